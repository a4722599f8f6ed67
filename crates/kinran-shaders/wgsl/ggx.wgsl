// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/ggx.wesl, by ./x shaders. Needs: sym

// The GGX microfacet lobe, isotropic and anisotropic.
//
// All directions are unit vectors in the shading frame: z is the normal, x the tangent along which the roughness is
// `alpha_t`, y the bitangent along which it is `alpha_b`. `alpha` is GGX roughness, the square of perceptual
// roughness, from ALPHA_MIN to 1.
//
// A lobe of a light is D V F n·u times the light's irradiance. What depends on the view alone (the stretched v of the
// visibility, products of alphas) is the same for every light, and compilers keep it out of an unrolled loop.

/// 1 / π.
const FRAC_1_PI: f32 = 0.31830988618379067;

/// Isotropic distribution of microfacet normals per steradian, `n_h = n·h` (Walter 2007, eq. 33). One ulp of `n_h`
/// moves the peak by `2.4e-7 / alpha²`; where that matters, `ggx_aniso_d` has all the digits.
///
/// Cost on GCN: 10 instructions (1 at a quarter of the rate).
fn ggx_d(n_h: f32, alpha: f32) -> f32 {
    let a_sqr = alpha * alpha;
    // 1 - n_h² as a product, which does not round before it cancels.
    let q = (1.0 - n_h) * (1.0 + n_h) + a_sqr * n_h * n_h;
    return a_sqr * FRAC_1_PI / (q * q);
}

/// Anisotropic distribution of microfacet normals per steradian (slide: Our Algorithm, the form with
/// `(alpha_t alpha_b)^3`), for `h` in the upper hemisphere. Its integral against n·h over there is one.
///
/// Cost on GCN: 12 instructions (1 at a quarter of the rate).
fn ggx_aniso_d(h: vec3f, alpha_t: f32, alpha_b: f32) -> f32 {
    let alpha_tb = alpha_t * alpha_b;
    let v = vec3f(h.x * alpha_b, h.y * alpha_t, h.z * alpha_tb);
    let w = alpha_tb / dot(v, v);
    return alpha_tb * FRAC_1_PI * w * w;
}

/// `ggx_aniso_d` from the squared roughness matrix `a` (xx, xy, yy), with no eigen decode:
/// `|A|^(3/2) / (π (h.xy^T adj(A) h.xy + |A| h.z²)²)`. `|A|` must be positive.
///
/// Cost on GCN: 17 instructions (2 at a quarter of the rate).
fn ggx_matrix_d(h: vec3f, a: vec3f) -> f32 {
    let det = sym2_det(a);
    let w = det / (sym2_quadratic(vec3f(a.z, -a.y, a.x), h.xy) + det * h.z * h.z);
    return inverseSqrt(det) * FRAC_1_PI * w * w;
}

/// Visibility from the two terms of `2 n·u n·v (1 + Λ(u) + Λ(v))`: `n·v |u'|` and `n·u |v'|`, where the prime
/// stretches a direction by the roughness. Finite, and meaningless, where both directions graze: their sum is 8e-9 where
/// both cosines are 1e-6 and alpha is ALPHA_MIN. The bound keeps the product with the sharpest peak finite too.
///
/// Cost on GCN: 3 instructions (1 at a quarter of the rate).
fn smith_v_of_terms(u: f32, v: f32) -> f32 {
    return 0.5 / max(u + v, 1e-12);
}

/// Height-correlated Smith visibility `G2 / (4 n·u n·v)`, isotropic (Heitz 2014, eq. 99).
///
/// Cost on GCN: 12 instructions (3 at a quarter of the rate).
fn smith_v(n_u: f32, n_v: f32, alpha: f32) -> f32 {
    let a_sqr = alpha * alpha;
    let v = n_u * sqrt(n_v * n_v * (1.0 - a_sqr) + a_sqr);
    let u = n_v * sqrt(n_u * n_u * (1.0 - a_sqr) + a_sqr);
    return smith_v_of_terms(u, v);
}

