//! Every formula of Kinran as a plain function: no I/O, no allocation, `no_std`.
//!
//! Conventions. Vectors are unit length and point away from the surface: `n` normal, `u` light, `v` view,
//! `h` half vector; a shading frame has z along the normal. `alpha` is GGX roughness, the square of
//! perceptual roughness. `S` and `A` are squared roughness: SGGX eigenvalues are `alpha²`. Beckmann's
//! `sigma` is `alpha / sqrt(2)`.
//!
//! Transcendental functions come from the `libm` crate, so that results do not depend on the system's.
//!
//! Brushed metal is rough across the brush and smooth along it, so that its highlight is long:
//!
//! ```
//! use glam::vec3;
//! use kinran_shading::{alpha_from_roughness, ggx_aniso_d, schlick_f, smith_aniso_v};
//!
//! let (alpha_t, alpha_b) = (alpha_from_roughness(0.7), alpha_from_roughness(0.3));
//! let (u, v, h) = (vec3(0.6, 0.0, 0.8), vec3(0.0, 0.0, 1.0), vec3(0.316_228, 0.0, 0.948_683));
//! let lobe = ggx_aniso_d(h, alpha_t, alpha_b) * smith_aniso_v(u, v, alpha_t, alpha_b);
//! let reflected = lobe * schlick_f(vec3(0.9, 0.8, 0.6), v.dot(h)) * u.z;
//!
//! let aside = vec3(h.y, h.x, h.z);
//! assert!(ggx_aniso_d(h, alpha_t, alpha_b) > 10.0 * ggx_aniso_d(aside, alpha_t, alpha_b));
//! assert!(reflected.cmpgt(glam::Vec3::ZERO).all());
//! ```
#![cfg_attr(not(any(feature = "std", test)), no_std)]

mod aniso;
mod beckmann;
pub mod detail;
mod frame;
pub mod fuzz;
mod ggx;
mod multiscatter;
mod sggx;
pub mod sh;
pub mod skin;
mod sqrt;
mod sym;

pub use aniso::{
    ALPHA_MIN, AnisoDecoded, alpha_from_gloss, alpha_from_roughness, alphas_from_khr_anisotropy,
    aniso_decode, aniso_decode_matrix, aniso_encode, aniso_from_alphas, axis_from_direction,
    direction_from_axis, khr_anisotropy_from_alphas,
};
pub use beckmann::{
    LeanMoments, alpha_from_sigma, beckmann_aniso_d, normal_from_slope, sigma_from_alpha, slope_from_normal,
};
pub use frame::{m_n, normal_from_xy};
pub use ggx::{
    DIELECTRIC_F0, ggx_aniso_d, ggx_d, ggx_matrix_d, ggx_vndf_pdf, ggx_vndf_sample, schlick_f,
    smith_aniso_g1, smith_aniso_v, smith_matrix_v, smith_v,
};
pub use multiscatter::{ggx_albedo_alpha, ggx_directional_albedo, multiscatter_compensation};
pub use sggx::{
    UNIT_SLOPES, ggx_from_sggx, ggx_from_sggx_unclamped, microfacet_basis, sggx_d, sggx_from_ggx,
    sggx_from_slopes, sggx_power_iteration, sggx_principal_axis, sggx_projected_area, slopes_from_sggx,
};
pub use sym::{Sym2, Sym3};
