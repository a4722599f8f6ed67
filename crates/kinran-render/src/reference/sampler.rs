//! Deterministic stratified random numbers.
//!
//! Every pair of dimensions is an Owen-scrambled, shuffled copy of the first two dimensions of Sobol's
//! sequence (Burley. Practical Hash-based Owen Scrambling. JCGT 2020): any aligned power-of-two run of
//! samples is a (0, 2)-net, and pairs are independent of each other and from pixel to pixel.

use glam::{Vec2, vec2};

/// Sample `index` of the two-dimensional sequence numbered `pair`, in [0, 1)². Different seeds give
/// independent sequences.
#[inline]
pub(crate) fn sample_2d(index: u32, pair: u32, seed: u32) -> Vec2 {
    let seed = hash(seed ^ pair.wrapping_mul(0x9E37_79B9));
    let index = owen_scramble(index, seed);
    let x = owen_scramble(index.reverse_bits(), hash(seed ^ 0x6573_2F2B));
    let y = owen_scramble(sobol_1(index), hash(seed ^ 0xB5AD_4ECE));
    // 24 bits are what f32 holds below one.
    vec2((x >> 8) as f32, (y >> 8) as f32) * (1.0 / 16_777_216.0)
}

/// A seed for each pixel of a picture of seed `picture`.
#[inline]
pub(crate) fn pixel_seed(x: u32, y: u32, picture: u32) -> u32 {
    // An odd factor keeps pictures apart; another one than that of pairs, so that no picture's first pair is another's second.
    hash(hash(x).wrapping_add(y)) ^ picture.wrapping_mul(0x85EB_CA6B)
}

/// The second dimension of Sobol's sequence, as a fraction of 2^32.
#[inline]
fn sobol_1(index: u32) -> u32 {
    let (mut bits, mut column, mut x) = (index, 1u32 << 31, 0);
    while bits != 0 {
        if bits & 1 != 0 {
            x ^= column;
        }
        column ^= column >> 1;
        bits >>= 1;
    }
    x
}

/// Owen scrambling by the hash of Laine and Karras, constants of Burley's listing 3.
#[inline]
fn owen_scramble(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits().wrapping_add(seed);
    x ^= x.wrapping_mul(0x6C50_B47C);
    x ^= x.wrapping_mul(0xB82F_1E52);
    x ^= x.wrapping_mul(0xC7AF_E638);
    x ^= x.wrapping_mul(0x8D22_F6E6);
    x.reverse_bits()
}

/// The finaliser of MurmurHash3.
#[inline]
fn hash(mut x: u32) -> u32 {
    x = x.wrapping_add(0x9E37_79B9);
    x = (x ^ (x >> 16)).wrapping_mul(0x85EB_CA6B);
    x = (x ^ (x >> 13)).wrapping_mul(0xC2B2_AE35);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every elementary interval of area 1/64 holds one of 64 points: the property that makes it a (0, 2)-net.
    #[test]
    fn aligned_runs_are_nets() {
        for (seed, pair, start) in [(1, 0, 0), (77, 3, 64), (0xFFFF_FFFF, 1, 192), (5, 2, 1 << 20)] {
            let points: Vec<Vec2> = (start..start + 64).map(|i| sample_2d(i, pair, seed)).collect();
            for log_columns in 0..=6 {
                let (columns, rows) = (1usize << log_columns, 64usize >> log_columns);
                let mut count = vec![0; 64];
                for p in &points {
                    count[(p.y * rows as f32) as usize * columns + (p.x * columns as f32) as usize] += 1;
                }
                assert!(count.iter().all(|&c| c == 1), "seed {seed}, {columns}x{rows} strata: {count:?}");
            }
        }
    }

    #[test]
    fn pairs_and_pixels_are_independent() {
        // The correlation of 4096 independent pairs has a standard deviation of 1/64.
        let correlation = |a: &dyn Fn(u32) -> f32, b: &dyn Fn(u32) -> f32| -> f32 {
            (0..4096).map(|i| (a(i) - 0.5) * (b(i) - 0.5)).sum::<f32>() * 12.0 / 4096.0
        };
        let base = |i| sample_2d(i, 0, 9).x;
        let others: [(&str, &dyn Fn(u32) -> f32); 3] = [
            ("y", &|i| sample_2d(i, 0, 9).y),
            ("pair", &|i| sample_2d(i, 1, 9).x),
            ("seed", &|i| sample_2d(i, 0, 10).x),
        ];
        for (name, other) in others {
            let c = correlation(&base, other);
            assert!(c.abs() < 5.0 / 64.0, "{name}: correlation {c}");
        }
        let neighbours = correlation(&|i| sample_2d(0, 0, pixel_seed(i % 64, i / 64, 0)).x, &|i| {
            sample_2d(0, 0, pixel_seed(i % 64 + 1, i / 64, 0)).x
        });
        assert!(neighbours.abs() < 5.0 / 64.0, "neighbouring pixels: correlation {neighbours}");
        for (a, b, pair) in [(0, 1, 0), (1, 2, 0), (0, 1, 1), (1, 0, 1)] {
            let seeds = correlation(&|i| sample_2d(0, 0, pixel_seed(i % 64, i / 64, a)).x, &|i| {
                sample_2d(0, pair, pixel_seed(i % 64, i / 64, b)).x
            });
            assert!(seeds.abs() < 5.0 / 64.0, "pictures {a} and {b}, pair {pair}: correlation {seeds}");
        }
    }
}