/// Height-correlated Smith visibility `G2 / (4 n·u n·v)`, anisotropic (Heitz 2014, eq. 99 with the lambda of section
/// 5.3). `u` and `v` lie in the upper hemisphere.
///
/// Cost on GCN: 16 instructions (3 at a quarter of the rate).
fn smith_aniso_v(u: vec3f, v: vec3f, alpha_t: f32, alpha_b: f32) -> f32 {
    let stretch = vec3f(alpha_t, alpha_b, 1.0);
    return smith_v_of_terms(v.z * length(u * stretch), u.z * length(v * stretch));
}

/// `smith_aniso_v` from the squared roughness matrix `a` (xx, xy, yy), with no eigen decode.
///
/// Cost on GCN: 21 instructions (3 at a quarter of the rate).
fn smith_matrix_v(u: vec3f, v: vec3f, a: vec3f) -> f32 {
    let stretched_u = sqrt(sym2_quadratic(a, u.xy) + u.z * u.z);
    let stretched_v = sqrt(sym2_quadratic(a, v.xy) + v.z * v.z);
    return smith_v_of_terms(v.z * stretched_u, u.z * stretched_v);
}

/// Smith masking of `v` alone, 0 to 1 (Heitz 2014, eq. 43).
///
/// Cost on GCN: 10 instructions (2 at a quarter of the rate).
fn smith_aniso_g1(v: vec3f, alpha_t: f32, alpha_b: f32) -> f32 {
    return 2.0 * v.z / (v.z + length(v * vec3f(alpha_t, alpha_b, 1.0)));
}

/// Fresnel reflectance by Schlick's approximation (1994) from `f0` at normal incidence to one at grazing.
///
/// Cost on GCN: 10 instructions.
fn schlick_f(f0: vec3f, v_h: f32) -> vec3f {
    let m = saturate(1.0 - v_h);
    let m_sqr = m * m;
    return f0 + (1.0 - f0) * (m_sqr * m_sqr * m);
}

/// A microfacet normal distributed as `ggx_vndf_pdf` for the view direction `v`, from two uniform numbers in [0, 1)
/// (Dupuy, Benyoub 2023, listing 3).
///
/// Cost on GCN: 32 instructions (5 at a quarter of the rate).
fn ggx_vndf_sample(v: vec3f, alpha_t: f32, alpha_b: f32, xi: vec2f) -> vec3f {
    let stretch = vec3f(alpha_t, alpha_b, 1.0);
    let v_std = normalize(v * stretch);

    // Sample the spherical cap that reflects to the upper hemisphere.
    let phi = 6.2831853 * xi.x;
    let z = (1.0 - xi.y) * (1.0 + v_std.z) - v_std.z;
    let sin_theta = sqrt(max(1.0 - z * z, 0.0));
    let cap = vec3f(sin_theta * cos(phi), sin_theta * sin(phi), z);

    // The rim of the cap is opposite to `v_std` in one point, where the sum may round to nothing.
    let h = (cap + v_std) * stretch;
    let length_squared = dot(h, h);
    return select(vec3f(0.0, 0.0, 1.0), h * inverseSqrt(length_squared), length_squared > 0.0);
}

/// Density per steradian of microfacet normals visible from `v`: `G1(v) max(v·h, 0) D(h) / n·v` (Heitz 2014, eq. 16).
/// Divide by `4 v·h` for the density of the reflected direction.
///
/// Cost on GCN: 29 instructions (3 at a quarter of the rate).
fn ggx_vndf_pdf(v: vec3f, h: vec3f, alpha_t: f32, alpha_b: f32) -> f32 {
    if h.z <= 0.0 {
        return 0.0;
    }
    let g_over_n_v = 2.0 / (v.z + length(v * vec3f(alpha_t, alpha_b, 1.0)));
    return g_over_n_v * max(dot(v, h), 0.0) * ggx_aniso_d(h, alpha_t, alpha_b);
}
