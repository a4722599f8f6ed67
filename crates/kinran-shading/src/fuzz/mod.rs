//! Anisotropic fuzz: a thin layer of fibres that scatters light once, over any base.
//!
//! - Koenderink, Pont. The Secret of Velvety Skin. Machine Vision and Applications 2003 (eq. 9: the layer).
//! - Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015 (the fibres).
//! - Schlick. An Inexpensive BRDF Model for Physically-based Rendering. Eurographics 1994 (the velvet phase).
//! - Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020 (all of it together).
//!
//! The BRDF is `c_f p(u, v) (1 - e^(-d (1/u·n + 1/v·n))) / (u·n + v·n)`, with the fibres' albedo `c_f`, the
//! phase function `p` (per steradian) and the layer's density `d`: its thickness over the mean free path.
//! The talk's slide has `u·v` where `u·n` belongs. `t` is the fibres' direction, a unit vector whose sign is
//! of no account to the lobe; fits want it above the horizon. The first argument of `p` is the light.
//!
//! One exponential a light serves both the lobe and what is left for the base:
//! `e^(-d (1/u·n + 1/v·n)) = P_p(u) P_e(v)`.
//!
//! ```
//! use glam::vec3;
//! use kinran_shading::fuzz::{fibre_direction, fuzz_alpha, fuzz_brdf};
//!
//! // Fibres combed along x glow for a light that comes over them at a grazing angle.
//! let (t, alpha) = (fibre_direction(1.2, 0.0), fuzz_alpha(0.3));
//! let view = vec3(0.0, 0.0, 1.0);
//! let over = fuzz_brdf(vec3(0.0, 0.96, 0.28), view, t, 0.3, alpha);
//! let above = fuzz_brdf(vec3(0.0, 0.28, 0.96), view, t, 0.3, alpha);
//! assert!(over > above && above > 0.0);
//! ```

mod ambient;
mod deferred;
mod layer;
mod p_s;
mod phase;
mod sampling;

pub use ambient::{
    FUZZ_COMBED_ALPHA, FUZZ_TABLE_SIZE, fuzz_ambient_attenuation, fuzz_ambient_direction,
    fuzz_ambient_factor, fuzz_ambient_mean, fuzz_ambient_place, fuzz_ambient_radiance,
    fuzz_ambient_tabulated, fuzz_g, fuzz_g_talk, fuzz_q, fuzz_q_talk,
};
pub use deferred::{
    FUZZ_DEFERRED_ALBEDO, FUZZ_DEFERRED_ALPHA, FUZZ_DEFERRED_DENSITY, FUZZ_WRAP, FUZZ_WRAP_SCALE,
    fuzz_deferred, fuzz_deferred_color, fuzz_deferred_escape, fuzz_wrap, fuzziness_code, fuzziness_from_code,
};
pub use layer::{
    FUZZ_COSINE_MIN, FuzzLight, FuzzView, fuzz_attenuation, fuzz_brdf, fuzz_layer, fuzz_light, fuzz_passage,
    fuzz_reciprocal_brdf, fuzz_smooth_normal, fuzz_velvet_brdf, fuzz_view,
};
pub use p_s::{fibre_p_s, fuzz_p_s};
pub use phase::{
    FUZZ_ALPHA_MIN, fibre_d, fibre_direction, fibre_phase, fibre_projected_area, fuzz_alpha, velvet_k,
    velvet_normalization, velvet_phase,
};
pub use sampling::{fuzz_over_base_pdf, fuzz_over_base_sample, fuzz_over_base_shares, fuzz_pdf, fuzz_sample};
