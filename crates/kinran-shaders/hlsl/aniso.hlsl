// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/aniso.wesl, by ./x shaders. Needs: frame, sym

// The aniso texel: squared roughness as three numbers that survive 8 bits, filtering and BC7.
//
// A texel holds [sqrt(Sxx), rho/2 + 1/2, sqrt(Syy)] with rho = Sxy / sqrt(Sxx Syy) (slide: Our Algorithm, step 4).
// S is alpha² as a symmetric matrix in the frame of `m_n`. Sample the texture with the hardware's filter; every
// average of texels decodes to a positive semi-definite matrix.

#ifndef KINRAN_ANISO_HLSL
#define KINRAN_ANISO_HLSL

#include "frame.hlsl"
#include "sym.hlsl"

/// What a light needs of an aniso texel.
struct AnisoDecoded {
    float alpha_t;
    float alpha_b;
    float3 tangent;
    float3 bitangent;
};

/// Smallest GGX roughness to shade with: one step of an 8-bit aniso channel.
static const float ALPHA_MIN = 0.003921569;

/// GGX alpha of a perceptual roughness in [0, 1]: its square, at least ALPHA_MIN.
///
/// Cost on GCN: 2 instructions.
float alpha_from_roughness(float roughness)
{
    return max((roughness * roughness), ALPHA_MIN);
}

/// GGX alpha of a gloss in [0, 1]: `(1 - gloss)²`, at least ALPHA_MIN.
///
/// Cost on GCN: 3 instructions.
float alpha_from_gloss(float gloss)
{
    const float _e3 = alpha_from_roughness((1.0 - gloss));
    return _e3;
}

/// Texel of a squared roughness matrix `s` (xx, xy, yy); each component in [0, 1]. rho is 0 where Sxx or Syy is 0.
///
/// Cost on GCN: 11 instructions (3 at a quarter of the rate).
float3 aniso_encode(float3 s)
{
    float product = s.x * s.z;
    float rho = (product > 0.0) ? clamp((s.y * rsqrt(product)), -1.0, 1.0) : 0.0;
    return float3(sqrt(saturate(s.x)), ((0.5 * rho) + 0.5), sqrt(saturate(s.z)));
}

/// Squared roughness matrix (xx, xy, yy) of a texel: positive semi-definite for every texel in [0, 1]³.
///
/// With `ggx_matrix_d` and `smith_matrix_v` this is all the decoding a light needs: cheaper than `aniso_decode` for a
/// few lights. Add `sym2_clamp_eigen` where a determinant of zero would divide.
///
/// Cost on GCN: 5 instructions.
float3 aniso_decode_matrix(float3 texel)
{
    return float3((texel.x * texel.x), ((texel.x * ((texel.y * 2.0) - 1.0)) * texel.z), (texel.z * texel.z));
}

#ifndef KINRAN_CONSTRUCTANISODECODED_HLSL
#define KINRAN_CONSTRUCTANISODECODED_HLSL
AnisoDecoded ConstructAnisoDecoded(float arg0, float arg1, float3 arg2, float3 arg3) {
    AnisoDecoded ret = (AnisoDecoded)0;
    ret.alpha_t = arg0;
    ret.alpha_b = arg1;
    ret.tangent = arg2;
    ret.bitangent = arg3;
    return ret;
}
#endif

