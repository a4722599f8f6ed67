// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sggx.wesl, by ./x shaders. Needs: frame, sym

// SGGX matrices: a normal and its anisotropic roughness as one thing that can be averaged.
//
// Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

/// A surface: unit normal, and squared roughness matrix (xx, xy, yy) in the frame of `m_n`.
struct GgxSurface {
    /// Unit normal.
    normal: vec3f,
    /// Squared roughness (xx, xy, yy).
    a: vec3f,
}

/// A distribution of slopes: centre and squared roughness (xx, xy, yy), both dimensionless.
struct SlopeDistribution {
    /// Centre.
    m: vec2f,
    /// Squared roughness (xx, xy, yy).
    a: vec3f,
}

/// `S = M_n [A 0; 0 1] M_n^T` (slide: Our Algorithm, step 1): the SGGX matrix of a GGX surface with unit normal `n`
/// and squared roughness matrix `a` (xx, xy, yy) in the frame of `m_n`.
///
/// Cost on GCN: 51 instructions (1 at a quarter of the rate).
fn sggx_from_ggx(n: vec3f, a: vec3f) -> mat3x3f {
    let m = m_n(n);
    let ax = m[0] * a.x + m[1] * a.y;
    let ay = m[0] * a.y + m[1] * a.z;
    return mat3x3f(
        ax * m[0].x + ay * m[1].x + n * n.x,
        ax * m[0].y + ay * m[1].y + n * n.y,
        ax * m[0].z + ay * m[1].z + n * n.z,
    );
}

/// Area of the microflakes projected along the unit vector `w`: `sqrt(w^T S w)` (Heitz 2015).
///
/// Cost on GCN: 14 instructions (1 at a quarter of the rate).
fn sggx_projected_area(s: mat3x3f, w: vec3f) -> f32 {
    return sqrt(max(sym3_quadratic(s, w), 0.0));
}

/// Distribution of microflake normals at the unit vector `h`, a density per steradian over the sphere:
/// `1 / (π sqrt|S| (h^T S^-1 h)^2)` (Heitz 2015), written as `|S|^(3/2) / (π (h^T adj(S) h)^2)`. `s` must have a
/// positive determinant. Single precision leaves a relative error of 1e-5 over the smallest eigenvalue.
///
/// Cost on GCN: 39 instructions (2 at a quarter of the rate).
fn sggx_d(s: mat3x3f, h: vec3f) -> f32 {
    let det = sym3_det(s);
    let q = sym3_quadratic(sym3_adjugate(s), h);
    return det * sqrt(det) / (3.14159265 * q * q);
}

/// The slope distribution an SGGX matrix with zz > 0 stands for, seen from the z axis: `S / S_zz = [A + m m^T, m;
/// m^T, 1]`. The slopes follow a bivariate Student-t with two degrees of freedom.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
fn slopes_from_sggx(s: mat3x3f) -> SlopeDistribution {
    let inv = 1.0 / s[2].z;
    let m = s[2].xy * inv;
    let a = vec3f(s[0].x, s[0].y, s[1].y) * inv - vec3f(m.x * m.x, m.x * m.y, m.y * m.y);
    return SlopeDistribution(m, a);
}

/// The SGGX matrix with zz = 1 of a slope distribution; the inverse of `slopes_from_sggx`.
///
/// Cost on GCN: 3 instructions.
fn sggx_from_slopes(m: vec2f, a: vec3f) -> mat3x3f {
    let xy = a.y + m.x * m.y;
    return mat3x3f(vec3f(a.x + m.x * m.x, xy, m.x), vec3f(xy, a.z + m.y * m.y, m.y), vec3f(m, 1.0));
}

/// The talk's power iteration (slide: Our Algorithm, step 3): `steps` times `n = S n / |S n|` from `start`. The
/// tangent of the error shrinks by the ratio of the two largest eigenvalues a step; in V grooves steeper than 45° it
/// leaves the surface for its walls. `sggx_principal_axis` has neither fault.
///
/// Cost on GCN: 34 instructions (2 at a quarter of the rate), one round of its loop.
fn sggx_power_iteration(s: mat3x3f, start: vec3f, steps: u32) -> vec3f {
    let scale = 1.0 / max(sym3_trace(s), 1e-30);
    var n = start;
    for (var i = 0u; i < steps; i++) {
        let next = s * n * scale;
        let length_squared = dot(next, next);
        n = select(n, next * inverseSqrt(length_squared), length_squared > 0.0);
    }
    return n;
}

/// Squared overlap with the eigenvector of `l`, from the moments m' B m and |B m|² of a deviator of unit size.
///
/// Cost on GCN: 7 instructions (1 at a quarter of the rate).
fn sggx_overlap(l: f32, moment: f32, moment_sqr: f32) -> f32 {
    return (moment_sqr + l * moment + l * l - 3.0) / (3.0 * l * l - 3.0);
}

