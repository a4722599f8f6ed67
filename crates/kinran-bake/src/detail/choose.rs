//! Which block of several to keep: the one whose blended result is nearest to the target. For BC1 and BC4.
//!
//! An encoder sees `s` alone and weighs all texels alike. But the blend has slope 0.1 here and 4 there, and texels
//! next to each other have different tiles under them, so of many blocks equally near to `s` one is much nearer to the
//! target than the others.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over lanes of known length are what compilers vectorise"
)]

use kinran_image::Format;

use super::code::{code_from_linear, linear_from_byte};
use super::map::MapKind;
use super::solve::{Blend, Operator, Plain, Smooth};

/// Texels of a block.
const TEXELS: usize = 16;

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
    /// `s` is stored as sRGB code.
    pub(crate) srgb: bool,
    pub(crate) format: Format,
    /// What an encoder made of `s`.
    pub(crate) blocks: &'a mut [u8],
}

impl pulp::WithSimd for ChooseBand<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        match self.blend {
            Blend::Smooth => self.choose(Smooth),
            Blend::Plain => self.choose(Plain),
        }
    }
}

impl ChooseBand<'_> {
    #[inline(always)]
    fn choose(self, blend: impl Operator) {
        let columns = self.width.div_ceil(4);
        for (i, block) in self.blocks.as_chunks_mut::<8>().0.iter_mut().enumerate() {
            let (x0, y0) = (i % columns * 4, i / columns * 4);
            let mut goal = BlockGoal::zeros();
            let columns_inside = 4.min(self.width - x0);
            let mut inside = [0.0; TEXELS];
            for (y, (target, detail)) in self.target[y0..].iter().zip(&self.detail[y0..]).take(4).enumerate()
            {
                let row = 4 * y..4 * y + columns_inside;
                inside[row.clone()].fill(1.0);
                for channel in 0..3 {
                    goal.t[channel][row.clone()].copy_from_slice(&target[channel][x0..x0 + columns_inside]);
                    goal.d[channel][row.clone()].copy_from_slice(&detail[channel][x0..x0 + columns_inside]);
                }
            }
            for channel in 0..3 {
                for i in 0..TEXELS {
                    goal.gain[channel][i] = code_gain(self.kind, goal.t[channel][i]) * inside[i];
                }
            }
            for channel in 0..3 {
                for i in 0..TEXELS {
                    let s = blend.inverse(goal.t[channel][i], goal.d[channel][i]);
                    let (v, slope) = stored(s, self.srgb);
                    let step = blend.slope(s, goal.d[channel][i]) * goal.gain[channel][i] * slope;
                    goal.v[channel][i] = v;
                    goal.weight[channel][i] = step * step;
                }
            }
            match self.format {
                Format::Bc4 => choose_bc4(block, &goal, blend),
                _ => choose_bc1(block, &goal, self.srgb, blend),
            }
        }
    }
}

/// What a block of `s` should achieve, for colour and data, texels row by row.
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

/// Formats in which blocks are chosen by what they are blended to.
pub(crate) fn can_choose(format: Format, kind: MapKind) -> bool {
    matches!((format, kind), (Format::Bc1, MapKind::Color | MapKind::Data) | (Format::Bc4, MapKind::Data))
}

/// What is stored for `s`, 0 to 1, and the derivative of `s` by it; the inverse of
/// [`detail_from_texel`](kinran_shading::detail::detail_from_texel), through the sRGB curve where that is stored.
#[inline(always)]
fn stored(s: f32, srgb: bool) -> (f32, f32) {
    let texel = (s * 254.0 + 1.0) * (1.0 / 255.0);
    if !srgb {
        return (texel, 255.0 / 254.0);
    }
    let code = code_from_linear(texel);
    let slope = if texel <= 0.003_130_8 { 1.0 / 12.92 } else { 2.4 * texel / (code + 0.055) };
    (code, slope * (255.0 / 254.0))
}

/// The `s` that a stored byte stands for.
#[inline(always)]
fn synthesized(byte: u8, srgb: bool) -> f32 {
    let texel = if srgb { linear_from_byte(byte) } else { f32::from(byte) * (1.0 / 255.0) };
    (texel * (255.0 / 254.0) - 1.0 / 254.0).max(0.0)
}

/// Rounds of fitting end points to the texels that chose them. The third gains less than a thousandth.
const ROUNDS: usize = 2;

