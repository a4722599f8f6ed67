//! SGGX matrices: a normal and its anisotropic roughness as one thing that can be averaged.
//!
//! - Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.
//! - Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

use crate::{Sym2, Sym3, m_n, sqrt::sqrt};
use core::f32::consts::PI;
use glam::{Vec2, Vec3, vec2};

/// `S = M_n [A 0; 0 1] M_n^T` (slide: Our Algorithm, step 1): the SGGX matrix of a GGX surface with unit
/// normal `n` and squared roughness matrix `a` in the frame of [`m_n`].
#[inline(always)]
pub fn sggx_from_ggx(n: Vec3, a: Sym2) -> Sym3 {
    let m = m_n(n);
    let (x, y) = (m.x_axis, m.y_axis);
    let ax = x * a.xx + y * a.xy;
    let ay = x * a.xy + y * a.yy;
    Sym3 {
        xx: x.x * ax.x + y.x * ay.x + n.x * n.x,
        xy: x.x * ax.y + y.x * ay.y + n.x * n.y,
        xz: x.x * ax.z + y.x * ay.z + n.x * n.z,
        yy: x.y * ax.y + y.y * ay.y + n.y * n.y,
        yz: x.y * ax.z + y.y * ay.z + n.y * n.z,
        zz: x.z * ax.z + y.z * ay.z + n.z * n.z,
    }
}

/// Area of the microflakes projected along the unit vector `w`: `sqrt(w^T S w)` (Heitz 2015).
pub fn sggx_projected_area(s: Sym3, w: Vec3) -> f32 {
    sqrt(s.quadratic(w).max(0.0))
}

/// Distribution of microflake normals at the unit vector `h`, a density per steradian over the sphere:
/// `1 / (π sqrt|S| (h^T S^-1 h)^2)` (Heitz 2015), written as `|S|^(3/2) / (π (h^T adj(S) h)^2)`. Its integral
/// against `max(w·h, 0)` is [`sggx_projected_area`]. `s` must have a positive determinant. Single precision
/// leaves a relative error of 1e-5 over the smallest eigenvalue: 2 % at alpha = 0.02.
pub fn sggx_d(s: Sym3, h: Vec3) -> f32 {
    let det = s.det();
    let q = s.adjugate().quadratic(h);
    det * sqrt(det) / (PI * q * q)
}

/// The slope distribution an SGGX matrix with zz > 0 stands for, seen from the z axis: centre `m` and
/// squared roughness `A`, both dimensionless slopes, such that `S / S_zz = [A + m m^T, m; m^T, 1]`.
///
/// The slopes follow a bivariate Student-t with two degrees of freedom, density `1 / (π sqrt|A| (1+q)^2)`,
/// `q = (s-m)^T A^-1 (s-m)`. A slope is `h.xy / h.z`: positive x leans towards +x.
#[inline(always)]
pub fn slopes_from_sggx(s: Sym3) -> (Vec2, Sym2) {
    let inv = s.zz.recip();
    let m = vec2(s.xz * inv, s.yz * inv);
    (m, Sym2 { xx: s.xx * inv - m.x * m.x, xy: s.xy * inv - m.x * m.y, yy: s.yy * inv - m.y * m.y })
}

/// The SGGX matrix with zz = 1 of a slope distribution; the inverse of [`slopes_from_sggx`].
#[inline(always)]
pub fn sggx_from_slopes(m: Vec2, a: Sym2) -> Sym3 {
    Sym3 { xx: a.xx + m.x * m.x, xy: a.xy + m.x * m.y, xz: m.x, yy: a.yy + m.y * m.y, yz: m.y, zz: 1.0 }
}

/// The talk's power iteration (slide: Our Algorithm, step 3): `steps` times `n = S n / |S n|` from `start`.
///
/// The tangent of the error shrinks by `λ2/λ1` a step, which is about alpha² plus the normals' variance: from
/// 20° to 0.1° it takes 4 steps at a ratio of 1/4, 8 at 1/2 and 51 at 0.9; 8 steps from z leave 9° on a
/// single texel of alpha 0.95 tilted by 20°. In V grooves steeper than 45° it leaves the surface for its
/// walls. [`sggx_principal_axis`] has neither fault; this one is here to compare with.
pub fn sggx_power_iteration(s: Sym3, start: Vec3, steps: u32) -> Vec3 {
    let scale = s.trace().max(f32::MIN_POSITIVE).recip();
    (0..steps).fold(start, |n, _| (s.mul_vec3(n) * scale).normalize_or(n))
}

