// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_deferred.wesl, by ./x shaders. Needs: fuzz_layer

// Fuzz by seven bits of a G-buffer: fixed fibres over Lambert, for moss and felt.
//
// McAuley. Extension to Energy-Conserving Wrapped Diffuse. 2013.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

#ifndef KINRAN_FUZZ_DEFERRED_GLSL
#define KINRAN_FUZZ_DEFERRED_GLSL

/// Density of the layer.
const float FUZZ_DEFERRED_DENSITY = 0.5;

/// Roughness of the fibres: a spread of 0.9. They stand along the normal.
const float FUZZ_DEFERRED_ALPHA = 0.9486833;

/// Albedo of the fibres over that of the Lambert base.
const float FUZZ_DEFERRED_ALBEDO = 5.0;

/// How far light wraps around the terminator, as a cosine.
const float FUZZ_WRAP = 0.2;

/// `(1+n)/(2 (1+w)^(1+n))` for n = 2: with it the wrapped cosine integrates to π over the sphere.
const float FUZZ_WRAP_SCALE = 0.86805546;

/// The cosine of light and normal, softened by wrapping (McAuley 2013; slide: Deferred), n = 2:
/// `(1+n)/(2(1+w)) (max(n_u + w, 0)/(1+w))^n`. Its integral over the sphere is π. Where no light arrives it is 1e-8
/// rather than zero, so that the layer may divide by it.
///
/// Cost on GCN: 4 instructions.
float fuzz_wrap(float n_u) {
    float c = max((n_u + FUZZ_WRAP), 0.0001);
    return (FUZZ_WRAP_SCALE * c) * c;
}

/// P_e of the deferred layer, once a pixel.
///
/// Cost on GCN: 4 instructions (2 at a quarter of the rate).
float fuzz_deferred_escape(float n_v) {
    float _e2 = fuzz_passage(FUZZ_DEFERRED_DENSITY, n_v);
    return _e2;
}

/// BRDF times cosine of the deferred layer for a fibre albedo of one, from the cosines of light and view with the normal
/// and with each other and `fuzz_deferred_escape`. Lights down to `n_u = -FUZZ_WRAP` reach it. The picture is
/// `lerp(Lambert, this, fuzziness)`; the base is not shadowed. It is `fibre_phase` and `fuzz_layer` times cosine with
/// `fuzz_wrap` for the light's cosine, every constant factor drawn into another.
///
/// Cost on GCN: 23 instructions (4 at a quarter of the rate).
float fuzz_deferred(float n_u, float n_v, float u_v, float escaped) {
    float c = max((n_u + FUZZ_WRAP), 0.0001);
    float wrapped = c * c;
    float passed = exp2((-0.8309924 / wrapped)) * escaped;
    float w = 1.000001 + u_v;
    float s = n_u + n_v;
    float m = ((s * s) * 0.055555534) + w;
    float over_area = inversesqrt((142.1223 - ((n_u * n_u) * 14.212225)));
    float above = (((w * w) * wrapped) * (1.0 - passed)) * over_area;
    return above / ((m * m) * (wrapped + (n_v * 1.1520001)));
}

/// Albedo of the fibres over a Lambert base of albedo `base`: `5 base`, as the talk has it, but no more than the layer
/// can have without returning more than arrives. The talk's alone exceeds one at grazing where `base` is above 0.35.
///
/// Cost on GCN: 8 instructions.
vec3 fuzz_deferred_color(vec3 base, float n_v) {
    return min((base * FUZZ_DEFERRED_ALBEDO), vec3((1.7241 + (7.5257 * n_v))));
}

/// Eight bits of a G-buffer, a whole number from 0 to 255, from a fuzziness in [0, 1], rounded to 1/127, below a `flag` in
/// the top bit (0 or 1: translucency, in the talk). A channel of the format unorm8 wants it over 255.
///
/// Cost on GCN: 4 instructions.
float fuzziness_code(float fuzziness, float flag) {
    return (128.0 * flag) + floor(((clamp(fuzziness, 0.0, 1.0) * 127.0) + 0.5));
}

/// Fuzziness of eight bits, the flag left out. What a channel of the format unorm8 gives, times 255, need not be whole.
///
/// Cost on GCN: 4 instructions.
float fuzziness_from_code(float code) {
    return (code - ((code > 127.5) ? 128.0 : 0.0)) * 0.007874016;
}

#endif
