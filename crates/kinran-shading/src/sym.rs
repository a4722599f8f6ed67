//! Symmetric 2×2 and 3×3 matrices, stored without their mirrored halves.

use crate::sqrt::sqrt;
use core::ops::{Add, Mul};
use glam::{Mat3, Vec2, Vec3, vec2, vec3};

/// A symmetric 2×2 matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sym2 {
    /// Row x, column x.
    pub xx: f32,
    /// Row x, column y, and its mirror image.
    pub xy: f32,
    /// Row y, column y.
    pub yy: f32,
}

impl Sym2 {
    /// The matrix `s * I`.
    pub fn scalar(s: f32) -> Self {
        Sym2 { xx: s, xy: 0.0, yy: s }
    }

    /// The matrix with eigenvalue `l1` along the unit vector `axis` and `l2` across it.
    pub fn from_eigen(l1: f32, l2: f32, axis: Vec2) -> Self {
        Sym2 {
            xx: l1 * axis.x * axis.x + l2 * axis.y * axis.y,
            xy: (l1 - l2) * axis.x * axis.y,
            yy: l1 * axis.y * axis.y + l2 * axis.x * axis.x,
        }
    }

    /// `v v^T`.
    pub fn outer(v: Vec2) -> Self {
        Sym2 { xx: v.x * v.x, xy: v.x * v.y, yy: v.y * v.y }
    }

    /// Determinant.
    pub fn det(self) -> f32 {
        self.xx * self.yy - self.xy * self.xy
    }

    /// Trace.
    pub fn trace(self) -> f32 {
        self.xx + self.yy
    }

    /// `v^T A v`.
    pub fn quadratic(self, v: Vec2) -> f32 {
        self.xx * v.x * v.x + 2.0 * self.xy * v.x * v.y + self.yy * v.y * v.y
    }

    /// Eigenvalues `(larger, smaller)` of a positive semi-definite matrix and the unit eigenvector of the
    /// larger, with x ≥ 0 (and y = +1 where x = 0); (1, 0) when both are equal. The smaller eigenvalue is
    /// `det / larger`, which keeps its digits where the textbook's half difference cancels. Both are clamped
    /// at zero, which undoes what rounding does to the determinant of a singular matrix.
    pub fn eigen(self) -> (f32, f32, Vec2) {
        let half_difference = 0.5 * (self.xx - self.yy);
        let radius = sqrt(half_difference * half_difference + self.xy * self.xy);
        let l1 = 0.5 * self.trace() + radius;
        // A radius far below the rounding of the diagonal is none, and its square may underflow.
        if radius <= 1e-12 * l1 || l1 <= 0.0 {
            return (l1.max(0.0), (l1 - 2.0 * radius).max(0.0), Vec2::X);
        }
        let l2 = (self.det() / l1).max(0.0).min(l1);

        // The larger component of the half-angle is free of cancellation, the other follows from xy.
        let axis = if half_difference >= 0.0 {
            let c = sqrt(0.5 + 0.5 * half_difference / radius);
            vec2(c, 0.5 * self.xy / (radius * c))
        } else {
            let s = sqrt(0.5 - 0.5 * half_difference / radius);
            if self.xy < 0.0 {
                vec2(-0.5 * self.xy / (radius * s), -s)
            } else {
                vec2(0.5 * self.xy / (radius * s), s)
            }
        };
        (l1, l2, axis)
    }

    /// The same eigenvectors with both eigenvalues clamped to `[lo, hi]`, `lo` ≥ 0. A matrix within the range
    /// comes back as it is, one that rounding made indefinite does not.
    pub fn clamp_eigen(self, lo: f32, hi: f32) -> Self {
        let (l1, l2, axis) = self.eigen();
        // Strictly above: the smaller eigenvalue is already clamped at zero.
        if l1 <= hi && l2 > lo { self } else { Self::from_eigen(l1.clamp(lo, hi), l2.clamp(lo, hi), axis) }
    }