/// Replaces a BC1 block by one whose blended result is nearer to the target, if there is one: texels choose again among
/// its four colours by what they are blended to; then the end points follow by least squares, weighted by the slope of
/// the blend; and so on.
#[inline(always)]
fn choose_bc1(block: &mut [u8; 8], goal: &BlockGoal, srgb: bool, blend: impl Operator) {
    let ends = [u16::from_le_bytes([block[0], block[1]]), u16::from_le_bytes([block[2], block[3]])];
    // The mode with three colours and black is not for maps without holes.
    if ends[0] < ends[1] {
        return;
    }
    let mut best = assign(ends, goal, srgb, blend);
    for _ in 0..ROUNDS {
        let ends = fit(&best.choices, goal);
        if ends == best.ends {
            break;
        }
        let fitted = assign(ends, goal, srgb, blend);
        if fitted.error >= best.error {
            break;
        }
        best = fitted;
    }
    best.write(block);
}

/// A block's end points and what each texel takes of them.
#[derive(Clone, Copy)]
struct Candidate {
    ends: [u16; 2],
    choices: [u8; TEXELS],
    error: f32,
}

impl Candidate {
    fn write(&self, block: &mut [u8; 8]) {
        let Candidate { mut ends, choices, .. } = *self;
        // Four colours take the larger end first; exchanged, the four choices exchange in pairs.
        let exchange = ends[0] < ends[1];
        if exchange {
            ends.swap(0, 1);
        }
        let all = ends[0] == ends[1];
        let mut bits = 0_u32;
        for (i, choice) in choices.into_iter().enumerate() {
            let choice = if all { 0 } else { u32::from(choice) ^ u32::from(exchange) };
            bits |= choice << (2 * i);
        }
        block[..2].copy_from_slice(&ends[0].to_le_bytes());
        block[2..4].copy_from_slice(&ends[1].to_le_bytes());
        block[4..].copy_from_slice(&bits.to_le_bytes());
    }
}

/// The three channels of a 5:6:5 colour as whole numbers.
#[inline(always)]
fn channels(end: u16) -> [u16; 3] {
    [end >> 11, end >> 5 & 63, end & 31]
}

/// The largest number of each channel.
const LARGEST: [f32; 3] = [31.0, 63.0, 31.0];

/// Shares of the first end in the four colours.
const SHARES: [f32; 4] = [1.0, 0.0, 2.0 / 3.0, 1.0 / 3.0];

/// The four values of `s` in a channel, with the 8 bits that decoders round to.
#[inline(always)]
fn palette(ends: [u16; 2], channel: usize, srgb: bool) -> [f32; 4] {
    let (a, b) = (f32::from(channels(ends[0])[channel]), f32::from(channels(ends[1])[channel]));
    SHARES.map(|share| {
        let byte = ((b + (a - b) * share) * (255.0 / LARGEST[channel]) + 0.5) as u8;
        synthesized(byte, srgb)
    })
}

/// Lets each texel take the colour that is blended nearest to its target.
#[inline(always)]
fn assign(ends: [u16; 2], goal: &BlockGoal, srgb: bool, blend: impl Operator) -> Candidate {
    let palettes: [[f32; 4]; 3] = [0, 1, 2].map(|channel| palette(ends, channel, srgb));
    let mut least = [f32::INFINITY; TEXELS];
    let mut choices = [0_i32; TEXELS];
    for choice in 0..4 {
        let mut errors = [0.0; TEXELS];
        for channel in 0..3 {
            let s = palettes[channel][choice];
            let (d, t, gain) = (&goal.d[channel], &goal.t[channel], &goal.gain[channel]);
            for i in 0..TEXELS {
                let difference = (blend.blend(s, d[i]) - t[i]) * gain[i];
                errors[i] += difference * difference;
            }
        }
        for i in 0..TEXELS {
            let better = errors[i] < least[i];
            choices[i] = if better { choice as i32 } else { choices[i] };
            least[i] = if better { errors[i] } else { least[i] };
        }
    }
    Candidate { ends, choices: choices.map(|c| c as u8), error: sum(&least) }
}

