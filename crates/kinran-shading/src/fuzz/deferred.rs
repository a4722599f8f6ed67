//! Fuzz by seven bits of a G-buffer: fixed fibres over Lambert, for moss and felt (slide: Deferred).

use crate::{fuzz::layer::fuzz_passage, sqrt::sqrt};
use core::f32::consts::{LOG2_E, PI};
use glam::Vec3;

/// Density of the layer.
pub const FUZZ_DEFERRED_DENSITY: f32 = 0.5;

/// Roughness of the fibres: a spread of 0.9. They stand along the normal.
pub const FUZZ_DEFERRED_ALPHA: f32 = 0.948_683_3;

/// Albedo of the fibres over that of the Lambert base. Single scattering of this layer returns 0.162 of
/// uniform light, 1/6.2: five times that is about the base's own brightness.
pub const FUZZ_DEFERRED_ALBEDO: f32 = 5.0;

/// How far light wraps around the terminator, as a cosine.
pub const FUZZ_WRAP: f32 = 0.2;

/// `(1+n)/(2 (1+w)^(1+n))` for n = 2: with it the wrapped cosine integrates to π over the sphere.
pub const FUZZ_WRAP_SCALE: f32 = 3.0 / (2.0 * (1.0 + FUZZ_WRAP) * (1.0 + FUZZ_WRAP) * (1.0 + FUZZ_WRAP));

/// The cosine of light and normal, softened by wrapping (McAuley 2013; slide: Deferred), n = 2:
/// `(1+n)/(2(1+w)) (max(n_u + w, 0)/(1+w))^n`. Its integral over the sphere is π, that of the clamped cosine.
/// Where no light arrives it is 1e-8 rather than zero, so that the layer may divide by it.
pub fn fuzz_wrap(n_u: f32) -> f32 {
    let c = (n_u + FUZZ_WRAP).max(1e-4);
    FUZZ_WRAP_SCALE * c * c
}

/// P_e of the deferred layer, once a pixel.
pub fn fuzz_deferred_escape(n_v: f32) -> f32 {
    fuzz_passage(FUZZ_DEFERRED_DENSITY, n_v)
}

/// BRDF times cosine of the deferred layer for a fibre albedo of one, from the cosines of light and view with
/// the normal and with each other and [`fuzz_deferred_escape`]. Lights down to `n_u = -FUZZ_WRAP` reach it.
/// The picture is `lerp(Lambert, this, fuzziness)`; the base is not shadowed.
///
/// [`fibre_phase`](super::fibre_phase) and [`fuzz_layer`](super::fuzz_layer) times cosine with [`fuzz_wrap`] for the
/// light's cosine, every constant factor drawn into another.
pub fn fuzz_deferred(n_u: f32, n_v: f32, u_v: f32, escaped: f32) -> f32 {
    const ALPHA_SQR: f32 = FUZZ_DEFERRED_ALPHA * FUZZ_DEFERRED_ALPHA;
    const K: f32 = 1.0 - ALPHA_SQR;
    const ROOT: f32 = 16.0 * PI * PI * ALPHA_SQR;
    // The wrapped cosine over its scale.
    let c = (n_u + FUZZ_WRAP).max(1e-4);
    let wrapped = c * c;
    // `fuzz_passage`; the cosine is never zero.
    let passed = libm::exp2f(-LOG2_E * (FUZZ_DEFERRED_DENSITY / FUZZ_WRAP_SCALE) / wrapped) * escaped;

    // The phase is `(w/m)² / (4π α sqrt(1 - k n_u²))` with half of |u + v|² for w, kept above zero where v = -u.
    let w = 1.000_001 + u_v;
    let s = n_u + n_v;
    let m = s * s * (0.5 * K / ALPHA_SQR) + w;
    let area = sqrt(ROOT - n_u * n_u * (ROOT * K));
    w * w * wrapped * (1.0 - passed) / (m * m * (wrapped + n_v * (1.0 / FUZZ_WRAP_SCALE)) * area)
}

/// Albedo of the fibres over a Lambert base of albedo `base`: `5 base`, as the talk has it, but no more than the
/// layer can have without returning more than arrives. The talk's alone exceeds one at grazing where `base` is above
/// 0.35.
///
/// The layer's share of a white furnace is `0.58 / (1 + 4.365 n_v)` or up to 8 % less, the lights below the
/// horizon included; the bound is its inverse, one multiply-add and three minima a pixel and nothing a light.
pub fn fuzz_deferred_color(base: Vec3, n_v: f32) -> Vec3 {
    (base * FUZZ_DEFERRED_ALBEDO).min(Vec3::splat(1.7241 + 7.5257 * n_v))
}

/// Eight bits of a G-buffer, a whole number from 0 to 255, from a fuzziness in [0, 1], rounded to 1/127, below a `flag` in
/// the top bit (0 or 1: translucency, in the talk). A channel of the format unorm8 wants it over 255.
pub fn fuzziness_code(fuzziness: f32, flag: f32) -> f32 {
    128.0 * flag + libm::floorf(fuzziness.clamp(0.0, 1.0) * 127.0 + 0.5)
}

/// Fuzziness of eight bits, the flag left out. What a channel of the format unorm8 gives, times 255, need not be whole.
pub fn fuzziness_from_code(code: f32) -> f32 {
    let flag = if code > 127.5 { 128.0 } else { 0.0 };
    (code - flag) * (1.0 / 127.0)
}
