// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_hsv.wesl, by ./x shaders. Needs: nothing else

// Hue, saturation and value.

#ifndef KINRAN_DETAIL_HSV_METAL
#define KINRAN_DETAIL_HSV_METAL

#include <metal_stdlib>

/// A linear colour in [0, 1]³ with its hue turned by `shift.x` turns, its HSV saturation multiplied by `shift.y` and its
/// value by `shift.z`; `(0, 1, 1)` leaves it as it is. Both are clamped to 1 (Smith. Color gamut transform pairs. 1978).
///
/// Cost on GCN: 42 instructions (2 at a quarter of the rate).
inline metal::float3 hsv_shift(
    metal::float3 color,
    metal::float3 shift
) {
    float value = metal::max(color.x, metal::max(color.y, color.z));
    float chroma = value - metal::min(color.x, metal::min(color.y, color.z));
    float scale = 1.0 / metal::max(chroma, 0.00000000000000000001);
    metal::float3 differences = (color.yzx - color.zxy) * scale;
    float green_or_blue = (color.y >= value) ? (2.0 + differences.y) : (4.0 + differences.z);
    float sector = (color.x >= value) ? differences.x : green_or_blue;
    float hue = (sector * 0.16666667) + shift.x;
    float saturation = metal::saturate((chroma / metal::max(value, 0.00000000000000000001)) * shift.y);
    metal::float3 k = 6.0 * metal::fract(metal::float3(hue) + metal::float3(0.0, 0.6666667, 0.33333334));
    metal::float3 weight = metal::saturate(metal::abs(k - metal::float3(3.0)) - metal::float3(1.0));
    return metal::saturate(value * shift.z) * (metal::float3(1.0) + ((weight - metal::float3(1.0)) * saturation));
}

#endif