/// The end points nearest to the exact solution, given what each texel takes of them.
#[inline(always)]
fn fit(choices: &[u8; TEXELS], goal: &BlockGoal) -> [u16; 2] {
    let shares = choices.map(|choice| SHARES[usize::from(choice)]);
    let mut ends = [0_u16; 2];
    for channel in 0..3 {
        let (a, b) = least_squares(&shares, &goal.v[channel], &goal.weight[channel]);
        let bits = [11, 5, 0][channel];
        for (end, value) in ends.iter_mut().zip([a, b]) {
            *end |= ((value.clamp(0.0, 1.0) * LARGEST[channel] + 0.5) as u16) << bits;
        }
    }
    ends
}

/// The two ends whose mixtures, by the shares of the first, are nearest to `v`. Where all shares are alike or nothing has
/// a weight, both are the mean.
#[inline(always)]
fn least_squares(shares: &[f32; TEXELS], v: &[f32; TEXELS], w: &[f32; TEXELS]) -> (f32, f32) {
    let mut terms = [[0.0; TEXELS]; 5];
    for i in 0..TEXELS {
        let (a, b) = (shares[i], 1.0 - shares[i]);
        for (term, value) in terms.iter_mut().zip([a * a, a * b, b * b, a * v[i], b * v[i]]) {
            term[i] = w[i] * value;
        }
    }
    let [aa, ab, bb, va, vb] = terms.each_ref().map(sum);
    let determinant = aa * bb - ab * ab;
    if determinant > 1e-4 * (aa + bb) * (aa + bb) {
        ((va * bb - vb * ab) / determinant, (vb * aa - va * ab) / determinant)
    } else {
        let mean = (va + vb) / (aa + 2.0 * ab + bb).max(1e-20);
        (mean, mean)
    }
}

/// As [`choose_bc1`], for the one channel and eight values of BC4.
#[inline(always)]
fn choose_bc4(block: &mut [u8; 8], goal: &BlockGoal, blend: impl Operator) {
    let ends = [block[0], block[1]];
    // Six values, black and white: for blocks that reach both, and seldom.
    if ends[0] < ends[1] {
        return;
    }
    let mut best = assign_bc4(ends, goal, blend);
    for _ in 0..ROUNDS {
        let shares = best.1.map(share_bc4);
        let (a, b) = least_squares(&shares, &goal.v[0], &goal.weight[0]);
        let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let ends = [byte(a.max(b)), byte(a.min(b))];
        let fitted = assign_bc4(ends, goal, blend);
        if fitted.2 >= best.2 {
            break;
        }
        best = fitted;
    }
    let (ends, choices, _) = best;
    let mut bits = 0_u64;
    for (i, choice) in choices.into_iter().enumerate() {
        let choice = if ends[0] == ends[1] { 0 } else { u64::from(choice) };
        bits |= choice << (3 * i);
    }
    block[..2].copy_from_slice(&ends);
    block[2..].copy_from_slice(&bits.to_le_bytes()[..6]);
}

/// Share of the first end in a value of BC4.
#[inline(always)]
fn share_bc4(choice: u8) -> f32 {
    match choice {
        0 => 1.0,
        1 => 0.0,
        choice => f32::from(8 - choice) / 7.0,
    }
}

/// Lets each texel take the value that is blended nearest to its target; ends, choices and the error.
#[inline(always)]
fn assign_bc4(ends: [u8; 2], goal: &BlockGoal, blend: impl Operator) -> ([u8; 2], [u8; TEXELS], f32) {
    let (a, b) = (f32::from(ends[0]), f32::from(ends[1]));
    let mut least = [f32::INFINITY; TEXELS];
    let mut choices = [0_i32; TEXELS];
    for choice in 0..8_u8 {
        let s = synthesized((b + (a - b) * share_bc4(choice) + 0.5) as u8, false);
        for i in 0..TEXELS {
            let difference = (blend.blend(s, goal.d[0][i]) - goal.t[0][i]) * goal.gain[0][i];
            let better = difference * difference < least[i];
            choices[i] = if better { i32::from(choice) } else { choices[i] };
            least[i] = if better { difference * difference } else { least[i] };
        }
    }
    (ends, choices.map(|c| c as u8), sum(&least))
}

/// A sum in a fixed order that runs in lanes.
#[inline(always)]
fn sum(values: &[f32; TEXELS]) -> f32 {
    let mut lanes: [f32; 8] = std::array::from_fn(|i| values[i] + values[i + 8]);
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
