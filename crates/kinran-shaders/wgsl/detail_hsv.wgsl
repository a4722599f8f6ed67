// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_hsv.wesl, by ./x shaders. Needs: nothing else

// Hue, saturation and value.

/// A linear colour in [0, 1]³ with its hue turned by `shift.x` turns, its HSV saturation multiplied by `shift.y` and its
/// value by `shift.z`; `(0, 1, 1)` leaves it as it is. Both are clamped to 1 (Smith. Color gamut transform pairs. 1978).
///
/// Cost on GCN: 42 instructions (2 at a quarter of the rate).
fn hsv_shift(color: vec3f, shift: vec3f) -> vec3f {
    let value = max(color.x, max(color.y, color.z));
    let chroma = value - min(color.x, min(color.y, color.z));
    // A colour without chroma has no saturation, whatever hue this gives it.
    let scale = 1.0 / max(chroma, 1e-20);
    let differences = (color.yzx - color.zxy) * scale;
    let green_or_blue = select(4.0 + differences.z, 2.0 + differences.y, color.y >= value);
    let sector = select(green_or_blue, differences.x, color.x >= value);
    let hue = sector * (1.0 / 6.0) + shift.x;
    let saturation = saturate(chroma / max(value, 1e-20) * shift.y);
    // Each channel as a trapezoid of the hue, in sixths of a turn, red at 0.
    let k = 6.0 * fract(hue + vec3f(0.0, 2.0 / 3.0, 1.0 / 3.0));
    let weight = saturate(abs(k - 3.0) - 1.0);
    return saturate(value * shift.z) * (1.0 + (weight - 1.0) * saturation);
}