    /// The positive semi-definite square root of a positive semi-definite matrix:
    /// `(A + sqrt(det) I) / sqrt(trace + 2 sqrt(det))`, by Cayley–Hamilton.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        let root_det = sqrt(self.det().max(0.0));
        let scale = sqrt(self.trace() + 2.0 * root_det);
        let inv = if scale == 0.0 { 0.0 } else { scale.recip() };
        (self + Sym2::scalar(root_det)) * inv
    }
}

impl Add for Sym2 {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Sym2 { xx: self.xx + o.xx, xy: self.xy + o.xy, yy: self.yy + o.yy }
    }
}

impl Mul<f32> for Sym2 {
    type Output = Self;
    fn mul(self, s: f32) -> Self {
        Sym2 { xx: self.xx * s, xy: self.xy * s, yy: self.yy * s }
    }
}

/// A symmetric 3×3 matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sym3 {
    /// Row x, column x.
    pub xx: f32,
    /// Row x, column y, and its mirror image.
    pub xy: f32,
    /// Row x, column z, and its mirror image.
    pub xz: f32,
    /// Row y, column y.
    pub yy: f32,
    /// Row y, column z, and its mirror image.
    pub yz: f32,
    /// Row z, column z.
    pub zz: f32,
}

impl Sym3 {
    /// The matrix `s * I`.
    pub fn scalar(s: f32) -> Self {
        Sym3 { xx: s, yy: s, zz: s, ..Sym3::default() }
    }

    /// `v v^T`.
    pub fn outer(v: Vec3) -> Self {
        Sym3 { xx: v.x * v.x, xy: v.x * v.y, xz: v.x * v.z, yy: v.y * v.y, yz: v.y * v.z, zz: v.z * v.z }
    }

    /// `A v`.
    pub fn mul_vec3(self, v: Vec3) -> Vec3 {
        vec3(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }

    /// `v^T A v`.
    pub fn quadratic(self, v: Vec3) -> f32 {
        v.dot(self.mul_vec3(v))
    }

    /// `M^T A M`: the matrix seen from the frame whose axes are the columns of `m`.
    pub fn in_frame(self, m: Mat3) -> Self {
        let (ax, ay, az) = (self.mul_vec3(m.x_axis), self.mul_vec3(m.y_axis), self.mul_vec3(m.z_axis));
        Sym3 {
            xx: m.x_axis.dot(ax),
            xy: m.x_axis.dot(ay),
            xz: m.x_axis.dot(az),
            yy: m.y_axis.dot(ay),
            yz: m.y_axis.dot(az),
            zz: m.z_axis.dot(az),
        }
    }

    /// The adjugate: `A adj(A) = det(A) I`.
    pub fn adjugate(self) -> Self {
        Sym3 {
            xx: self.yy * self.zz - self.yz * self.yz,
            xy: self.xz * self.yz - self.xy * self.zz,
            xz: self.xy * self.yz - self.xz * self.yy,
            yy: self.xx * self.zz - self.xz * self.xz,
            yz: self.xy * self.xz - self.xx * self.yz,
            zz: self.xx * self.yy - self.xy * self.xy,
        }
    }

    /// Determinant.
    pub fn det(self) -> f32 {
        let a = self.adjugate();
        self.xx * a.xx + self.xy * a.xy + self.xz * a.xz
    }

    /// Trace.
    pub fn trace(self) -> f32 {
        self.xx + self.yy + self.zz
    }
}

impl Add for Sym3 {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Sym3 {
            xx: self.xx + o.xx,
            xy: self.xy + o.xy,
            xz: self.xz + o.xz,
            yy: self.yy + o.yy,
            yz: self.yz + o.yz,
            zz: self.zz + o.zz,
        }
    }
}

impl Mul<f32> for Sym3 {
    type Output = Self;
    fn mul(self, s: f32) -> Self {
        Sym3 {
            xx: self.xx * s,
            xy: self.xy * s,
            xz: self.xz * s,
            yy: self.yy * s,
            yz: self.yz * s,
            zz: self.zz * s,
        }
    }
}
