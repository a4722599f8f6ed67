//! BC1: ends on the line of the solution, then least squares and single steps, by the blended error.

use pulp::Simd;

use super::{BlockGoal, Lanes, Line, Nearest, TEXELS, lanes_of, least_squares, sum};

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

/// What the four values of each channel make of a detail, by choice and channel.
type Colors = [[Line; 3]; 4];

/// Lines of all values of a channel, which are thirds of its steps.
pub(super) struct Thirds {
    five: [Line; 3 * 31 + 1],
    six: [Line; 3 * 63 + 1],
}

impl Thirds {
    /// From the lines of all bytes: with the 8 bits that decoders round to.
    #[inline(always)]
    pub(super) fn new(lines: &[Line; 256]) -> Self {
        let mut thirds = Thirds { five: [Line::default(); 94], six: [Line::default(); 190] };
        let byte = |third: usize, largest: f32| (third as f32 * 85.0 / largest + 0.5) as usize;
        for (third, line) in thirds.five.iter_mut().enumerate() {
            *line = lines[byte(third, 31.0)];
        }
        for (third, line) in thirds.six.iter_mut().enumerate() {
            *line = lines[byte(third, 63.0)];
        }
        thirds
    }

    /// The four values of a channel.
    #[inline(always)]
    fn values(&self, [a, b]: [i32; 2], channel: usize) -> [&Line; 4] {
        let thirds = if channel == 1 { &self.six[..] } else { &self.five[..] };
        [3 * a, 3 * b, 2 * a + b, a + 2 * b].map(|third| &thirds[third as usize])
    }

    #[inline(always)]
    fn colors(&self, ends: Ends) -> Colors {
        let mut colors = [[Line::default(); 3]; 4];
        for c in 0..3 {
            for (color, value) in colors.iter_mut().zip(self.values(ends[c], c)) {
                color[c] = *value;
            }
        }
        colors
    }
}

/// The block of four colours whose blended result is nearest to the target, as far as it is found: texels take the
/// colour that is blended nearest to their target; the ends follow by least squares, weighted by the slope of the blend;
/// then each end takes single steps as long as they help.
#[inline(always)]
pub(super) fn choose<S: Simd>(simd: S, goal: &BlockGoal, thirds: &Thirds) -> [u8; 8] {
    let [high, low] = goal.line(simd);
    let (mut ends, mut least) = ([[0; 2]; 3], f32::INFINITY);
    for inset in INSETS {
        let mut start = [[0; 2]; 3];
        for c in 0..3 {
            let by = (high[c] - low[c]) * inset;
            start[c] = [quantize(high[c] - by, c), quantize(low[c] + by, c)];
        }
        let (mut error, mut chosen) = nearest(simd, goal, thirds, start);
        for _ in 0..ROUNDS {
            let fitted = fit(simd, &chosen, goal);
            if fitted == start {
                break;
            }
            let (fitted_error, fitted_chosen) = nearest(simd, goal, thirds, fitted);
            if fitted_error >= error {
                break;
            }
            (start, error, chosen) = (fitted, fitted_error, fitted_chosen);
        }
        if error < least {
            (ends, least) = (start, error);
        }
    }

    for _ in 0..SWEEPS {
        let before = least;
        for c in 0..3 {
            let others = Others::new(simd, goal, thirds, ends, c);
            for (a, b) in STEPS {
                let moved = [ends[c][0] + a, ends[c][1] + b];
                if moved.iter().any(|end| !(0..=LARGEST[c]).contains(end)) {
                    continue;
                }
                let error = others.total_with(simd, goal, thirds.values(moved, c), c);
                if error < least {
                    (ends[c], least) = (moved, error);
                }
            }
        }
        if least == before {
            break;
        }
    }
    pack(ends, &nearest(simd, goal, thirds, ends).1.choices)
}

/// What texels choose of the four colours, and the error.
#[inline(always)]
fn nearest<S: Simd>(simd: S, goal: &BlockGoal, thirds: &Thirds, ends: Ends) -> (f32, Nearest) {
    let nearest = goal.nearest(simd, &thirds.colors(ends));
    (sum(&nearest.errors), nearest)
}

#[inline(always)]
fn quantize(v: f32, channel: usize) -> i32 {
    (v.clamp(0.0, 1.0) * LARGEST[channel] as f32 + 0.5) as i32
}

/// Differences of two channels, by colour and texel.
struct Others([[f32; TEXELS]; 4]);

impl Others {
    /// Those of all channels but one.
    #[inline(always)]
    fn new<S: Simd>(simd: S, goal: &BlockGoal, thirds: &Thirds, ends: Ends, but: usize) -> Self {
        let (a, b) = ((but + 1) % 3, (but + 2) % 3);
        let (values_a, values_b) = (thirds.values(ends[a], a), thirds.values(ends[b], b));
        let mut others = [[0.0; TEXELS]; 4];
        for part in 0..TEXELS / S::F32_LANES {
            let (lanes_a, lanes_b): (Lanes<S>, Lanes<S>) =
                (goal.lanes(simd, a, part), goal.lanes(simd, b, part));
            for (others, (a, b)) in others.iter_mut().zip(values_a.into_iter().zip(values_b)) {
                let error = simd.add_f32s(lanes_a.error(simd, a), lanes_b.error(simd, b));
                S::as_mut_simd_f32s(others).0[part] = error;
            }
        }
        Others(others)
    }

    /// The error when each texel takes the best of the four colours.
    #[inline(always)]
    fn total_with<S: Simd>(&self, simd: S, goal: &BlockGoal, values: [&Line; 4], channel: usize) -> f32 {
        let mut least = [0.0; TEXELS];
        for (part, least) in S::as_mut_simd_f32s(&mut least).0.iter_mut().enumerate() {
            let lanes: Lanes<S> = goal.lanes(simd, channel, part);
            *least = simd.splat_f32s(f32::INFINITY);
            for (value, others) in values.into_iter().zip(&self.0) {
                let error = simd.add_f32s(lanes.error(simd, value), lanes_of::<S>(others, part));
                *least = simd.min_f32s(*least, error);
            }
        }
        sum(&least)
    }
}

/// The ends nearest to the exact solution, given what each texel takes of them.
#[inline(always)]
fn fit<S: Simd>(simd: S, chosen: &Nearest, goal: &BlockGoal) -> Ends {
    let shares = chosen.choices.map(|choice| SHARES[choice as usize & 3]);
    let mut ends = [[0; 2]; 3];
    for c in 0..3 {
        let (a, b) = least_squares(simd, &shares, &goal.v[c], &goal.weight[c]);
        ends[c] = [quantize(a, c), quantize(b, c)];
    }
    ends
}

#[inline(always)]
fn pack(ends: Ends, choices: &[u32; TEXELS]) -> [u8; 8] {
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
        let choice = if all { 0 } else { choice ^ u32::from(exchange) };
        bits |= choice << (2 * i);
    }
    let mut block = [0; 8];
    block[..2].copy_from_slice(&packed[0].to_le_bytes());
    block[2..4].copy_from_slice(&packed[1].to_le_bytes());
    block[4..].copy_from_slice(&bits.to_le_bytes());
    block
}
