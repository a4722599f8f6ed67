// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sym.wesl, by ./x shaders. Needs: nothing else

// Symmetric matrices. A 2×2 one is a vec3f (xx, xy, yy), so that sums and scalings are the language's own; a 3×3
// one is a mat3x3f.

/// The 2×2 matrix with eigenvalue `l1` along the unit vector `axis` and `l2` across it.
///
/// Cost on GCN: 11 instructions.
fn sym2_from_eigen(l1: f32, l2: f32, axis: vec2f) -> vec3f {
    return vec3f(
        l1 * axis.x * axis.x + l2 * axis.y * axis.y,
        (l1 - l2) * axis.x * axis.y,
        l1 * axis.y * axis.y + l2 * axis.x * axis.x,
    );
}

/// `v v^T`.
///
/// Cost on GCN: 3 instructions.
fn sym2_outer(v: vec2f) -> vec3f {
    return vec3f(v.x * v.x, v.x * v.y, v.y * v.y);
}

/// Determinant of a 2×2 matrix.
///
/// Cost on GCN: 2 instructions.
fn sym2_det(a: vec3f) -> f32 {
    return a.x * a.z - a.y * a.y;
}

/// Trace of a 2×2 matrix.
///
/// Cost on GCN: 1 instruction.
fn sym2_trace(a: vec3f) -> f32 {
    return a.x + a.z;
}

/// `v^T A v`.
///
/// Cost on GCN: 7 instructions.
fn sym2_quadratic(a: vec3f, v: vec2f) -> f32 {
    return a.x * v.x * v.x + 2.0 * a.y * v.x * v.y + a.z * v.y * v.y;
}

/// Eigenvalues of a positive semi-definite 2×2 matrix and the unit eigenvector of the larger.
struct SymEigen {
    /// The larger eigenvalue.
    larger: f32,
    /// The smaller eigenvalue.
    smaller: f32,
    /// Unit eigenvector of the larger.
    axis: vec2f,
}

/// Eigenvalues and axis of a positive semi-definite matrix, both at least zero. The axis has x ≥ 0 (and y = +1
/// where x = 0) and is (1, 0) when both eigenvalues are equal. The smaller is `det / larger`, which keeps its digits
/// where the textbook's half difference cancels.
///
/// Cost on GCN: 33 instructions (5 at a quarter of the rate).
fn sym2_eigen(a: vec3f) -> SymEigen {
    let half_difference = 0.5 * (a.x - a.z);
    let radius = sqrt(half_difference * half_difference + a.y * a.y);
    let larger = 0.5 * (a.x + a.z) + radius;
    // A radius far below the rounding of the diagonal is none, and its square may underflow.
    if radius <= 1e-12 * larger || larger <= 0.0 {
        return SymEigen(max(larger, 0.0), max(larger - 2.0 * radius, 0.0), vec2f(1.0, 0.0));
    }
    let smaller = min(max(sym2_det(a) / larger, 0.0), larger);

    // The larger component of the half-angle is free of cancellation, the other follows from xy.
    let long = sqrt(0.5 + 0.5 * abs(half_difference) / radius);
    let short = 0.5 * abs(a.y) / (radius * long);
    let side = select(1.0, -1.0, a.y < 0.0);
    let axis = select(vec2f(short, side * long), vec2f(long, side * short), half_difference >= 0.0);
    return SymEigen(larger, smaller, axis);
}

/// The same eigenvectors with both eigenvalues clamped to `[lo, hi]`, `lo` ≥ 0. A matrix within the range comes back
/// as it is.
///
/// Cost on GCN: 54 instructions (5 at a quarter of the rate).
fn sym2_clamp_eigen(a: vec3f, lo: f32, hi: f32) -> vec3f {
    let e = sym2_eigen(a);
    let clamped = sym2_from_eigen(clamp(e.larger, lo, hi), clamp(e.smaller, lo, hi), e.axis);
    return select(clamped, a, e.larger <= hi && e.smaller > lo);
}

/// The positive semi-definite square root of a positive semi-definite matrix:
/// `(A + sqrt(det) I) / sqrt(trace + 2 sqrt(det))`, by Cayley–Hamilton.
///
/// Cost on GCN: 17 instructions (3 at a quarter of the rate).
fn sym2_sqrt(a: vec3f) -> vec3f {
    let root_det = sqrt(max(sym2_det(a), 0.0));
    let scale = sqrt(sym2_trace(a) + 2.0 * root_det);
    if scale == 0.0 {
        return vec3f(0.0);
    }
    return (a + vec3f(root_det, 0.0, root_det)) * (1.0 / scale);
}

/// `k A`. Column by column: a matrix times a number, which HLSL writes `mul(k, A)`, is refused by Slang for WGSL.
///
/// Cost on GCN: 9 instructions.
fn sym3_scale(a: mat3x3f, k: f32) -> mat3x3f {
    return mat3x3f(a[0] * k, a[1] * k, a[2] * k);
}

/// `A + d I`.
///
/// Cost on GCN: 3 instructions.
fn sym3_add_diagonal(a: mat3x3f, d: f32) -> mat3x3f {
    return mat3x3f(a[0] + vec3f(d, 0.0, 0.0), a[1] + vec3f(0.0, d, 0.0), a[2] + vec3f(0.0, 0.0, d));
}

/// `v^T A v`.
///
/// Cost on GCN: 12 instructions.
fn sym3_quadratic(a: mat3x3f, v: vec3f) -> f32 {
    return dot(v, a * v);
}

/// Trace of a 3×3 matrix.
///
/// Cost on GCN: 2 instructions.
fn sym3_trace(a: mat3x3f) -> f32 {
    return a[0].x + a[1].y + a[2].z;
}

/// The adjugate of a symmetric matrix: `A adj(A) = det(A) I`. Its columns are the cross products of A's.
///
/// Cost on GCN: 18 instructions.
fn sym3_adjugate(a: mat3x3f) -> mat3x3f {
    return mat3x3f(cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1]));
}

/// Determinant of a symmetric 3×3 matrix.
///
/// Cost on GCN: 9 instructions.
fn sym3_det(a: mat3x3f) -> f32 {
    return dot(a[0], cross(a[1], a[2]));
}
