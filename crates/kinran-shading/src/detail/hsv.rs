//! Hue, saturation and value.

use glam::{Vec3, vec3};

/// A linear colour in [0, 1]³ with its hue turned by `shift.x` turns, its HSV saturation multiplied by `shift.y` and its
/// value by `shift.z`; `(0, 1, 1)` leaves it as it is. Both are clamped to 1 (Smith. Color gamut transform pairs.
/// 1978).
#[inline]
pub fn hsv_shift(color: Vec3, shift: Vec3) -> Vec3 {
    let value = color.max_element();
    let chroma = value - color.min_element();
    // A colour without chroma has no saturation, whatever hue this gives it.
    let scale = 1.0 / chroma.max(1e-20);
    let sector = if color.x >= value {
        (color.y - color.z) * scale
    } else if color.y >= value {
        2.0 + (color.z - color.x) * scale
    } else {
        4.0 + (color.x - color.y) * scale
    };
    let hue = sector * (1.0 / 6.0) + shift.x;
    let saturation = (chroma / value.max(1e-20) * shift.y).clamp(0.0, 1.0);
    let value = (value * shift.z).clamp(0.0, 1.0);
    // Each channel as a trapezoid of the hue, in sixths of a turn, red at 0.
    let channel = |at: f32| {
        let turn = hue + at;
        let k = 6.0 * (turn - libm::floorf(turn));
        let weight = ((k - 3.0).abs() - 1.0).clamp(0.0, 1.0);
        value * (1.0 + (weight - 1.0) * saturation)
    };
    vec3(channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0))
}
