// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_overlay.wesl, by ./x shaders. Needs: nothing else

// Overlay and the talk's smooth overlay: a synthesized value `s` lays itself over a detail `d` so that every target can
// be reached (slides: Detail Maps). Both are solved for `s` when textures are baked.
//
// Colour is linear light: sample the tile with sRGB decoding, the synthesized map without.

#ifndef KINRAN_DETAIL_OVERLAY_GLSL
#define KINRAN_DETAIL_OVERLAY_GLSL

/// Overlay of a detail `d` by a synthesized value `s`, both in [0, 1] (slide: Detail Maps | Our Approach):
/// `2sd` below s = 1/2, `1 - 2(1-s)(1-d)` from there on.
///
/// Cost on GCN: 7 instructions.
float overlay(float s, float d) {
    return (s < 0.5) ? ((2.0 * s) * d) : (1.0 - ((2.0 * (1.0 - s)) * (1.0 - d)));
}

/// `overlay` of each channel.
///
/// Cost on GCN: 21 instructions.
vec3 overlay_color(vec3 s, vec3 d) {
    float _e4 = overlay(s.x, d.x);
    float _e7 = overlay(s.y, d.y);
    float _e10 = overlay(s.z, d.z);
    return vec3(_e4, _e7, _e10);
}

/// The talk's smooth overlay, finer near `t = d` where a dark detail is brightened (slide: Detail Maps | Blending): as
/// `overlay`, but `lerp(2sd, s, (2s-1)²)` where s ≥ 1/2 and d < 1/2.
///
/// Cost on GCN: 13 instructions.
float smooth_overlay(float s, float d) {
    float x = (2.0 * s) - 1.0;
    float low = (2.0 * s) * d;
    float bright = 1.0 - ((2.0 * (1.0 - s)) * (1.0 - d));
    float dark = low + (((s - low) * x) * x);
    return (s < 0.5) ? low : ((d < 0.5) ? dark : bright);
}

/// `smooth_overlay` of each channel.
///
/// Cost on GCN: 39 instructions.
vec3 smooth_overlay_color(vec3 s, vec3 d) {
    float _e4 = smooth_overlay(s.x, d.x);
    float _e7 = smooth_overlay(s.y, d.y);
    float _e10 = smooth_overlay(s.z, d.z);
    return vec3(_e4, _e7, _e10);
}

#endif
