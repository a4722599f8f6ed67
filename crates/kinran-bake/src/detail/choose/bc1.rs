//! BC1: ends on the line of the solution, then least squares and single steps, by the blended error.

use super::{Blending, BlockGoal, Stored, TEXELS, least_squares, lower, sum};

/// Shares of the line that are cut off both its ends, to start from.
const INSETS: [f32; 3] = [0.0, 0.1, 0.25];

/// Rounds of fitting ends to the texels that chose them. The third gains less than a thousandth.
const ROUNDS: usize = 3;

/// Rounds of single steps. The third gains less than a thousandth.
const SWEEPS: usize = 2;

/// Steps of the two ends of a channel that are tried.
const STEPS: [(i32, i32); 6] = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1)];

/// The largest number of each channel.
const LARGEST: [i32; 3] = [31, 63, 31];

/// Shares of the first end in the four colours.
const SHARES: [f32; 4] = [1.0, 0.0, 2.0 / 3.0, 1.0 / 3.0];

/// The ends in red, green and blue, as the whole numbers that are stored.
type Ends = [[i32; 2]; 3];

/// Squared differences by channel, colour and texel.
type Errors = [[[f32; TEXELS]; 4]; 3];

/// The block of four colours whose blended result is nearest to the target, as far as it is found: texels take the
/// colour that is blended nearest to their target; the ends follow by least squares, weighted by the slope of the blend;
/// then each end takes single steps as long as they help.
#[inline(always)]
pub(super) fn choose(goal: &BlockGoal, stored: Stored, blend: Blending) -> [u8; 8] {
    let [high, low] = goal.line();
    let (mut ends, mut errors, mut least) = ([[0; 2]; 3], [[[0.0; TEXELS]; 4]; 3], f32::INFINITY);
    for inset in INSETS {
        let mut start = [[0; 2]; 3];
        for c in 0..3 {
            let by = (high[c] - low[c]) * inset;
            start[c] = [quantize(high[c] - by, c), quantize(low[c] + by, c)];
        }
        let mut start_errors = errors_of(start, goal, stored, blend);
        let mut error = total(&start_errors);
        for _ in 0..ROUNDS {
            let fitted = fit(&choices_of(&start_errors), goal);
            if fitted == start {
                break;
            }
            let fitted_errors = errors_of(fitted, goal, stored, blend);
            let fitted_error = total(&fitted_errors);
            if fitted_error >= error {
                break;
            }
            (start, start_errors, error) = (fitted, fitted_errors, fitted_error);
        }
        if error < least {
            (ends, errors, least) = (start, start_errors, error);
        }
    }

    for _ in 0..SWEEPS {
        let before = least;
        for c in 0..3 {
            let mut others = [[0.0; TEXELS]; 4];
            for (choice, others) in others.iter_mut().enumerate() {
                let (a, b) = (&errors[(c + 1) % 3][choice], &errors[(c + 2) % 3][choice]);
                for i in 0..TEXELS {
                    others[i] = a[i] + b[i];
                }
            }
            for (a, b) in STEPS {
                let moved = [ends[c][0] + a, ends[c][1] + b];
                if moved.iter().any(|end| !(0..=LARGEST[c]).contains(end)) {
                    continue;
                }
                let of_channel = channel_errors(moved, c, goal, stored, blend);
                let error = total_with(&of_channel, &others);
                if error < least {
                    (ends[c], errors[c], least) = (moved, of_channel, error);
                }
            }
        }
        if least == before {
            break;
        }
    }
    pack(ends, &choices_of(&errors))
}

#[inline(always)]
fn quantize(v: f32, channel: usize) -> i32 {
    (v.clamp(0.0, 1.0) * LARGEST[channel] as f32 + 0.5) as i32
}

/// Differences for the four values of a channel, with the 8 bits that decoders round to.
#[inline(always)]
fn channel_errors(
    ends: [i32; 2],
    channel: usize,
    goal: &BlockGoal,
    stored: Stored,
    blend: Blending,
) -> [[f32; TEXELS]; 4] {
    let (a, b) = (ends[0] as f32, ends[1] as f32);
    let mut errors = [[0.0; TEXELS]; 4];
    for (errors, share) in errors.iter_mut().zip(SHARES) {
        let byte = ((b + (a - b) * share) * (255.0 / LARGEST[channel] as f32) + 0.5) as u8;
        *errors = goal.errors(channel, &[stored.value(byte); TEXELS], blend);
    }
    errors
}

#[inline(always)]
fn errors_of(ends: Ends, goal: &BlockGoal, stored: Stored, blend: Blending) -> Errors {
    let mut errors = [[[0.0; TEXELS]; 4]; 3];
    for c in 0..3 {
        errors[c] = channel_errors(ends[c], c, goal, stored, blend);
    }
    errors
}

/// The error when each texel takes the best of the four colours.
#[inline(always)]
fn total(errors: &Errors) -> f32 {
    let mut others = errors[1];
    for choice in 0..4 {
        for i in 0..TEXELS {
            others[choice][i] += errors[2][choice][i];
        }
    }
    total_with(&errors[0], &others)
}

#[inline(always)]
fn total_with(one: &[[f32; TEXELS]; 4], others: &[[f32; TEXELS]; 4]) -> f32 {
    let mut all = [[0.0; TEXELS]; 4];
    for choice in 0..4 {
        for i in 0..TEXELS {
            all[choice][i] = one[choice][i] + others[choice][i];
        }
    }
    sum(&lower(&lower(&all[0], &all[1]), &lower(&all[2], &all[3])))
}

#[inline(always)]
fn choices_of(errors: &Errors) -> [i32; TEXELS] {
    let (mut least, mut choices) = ([f32::INFINITY; TEXELS], [0_i32; TEXELS]);
    for choice in 0..4 {
        for i in 0..TEXELS {
            let error = errors[0][choice][i] + (errors[1][choice][i] + errors[2][choice][i]);
            let better = error < least[i];
            choices[i] = if better { choice as i32 } else { choices[i] };
            least[i] = if better { error } else { least[i] };
        }
    }
    choices
}

/// The ends nearest to the exact solution, given what each texel takes of them.
#[inline(always)]
fn fit(choices: &[i32; TEXELS], goal: &BlockGoal) -> Ends {
    let mut shares = [0.0; TEXELS];
    for i in 0..TEXELS {
        shares[i] = SHARES[choices[i] as usize];
    }
    let mut ends = [[0; 2]; 3];
    for c in 0..3 {
        let (a, b) = least_squares(&shares, &goal.v[c], &goal.weight[c]);
        ends[c] = [quantize(a, c), quantize(b, c)];
    }
    ends
}

#[inline(always)]
fn pack(ends: Ends, choices: &[i32; TEXELS]) -> [u8; 8] {
    let mut packed: [u16; 2] =
        std::array::from_fn(|i| ((ends[0][i] << 11) | (ends[1][i] << 5) | ends[2][i]) as u16);
    // Four colours take the larger end first; exchanged, the four choices exchange in pairs.
    let exchange = packed[0] < packed[1];
    if exchange {
        packed.swap(0, 1);
    }
    let all = packed[0] == packed[1];
    let mut bits = 0_u32;
    for (i, &choice) in choices.iter().enumerate() {
        let choice = if all { 0 } else { choice as u32 ^ u32::from(exchange) };
        bits |= choice << (2 * i);
    }
    let mut block = [0; 8];
    block[..2].copy_from_slice(&packed[0].to_le_bytes());
    block[2..4].copy_from_slice(&packed[1].to_le_bytes());
    block[4..].copy_from_slice(&bits.to_le_bytes());
    block
}
