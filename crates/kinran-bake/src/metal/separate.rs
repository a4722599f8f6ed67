//! Base colour b, metalness m and F0 of what is not metal, φ, nearest to what a footprint scatters and reflects.
//!
//! A pair of b and m has four numbers for six that a person sees: red, green and blue of what scatters and of what reflects. With
//! a φ for each texel, as `KHR_materials_specular` has it, there are seven. What is not metal scatters what it does not reflect,
//! by the largest channel of φ, so that with the means d of `b (1 - m)` and f of F0 over the footprint
//!
//! ```text
//! min  Σ ((b (1-m) (1 - max φ) - (1 - max φ₀) d)² + (b m + φ (1-m) - f)² + ε (φ - φ₀)²) + δ (m - μ)²,
//!      0 ≤ b, m ≤ what factors allow, 0 ≤ φ ≤ 1, sums over red, green and blue,
//! ```
//!
//! φ₀ being that of the finest level and μ the mean metalness. Many triples are nearly right. Samplers blend texels and levels
//! number by number, and what is blended shows other colours than its parts do unless they say them alike: so that one is taken
//! whose φ is near to φ₀ and whose m is near to μ, which blends are exact for.
//!
//! For given m and max φ that is two linear equations for each channel. With `s = 1 - m`, `a = s (1 - max φ)` and D for
//! `(1 - max φ₀) d`,
//!
//! ```text
//! φ = (a s (a f - m D) + ε φ₀ (a² + m²)) / (a² s² + ε (a² + m²)),     b = (a D + m f - m s φ) / (a² + m²).
//! ```
//!
//! max φ is put in from the solution before, and m is searched for as that of a pair.

use super::pair::{Limits, Means, search};

/// A texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Separate {
    /// Base colour.
    pub(super) base: [f32; 3],
    /// F0 of what is not metal.
    pub(super) specular: [f32; 3],
    /// Metalness.
    pub(super) metallic: f32,
}

/// ε. Chosen by what a trilinear sampler shows between levels 0 and 3 of rusty steel (`acg_metal053c`) and of painted chips, rust
/// and weave: with a tenth of it and without δ F0 is up to five times as far off there.
const NEAR: f32 = 1e-3;

/// δ, chosen likewise.
const NEAR_MEAN: f32 = 0.03;

/// How often max φ is put in: over footprints as those of the tests two times leave 1.23, three 1.09, four 1.04 of the least sum.
const ROUNDS: usize = 3;

/// The texel nearest to what a footprint scatters and reflects. `dielectric` is F0 of what is not metal in the footprint.
pub(super) fn separate(means: &Means, dielectric: [f32; 3], limits: Limits) -> Separate {
    if let Some(base) = means.exact() {
        return Separate { base, specular: dielectric, metallic: means.metallic };
    }
    let largest = |f0: [f32; 3]| f0.into_iter().fold(0.0, f32::max);
    let (f, inside) = (means.reflected(dielectric), 1.0 - largest(dielectric));
    let d = means.scattered.map(|d| d * inside);
    let ((base, specular), metallic) = search(means.metallic, limits.metallic, |m| {
        let s = 1.0 - m;
        let (mut base, mut specular) = ([0.0; 3], dielectric);
        for _ in 0..ROUNDS {
            let a = s * (1.0 - largest(specular));
            let square = a * a + m * m;
            for c in 0..3 {
                let own = s * f[c] + NEAR * dielectric[c];
                if square == 0.0 {
                    // All of it reflects.
                    specular[c] = (own / (1.0 + NEAR)).clamp(0.0, 1.0);
                    continue;
                }
                let free = a * s * (a * f[c] - m * d[c]) + NEAR * dielectric[c] * square;
                let free = free / (a * a * s * s + NEAR * square);
                // What is out of its range is brought to its end, and the other one follows.
                let sum = a * d[c] + m * f[c];
                base[c] = ((sum - m * s * free.clamp(0.0, 1.0)) / square).clamp(0.0, limits.base[c]);
                specular[c] = ((own - m * s * base[c]) / (s * s + NEAR)).clamp(0.0, 1.0);
            }
        }
        let a = s * (1.0 - largest(specular));
        let term = |c: usize| {
            let scattered = base[c] * a - d[c];
            let reflected = base[c] * m + specular[c] * s - f[c];
            let away = specular[c] - dielectric[c];
            scattered * scattered + reflected * reflected + NEAR * away * away
        };
        let away = m - means.metallic;
        ((base, specular), (0..3).map(term).sum::<f32>() + NEAR_MEAN * away * away)
    });
    Separate { base, specular, metallic }
}

#[cfg(test)]
mod tests {
    use super::super::pair::pair;
    use super::*;

    /// Uniform in [0, 1).
    fn uniform(state: &mut u32) -> f32 {
        *state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        (*state >> 8) as f32 / 16_777_216.0
    }

    const ALL: Limits = Limits { base: [1.0; 3], metallic: 1.0 };

