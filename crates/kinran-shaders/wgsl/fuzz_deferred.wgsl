// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_deferred.wesl, by ./x shaders. Needs: fuzz_layer

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

/// `(1+n)/(2 (1+w)^(1+n))` for n = 2: with it the wrapped cosine integrates to π over the sphere.
const FUZZ_WRAP_SCALE: f32 = 3.0 / (2.0 * (1.0 + FUZZ_WRAP) * (1.0 + FUZZ_WRAP) * (1.0 + FUZZ_WRAP));

/// The cosine of light and normal, softened by wrapping (McAuley 2013; slide: Deferred), n = 2:
/// `(1+n)/(2(1+w)) (max(n_u + w, 0)/(1+w))^n`. Its integral over the sphere is π. Where no light arrives it is 1e-8
/// rather than zero, so that the layer may divide by it.
///
/// Cost on GCN: 4 instructions.
fn fuzz_wrap(n_u: f32) -> f32 {
    let c = max(n_u + FUZZ_WRAP, 1e-4);
    return FUZZ_WRAP_SCALE * c * c;
}

/// P_e of the deferred layer, once a pixel.
///
/// Cost on GCN: 4 instructions (2 at a quarter of the rate).
fn fuzz_deferred_escape(n_v: f32) -> f32 {
    return fuzz_passage(FUZZ_DEFERRED_DENSITY, n_v);
}

/// BRDF times cosine of the deferred layer for a fibre albedo of one, from the cosines of light and view with the normal
/// and with each other and `fuzz_deferred_escape`. Lights down to `n_u = -FUZZ_WRAP` reach it. The picture is
/// `lerp(Lambert, this, fuzziness)`; the base is not shadowed. It is `fibre_phase` and `fuzz_layer` times cosine with
/// `fuzz_wrap` for the light's cosine, every constant factor drawn into another.
///
/// Cost on GCN: 23 instructions (4 at a quarter of the rate).
fn fuzz_deferred(n_u: f32, n_v: f32, u_v: f32, escaped: f32) -> f32 {
    const alpha_sqr = FUZZ_DEFERRED_ALPHA * FUZZ_DEFERRED_ALPHA;
    const k = 1.0 - alpha_sqr;
    const root = 157.91367 * alpha_sqr;
    // The wrapped cosine over its scale.
    let c = max(n_u + FUZZ_WRAP, 1e-4);
    let wrapped = c * c;
    // `fuzz_passage`; the cosine is never zero.
    let passed = exp2(-1.44269504 * (FUZZ_DEFERRED_DENSITY / FUZZ_WRAP_SCALE) / wrapped) * escaped;

    // The phase is `(w/m)² / (4π α sqrt(1 - k n_u²))` with half of |u + v|² for w, kept above zero where v = -u.
    let w = 1.000001 + u_v;
    let s = n_u + n_v;
    let m = s * s * (0.5 * k / alpha_sqr) + w;
    let over_area = inverseSqrt(root - n_u * n_u * (root * k));
    let above = w * w * wrapped * (1.0 - passed) * over_area;
    return above / (m * m * (wrapped + n_v * (1.0 / FUZZ_WRAP_SCALE)));
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