/// The unit eigenvector of `s` with the largest overlap with the unit vector `start`, signed to agree with
/// it. Started at the mean normal of a footprint it finds the filtered normal, also where the largest
/// eigenvalue is another one (V grooves steeper than 45°).
///
/// Where eigenvalues coincide, to 0.1 % of their spread, it is the projection of `start` on their space;
/// `start` itself if `s` is a multiple of the identity. The residual `|S n - (n^T S n) n|` is 3e-7 of the
/// trace on footprints of textures and 5e-4 at worst, on the verge of such a coincidence. Free of branches
/// and trigonometry, so that loops over many matrices vectorise.
#[inline(always)]
pub fn sggx_principal_axis(s: Sym3, start: Vec3) -> Vec3 {
    const SQRT_3: f32 = 1.732_050_8;
    /// Sine of φ under which two eigenvalues are one: rounding of `r` alone makes 3e-4.
    const COINCIDENT: f32 = 1e-3;

    // The deviator B of unit size and det B >= 0: its eigenvalues are 2 cos(φ), 2 cos(φ ± 2π/3) with
    // 3φ = acos(r), the first at least sqrt(3) away from the others.
    let s = s * s.trace().recip();
    let b = Sym3 { xx: s.xx - 1.0 / 3.0, yy: s.yy - 1.0 / 3.0, zz: s.zz - 1.0 / 3.0, ..s };
    let diagonal = b.xx * b.xx + b.yy * b.yy + b.zz * b.zz;
    let size = sqrt((diagonal + 2.0 * (b.xy * b.xy + b.xz * b.xz + b.yz * b.yz)) * (1.0 / 6.0));
    let b = b * size.recip();
    let r = 0.5 * b.det();
    let b = b * 1.0_f32.copysign(r);

    // sin(2/3 asin(t)) with t = sin(3φ/2) <= sqrt(1/2) by four terms of its series, within 0.1 %: the
    // refinement below cubes the error.
    let t2 = (0.5 - 0.5 * r.abs()).max(0.0);
    let series = 1.0 + t2 * (5.0 / 54.0 + t2 * (77.0 / 1944.0 + t2 * (2431.0 / 104_976.0)));
    let sin = sqrt(t2) * (2.0 / 3.0) * series;
    let cos = sqrt(1.0 - sin * sin);
    let (l0, l1, l2) = (2.0 * cos, SQRT_3 * sin - cos, -SQRT_3 * sin - cos);

    // Squared overlaps with the three eigenvectors, from the moments of B in `start`.
    let bn = b.mul_vec3(start);
    let (m1, m2) = (start.dot(bn), bn.length_squared());
    let overlap = |l: f32| (m2 + l * m1 + l * l - 3.0) / (3.0 * l * l - 3.0);
    let w0 = overlap(l0).clamp(0.0, 1.0);
    let coincident = sin < COINCIDENT;
    let w1 = if coincident { 1.0 - w0 } else { overlap(l1).max(0.0).min(1.0 - w0) };
    let w2 = 1.0 - w0 - w1;

    // Project the two others away, (B - l I)(B - l' I), by Cayley–Hamilton.
    let first = w0 >= w1.max(w2);
    let p = bn - start * if first { l1 } else { l0 };
    let other = if first || w1 >= w2 { l2 } else { l1 };
    let q = b.mul_vec3(p) - p * other;
    let v = if coincident && !first { p } else { q };
    let n = v * sqrt(v.length_squared()).recip();

    // One step of Rayleigh quotient iteration, adj(B - (n^T B n) I) n.
    let mu = b.quadratic(n);
    let shifted = Sym3 { xx: b.xx - mu, yy: b.yy - mu, zz: b.zz - mu, ..b };
    let v = shifted.adjugate().mul_vec3(n);
    let length = sqrt(v.length_squared());
    // The length is the product of the distances to both other eigenvalues, 6 sqrt(3) sin for a close one.
    let n = if length > 6.0 * SQRT_3 * COINCIDENT { v * length.recip() } else { n };

    // Rounding of S, 1e-7 of its trace, is all there is of a smaller deviator. Nor does S = 0 pass.
    let n = if size > 3e-6 { n } else { start };
    if n.dot(start) < 0.0 { -n } else { n }
}

