// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_sampling.wesl, by ./x shaders. Needs: fuzz_phase, ggx

// Light directions for a view, where a layer of fibres and its base scatter from.
//
// Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.

/// A light direction distributed as `fuzz_pdf` for the view `v`, from two uniform numbers in [0, 1): `v` reflected on a
/// visible normal of the fibres (Heitz 2015, section 4). It may lie below the horizon, where the layer receives nothing:
/// the density covers the sphere.
///
/// Cost on GCN: 58 instructions (6 at a quarter of the rate).
fn fuzz_sample(v: vec3f, t: vec3f, alpha: f32, xi: vec2f) -> vec3f {
    let squeezed_v = v - t * ((1.0 - alpha) * dot(t, v));
    let phi = 6.28318531 * xi.x;
    let z = 1.0 - 2.0 * xi.y;
    let r = sqrt(max(1.0 - z * z, 0.0));
    let axis = normalize(squeezed_v);
    let sum = vec3f(r * cos(phi), r * sin(phi), z) + axis;
    // The point opposite to the axis is no direction.
    let m = normalize(select(axis, sum, dot(sum, sum) > 1e-12));
    let h = normalize(m - t * ((1.0 - alpha) * dot(t, m)));
    return h * (2.0 * dot(v, h)) - v;
}

/// Density per steradian of `fuzz_sample`: `D_F(h) / (4 σ_F(v))`.
///
/// Cost on GCN: 27 instructions (2 at a quarter of the rate).
fn fuzz_pdf(u: vec3f, v: vec3f, t: vec3f, alpha: f32) -> f32 {
    return fibre_phase(dot(u, v), dot(t, v), dot(t, u), alpha);
}

/// Probabilities of sampling the layer, the base's specular lobe and its diffuse one, in proportion to the light that
/// each is expected to send; each at least 5 % of the largest, so that a wrong guess only adds noise.
///
/// Cost on GCN: 12 instructions (1 at a quarter of the rate).
fn fuzz_over_base_shares(fuzz: f32, specular: f32, diffuse: f32) -> vec3f {
    let least = 0.05 * max(max(fuzz, max(specular, diffuse)), 1e-6);
    let shares = max(vec3f(fuzz, specular, diffuse), vec3f(least));
    return shares / (shares.x + shares.y + shares.z);
}

/// A light direction for a layer of fibres over GGX and Lambert, distributed as `fuzz_over_base_pdf`; vectors in the
/// frame of the alphas, z along the normal, `shares` as `fuzz_over_base_shares` gives them.
///
/// Cost on GCN: 118 instructions (18 at a quarter of the rate).
fn fuzz_over_base_sample(
    v: vec3f,
    t: vec3f,
    alpha: f32,
    alpha_t: f32,
    alpha_b: f32,
    shares: vec3f,
    xi: vec2f,
) -> vec3f {
    if xi.x < shares.x {
        return fuzz_sample(v, t, alpha, vec2f(xi.x / shares.x, xi.y));
    }
    let rest = xi.x - shares.x;
    if rest < shares.y {
        let h = ggx_vndf_sample(v, alpha_t, alpha_b, vec2f(rest / shares.y, xi.y));
        return h * (2.0 * dot(v, h)) - v;
    }
    // Rounding may take the last number to one.
    let x = saturate((rest - shares.y) / shares.z);
    let phi = 6.28318531 * xi.y;
    let r = sqrt(x);
    return vec3f(r * cos(phi), r * sin(phi), sqrt(1.0 - x));
}

/// Density per steradian of `fuzz_over_base_sample`, over the sphere.
///
/// Cost on GCN: 84 instructions (7 at a quarter of the rate).
fn fuzz_over_base_pdf(
    u: vec3f,
    v: vec3f,
    t: vec3f,
    alpha: f32,
    alpha_t: f32,
    alpha_b: f32,
    shares: vec3f,
) -> f32 {
    let sum = u + v;
    let h = normalize(select(t, sum, dot(sum, sum) > 1e-12));
    let specular = ggx_vndf_pdf(v, h, alpha_t, alpha_b) / max(4.0 * dot(v, h), 1e-12);
    let diffuse = max(u.z, 0.0) * 0.318309886;
    return shares.x * fuzz_pdf(u, v, t, alpha) + shares.y * specular + shares.z * diffuse;
}
