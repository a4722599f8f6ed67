//! BC4: as BC1, for one channel and eight values.

use pulp::Simd;

use super::{Blending, BlockGoal, TEXELS, least_squares, sum};

/// Rounds of fitting ends to the texels that chose them.
const ROUNDS: usize = 2;

/// Steps of the two ends that are tried, in rounds.
const STEPS: [(i32, i32); 6] = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1)];

/// Rounds of steps.
const SWEEPS: usize = 2;

/// Replaces a block by one whose blended result is nearer to the target, if there is one.
#[inline(always)]
pub(super) fn choose<S: Simd>(simd: S, block: &mut [u8], goal: &BlockGoal, blend: Blending) {
    // Six values, black and white: for blocks that reach both, and seldom.
    let mut ends = [i32::from(block[0]), i32::from(block[1])];
    if ends[0] <= ends[1] {
        return;
    }
    let (mut least, mut choices) = nearest(simd, goal, blend, ends);
    for _ in 0..ROUNDS {
        let fitted = fit(simd, &choices, &goal.v[0], &goal.weight[0]);
        let (error, fitted_choices) = nearest(simd, goal, blend, fitted);
        if error >= least {
            break;
        }
        (ends, least, choices) = (fitted, error, fitted_choices);
    }
    for _ in 0..SWEEPS {
        let before = least;
        for (a, b) in STEPS {
            let moved = [ends[0] + a, ends[1] + b];
            if moved[0] <= 255 && moved[1] >= 0 && moved[0] >= moved[1] {
                let (error, moved_choices) = nearest(simd, goal, blend, moved);
                if error < least {
                    (ends, least, choices) = (moved, error, moved_choices);
                }
            }
        }
        if least == before {
            break;
        }
    }
    pack(block, ends, &choices);
}

/// What texels choose of the eight values, and the error.
#[inline(always)]
fn nearest<S: Simd>(simd: S, goal: &BlockGoal, blend: Blending, ends: [i32; 2]) -> (f32, [u32; TEXELS]) {
    let nearest = goal.nearest(simd, &values(ends).map(|value| [blend.line(synthesized(value))]));
    (sum(&nearest.errors), nearest.choices)
}

/// The ends nearest to `v`, the larger first, given what each texel takes of them.
#[inline(always)]
pub(super) fn fit<S: Simd>(
    simd: S,
    choices: &[u32; TEXELS],
    v: &[f32; TEXELS],
    weight: &[f32; TEXELS],
) -> [i32; 2] {
    let (a, b) = least_squares(simd, &choices.map(|choice| SHARES[choice as usize & 7]), v, weight);
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as i32;
    [byte(a.max(b)), byte(a.min(b))]
}

/// Shares of the first end in the eight values.
const SHARES: [f32; 8] = [1.0, 0.0, 6.0 / 7.0, 5.0 / 7.0, 4.0 / 7.0, 3.0 / 7.0, 2.0 / 7.0, 1.0 / 7.0];

/// The eight values, in steps of 8 bits; decoders keep more of them.
#[inline(always)]
pub(super) fn values(ends: [i32; 2]) -> [f32; 8] {
    let (a, b) = (ends[0] as f32, ends[1] as f32);
    SHARES.map(|share| b + (a - b) * share)
}

/// The `s` that a value stands for, as `detail_from_texel` has it.
#[inline(always)]
pub(super) fn synthesized(value: f32) -> f32 {
    ((value - 1.0) * (1.0 / 254.0)).max(0.0)
}

#[inline(always)]
pub(super) fn pack(block: &mut [u8], ends: [i32; 2], choices: &[u32; TEXELS]) {
    let mut bits = 0_u64;
    for (i, &choice) in choices.iter().enumerate() {
        let choice = if ends[0] == ends[1] { 0 } else { u64::from(choice) };
        bits |= choice << (3 * i);
    }
    block[0] = ends[0] as u8;
    block[1] = ends[1] as u8;
    block[2..8].copy_from_slice(&bits.to_le_bytes()[..6]);
}
