// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_ambient.wesl, by ./x shaders. Needs: fuzz_layer

// The layer of fibres in light from all around, given as order-2 spherical harmonics.
//
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.
//
// Ambient light of the layer is `c_f fuzz_g fuzz_ambient_factor fuzz_ambient_radiance`: the mean of the layer's
// geometry, a polynomial for what the phase function gathers, and the light along the lobe's mean direction. The talk
// has `1 - P_s(v)` for the second and the hemisphere's mean for the third.

#ifndef KINRAN_FUZZ_AMBIENT_METAL
#define KINRAN_FUZZ_AMBIENT_METAL

#include <metal_stdlib>

#include "fuzz_layer.h"

#ifndef KINRAN_FLOAT4ARRAY_METAL
#define KINRAN_FLOAT4ARRAY_METAL
struct Float4Array {
    float inner[4];
};
#endif

#ifndef KINRAN_FLOAT2ARRAY_METAL
#define KINRAN_FLOAT2ARRAY_METAL
struct Float2Array {
    float inner[2];
};
#endif

#ifndef KINRAN_FLOAT8ARRAY_METAL
#define KINRAN_FLOAT8ARRAY_METAL
struct Float8Array {
    float inner[8];
};
#endif

#ifndef KINRAN_FLOAT3X9ARRAY_METAL
#define KINRAN_FLOAT3X9ARRAY_METAL
struct Float3x9Array {
    metal::float3 inner[9];
};
#endif

/// Nodes of the ambient table along each of its sides, the first and the last at the ends of their ranges.
constant uint FUZZ_TABLE_SIZE = 48u;

/// Fibres of a smaller alpha are combed: six coefficients miss P_s by more than 0.09 and eight the ambient light by more
/// than 14 %. `fibre_p_s` and the table take their places.
constant float FUZZ_COMBED_ALPHA = 0.3;

/// Mean over the hemisphere of the layer's BRDF times cosine over phase (slide: Ambient Lighting, `G~`), for a view at
/// cosine `n_v`: `F (1 - e^-y) (1 - y e^-y / 10)` with `F = 1 - n_v ln(1 + 1/n_v)` and `y = d / (n_v F)`. Within -3.6 %
/// and +4.8 % of the closed form for densities in [0.002, 3] and n_v ≥ 0.002; finite for all n_v in [0, 1].
///
/// Cost on GCN: 16 instructions (4 at a quarter of the rate).
inline float fuzz_g(
    float density,
    float n_v
) {
    float x = metal::max(n_v, FUZZ_COSINE_MIN);
    float dense = 1.0 - (x * metal::log(1.0 + (1.0 / x)));
    float y = density / (x * dense);
    float e = metal::exp2(-1.442695 * y);
    return (dense * (1.0 - e)) * (1.0 - ((0.1 * y) * e));
}

/// The talk's form of `fuzz_g`, `d (1 + c_0 x + c_1 x²) / (d + c_2 x + c_3 x³)`, by four coefficients; zero where there are
/// no fibres.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
inline float fuzz_g_talk(
    Float4Array coefficients,
    float density,
    float n_v
) {
    float above = 1.0 + (n_v * (coefficients.inner[0] + (coefficients.inner[1] * n_v)));
    return (density * above) / metal::max(density + (n_v * (coefficients.inner[2] + ((coefficients.inner[3] * n_v) * n_v))), 0.00000000000000000001);
}

/// Share of uniform irradiance that reaches the base unscattered, `2 E_3(d)` (slide: Ambient Shadowing, `Q~`); within
/// 0.00043 for densities in [0, 3].
///
/// Cost on GCN: 11 instructions (2 at a quarter of the rate).
inline float fuzz_q(
    float density
) {
    float above = 1.0 + (density * (3.07323 + (0.102541 * density)));
    float _e9 = fuzz_passage(density, 1.0);
    return (_e9 * above) / (1.0 + (density * (4.02006 + (1.98275 * density))));
}

/// The talk's form of `fuzz_q`, `1 + c_0 d + c_1 d²`, by two coefficients; turns up outside the range of its fit.
///
/// Cost on GCN: 2 instructions.
inline float fuzz_q_talk(
    Float2Array coefficients,
    float density
) {
    return 1.0 + (density * (coefficients.inner[0] + (coefficients.inner[1] * density)));
}

