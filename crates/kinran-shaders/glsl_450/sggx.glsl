// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sggx.wesl, by ./x shaders. Needs: frame, sym

// SGGX matrices: a normal and its anisotropic roughness as one thing that can be averaged.
//
// Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

#ifndef KINRAN_SGGX_GLSL
#define KINRAN_SGGX_GLSL

#include "frame.glsl"
#include "sym.glsl"

/// A surface: unit normal, and squared roughness matrix (xx, xy, yy) in the frame of `m_n`.
struct GgxSurface {
    vec3 normal;
    vec3 a;
};

/// A distribution of slopes: centre and squared roughness (xx, xy, yy), both dimensionless.
struct SlopeDistribution {
    vec2 m;
    vec3 a;
};

/// `S = M_n [A 0; 0 1] M_n^T` (slide: Our Algorithm, step 1): the SGGX matrix of a GGX surface with unit normal `n`
/// and squared roughness matrix `a` (xx, xy, yy) in the frame of `m_n`.
///
/// Cost on GCN: 51 instructions (1 at a quarter of the rate).
mat3 sggx_from_ggx(vec3 n, vec3 a) {
    mat3 _e2 = m_n(n);
    vec3 ax = (_e2[0] * a.x) + (_e2[1] * a.y);
    vec3 ay = (_e2[0] * a.y) + (_e2[1] * a.z);
    return mat3((((ax * _e2[0].x) + (ay * _e2[1].x)) + (n * n.x)), (((ax * _e2[0].y) + (ay * _e2[1].y)) + (n * n.y)), (((ax * _e2[0].z) + (ay * _e2[1].z)) + (n * n.z)));
}

/// Area of the microflakes projected along the unit vector `w`: `sqrt(w^T S w)` (Heitz 2015).
///
/// Cost on GCN: 14 instructions (1 at a quarter of the rate).
float sggx_projected_area(mat3 s, vec3 w) {
    float _e2 = sym3_quadratic(s, w);
    return sqrt(max(_e2, 0.0));
}

/// Distribution of microflake normals at the unit vector `h`, a density per steradian over the sphere:
/// `1 / (π sqrt|S| (h^T S^-1 h)^2)` (Heitz 2015), written as `|S|^(3/2) / (π (h^T adj(S) h)^2)`. `s` must have a
/// positive determinant. Single precision leaves a relative error of 1e-5 over the smallest eigenvalue.
///
/// Cost on GCN: 39 instructions (2 at a quarter of the rate).
float sggx_d(mat3 s, vec3 h) {
    float _e2 = sym3_det(s);
    mat3 _e3 = sym3_adjugate(s);
    float _e4 = sym3_quadratic(_e3, h);
    return (_e2 * sqrt(_e2)) / ((3.1415927 * _e4) * _e4);
}

/// The slope distribution an SGGX matrix with zz > 0 stands for, seen from the z axis: `S / S_zz = [A + m m^T, m;
/// m^T, 1]`. The slopes follow a bivariate Student-t with two degrees of freedom.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
SlopeDistribution slopes_from_sggx(mat3 s) {
    float inv = 1.0 / s[2].z;
    vec2 m = s[2].xy * inv;
    vec3 a = (vec3(s[0].x, s[0].y, s[1].y) * inv) - vec3((m.x * m.x), (m.x * m.y), (m.y * m.y));
    return SlopeDistribution(m, a);
}

/// The SGGX matrix with zz = 1 of a slope distribution; the inverse of `slopes_from_sggx`.
///
/// Cost on GCN: 3 instructions.
mat3 sggx_from_slopes(vec2 m, vec3 a) {
    float xy = a.y + (m.x * m.y);
    return mat3(vec3((a.x + (m.x * m.x)), xy, m.x), vec3(xy, (a.z + (m.y * m.y)), m.y), vec3(m, 1.0));
}

/// The talk's power iteration (slide: Our Algorithm, step 3): `steps` times `n = S n / |S n|` from `start`. The
/// tangent of the error shrinks by the ratio of the two largest eigenvalues a step; in V grooves steeper than 45° it
/// leaves the surface for its walls. `sggx_principal_axis` has neither fault.
///
/// Cost on GCN: 34 instructions (2 at a quarter of the rate), one round of its loop.
vec3 sggx_power_iteration(mat3 s, vec3 start, uint steps) {
    vec3 n = vec3(0.0);
    uint i = 0u;
    float _e3 = sym3_trace(s);
    float scale = 1.0 / max(_e3, 1e-30);
    n = start;
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            uint _e24 = i;
            i = _e24 + 1u;
        }
        loop_init = false;
        uint _e11 = i;
        if (_e11 < steps) {
        } else {
            break;
        }
        {
            vec3 _e13 = n;
            vec3 next = (s * _e13) * scale;
            float length_squared = dot(next, next);
            vec3 _e17 = n;
            n = (length_squared > 0.0) ? (next * inversesqrt(length_squared)) : _e17;
        }
    }
    vec3 _e26 = n;
    return _e26;
}

/// Squared overlap with the eigenvector of `l`, from the moments m' B m and |B m|² of a deviator of unit size.
///
/// Cost on GCN: 7 instructions (1 at a quarter of the rate).
float sggx_overlap(float l, float moment, float moment_sqr) {
    return (((moment_sqr + (l * moment)) + (l * l)) - 3.0) / (((3.0 * l) * l) - 3.0);
}

