//! Blocks of BC7 whose opaque texels decode to alpha 255.
//!
//! Mode 6 stores end points with 7 bits a channel and a lowest bit that red, green, blue and alpha share. Encoders choose
//! that bit by the colour, and where it is 0 alpha becomes 254. Here both of a block's lowest bits become 1, which leaves
//! colour the odd values, and its end points and indices are fitted again (Khronos Data Format 1.4, section 20.1).
//!
//! Where opaque texels stand beside others, an encoder may store an alpha near 255 for both. Mode 5 stores alpha by itself, in
//! 8 bits: with 255 as one end point opaque texels are exact.

/// Weights of 4-bit indices, of 64.
const WEIGHTS: [i16; 16] = [0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64];

/// Weights of 2-bit indices.
const WEIGHTS_OF_2: [i16; 4] = [0, 21, 43, 64];

/// Times that end points are fitted to the indices and indices to the end points: the second gains up to 0.2 dB, a third
/// 0.02.
const ROUNDS: usize = 2;

/// Rewrites a block of `texels`, RGBA and all opaque, if it is of mode 6 and would decode to another alpha than 255.
pub(crate) fn keep_opaque(texels: &[[u8; 4]; 16], block: &mut [u8; 16]) {
    let bits = u128::from_le_bytes(*block);
    // Mode, then two end points each of red, green, blue and alpha, the lowest bits and the indices.
    let field = |at: u32, count: u32| (bits >> at) as u32 & ((1 << count) - 1);
    if field(0, 7) != 1 << 6 || field(49, 16) == 0xffff {
        return;
    }
    let lowest = [field(63, 1), field(64, 1)];
    let mut ends: [[i16; 2]; 3] = std::array::from_fn(|channel| {
        std::array::from_fn(|end| {
            (field(7 + 14 * channel as u32 + 7 * end as u32, 7) << 1 | lowest[end]) as i16
        })
    });
    // The first index lacks its highest bit.
    let mut indices: [usize; 16] = std::array::from_fn(|i| match i {
        0 => field(65, 3) as usize,
        _ => field(64 + 4 * i as u32, 4) as usize,
    });

    let planes: [[i16; 16]; 3] = std::array::from_fn(|c| std::array::from_fn(|i| i16::from(texels[i][c])));
    let (mut best, mut least) = ((ends, indices), i32::MAX);
    for _ in 0..ROUNDS {
        let weights = indices.map(|index| WEIGHTS[index]);
        for (ends, plane) in ends.iter_mut().zip(&planes) {
            *ends = fitted_ends(*ends, &weights, plane, |code| 2 * code + 1);
        }
        let error;
        (indices, error) = nearest_indices(&WEIGHTS, &ends, &planes);
        if error < least {
            (best, least) = ((ends, indices), error);
        }
    }

    let (mut ends, mut indices) = best;
    if indices[0] > 7 {
        ends.iter_mut().for_each(|pair| pair.reverse());
        indices.iter_mut().for_each(|index| *index = 15 - *index);
    }
    let mut bits: u128 = 1 << 6 | 0xffff << 49;
    for (channel, pair) in ends.iter().enumerate() {
        for (end, value) in pair.iter().enumerate() {
            bits |= ((value >> 1) as u128) << (7 + 14 * channel + 7 * end);
        }
    }
    bits |= (indices[0] as u128) << 65;
    for (i, index) in indices.iter().enumerate().skip(1) {
        bits |= (*index as u128) << (64 + 4 * i);
    }
    *block = bits.to_le_bytes();
}

