//! Which of several noisy pictures is nearest to a noisy ground truth, and whether noise allows to say so.
//!
//! Pictures are means of random samples, so that a filter without any error is off too, and of two filters one is always a
//! little nearer by chance. Every picture, ground truth too, is therefore drawn in two halves a and b of independent samples.
//! Let q be the error of one filter less that of another, at a pixel, against the truth of the same half.
//!
//! **The difference.** Where the error is the squared difference x² = (F - T)², a picture of n samples adds the noise's
//! variance to its mean, v/n, and a half adds twice as much. So
//!
//! ```text
//! D = 2 mean(q of all samples) - (mean(q of a) + mean(q of b)) / 2
//! ```
//!
//! has no noise in its mean (it is the delete-half jackknife, and equals the mean of x_a x_b of one filter less that of the
//! other, products of independent factors).
//!
//! **Its standard error.** With s = F - G and t = F + G - 2T, q is s t. Let s, t be the means of both halves and u, w half of
//! their differences: D at a pixel is s t - u w, and half of q_a - q_b is t u + s w. Both halves have the same distribution, so
//! u is distributed as the error of s, and w as that of t; for normal noise (t u + s w)² then has the variance of D as its mean,
//! the terms of second order too. Random numbers of pixels are independent, so these squares add up. FLIP looks at a
//! neighbourhood, so sums of blocks take the place of pixels.
//!
//! **What bends.** FLIP raises differences to the power 0.7, so that noise alone falls with n^-0.35 and not with 1/n: of what
//! halving the samples adds, 1 / (2^0.35 - 1) times as much is still in the picture of all samples, and D has taken it off
//! once. What remains, 2.65 of it at most, counts as doubt ([`FLIP_BEND`]).
//!
//! A filter is nearest when it is nearer than every other by more than the doubt: [`ERRORS`] standard errors and what bends.

/// Standard errors that a difference must exceed. Five, for few blocks give a rough standard error, and blocks that are
/// neighbours share a little of FLIP's noise: a third less would still be one mark of noise in a thousand.
const ERRORS: f64 = 5.0;

/// See the head of this file: 1 / (2^0.35 - 1) - 1, rounded up.
pub(crate) const FLIP_BEND: f64 = 2.7;

/// Side of a block in pixels, several times as wide as FLIP's widest filter (a deviation of 3 pixels).
const BLOCK: usize = 16;

/// Fewer blocks than this give no standard error worth the name; smaller pictures have blocks of half the side.
const FEWEST: usize = 16;

/// The errors of a picture.
pub(crate) struct Errors {
    /// Sums over blocks of each half's picture.
    blocks: [Vec<f64>; 2],
    /// Mean over the pixels of the picture of all samples.
    mean: f64,
    pixels: f64,
}

impl Errors {
    /// From the errors of each pixel of pictures `width` wide: of both halves, and of all samples.
    pub(crate) fn new(width: usize, halves: [&[f32]; 2], whole: &[f32]) -> Self {
        let height = whole.len() / width;
        let blocks_of = |side: usize| width.div_ceil(side) * height.div_ceil(side);
        let side = if blocks_of(BLOCK) < FEWEST { BLOCK / 2 } else { BLOCK };
        let blocks = halves.map(|errors| {
            let mut sums = vec![0.0; blocks_of(side)];
            for (i, &error) in errors.iter().enumerate() {
                sums[i / width / side * width.div_ceil(side) + i % width / side] += f64::from(error);
            }
            sums
        });
        let pixels = whole.len() as f64;
        Errors { blocks, mean: whole.iter().map(|&e| f64::from(e)).sum::<f64>() / pixels, pixels }
    }

    /// The mean error of the picture of all samples.
    pub(crate) fn mean(&self) -> f64 {
        self.mean
    }

    /// The mean error, noise's share taken off.
    pub(crate) fn quiet_mean(&self) -> f64 {
        2.0 * self.mean - self.half_mean()
    }

    fn half_mean(&self) -> f64 {
        self.blocks.iter().flatten().sum::<f64>() / (2.0 * self.pixels)
    }

