//! Energy that microfacet models lose between the facets, given back.
//!
//! - Turquin. Practical multiple scattering compensation for microfacet models. 2019.

use crate::sqrt::sqrt;
use glam::Vec3;

/// Directional albedo of the single-scattering GGX lobe with height-correlated Smith masking and F = 1, for
/// a view at cosine `n_v` (0 to 1): the share of a white furnace that comes back, 0.307 (= 1 − ln 2) to 1.
///
/// A rational fit of ours, within 0.011 of quadrature (0.004 RMS) for alpha in [0.005, 1], n_v in
/// [0.005, 1]. The lost part is written as alpha times a ratio of two polynomials of degree two in each
/// variable, fitted by least squares on the fourth power of the error.
pub fn ggx_directional_albedo(n_v: f32, alpha: f32) -> f32 {
    let (m, a) = (n_v, alpha);
    let (m2, a2) = (m * m, a * a);
    let p = (0.000_239_17 + 0.004_272 * a + 0.014_007 * a2)
        + (0.130_20 - 0.075_028 * a + 3.216_9 * a2) * m
        + (-0.034_490 - 0.188_97 * a + 0.089_879 * a2) * m2;
    let q = (-0.000_019_263 + 0.005_459_8 * a + 1.028_8 * a2)
        + (0.001_931_7 - 1.133_1 * a + 5.312_3 * a2) * m
        + (1.0 - 1.351_6 * a - 0.380_30 * a2) * m2;
    (1.0 - a * p / q).clamp(0.3, 1.0)
}

/// Roughness of the isotropic lobe whose albedo stands for that of an anisotropic one, for the unit view `v` in the frame
/// of the alphas: squared, the mean of `alpha_t²` and `alpha_b²` from above; the flatter the view, the more that across it
/// counts, towards which facets send most light: `(alpha_t² + alpha_b² + 0.8 (alpha_t² - alpha_b²) (v.y⁴ - v.x⁴)) / 2`.
///
/// The squared roughness along the view has the weight `(1 - 0.8 sin⁴θ) / 2`. RMS error of E 0.019 over random pairs in
/// [0.05, 1] and all views, where the mean alone has 0.030; the factor is that of the least. The worst is 0.32, at a flat
/// view across the pair (1, 0.05).
pub fn ggx_albedo_alpha(v: Vec3, alpha_t: f32, alpha_b: f32) -> f32 {
    let (t, b) = (alpha_t * alpha_t, alpha_b * alpha_b);
    let (x, y) = (v.x * v.x, v.y * v.y);
    sqrt(0.5 * (t + b) + 0.4 * (t - b) * (y * y - x * x))
}

/// Factor on the single-scattering lobe that restores the energy of all further bounces, `1 + f0 (1/E - 1)`
/// (Turquin 2019, eq. 16), for the unit view `v` in the frame of the alphas, z along the normal. White isotropic facets
/// then pass the furnace within 3.5 %; the factor depends on the view alone, so the compensated lobe is not reciprocal.
/// An anisotropic lobe uses the isotropic albedo at [`ggx_albedo_alpha`].
pub fn multiscatter_compensation(f0: Vec3, v: Vec3, alpha_t: f32, alpha_b: f32) -> Vec3 {
    let e = ggx_directional_albedo(v.z.clamp(0.0, 1.0), ggx_albedo_alpha(v, alpha_t, alpha_b));
    Vec3::ONE + f0 * (e.recip() - 1.0)
}