/// The unit eigenvector of `s` with the largest overlap with the unit vector `start`, signed to agree with it.
/// Started at the mean normal of a footprint it finds the filtered normal, also where the largest eigenvalue is
/// another one (V grooves steeper than 45°). Where eigenvalues coincide, to 0.1 % of their spread, it is the
/// projection of `start` on their space; `start` itself if `s` is a multiple of the identity. No trigonometry.
///
/// Cost on GCN: 204 instructions (10 at a quarter of the rate).
vec3 sggx_principal_axis(mat3 s, vec3 start) {
    bool local_2 = false;
    bool local_3 = false;
    float _e4 = sym3_trace(s);
    mat3 _e7 = sym3_scale(s, (1.0 / _e4));
    mat3 _e9 = sym3_add_diagonal(_e7, -0.33333334);
    float squares = (dot(_e9[0], _e9[0]) + dot(_e9[1], _e9[1])) + dot(_e9[2], _e9[2]);
    float size = sqrt((squares * 0.16666667));
    mat3 _e26 = sym3_scale(_e9, (1.0 / size));
    float _e27 = sym3_det(_e26);
    float r = 0.5 * _e27;
    mat3 _e35 = sym3_scale(_e26, ((r < 0.0) ? -1.0 : 1.0));
    float t_sqr = max((0.5 - (0.5 * abs(r))), 0.0);
    float series = 1.0 + (t_sqr * (0.09259259 + (t_sqr * (0.039609052 + (t_sqr * 0.023157675)))));
    float sine = (sqrt(t_sqr) * 0.6666667) * series;
    float cosine = sqrt((1.0 - (sine * sine)));
    float l_first = 2.0 * cosine;
    float l_second = (1.7320508 * sine) - cosine;
    float l_third = (-(1.7320508) * sine) - cosine;
    vec3 bn = _e35 * start;
    float moment = dot(start, bn);
    float moment_sqr = dot(bn, bn);
    float _e71 = sggx_overlap(l_first, moment, moment_sqr);
    float w_first = clamp(_e71, 0.0, 1.0);
    bool coincident = sine < 0.001;
    float rest = 1.0 - w_first;
    float _e76 = sggx_overlap(l_second, moment, moment_sqr);
    float w_second = coincident ? rest : min(max(_e76, 0.0), rest);
    float w_third = (1.0 - w_first) - w_second;
    bool is_first = w_first >= max(w_second, w_third);
    vec3 p = bn - (start * (is_first ? l_second : l_first));
    if (!(is_first)) {
        local_2 = w_second >= w_third;
    } else {
        local_2 = true;
    }
    bool _e94 = local_2;
    float other = _e94 ? l_third : l_second;
    vec3 q = (_e35 * p) - (p * other);
    if (coincident) {
        local_3 = !(is_first);
    } else {
        local_3 = false;
    }
    bool _e103 = local_3;
    vec3 projected = normalize((_e103 ? p : q));
    float _e106 = sym3_quadratic(_e35, projected);
    mat3 _e108 = sym3_add_diagonal(_e35, -(_e106));
    mat3 _e109 = sym3_adjugate(_e108);
    vec3 refined = _e109 * projected;
    float refined_length = length(refined);
    bool far = refined_length > ((6.0 * 1.7320508) * 0.001);
    vec3 axis = far ? (refined * (1.0 / refined_length)) : projected;
    vec3 n = (size > 3e-6) ? axis : start;
    return (dot(n, start) < 0.0) ? -(n) : n;
}

/// `ggx_from_sggx` before the clamp of the roughness.
///
/// Cost on GCN: 268 instructions (12 at a quarter of the rate).
GgxSurface ggx_from_sggx_unclamped(mat3 s, vec3 mean_normal) {
    vec3 _e2 = sggx_principal_axis(s, mean_normal);
    vec3 n = (_e2.z < 0.0) ? -(_e2) : _e2;
    mat3 _e8 = m_n(n);
    vec3 sx = s * _e8[0];
    vec3 sy = s * _e8[1];
    float _e13 = sym3_quadratic(s, n);
    float inv = 1.0 / max(_e13, 1e-30);
    return GgxSurface(n, (vec3(dot(_e8[0], sx), dot(_e8[0], sy), dot(_e8[1], sy)) * inv));
}

/// Normal and squared roughness matrix of a filtered SGGX matrix (slide: Our Algorithm, step 3). `mean_normal`, a unit
/// vector, picks the eigenvector as in `sggx_principal_axis`. The normal returned has z ≥ 0, eigenvalues of the
/// roughness lie in [0, 1]: a microsurface rougher than alpha = 1 is clamped, because no texture can hold it.
///
/// Cost on GCN: 321 instructions (17 at a quarter of the rate).
GgxSurface ggx_from_sggx(mat3 s, vec3 mean_normal) {
    GgxSurface _e2 = ggx_from_sggx_unclamped(s, mean_normal);
    vec3 _e7 = sym2_clamp_eigen(_e2.a, 0.0, 1.0);
    return GgxSurface(_e2.normal, _e7);
}

#endif