    /// By how much its error is larger than another's, noise taken off, and the doubt about that.
    fn beyond(&self, other: &Errors, bend: f64) -> (f64, f64) {
        let [a, b] = &self.blocks;
        let [other_a, other_b] = &other.blocks;
        let squares = a.iter().zip(b).zip(other_a.iter().zip(other_b));
        let variance: f64 = squares.map(|((a, b), (c, d))| (0.5 * ((a - c) - (b - d))).powi(2)).sum();
        let added = (self.half_mean() - other.half_mean()) - (self.mean - other.mean);
        let doubt = ERRORS * variance.sqrt() / self.pixels + bend * added.abs();
        (self.quiet_mean() - other.quiet_mean(), doubt)
    }

    /// Whether noise alone explains the errors, which are squares.
    pub(crate) fn is_noise(&self) -> bool {
        let none = Errors { blocks: self.blocks.clone().map(|b| vec![0.0; b.len()]), ..*self };
        let (error, doubt) = self.beyond(&Errors { mean: 0.0, ..none }, 0.0);
        error <= doubt
    }
}

/// What can be said of several errors.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Order {
    /// The nearest, noise taken off.
    pub(crate) first: usize,
    /// Those that noise does not allow to tell from it, in their order.
    pub(crate) alike: Vec<usize>,
    /// The least difference from the first that would have been told, in the errors' unit.
    pub(crate) told: f64,
    /// How many times as many samples would tell all that are alike from the first; infinite where they seem the same. Noise
    /// falls with the root of the samples.
    pub(crate) samples: f64,
}

