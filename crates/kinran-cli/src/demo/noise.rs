//! Repeatable randomness for the demo's materials.

use glam::Vec2;

/// A number in [0, 1) that depends on nothing but its arguments (PCG's output permutation; Jarzynski, Olano.
/// Hash Functions for GPU Rendering. JCGT 2020).
pub(crate) fn random(x: i32, y: i32, seed: u32) -> f32 {
    let pcg = |v: u32| {
        let state = v.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        (word >> 22) ^ word
    };
    let hash = pcg(pcg(pcg(seed).wrapping_add(x as u32)).wrapping_add(y as u32));
    (hash >> 8) as f32 / (1 << 24) as f32
}

/// As [`random`], in [-1, 1).
pub(crate) fn signed(x: i32, y: i32, seed: u32) -> f32 {
    2.0 * random(x, y, seed) - 1.0
}

/// Smooth noise in [-1, 1], random at whole coordinates, that repeats after `period` along each axis.
pub(crate) fn noise(p: Vec2, period: [i32; 2], seed: u32) -> f32 {
    let corner = p.floor();
    let f = p - corner;
    let f = f * f * (Vec2::splat(3.0) - 2.0 * f);
    let at = |dx: i32, dy: i32| {
        let x = (corner.x as i32 + dx).rem_euclid(period[0]);
        let y = (corner.y as i32 + dy).rem_euclid(period[1]);
        signed(x, y, seed)
    };
    let lower = at(0, 0) + (at(1, 0) - at(0, 0)) * f.x;
    let upper = at(0, 1) + (at(1, 1) - at(0, 1)) * f.x;
    lower + (upper - lower) * f.y
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec2;

    #[test]
    fn noise_has_no_seam_and_does_not_leave_its_range() {
        for i in 0..500 {
            let p = vec2(i as f32 * 0.037, i as f32 * 0.11);
            let here = noise(p, [4, 6], 3);
            let again = noise(p + vec2(4.0, -6.0), [4, 6], 3);
            assert!(
                (here - again).abs() < 1e-4 && here.abs() <= 1.0,
                "at {p}: {here}, one period on {again}"
            );
        }
    }

    #[test]
    fn random_numbers_are_evenly_spread() {
        // The mean of 10000 uniform numbers has a standard deviation of 0.0029.
        let mean = (0..10_000).map(|i| f64::from(random(i % 100, i / 100, 7))).sum::<f64>() / 1e4;
        assert!((mean - 0.5).abs() < 0.012, "mean {mean}");
    }
}
