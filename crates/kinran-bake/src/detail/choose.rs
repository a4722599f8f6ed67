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
use kinran_image::srgb::{code_from_linear, linear_from_byte};
use pulp::Simd;

use super::map::MapKind;
use super::operator::{Blend, Operator, Over, Plain, RUN, Smooth, run_of};

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

/// What one `s` makes of any detail `d`: `slope d + offset`. Given `s`, every blend here is straight in `d`, but the
/// smooth overlay has other numbers below d = 1/2 than above. So a value of a block is worked out once, and each of
/// sixteen texels costs a multiplication.
#[derive(Clone, Copy, Default)]
struct Line {
    /// Slope and offset below d = 1/2.
    dark: [f32; 2],
    /// From there on.
    bright: [f32; 2],
}

impl Blending {
    #[inline(always)]
    fn line(self, s: f32) -> Line {
        let x = 2.0 * s - 1.0;
        let bright = if s < 0.5 { [2.0 * s, 0.0] } else { [2.0 * (1.0 - s), x] };
        match self {
            Blending::Smooth if s >= 0.5 => Line { dark: [2.0 * s * (1.0 - x * x), s * x * x], bright },
            Blending::Smooth | Blending::Plain => Line { dark: bright, bright },
            Blending::Over(alpha) => {
                Line { dark: [alpha, s * (1.0 - alpha)], bright: [alpha, s * (1.0 - alpha)] }
            }
        }
    }
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
    fn with_simd<S: Simd>(self, simd: S) {
        match (self.kind, self.blend) {
            (MapKind::Normal, _) => self.choose_normals(simd),
            (MapKind::Aniso, _) => {
                let alpha = self.alpha;
                self.choose(simd, Over(alpha), Blending::Over(alpha));
            }
            (_, Blend::Smooth) => self.choose(simd, Smooth, Blending::Smooth),
            (_, Blend::Plain) => self.choose(simd, Plain, Blending::Plain),
        }
    }
}

/// One row of what blocks should achieve, up to whole blocks; in the order of [`BlockGoal`]'s fields.
type GoalRow = [[Vec<f32>; 3]; 5];

impl ChooseBand<'_> {
    #[inline(always)]
    fn choose<S: Simd>(self, simd: S, operator: impl Operator, blend: Blending) {
        let size = if self.format == Format::Bc7 { 16 } else { 8 };
        let columns = self.width.div_ceil(4);
        debug_assert!(self.target.iter().flatten().all(|plane| plane.len() == self.width), "whole rows");
        debug_assert_eq!(self.detail.len(), self.target.len(), "a detail for each row");
        debug_assert_eq!(self.blocks.len(), columns * size * self.target.len().div_ceil(4), "whole blocks");
        let mut lines = [Line::default(); 256];
        for (byte, line) in (0..=255).zip(&mut lines) {
            *line = blend.line(self.stored.value(byte));
        }
        let thirds = bc1::Thirds::new(&lines);
        let zeros = || std::array::from_fn(|_| std::array::from_fn(|_| vec![0.0; columns * 4]));
        let mut rows: [GoalRow; 4] = std::array::from_fn(|_| zeros());
        for (blocks, y0) in self.blocks.chunks_exact_mut(columns * size).zip((0..).step_by(4)) {
            for (i, row) in rows.iter_mut().enumerate() {
                match self.target.get(y0 + i) {
                    Some(target) => goal_row(
                        target,
                        &self.detail[y0 + i],
                        (self.kind, self.stored),
                        operator,
                        columns * 4,
                        row,
                    ),
                    // Below the image there is nothing to be achieved.
                    None => row.iter_mut().flatten().for_each(|plane| plane.fill(0.0)),
                }
            }
            for (column, block) in blocks.chunks_exact_mut(size).enumerate() {
                let goal = BlockGoal::of_rows(&rows, column);
                match self.format {
                    Format::Bc4 => bc4::choose(simd, block, &goal, blend),
                    Format::Bc7 => bc7::choose(simd, block, &goal, &lines),
                    _ => block.copy_from_slice(&bc1::choose(simd, &goal, &thirds)),
                }
            }
        }
    }

    #[inline(always)]
    fn choose_normals<S: Simd>(self, simd: S) {
        let columns = self.width.div_ceil(4);
        for i in 0..self.blocks.len() / 16 {
            let goal = self.normals(i % columns * 4, i / columns * 4);
            bc5::choose(simd, &mut self.blocks[i * 16..][..16], &goal);
        }
    }

    /// Target, detail and which texels there are, of the block whose first texel is (`x0`, `y0`).
    #[inline(always)]
    fn normals(&self, x0: usize, y0: usize) -> BlockGoal {
        let mut goal = BlockGoal::zeros();
        let columns = 4.min(self.width - x0);
        for (y, (target, detail)) in self.target[y0..].iter().zip(&self.detail[y0..]).take(4).enumerate() {
            let row = 4 * y..4 * y + columns;
            for channel in 0..3 {
                goal.gain[channel][row.clone()].fill(1.0);
                goal.t[channel][row.clone()].copy_from_slice(&target[channel][x0..x0 + columns]);
                goal.d[channel][row.clone()].copy_from_slice(&detail[channel][x0..x0 + columns]);
            }
        }
        goal
    }
}

