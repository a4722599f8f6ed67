//! How a fibre scatters: the SGGX phase function of specular fibres, and Schlick's for velvet.

use crate::sqrt::sqrt;
use core::f32::consts::{PI, SQRT_2};
use glam::{Vec3, vec3};

/// Smallest roughness of fibres to shade with. A spread of zero would be perfect mirrors in a row, whose lobe
/// no sum over samples finds; chosen by eye.
pub const FUZZ_ALPHA_MIN: f32 = 0.1;

/// Roughness of fibres from their spread, 0 (combed) to 1 (in all directions): its root, at least
/// [`FUZZ_ALPHA_MIN`].
///
/// The talk gives spread 0.9 as alpha 0.95 and as a Schlick k of 0.1; that the one is `sqrt(spread)` and the
/// other `1 - spread` is inferred from it. Then `k = 1 - alpha²`, and both phase functions depend on the
/// half vector in nearly the same way.
pub fn fuzz_alpha(spread: f32) -> f32 {
    sqrt(spread.max(FUZZ_ALPHA_MIN * FUZZ_ALPHA_MIN))
}

/// Schlick's k of the velvet phase from the fibres' spread: `1 - spread`, at most 0.99. The talk's k has the
/// other sign (see [`velvet_phase`]).
pub fn velvet_k(spread: f32) -> f32 {
    1.0 - spread.max(FUZZ_ALPHA_MIN * FUZZ_ALPHA_MIN)
}

/// Direction of fibres in a frame with z along the normal: `tilt` away from the normal (0 upright, π/2
/// lying), `azimuth` counter-clockwise from x, both in radians.
pub fn fibre_direction(tilt: f32, azimuth: f32) -> Vec3 {
    let sine = libm::sinf(tilt);
    vec3(sine * libm::cosf(azimuth), sine * libm::sinf(azimuth), libm::cosf(tilt))
}

/// Distribution of the fibres' microflake normals at cosine `t_h` to their direction, per steradian over the
/// sphere (slide: Phase Function, `D_F`): `α³ / (π (t_h² (1 - α²) + α²)²)`. It is the SGGX distribution of
/// `S = I - (1 - α²) t tᵀ`; its integral against `max(w·h, 0)` is [`fibre_projected_area`].
pub fn fibre_d(t_h: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let q = t_h * t_h * (1.0 - a2) + a2;
    a2 * alpha / (PI * q * q)
}

/// Projected area of the fibres' microflakes along a direction at cosine `t_w` to them (slide: Phase
/// Function, `σ_F`): `sqrt(1 - t_w² (1 - α²))`.
pub fn fibre_projected_area(t_w: f32, alpha: f32) -> f32 {
    sqrt(1.0 - t_w * t_w * (1.0 - alpha * alpha))
}

/// The fibres' phase function per steradian (slide: Phase Function, `p_F`): `D_F(h) / (4 σ_F(u))` for light
/// from `u` and a view along `v`, from `u_v = u·v`, `t_u = t·u` and `t_v = t·v`.
///
/// Over all `v` of the sphere it integrates to one. It is not symmetric: `p(u, v) σ(u) = p(v, u) σ(v)`, a
/// ratio of up to 1/α.
pub fn fibre_phase(u_v: f32, t_u: f32, t_v: f32, alpha: f32) -> f32 {
    // |u + v|², kept above zero where v = -u.
    let w = 2.000_002 + 2.0 * u_v;
    let s = t_u + t_v;
    let a2 = alpha * alpha;
    let k = 1.0 - a2;
    let m = s * s * k + a2 * w;
    a2 * alpha * w * w / (4.0 * PI * m * m * sqrt(1.0 - t_u * t_u * k))
}

/// Normalisation r(k) of the velvet phase: `sqrt(1-k) / (1 + (2 sqrt(2) - 1) k)`, for k in [0, 0.99].
///
/// The talk calls its own "approximate and conservative" and does not print it. With this one the phase
/// scatters at most what arrives: the largest integral over the sphere, that of light across the fibres, is
/// 0.882 to 1 over all k.
pub fn velvet_normalization(k: f32) -> f32 {
    sqrt(1.0 - k) / (1.0 + (2.0 * SQRT_2 - 1.0) * k)
}

/// The velvet phase per steradian (slide: Velvet Scattering, `p_V`): `r(k) (1-k²) / (4π (1 - k sin(t, h))²)`,
/// arguments as in [`fibre_phase`], k in [0, 0.99] as [`velvet_k`] gives it.
///
/// Differs from the slide in the sign of k: its k = -0.1 in `(1 - k sin)²` darkens the half vectors across
/// the fibres, which makes upright fibres scatter forward, the opposite of the velvet it describes.
/// Symmetric in u and v. Its integral over the sphere is 1 at most and depends on the light's direction.
pub fn velvet_phase(u_v: f32, t_u: f32, t_v: f32, k: f32) -> f32 {
    let w = 2.000_002 + 2.0 * u_v;
    let s = t_u + t_v;
    let q = 1.0 - k * sqrt((1.0 - s * s / w).max(0.0));
    velvet_normalization(k) * (1.0 - k * k) / (4.0 * PI * q * q)
}
