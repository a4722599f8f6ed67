//! BC4: as BC1, for one channel and eight values.

use super::{Blending, BlockGoal, TEXELS, least_squares, lower, sum};

/// Rounds of fitting ends to the texels that chose them.
const ROUNDS: usize = 2;

/// Steps of the two ends that are tried, in rounds.
const STEPS: [(i32, i32); 6] = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1)];

/// Rounds of steps.
const SWEEPS: usize = 2;

/// Replaces a block by one whose blended result is nearer to the target, if there is one.
#[inline(always)]
pub(super) fn choose(block: &mut [u8], goal: &BlockGoal, blend: Blending) {
    let error = |ends: [i32; 2]| {
        let mut least = [f32::INFINITY; TEXELS];
        for value in values(ends) {
            least = lower(&least, &goal.errors(0, &[synthesized(value); TEXELS], blend));
        }
        sum(&least)
    };
    let choices = |ends: [i32; 2]| {
        let (mut least, mut choices) = ([f32::INFINITY; TEXELS], [0_i32; TEXELS]);
        for (choice, value) in values(ends).into_iter().enumerate() {
            let errors = goal.errors(0, &[synthesized(value); TEXELS], blend);
            for i in 0..TEXELS {
                let better = errors[i] < least[i];
                choices[i] = if better { choice as i32 } else { choices[i] };
                least[i] = if better { errors[i] } else { least[i] };
            }
        }
        choices
    };
    // Six values, black and white: for blocks that reach both, and seldom.
    let mut ends = [i32::from(block[0]), i32::from(block[1])];
    if ends[0] <= ends[1] {
        return;
    }
    let mut least = error(ends);
    for _ in 0..ROUNDS {
        let fitted = fit(&choices(ends), &goal.v[0], &goal.weight[0]);
        let fitted_error = error(fitted);
        if fitted_error >= least {
            break;
        }
        (ends, least) = (fitted, fitted_error);
    }
    for _ in 0..SWEEPS {
        let before = least;
        for (a, b) in STEPS {
            let moved = [ends[0] + a, ends[1] + b];
            if moved[0] <= 255 && moved[1] >= 0 && moved[0] >= moved[1] {
                let moved_error = error(moved);
                if moved_error < least {
                    (ends, least) = (moved, moved_error);
                }
            }
        }
        if least == before {
            break;
        }
    }
    pack(block, ends, &choices(ends));
}

/// The ends nearest to `v`, the larger first, given what each texel takes of them.
#[inline(always)]
pub(super) fn fit(choices: &[i32; TEXELS], v: &[f32; TEXELS], weight: &[f32; TEXELS]) -> [i32; 2] {
    let (a, b) = least_squares(&choices.map(share), v, weight);
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as i32;
    [byte(a.max(b)), byte(a.min(b))]
}

/// Share of the first end in a value.
#[inline(always)]
fn share(choice: i32) -> f32 {
    match choice {
        0 => 1.0,
        1 => 0.0,
        choice => (8 - choice) as f32 / 7.0,
    }
}

/// The eight values, in steps of 8 bits; decoders keep more of them.
#[inline(always)]
pub(super) fn values(ends: [i32; 2]) -> [f32; 8] {
    let (a, b) = (ends[0] as f32, ends[1] as f32);
    std::array::from_fn(|choice| b + (a - b) * share(choice as i32))
}

/// The `s` that a value stands for, as `detail_from_texel` has it.
#[inline(always)]
pub(super) fn synthesized(value: f32) -> f32 {
    ((value - 1.0) * (1.0 / 254.0)).max(0.0)
}

#[inline(always)]
pub(super) fn pack(block: &mut [u8], ends: [i32; 2], choices: &[i32; TEXELS]) {
    let mut bits = 0_u64;
    for (i, &choice) in choices.iter().enumerate() {
        let choice = if ends[0] == ends[1] { 0 } else { choice as u64 };
        bits |= choice << (3 * i);
    }
    block[0] = ends[0] as u8;
    block[1] = ends[1] as u8;
    block[2..8].copy_from_slice(&bits.to_le_bytes()[..6]);
}
