//! P_s: the share of scattered light that a fibre sends down to the base.

use crate::sqrt::sqrt;

/// P_s of SGGX fibres, exactly (slide: Base Layer, "no analytical expression"): one minus the integral of
/// [`fibre_phase`](super::fibre_phase)`(u, v)` over the `v` above the horizon, for a light at cosines `n_u` ≥ 0
/// to the normal and `t_u` to the fibres, whose own cosine to the normal is `t_n`.
///
/// A fibre of SGGX reflects `u` on visible normals `h = L m`, where `L² = S` and m is cosine-distributed. The
/// reflection is above the horizon where `h·A h > 0` with `A = u nᵀ + n uᵀ - (u·n) I`, which has one
/// positive eigenvalue. So m must lie in the elliptic cone of `L A L`, and the share is that cone's form factor:
/// with the positive eigenvalue λ of `S A`, whose characteristic polynomial is χ,
/// `1 - P_s = λ sqrt((λ + c) (λ + α² c/σ²)) / χ'(λ)`, `c = u·n`, `σ² = 1 - (1-α²) (t·u)²`,
/// `χ = λ³ + (α² c + 2 k t_u t_n) λ² - (α² + k (1 - t_u² - t_n²)) λ - α² c`, `k = 1 - α²`.
///
/// λ is at most 1; Laguerre's iteration from there falls on it. Within 3e-5 of double-precision quadrature
/// for alpha ≥ 0.1.
pub fn fibre_p_s(n_u: f32, t_u: f32, t_n: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let k = 1.0 - a2;
    let b0 = -a2 * n_u;
    let b1 = -(a2 + k * (1.0 - t_u * t_u - t_n * t_n));
    let b2 = a2 * n_u + 2.0 * k * t_u * t_n;

    // Four steps cube the error four times.
    let mut l = 1.0;
    for _ in 0..4 {
        l = fibre_p_s_step(l, b0, b1, b2);
    }
    let slope = (3.0 * l + 2.0 * b2) * l + b1;
    let area_sqr = 1.0 - k * t_u * t_u;
    let upward = l * sqrt(((l + n_u) * (l + a2 * n_u / area_sqr)).max(0.0)) / slope.max(1e-20);
    (1.0 - upward).clamp(0.0, 1.0)
}

/// A step of Laguerre's iteration for the largest root of `l³ + square l² + linear l + constant`, whose roots are all
/// real.
fn fibre_p_s_step(l: f32, constant: f32, linear: f32, square: f32) -> f32 {
    let value = ((l + square) * l + linear) * l + constant;
    let slope = (3.0 * l + 2.0 * square) * l + linear;
    let bend = 6.0 * l + 2.0 * square;
    let root = sqrt((4.0 * slope * slope - 6.0 * value * bend).max(0.0));
    l - 3.0 * value / (slope + root).max(1e-20)
}

/// P_s by the talk's six coefficients (slide: Base Layer), fitted for one tilt and one spread: `c_0 + c_1 n_u +
/// c_2 t_u + c_3 n_u² + c_4 n_u t_u + c_5 t_u²`, clamped to [0, 1]. The fit's error is part of the fit.
pub fn fuzz_p_s(coefficients: [f32; 6], n_u: f32, t_u: f32) -> f32 {
    let [c0, c1, c2, c3, c4, c5] = coefficients;
    (c0 + n_u * (c1 + c3 * n_u + c4 * t_u) + t_u * (c2 + c5 * t_u)).clamp(0.0, 1.0)
}
