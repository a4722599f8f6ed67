//! BC7: the encoder's partition and mode, its ends and choices made anew by the blended error; and one line for all
//! texels (mode 6) beside it.

use std::sync::LazyLock;

use kinran_image::{Format, decode};
use pulp::Simd;

use super::{BlockGoal, Line, Nearest, TEXELS, dot, least_squares};

/// Rounds of fitting ends to the texels that chose them.
const ROUNDS: usize = 2;

/// What the bits of a mode are (Khronos Data Format Specification 1.3, section 20). Modes 4, 5 and 7 are kept as the
/// encoder made them: they are for alpha.
#[derive(Clone, Copy)]
struct Mode {
    number: u32,
    subsets: usize,
    partition_bits: u32,
    color_bits: u32,
    alpha_bits: u32,
    /// Ends that share one lowest bit; 0 where there is none.
    ends_per_bit: usize,
    index_bits: u32,
}

const MODES: [Mode; 5] = [
    Mode {
        number: 0,
        subsets: 3,
        partition_bits: 4,
        color_bits: 4,
        alpha_bits: 0,
        ends_per_bit: 1,
        index_bits: 3,
    },
    Mode {
        number: 1,
        subsets: 2,
        partition_bits: 6,
        color_bits: 6,
        alpha_bits: 0,
        ends_per_bit: 2,
        index_bits: 3,
    },
    Mode {
        number: 2,
        subsets: 3,
        partition_bits: 6,
        color_bits: 5,
        alpha_bits: 0,
        ends_per_bit: 0,
        index_bits: 2,
    },
    Mode {
        number: 3,
        subsets: 2,
        partition_bits: 6,
        color_bits: 7,
        alpha_bits: 0,
        ends_per_bit: 1,
        index_bits: 2,
    },
    ONE_LINE,
];

const ONE_LINE: Mode = Mode {
    number: 6,
    subsets: 1,
    partition_bits: 0,
    color_bits: 7,
    alpha_bits: 7,
    ends_per_bit: 1,
    index_bits: 4,
};

/// 64ths of the second end, by bits of the index.
fn shares(index_bits: u32) -> &'static [i32] {
    match index_bits {
        2 => &[0, 21, 43, 64],
        3 => &[0, 9, 18, 27, 37, 46, 55, 64],
        _ => &[0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64],
    }
}

/// Which subset each texel is in, and which texels have an index without its highest bit, for two and three subsets.
struct Partitions {
    subsets: [[[u8; TEXELS]; 64]; 2],
    anchors: [[[bool; TEXELS]; 64]; 2],
}

/// Read off blocks that a decoder is given: of modes 1 and 2, where subsets have ends of their own and all indices are
/// zero; and where all bits of indices are set, so that a texel whose index lacks one does not reach the second end.
static PARTITIONS: LazyLock<Box<Partitions>> = LazyLock::new(|| {
    let mut partitions = Partitions { subsets: [[[0; TEXELS]; 64]; 2], anchors: [[[false; TEXELS]; 64]; 2] };
    for (i, mode) in [MODES[1], MODES[2]].into_iter().enumerate() {
        for partition in 0..64 {
            let mut block =
                Block { mode, partition, ends: [[[0; 3]; 2]; 3], low: [[0; 2]; 3], choices: [0; TEXELS] };
            let largest = (1 << mode.color_bits) - 1;
            for subset in 0..mode.subsets {
                block.ends[subset] = [[largest * subset as i32 / 2; 3]; 2];
            }
            let nowhere = [false; TEXELS];
            let level = |texel: [f32; 4]| (texel[0] * 2.0).round() as u8;
            let decoded = decoded(&block.pack(&nowhere));
            partitions.subsets[i][partition] = decoded.map(level);
            block.ends = [[[0; 3], [largest; 3]]; 3];
            block.low = [[0, 1]; 3];
            // Mode 1 shares its lowest bit between ends: with none set the second is 126 of 127.
            let mut bits = u128::from_le_bytes(block.pack(&nowhere));
            bits |= u128::MAX << block.index_start();
            let reached = self::decoded(&bits.to_le_bytes());
            partitions.anchors[i][partition] = reached.map(|texel| texel[0] < 0.9);
        }
    }
    Box::new(partitions)
});

fn decoded(block: &[u8; 16]) -> [[f32; 4]; TEXELS] {
    let texels = decode(Format::Bc7, block, 4, 4).unwrap_or_default();
    std::array::from_fn(|i| texels.get(i).copied().unwrap_or_default())
}

/// A block of one of [`MODES`].
#[derive(Clone, Copy)]
struct Block {
    mode: Mode,
    partition: usize,
    /// Subset, end, channel: what is stored, without the lowest bit where that is shared.
    ends: [[[i32; 3]; 2]; 3],
    /// Lowest bits by subset and end.
    low: [[i32; 2]; 3],
    choices: [u8; TEXELS],
}

