//! Which block of many to keep: the one whose blended result is nearest to the target.
//!
//! An encoder sees `s` alone and weighs all texels alike. But the blend has slope 0.1 here and 4 there, and texels
//! next to each other have different tiles under them, so of many blocks equally near to `s` one is much nearer to the
//! target than the others.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over lanes of known length are what compilers vectorise"
)]

mod bc1;
mod bc4;
mod bc5;
mod bc7;

use kinran_image::Format;

use super::code::{code_from_linear, linear_from_byte};
use super::map::MapKind;
use super::solve::{Blend, Operator, Over, Plain, Smooth};

/// Texels of a block.
const TEXELS: usize = 16;

/// Formats whose blocks are chosen by what they are blended to.
pub(crate) fn can_choose(format: Format, kind: MapKind) -> bool {
    matches!(
        (format, kind),
        (Format::Bc1 | Format::Bc7, MapKind::Color | MapKind::Data | MapKind::Aniso)
            | (Format::Bc4, MapKind::Data)
            | (Format::Bc5, MapKind::Normal)
    )
}

/// Formats whose blocks are made here from the start, without an encoder's to begin with.
pub(crate) fn makes_its_own(format: Format) -> bool {
    format == Format::Bc1
}

/// How a map is blended. Chosen for sixteen texels at a time, not for each block: code for every way would be thrice as
/// long.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Blending {
    Smooth,
    Plain,
    Over(f32),
}

/// How `s` is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stored {
    /// So that byte 128 is 1/2.
    Linear,
    /// The same, as sRGB code.
    Srgb,
    /// As it is: aniso texels.
    Plain,
}

impl Stored {
    /// What is stored for `s`, 0 to 1, and the derivative of `s` by it; the inverse of
    /// [`detail_from_texel`](kinran_shading::detail::detail_from_texel), through the sRGB curve where that is stored.
    #[inline(always)]
    fn texel(self, s: f32) -> (f32, f32) {
        let texel = (s * 254.0 + 1.0) * (1.0 / 255.0);
        match self {
            Stored::Plain => (s, 1.0),
            Stored::Linear => (texel, 255.0 / 254.0),
            Stored::Srgb => {
                let code = code_from_linear(texel);
                let slope = if texel <= 0.003_130_8 { 1.0 / 12.92 } else { 2.4 * texel / (code + 0.055) };
                (code, slope * (255.0 / 254.0))
            }
        }
    }

    /// The `s` that a stored byte stands for.
    #[inline(always)]
    fn value(self, byte: u8) -> f32 {
        let texel = match self {
            Stored::Srgb => linear_from_byte(byte),
            _ => f32::from(byte) * (1.0 / 255.0),
        };
        if self == Stored::Plain { texel } else { (texel * (255.0 / 254.0) - 1.0 / 254.0).max(0.0) }
    }
}

/// The blocks of a band of one level.
pub(crate) struct ChooseBand<'a> {
    /// Texels in a row.
    pub(crate) width: usize,
    /// Rows of the target's three planes, four for each row of blocks but the last.
    pub(crate) target: Vec<[&'a [f32]; 3]>,
    /// Rows of the detail that was solved against.
    pub(crate) detail: &'a [[Vec<f32>; 3]],
    pub(crate) kind: MapKind,
    pub(crate) blend: Blend,
    /// Opacity over aniso maps.
    pub(crate) alpha: f32,
    pub(crate) stored: Stored,
    pub(crate) format: Format,
    /// What an encoder made of `s`, unless the format [`makes_its_own`].
    pub(crate) blocks: &'a mut [u8],
}

impl pulp::WithSimd for ChooseBand<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let blend = match (self.kind, self.blend) {
            (MapKind::Normal, _) => return self.choose_normals(),
            (MapKind::Aniso, _) => Blending::Over(self.alpha),
            (_, Blend::Smooth) => Blending::Smooth,
            (_, Blend::Plain) => Blending::Plain,
        };
        self.choose(blend);
    }
}

impl ChooseBand<'_> {
    #[inline(always)]
    fn choose(self, blend: Blending) {
        let size = if self.format == Format::Bc7 { 16 } else { 8 };
        let columns = self.width.div_ceil(4);
        for i in 0..self.blocks.len() / size {
            let mut goal = self.goal(i % columns * 4, i / columns * 4);
            goal.solve(blend, self.stored);
            let block = &mut self.blocks[i * size..][..size];
            match (self.format, block.len()) {
                (Format::Bc4, 8) => bc4::choose(block, &goal, blend),
                (Format::Bc7, 16) => bc7::choose(block, &goal, self.stored, blend),
                _ => block.copy_from_slice(&bc1::choose(&goal, self.stored, blend)),
            }
        }
    }

    #[inline(always)]
    fn choose_normals(self) {
        let columns = self.width.div_ceil(4);
        for i in 0..self.blocks.len() / 16 {
            let goal = self.goal(i % columns * 4, i / columns * 4);
            bc5::choose(&mut self.blocks[i * 16..][..16], &goal);
        }
    }

    /// Target and detail of the block whose first texel is (`x0`, `y0`).
    #[inline(always)]
    fn goal(&self, x0: usize, y0: usize) -> BlockGoal {
        let mut goal = BlockGoal::zeros();
        let columns = 4.min(self.width - x0);
        for (y, (target, detail)) in self.target[y0..].iter().zip(&self.detail[y0..]).take(4).enumerate() {
            let row = 4 * y..4 * y + columns;
            goal.inside[row.clone()].fill(1.0);
            for channel in 0..3 {
                goal.t[channel][row.clone()].copy_from_slice(&target[channel][x0..x0 + columns]);
                goal.d[channel][row.clone()].copy_from_slice(&detail[channel][x0..x0 + columns]);
            }
        }
        for channel in 0..3 {
            for i in 0..TEXELS {
                goal.gain[channel][i] = code_gain(self.kind, goal.t[channel][i]) * goal.inside[i];
            }
        }
        goal
    }
}

