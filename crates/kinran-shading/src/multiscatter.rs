//! Energy that microfacet models lose between the facets, given back.
//!
//! - Turquin. Practical multiple scattering compensation for microfacet models. 2019.

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

/// Factor on the single-scattering lobe that restores the energy of all further bounces, `1 + f0 (1/E - 1)`
/// (Turquin 2019, eq. 16). White isotropic facets then pass the furnace within 3.5 %; the factor depends on
/// the view alone, so the compensated lobe is not reciprocal.
///
/// An anisotropic lobe uses the isotropic albedo at `alpha = sqrt((alpha_t² + alpha_b²)/2)`, the best of
/// six means tried: RMS error of E 0.027 over random pairs in [0.05, 1] and all views, worst 0.24 (a flat
/// view along the smaller roughness of an extreme pair).
pub fn multiscatter_compensation(f0: Vec3, n_v: f32, alpha_t: f32, alpha_b: f32) -> Vec3 {
    let alpha = crate::sqrt::sqrt(0.5 * (alpha_t * alpha_t + alpha_b * alpha_b));
    let e = ggx_directional_albedo(n_v.clamp(0.0, 1.0), alpha);
    Vec3::ONE + f0 * (e.recip() - 1.0)
}