/// What the phase function gathers of uniform light, over `fuzz_g`, as a polynomial of the view fitted for one tilt and
/// one spread over densities of 0.05 to 0.5: the talk's six terms and the third and fourth power of `t_v`.
///
/// Cost on GCN: 8 instructions.
inline float fuzz_ambient_factor(
    Float8Array coefficients,
    float n_v,
    float t_v
) {
    float along = t_v * (coefficients.inner[2] + (t_v * (coefficients.inner[5] + (t_v * (coefficients.inner[6] + (t_v * coefficients.inner[7]))))));
    float across = n_v * ((coefficients.inner[1] + (coefficients.inner[3] * n_v)) + (coefficients.inner[4] * t_v));
    return metal::max((coefficients.inner[0] + across) + along, 0.0);
}

/// Texture coordinates in the table that replaces `fuzz_ambient_factor` for combed fibres, of FUZZ_TABLE_SIZE texels a
/// side: x runs with `n_v` from 0 to 1, y with the cosine of the azimuth between view and fibre. `t_n` is `t·n`.
///
/// Cost on GCN: 11 instructions (1 at a quarter of the rate).
inline metal::float2 fuzz_ambient_place(
    float n_v,
    float t_v,
    float t_n
) {
    float sines = metal::sqrt(metal::max((1.0 - (n_v * n_v)) * (1.0 - (t_n * t_n)), 0.000000000001));
    float azimuth = metal::saturate(0.5 + ((0.5 * (t_v - (n_v * t_n))) / sines));
    return (metal::float2(n_v, azimuth) * (1.0 - 0.020833334)) + metal::float2(0.5 * 0.020833334);
}

/// The factor from what the table holds at `fuzz_ambient_place`, interpolated bilinearly: x for a thin layer, y what a
/// dense one adds to it.
///
/// Cost on GCN: 5 instructions (1 at a quarter of the rate).
inline float fuzz_ambient_tabulated(
    metal::float2 texel,
    float density,
    float n_v
) {
    return texel.x + ((texel.y * density) / metal::max(density + n_v, 0.00000000000000000001));
}

/// Mean direction of the light that the lobe gathers, shorter than one, by four coefficients of the same fit:
/// `c_0 n + c_1 v + (c_2 + c_3 t_v) t`.
///
/// Cost on GCN: 13 instructions.
inline metal::float3 fuzz_ambient_direction(
    Float4Array coefficients,
    metal::float3 n,
    metal::float3 v,
    metal::float3 t
) {
    return ((n * coefficients.inner[0]) + (v * coefficients.inner[1])) + (t * (coefficients.inner[2] + (coefficients.inner[3] * metal::dot(t, v))));
}

/// Mean radiance in the lobe, from the coefficients of `radiance` up to order 1 and `fuzz_ambient_direction`; exact for
/// light that varies linearly with direction. Never negative.
///
/// Cost on GCN: 18 instructions.
inline metal::float3 fuzz_ambient_radiance(
    Float3x9Array radiance,
    metal::float3 direction
) {
    metal::float3 linear = ((radiance.inner[3] * direction.x) + (radiance.inner[1] * direction.y)) + (radiance.inner[2] * direction.z);
    return metal::max((radiance.inner[0] * 0.2820948) + (linear * 0.48860252), metal::float3(0.0));
}

/// Mean radiance over the hemisphere about the unit vector `n`: the talk's light. Never negative.
///
/// Cost on GCN: 21 instructions.
inline metal::float3 fuzz_ambient_mean(
    Float3x9Array radiance,
    metal::float3 n
) {
    metal::float3 _e4 = fuzz_ambient_radiance(radiance, n * 0.5);
    return _e4;
}

/// Factor on the base's ambient light, diffuse or from a specular probe (slide: Ambient Shadowing, `c_atten`):
/// `P_e (Q + c_f R (1 - Q))`. `downward` is R, the mean of P_s over uniform irradiance, which depends on tilt and spread;
/// 1/2 for fibres in all directions. The slide's R lacks a 1/π.
///
/// Cost on GCN: 8 instructions.
inline metal::float3 fuzz_ambient_attenuation(
    float escaped,
    float q,
    float downward,
    metal::float3 fibre_color
) {
    return (metal::float3(q) + (fibre_color * (downward * (1.0 - q)))) * escaped;
}

#endif
