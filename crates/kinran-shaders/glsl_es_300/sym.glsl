// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sym.wesl, by ./x shaders. Needs: nothing else

// Symmetric matrices. A 2×2 one is a vec3f (xx, xy, yy), so that sums and scalings are the language's own; a 3×3
// one is a mat3x3f.

#ifndef KINRAN_SYM_GLSL
#define KINRAN_SYM_GLSL

/// Eigenvalues of a positive semi-definite 2×2 matrix and the unit eigenvector of the larger.
struct SymEigen {
    float larger;
    float smaller;
    vec2 axis;
};

/// The 2×2 matrix with eigenvalue `l1` along the unit vector `axis` and `l2` across it.
///
/// Cost on GCN: 11 instructions.
vec3 sym2_from_eigen(float l1_, float l2_, vec2 axis) {
    return vec3((((l1_ * axis.x) * axis.x) + ((l2_ * axis.y) * axis.y)), (((l1_ - l2_) * axis.x) * axis.y), (((l1_ * axis.y) * axis.y) + ((l2_ * axis.x) * axis.x)));
}

/// `v v^T`.
///
/// Cost on GCN: 3 instructions.
vec3 sym2_outer(vec2 v) {
    return vec3((v.x * v.x), (v.x * v.y), (v.y * v.y));
}

/// Determinant of a 2×2 matrix.
///
/// Cost on GCN: 2 instructions.
float sym2_det(vec3 a) {
    return (a.x * a.z) - (a.y * a.y);
}

/// Trace of a 2×2 matrix.
///
/// Cost on GCN: 1 instruction.
float sym2_trace(vec3 a) {
    return a.x + a.z;
}

/// `v^T A v`.
///
/// Cost on GCN: 7 instructions.
float sym2_quadratic(vec3 a, vec2 v) {
    return (((a.x * v.x) * v.x) + (((2.0 * a.y) * v.x) * v.y)) + ((a.z * v.y) * v.y);
}

/// Eigenvalues and axis of a positive semi-definite matrix, both at least zero. The axis has x ≥ 0 (and y = +1
/// where x = 0) and is (1, 0) when both eigenvalues are equal. The smaller is `det / larger`, which keeps its digits
/// where the textbook's half difference cancels.
///
/// Cost on GCN: 33 instructions (5 at a quarter of the rate).
SymEigen sym2_eigen(vec3 a) {
    bool local = false;
    float half_difference = 0.5 * (a.x - a.z);
    float radius = sqrt(((half_difference * half_difference) + (a.y * a.y)));
    float larger = (0.5 * (a.x + a.z)) + radius;
    if (!((radius <= (1e-12 * larger)))) {
        local = larger <= 0.0;
    } else {
        local = true;
    }
    bool _e27 = local;
    if (_e27) {
        return SymEigen(max(larger, 0.0), max((larger - (2.0 * radius)), 0.0), vec2(1.0, 0.0));
    }
    float _e39 = sym2_det(a);
    float smaller = min(max((_e39 / larger), 0.0), larger);
    float long_ = sqrt((0.5 + ((0.5 * abs(half_difference)) / radius)));
    float short_ = (0.5 * abs(a.y)) / (radius * long_);
    float side = (a.y < 0.0) ? -1.0 : 1.0;
    vec2 axis = (half_difference >= 0.0) ? vec2(long_, (side * short_)) : vec2(short_, (side * long_));
    return SymEigen(larger, smaller, axis);
}

/// The same eigenvectors with both eigenvalues clamped to `[lo, hi]`, `lo` ≥ 0. A matrix within the range comes back
/// as it is.
///
/// Cost on GCN: 54 instructions (5 at a quarter of the rate).
vec3 sym2_clamp_eigen(vec3 a, float lo, float hi) {
    bool local = false;
    SymEigen _e3 = sym2_eigen(a);
    vec3 _e9 = sym2_from_eigen(clamp(_e3.larger, lo, hi), clamp(_e3.smaller, lo, hi), _e3.axis);
    if (_e3.larger <= hi) {
        local = _e3.smaller > lo;
    } else {
        local = false;
    }
    bool _e17 = local;
    return _e17 ? a : _e9;
}

/// The positive semi-definite square root of a positive semi-definite matrix:
/// `(A + sqrt(det) I) / sqrt(trace + 2 sqrt(det))`, by Cayley–Hamilton.
///
/// Cost on GCN: 17 instructions (3 at a quarter of the rate).
vec3 sym2_sqrt(vec3 a) {
    float _e1 = sym2_det(a);
    float root_det = sqrt(max(_e1, 0.0));
    float _e5 = sym2_trace(a);
    float scale = sqrt((_e5 + (2.0 * root_det)));
    if (scale == 0.0) {
        return vec3(0.0);
    }
    return (a + vec3(root_det, 0.0, root_det)) * (1.0 / scale);
}

/// `k A`. Column by column: a matrix times a number, which HLSL writes `mul(k, A)`, is refused by Slang for WGSL.
///
/// Cost on GCN: 9 instructions.
mat3 sym3_scale(mat3 a, float k) {
    return mat3((a[0] * k), (a[1] * k), (a[2] * k));
}

/// `A + d I`.
///
/// Cost on GCN: 3 instructions.
mat3 sym3_add_diagonal(mat3 a, float d) {
    return mat3((a[0] + vec3(d, 0.0, 0.0)), (a[1] + vec3(0.0, d, 0.0)), (a[2] + vec3(0.0, 0.0, d)));
}

/// `v^T A v`.
///
/// Cost on GCN: 12 instructions.
float sym3_quadratic(mat3 a, vec3 v) {
    return dot(v, (a * v));
}

/// Trace of a 3×3 matrix.
///
/// Cost on GCN: 2 instructions.
float sym3_trace(mat3 a) {
    return (a[0].x + a[1].y) + a[2].z;
}

/// The adjugate of a symmetric matrix: `A adj(A) = det(A) I`. Its columns are the cross products of A's.
///
/// Cost on GCN: 18 instructions.
mat3 sym3_adjugate(mat3 a) {
    return mat3(cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1]));
}

/// Determinant of a symmetric 3×3 matrix.
///
/// Cost on GCN: 9 instructions.
float sym3_det(mat3 a) {
    return dot(a[0], cross(a[1], a[2]));
}

#endif
