// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_deferred.wesl, by ./x shaders. Needs: fuzz_layer, fuzz_phase

// Fuzz by seven bits of a G-buffer: fixed fibres over Lambert, for moss and felt.
//
// McAuley. Extension to Energy-Conserving Wrapped Diffuse. 2013.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

/// Density of the layer.
const FUZZ_DEFERRED_DENSITY: f32 = 0.5;

/// Roughness of the fibres: a spread of 0.9. They stand along the normal.
const FUZZ_DEFERRED_ALPHA: f32 = 0.9486833;

/// Albedo of the fibres over that of the Lambert base.
const FUZZ_DEFERRED_ALBEDO: f32 = 5.0;

/// How far light wraps around the terminator, as a cosine.
const FUZZ_WRAP: f32 = 0.2;

/// The cosine of light and normal, softened by wrapping (McAuley 2013; slide: Deferred), n = 2:
/// `(1+n)/(2(1+w)) (max(n_u + w, 0)/(1+w))^n`. Its integral over the sphere is π. Where no light arrives it is 1e-8
/// rather than zero, so that the layer may divide by it.
///
/// Cost on GCN: 4 instructions.
fn fuzz_wrap(n_u: f32) -> f32 {
    let scale = 3.0 / (2.0 * (1.0 + FUZZ_WRAP) * (1.0 + FUZZ_WRAP) * (1.0 + FUZZ_WRAP));
    let c = max(n_u + FUZZ_WRAP, 1e-4);
    return scale * c * c;
}

/// P_e of the deferred layer, once a pixel.
///
/// Cost on GCN: 3 instructions (2 at a quarter of the rate).
fn fuzz_deferred_escape(n_v: f32) -> f32 {
    return fuzz_passage(FUZZ_DEFERRED_DENSITY, n_v);
}

/// BRDF times cosine of the deferred layer for a fibre albedo of one, from the cosines of light and view with the normal
/// and with each other and `fuzz_deferred_escape`. Lights down to `n_u = -FUZZ_WRAP` reach it. The picture is
/// `lerp(Lambert, this, fuzziness)`; the base is not shadowed.
///
/// Cost on GCN: 28 instructions (5 at a quarter of the rate).
fn fuzz_deferred(n_u: f32, n_v: f32, u_v: f32, escaped: f32) -> f32 {
    let wrapped = fuzz_wrap(n_u);
    let passed = fuzz_passage(FUZZ_DEFERRED_DENSITY, wrapped) * escaped;
    return fibre_phase(u_v, n_u, n_v, FUZZ_DEFERRED_ALPHA) * (1.0 - passed) * wrapped / (wrapped + n_v);
}

/// Albedo of the fibres over a Lambert base of albedo `base`: `5 base`, as the talk has it, but no more than the layer
/// can have without returning more than arrives. The talk's alone exceeds one at grazing where `base` is above 0.35.
///
/// Cost on GCN: 8 instructions.
fn fuzz_deferred_color(base: vec3f, n_v: f32) -> vec3f {
    return min(base * FUZZ_DEFERRED_ALBEDO, vec3f(1.7241 + 7.5257 * n_v));
}

/// Eight bits of a G-buffer, a whole number from 0 to 255, from a fuzziness in [0, 1], rounded to 1/127, below a `flag` in
/// the top bit (0 or 1: translucency, in the talk). A channel of the format unorm8 wants it over 255.
///
/// Cost on GCN: 4 instructions.
fn fuzziness_code(fuzziness: f32, flag: f32) -> f32 {
    return 128.0 * flag + floor(saturate(fuzziness) * 127.0 + 0.5);
}

/// Fuzziness of eight bits, the flag left out. What a channel of the format unorm8 gives, times 255, need not be whole.
///
/// Cost on GCN: 4 instructions.
fn fuzziness_from_code(code: f32) -> f32 {
    return (code - select(0.0, 128.0, code > 127.5)) * (1.0 / 127.0);
}
