//! Which texels of level 0 a texel of another level stands for, along one axis.

use kinran_image::level_size;
use kinran_scene::Wrap;

use crate::channels::wrapped;

/// The shape of the footprint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kernel {
    /// The texel's own area: what mip generators use. Odd sizes share a texel between neighbours.
    #[default]
    Box,
    /// `[1 3 3 1] / 8` from level to level: twice as wide, smoother over distance, reaches over the border.
    Tent,
}

/// Texels of the finer level and their weights, which add up to one.
pub type Taps = Vec<(u32, f32)>;

/// Taps that reduce level `level - 1` to `level`, for every texel of `level`, along an axis of `size` texels
/// at level 0.
pub fn reduction(size: u32, level: usize, kernel: Kernel, wrap: Wrap) -> Vec<Taps> {
    let fine = level_size(size, level - 1);
    let coarse = level_size(size, level);
    if fine == 1 {
        return vec![vec![(0, 1.0)]];
    }
    let ratio = f64::from(fine) / f64::from(coarse);
    (0..coarse)
        .map(|x| {
            let (begin, end) = (f64::from(x) * ratio, f64::from(x + 1) * ratio);
            let mut taps = Taps::new();
            let mut add = |i: i64, weight: f64| {
                let i = wrapped(i, fine, wrap);
                match taps.iter_mut().find(|tap| tap.0 == i) {
                    Some(tap) => tap.1 += weight as f32,
                    None => taps.push((i, weight as f32)),
                }
            };
            match kernel {
                Kernel::Box => {
                    for i in begin.floor() as i64..end.ceil() as i64 {
                        let covered = (i as f64 + 1.0).min(end) - (i as f64).max(begin);
                        add(i, covered / ratio);
                    }
                }
                Kernel::Tent => {
                    let center = 0.5 * (begin + end);
                    let reach = ratio;
                    let overlaps = (center - reach).floor() as i64..(center + reach).ceil() as i64;
                    for i in overlaps {
                        let weight = tent_integral((i as f64 + 1.0 - center) / reach)
                            - tent_integral((i as f64 - center) / reach);
                        add(i, weight);
                    }
                }
            }
            taps.retain(|tap| tap.1 > 0.0);
            taps.sort_by_key(|tap| tap.0);
            debug_assert!(is_average(&taps), "{taps:?}");
            taps
        })
        .collect()
}

/// Taps that average an axis of `fine` texels to one of `coarse`, no more than these, by the area that texels cover.
pub(crate) fn area_taps(fine: u32, coarse: u32) -> Vec<Taps> {
    let ratio = f64::from(fine) / f64::from(coarse);
    (0..coarse)
        .map(|x| {
            let (begin, end) = (f64::from(x) * ratio, f64::from(x + 1) * ratio);
            let last = (end.ceil() as u32).min(fine);
            (begin.floor() as u32..last)
                .map(|i| (i, (((f64::from(i) + 1.0).min(end) - f64::from(i).max(begin)) / ratio) as f32))
                .filter(|tap| tap.1 > 0.0)
                .collect()
        })
        .collect()
}

/// Taps in order, with weights that add up to one.
fn is_average(taps: &Taps) -> bool {
    let sum: f32 = taps.iter().map(|tap| tap.1).sum();
    taps.is_sorted_by(|a, b| a.0 < b.0) && (sum - 1.0).abs() < 1e-3
}

/// Integral of the unit tent `1 - |t|` on [−1, 1] from −1 to `t`.
fn tent_integral(t: f64) -> f64 {
    let t = t.clamp(-1.0, 1.0);
    if t < 0.0 { 0.5 * (1.0 + t) * (1.0 + t) } else { 1.0 - 0.5 * (1.0 - t) * (1.0 - t) }
}

/// Taps into level 0 for every texel of levels 1, 2, …: the reductions composed, so that a filter which works
/// from level 0 sees exactly the footprints of one that works from level to level.
pub fn footprints(size: u32, levels: usize, kernel: Kernel, wrap: Wrap) -> Vec<Vec<Taps>> {
    let mut all: Vec<Vec<Taps>> = Vec::with_capacity(levels.saturating_sub(1));
    for level in 1..levels {
        let step = reduction(size, level, kernel, wrap);
        let next = match all.last() {
            None => step,
            Some(finer) => step.iter().map(|taps| compose(taps, finer)).collect(),
        };
        all.push(next);
    }
    all
}

fn compose(taps: &Taps, finer: &[Taps]) -> Taps {
    let mut sum: Taps = Vec::new();
    for &(i, weight) in taps {
        sum.extend(finer[i as usize].iter().map(|&(j, w)| (j, w * weight)));
    }
    sum.sort_by_key(|tap| tap.0);
    sum.dedup_by(|b, a| {
        let same = a.0 == b.0;
        if same {
            a.1 += b.1;
        }
        same
    });
    debug_assert!(is_average(&sum), "{sum:?}");
    sum
}
