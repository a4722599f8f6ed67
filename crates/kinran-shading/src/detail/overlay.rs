//! Overlay and the talk's smooth overlay, with their inverses.
//!
//! Both are non-decreasing in `s` with f(0) = 0 and f(1) = 1 for every `d`, so every target is reached. The
//! solution is unique but for two plateaus, d = t = 0 (any s ≤ 1/2) and d = t = 1 (any s ≥ 1/2), where 1/2 is
//! chosen: a detail equal to its target asks for nothing.

use crate::sqrt::sqrt;
use glam::Vec3;

/// Divisors below this are zeros whose quotient is not used.
const TINY: f32 = 1e-30;

/// Overlay of a detail `d` by a synthesized value `s`, both in [0, 1] (slide: Detail Maps | Our Approach):
/// `2sd` below s = 1/2, `1 - 2(1-s)(1-d)` from there on.
#[inline(always)]
pub fn overlay(s: f32, d: f32) -> f32 {
    if s < 0.5 { 2.0 * s * d } else { 1.0 - 2.0 * (1.0 - s) * (1.0 - d) }
}

/// [`overlay`] of each channel.
#[inline(always)]
pub fn overlay_color(s: Vec3, d: Vec3) -> Vec3 {
    Vec3::new(overlay(s.x, d.x), overlay(s.y, d.y), overlay(s.z, d.z))
}

/// The `s` with `overlay(s, d) = t`, for `t` and `d` in [0, 1].
#[inline(always)]
pub fn overlay_inverse(t: f32, d: f32) -> f32 {
    let darker = t < d;
    // One division for both sides: it is what this costs.
    let (part, whole) = if darker { (t, d) } else { (1.0 - t, 1.0 - d) };
    let quotient = part / larger(2.0 * whole, TINY);
    if darker {
        quotient
    } else if d >= 1.0 {
        0.5
    } else {
        1.0 - quotient
    }
}

/// Derivative of [`overlay`] by `s`; at the kink, that above it.
#[inline(always)]
pub fn overlay_slope(s: f32, d: f32) -> f32 {
    2.0 * if s < 0.5 { d } else { 1.0 - d }
}

/// The talk's smooth overlay, finer near `t = d` where a dark detail is brightened (slide: Detail Maps |
/// Blending): as [`overlay`], but `lerp(2sd, s, (2s-1)²)` where s ≥ 1/2 and d < 1/2.
///
/// For d ≤ 1/2 the slope is continuous at s = 1/2; above, the kink of overlay remains.
#[inline(always)]
pub fn smooth_overlay(s: f32, d: f32) -> f32 {
    let x = 2.0 * s - 1.0;
    let low = 2.0 * s * d;
    let bright = 1.0 - 2.0 * (1.0 - s) * (1.0 - d);
    let dark = low + (s - low) * x * x;
    if s < 0.5 {
        low
    } else if d < 0.5 {
        dark
    } else {
        bright
    }
}

/// [`smooth_overlay`] of each channel.
#[inline(always)]
pub fn smooth_overlay_color(s: Vec3, d: Vec3) -> Vec3 {
    Vec3::new(smooth_overlay(s.x, d.x), smooth_overlay(s.y, d.y), smooth_overlay(s.z, d.z))
}

/// The `s` with `smooth_overlay(s, d) = t`, for `t` and `d` in [0, 1]: `smooth_overlay` of it is within 3e-7 of
/// `t`.
///
/// Where t ≥ d and d < 1/2, with `x = 2s - 1`, `a = 1 - 2d` and `e = t - d` it is the root of
/// `d x + a x²/2 + a x³/2 = e` in [0, 1]. The start has x² for x³, which lies below the root; two of Halley's steps
/// reach single precision for every d and t. (In `s` the cubic `4a s³ - 4a s² + s - t` cancels near d = 0, and has three
/// real roots for d < 1/8.) The last step shares its division with [`overlay_inverse`].
///
/// It has three parts, for whoever solves many: each division waits for the one before, and one after another for all
/// texels, parts of different texels overlap, where a processor does not look as far ahead as to the next whole.
#[inline(always)]
pub fn smooth_overlay_inverse(t: f32, d: f32) -> f32 {
    let x = smooth_overlay_inverse_start(t, d);
    smooth_overlay_inverse_end(smooth_overlay_inverse_step(x, t, d), t, d)
}

/// The start of [`smooth_overlay_inverse`]: an `x` that is right to a third where d < 1/2 and t ≥ d, and not used elsewhere.
#[inline(always)]
pub fn smooth_overlay_inverse_start(t: f32, d: f32) -> f32 {
    let (a, e) = (1.0 - 2.0 * d, t - d);
    2.0 * e / larger(d + sqrt(larger(d * d + 4.0 * a * e, 0.0)), TINY)
}

/// One step of [`smooth_overlay_inverse`] from `x` on.
#[inline(always)]
pub fn smooth_overlay_inverse_step(x: f32, t: f32, d: f32) -> f32 {
    let (part, whole) = halley(x, t, d);
    x - part / larger(whole, TINY)
}

/// The last step of [`smooth_overlay_inverse`], and what it is where the overlay is plain. Everything is computed, then
/// chosen: so a loop over texels runs in lanes.
#[inline(always)]
pub fn smooth_overlay_inverse_end(x: f32, t: f32, d: f32) -> f32 {
    let (darker, curved) = (t < d, (t >= d) & (d < 0.5));
    let (step_part, step_whole) = halley(x, t, d);
    let plain_part = if darker { t } else { 1.0 - t };
    let plain_whole = 2.0 * if darker { d } else { 1.0 - d };
    let part = if curved { step_part } else { plain_part };
    let whole = if curved { step_whole } else { plain_whole };
    let quotient = part / larger(whole, TINY);
    let brighter = if d >= 1.0 { 0.5 } else { 1.0 - quotient };
    let plain = if darker { quotient } else { brighter };
    if curved { 0.5 + 0.5 * (x - quotient) } else { plain }
}

/// Numerator and denominator of what Halley's step takes off `x`.
#[inline(always)]
fn halley(x: f32, t: f32, d: f32) -> (f32, f32) {
    let (a, e) = (1.0 - 2.0 * d, t - d);
    let (ax, axx) = (a * x, a * x * x);
    let excess = x * (d + 0.5 * (ax + axx)) - e;
    let slope = d + ax + 1.5 * axx;
    let curvature = a + 3.0 * ax;
    (excess * slope, slope * slope - 0.5 * excess * curvature)
}

/// The larger of two numbers that are none but numbers: one instruction, where `f32::max` takes four.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Derivative of [`smooth_overlay`] by `s`; at a kink, that above it.
#[inline(always)]
pub fn smooth_overlay_slope(s: f32, d: f32) -> f32 {
    let (a, x) = (1.0 - 2.0 * d, 2.0 * s - 1.0);
    let dark = 2.0 * d + a * x * (2.0 + 3.0 * x);
    let plain = overlay_slope(s, d);
    if s >= 0.5 && d < 0.5 { dark } else { plain }
}
