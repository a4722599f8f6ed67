//! The layer in light from all around, given as order-2 spherical harmonics.
//!
//! Exact is `L_o(v) = c_f ∫ p(u, v) g(u, v) L(u) du` with `g = f (u·n) / (c_f p)`. The talk pulls it apart into
//! three factors: G, the mean of g; the mean of L; and `∫ p(u, v) du`, which it takes for `1 - P_s(v)`. That
//! last step holds for symmetric phase functions only. Here one polynomial of the view stands for the last
//! factor and for what the product of means misses, and the light is that along the lobe's own mean
//! direction instead of the mean over the hemisphere.

use crate::{
    fuzz::layer::{FUZZ_COSINE_MIN, fuzz_passage},
    sh::Sh9,
    sqrt::sqrt,
};
use core::f32::consts::LOG2_E;
use glam::{Vec2, Vec3, vec2};

/// Mean of g over the hemisphere, `(1/2π) ∫ g du` (slide: Ambient Lighting, `G~`), for a view at cosine `n_v`:
/// `F (1 - e^-y) (1 - y e^-y / 10)` with `F = 1 - n_v ln(1 + 1/n_v)` and `y = d / (n_v F)`.
///
/// Ours: F is the limit for a dense layer and `d / n_v` that for a thin one, both exact. Within -3.6 % and
/// +4.8 % of the closed form for every density in [0.002, 3] and every n_v ≥ 0.002; the talk's form has
/// 17 % within d in [0.05, 0.5], n_v ≥ 0.1 and cannot follow `n_v ln n_v` at grazing. Finite for all n_v in [0, 1].
pub fn fuzz_g(density: f32, n_v: f32) -> f32 {
    let n_v = n_v.max(FUZZ_COSINE_MIN);
    let dense = 1.0 - n_v * libm::logf(1.0 + 1.0 / n_v);
    let y = density / (n_v * dense);
    let e = libm::exp2f(-LOG2_E * y);
    dense * (1.0 - e) * (1.0 - 0.1 * y * e)
}

/// The talk's form of [`fuzz_g`], `d (1 + c_0 x + c_1 x²) / (d + c_2 x + c_3 x³)`, by four coefficients; zero where there
/// are no fibres.
pub fn fuzz_g_talk(coefficients: [f32; 4], density: f32, n_v: f32) -> f32 {
    let [c0, c1, c2, c3] = coefficients;
    density * (1.0 + n_v * (c0 + c1 * n_v)) / (density + n_v * (c2 + c3 * n_v * n_v)).max(1e-20)
}

/// Share of uniform irradiance that reaches the base unscattered, `(1/π) ∫ P_p (u·n) du = 2 E_3(d)` (slide:
/// Ambient Shadowing, `Q~`). A fit of ours within 0.00043 for densities in [0, 3].
pub fn fuzz_q(density: f32) -> f32 {
    let d = density;
    fuzz_passage(d, 1.0) * (1.0 + d * (3.073_23 + 0.102_541 * d)) / (1.0 + d * (4.020_06 + 1.982_75 * d))
}

/// The talk's form of [`fuzz_q`], `1 + c_0 d + c_1 d²`, by two coefficients; turns up outside the range of
/// its fit.
pub fn fuzz_q_talk(coefficients: [f32; 2], density: f32) -> f32 {
    let [c0, c1] = coefficients;
    1.0 + density * (c0 + c1 * density)
}

/// `∫ p g du / G` as a polynomial of the view, fitted for one tilt and one spread over densities of 0.05 to
/// 0.5: the talk's six terms and the third and fourth power of `t_v`, whose lobe is narrow across the fibres.
pub fn fuzz_ambient_factor(coefficients: [f32; 8], n_v: f32, t_v: f32) -> f32 {
    let [c0, c1, c2, c3, c4, c5, c6, c7] = coefficients;
    let along = t_v * (c2 + t_v * (c5 + t_v * (c6 + t_v * c7)));
    (c0 + n_v * (c1 + c3 * n_v + c4 * t_v) + along).max(0.0)
}

/// Nodes of the ambient table along each of its sides, the first and the last at the ends of their ranges.
pub const FUZZ_TABLE_SIZE: u32 = 48;

/// Fibres of a smaller alpha are combed: six coefficients miss P_s by more than 0.09 and eight the ambient light by more
/// than 14 %. [`fibre_p_s`](super::fibre_p_s) and the table take their places.
pub const FUZZ_COMBED_ALPHA: f32 = 0.3;

/// Texture coordinates in the table that replaces [`fuzz_ambient_factor`] for combed fibres, of [`FUZZ_TABLE_SIZE`]
/// texels a side: x runs with `n_v` from 0 to 1, y with the cosine of the azimuth between view and fibre. `t_n` is
/// `t·n`.
pub fn fuzz_ambient_place(n_v: f32, t_v: f32, t_n: f32) -> Vec2 {
    const TEXEL: f32 = 1.0 / FUZZ_TABLE_SIZE as f32;
    let sines = sqrt(((1.0 - n_v * n_v) * (1.0 - t_n * t_n)).max(1e-12));
    let azimuth = (0.5 + 0.5 * (t_v - n_v * t_n) / sines).clamp(0.0, 1.0);
    vec2(n_v, azimuth) * (1.0 - TEXEL) + 0.5 * TEXEL
}

/// The factor from what the table holds at [`fuzz_ambient_place`], interpolated bilinearly: x for a thin
/// layer, y what a dense one adds to it.
pub fn fuzz_ambient_tabulated(texel: Vec2, density: f32, n_v: f32) -> f32 {
    texel.x + texel.y * density / (density + n_v).max(1e-20)
}

/// Mean direction of the light that the lobe gathers, `∫ p g u du / ∫ p g du`, shorter than one; by four
/// coefficients of the same fit: `c_0 n + c_1 v + (c_2 + c_3 t_v) t`.
pub fn fuzz_ambient_direction(coefficients: [f32; 4], n: Vec3, v: Vec3, t: Vec3) -> Vec3 {
    let [c0, c1, c2, c3] = coefficients;
    n * c0 + v * c1 + t * (c2 + c3 * t.dot(v))
}

/// Mean radiance in the lobe, from the coefficients of `radiance` up to order 1 and
/// [`fuzz_ambient_direction`]; exact for light that varies linearly with direction. Never negative.
pub fn fuzz_ambient_radiance(radiance: &Sh9, direction: Vec3) -> Vec3 {
    let linear = radiance[3] * direction.x + radiance[1] * direction.y + radiance[2] * direction.z;
    (radiance[0] * 0.282_094_8 + linear * 0.488_602_52).max(Vec3::ZERO)
}

/// Mean radiance over the hemisphere about the unit vector `n`, `(1/2π) ∫ L du`: the talk's light. Order 2 has
/// none of it. Never negative.
pub fn fuzz_ambient_mean(radiance: &Sh9, n: Vec3) -> Vec3 {
    fuzz_ambient_radiance(radiance, n * 0.5)
}

/// Factor on the base's ambient light, diffuse or from a specular probe (slide: Ambient Shadowing,
/// `c_atten`): `P_e (Q + c_f R (1 - Q))`. `downward` is R, the mean of P_s over uniform irradiance, which depends on
/// tilt and spread; 1/2 for fibres in all directions. The slide's R lacks a 1/π.
pub fn fuzz_ambient_attenuation(escaped: f32, q: f32, downward: f32, fibre_color: Vec3) -> Vec3 {
    (q + fibre_color * (downward * (1.0 - q))) * escaped
}