impl Block {
    /// `None` for other modes, and for a line whose alpha is not one.
    fn read(bytes: &[u8]) -> Option<Self> {
        let mut block = [0; 16];
        block.copy_from_slice(bytes);
        let all = u128::from_le_bytes(block);
        let mode = *MODES.iter().find(|mode| mode.number == all.trailing_zeros())?;
        let mut at = mode.number + 1;
        let mut take = |bits: u32| {
            let value = (all >> at) & ((1 << bits) - 1);
            at += bits;
            value as i32
        };
        let mut read = Block {
            mode,
            partition: take(mode.partition_bits) as usize,
            ends: [[[0; 3]; 2]; 3],
            low: [[0; 2]; 3],
            choices: [0; TEXELS],
        };
        for channel in 0..3 {
            for ends in &mut read.ends[..mode.subsets] {
                ends.iter_mut().for_each(|end| end[channel] = take(mode.color_bits));
            }
        }
        let alpha = [take(mode.alpha_bits), take(mode.alpha_bits)];
        match mode.ends_per_bit {
            1 => read.low[..mode.subsets].iter_mut().flatten().for_each(|low| *low = take(1)),
            2 => read.low[..mode.subsets].iter_mut().for_each(|low| *low = [take(1); 2]),
            _ => {}
        }
        if mode.alpha_bits > 0 && (alpha != [127; 2] || read.low[0] != [1; 2]) {
            return None;
        }
        let anchors = read.anchors();
        for (choice, anchor) in read.choices.iter_mut().zip(anchors) {
            *choice = take(mode.index_bits - u32::from(anchor)) as u8;
        }
        Some(read)
    }

    fn subset_of(&self) -> &'static [u8; TEXELS] {
        match self.mode.subsets {
            1 => &[0; TEXELS],
            n => &PARTITIONS.subsets[n - 2][self.partition],
        }
    }

    fn anchors(&self) -> [bool; TEXELS] {
        match self.mode.subsets {
            1 => std::array::from_fn(|i| i == 0),
            n => PARTITIONS.anchors[n - 2][self.partition],
        }
    }

    /// The bit at which indices begin.
    fn index_start(&self) -> u32 {
        let Mode { number, subsets, partition_bits, color_bits, alpha_bits, ends_per_bit, .. } = self.mode;
        let ends = 2 * subsets as u32;
        let low = if ends_per_bit == 0 { 0 } else { ends / ends_per_bit as u32 };
        number + 1 + partition_bits + 3 * ends * color_bits + 2 * alpha_bits + low
    }

    /// The bytes; anchors' choices must lack their highest bit.
    fn pack(&self, anchors: &[bool; TEXELS]) -> [u8; 16] {
        let Mode { number, subsets, partition_bits, color_bits, alpha_bits, ends_per_bit, index_bits } =
            self.mode;
        let (mut all, mut at) = (1_u128 << number, number + 1);
        let mut put = |value: i32, bits: u32| {
            // Without anchors, as partitions are found, indices are zero and the last ones lie behind the block.
            debug_assert!(value == 0 || at + bits <= 128, "{value} of {bits} bits at {at}");
            all |= (value as u128).checked_shl(at).unwrap_or(0);
            at += bits;
        };
        put(self.partition as i32, partition_bits);
        for channel in 0..3 {
            self.ends[..subsets].iter().flatten().for_each(|end| put(end[channel], color_bits));
        }
        put((1 << alpha_bits) - 1, alpha_bits);
        put((1 << alpha_bits) - 1, alpha_bits);
        match ends_per_bit {
            1 => self.low[..subsets].iter().flatten().for_each(|low| put(*low, 1)),
            2 => self.low[..subsets].iter().for_each(|low| put(low[0], 1)),
            _ => {}
        }
        for (&choice, &anchor) in self.choices.iter().zip(anchors) {
            put(i32::from(choice), index_bits - u32::from(anchor));
        }
        all.to_le_bytes()
    }

    /// The bytes, ends exchanged where an anchor asks for it.
    fn packed(mut self) -> [u8; 16] {
        let anchors = self.anchors();
        let subset_of = self.subset_of();
        let largest = (1_u8 << self.mode.index_bits) - 1;
        for i in 0..TEXELS {
            if anchors[i] && self.choices[i] > largest / 2 {
                let subset = usize::from(subset_of[i]);
                self.ends[subset].swap(0, 1);
                self.low[subset].swap(0, 1);
                for j in 0..TEXELS {
                    if subset_of[j] == subset_of[i] {
                        self.choices[j] = largest - self.choices[j];
                    }
                }
            }
        }
        self.pack(&anchors)
    }

    /// What is stored for `v`, 0 to 1, with a lowest bit.
    #[inline(always)]
    fn quantize(mode: &Mode, v: f32, low: i32) -> i32 {
        let largest = (1 << mode.color_bits) - 1;
        let v = v.clamp(0.0, 1.0);
        if mode.ends_per_bit == 0 {
            return (v * largest as f32 + 0.5) as i32;
        }
        let whole = v * (2 * largest + 1) as f32;
        (((whole - low as f32) * 0.5 + 0.5).max(0.0) as i32).min(largest)
    }

    /// An end's channel as 8 bits.
    #[inline(always)]
    fn byte(mode: &Mode, stored: i32, low: i32) -> i32 {
        let (value, bits) = if mode.ends_per_bit == 0 {
            (stored, mode.color_bits)
        } else {
            (stored << 1 | low, mode.color_bits + 1)
        };
        let left = value << (8 - bits);
        left | left >> bits
    }
}