/// Normal and squared roughness matrix of a filtered SGGX matrix (slide: Our Algorithm, step 3).
///
/// `mean_normal`, a unit vector, picks the eigenvector as in [`sggx_principal_axis`]. `S z`, normalised, is a
/// substitute at no cost; a single texel keeps its normal from there while the tangent of its tilt is below
/// `1/alpha²` (48° at alpha 0.95, 76° at 0.5). An eigenvector has no sign: the one returned has z ≥ 0, as a
/// normal map has. The scale `S_33` drops out. Eigenvalues of the result lie in [0, 1]: a microsurface
/// rougher than alpha = 1 (steep V grooves) is clamped, because no texture can hold it. Rounding of S leaves
/// an error of 8e-7 in alpha²: 0.01 % of alpha at 0.1, 3 % at 0.004.
pub fn ggx_from_sggx(s: Sym3, mean_normal: Vec3) -> (Vec3, Sym2) {
    let (n, a) = ggx_from_sggx_unclamped(s, mean_normal);
    (n, a.clamp_eigen(0.0, 1.0))
}

/// [`ggx_from_sggx`] before the clamp, free of branches for loops over many matrices.
#[inline(always)]
pub fn ggx_from_sggx_unclamped(s: Sym3, mean_normal: Vec3) -> (Vec3, Sym2) {
    let n = sggx_principal_axis(s, mean_normal);
    let n = if n.z < 0.0 { -n } else { n };
    let m = m_n(n);
    let (sx, sy) = (s.mul_vec3(m.x_axis), s.mul_vec3(m.y_axis));
    let inv = s.quadratic(n).max(f32::MIN_POSITIVE).recip();
    (n, Sym2 { xx: m.x_axis.dot(sx) * inv, xy: m.x_axis.dot(sy) * inv, yy: m.y_axis.dot(sy) * inv })
}

/// Quadrature of a unit GGX slope distribution (alpha = 1): 16 equally weighted points, four radii
/// `sqrt(u/(1-u))`, `u = (k + 1/2)/4`, on four directions each. `A^(1/2)` maps them to any other.
///
/// The directions of neighbouring radii are turned by 45°, so that the set has eight directions.
pub const UNIT_SLOPES: [Vec2; 16] = {
    const R0: f32 = 0.377_964_5; // sqrt(1/7)
    const R1: f32 = 0.774_596_7; // sqrt(3/5)
    const R2: f32 = 1.290_994_4; // sqrt(5/3)
    const R3: f32 = 2.645_751_3; // sqrt(7)
    const C: f32 = core::f32::consts::FRAC_1_SQRT_2;
    [
        vec2(R0, 0.0),
        vec2(0.0, R0),
        vec2(-R0, 0.0),
        vec2(0.0, -R0),
        vec2(C * R1, C * R1),
        vec2(-C * R1, C * R1),
        vec2(-C * R1, -C * R1),
        vec2(C * R1, -C * R1),
        vec2(R2, 0.0),
        vec2(0.0, R2),
        vec2(-R2, 0.0),
        vec2(0.0, -R2),
        vec2(C * R3, C * R3),
        vec2(-C * R3, C * R3),
        vec2(-C * R3, -C * R3),
        vec2(C * R3, -C * R3),
    ]
};

/// The three columns `[M_n A^(1/2) x, M_n A^(1/2) y, n]` that map a unit slope `(p, q)` to the microfacet
/// normal `p X + q Y + n` (not of unit length) of a GGX surface.
#[inline(always)]
pub fn microfacet_basis(n: Vec3, a: Sym2) -> [Vec3; 3] {
    let root = a.sqrt();
    let m = m_n(n);
    [m.x_axis * root.xx + m.y_axis * root.xy, m.x_axis * root.xy + m.y_axis * root.yy, n]
}