/// What a block of `s` should achieve, texels row by row.
struct BlockGoal {
    /// The exact solution as it would be stored, 0 to 1.
    v: [[f32; TEXELS]; 3],
    /// Steps of 8 bits of the map's code, squared, for a small squared difference in what is stored.
    weight: [[f32; TEXELS]; 3],
    /// The detail.
    d: [[f32; TEXELS]; 3],
    /// The target.
    t: [[f32; TEXELS]; 3],
    /// Steps of 8 bits for a difference of one in the blended value; zero outside of the image.
    gain: [[f32; TEXELS]; 3],
    /// 1 in the image, 0 outside.
    inside: [f32; TEXELS],
}

impl BlockGoal {
    fn zeros() -> Self {
        let zeros = [[0.0; TEXELS]; 3];
        BlockGoal { v: zeros, weight: zeros, d: zeros, t: zeros, gain: zeros, inside: [0.0; TEXELS] }
    }

    /// Sets the exact solution and its weights.
    #[inline(always)]
    fn solve(&mut self, blend: Blending, stored: Stored) {
        match blend {
            Blending::Smooth => self.solve_by(Smooth, stored),
            Blending::Plain => self.solve_by(Plain, stored),
            Blending::Over(alpha) => self.solve_by(Over(alpha), stored),
        }
    }

    #[inline(always)]
    fn solve_by(&mut self, operator: impl Operator, stored: Stored) {
        for channel in 0..3 {
            for i in 0..TEXELS {
                let s = operator.inverse(self.t[channel][i], self.d[channel][i]);
                let (v, slope) = stored.texel(s);
                let step = operator.slope(s, self.d[channel][i]) * self.gain[channel][i] * slope;
                self.v[channel][i] = v;
                // A texel that hardly matters still has a place.
                self.weight[channel][i] = step * step + self.inside[i];
            }
        }
    }

    /// Squared differences to the target in one channel where texels have `s`.
    #[inline(always)]
    fn errors(&self, channel: usize, s: &[f32; TEXELS], blend: Blending) -> [f32; TEXELS] {
        let (d, t, gain) = (&self.d[channel], &self.t[channel], &self.gain[channel]);
        match blend {
            Blending::Smooth => errors_by(Smooth, s, d, t, gain),
            Blending::Plain => errors_by(Plain, s, d, t, gain),
            Blending::Over(alpha) => errors_by(Over(alpha), s, d, t, gain),
        }
    }

    /// Two colours on either end of the line along which the solution lies, as far as it reaches.
    #[inline(always)]
    fn line(&self) -> [[f32; 3]; 2] {
        let (mut total, mut scale) = ([0.0; 3], [0.0; 3]);
        for channel in 0..3 {
            total[channel] = sum(&self.weight[channel]);
            scale[channel] = total[channel].max(1e-20).sqrt();
        }
        let mut texel_weight = [0.0; TEXELS];
        for channel in 0..3 {
            for i in 0..TEXELS {
                texel_weight[i] += self.weight[channel][i];
            }
        }
        // Deviations from the mean, in units in which all channels count alike.
        let mut p = [[0.0; TEXELS]; 3];
        let mut mean = [0.0; 3];
        for channel in 0..3 {
            let mut weighted = [0.0; TEXELS];
            for i in 0..TEXELS {
                weighted[i] = self.weight[channel][i] * self.v[channel][i];
            }
            mean[channel] = sum(&weighted) / total[channel].max(1e-20);
            for i in 0..TEXELS {
                p[channel][i] = (self.v[channel][i] - mean[channel]) * scale[channel] * self.inside[i];
            }
        }
        let mut weighted = p;
        for channel in 0..3 {
            for i in 0..TEXELS {
                weighted[channel][i] *= texel_weight[i];
            }
        }
        let (xx, yy, zz) = (dot(&p[0], &weighted[0]), dot(&p[1], &weighted[1]), dot(&p[2], &weighted[2]));
        let (xy, xz, yz) = (dot(&p[0], &weighted[1]), dot(&p[0], &weighted[2]), dot(&p[1], &weighted[2]));
        // The power method, from the column of the largest variance.
        let mut axis = if xx >= yy && xx >= zz {
            [xx, xy, xz]
        } else if yy >= zz {
            [xy, yy, yz]
        } else {
            [xz, yz, zz]
        };
        for _ in 0..4 {
            let [x, y, z] = axis;
            axis = [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z];
            let largest = axis.iter().fold(1e-20_f32, |m, a| m.max(a.abs()));
            axis = axis.map(|a| a / largest);
        }
        let length = (axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]).max(1e-20);
        let (mut low, mut high) = (0.0_f32, 0.0_f32);
        for i in 0..TEXELS {
            let along = (p[0][i] * axis[0] + p[1][i] * axis[1] + p[2][i] * axis[2]) / length;
            (low, high) = (low.min(along), high.max(along));
        }
        let at = |along: f32| std::array::from_fn(|c| (mean[c] + along * axis[c] / scale[c]).clamp(0.0, 1.0));
        [at(high), at(low)]
    }
}