/// Squared differences of a subset's texels and what they choose, given its ends.
#[inline(always)]
fn assign<S: Simd>(
    simd: S,
    mode: &Mode,
    ends: &[[i32; 3]; 2],
    low: [i32; 2],
    goal: &BlockGoal,
    lines: &[Line; 256],
) -> Nearest {
    let bytes: [[i32; 3]; 2] =
        std::array::from_fn(|end| std::array::from_fn(|c| Block::byte(mode, ends[end][c], low[end])));
    let mut colors = [[Line::default(); 3]; 16];
    let shares = shares(mode.index_bits);
    for (color, &share) in colors.iter_mut().zip(shares) {
        for c in 0..3 {
            let byte = ((64 - share) * bytes[0][c] + share * bytes[1][c] + 32) >> 6;
            color[c] = lines[byte as usize & 255];
        }
    }
    goal.nearest(simd, &colors[..shares.len()])
}

/// Lowest bits that a pair of ends may have.
fn low_bits(mode: &Mode) -> &'static [[i32; 2]] {
    match (mode.ends_per_bit, mode.alpha_bits) {
        (0, _) => &[[0, 0]],
        // Alpha is one only so.
        (_, 7) => &[[1, 1]],
        (2, _) => &[[0, 0], [1, 1]],
        _ => &[[0, 0], [0, 1], [1, 0], [1, 1]],
    }
}

/// Replaces a block by one whose blended result is nearer to the target, if there is one.
#[inline(always)]
pub(super) fn choose<S: Simd>(simd: S, block: &mut [u8], goal: &BlockGoal, lines: &[Line; 256]) {
    let mut bytes = [0; 16];
    bytes.copy_from_slice(block);
    let (mut best, mut least) = (None, error_of(&decoded(&bytes), goal, lines));
    let mut line = Block {
        mode: ONE_LINE,
        partition: 0,
        ends: [[[0; 3]; 2]; 3],
        low: [[1; 2]; 3],
        choices: [0; TEXELS],
    };
    line.ends[0] = goal.line(simd).map(|end| end.map(|v| Block::quantize(&ONE_LINE, v, 1)));
    for start in [Block::read(block), Some(line)].into_iter().flatten() {
        let (refined, error) = refine(simd, start, goal, lines);
        if error < least {
            (best, least) = (Some(refined), error);
        }
    }
    if let Some(best) = best {
        block.copy_from_slice(&best.packed());
    }
}

/// Choices by what they are blended to, then ends by least squares, subset by subset.
#[inline(always)]
fn refine<S: Simd>(simd: S, mut block: Block, goal: &BlockGoal, lines: &[Line; 256]) -> (Block, f32) {
    let mode = block.mode;
    let subset_of = block.subset_of();
    let mut total = 0.0;
    for subset in 0..mode.subsets {
        let inside = subset_of.map(|of| if usize::from(of) == subset { 1.0 } else { 0.0 });
        let mut chosen = assign(simd, &mode, &block.ends[subset], block.low[subset], goal, lines);
        let mut least = dot(simd, &chosen.errors, &inside);
        for _ in 0..ROUNDS {
            let ideal = fit(simd, &mode, &chosen.choices, &inside, goal);
            let mut better = false;
            for &low in low_bits(&mode) {
                let ends: [[i32; 3]; 2] = std::array::from_fn(|end| {
                    std::array::from_fn(|c| Block::quantize(&mode, ideal[end][c], low[end]))
                });
                let fitted = assign(simd, &mode, &ends, low, goal, lines);
                let error = dot(simd, &fitted.errors, &inside);
                if error < least {
                    (block.ends[subset], block.low[subset], chosen, least, better) =
                        (ends, low, fitted, error, true);
                }
            }
            if !better {
                break;
            }
        }
        for i in 0..TEXELS {
            if inside[i] > 0.0 {
                block.choices[i] = chosen.choices[i] as u8;
            }
        }
        total += least;
    }
    (block, total)
}