/// A block of mode 5 in which opaque ones of `texels`, RGBA, have alpha 255.
pub(crate) fn with_own_alpha(texels: &[[u8; 4]; 16]) -> [u8; 16] {
    let planes: [[i16; 16]; 4] = std::array::from_fn(|c| std::array::from_fn(|i| i16::from(texels[i][c])));
    let colors = [planes[0], planes[1], planes[2]];
    // Of colour, from the two texels that are farthest apart.
    let apart = |a: usize, b: usize| colors.iter().map(|plane| squared(plane[a] - plane[b])).sum::<i32>();
    let pairs = (0..16).flat_map(|a| (0..a).map(move |b| (a, b)));
    let (a, b) = pairs.max_by_key(|&(a, b)| apart(a, b)).unwrap_or_default();
    let stored = |code: i16| code << 1 | code >> 6;
    let mut ends = colors.map(|plane| [plane[a], plane[b]].map(|value| stored(value >> 1)));
    let (mut indices, error) = nearest_indices(&WEIGHTS_OF_2, &ends, &colors);
    let (mut best, mut least) = ((ends, indices), error);
    for _ in 0..ROUNDS {
        let weights = indices.map(|index| WEIGHTS_OF_2[index]);
        for (ends, plane) in ends.iter_mut().zip(&colors) {
            *ends = fitted_ends(*ends, &weights, plane, stored);
        }
        let error;
        (indices, error) = nearest_indices(&WEIGHTS_OF_2, &ends, &colors);
        if error < least {
            (best, least) = ((ends, indices), error);
        }
    }
    let (mut ends, mut indices) = best;

    let lowest = planes[3].iter().copied().min().unwrap_or(255);
    let mut alphas = [lowest, 255];
    let mut levels = planes[3].map(|alpha| {
        let off = |index: &usize| (interpolated(alphas, WEIGHTS_OF_2[*index]) - alpha).abs();
        // The last of the nearest, so that 255 is the end.
        (0..4).rev().min_by_key(off).unwrap_or(3)
    });

    // The first indices lack their highest bits.
    let turn = |indices: &mut [usize; 16]| indices.iter_mut().for_each(|index| *index = 3 - *index);
    if indices[0] > 1 {
        ends.iter_mut().for_each(|pair| pair.reverse());
        turn(&mut indices);
    }
    if levels[0] > 1 {
        alphas.reverse();
        turn(&mut levels);
    }
    let mut bits: u128 = 1 << 5;
    for (channel, pair) in ends.iter().enumerate() {
        for (end, value) in pair.iter().enumerate() {
            bits |= ((value >> 1) as u128) << (8 + 14 * channel + 7 * end);
        }
    }
    bits |= (alphas[0] as u128) << 50 | (alphas[1] as u128) << 58;
    for (first, indices) in [(66, indices), (97, levels)] {
        bits |= (indices[0] as u128) << first;
        for (i, index) in indices.iter().enumerate().skip(1) {
            bits |= (*index as u128) << (first + 2 * i - 1);
        }
    }
    bits.to_le_bytes()
}

/// What a channel decodes to, by 16-bit numbers: 64 times 255 is one.
fn interpolated(ends: [i16; 2], weight: i16) -> i16 {
    ((64 - weight) * ends[0] + weight * ends[1] + 32) >> 6
}

fn squared(difference: i16) -> i32 {
    i32::from(difference) * i32::from(difference)
}

/// The end points of a channel with the least squared error: of nine, those around the best real ones. Of 7 bits is
/// `stored` what they say.
fn fitted_ends(
    ends: [i16; 2],
    weights: &[i16; 16],
    plane: &[i16; 16],
    stored: impl Fn(i16) -> i16,
) -> [i16; 2] {
    // The normal equations of (64 - w) a + w b = 64 t, whose sums are whole numbers.
    let (mut aa, mut ab, mut bb, mut at, mut bt) = (0, 0, 0, 0, 0);
    for (w, t) in weights.iter().zip(plane) {
        let (w, t) = (i32::from(*w), i32::from(*t));
        let v = 64 - w;
        aa += v * v;
        ab += v * w;
        bb += w * w;
        at += v * t;
        bt += w * t;
    }
    let [aa, ab, bb, at, bt] = [aa, ab, bb, at, bt].map(f64::from);
    let determinant = aa * bb - ab * ab;
    let real = if determinant > 0.0 {
        [(bb * at - ab * bt) / determinant, (aa * bt - ab * at) / determinant].map(|end| 64.0 * end)
    } else {
        ends.map(f64::from)
    };
    let near = real.map(|end| (end.clamp(0.0, 255.0) / 2.0) as i16);

    let (mut best, mut least) = (ends, i32::MAX);
    for a in [near[0], near[0] - 1, near[0] + 1] {
        for b in [near[1], near[1] - 1, near[1] + 1] {
            if !(0..128).contains(&a) || !(0..128).contains(&b) {
                continue;
            }
            let (a, b) = (stored(a), stored(b));
            let error = weights.iter().zip(plane).map(|(w, t)| squared(interpolated([a, b], *w) - t)).sum();
            if error < least {
                (best, least) = ([a, b], error);
            }
        }
    }
    best
}

/// The index of each texel that brings its colour nearest, and the sum of squared errors.
fn nearest_indices(weights: &[i16], ends: &[[i16; 2]; 3], planes: &[[i16; 16]; 3]) -> ([usize; 16], i32) {
    let mut least = [i32::MAX; 16];
    let mut nearest = [0_i32; 16];
    for (index, weight) in (0..).zip(weights) {
        let color = ends.map(|pair| interpolated(pair, *weight));
        for i in 0..16 {
            let error = (0..3).map(|c| squared(color[c] - planes[c][i])).sum();
            let nearer = error < least[i];
            nearest[i] = if nearer { index } else { nearest[i] };
            least[i] = if nearer { error } else { least[i] };
        }
    }
    (nearest.map(|index| index as usize), least.iter().sum())
}