    /// Errors of what scatters and of what reflects, the largest of three channels each.
    fn off(means: &Means, texel: &Separate) -> [f64; 2] {
        let of = |x: f32| f64::from(x);
        let m = of(texel.metallic);
        let most = texel.specular.into_iter().map(of).fold(0.0, f64::max);
        let (mut scattered, mut reflected) = (0.0_f64, 0.0_f64);
        for c in 0..3 {
            let (b, p) = (of(texel.base[c]), of(texel.specular[c]));
            let wanted = of(means.of_metal[c]) + 0.04 * (1.0 - of(means.metallic));
            scattered = scattered.max((b * (1.0 - m) * (1.0 - most) - 0.96 * of(means.scattered[c])).abs());
            reflected = reflected.max((b * m + p * (1.0 - m) - wanted).abs());
        }
        [scattered, reflected]
    }

    /// Two to four materials, dark ones among them.
    fn footprint(state: &mut u32, count: usize) -> Means {
        let mut means = Means { scattered: [0.0; 3], of_metal: [0.0; 3], metallic: 0.0 };
        for _ in 0..count {
            let dark = if uniform(state) < 0.4 { 0.05 } else { 1.0 };
            let m = match uniform(state) {
                v if v < 0.4 => 0.0,
                v if v < 0.8 => 1.0,
                _ => uniform(state),
            };
            means.metallic += m / count as f32;
            for c in 0..3 {
                let b = dark * uniform(state);
                means.scattered[c] += b * (1.0 - m) / count as f32;
                means.of_metal[c] += b * m / count as f32;
            }
        }
        means
    }

    /// Both colours are off by less than a third of what the best pair of base colour and metalness is off by.
    #[test]
    fn a_mixed_footprint_scatters_or_reflects_something_else() {
        let mut state = 21;
        let (mut most, mut sum, mut of_pairs) = ([0.0_f64; 2], [0.0_f64; 2], [0.0_f64; 2]);
        for i in 0..3000 {
            let means = footprint(&mut state, 2 + i % 3);
            let texel = separate(&means, [0.04; 3], ALL);
            let (base, metallic) = pair(&means, [0.04; 3], ALL);
            let of_pair = off(&means, &Separate { base, specular: [0.04; 3], metallic });
            for (k, e) in off(&means, &texel).into_iter().enumerate() {
                most[k] = most[k].max(e);
                sum[k] += e / 3000.0;
                of_pairs[k] += of_pair[k] / 3000.0;
            }
            let unit = |v: f32| (0.0..=1.0).contains(&v);
            assert!(
                texel.base.into_iter().chain(texel.specular).chain([texel.metallic]).all(unit),
                "{texel:?}"
            );
        }
        assert!(most.iter().all(|e| *e < 0.12), "largest errors, scattered and reflected: {most:?}");
        for k in 0..2 {
            assert!(sum[k] < 0.3 * of_pairs[k], "mean error {}: {}, of pairs {}", k, sum[k], of_pairs[k]);
        }
    }

    /// What one texel says stays, and so does what averages say right.
    #[test]
    fn a_footprint_of_one_material_becomes_another() {
        let mut state = 11;
        for i in 0..2000 {
            let m = [0.0, 1.0, uniform(&mut state)][i % 3];
            let b: [f32; 3] = std::array::from_fn(|_| uniform(&mut state));
            let means = Means { scattered: b.map(|b| b - b * m), of_metal: b.map(|b| b * m), metallic: m };
            let got = separate(&means, [0.04; 3], ALL);
            let off = (0..3).map(|c| (got.base[c] - b[c]).abs()).fold((got.metallic - m).abs(), f32::max);
            assert!(off < 1e-6 && got.specular == [0.04; 3], "wanted {b:?}, {m}, got {got:?}");
        }
    }

    /// Black, white mirrors beside white chalk, one in two texels each, factors of zero: numbers in their ranges, and no NaN.
    #[test]
    fn an_extreme_footprint_becomes_no_texel() {
        let half = |chalk: f32, mirror: f32, Limits { base, metallic }| Means {
            scattered: base.map(|most| 0.5 * most * (chalk + mirror * (1.0 - metallic))),
            of_metal: base.map(|most| 0.5 * most * mirror * metallic),
            metallic: 0.5 * metallic,
        };
        for (chalk, mirror) in [(1.0, 1.0), (0.0, 1.0), (1.0, 0.0), (0.0, 0.0)] {
            for limits in [
                ALL,
                Limits { base: [0.0; 3], metallic: 1.0 },
                Limits { base: [1.0, 0.0, 0.5], metallic: 0.5 },
                Limits { base: [1.0; 3], metallic: 0.0 },
            ] {
                let texel = separate(&half(chalk, mirror, limits), [0.04; 3], limits);
                let within = |v: f32, most: f32| (0.0..=most).contains(&v);
                assert!(within(texel.metallic, limits.metallic), "{texel:?}");
                for c in 0..3 {
                    assert!(
                        within(texel.base[c], limits.base[c]) && within(texel.specular[c], 1.0),
                        "{texel:?}"
                    );
                }
            }
        }
    }
}
