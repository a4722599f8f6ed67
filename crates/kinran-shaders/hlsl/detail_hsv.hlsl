// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_hsv.wesl, by ./x shaders. Needs: nothing else

// Hue, saturation and value.

#ifndef KINRAN_DETAIL_HSV_HLSL
#define KINRAN_DETAIL_HSV_HLSL

/// A linear colour in [0, 1]³ with its hue turned by `shift.x` turns, its HSV saturation multiplied by `shift.y` and its
/// value by `shift.z`; `(0, 1, 1)` leaves it as it is. Both are clamped to 1 (Smith. Color gamut transform pairs. 1978).
///
/// Cost on GCN: 42 instructions (2 at a quarter of the rate).
float3 hsv_shift(float3 color, float3 shift)
{
    float value = max(color.x, max(color.y, color.z));
    float chroma = value - min(color.x, min(color.y, color.z));
    float scale = 1.0 / max(chroma, 1e-20);
    float3 differences = (color.yzx - color.zxy) * scale;
    float green_or_blue = (color.y >= value) ? (2.0 + differences.y) : (4.0 + differences.z);
    float sector = (color.x >= value) ? differences.x : green_or_blue;
    float hue = (sector * 0.16666667) + shift.x;
    float saturation = saturate(((chroma / max(value, 1e-20)) * shift.y));
    float3 k = 6.0 * frac(((hue).xxx + float3(0.0, 0.6666667, 0.33333334)));
    float3 weight = saturate((abs((k - (3.0).xxx)) - (1.0).xxx));
    return saturate((value * shift.z)) * ((1.0).xxx + ((weight - (1.0).xxx) * saturation));
}

#endif
