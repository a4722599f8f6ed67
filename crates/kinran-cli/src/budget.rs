//! What the error of a filter's picture is made of.
//!
//! Between ground truth and the picture lie others that lose one thing after the other:
//!
//! ```text
//! ground truth      every texel shaded by itself, averaged over the pixel
//!   sampling kernel      ... averaged by the sampler's own kernel, wider than a pixel: TextureFiltering::Texels
//!   colour apart         ... base colour and metalness are those of the mips, lobes still every texel's own, each counting as
//!                        much as the filter lets it count
//!   lobe                 ... one lobe in their place, the filter's, in floats
//!   compression          ... in blocks: the filter's picture
//!   noise                what samples add to its error
//! ```
//!
//! The share of each is what the mean squared error grows by; noise is taken off all of them as `ranking.rs` has it. Shares
//! add up to one, and one may be negative: a loss that takes back a part of what was lost before.

use schemars::JsonSchema;
use serde::Serialize;

/// Shares of a squared error, of one in all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Shares {
    /// The sampler's kernel is wider than a pixel.
    pub sampling_kernel: f64,
    /// Colour and metalness are averaged apart from the lobe.
    pub colour_apart: f64,
    /// One lobe stands for many.
    pub lobe: f64,
    /// Normals and lobes are compressed in blocks.
    pub compression: f64,
    /// The pictures' random samples.
    pub noise: f64,
}

impl Shares {
    /// From mean squared errors: of the pictures that lose one thing after the other, all without noise, the filter's own last;
    /// and of that one with its noise. None of what is no error.
    pub(crate) fn new([kernel, colour, float, blocks]: [f64; 4], noisy: f64) -> Self {
        let share = |square: f64| if noisy > 0.0 { square / noisy } else { 0.0 };
        Shares {
            sampling_kernel: share(kernel),
            colour_apart: share(colour - kernel),
            lobe: share(float - colour),
            compression: share(blocks - float),
            noise: share(noisy - blocks),
        }
    }

    /// In words, the largest first; without those that are no percent.
    fn words(&self) -> String {
        let mut named = [
            (self.sampling_kernel, "sampling kernel"),
            (self.colour_apart, "colour apart"),
            (self.lobe, "lobe"),
            (self.compression, "compression"),
            (self.noise, "noise"),
        ];
        named.sort_by(|a, b| b.0.total_cmp(&a.0));
        let told = named.into_iter().filter(|(share, _)| share.abs() >= 0.01);
        told.map(|(share, name)| format!("{name} {:.0} %", 100.0 * share)).collect::<Vec<_>>().join(", ")
    }
}

/// What the error of a filter at one distance is made of.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Budget {
    /// Factor of distance.
    pub distance: f32,
    /// Of the squared error of display-encoded values.
    pub rmse: Shares,
    /// Of the squared error in linear light.
    pub l2: Shares,
    /// Both in a sentence, the largest first.
    pub says: String,
}

impl Budget {
    pub(crate) fn new(filter: &str, distance: f32, rmse: Shares, l2: Shares) -> Self {
        let (rmse_words, l2_words) = (rmse.words(), l2.words());
        let says = format!("{filter} x{distance}, its squared error: RMSE {rmse_words}; L2 {l2_words}.");
        Budget { distance, rmse, l2, says }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_leave_something_out_or_hide_the_largest() {
        let shares = Shares::new([0.01, 0.05, 0.03, 0.035], 0.04);
        let all =
            [shares.sampling_kernel, shares.colour_apart, shares.lobe, shares.compression, shares.noise];
        for (got, wanted) in all.into_iter().zip([0.25, 1.0, -0.5, 0.125, 0.125]) {
            assert!((got - wanted).abs() < 1e-12, "wanted {wanted}, got {got}: {shares:?}");
        }
        let says = Budget::new("ml", 2.0, shares, shares).says;
        assert!(says.contains("RMSE colour apart 100 %, sampling kernel 25 %"), "{says}");
        let none = Shares::new([0.0; 4], 0.0);
        assert_eq!(none.lobe, 0.0, "pictures that are equal: {none:?}");
    }
}