/// The unit eigenvector of `s` with the largest overlap with the unit vector `start`, signed to agree with it.
/// Started at the mean normal of a footprint it finds the filtered normal, also where the largest eigenvalue is
/// another one (V grooves steeper than 45°). Where eigenvalues coincide, to 0.1 % of their spread, it is the
/// projection of `start` on their space; `start` itself if `s` is a multiple of the identity. No trigonometry.
///
/// Cost on GCN: 204 instructions (10 at a quarter of the rate).
fn sggx_principal_axis(s: mat3x3f, start: vec3f) -> vec3f {
    let sqrt_three = 1.7320508;
    // Sine under which two eigenvalues are one: rounding of r alone makes 3e-4.
    let coincidence = 1e-3;

    // The deviator B of unit size and det B >= 0: its eigenvalues are 2 cos(φ), 2 cos(φ ± 2π/3) with 3φ = acos(r),
    // the first at least sqrt(3) away from the others.
    let deviator = sym3_add_diagonal(sym3_scale(s, 1.0 / sym3_trace(s)), -1.0 / 3.0);
    let squares = dot(deviator[0], deviator[0]) + dot(deviator[1], deviator[1]) + dot(deviator[2], deviator[2]);
    let size = sqrt(squares * (1.0 / 6.0));
    let unit = sym3_scale(deviator, 1.0 / size);
    let r = 0.5 * sym3_det(unit);
    let b = sym3_scale(unit, select(1.0, -1.0, r < 0.0));

    // sin(2/3 asin(t)) with t = sin(3φ/2) <= sqrt(1/2) by four terms of its series, within 0.1 %: the refinement
    // below cubes the error.
    let t_sqr = max(0.5 - 0.5 * abs(r), 0.0);
    let series = 1.0 + t_sqr * (5.0 / 54.0 + t_sqr * (77.0 / 1944.0 + t_sqr * (2431.0 / 104976.0)));
    let sine = sqrt(t_sqr) * (2.0 / 3.0) * series;
    let cosine = sqrt(1.0 - sine * sine);
    let l_first = 2.0 * cosine;
    let l_second = sqrt_three * sine - cosine;
    let l_third = -sqrt_three * sine - cosine;

    // Squared overlaps with the three eigenvectors.
    let bn = b * start;
    let moment = dot(start, bn);
    let moment_sqr = dot(bn, bn);
    let w_first = saturate(sggx_overlap(l_first, moment, moment_sqr));
    let coincident = sine < coincidence;
    let rest = 1.0 - w_first;
    let w_second = select(min(max(sggx_overlap(l_second, moment, moment_sqr), 0.0), rest), rest, coincident);
    let w_third = 1.0 - w_first - w_second;

    // Project the two others away, (B - l I)(B - l' I), by Cayley–Hamilton.
    let is_first = w_first >= max(w_second, w_third);
    let p = bn - start * select(l_first, l_second, is_first);
    let other = select(l_second, l_third, is_first || w_second >= w_third);
    let q = b * p - p * other;
    let projected = normalize(select(q, p, coincident && !is_first));

    // One step of Rayleigh quotient iteration, adj(B - (n^T B n) I) n.
    let refined = sym3_adjugate(sym3_add_diagonal(b, -sym3_quadratic(b, projected))) * projected;
    let refined_length = length(refined);
    // The length is the product of the distances to both other eigenvalues, 6 sqrt(3) sine for a close one.
    let far = refined_length > 6.0 * sqrt_three * coincidence;
    let axis = select(projected, refined * (1.0 / refined_length), far);

    // Rounding of S, 1e-7 of its trace, is all there is of a smaller deviator.
    let n = select(start, axis, size > 3e-6);
    return select(n, -n, dot(n, start) < 0.0);
}

/// `ggx_from_sggx` before the clamp of the roughness.
///
/// Cost on GCN: 268 instructions (12 at a quarter of the rate).
fn ggx_from_sggx_unclamped(s: mat3x3f, mean_normal: vec3f) -> GgxSurface {
    let axis = sggx_principal_axis(s, mean_normal);
    let n = select(axis, -axis, axis.z < 0.0);
    let m = m_n(n);
    let sx = s * m[0];
    let sy = s * m[1];
    let inv = 1.0 / max(sym3_quadratic(s, n), 1e-30);
    return GgxSurface(n, vec3f(dot(m[0], sx), dot(m[0], sy), dot(m[1], sy)) * inv);
}

/// Normal and squared roughness matrix of a filtered SGGX matrix (slide: Our Algorithm, step 3). `mean_normal`, a unit
/// vector, picks the eigenvector as in `sggx_principal_axis`. The normal returned has z ≥ 0, eigenvalues of the
/// roughness lie in [0, 1]: a microsurface rougher than alpha = 1 is clamped, because no texture can hold it.
///
/// Cost on GCN: 321 instructions (17 at a quarter of the rate).
fn ggx_from_sggx(s: mat3x3f, mean_normal: vec3f) -> GgxSurface {
    let surface = ggx_from_sggx_unclamped(s, mean_normal);
    return GgxSurface(surface.normal, sym2_clamp_eigen(surface.a, 0.0, 1.0));
}