/// The ends nearest to the exact solution, given what each texel of a subset takes of them.
#[inline(always)]
fn fit<S: Simd>(
    simd: S,
    mode: &Mode,
    choices: &[u32; TEXELS],
    inside: &[f32; TEXELS],
    goal: &BlockGoal,
) -> [[f32; 3]; 2] {
    let of_index = shares(mode.index_bits);
    let first = choices.map(|choice| (64 - of_index[choice as usize]) as f32 * (1.0 / 64.0));
    let mut ends = [[0.0; 3]; 2];
    for c in 0..3 {
        let mut weight = [0.0; TEXELS];
        for i in 0..TEXELS {
            weight[i] = goal.weight[c][i] * inside[i];
        }
        let (a, b) = least_squares(simd, &first, &goal.v[c], &weight);
        (ends[0][c], ends[1][c]) = (a, b);
    }
    ends
}

/// The blended error of a block as it is.
#[inline(always)]
fn error_of(texels: &[[f32; 4]; TEXELS], goal: &BlockGoal, lines: &[Line; 256]) -> f32 {
    let mut total = 0.0;
    for c in 0..3 {
        for i in 0..TEXELS {
            let line = &lines[(texels[i][c] * 255.0 + 0.5) as usize & 255];
            let [slope, offset] = if goal.d[c][i] < 0.5 { line.dark } else { line.bright };
            let difference = (slope * goal.d[c][i] + (offset - goal.t[c][i])) * goal.gain[c][i];
            total += difference * difference;
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinran_image::{Encoder, Encoding, Preset, encode};

    /// A block read and packed again is the same block, and its texels are what its ends and choices say.
    #[test]
    fn blocks_of_an_encoder_are_read_as_a_decoder_reads_them() {
        let (width, height) = (128, 128);
        let mut state = 1_u32;
        let rgba: Vec<u8> = (0..width * height)
            .flat_map(|i| {
                state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                let noise = (state >> 24) as f32 * ((i / 4096) as f32 * 0.2);
                let (x, y) = ((i % width) as f32, (i / width) as f32);
                let wave = |k: f32| 110.0 + 70.0 * ((x * k).sin() * (y * 0.3 * k).cos()) + noise * 0.3;
                [wave(0.2) as u8, wave(0.7) as u8, wave(1.3) as u8, 255]
            })
            .collect();
        // Each encoder has its favourite modes.
        let blocks: Vec<u8> = [
            (Encoder::Portable, Preset::Fast),
            (Encoder::Portable, Preset::Normal),
            (Encoder::Ispc, Preset::Fast),
            (Encoder::Ispc, Preset::Normal),
        ]
        .into_iter()
        .flat_map(|(encoder, preset)| {
            encode(Encoding { format: Format::Bc7, encoder, preset }, &rgba, width, height).unwrap()
        })
        .collect();
        let mut known = [0; 8];
        for bytes in blocks.as_chunks::<16>().0 {
            let Some(block) = Block::read(bytes) else { continue };
            known[block.mode.number as usize] += 1;
            assert_eq!(block.packed(), *bytes, "mode {}", block.mode.number);
            let texels = decoded(bytes);
            for (i, texel) in texels.into_iter().enumerate() {
                let subset = usize::from(block.subset_of()[i]);
                let share = shares(block.mode.index_bits)[usize::from(block.choices[i])];
                for c in 0..3 {
                    let end = |end: usize| {
                        Block::byte(&block.mode, block.ends[subset][end][c], block.low[subset][end])
                    };
                    let byte = ((64 - share) * end(0) + share * end(1) + 32) >> 6;
                    assert_eq!(
                        (texel[c] * 255.0 + 0.5) as i32,
                        byte,
                        "mode {}, texel {i}",
                        block.mode.number
                    );
                }
            }
        }
        let seen = known.iter().filter(|&&n| n > 0).count();
        assert!(seen >= 3, "the encoder made blocks of too few modes: {known:?}");
    }

    #[test]
    fn every_subset_of_every_partition_has_one_anchor() {
        for (i, subsets) in [2, 3].into_iter().enumerate() {
            for partition in 0..64 {
                let (of, anchors) = (PARTITIONS.subsets[i][partition], PARTITIONS.anchors[i][partition]);
                for subset in 0..subsets {
                    let count = (0..TEXELS).filter(|&t| anchors[t] && of[t] == subset).count();
                    assert_eq!(count, 1, "{subsets} subsets, partition {partition}, subset {subset}");
                }
                assert!(anchors[0], "the first texel is an anchor");
            }
        }
    }
}