/// The order of errors, of which there is at least one.
pub(crate) fn order(errors: &[&Errors], bend: f64) -> Order {
    let quiet: Vec<f64> = errors.iter().map(|e| e.quiet_mean()).collect();
    let first = (0..errors.len()).min_by(|&a, &b| quiet[a].total_cmp(&quiet[b])).expect("there is an error");
    let mut order = Order { first, alike: Vec::new(), told: 0.0, samples: 1.0 };
    for (i, error) in errors.iter().enumerate().filter(|&(i, _)| i != first) {
        let (difference, doubt) = error.beyond(errors[first], bend);
        order.told = order.told.max(doubt);
        if difference <= doubt {
            order.alike.push(i);
            let times = if difference > 0.0 { (doubt / difference).powi(2) } else { f64::INFINITY };
            order.samples = order.samples.max(times);
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 96;

    fn order(errors: &[Errors], bend: f64) -> Order {
        super::order(&errors.iter().collect::<Vec<_>>(), bend)
    }

    /// Normal noise, the sum of twelve uniform numbers of a linear congruential generator (Knuth's MMIX).
    struct Noise(u64);

    impl Noise {
        fn next(&mut self) -> f64 {
            let uniform = |state: &mut u64| {
                *state =
                    state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (*state >> 11) as f64 / (1u64 << 53) as f64
            };
            (0..12).map(|_| uniform(&mut self.0)).sum::<f64>() - 6.0
        }
    }

    /// Squared errors of pictures that are off by `offs`, each with noise of its own of deviation `noise` in a half, against
    /// one truth with noise of deviation `truth`.
    fn squares(seed: u64, offs: &[f64], noise: &[f64], truth: f64) -> Vec<Errors> {
        let mut random = Noise(seed);
        let mut picture = |deviation: f64| -> [Vec<f64>; 2] {
            [(); 2].map(|()| (0..SIDE * SIDE).map(|_| deviation * random.next()).collect())
        };
        let truths = picture(truth);
        let of = |(&off, &noise): (&f64, &f64)| {
            let filter = picture(noise);
            let apart =
                |half: usize, i: usize| off * (i as f64 * 0.1).sin() + filter[half][i] - truths[half][i];
            let half = |half| (0..SIDE * SIDE).map(|i| apart(half, i).powi(2) as f32).collect::<Vec<_>>();
            let whole: Vec<f32> =
                (0..SIDE * SIDE).map(|i| (0.5 * (apart(0, i) + apart(1, i))).powi(2) as f32).collect();
            Errors::new(SIDE, [&half(0), &half(1)], &whole)
        };
        offs.iter().zip(noise).map(of).collect()
    }

    #[test]
    fn noise_is_never_marked_though_one_picture_is_noisier() {
        for seed in 0..200 {
            let errors = squares(seed, &[0.02, 0.02, 0.02], &[0.02, 0.02, 0.03], 0.05);
            let said = order(&errors, 0.0);
            assert_eq!(said.alike.len(), 2, "seed {seed}: {said:?}");
            // The third, noisier one would lose by 2.5e-4 if noise were an error.
            let noisier = errors[2].mean - errors[0].mean;
            assert!(noisier > said.told, "seed {seed}: noise of {noisier} is no test at {said:?}");
        }
    }

    #[test]
    fn identical_pictures_are_alike_and_no_samples_would_tell_them_apart() {
        let mut errors = squares(7, &[0.1, 0.1], &[0.0, 0.0], 0.05);
        let said = order(&errors, FLIP_BEND);
        assert_eq!((said.alike.len(), said.told, said.samples), (1, 0.0, f64::INFINITY), "{said:?}");
        errors.truncate(1);
        assert!(order(&errors, 0.0).alike.is_empty());
    }

    #[test]
    fn a_clearly_better_picture_is_marked_and_its_lead_is_that_of_the_closed_form() {
        for seed in 0..50 {
            let errors = squares(seed, &[0.1, 0.05, 0.1], &[0.02, 0.03, 0.02], 0.05);
            let said = order(&errors, 0.0);
            assert_eq!((said.first, said.alike.len()), (1, 0), "seed {seed}: {said:?}");
            // The mean of sin² is a half.
            let (lead, doubt) = errors[0].beyond(&errors[1], 0.0);
            let wanted = 0.5 * (0.1f64.powi(2) - 0.05f64.powi(2));
            assert!((lead - wanted).abs() < doubt, "seed {seed}: wanted {wanted}, got {lead} ± {doubt}");
            assert!(doubt < 0.1 * wanted, "seed {seed}: a doubt of {doubt}");
        }
    }

    #[test]
    fn the_standard_error_is_that_of_many_trials() {
        let trials: Vec<(f64, f64)> = (0..400)
            .map(|seed| {
                let errors = squares(1000 + seed, &[0.05, 0.04], &[0.02, 0.03], 0.05);
                errors[0].beyond(&errors[1], 0.0)
            })
            .collect();
        let mean = trials.iter().map(|t| t.0).sum::<f64>() / 400.0;
        let deviation = (trials.iter().map(|t| (t.0 - mean).powi(2)).sum::<f64>() / 399.0).sqrt();
        let said = trials.iter().map(|t| t.1 / ERRORS).sum::<f64>() / 400.0;
        // A deviation of 400 trials is known to 1 in 28.
        assert!((said / deviation - 1.0).abs() < 0.12, "deviation {deviation}, said {said}");
    }

    #[test]
    fn a_picture_without_error_is_noise_and_one_with_error_is_not() {
        for seed in 0..50 {
            let errors = squares(seed, &[0.0, 0.05], &[0.02, 0.02], 0.05);
            assert!(errors[0].is_noise() && !errors[1].is_noise(), "seed {seed}");
        }
    }

    /// What was alike is told apart with as many times more samples as were asked for, give or take the noise of the estimate.
    #[test]
    fn the_samples_asked_for_tell_pictures_apart() {
        let few = order(&squares(3, &[0.025, 0.02], &[0.05; 2], 0.05), 0.0);
        assert!(few.alike.len() == 1 && few.samples < 100.0, "{few:?}");
        let less = 0.05 / few.samples.sqrt();
        let many = order(&squares(4, &[0.025, 0.02], &[less; 2], less), 0.0);
        assert!(many.first == 1 && many.samples < 2.0, "{few:?}, then {many:?}");
    }
}
