// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_layer.wesl, by ./x shaders. Needs: fuzz_phase

// The layer of fibres: what it scatters to the viewer and what it leaves of the base.
//
// Koenderink, Pont. The Secret of Velvety Skin. Machine Vision and Applications 2003.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

#ifndef KINRAN_FUZZ_LAYER_HLSL
#define KINRAN_FUZZ_LAYER_HLSL

#include "fuzz_phase.hlsl"

/// What the layer's lobe needs of a view, once a pixel.
struct FuzzView {
    float n_v;
    float t_v;
    float escaped;
    float exponent;
    float squeeze;
    float root;
    float root_along;
};

/// What the layer makes of a light.
struct FuzzLight {
    float lobe;
    float penetrated;
};

/// Cosines below this one, of light or view and normal, count as it: a layer of density 1e-4 lets nothing pass there, and
/// quotients stay finite at the horizon.
static const float FUZZ_COSINE_MIN = 1e-6;

/// Share of light that passes the layer along a direction at cosine `n_w` ≥ 0 to the normal without meeting a fibre:
/// `e^(-d / n_w)`. Towards the light it is the talk's `P_p`, towards the viewer `P_e`.
///
/// Cost on GCN: 5 instructions (2 at a quarter of the rate).
float fuzz_passage(float density, float n_w)
{
    return exp2(((-1.442695 * density) / max(n_w, FUZZ_COSINE_MIN)));
}

/// The layer's BRDF for a fibre albedo of one (slide: New Model): `p (1 - passed) / (n_u + n_v)`, where `passed` is
/// `fuzz_passage` along the light times that along the view, and `phase` the phase function; for cosines ≥ 0. Where both
/// vanish the BRDF is infinite, and this is its value at FUZZ_COSINE_MIN.
///
/// Cost on GCN: 6 instructions (1 at a quarter of the rate).
float fuzz_layer(float phase, float passed, float n_u, float n_v)
{
    return (phase * (1.0 - passed)) / max((n_u + n_v), FUZZ_COSINE_MIN);
}

/// BRDF of a layer of SGGX fibres for an albedo of one, per steradian, zero below the horizon; `u` light, `v` view and
/// `t` fibre direction are unit vectors in a frame with z along the normal. Not reciprocal: `f(u, v) σ(u) = f(v, u)
/// σ(v)`.
///
/// Cost on GCN: 44 instructions (6 at a quarter of the rate).
float fuzz_brdf(float3 u, float3 v, float3 t, float density, float alpha)
{
    const float _e6 = fuzz_passage(density, u.z);
    const float _e8 = fuzz_passage(density, v.z);
    float passed = _e6 * _e8;
    const float _e13 = fibre_phase(dot(u, v), dot(t, u), dot(t, v), alpha);
    const float _e16 = fuzz_layer(_e13, passed, u.z, v.z);
    return (min(u.z, v.z) > 0.0) ? _e16 : 0.0;
}

/// `fuzz_brdf` with the velvet phase of asymmetry `k`; reciprocal.
///
/// Cost on GCN: 45 instructions (9 at a quarter of the rate).
float fuzz_velvet_brdf(float3 u, float3 v, float3 t, float density, float k)
{
    const float _e6 = fuzz_passage(density, u.z);
    const float _e8 = fuzz_passage(density, v.z);
    float passed = _e6 * _e8;
    const float _e13 = velvet_phase(dot(u, v), dot(t, u), dot(t, v), k);
    const float _e16 = fuzz_layer(_e13, passed, u.z, v.z);
    return (min(u.z, v.z) > 0.0) ? _e16 : 0.0;
}

/// BRDF of a layer whose extinction follows the fibres' projected area, as in a true microflake volume:
/// `D/4 (1 - e^(-d (σ_u/n_u + σ_v/n_v))) / (σ_v n_u + σ_u n_v)`. Reciprocal.
///
/// Cost on GCN: 54 instructions (8 at a quarter of the rate).
float fuzz_reciprocal_brdf(float3 u, float3 v, float3 t, float density, float alpha)
{
    float3 h = normalize((u + v));
    const float _e8 = fibre_projected_area(dot(t, u), alpha);
    const float _e10 = fibre_projected_area(dot(t, v), alpha);
    const float _e13 = fuzz_passage((density * _e8), u.z);
    const float _e16 = fuzz_passage((density * _e10), v.z);
    float passed = _e13 * _e16;
    const float _e19 = fibre_d(dot(t, h), alpha);
    float value = ((0.25 * _e19) * (1.0 - passed)) / ((_e10 * u.z) + (_e8 * v.z));
    return (min(u.z, v.z) > 0.0) ? value : 0.0;
}

