// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_overlay.wesl, by ./x shaders. Needs: nothing else

// Overlay and the talk's smooth overlay: a synthesized value `s` lays itself over a detail `d` so that every target can
// be reached (slides: Detail Maps). Both are solved for `s` when textures are baked.
//
// Colour is linear light: sample the tile with sRGB decoding, the synthesized map without.

/// Overlay of a detail `d` by a synthesized value `s`, both in [0, 1] (slide: Detail Maps | Our Approach):
/// `2sd` below s = 1/2, `1 - 2(1-s)(1-d)` from there on.
///
/// Cost on GCN: 7 instructions.
fn overlay(s: f32, d: f32) -> f32 {
    return select(1.0 - 2.0 * (1.0 - s) * (1.0 - d), 2.0 * s * d, s < 0.5);
}

/// `overlay` of each channel.
///
/// Cost on GCN: 21 instructions.
fn overlay_color(s: vec3f, d: vec3f) -> vec3f {
    return vec3f(overlay(s.x, d.x), overlay(s.y, d.y), overlay(s.z, d.z));
}

/// The talk's smooth overlay, finer near `t = d` where a dark detail is brightened (slide: Detail Maps | Blending): as
/// `overlay`, but `lerp(2sd, s, (2s-1)²)` where s ≥ 1/2 and d < 1/2.
///
/// Cost on GCN: 13 instructions.
fn smooth_overlay(s: f32, d: f32) -> f32 {
    let x = 2.0 * s - 1.0;
    let low = 2.0 * s * d;
    let bright = 1.0 - 2.0 * (1.0 - s) * (1.0 - d);
    let dark = low + (s - low) * x * x;
    return select(select(bright, dark, d < 0.5), low, s < 0.5);
}

/// `smooth_overlay` of each channel.
///
/// Cost on GCN: 39 instructions.
fn smooth_overlay_color(s: vec3f, d: vec3f) -> vec3f {
    return vec3f(smooth_overlay(s.x, d.x), smooth_overlay(s.y, d.y), smooth_overlay(s.z, d.z));
}