/// Sets a row of goals, `padded` texels of it.
#[inline(always)]
fn goal_row(
    target: &[&[f32]; 3],
    detail: &[Vec<f32>; 3],
    (kind, stored): (MapKind, Stored),
    operator: impl Operator,
    padded: usize,
    row: &mut GoalRow,
) {
    row.iter_mut().flatten().for_each(|plane| {
        plane.clear();
        plane.resize(padded, 0.0);
    });
    let width = target[0].len();
    for c in 0..3 {
        for x0 in (0..width).step_by(RUN) {
            let (t, d) = (run_of(target[c], x0), run_of(&detail[c], x0));
            let mut v = operator.inverse_run(&t, &d);
            let (mut weight, mut gain) = ([0.0; RUN], [0.0; RUN]);
            for i in 0..RUN {
                gain[i] = code_gain(kind, t[i]);
                weight[i] = operator.slope(v[i], d[i]) * gain[i];
            }
            for i in 0..RUN {
                let (texel, slope) = stored.texel(v[i]);
                v[i] = texel;
                weight[i] *= slope;
            }
            for i in 0..RUN {
                // A texel that hardly matters still has a place.
                weight[i] = weight[i] * weight[i] + 1.0;
            }
            let run = x0..width.min(x0 + RUN);
            for (plane, values) in row.iter_mut().zip([v, weight, d, t, gain]) {
                plane[c][run.clone()].copy_from_slice(&values[..run.len()]);
            }
        }
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
}

impl BlockGoal {
    fn zeros() -> Self {
        let zeros = [[0.0; TEXELS]; 3];
        BlockGoal { v: zeros, weight: zeros, d: zeros, t: zeros, gain: zeros }
    }

    #[inline(always)]
    fn of_rows(rows: &[GoalRow; 4], column: usize) -> Self {
        let mut goal = BlockGoal::zeros();
        let BlockGoal { v, weight, d, t, gain } = &mut goal;
        for (field, planes) in [v, weight, d, t, gain].into_iter().enumerate() {
            for (channel, plane) in planes.iter_mut().enumerate() {
                for (y, texels) in plane.as_chunks_mut::<4>().0.iter_mut().enumerate() {
                    texels.copy_from_slice(&rows[y][field][channel][4 * column..][..4]);
                }
            }
        }
        goal
    }

    /// Texels of one channel in the `part`th register.
    #[inline(always)]
    fn lanes<S: Simd>(&self, simd: S, channel: usize, part: usize) -> Lanes<S> {
        let d = lanes_of::<S>(&self.d[channel], part);
        Lanes {
            dark: simd.less_than_f32s(d, simd.splat_f32s(0.5)),
            d,
            t: lanes_of::<S>(&self.t[channel], part),
            gain: lanes_of::<S>(&self.gain[channel], part),
        }
    }

    /// What each texel is nearest to, of the choices whose values in the first `CHANNELS` channels are `lines`.
    #[inline(always)]
    fn nearest<S: Simd, const CHANNELS: usize>(&self, simd: S, lines: &[[Line; CHANNELS]]) -> Nearest {
        let mut nearest = Nearest { errors: [0.0; TEXELS], choices: [0; TEXELS] };
        let (errors, _) = S::as_mut_simd_f32s(&mut nearest.errors);
        let (choices, _) = S::as_mut_simd_u32s(&mut nearest.choices);
        for (part, (errors, choices)) in errors.iter_mut().zip(choices).enumerate() {
            let mut texels = [self.lanes(simd, 0, part); CHANNELS];
            for (c, texels) in texels.iter_mut().enumerate().skip(1) {
                *texels = self.lanes(simd, c, part);
            }
            let (mut least, mut choice) = (simd.splat_f32s(f32::INFINITY), simd.splat_u32s(0));
            for (i, lines) in lines.iter().enumerate() {
                let mut error = texels[0].error(simd, &lines[0]);
                for (texels, line) in texels.iter().zip(lines).skip(1) {
                    error = simd.add_f32s(error, texels.error(simd, line));
                }
                let nearer = simd.less_than_f32s(error, least);
                least = simd.select_f32s(nearer, error, least);
                choice = simd.select_u32s(nearer, simd.splat_u32s(i as u32), choice);
            }
            (*errors, *choices) = (least, choice);
        }
        nearest
    }

    /// Two colours on either end of the line along which the solution lies, as far as it reaches.
    #[inline(always)]
    fn line<S: Simd>(&self, simd: S) -> [[f32; 3]; 2] {
        let (mut mean, mut scale) = ([0.0; 3], [0.0; 3]);
        for c in 0..3 {
            let total = sum(&self.weight[c]).max(1e-20);
            mean[c] = dot(simd, &self.weight[c], &self.v[c]) / total;
            scale[c] = total.sqrt();
        }
        // Deviations from the mean, in units in which all channels count alike, and with the texel's weight.
        let (mut p, mut weighted) = ([[0.0; TEXELS]; 3], [[0.0; TEXELS]; 3]);
        for part in 0..TEXELS / S::F32_LANES {
            let weight = simd.add_f32s(
                simd.add_f32s(lanes_of::<S>(&self.weight[0], part), lanes_of::<S>(&self.weight[1], part)),
                lanes_of::<S>(&self.weight[2], part),
            );
            let inside = simd.less_than_f32s(simd.splat_f32s(0.0), weight);
            for c in 0..3 {
                let apart = simd.sub_f32s(lanes_of::<S>(&self.v[c], part), simd.splat_f32s(mean[c]));
                let apart = simd.mul_f32s(apart, simd.splat_f32s(scale[c]));
                let apart = simd.select_f32s(inside, apart, simd.splat_f32s(0.0));
                S::as_mut_simd_f32s(&mut p[c]).0[part] = apart;
                S::as_mut_simd_f32s(&mut weighted[c]).0[part] = simd.mul_f32s(apart, weight);
            }
        }
        let (xx, yy, zz) =
            (dot(simd, &p[0], &weighted[0]), dot(simd, &p[1], &weighted[1]), dot(simd, &p[2], &weighted[2]));
        let (xy, xz, yz) =
            (dot(simd, &p[0], &weighted[1]), dot(simd, &p[0], &weighted[2]), dot(simd, &p[1], &weighted[2]));
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
        let mut along = [0.0; TEXELS];
        for part in 0..TEXELS / S::F32_LANES {
            let mut sum = simd.splat_f32s(0.0);
            for c in 0..3 {
                let term = simd.mul_f32s(lanes_of::<S>(&p[c], part), simd.splat_f32s(axis[c]));
                sum = simd.add_f32s(sum, term);
            }
            S::as_mut_simd_f32s(&mut along).0[part] = sum;
        }
        let (mut low, mut high) = (0.0, 0.0);
        for v in along {
            (low, high) = (if v < low { v } else { low }, if v > high { v } else { high });
        }
        let at = |along: f32| {
            std::array::from_fn(|c| (mean[c] + along / length * axis[c] / scale[c]).clamp(0.0, 1.0))
        };
        [at(high), at(low)]
    }
}

/// What texels are nearest to.
struct Nearest {
    /// Squared differences of the blended result.
    errors: [f32; TEXELS],
    choices: [u32; TEXELS],
}

/// Texels of one channel, as many as a register takes.
#[derive(Clone, Copy)]
struct Lanes<S: Simd> {
    dark: S::m32s,
    d: S::f32s,
    t: S::f32s,
    gain: S::f32s,
}

impl<S: Simd> Lanes<S> {
    /// Squared differences to the target where all texels have one `s`.
    #[inline(always)]
    fn error(&self, simd: S, line: &Line) -> S::f32s {
        let slope =
            simd.select_f32s(self.dark, simd.splat_f32s(line.dark[0]), simd.splat_f32s(line.bright[0]));
        let offset =
            simd.select_f32s(self.dark, simd.splat_f32s(line.dark[1]), simd.splat_f32s(line.bright[1]));
        // Not fused, so that all processors give the same bits.
        let blended = simd.mul_f32s(slope, self.d);
        let difference = simd.add_f32s(blended, simd.sub_f32s(offset, self.t));
        let steps = simd.mul_f32s(difference, self.gain);
        simd.mul_f32s(steps, steps)
    }
}

#[inline(always)]
fn lanes_of<S: Simd>(values: &[f32; TEXELS], part: usize) -> S::f32s {
    S::as_simd_f32s(values).0[part]
}

#[inline(always)]
fn dot<S: Simd>(simd: S, a: &[f32; TEXELS], b: &[f32; TEXELS]) -> f32 {
    let mut products = [0.0; TEXELS];
    for part in 0..TEXELS / S::F32_LANES {
        S::as_mut_simd_f32s(&mut products).0[part] =
            simd.mul_f32s(lanes_of::<S>(a, part), lanes_of::<S>(b, part));
    }
    sum(&products)
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
fn least_squares<S: Simd>(
    simd: S,
    shares: &[f32; TEXELS],
    v: &[f32; TEXELS],
    w: &[f32; TEXELS],
) -> (f32, f32) {
    let (mut rest, mut wa, mut wb) = ([0.0; TEXELS], [0.0; TEXELS], [0.0; TEXELS]);
    for part in 0..TEXELS / S::F32_LANES {
        let (share, w) = (lanes_of::<S>(shares, part), lanes_of::<S>(w, part));
        let other = simd.sub_f32s(simd.splat_f32s(1.0), share);
        S::as_mut_simd_f32s(&mut rest).0[part] = other;
        S::as_mut_simd_f32s(&mut wa).0[part] = simd.mul_f32s(w, share);
        S::as_mut_simd_f32s(&mut wb).0[part] = simd.mul_f32s(w, other);
    }
    let (aa, ab, bb) = (dot(simd, &wa, shares), dot(simd, &wa, &rest), dot(simd, &wb, &rest));
    let (va, vb) = (dot(simd, &wa, v), dot(simd, &wb, v));
    let determinant = aa * bb - ab * ab;
    if determinant > 1e-4 * (aa + bb) * (aa + bb) {
        ((va * bb - vb * ab) / determinant, (vb * aa - va * ab) / determinant)
    } else {
        let mean = (va + vb) / (aa + 2.0 * ab + bb).max(1e-20);
        (mean, mean)
    }
}

/// A sum of sixteen: halves on halves, so that it runs in lanes, and in the same order on every processor.
#[inline(always)]
fn sum(values: &[f32; TEXELS]) -> f32 {
    let mut lanes = [0.0; TEXELS / 2];
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
    use glam::Vec3;
    use kinran_shading::detail::{detail_over, overlay, smooth_overlay};

    use super::*;
    use crate::simd::dispatch;

    struct One<'a>(&'a BlockGoal, Line);

    impl pulp::WithSimd for One<'_> {
        type Output = [f32; TEXELS];

        fn with_simd<S: Simd>(self, simd: S) -> [f32; TEXELS] {
            self.0.nearest(simd, &[[self.1]]).errors
        }
    }

    /// Texels of all details and targets, errors by the lines and by the operators as they are.
    #[test]
    fn lines_are_the_operators() {
        let mut goal = BlockGoal::zeros();
        for (blending, blend) in [
            (Blending::Smooth, smooth_overlay as fn(f32, f32) -> f32),
            (Blending::Plain, overlay),
            (Blending::Over(0.3), |s, d| detail_over(Vec3::splat(s), Vec3::splat(d), 0.3).x),
        ] {
            for step in 0..=200 {
                let s = step as f32 / 200.0;
                for i in 0..TEXELS {
                    goal.d[0][i] = i as f32 / 15.0;
                    goal.t[0][i] = ((i * 7) % 16) as f32 / 15.0;
                    goal.gain[0][i] = 1.0;
                }
                let got = dispatch(One(&goal, blending.line(s)));
                for i in 0..TEXELS {
                    let want = (blend(s, goal.d[0][i]) - goal.t[0][i]).powi(2);
                    assert!(
                        (got[i] - want).abs() < 1e-6,
                        "{blending:?}, s = {s}, d = {}, t = {}: wanted {want}, got {}",
                        goal.d[0][i],
                        goal.t[0][i],
                        got[i]
                    );
                }
            }
        }
    }

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