#ifndef KINRAN_CONSTRUCTFUZZVIEW_HLSL
#define KINRAN_CONSTRUCTFUZZVIEW_HLSL
FuzzView ConstructFuzzView(float arg0, float arg1, float arg2, float arg3, float arg4, float arg5, float arg6) {
    FuzzView ret = (FuzzView)0;
    ret.n_v = arg0;
    ret.t_v = arg1;
    ret.escaped = arg2;
    ret.exponent = arg3;
    ret.squeeze = arg4;
    ret.root = arg5;
    ret.root_along = arg6;
    return ret;
}
#endif

/// Prepares `fuzz_light` for a view at cosine `n_v` ≥ 0 to the normal and `t_v` to the fibres.
///
/// Cost on GCN: 13 instructions (3 at a quarter of the rate).
FuzzView fuzz_view(float n_v, float t_v, float density, float alpha)
{
    float exponent = -1.442695 * max(density, 1e-20);
    float n = max(n_v, FUZZ_COSINE_MIN);
    float alpha_sqr = alpha * alpha;
    float k = 1.0 - alpha_sqr;
    float root = 157.91367 * alpha_sqr;
    const FuzzView fuzzview = ConstructFuzzView(n, t_v, exp2((exponent / n)), exponent, ((0.5 * k) / alpha_sqr), root, (root * k));
    return fuzzview;
}

#ifndef KINRAN_CONSTRUCTFUZZLIGHT_HLSL
#define KINRAN_CONSTRUCTFUZZLIGHT_HLSL
FuzzLight ConstructFuzzLight(float arg0, float arg1) {
    FuzzLight ret = (FuzzLight)0;
    ret.lobe = arg0;
    ret.penetrated = arg1;
    return ret;
}
#endif

/// Lobe and penetration for a light at cosines `n_u` ≥ 0 to the normal, `t_u` to the fibres and `u_v` to the view:
/// `fuzz_brdf` with one exponential for both and all that is known of the view drawn together. The cosines are the same
/// in every frame.
///
/// Cost on GCN: 19 instructions (4 at a quarter of the rate).
FuzzLight fuzz_light(FuzzView view, float n_u, float t_u, float u_v)
{
    float penetrated = exp2((view.exponent / n_u));
    float scattered = 1.0 - (penetrated * view.escaped);
    float w = 1.000001 + u_v;
    float s = t_u + view.t_v;
    float m = ((s * s) * view.squeeze) + w;
    float over_area = rsqrt((view.root - ((t_u * t_u) * view.root_along)));
    const FuzzLight fuzzlight = ConstructFuzzLight(((((w * w) * scattered) * over_area) / ((m * m) * (n_u + view.n_v))), penetrated);
    return fuzzlight;
}

/// Factor on the base's BRDF (slide: Base Layer, `c_atten`): `(P_p + c_f (1 - P_p) P_s) P_e`, for the share `penetrated`
/// that reaches the base, `escaped` that leaves it towards the viewer, and `downward` (P_s) of the scattered light that
/// goes down. With `downward` = 0 it is the talk's cheaper variant.
///
/// Cost on GCN: 8 instructions.
float3 fuzz_attenuation(float penetrated, float escaped, float downward, float3 fibre_color)
{
    float scattered = downward - (penetrated * downward);
    return ((penetrated * escaped)).xxx + ((fibre_color * escaped) * scattered);
}

/// The normal for the layer, between the normal-mapped `n` and the mesh's `vertex_normal` (slide: Deferred):
/// `smoothness` 0 keeps `n`, 1 takes the mesh's. They are less than 180° apart.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
float3 fuzz_smooth_normal(float3 n, float3 vertex_normal, float smoothness)
{
    return normalize((n + ((vertex_normal - n) * smoothness)));
}

#endif
