// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_hsv.wesl, by ./x shaders. Needs: nothing else

// Hue, saturation and value.

#ifndef KINRAN_DETAIL_HSV_GLSL
#define KINRAN_DETAIL_HSV_GLSL

/// A linear colour in [0, 1]³ with its hue turned by `shift.x` turns, its HSV saturation multiplied by `shift.y` and its
/// value by `shift.z`; `(0, 1, 1)` leaves it as it is. Both are clamped to 1 (Smith. Color gamut transform pairs. 1978).
///
/// Cost on GCN: 42 instructions (2 at a quarter of the rate).
vec3 hsv_shift(vec3 color, vec3 shift) {
    float value = max(color.x, max(color.y, color.z));
    float chroma = value - min(color.x, min(color.y, color.z));
    float scale = 1.0 / max(chroma, 1e-20);
    vec3 differences = (color.yzx - color.zxy) * scale;
    float green_or_blue = (color.y >= value) ? (2.0 + differences.y) : (4.0 + differences.z);
    float sector = (color.x >= value) ? differences.x : green_or_blue;
    float hue = (sector * 0.16666667) + shift.x;
    float saturation = clamp(((chroma / max(value, 1e-20)) * shift.y), 0.0, 1.0);
    vec3 k = 6.0 * fract((vec3(hue) + vec3(0.0, 0.6666667, 0.33333334)));
    vec3 weight = clamp((abs((k - vec3(3.0))) - vec3(1.0)), vec3(0.0), vec3(1.0));
    return clamp((value * shift.z), 0.0, 1.0) * (vec3(1.0) + ((weight - vec3(1.0)) * saturation));
}

#endif
