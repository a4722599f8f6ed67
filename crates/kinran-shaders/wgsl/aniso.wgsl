// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/aniso.wesl, by ./x shaders. Needs: frame, sym

// The aniso texel: squared roughness as three numbers that survive 8 bits, filtering and BC7.
//
// A texel holds [sqrt(Sxx), rho/2 + 1/2, sqrt(Syy)] with rho = Sxy / sqrt(Sxx Syy) (slide: Our Algorithm, step 4).
// S is alpha² as a symmetric matrix in the frame of `m_n`. Sample the texture with the hardware's filter; every
// average of texels decodes to a positive semi-definite matrix.

/// Smallest GGX roughness to shade with: one step of an 8-bit aniso channel.
const ALPHA_MIN: f32 = 0.00392156862745098;

/// GGX alpha of a perceptual roughness in [0, 1]: its square, at least ALPHA_MIN.
///
/// Cost on GCN: 2 instructions.
fn alpha_from_roughness(roughness: f32) -> f32 {
    return max(roughness * roughness, ALPHA_MIN);
}

/// GGX alpha of a gloss in [0, 1]: `(1 - gloss)²`, at least ALPHA_MIN.
///
/// Cost on GCN: 3 instructions.
fn alpha_from_gloss(gloss: f32) -> f32 {
    return alpha_from_roughness(1.0 - gloss);
}

/// What a light needs of an aniso texel.
struct AnisoDecoded {
    /// Roughness along `tangent`, the larger one.
    alpha_t: f32,
    /// Roughness along `bitangent`, the smaller one.
    alpha_b: f32,
    /// Unit vector of the larger roughness.
    tangent: vec3f,
    /// Unit vector of the smaller roughness.
    bitangent: vec3f,
}

/// Texel of a squared roughness matrix `s` (xx, xy, yy); each component in [0, 1]. rho is 0 where Sxx or Syy is 0.
///
/// Cost on GCN: 11 instructions (3 at a quarter of the rate).
fn aniso_encode(s: vec3f) -> vec3f {
    let product = s.x * s.z;
    let rho = select(0.0, clamp(s.y * inverseSqrt(product), -1.0, 1.0), product > 0.0);
    return vec3f(sqrt(saturate(s.x)), 0.5 * rho + 0.5, sqrt(saturate(s.z)));
}

/// Squared roughness matrix (xx, xy, yy) of a texel: positive semi-definite for every texel in [0, 1]³.
///
/// With `ggx_matrix_d` and `smith_matrix_v` this is all the decoding a light needs: cheaper than `aniso_decode` for a
/// few lights. Add `sym2_clamp_eigen` where a determinant of zero would divide.
///
/// Cost on GCN: 5 instructions.
fn aniso_decode_matrix(texel: vec3f) -> vec3f {
    return vec3f(texel.x * texel.x, texel.x * (texel.y * 2.0 - 1.0) * texel.z, texel.z * texel.z);
}

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
fn aniso_decode(texel: vec3f, tangent: vec3f, bitangent: vec3f) -> AnisoDecoded {
    let rho = texel.y * 2.0 - 1.0;
    let sxy_twice = 2.0 * (texel.x * texel.z * rho);
    let sxx = texel.x * texel.x;
    let sum = texel.z * texel.z + sxx;
    let difference = sxx - texel.z * texel.z;
    // The grain keeps a round texel from 0 / 0 and touches no other: alphas of 1e-4 have as much.
    let discr_sqr = sxy_twice * sxy_twice + (difference * difference + 1e-18);
    let discr_rcp = inverseSqrt(discr_sqr);

    // Factors of a power of two, absolute values and `saturate` stand where GCN has them for nothing, on the result of
    // another instruction. 1.5378701e-5 is ALPHA_MIN².
    let alpha_t_sqr = max(0.5 * (discr_sqr * discr_rcp + sum), 1.5378701e-5);
    let alpha_b_sqr = max(0.5 * (sum - discr_sqr * discr_rcp), 1.5378701e-5);

    let c_sqr = saturate(0.5 * (difference * discr_rcp + 1.0));
    let c = sqrt(c_sqr);
    let s_abs = sqrt(1.0 - c_sqr);
    let s = select(s_abs, -s_abs, sxy_twice < 0.0);
    return AnisoDecoded(
        saturate(sqrt(alpha_t_sqr)),
        saturate(sqrt(alpha_b_sqr)),
        c * tangent + s * bitangent,
        c * bitangent - s * tangent,
    );
}

/// Squared roughness matrix (xx, xy, yy) with `alpha_t` along the unit vector `axis` of the `m_n` frame, `alpha_b`
/// across.
///
/// Cost on GCN: 13 instructions.
fn aniso_from_alphas(alpha_t: f32, alpha_b: f32, axis: vec2f) -> vec3f {
    return sym2_from_eigen(alpha_t * alpha_t, alpha_b * alpha_b, axis);
}

/// Direction in the `m_n` frame of a direction painted in the mesh's tangent plane: what Gram–Schmidt, `d - (d·n) n`,
/// makes of it. Both are unit vectors; where nothing is left of it, the direction stays as it is.
///
/// Cost on GCN: 23 instructions (2 at a quarter of the rate).
fn axis_from_direction(direction: vec2f, n: vec3f) -> vec2f {
    // The columns of m_n are orthogonal to n, so the Gram–Schmidt term drops out of both products.
    let m = m_n(n);
    let axis = vec2f(dot(m[0].xy, direction), dot(m[1].xy, direction));
    let length_squared = dot(axis, axis);
    return select(direction, axis * inverseSqrt(length_squared), length_squared > 1e-12);
}

/// The inverse of `axis_from_direction`: the unit direction in the mesh's tangent plane that Gram–Schmidt against `n`
/// turns into `axis` of the `m_n` frame.
///
/// Cost on GCN: 31 instructions (2 at a quarter of the rate).
fn direction_from_axis(axis: vec2f, n: vec3f) -> vec2f {
    let m = m_n(n);
    let t = m[0] * axis.x + m[1] * axis.y;
    // In the plane of t and n, the vector without a z component; times n.z to survive the horizon.
    let d = t.xy * n.z - t.z * n.xy;
    let length_squared = dot(d, d);
    return select(axis, d * inverseSqrt(length_squared), length_squared > 1e-12);
}

/// Principal alphas (alpha_t, alpha_b) of `KHR_materials_anisotropy`: `alpha_b = roughness²`,
/// `alpha_t = mix(alpha_b, 1, strength²)`.
///
/// Cost on GCN: 5 instructions.
fn alphas_from_khr_anisotropy(roughness: f32, strength: f32) -> vec2f {
    let alpha_b = alpha_from_roughness(roughness);
    return vec2f(alpha_b + (1.0 - alpha_b) * strength * strength, alpha_b);
}

/// Perceptual roughness and anisotropy strength of `KHR_materials_anisotropy` for `alpha_t ≥ alpha_b`; the inverse of
/// `alphas_from_khr_anisotropy`.
///
/// Cost on GCN: 8 instructions (3 at a quarter of the rate).
fn khr_anisotropy_from_alphas(alpha_t: f32, alpha_b: f32) -> vec2f {
    let rest = 1.0 - alpha_b;
    let strength = select(0.0, sqrt(saturate((alpha_t - alpha_b) / rest)), rest > 0.0);
    return vec2f(sqrt(alpha_b), strength);
}