/// Principal roughnesses and directions of a texel (slide: Our Algorithm, `DecodeSggx`), in the frame of the two unit
/// vectors given, which are the first two columns of `m_n` brought to world space.
///
/// Differs from the slide in two points. Roughness is kept within ALPHA_MIN and 1, which also bounds what the half
/// difference in alpha_b loses: alpha_b is within 1 % of the exact one even where alpha_t is 255 times as large. And
/// Sxy = 0 counts as positive: with HLSL's `sign`, which is zero there, the tangent vanishes on every texel aligned with
/// the bitangent. The axis comes from cos² and sin² of its angle, within 0.03° of the exact one; that of a round texel,
/// which has none, lies at 45°.
///
/// Cost on GCN: 33 instructions (5 at a quarter of the rate).
AnisoDecoded aniso_decode(float3 texel, float3 tangent, float3 bitangent)
{
    float rho = (texel.y * 2.0) - 1.0;
    float sxy_twice = 2.0 * ((texel.x * texel.z) * rho);
    float sxx = texel.x * texel.x;
    float sum = (texel.z * texel.z) + sxx;
    float difference = sxx - (texel.z * texel.z);
    float discr_sqr = (sxy_twice * sxy_twice) + ((difference * difference) + 1e-18);
    float discr_rcp = rsqrt(discr_sqr);
    float alpha_t_sqr = max((0.5 * ((discr_sqr * discr_rcp) + sum)), 1.53787e-5);
    float alpha_b_sqr = max((0.5 * (sum - (discr_sqr * discr_rcp))), 1.53787e-5);
    float c_sqr = saturate((0.5 * ((difference * discr_rcp) + 1.0)));
    float c = sqrt(c_sqr);
    float s_abs = sqrt((1.0 - c_sqr));
    float s = (sxy_twice < 0.0) ? -(s_abs) : s_abs;
    const AnisoDecoded anisodecoded = ConstructAnisoDecoded(saturate(sqrt(alpha_t_sqr)), saturate(sqrt(alpha_b_sqr)), ((c * tangent) + (s * bitangent)), ((c * bitangent) - (s * tangent)));
    return anisodecoded;
}

/// Squared roughness matrix (xx, xy, yy) with `alpha_t` along the unit vector `axis` of the `m_n` frame, `alpha_b`
/// across.
///
/// Cost on GCN: 13 instructions.
float3 aniso_from_alphas(float alpha_t, float alpha_b, float2 axis)
{
    const float3 _e5 = sym2_from_eigen((alpha_t * alpha_t), (alpha_b * alpha_b), axis);
    return _e5;
}

/// Direction in the `m_n` frame of a direction painted in the mesh's tangent plane: what Gram–Schmidt, `d - (d·n) n`,
/// makes of it. Both are unit vectors; where nothing is left of it, the direction stays as it is.
///
/// Cost on GCN: 23 instructions (2 at a quarter of the rate).
float2 axis_from_direction(float2 direction, float3 n)
{
    const float3x3 _e2 = m_n(n);
    float2 axis = float2(dot(_e2[0].xy, direction), dot(_e2[1].xy, direction));
    float length_squared = dot(axis, axis);
    return (length_squared > 1e-12) ? (axis * rsqrt(length_squared)) : direction;
}

/// The inverse of `axis_from_direction`: the unit direction in the mesh's tangent plane that Gram–Schmidt against `n`
/// turns into `axis` of the `m_n` frame.
///
/// Cost on GCN: 31 instructions (2 at a quarter of the rate).
float2 direction_from_axis(float2 axis, float3 n)
{
    const float3x3 _e2 = m_n(n);
    float3 t = (_e2[0] * axis.x) + (_e2[1] * axis.y);
    float2 d = (t.xy * n.z) - (t.z * n.xy);
    float length_squared = dot(d, d);
    return (length_squared > 1e-12) ? (d * rsqrt(length_squared)) : axis;
}

/// Principal alphas (alpha_t, alpha_b) of `KHR_materials_anisotropy`: `alpha_b = roughness²`,
/// `alpha_t = mix(alpha_b, 1, strength²)`.
///
/// Cost on GCN: 5 instructions.
float2 alphas_from_khr_anisotropy(float roughness, float strength)
{
    const float _e2 = alpha_from_roughness(roughness);
    return float2((_e2 + (((1.0 - _e2) * strength) * strength)), _e2);
}

/// Perceptual roughness and anisotropy strength of `KHR_materials_anisotropy` for `alpha_t ≥ alpha_b`; the inverse of
/// `alphas_from_khr_anisotropy`.
///
/// Cost on GCN: 8 instructions (3 at a quarter of the rate).
float2 khr_anisotropy_from_alphas(float alpha_t, float alpha_b)
{
    float rest = 1.0 - alpha_b;
    float strength = (rest > 0.0) ? sqrt(saturate(((alpha_t - alpha_b) / rest))) : 0.0;
    return float2(sqrt(alpha_b), strength);
}

#endif