#[inline(always)]
fn errors_by(
    operator: impl Operator,
    s: &[f32; TEXELS],
    d: &[f32; TEXELS],
    t: &[f32; TEXELS],
    gain: &[f32; TEXELS],
) -> [f32; TEXELS] {
    let mut errors = [0.0; TEXELS];
    for i in 0..TEXELS {
        let difference = (operator.blend(s[i], d[i]) - t[i]) * gain[i];
        errors[i] = difference * difference;
    }
    errors
}

/// Steps of 8 bits of the map's code for a small difference at the target `t`: for colour the slope of the sRGB curve,
/// from a fit of roots to it, `0.585122381 t^(1/2) + 0.783140355 t^(1/4) - 0.368262736 t^(1/8)`, which runs in lanes; its
/// slope is within 1.5 % of the curve's. It is a weight, and errors are measured by the curve itself.
#[inline(always)]
fn code_gain(kind: MapKind, t: f32) -> f32 {
    let t = t.max(0.003_130_8);
    let root = t.sqrt();
    let fourth = root.sqrt();
    let eighth = fourth.sqrt();
    let slope = (0.292_561_2 * root + 0.195_785_09 * fourth - 0.046_032_842 * eighth) / t;
    255.0 * if kind == MapKind::Color { slope } else { 1.0 }
}

/// The two ends whose mixtures, by the shares of the first, are nearest to `v`. Where all shares are alike or nothing has
/// a weight, both are the mean.
#[inline(always)]
fn least_squares(shares: &[f32; TEXELS], v: &[f32; TEXELS], w: &[f32; TEXELS]) -> (f32, f32) {
    let (mut aa, mut ab, mut bb) = ([0.0; TEXELS], [0.0; TEXELS], [0.0; TEXELS]);
    let (mut va, mut vb) = ([0.0; TEXELS], [0.0; TEXELS]);
    for i in 0..TEXELS {
        let (a, b) = (shares[i], 1.0 - shares[i]);
        aa[i] = w[i] * a * a;
        ab[i] = w[i] * a * b;
        bb[i] = w[i] * b * b;
        va[i] = w[i] * a * v[i];
        vb[i] = w[i] * b * v[i];
    }
    let (aa, ab, bb, va, vb) = (sum(&aa), sum(&ab), sum(&bb), sum(&va), sum(&vb));
    let determinant = aa * bb - ab * ab;
    if determinant > 1e-4 * (aa + bb) * (aa + bb) {
        ((va * bb - vb * ab) / determinant, (vb * aa - va * ab) / determinant)
    } else {
        let mean = (va + vb) / (aa + 2.0 * ab + bb).max(1e-20);
        (mean, mean)
    }
}

/// The lower of two arrays, texel by texel.
#[inline(always)]
fn lower(a: &[f32; TEXELS], b: &[f32; TEXELS]) -> [f32; TEXELS] {
    let mut lower = [0.0; TEXELS];
    for i in 0..TEXELS {
        lower[i] = if a[i] < b[i] { a[i] } else { b[i] };
    }
    lower
}

#[inline(always)]
fn dot(a: &[f32; TEXELS], b: &[f32; TEXELS]) -> f32 {
    let mut products = [0.0; TEXELS];
    for i in 0..TEXELS {
        products[i] = a[i] * b[i];
    }
    sum(&products)
}

/// A sum in a fixed order that runs in lanes.
#[inline(always)]
fn sum(values: &[f32; TEXELS]) -> f32 {
    let mut lanes = [0.0; 8];
    for i in 0..8 {
        lanes[i] = values[i] + values[i + 8];
    }
    for half in [4, 2, 1] {
        for i in 0..half {
            lanes[i] += lanes[i + half];
        }
    }
    lanes[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_the_slope_of_the_srgb_curve() {
        for i in 0..=1000 {
            let t = 0.003_130_8 + i as f32 * 0.000_996;
            let want = 255.0 * 1.055 / 2.4 * t.powf(1.0 / 2.4 - 1.0);
            let got = code_gain(MapKind::Color, t);
            assert!((got / want - 1.0).abs() < 0.015, "at {t}: wanted {want}, got {got}");
        }
    }
}
