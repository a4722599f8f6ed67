// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/beckmann.wesl, by ./x shaders. Needs: nothing else

// The Beckmann distribution and LEAN mapping, to compare with.
//
// Beckmann, Spizzichino. The Scattering of Electromagnetic Waves from Rough Surfaces. 1963.
// Olano, Baker. LEAN Mapping. I3D 2010.

/// Beckmann's sigma, the standard deviation of slopes, that stands for a GGX alpha (slide: LEAN Mapping):
/// `alpha / sqrt(2)`.
///
/// Cost on GCN: 1 instruction.
fn sigma_from_alpha(alpha: f32) -> f32 {
    return alpha * 0.70710678;
}

/// The inverse of `sigma_from_alpha`.
///
/// Cost on GCN: 1 instruction.
fn alpha_from_sigma(sigma: f32) -> f32 {
    return sigma * 1.41421356;
}

/// Distribution of microfacet normals per steradian with slope deviations `sigma_t`, `sigma_b` along x and y
/// (Beckmann 1963): `exp(-(x²/σt² + y²/σb²) / (2 z²)) / (2π σt σb z⁴)`, zero below the horizon.
///
/// Cost on GCN: 20 instructions (5 at a quarter of the rate).
fn beckmann_aniso_d(h: vec3f, sigma_t: f32, sigma_b: f32) -> f32 {
    // z⁴ underflows long after the exponential has: at z = 1e-6 it is exp(-5e11 / sigma²).
    if h.z <= 1e-6 {
        return 0.0;
    }
    let z_sqr = h.z * h.z;
    let x = h.x / sigma_t;
    let y = h.y / sigma_b;
    return exp(-0.5 * (x * x + y * y) / z_sqr) / (6.2831853 * sigma_t * sigma_b * z_sqr * z_sqr);
}

/// Slope towards which a unit normal with z ≥ 0 leans: `n.xy / n.z`, a million at most.
///
/// Cost on GCN: 4 instructions (1 at a quarter of the rate).
fn slope_from_normal(n: vec3f) -> vec2f {
    return n.xy / max(n.z, 1e-6);
}

/// Unit normal of a slope.
///
/// Cost on GCN: 5 instructions (1 at a quarter of the rate).
fn normal_from_slope(slope: vec2f) -> vec3f {
    return vec3f(slope, 1.0) * inverseSqrt(1.0 + dot(slope, slope));
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_hsv.wesl, by ./x shaders. Needs: nothing else

// Hue, saturation and value.

/// A linear colour in [0, 1]³ with its hue turned by `shift.x` turns, its HSV saturation multiplied by `shift.y` and its
/// value by `shift.z`; `(0, 1, 1)` leaves it as it is. Both are clamped to 1 (Smith. Color gamut transform pairs. 1978).
///
/// Cost on GCN: 42 instructions (2 at a quarter of the rate).
fn hsv_shift(color: vec3f, shift: vec3f) -> vec3f {
    let value = max(color.x, max(color.y, color.z));
    let chroma = value - min(color.x, min(color.y, color.z));
    // A colour without chroma has no saturation, whatever hue this gives it.
    let scale = 1.0 / max(chroma, 1e-20);
    let differences = (color.yzx - color.zxy) * scale;
    let green_or_blue = select(4.0 + differences.z, 2.0 + differences.y, color.y >= value);
    let sector = select(green_or_blue, differences.x, color.x >= value);
    let hue = sector * (1.0 / 6.0) + shift.x;
    let saturation = saturate(chroma / max(value, 1e-20) * shift.y);
    // Each channel as a trapezoid of the hue, in sixths of a turn, red at 0.
    let k = 6.0 * fract(hue + vec3f(0.0, 2.0 / 3.0, 1.0 / 3.0));
    let weight = saturate(abs(k - 3.0) - 1.0);
    return saturate(value * shift.z) * (1.0 + (weight - 1.0) * saturation);
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_normal.wesl, by ./x shaders. Needs: nothing else

// Normals laid over each other.

/// Reoriented normal mapping: the unit normal `detail` in the frame of the unit normal `base`, both with z ≥ 0; equals
/// `m_n(base) * detail` (slide: Detail Maps; Barré-Brisebois and Hill. Blending in Detail. 2012). In detail mapping
/// the synthesized normal is the base.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
fn rnm(base: vec3f, detail: vec3f) -> vec3f {
    let t = base + vec3f(0.0, 0.0, 1.0);
    let u = detail * vec3f(-1.0, -1.0, 1.0);
    return t * (dot(t, u) / t.z) - u;
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_over.wesl, by ./x shaders. Needs: nothing else

// Alpha blending, for aniso texels.

/// The texel `detail` over the texel `s` with opacity `alpha` in [0, 1] (slide: Detail Maps, "aniso maps blended with
/// regular alpha blending"). Every mixture of aniso texels decodes to a positive semi-definite matrix.
///
/// Cost on GCN: 6 instructions.
fn detail_over(s: vec3f, detail: vec3f, alpha: f32) -> vec3f {
    return s + (detail - s) * alpha;
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_overlay.wesl, by ./x shaders. Needs: nothing else

// Overlay and the talk's smooth overlay: a synthesized value `s` lays itself over a detail `d` so that every target can
// be reached (slides: Detail Maps). Both are solved for `s` when textures are baked.
//
// Colour is linear light: sample the tile with sRGB decoding, the synthesized map without.

/// Overlay of a detail `d` by a synthesized value `s`, both in [0, 1] (slide: Detail Maps | Our Approach):
/// `2sd` below s = 1/2, `1 - 2(1-s)(1-d)` from there on.
///
/// Cost on GCN: 7 instructions.
fn overlay(s: f32, d: f32) -> f32 {
    return select(1.0 - 2.0 * (1.0 - s) * (1.0 - d), 2.0 * s * d, s < 0.5);
}

/// `overlay` of each channel.
///
/// Cost on GCN: 21 instructions.
fn overlay_color(s: vec3f, d: vec3f) -> vec3f {
    return vec3f(overlay(s.x, d.x), overlay(s.y, d.y), overlay(s.z, d.z));
}

/// The talk's smooth overlay, finer near `t = d` where a dark detail is brightened (slide: Detail Maps | Blending): as
/// `overlay`, but `lerp(2sd, s, (2s-1)²)` where s ≥ 1/2 and d < 1/2.
///
/// Cost on GCN: 13 instructions.
fn smooth_overlay(s: f32, d: f32) -> f32 {
    let x = 2.0 * s - 1.0;
    let low = 2.0 * s * d;
    let bright = 1.0 - 2.0 * (1.0 - s) * (1.0 - d);
    let dark = low + (s - low) * x * x;
    return select(select(bright, dark, d < 0.5), low, s < 0.5);
}

/// `smooth_overlay` of each channel.
///
/// Cost on GCN: 39 instructions.
fn smooth_overlay_color(s: vec3f, d: vec3f) -> vec3f {
    return vec3f(smooth_overlay(s.x, d.x), smooth_overlay(s.y, d.y), smooth_overlay(s.z, d.z));
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/frame.wesl, by ./x shaders. Needs: nothing else

// The frame in which an anisotropic texel lives.

/// The shortest-arc rotation that takes z = (0, 0, 1) to the unit vector `n` (slide: Our Algorithm, step 1).
///
/// Its first two columns are the tangent and bitangent of every aniso texel; a Gram–Schmidt tangent differs from them
/// by 0.44° at a tilt of 10° and 18° at 60°, so decode with these. Orthonormal to 3e-7 for n.z ≥ 0; where `1 + n.z`
/// is below 1e-6 the half turn about x is returned, whose third column is −z.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
fn m_n(n: vec3f) -> mat3x3f {
    let d = 1.0 + n.z;
    if d < 1e-6 {
        return mat3x3f(vec3f(1.0, 0.0, 0.0), vec3f(0.0, -1.0, 0.0), vec3f(0.0, 0.0, -1.0));
    }
    let a = 1.0 / d;
    let xy = -n.x * n.y * a;
    return mat3x3f(vec3f(n.z + n.y * n.y * a, xy, -n.x), vec3f(xy, n.z + n.x * n.x * a, -n.y), n);
}

/// A unit normal from the xy of a normal map, each in [−1, 1]. Where x² + y² exceeds one, as compression and
/// filtering make it do, the normal lies on the horizon in the same direction.
///
/// Cost on GCN: 8 instructions (2 at a quarter of the rate).
fn normal_from_xy(x: f32, y: f32) -> vec3f {
    let xy_squared = x * x + y * y;
    let scale = inverseSqrt(max(xy_squared, 1.0));
    return vec3f(x * scale, y * scale, sqrt(max(1.0 - xy_squared, 0.0)));
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_p_s.wesl, by ./x shaders. Needs: nothing else

// P_s: the share of scattered light that a fibre sends down to the base.
//
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

/// A step of Laguerre's iteration for the largest root of `l³ + square l² + linear l + constant`, whose roots are all
/// real.
///
/// Cost on GCN: 18 instructions (2 at a quarter of the rate).
fn fibre_p_s_step(l: f32, constant: f32, linear: f32, square: f32) -> f32 {
    let value = ((l + square) * l + linear) * l + constant;
    let slope = (3.0 * l + 2.0 * square) * l + linear;
    let bend = 6.0 * l + 2.0 * square;
    let root = sqrt(max(4.0 * slope * slope - 6.0 * value * bend, 0.0));
    return l - 3.0 * value / max(slope + root, 1e-20);
}

/// P_s of SGGX fibres, exactly (slide: Base Layer, "no analytical expression"): one minus the integral of
/// `fibre_phase(u, v)` over the `v` above the horizon, for a light at cosines `n_u` ≥ 0 to the normal and `t_u` to the
/// fibres, whose own cosine to the normal is `t_n`. It is the form factor of an elliptic cone: with the positive root λ
/// of `χ = λ³ + (α² c + 2 k t_u t_n) λ² - (α² + k (1 - t_u² - t_n²)) λ - α² c`, `c = n_u`, `k = 1 - α²`,
/// `1 - P_s = λ sqrt((λ + c) (λ + α² c/σ²)) / χ'(λ)`. Laguerre's iteration from 1 falls on λ.
///
/// Cost on GCN: 92 instructions (11 at a quarter of the rate).
fn fibre_p_s(n_u: f32, t_u: f32, t_n: f32, alpha: f32) -> f32 {
    let alpha_sqr = alpha * alpha;
    let k = 1.0 - alpha_sqr;
    let constant = -alpha_sqr * n_u;
    let linear = -(alpha_sqr + k * (1.0 - t_u * t_u - t_n * t_n));
    let square = alpha_sqr * n_u + 2.0 * k * t_u * t_n;

    // Four steps cube the error four times.
    let first = fibre_p_s_step(1.0, constant, linear, square);
    let second = fibre_p_s_step(first, constant, linear, square);
    let third = fibre_p_s_step(second, constant, linear, square);
    let l = fibre_p_s_step(third, constant, linear, square);
    let slope = (3.0 * l + 2.0 * square) * l + linear;
    let area_sqr = 1.0 - k * t_u * t_u;
    let upward = l * sqrt(max((l + n_u) * (l + alpha_sqr * n_u / area_sqr), 0.0)) / max(slope, 1e-20);
    return saturate(1.0 - upward);
}

/// P_s by the talk's six coefficients (slide: Base Layer), fitted for one tilt and one spread: `c_0 + c_1 n_u + c_2 t_u +
/// c_3 n_u² + c_4 n_u t_u + c_5 t_u²`, clamped to [0, 1]. `kinran fit fuzz` prints them with their error.
///
/// Cost on GCN: 5 instructions.
fn fuzz_p_s(coefficients: array<f32, 6>, n_u: f32, t_u: f32) -> f32 {
    let across = n_u * (coefficients[1] + coefficients[3] * n_u + coefficients[4] * t_u);
    return saturate(coefficients[0] + across + t_u * (coefficients[2] + coefficients[5] * t_u));
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_phase.wesl, by ./x shaders. Needs: nothing else

// How a fibre scatters: the SGGX phase function of specular fibres, and Schlick's for velvet.
//
// Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.
// Schlick. An Inexpensive BRDF Model for Physically-based Rendering. Eurographics 1994.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

/// Smallest roughness of fibres to shade with.
const FUZZ_ALPHA_MIN: f32 = 0.1;

/// Roughness of fibres from their spread, 0 (combed) to 1 (in all directions): its root, at least FUZZ_ALPHA_MIN.
///
/// Cost on GCN: 2 instructions (1 at a quarter of the rate).
fn fuzz_alpha(spread: f32) -> f32 {
    return sqrt(max(spread, FUZZ_ALPHA_MIN * FUZZ_ALPHA_MIN));
}

/// Schlick's k of the velvet phase from the fibres' spread: `1 - spread`, at most 0.99.
///
/// Cost on GCN: 2 instructions.
fn velvet_k(spread: f32) -> f32 {
    return 1.0 - max(spread, FUZZ_ALPHA_MIN * FUZZ_ALPHA_MIN);
}

/// Direction of fibres in a frame with z along the normal: `tilt` away from the normal (0 upright, π/2 lying),
/// `azimuth` counter-clockwise from x, both in radians.
///
/// Cost on GCN: 10 instructions (4 at a quarter of the rate).
fn fibre_direction(tilt: f32, azimuth: f32) -> vec3f {
    let sine = sin(tilt);
    return vec3f(sine * cos(azimuth), sine * sin(azimuth), cos(tilt));
}

/// Distribution of the fibres' microflake normals at cosine `t_h` to their direction, per steradian over the sphere
/// (slide: Phase Function, `D_F`): `α³ / (π (t_h² (1 - α²) + α²)²)`.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
fn fibre_d(t_h: f32, alpha: f32) -> f32 {
    let alpha_sqr = alpha * alpha;
    let q = t_h * t_h * (1.0 - alpha_sqr) + alpha_sqr;
    return alpha_sqr * alpha / (3.14159265 * q * q);
}

/// Projected area of the fibres' microflakes along a direction at cosine `t_w` to them (slide: Phase Function, `σ_F`):
/// `sqrt(1 - t_w² (1 - α²))`.
///
/// Cost on GCN: 4 instructions (1 at a quarter of the rate).
fn fibre_projected_area(t_w: f32, alpha: f32) -> f32 {
    return sqrt(1.0 - t_w * t_w * (1.0 - alpha * alpha));
}

/// The fibres' phase function per steradian (slide: Phase Function, `p_F`): `D_F(h) / (4 σ_F(u))` for light from `u`
/// and a view along `v`, from `u_v = u·v`, `t_u = t·u` and `t_v = t·v`. Not symmetric.
///
/// Cost on GCN: 18 instructions (2 at a quarter of the rate).
fn fibre_phase(u_v: f32, t_u: f32, t_v: f32, alpha: f32) -> f32 {
    // |u + v|², kept above zero where v = -u.
    let w = 2.000002 + 2.0 * u_v;
    let s = t_u + t_v;
    let alpha_sqr = alpha * alpha;
    let k = 1.0 - alpha_sqr;
    let m = s * s * k + alpha_sqr * w;
    return alpha_sqr * alpha * w * w * inverseSqrt(1.0 - t_u * t_u * k) / (12.5663706 * m * m);
}

/// Normalisation r(k) of the velvet phase: `sqrt(1-k) / (1 + (2 sqrt(2) - 1) k)`, for k in [0, 0.99]. With it the phase
/// scatters at most what arrives, and 0.88 of it at least for light across the fibres.
///
/// Cost on GCN: 5 instructions (2 at a quarter of the rate).
fn velvet_normalization(k: f32) -> f32 {
    return sqrt(1.0 - k) / (1.0 + 1.82842712 * k);
}

/// The velvet phase per steradian (slide: Velvet Scattering, `p_V`): `r(k) (1-k²) / (4π (1 - k sin(t, h))²)`, arguments
/// as in `fibre_phase`, k in [0, 0.99] as `velvet_k` gives it. The slide's k has the other sign, which scatters forward.
///
/// Cost on GCN: 19 instructions (5 at a quarter of the rate).
fn velvet_phase(u_v: f32, t_u: f32, t_v: f32, k: f32) -> f32 {
    let w = 2.000002 + 2.0 * u_v;
    let s = t_u + t_v;
    let q = 1.0 - k * sqrt(max(1.0 - s * s / w, 0.0));
    return velvet_normalization(k) * (1.0 - k * k) / (12.5663706 * q * q);
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_layer.wesl, by ./x shaders. Needs: fuzz_phase

// The layer of fibres: what it scatters to the viewer and what it leaves of the base.
//
// Koenderink, Pont. The Secret of Velvety Skin. Machine Vision and Applications 2003.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

/// Cosines below this one, of light or view and normal, count as it: a layer of density 1e-4 lets nothing pass there, and
/// quotients stay finite at the horizon.
const FUZZ_COSINE_MIN: f32 = 1e-6;

/// Share of light that passes the layer along a direction at cosine `n_w` ≥ 0 to the normal without meeting a fibre:
/// `e^(-d / n_w)`. Towards the light it is the talk's `P_p`, towards the viewer `P_e`.
///
/// Cost on GCN: 5 instructions (2 at a quarter of the rate).
fn fuzz_passage(density: f32, n_w: f32) -> f32 {
    return exp2(-1.44269504 * density / max(n_w, FUZZ_COSINE_MIN));
}

/// The layer's BRDF for a fibre albedo of one (slide: New Model): `p (1 - passed) / (n_u + n_v)`, where `passed` is
/// `fuzz_passage` along the light times that along the view, and `phase` the phase function; for cosines ≥ 0. Where both
/// vanish the BRDF is infinite, and this is its value at FUZZ_COSINE_MIN.
///
/// Cost on GCN: 6 instructions (1 at a quarter of the rate).
fn fuzz_layer(phase: f32, passed: f32, n_u: f32, n_v: f32) -> f32 {
    return phase * (1.0 - passed) / max(n_u + n_v, FUZZ_COSINE_MIN);
}

/// BRDF of a layer of SGGX fibres for an albedo of one, per steradian, zero below the horizon; `u` light, `v` view and
/// `t` fibre direction are unit vectors in a frame with z along the normal. Not reciprocal: `f(u, v) σ(u) = f(v, u)
/// σ(v)`.
///
/// Cost on GCN: 44 instructions (6 at a quarter of the rate).
fn fuzz_brdf(u: vec3f, v: vec3f, t: vec3f, density: f32, alpha: f32) -> f32 {
    let passed = fuzz_passage(density, u.z) * fuzz_passage(density, v.z);
    let value = fuzz_layer(fibre_phase(dot(u, v), dot(t, u), dot(t, v), alpha), passed, u.z, v.z);
    return select(0.0, value, min(u.z, v.z) > 0.0);
}

/// `fuzz_brdf` with the velvet phase of asymmetry `k`; reciprocal.
///
/// Cost on GCN: 45 instructions (9 at a quarter of the rate).
fn fuzz_velvet_brdf(u: vec3f, v: vec3f, t: vec3f, density: f32, k: f32) -> f32 {
    let passed = fuzz_passage(density, u.z) * fuzz_passage(density, v.z);
    let value = fuzz_layer(velvet_phase(dot(u, v), dot(t, u), dot(t, v), k), passed, u.z, v.z);
    return select(0.0, value, min(u.z, v.z) > 0.0);
}

/// BRDF of a layer whose extinction follows the fibres' projected area, as in a true microflake volume:
/// `D/4 (1 - e^(-d (σ_u/n_u + σ_v/n_v))) / (σ_v n_u + σ_u n_v)`. Reciprocal.
///
/// Cost on GCN: 54 instructions (8 at a quarter of the rate).
fn fuzz_reciprocal_brdf(u: vec3f, v: vec3f, t: vec3f, density: f32, alpha: f32) -> f32 {
    let h = normalize(u + v);
    let area_u = fibre_projected_area(dot(t, u), alpha);
    let area_v = fibre_projected_area(dot(t, v), alpha);
    let passed = fuzz_passage(density * area_u, u.z) * fuzz_passage(density * area_v, v.z);
    let value = 0.25 * fibre_d(dot(t, h), alpha) * (1.0 - passed) / (area_v * u.z + area_u * v.z);
    return select(0.0, value, min(u.z, v.z) > 0.0);
}

/// What the layer's lobe needs of a view, once a pixel.
struct FuzzView {
    /// Cosine of view and normal, at least FUZZ_COSINE_MIN.
    n_v: f32,
    /// Cosine of view and fibre.
    t_v: f32,
    /// `P_e`: the share of the base's light that reaches the viewer.
    escaped: f32,
    /// `-d log2(e)`, below zero also for a density of zero.
    exponent: f32,
    /// `(1-α²) / 2α²`.
    squeeze: f32,
    /// `(4π α)²`.
    root: f32,
    /// `(4π α)² (1-α²)`.
    root_along: f32,
}

/// What the layer makes of a light.
struct FuzzLight {
    /// The BRDF for a fibre albedo of one, per steradian.
    lobe: f32,
    /// `P_p`: the share of the light that reaches the base unscattered.
    penetrated: f32,
}

/// Prepares `fuzz_light` for a view at cosine `n_v` ≥ 0 to the normal and `t_v` to the fibres.
///
/// Cost on GCN: 13 instructions (3 at a quarter of the rate).
fn fuzz_view(n_v: f32, t_v: f32, density: f32, alpha: f32) -> FuzzView {
    // Over a light's cosine of zero it is infinite and the power zero; a zero would be none over it.
    let exponent = -1.44269504 * max(density, 1e-20);
    let n = max(n_v, FUZZ_COSINE_MIN);
    let alpha_sqr = alpha * alpha;
    let k = 1.0 - alpha_sqr;
    let root = 157.91367 * alpha_sqr;
    return FuzzView(n, t_v, exp2(exponent / n), exponent, 0.5 * k / alpha_sqr, root, root * k);
}

/// Lobe and penetration for a light at cosines `n_u` ≥ 0 to the normal, `t_u` to the fibres and `u_v` to the view:
/// `fuzz_brdf` with one exponential for both and all that is known of the view drawn together. The cosines are the same
/// in every frame.
///
/// Cost on GCN: 19 instructions (4 at a quarter of the rate).
fn fuzz_light(view: FuzzView, n_u: f32, t_u: f32, u_v: f32) -> FuzzLight {
    let penetrated = exp2(view.exponent / n_u);
    let scattered = 1.0 - penetrated * view.escaped;
    // The phase is `(w/m)² / (4π α sqrt(1 - k t_u²))` with half of |u + v|² for w, kept above zero where v = -u.
    let w = 1.000001 + u_v;
    let s = t_u + view.t_v;
    let m = s * s * view.squeeze + w;
    let over_area = inverseSqrt(view.root - t_u * t_u * view.root_along);
    return FuzzLight(w * w * scattered * over_area / (m * m * (n_u + view.n_v)), penetrated);
}

/// Factor on the base's BRDF (slide: Base Layer, `c_atten`): `(P_p + c_f (1 - P_p) P_s) P_e`, for the share `penetrated`
/// that reaches the base, `escaped` that leaves it towards the viewer, and `downward` (P_s) of the scattered light that
/// goes down. With `downward` = 0 it is the talk's cheaper variant.
///
/// Cost on GCN: 8 instructions.
fn fuzz_attenuation(penetrated: f32, escaped: f32, downward: f32, fibre_color: vec3f) -> vec3f {
    // `escaped` goes with what the compiler can keep for all lights.
    let scattered = downward - penetrated * downward;
    return penetrated * escaped + fibre_color * escaped * scattered;
}

/// The normal for the layer, between the normal-mapped `n` and the mesh's `vertex_normal` (slide: Deferred):
/// `smoothness` 0 keeps `n`, 1 takes the mesh's. They are less than 180° apart.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
fn fuzz_smooth_normal(n: vec3f, vertex_normal: vec3f, smoothness: f32) -> vec3f {
    return normalize(n + (vertex_normal - n) * smoothness);
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_ambient.wesl, by ./x shaders. Needs: fuzz_layer

// The layer of fibres in light from all around, given as order-2 spherical harmonics.
//
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.
//
// Ambient light of the layer is `c_f fuzz_g fuzz_ambient_factor fuzz_ambient_radiance`: the mean of the layer's
// geometry, a polynomial for what the phase function gathers, and the light along the lobe's mean direction. The talk
// has `1 - P_s(v)` for the second and the hemisphere's mean for the third.

/// Mean over the hemisphere of the layer's BRDF times cosine over phase (slide: Ambient Lighting, `G~`), for a view at
/// cosine `n_v`: `F (1 - e^-y) (1 - y e^-y / 10)` with `F = 1 - n_v ln(1 + 1/n_v)` and `y = d / (n_v F)`. Within -3.6 %
/// and +4.8 % of the closed form for densities in [0.002, 3] and n_v ≥ 0.002; finite for all n_v in [0, 1].
///
/// Cost on GCN: 16 instructions (4 at a quarter of the rate).
fn fuzz_g(density: f32, n_v: f32) -> f32 {
    let x = max(n_v, FUZZ_COSINE_MIN);
    let dense = 1.0 - x * log(1.0 + 1.0 / x);
    let y = density / (x * dense);
    let e = exp2(-1.44269504 * y);
    return dense * (1.0 - e) * (1.0 - 0.1 * y * e);
}

/// The talk's form of `fuzz_g`, `d (1 + c_0 x + c_1 x²) / (d + c_2 x + c_3 x³)`, by four coefficients; zero where there are
/// no fibres.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
fn fuzz_g_talk(coefficients: array<f32, 4>, density: f32, n_v: f32) -> f32 {
    let above = 1.0 + n_v * (coefficients[0] + coefficients[1] * n_v);
    return density * above / max(density + n_v * (coefficients[2] + coefficients[3] * n_v * n_v), 1e-20);
}

/// Share of uniform irradiance that reaches the base unscattered, `2 E_3(d)` (slide: Ambient Shadowing, `Q~`); within
/// 0.00043 for densities in [0, 3].
///
/// Cost on GCN: 11 instructions (2 at a quarter of the rate).
fn fuzz_q(density: f32) -> f32 {
    let above = 1.0 + density * (3.07323 + 0.102541 * density);
    return fuzz_passage(density, 1.0) * above / (1.0 + density * (4.02006 + 1.98275 * density));
}

/// The talk's form of `fuzz_q`, `1 + c_0 d + c_1 d²`, by two coefficients; turns up outside the range of its fit.
///
/// Cost on GCN: 2 instructions.
fn fuzz_q_talk(coefficients: array<f32, 2>, density: f32) -> f32 {
    return 1.0 + density * (coefficients[0] + coefficients[1] * density);
}

/// What the phase function gathers of uniform light, over `fuzz_g`, as a polynomial of the view fitted for one tilt and
/// one spread over densities of 0.05 to 0.5: the talk's six terms and the third and fourth power of `t_v`.
///
/// Cost on GCN: 8 instructions.
fn fuzz_ambient_factor(coefficients: array<f32, 8>, n_v: f32, t_v: f32) -> f32 {
    let along = t_v * (coefficients[2] + t_v * (coefficients[5] + t_v * (coefficients[6] + t_v * coefficients[7])));
    let across = n_v * (coefficients[1] + coefficients[3] * n_v + coefficients[4] * t_v);
    return max(coefficients[0] + across + along, 0.0);
}

/// Nodes of the ambient table along each of its sides, the first and the last at the ends of their ranges.
const FUZZ_TABLE_SIZE: u32 = 48u;

/// Fibres of a smaller alpha are combed: six coefficients miss P_s by more than 0.09 and eight the ambient light by more
/// than 14 %. `fibre_p_s` and the table take their places.
const FUZZ_COMBED_ALPHA: f32 = 0.3;

/// Texture coordinates in the table that replaces `fuzz_ambient_factor` for combed fibres, of FUZZ_TABLE_SIZE texels a
/// side: x runs with `n_v` from 0 to 1, y with the cosine of the azimuth between view and fibre. `t_n` is `t·n`.
///
/// Cost on GCN: 11 instructions (1 at a quarter of the rate).
fn fuzz_ambient_place(n_v: f32, t_v: f32, t_n: f32) -> vec2f {
    let texel = 1.0 / f32(FUZZ_TABLE_SIZE);
    let sines = sqrt(max((1.0 - n_v * n_v) * (1.0 - t_n * t_n), 1e-12));
    let azimuth = saturate(0.5 + 0.5 * (t_v - n_v * t_n) / sines);
    return vec2f(n_v, azimuth) * (1.0 - texel) + 0.5 * texel;
}

/// The factor from what the table holds at `fuzz_ambient_place`, interpolated bilinearly: x for a thin layer, y what a
/// dense one adds to it.
///
/// Cost on GCN: 5 instructions (1 at a quarter of the rate).
fn fuzz_ambient_tabulated(texel: vec2f, density: f32, n_v: f32) -> f32 {
    return texel.x + texel.y * density / max(density + n_v, 1e-20);
}

/// Mean direction of the light that the lobe gathers, shorter than one, by four coefficients of the same fit:
/// `c_0 n + c_1 v + (c_2 + c_3 t_v) t`.
///
/// Cost on GCN: 13 instructions.
fn fuzz_ambient_direction(coefficients: array<f32, 4>, n: vec3f, v: vec3f, t: vec3f) -> vec3f {
    return n * coefficients[0] + v * coefficients[1] + t * (coefficients[2] + coefficients[3] * dot(t, v));
}

/// Mean radiance in the lobe, from the coefficients of `radiance` up to order 1 and `fuzz_ambient_direction`; exact for
/// light that varies linearly with direction. Never negative.
///
/// Cost on GCN: 18 instructions.
fn fuzz_ambient_radiance(radiance: array<vec3f, 9>, direction: vec3f) -> vec3f {
    let linear = radiance[3] * direction.x + radiance[1] * direction.y + radiance[2] * direction.z;
    return max(radiance[0] * 0.2820948 + linear * 0.48860252, vec3f(0.0));
}

/// Mean radiance over the hemisphere about the unit vector `n`: the talk's light. Never negative.
///
/// Cost on GCN: 21 instructions.
fn fuzz_ambient_mean(radiance: array<vec3f, 9>, n: vec3f) -> vec3f {
    return fuzz_ambient_radiance(radiance, n * 0.5);
}

/// Factor on the base's ambient light, diffuse or from a specular probe (slide: Ambient Shadowing, `c_atten`):
/// `P_e (Q + c_f R (1 - Q))`. `downward` is R, the mean of P_s over uniform irradiance, which depends on tilt and spread;
/// 1/2 for fibres in all directions. The slide's R lacks a 1/π.
///
/// Cost on GCN: 8 instructions.
fn fuzz_ambient_attenuation(escaped: f32, q: f32, downward: f32, fibre_color: vec3f) -> vec3f {
    return (q + fibre_color * (downward * (1.0 - q))) * escaped;
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_deferred.wesl, by ./x shaders. Needs: fuzz_layer

// Fuzz by seven bits of a G-buffer: fixed fibres over Lambert, for moss and felt.
//
// McAuley. Extension to Energy-Conserving Wrapped Diffuse. 2013.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

/// Density of the layer.
const FUZZ_DEFERRED_DENSITY: f32 = 0.5;

/// Roughness of the fibres: a spread of 0.9. They stand along the normal.
const FUZZ_DEFERRED_ALPHA: f32 = 0.9486833;

/// Albedo of the fibres over that of the Lambert base.
const FUZZ_DEFERRED_ALBEDO: f32 = 5.0;

/// How far light wraps around the terminator, as a cosine.
const FUZZ_WRAP: f32 = 0.2;

/// `(1+n)/(2 (1+w)^(1+n))` for n = 2: with it the wrapped cosine integrates to π over the sphere.
const FUZZ_WRAP_SCALE: f32 = 3.0 / (2.0 * (1.0 + FUZZ_WRAP) * (1.0 + FUZZ_WRAP) * (1.0 + FUZZ_WRAP));

/// The cosine of light and normal, softened by wrapping (McAuley 2013; slide: Deferred), n = 2:
/// `(1+n)/(2(1+w)) (max(n_u + w, 0)/(1+w))^n`. Its integral over the sphere is π. Where no light arrives it is 1e-8
/// rather than zero, so that the layer may divide by it.
///
/// Cost on GCN: 4 instructions.
fn fuzz_wrap(n_u: f32) -> f32 {
    let c = max(n_u + FUZZ_WRAP, 1e-4);
    return FUZZ_WRAP_SCALE * c * c;
}

/// P_e of the deferred layer, once a pixel.
///
/// Cost on GCN: 4 instructions (2 at a quarter of the rate).
fn fuzz_deferred_escape(n_v: f32) -> f32 {
    return fuzz_passage(FUZZ_DEFERRED_DENSITY, n_v);
}

/// BRDF times cosine of the deferred layer for a fibre albedo of one, from the cosines of light and view with the normal
/// and with each other and `fuzz_deferred_escape`. Lights down to `n_u = -FUZZ_WRAP` reach it. The picture is
/// `lerp(Lambert, this, fuzziness)`; the base is not shadowed. It is `fibre_phase` and `fuzz_layer` times cosine with
/// `fuzz_wrap` for the light's cosine, every constant factor drawn into another.
///
/// Cost on GCN: 23 instructions (4 at a quarter of the rate).
fn fuzz_deferred(n_u: f32, n_v: f32, u_v: f32, escaped: f32) -> f32 {
    const alpha_sqr = FUZZ_DEFERRED_ALPHA * FUZZ_DEFERRED_ALPHA;
    const k = 1.0 - alpha_sqr;
    const root = 157.91367 * alpha_sqr;
    // The wrapped cosine over its scale.
    let c = max(n_u + FUZZ_WRAP, 1e-4);
    let wrapped = c * c;
    // `fuzz_passage`; the cosine is never zero.
    let passed = exp2(-1.44269504 * (FUZZ_DEFERRED_DENSITY / FUZZ_WRAP_SCALE) / wrapped) * escaped;

    // The phase is `(w/m)² / (4π α sqrt(1 - k n_u²))` with half of |u + v|² for w, kept above zero where v = -u.
    let w = 1.000001 + u_v;
    let s = n_u + n_v;
    let m = s * s * (0.5 * k / alpha_sqr) + w;
    let over_area = inverseSqrt(root - n_u * n_u * (root * k));
    let above = w * w * wrapped * (1.0 - passed) * over_area;
    return above / (m * m * (wrapped + n_v * (1.0 / FUZZ_WRAP_SCALE)));
}

/// Albedo of the fibres over a Lambert base of albedo `base`: `5 base`, as the talk has it, but no more than the layer
/// can have without returning more than arrives. The talk's alone exceeds one at grazing where `base` is above 0.35.
///
/// Cost on GCN: 8 instructions.
fn fuzz_deferred_color(base: vec3f, n_v: f32) -> vec3f {
    return min(base * FUZZ_DEFERRED_ALBEDO, vec3f(1.7241 + 7.5257 * n_v));
}

/// Eight bits of a G-buffer, a whole number from 0 to 255, from a fuzziness in [0, 1], rounded to 1/127, below a `flag` in
/// the top bit (0 or 1: translucency, in the talk). A channel of the format unorm8 wants it over 255.
///
/// Cost on GCN: 4 instructions.
fn fuzziness_code(fuzziness: f32, flag: f32) -> f32 {
    return 128.0 * flag + floor(saturate(fuzziness) * 127.0 + 0.5);
}

/// Fuzziness of eight bits, the flag left out. What a channel of the format unorm8 gives, times 255, need not be whole.
///
/// Cost on GCN: 4 instructions.
fn fuzziness_from_code(code: f32) -> f32 {
    return (code - select(0.0, 128.0, code > 127.5)) * (1.0 / 127.0);
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/multiscatter.wesl, by ./x shaders. Needs: nothing else

// Energy that microfacet models lose between the facets, given back.
//
// Turquin. Practical multiple scattering compensation for microfacet models. 2019.

/// Directional albedo of the single-scattering GGX lobe with height-correlated Smith masking and F = 1, for a view at
/// cosine `n_v` (0 to 1): the share of a white furnace that comes back, 0.307 (= 1 − ln 2) to 1. A rational fit,
/// within 0.011 of quadrature (0.004 RMS) for alpha and n_v in [0.005, 1]; it takes the place of a lookup table.
///
/// Cost on GCN: 27 instructions (1 at a quarter of the rate).
fn ggx_directional_albedo(n_v: f32, alpha: f32) -> f32 {
    let m = n_v;
    let a = alpha;
    let m_sqr = m * m;
    let a_sqr = a * a;
    let p = (0.00023917 + 0.004272 * a + 0.014007 * a_sqr)
        + (0.13020 - 0.075028 * a + 3.2169 * a_sqr) * m
        + (-0.034490 - 0.18897 * a + 0.089879 * a_sqr) * m_sqr;
    let q = (-0.000019263 + 0.0054598 * a + 1.0288 * a_sqr)
        + (0.0019317 - 1.1331 * a + 5.3123 * a_sqr) * m
        + (1.0 - 1.3516 * a - 0.38030 * a_sqr) * m_sqr;
    return clamp(1.0 - a * p / q, 0.3, 1.0);
}

/// Roughness of the isotropic lobe whose albedo stands for that of an anisotropic one, for the unit view `v` in the frame
/// of the alphas: squared, the mean of `alpha_t²` and `alpha_b²` from above; the flatter the view, the more that across it
/// counts, towards which facets send most light: `(alpha_t² + alpha_b² + 0.8 (alpha_t² - alpha_b²) (v.y⁴ - v.x⁴)) / 2`.
/// RMS error of the albedo 0.019 over random pairs in [0.05, 1] and all views, worst 0.32 at a flat view across the pair
/// (1, 0.05).
///
/// Cost on GCN: 10 instructions (1 at a quarter of the rate).
fn ggx_albedo_alpha(v: vec3f, alpha_t: f32, alpha_b: f32) -> f32 {
    let t = alpha_t * alpha_t;
    let b = alpha_b * alpha_b;
    let x = v.x * v.x;
    let y = v.y * v.y;
    return sqrt(0.5 * (t + b) + 0.4 * (t - b) * (y * y - x * x));
}

/// Factor on the single-scattering lobe that restores the energy of all further bounces, `1 + f0 (1/E - 1)` (Turquin
/// 2019, eq. 16), per pixel, for the unit view `v` in the frame of the alphas, z along the normal. The factor depends on
/// the view alone, so the compensated lobe is not reciprocal. An anisotropic lobe uses the isotropic albedo at
/// `ggx_albedo_alpha`.
///
/// Cost on GCN: 44 instructions (3 at a quarter of the rate).
fn multiscatter_compensation(f0: vec3f, v: vec3f, alpha_t: f32, alpha_b: f32) -> vec3f {
    let e = ggx_directional_albedo(saturate(v.z), ggx_albedo_alpha(v, alpha_t, alpha_b));
    return 1.0 + f0 * (1.0 / e - 1.0);
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sh.wesl, by ./x shaders. Needs: nothing else

// Order-2 spherical harmonics: distant light by nine coefficients.
//
// Ramamoorthi and Hanrahan. An Efficient Representation for Irradiance Environment Maps. SIGGRAPH 2001.
//
// Coefficients stand in the order (l, m) = (0,0), (1,-1), (1,0), (1,1), (2,-2) .. (2,2). The basis is orthonormal
// over the sphere, its polar axis is z, without the Condon-Shortley phase.

/// The basis functions at a unit direction.
///
/// Cost on GCN: 14 instructions.
fn sh_basis(direction: vec3f) -> array<f32, 9> {
    let x = direction.x;
    let y = direction.y;
    let z = direction.z;
    return array<f32, 9>(
        0.2820948,
        0.48860252 * y,
        0.48860252 * z,
        0.48860252 * x,
        1.0925484 * x * y,
        1.0925484 * y * z,
        0.31539157 * (3.0 * z * z - 1.0),
        1.0925484 * x * z,
        0.5462742 * (x * x - y * y),
    );
}

/// The function that the coefficients stand for, at a unit direction; negative where it rings.
///
/// Cost on GCN: 41 instructions.
fn sh_evaluate(coefficients: array<vec3f, 9>, direction: vec3f) -> vec3f {
    let basis = sh_basis(direction);
    return coefficients[0] * basis[0] + coefficients[1] * basis[1] + coefficients[2] * basis[2]
        + coefficients[3] * basis[3] + coefficients[4] * basis[4] + coefficients[5] * basis[5]
        + coefficients[6] * basis[6] + coefficients[7] * basis[7] + coefficients[8] * basis[8];
}

/// Coefficients of irradiance from those of radiance (eq. 7), once per environment; `sh_evaluate` of the result is
/// `sh_irradiance`, three multiplications a coefficient cheaper.
///
/// Cost on GCN: 27 instructions.
fn sh_convolve_cosine(radiance: array<vec3f, 9>) -> array<vec3f, 9> {
    // sqrt(4 pi / (2l + 1)) times the clamped cosine's own coefficient: π, 2π/3, π/4.
    let band_zero = 3.14159265;
    let band_one = 2.09439510;
    let band_two = 0.78539816;
    return array<vec3f, 9>(
        radiance[0] * band_zero,
        radiance[1] * band_one,
        radiance[2] * band_one,
        radiance[3] * band_one,
        radiance[4] * band_two,
        radiance[5] * band_two,
        radiance[6] * band_two,
        radiance[7] * band_two,
        radiance[8] * band_two,
    );
}

/// Irradiance on a surface with unit `normal`, the integral of radiance times the clamped cosine. Light from one small
/// spot can make it slightly negative on the far side; clamp where that matters.
///
/// Cost on GCN: 65 instructions.
fn sh_irradiance(radiance: array<vec3f, 9>, normal: vec3f) -> vec3f {
    return sh_evaluate(sh_convolve_cosine(radiance), normal);
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sym.wesl, by ./x shaders. Needs: nothing else

// Symmetric matrices. A 2×2 one is a vec3f (xx, xy, yy), so that sums and scalings are the language's own; a 3×3
// one is a mat3x3f.

/// The 2×2 matrix with eigenvalue `l1` along the unit vector `axis` and `l2` across it.
///
/// Cost on GCN: 11 instructions.
fn sym2_from_eigen(l1: f32, l2: f32, axis: vec2f) -> vec3f {
    return vec3f(
        l1 * axis.x * axis.x + l2 * axis.y * axis.y,
        (l1 - l2) * axis.x * axis.y,
        l1 * axis.y * axis.y + l2 * axis.x * axis.x,
    );
}

/// `v v^T`.
///
/// Cost on GCN: 3 instructions.
fn sym2_outer(v: vec2f) -> vec3f {
    return vec3f(v.x * v.x, v.x * v.y, v.y * v.y);
}

/// Determinant of a 2×2 matrix.
///
/// Cost on GCN: 2 instructions.
fn sym2_det(a: vec3f) -> f32 {
    return a.x * a.z - a.y * a.y;
}

/// Trace of a 2×2 matrix.
///
/// Cost on GCN: 1 instruction.
fn sym2_trace(a: vec3f) -> f32 {
    return a.x + a.z;
}

/// `v^T A v`.
///
/// Cost on GCN: 7 instructions.
fn sym2_quadratic(a: vec3f, v: vec2f) -> f32 {
    return a.x * v.x * v.x + 2.0 * a.y * v.x * v.y + a.z * v.y * v.y;
}

/// Eigenvalues of a positive semi-definite 2×2 matrix and the unit eigenvector of the larger.
struct SymEigen {
    /// The larger eigenvalue.
    larger: f32,
    /// The smaller eigenvalue.
    smaller: f32,
    /// Unit eigenvector of the larger.
    axis: vec2f,
}

/// Eigenvalues and axis of a positive semi-definite matrix, both at least zero. The axis has x ≥ 0 (and y = +1
/// where x = 0) and is (1, 0) when both eigenvalues are equal. The smaller is `det / larger`, which keeps its digits
/// where the textbook's half difference cancels.
///
/// Cost on GCN: 33 instructions (5 at a quarter of the rate).
fn sym2_eigen(a: vec3f) -> SymEigen {
    let half_difference = 0.5 * (a.x - a.z);
    let radius = sqrt(half_difference * half_difference + a.y * a.y);
    let larger = 0.5 * (a.x + a.z) + radius;
    // A radius far below the rounding of the diagonal is none, and its square may underflow.
    if radius <= 1e-12 * larger || larger <= 0.0 {
        return SymEigen(max(larger, 0.0), max(larger - 2.0 * radius, 0.0), vec2f(1.0, 0.0));
    }
    let smaller = min(max(sym2_det(a) / larger, 0.0), larger);

    // The larger component of the half-angle is free of cancellation, the other follows from xy.
    let long = sqrt(0.5 + 0.5 * abs(half_difference) / radius);
    let short = 0.5 * abs(a.y) / (radius * long);
    let side = select(1.0, -1.0, a.y < 0.0);
    let axis = select(vec2f(short, side * long), vec2f(long, side * short), half_difference >= 0.0);
    return SymEigen(larger, smaller, axis);
}

/// The same eigenvectors with both eigenvalues clamped to `[lo, hi]`, `lo` ≥ 0. A matrix within the range comes back
/// as it is.
///
/// Cost on GCN: 54 instructions (5 at a quarter of the rate).
fn sym2_clamp_eigen(a: vec3f, lo: f32, hi: f32) -> vec3f {
    let e = sym2_eigen(a);
    let clamped = sym2_from_eigen(clamp(e.larger, lo, hi), clamp(e.smaller, lo, hi), e.axis);
    return select(clamped, a, e.larger <= hi && e.smaller > lo);
}

/// The positive semi-definite square root of a positive semi-definite matrix:
/// `(A + sqrt(det) I) / sqrt(trace + 2 sqrt(det))`, by Cayley–Hamilton.
///
/// Cost on GCN: 17 instructions (3 at a quarter of the rate).
fn sym2_sqrt(a: vec3f) -> vec3f {
    let root_det = sqrt(max(sym2_det(a), 0.0));
    let scale = sqrt(sym2_trace(a) + 2.0 * root_det);
    if scale == 0.0 {
        return vec3f(0.0);
    }
    return (a + vec3f(root_det, 0.0, root_det)) * (1.0 / scale);
}

/// `k A`. Column by column: a matrix times a number, which HLSL writes `mul(k, A)`, is refused by Slang for WGSL.
///
/// Cost on GCN: 9 instructions.
fn sym3_scale(a: mat3x3f, k: f32) -> mat3x3f {
    return mat3x3f(a[0] * k, a[1] * k, a[2] * k);
}

/// `A + d I`.
///
/// Cost on GCN: 3 instructions.
fn sym3_add_diagonal(a: mat3x3f, d: f32) -> mat3x3f {
    return mat3x3f(a[0] + vec3f(d, 0.0, 0.0), a[1] + vec3f(0.0, d, 0.0), a[2] + vec3f(0.0, 0.0, d));
}

/// `v^T A v`.
///
/// Cost on GCN: 12 instructions.
fn sym3_quadratic(a: mat3x3f, v: vec3f) -> f32 {
    return dot(v, a * v);
}

/// Trace of a 3×3 matrix.
///
/// Cost on GCN: 2 instructions.
fn sym3_trace(a: mat3x3f) -> f32 {
    return a[0].x + a[1].y + a[2].z;
}

/// The adjugate of a symmetric matrix: `A adj(A) = det(A) I`. Its columns are the cross products of A's.
///
/// Cost on GCN: 18 instructions.
fn sym3_adjugate(a: mat3x3f) -> mat3x3f {
    return mat3x3f(cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1]));
}

/// Determinant of a symmetric 3×3 matrix.
///
/// Cost on GCN: 9 instructions.
fn sym3_det(a: mat3x3f) -> f32 {
    return dot(a[0], cross(a[1], a[2]));
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/aniso.wesl, by ./x shaders. Needs: frame, sym

// The aniso texel: squared roughness as three numbers that survive 8 bits, filtering and BC7.
//
// A texel holds [sqrt(Sxx), rho/2 + 1/2, sqrt(Syy)] with rho = Sxy / sqrt(Sxx Syy) (slide: Our Algorithm, step 4).
// S is alpha² as a symmetric matrix in the frame of `m_n`. Sample the texture with the hardware's filter; every
// average of texels decodes to a positive semi-definite matrix.

/// Smallest GGX roughness to shade with: one step of an 8-bit aniso channel.
const ALPHA_MIN: f32 = 0.00392156862745098;

/// GGX alpha of a perceptual roughness in [0, 1]: its square, at least ALPHA_MIN.
///
/// Cost on GCN: 2 instructions.
fn alpha_from_roughness(roughness: f32) -> f32 {
    return max(roughness * roughness, ALPHA_MIN);
}

/// GGX alpha of a gloss in [0, 1]: `(1 - gloss)²`, at least ALPHA_MIN.
///
/// Cost on GCN: 3 instructions.
fn alpha_from_gloss(gloss: f32) -> f32 {
    return alpha_from_roughness(1.0 - gloss);
}

/// What a light needs of an aniso texel.
struct AnisoDecoded {
    /// Roughness along `tangent`, the larger one.
    alpha_t: f32,
    /// Roughness along `bitangent`, the smaller one.
    alpha_b: f32,
    /// Unit vector of the larger roughness.
    tangent: vec3f,
    /// Unit vector of the smaller roughness.
    bitangent: vec3f,
}

/// Texel of a squared roughness matrix `s` (xx, xy, yy); each component in [0, 1]. rho is 0 where Sxx or Syy is 0.
///
/// Cost on GCN: 11 instructions (3 at a quarter of the rate).
fn aniso_encode(s: vec3f) -> vec3f {
    let product = s.x * s.z;
    let rho = select(0.0, clamp(s.y * inverseSqrt(product), -1.0, 1.0), product > 0.0);
    return vec3f(sqrt(saturate(s.x)), 0.5 * rho + 0.5, sqrt(saturate(s.z)));
}

/// Squared roughness matrix (xx, xy, yy) of a texel: positive semi-definite for every texel in [0, 1]³.
///
/// With `ggx_matrix_d` and `smith_matrix_v` this is all the decoding a light needs: cheaper than `aniso_decode` for a
/// few lights. Add `sym2_clamp_eigen` where a determinant of zero would divide.
///
/// Cost on GCN: 5 instructions.
fn aniso_decode_matrix(texel: vec3f) -> vec3f {
    return vec3f(texel.x * texel.x, texel.x * (texel.y * 2.0 - 1.0) * texel.z, texel.z * texel.z);
}

/// Principal roughnesses and directions of a texel (slide: Our Algorithm, `DecodeSggx`), in the frame of the two unit
/// vectors given, which are the first two columns of `m_n` brought to world space.
///
/// Differs from the slide in two points. Roughness is kept within ALPHA_MIN and 1, which also bounds what the half
/// difference in alpha_b loses: alpha_b is within 1 % of the exact one even where alpha_t is 255 times as large. And
/// Sxy = 0 counts as positive: with HLSL's `sign`, which is zero there, the tangent vanishes on every texel aligned with
/// the bitangent. The axis comes from cos² and sin² of its angle, within 0.03° of the exact one; that of a round texel,
/// which has none, lies at 45°.
///
/// Cost on GCN: 33 instructions (5 at a quarter of the rate).
fn aniso_decode(texel: vec3f, tangent: vec3f, bitangent: vec3f) -> AnisoDecoded {
    let rho = texel.y * 2.0 - 1.0;
    let sxy_twice = 2.0 * (texel.x * texel.z * rho);
    let sxx = texel.x * texel.x;
    let sum = texel.z * texel.z + sxx;
    let difference = sxx - texel.z * texel.z;
    // The grain keeps a round texel from 0 / 0 and touches no other: alphas of 1e-4 have as much.
    let discr_sqr = sxy_twice * sxy_twice + (difference * difference + 1e-18);
    let discr_rcp = inverseSqrt(discr_sqr);

    // Factors of a power of two, absolute values and `saturate` stand where GCN has them for nothing, on the result of
    // another instruction. 1.5378701e-5 is ALPHA_MIN².
    let alpha_t_sqr = max(0.5 * (discr_sqr * discr_rcp + sum), 1.5378701e-5);
    let alpha_b_sqr = max(0.5 * (sum - discr_sqr * discr_rcp), 1.5378701e-5);

    let c_sqr = saturate(0.5 * (difference * discr_rcp + 1.0));
    let c = sqrt(c_sqr);
    let s_abs = sqrt(1.0 - c_sqr);
    let s = select(s_abs, -s_abs, sxy_twice < 0.0);
    return AnisoDecoded(
        saturate(sqrt(alpha_t_sqr)),
        saturate(sqrt(alpha_b_sqr)),
        c * tangent + s * bitangent,
        c * bitangent - s * tangent,
    );
}

/// Squared roughness matrix (xx, xy, yy) with `alpha_t` along the unit vector `axis` of the `m_n` frame, `alpha_b`
/// across.
///
/// Cost on GCN: 13 instructions.
fn aniso_from_alphas(alpha_t: f32, alpha_b: f32, axis: vec2f) -> vec3f {
    return sym2_from_eigen(alpha_t * alpha_t, alpha_b * alpha_b, axis);
}

/// Direction in the `m_n` frame of a direction painted in the mesh's tangent plane: what Gram–Schmidt, `d - (d·n) n`,
/// makes of it. Both are unit vectors; where nothing is left of it, the direction stays as it is.
///
/// Cost on GCN: 23 instructions (2 at a quarter of the rate).
fn axis_from_direction(direction: vec2f, n: vec3f) -> vec2f {
    // The columns of m_n are orthogonal to n, so the Gram–Schmidt term drops out of both products.
    let m = m_n(n);
    let axis = vec2f(dot(m[0].xy, direction), dot(m[1].xy, direction));
    let length_squared = dot(axis, axis);
    return select(direction, axis * inverseSqrt(length_squared), length_squared > 1e-12);
}

/// The inverse of `axis_from_direction`: the unit direction in the mesh's tangent plane that Gram–Schmidt against `n`
/// turns into `axis` of the `m_n` frame.
///
/// Cost on GCN: 31 instructions (2 at a quarter of the rate).
fn direction_from_axis(axis: vec2f, n: vec3f) -> vec2f {
    let m = m_n(n);
    let t = m[0] * axis.x + m[1] * axis.y;
    // In the plane of t and n, the vector without a z component; times n.z to survive the horizon.
    let d = t.xy * n.z - t.z * n.xy;
    let length_squared = dot(d, d);
    return select(axis, d * inverseSqrt(length_squared), length_squared > 1e-12);
}

/// Principal alphas (alpha_t, alpha_b) of `KHR_materials_anisotropy`: `alpha_b = roughness²`,
/// `alpha_t = mix(alpha_b, 1, strength²)`.
///
/// Cost on GCN: 5 instructions.
fn alphas_from_khr_anisotropy(roughness: f32, strength: f32) -> vec2f {
    let alpha_b = alpha_from_roughness(roughness);
    return vec2f(alpha_b + (1.0 - alpha_b) * strength * strength, alpha_b);
}

/// Perceptual roughness and anisotropy strength of `KHR_materials_anisotropy` for `alpha_t ≥ alpha_b`; the inverse of
/// `alphas_from_khr_anisotropy`.
///
/// Cost on GCN: 8 instructions (3 at a quarter of the rate).
fn khr_anisotropy_from_alphas(alpha_t: f32, alpha_b: f32) -> vec2f {
    let rest = 1.0 - alpha_b;
    let strength = select(0.0, sqrt(saturate((alpha_t - alpha_b) / rest)), rest > 0.0);
    return vec2f(sqrt(alpha_b), strength);
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_layer.wesl, by ./x shaders. Needs: aniso

// What a tiled layer's texels go through before they are blended: place, colour, direction, mask. Between `detail_uv`
// and the rest stands the texture fetch, with the hardware's filter and its repeating or mirroring address mode.

/// The synthesized value of a texel in [0, 1]: byte 128 is 1/2, 1 and 0 are 0, 255 is 1. Without this mapping 8 bits do
/// not hold the neutral 1/2, and a detail equal to its target would come out 0.4 % off.
///
/// Cost on GCN: 6 instructions.
fn detail_from_texel(texel: vec3f) -> vec3f {
    return saturate(texel * 1.003937007874016 - 0.003937007874016);
}

/// Place in the tile: the mesh's `uv` scaled and rotated by `matrix`, then moved. The matrix is
/// `KHR_texture_transform`'s, with columns `(cos sx, -sin sx)` and `(sin sy, cos sy)`.
///
/// Cost on GCN: 4 instructions.
fn detail_uv(uv: vec2f, matrix: mat2x2f, offset: vec2f) -> vec2f {
    return matrix * uv + offset;
}

/// Signs that mirrored tiling gives the directions in a tile at `uv`: −1 along an axis in every other tile.
///
/// Cost on GCN: 6 instructions.
fn detail_mirror(uv: vec2f) -> vec2f {
    return 1.0 - 4.0 * fract(0.5 * floor(uv));
}

/// Opacity of a layer: the mask's contrast raised around 1/2. `contrast` 1 leaves it as it is, 0 makes it 1/2.
///
/// Cost on GCN: 2 instructions.
fn detail_mask(mask: f32, contrast: f32) -> f32 {
    return saturate((mask - 0.5) * contrast + 0.5);
}

/// A tile's normal in the mesh's tangent space. `rotation` is the cosine and sine of the layer's rotation, `mirror` what
/// `detail_mirror` says, or ones. A change of scale leaves slopes as they are.
///
/// Cost on GCN: 6 instructions.
fn detail_turn_normal(n: vec3f, rotation: vec2f, mirror: vec2f) -> vec3f {
    let xy = n.xy * mirror;
    return vec3f(rotation.x * xy.x + rotation.y * xy.y, rotation.x * xy.y - rotation.y * xy.x, n.z);
}

/// A tile's aniso texel in the mesh's tangent space; as `detail_turn_normal`.
///
/// Cost on GCN: 32 instructions (3 at a quarter of the rate).
fn detail_turn_aniso(texel: vec3f, rotation: vec2f, mirror: vec2f) -> vec3f {
    let a = aniso_decode_matrix(texel);
    let xy = a.y * mirror.x * mirror.y;
    let c = rotation.x;
    let s = rotation.y;
    let across = 2.0 * c * s * xy;
    return aniso_encode(vec3f(
        c * c * a.x + across + s * s * a.z,
        c * s * (a.z - a.x) + (c * c - s * s) * xy,
        s * s * a.x - across + c * c * a.z,
    ));
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/ggx.wesl, by ./x shaders. Needs: sym

// The GGX microfacet lobe, isotropic and anisotropic.
//
// All directions are unit vectors in the shading frame: z is the normal, x the tangent along which the roughness is
// `alpha_t`, y the bitangent along which it is `alpha_b`. `alpha` is GGX roughness, the square of perceptual
// roughness, from ALPHA_MIN to 1.
//
// A lobe of a light is D V F n·u times the light's irradiance. What depends on the view alone (the stretched v of the
// visibility, products of alphas) is the same for every light, and compilers keep it out of an unrolled loop.

/// 1 / π.
const FRAC_1_PI: f32 = 0.31830988618379067;

/// Isotropic distribution of microfacet normals per steradian, `n_h = n·h` (Walter 2007, eq. 33). One ulp of `n_h`
/// moves the peak by `2.4e-7 / alpha²`; where that matters, `ggx_aniso_d` has all the digits.
///
/// Cost on GCN: 10 instructions (1 at a quarter of the rate).
fn ggx_d(n_h: f32, alpha: f32) -> f32 {
    let a_sqr = alpha * alpha;
    // 1 - n_h² as a product, which does not round before it cancels.
    let q = (1.0 - n_h) * (1.0 + n_h) + a_sqr * n_h * n_h;
    return a_sqr * FRAC_1_PI / (q * q);
}

/// Anisotropic distribution of microfacet normals per steradian (slide: Our Algorithm, the form with
/// `(alpha_t alpha_b)^3`), for `h` in the upper hemisphere. Its integral against n·h over there is one.
///
/// Cost on GCN: 12 instructions (1 at a quarter of the rate).
fn ggx_aniso_d(h: vec3f, alpha_t: f32, alpha_b: f32) -> f32 {
    let alpha_tb = alpha_t * alpha_b;
    let v = vec3f(h.x * alpha_b, h.y * alpha_t, h.z * alpha_tb);
    let w = alpha_tb / dot(v, v);
    return alpha_tb * FRAC_1_PI * w * w;
}

/// `ggx_aniso_d` from the squared roughness matrix `a` (xx, xy, yy), with no eigen decode:
/// `|A|^(3/2) / (π (h.xy^T adj(A) h.xy + |A| h.z²)²)`. `|A|` must be positive.
///
/// Cost on GCN: 17 instructions (2 at a quarter of the rate).
fn ggx_matrix_d(h: vec3f, a: vec3f) -> f32 {
    let det = sym2_det(a);
    let w = det / (sym2_quadratic(vec3f(a.z, -a.y, a.x), h.xy) + det * h.z * h.z);
    return inverseSqrt(det) * FRAC_1_PI * w * w;
}

/// Visibility from the two terms of `2 n·u n·v (1 + Λ(u) + Λ(v))`: `n·v |u'|` and `n·u |v'|`, where the prime
/// stretches a direction by the roughness. Finite, and meaningless, where both directions graze: their sum is 8e-9 where
/// both cosines are 1e-6 and alpha is ALPHA_MIN. The bound keeps the product with the sharpest peak finite too.
///
/// Cost on GCN: 3 instructions (1 at a quarter of the rate).
fn smith_v_of_terms(u: f32, v: f32) -> f32 {
    return 0.5 / max(u + v, 1e-12);
}

/// Height-correlated Smith visibility `G2 / (4 n·u n·v)`, isotropic (Heitz 2014, eq. 99).
///
/// Cost on GCN: 12 instructions (3 at a quarter of the rate).
fn smith_v(n_u: f32, n_v: f32, alpha: f32) -> f32 {
    let a_sqr = alpha * alpha;
    let v = n_u * sqrt(n_v * n_v * (1.0 - a_sqr) + a_sqr);
    let u = n_v * sqrt(n_u * n_u * (1.0 - a_sqr) + a_sqr);
    return smith_v_of_terms(u, v);
}

/// Height-correlated Smith visibility `G2 / (4 n·u n·v)`, anisotropic (Heitz 2014, eq. 99 with the lambda of section
/// 5.3). `u` and `v` lie in the upper hemisphere.
///
/// Cost on GCN: 16 instructions (3 at a quarter of the rate).
fn smith_aniso_v(u: vec3f, v: vec3f, alpha_t: f32, alpha_b: f32) -> f32 {
    let stretch = vec3f(alpha_t, alpha_b, 1.0);
    return smith_v_of_terms(v.z * length(u * stretch), u.z * length(v * stretch));
}

/// `smith_aniso_v` from the squared roughness matrix `a` (xx, xy, yy), with no eigen decode.
///
/// Cost on GCN: 21 instructions (3 at a quarter of the rate).
fn smith_matrix_v(u: vec3f, v: vec3f, a: vec3f) -> f32 {
    let stretched_u = sqrt(sym2_quadratic(a, u.xy) + u.z * u.z);
    let stretched_v = sqrt(sym2_quadratic(a, v.xy) + v.z * v.z);
    return smith_v_of_terms(v.z * stretched_u, u.z * stretched_v);
}

/// Smith masking of `v` alone, 0 to 1 (Heitz 2014, eq. 43).
///
/// Cost on GCN: 10 instructions (2 at a quarter of the rate).
fn smith_aniso_g1(v: vec3f, alpha_t: f32, alpha_b: f32) -> f32 {
    return 2.0 * v.z / (v.z + length(v * vec3f(alpha_t, alpha_b, 1.0)));
}

/// Fresnel reflectance by Schlick's approximation (1994) from `f0` at normal incidence to one at grazing.
///
/// Cost on GCN: 10 instructions.
fn schlick_f(f0: vec3f, v_h: f32) -> vec3f {
    let m = saturate(1.0 - v_h);
    let m_sqr = m * m;
    return f0 + (1.0 - f0) * (m_sqr * m_sqr * m);
}

/// A microfacet normal distributed as `ggx_vndf_pdf` for the view direction `v`, from two uniform numbers in [0, 1)
/// (Dupuy, Benyoub 2023, listing 3).
///
/// Cost on GCN: 32 instructions (5 at a quarter of the rate).
fn ggx_vndf_sample(v: vec3f, alpha_t: f32, alpha_b: f32, xi: vec2f) -> vec3f {
    let stretch = vec3f(alpha_t, alpha_b, 1.0);
    let v_std = normalize(v * stretch);

    // Sample the spherical cap that reflects to the upper hemisphere.
    let phi = 6.2831853 * xi.x;
    let z = (1.0 - xi.y) * (1.0 + v_std.z) - v_std.z;
    let sin_theta = sqrt(max(1.0 - z * z, 0.0));
    let cap = vec3f(sin_theta * cos(phi), sin_theta * sin(phi), z);

    // The rim of the cap is opposite to `v_std` in one point, where the sum may round to nothing.
    let h = (cap + v_std) * stretch;
    let length_squared = dot(h, h);
    return select(vec3f(0.0, 0.0, 1.0), h * inverseSqrt(length_squared), length_squared > 0.0);
}

/// Density per steradian of microfacet normals visible from `v`: `G1(v) max(v·h, 0) D(h) / n·v` (Heitz 2014, eq. 16).
/// Divide by `4 v·h` for the density of the reflected direction.
///
/// Cost on GCN: 29 instructions (3 at a quarter of the rate).
fn ggx_vndf_pdf(v: vec3f, h: vec3f, alpha_t: f32, alpha_b: f32) -> f32 {
    if h.z <= 0.0 {
        return 0.0;
    }
    let g_over_n_v = 2.0 / (v.z + length(v * vec3f(alpha_t, alpha_b, 1.0)));
    return g_over_n_v * max(dot(v, h), 0.0) * ggx_aniso_d(h, alpha_t, alpha_b);
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_sampling.wesl, by ./x shaders. Needs: fuzz_phase, ggx

// Light directions for a view, where a layer of fibres and its base scatter from.
//
// Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.

/// A light direction distributed as `fuzz_pdf` for the view `v`, from two uniform numbers in [0, 1): `v` reflected on a
/// visible normal of the fibres (Heitz 2015, section 4). It may lie below the horizon, where the layer receives nothing:
/// the density covers the sphere.
///
/// Cost on GCN: 58 instructions (6 at a quarter of the rate).
fn fuzz_sample(v: vec3f, t: vec3f, alpha: f32, xi: vec2f) -> vec3f {
    let squeezed_v = v - t * ((1.0 - alpha) * dot(t, v));
    let phi = 6.28318531 * xi.x;
    let z = 1.0 - 2.0 * xi.y;
    let r = sqrt(max(1.0 - z * z, 0.0));
    let axis = normalize(squeezed_v);
    let sum = vec3f(r * cos(phi), r * sin(phi), z) + axis;
    // The point opposite to the axis is no direction.
    let m = normalize(select(axis, sum, dot(sum, sum) > 1e-12));
    let h = normalize(m - t * ((1.0 - alpha) * dot(t, m)));
    return h * (2.0 * dot(v, h)) - v;
}

/// Density per steradian of `fuzz_sample`: `D_F(h) / (4 σ_F(v))`.
///
/// Cost on GCN: 27 instructions (2 at a quarter of the rate).
fn fuzz_pdf(u: vec3f, v: vec3f, t: vec3f, alpha: f32) -> f32 {
    return fibre_phase(dot(u, v), dot(t, v), dot(t, u), alpha);
}

/// Probabilities of sampling the layer, the base's specular lobe and its diffuse one, in proportion to the light that
/// each is expected to send; each at least 5 % of the largest, so that a wrong guess only adds noise.
///
/// Cost on GCN: 12 instructions (1 at a quarter of the rate).
fn fuzz_over_base_shares(fuzz: f32, specular: f32, diffuse: f32) -> vec3f {
    let least = 0.05 * max(max(fuzz, max(specular, diffuse)), 1e-6);
    let shares = max(vec3f(fuzz, specular, diffuse), vec3f(least));
    return shares / (shares.x + shares.y + shares.z);
}

/// A light direction for a layer of fibres over GGX and Lambert, distributed as `fuzz_over_base_pdf`; vectors in the
/// frame of the alphas, z along the normal, `shares` as `fuzz_over_base_shares` gives them.
///
/// Cost on GCN: 118 instructions (18 at a quarter of the rate).
fn fuzz_over_base_sample(
    v: vec3f,
    t: vec3f,
    alpha: f32,
    alpha_t: f32,
    alpha_b: f32,
    shares: vec3f,
    xi: vec2f,
) -> vec3f {
    if xi.x < shares.x {
        return fuzz_sample(v, t, alpha, vec2f(xi.x / shares.x, xi.y));
    }
    let rest = xi.x - shares.x;
    if rest < shares.y {
        let h = ggx_vndf_sample(v, alpha_t, alpha_b, vec2f(rest / shares.y, xi.y));
        return h * (2.0 * dot(v, h)) - v;
    }
    // Rounding may take the last number to one.
    let x = saturate((rest - shares.y) / shares.z);
    let phi = 6.28318531 * xi.y;
    let r = sqrt(x);
    return vec3f(r * cos(phi), r * sin(phi), sqrt(1.0 - x));
}

/// Density per steradian of `fuzz_over_base_sample`, over the sphere.
///
/// Cost on GCN: 84 instructions (7 at a quarter of the rate).
fn fuzz_over_base_pdf(
    u: vec3f,
    v: vec3f,
    t: vec3f,
    alpha: f32,
    alpha_t: f32,
    alpha_b: f32,
    shares: vec3f,
) -> f32 {
    let sum = u + v;
    let h = normalize(select(t, sum, dot(sum, sum) > 1e-12));
    let specular = ggx_vndf_pdf(v, h, alpha_t, alpha_b) / max(4.0 * dot(v, h), 1e-12);
    let diffuse = max(u.z, 0.0) * 0.318309886;
    return shares.x * fuzz_pdf(u, v, t, alpha) + shares.y * specular + shares.z * diffuse;
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sggx.wesl, by ./x shaders. Needs: frame, sym

// SGGX matrices: a normal and its anisotropic roughness as one thing that can be averaged.
//
// Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

/// A surface: unit normal, and squared roughness matrix (xx, xy, yy) in the frame of `m_n`.
struct GgxSurface {
    /// Unit normal.
    normal: vec3f,
    /// Squared roughness (xx, xy, yy).
    a: vec3f,
}

/// A distribution of slopes: centre and squared roughness (xx, xy, yy), both dimensionless.
struct SlopeDistribution {
    /// Centre.
    m: vec2f,
    /// Squared roughness (xx, xy, yy).
    a: vec3f,
}

/// `S = M_n [A 0; 0 1] M_n^T` (slide: Our Algorithm, step 1): the SGGX matrix of a GGX surface with unit normal `n`
/// and squared roughness matrix `a` (xx, xy, yy) in the frame of `m_n`.
///
/// Cost on GCN: 51 instructions (1 at a quarter of the rate).
fn sggx_from_ggx(n: vec3f, a: vec3f) -> mat3x3f {
    let m = m_n(n);
    let ax = m[0] * a.x + m[1] * a.y;
    let ay = m[0] * a.y + m[1] * a.z;
    return mat3x3f(
        ax * m[0].x + ay * m[1].x + n * n.x,
        ax * m[0].y + ay * m[1].y + n * n.y,
        ax * m[0].z + ay * m[1].z + n * n.z,
    );
}

/// Area of the microflakes projected along the unit vector `w`: `sqrt(w^T S w)` (Heitz 2015).
///
/// Cost on GCN: 14 instructions (1 at a quarter of the rate).
fn sggx_projected_area(s: mat3x3f, w: vec3f) -> f32 {
    return sqrt(max(sym3_quadratic(s, w), 0.0));
}

/// Distribution of microflake normals at the unit vector `h`, a density per steradian over the sphere:
/// `1 / (π sqrt|S| (h^T S^-1 h)^2)` (Heitz 2015), written as `|S|^(3/2) / (π (h^T adj(S) h)^2)`. `s` must have a
/// positive determinant. Single precision leaves a relative error of 1e-5 over the smallest eigenvalue.
///
/// Cost on GCN: 39 instructions (2 at a quarter of the rate).
fn sggx_d(s: mat3x3f, h: vec3f) -> f32 {
    let det = sym3_det(s);
    let q = sym3_quadratic(sym3_adjugate(s), h);
    return det * sqrt(det) / (3.14159265 * q * q);
}

/// The slope distribution an SGGX matrix with zz > 0 stands for, seen from the z axis: `S / S_zz = [A + m m^T, m;
/// m^T, 1]`. The slopes follow a bivariate Student-t with two degrees of freedom.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
fn slopes_from_sggx(s: mat3x3f) -> SlopeDistribution {
    let inv = 1.0 / s[2].z;
    let m = s[2].xy * inv;
    let a = vec3f(s[0].x, s[0].y, s[1].y) * inv - vec3f(m.x * m.x, m.x * m.y, m.y * m.y);
    return SlopeDistribution(m, a);
}

/// The SGGX matrix with zz = 1 of a slope distribution; the inverse of `slopes_from_sggx`.
///
/// Cost on GCN: 3 instructions.
fn sggx_from_slopes(m: vec2f, a: vec3f) -> mat3x3f {
    let xy = a.y + m.x * m.y;
    return mat3x3f(vec3f(a.x + m.x * m.x, xy, m.x), vec3f(xy, a.z + m.y * m.y, m.y), vec3f(m, 1.0));
}

/// The talk's power iteration (slide: Our Algorithm, step 3): `steps` times `n = S n / |S n|` from `start`. The
/// tangent of the error shrinks by the ratio of the two largest eigenvalues a step; in V grooves steeper than 45° it
/// leaves the surface for its walls. `sggx_principal_axis` has neither fault.
///
/// Cost on GCN: 34 instructions (2 at a quarter of the rate), one round of its loop.
fn sggx_power_iteration(s: mat3x3f, start: vec3f, steps: u32) -> vec3f {
    let scale = 1.0 / max(sym3_trace(s), 1e-30);
    var n = start;
    for (var i = 0u; i < steps; i++) {
        let next = s * n * scale;
        let length_squared = dot(next, next);
        n = select(n, next * inverseSqrt(length_squared), length_squared > 0.0);
    }
    return n;
}

/// Squared overlap with the eigenvector of `l`, from the moments m' B m and |B m|² of a deviator of unit size.
///
/// Cost on GCN: 7 instructions (1 at a quarter of the rate).
fn sggx_overlap(l: f32, moment: f32, moment_sqr: f32) -> f32 {
    return (moment_sqr + l * moment + l * l - 3.0) / (3.0 * l * l - 3.0);
}

/// The unit eigenvector of `s` with the largest overlap with the unit vector `start`, signed to agree with it.
/// Started at the mean normal of a footprint it finds the filtered normal, also where the largest eigenvalue is
/// another one (V grooves steeper than 45°). Where eigenvalues coincide, to 0.1 % of their spread, it is the
/// projection of `start` on their space; `start` itself if `s` is a multiple of the identity. No trigonometry.
///
/// Cost on GCN: 204 instructions (10 at a quarter of the rate).
fn sggx_principal_axis(s: mat3x3f, start: vec3f) -> vec3f {
    let sqrt_three = 1.7320508;
    // Sine under which two eigenvalues are one: rounding of r alone makes 3e-4.
    let coincidence = 1e-3;

    // The deviator B of unit size and det B >= 0: its eigenvalues are 2 cos(φ), 2 cos(φ ± 2π/3) with 3φ = acos(r),
    // the first at least sqrt(3) away from the others.
    let deviator = sym3_add_diagonal(sym3_scale(s, 1.0 / sym3_trace(s)), -1.0 / 3.0);
    let squares = dot(deviator[0], deviator[0]) + dot(deviator[1], deviator[1]) + dot(deviator[2], deviator[2]);
    let size = sqrt(squares * (1.0 / 6.0));
    let unit = sym3_scale(deviator, 1.0 / size);
    let r = 0.5 * sym3_det(unit);
    let b = sym3_scale(unit, select(1.0, -1.0, r < 0.0));

    // sin(2/3 asin(t)) with t = sin(3φ/2) <= sqrt(1/2) by four terms of its series, within 0.1 %: the refinement
    // below cubes the error.
    let t_sqr = max(0.5 - 0.5 * abs(r), 0.0);
    let series = 1.0 + t_sqr * (5.0 / 54.0 + t_sqr * (77.0 / 1944.0 + t_sqr * (2431.0 / 104976.0)));
    let sine = sqrt(t_sqr) * (2.0 / 3.0) * series;
    let cosine = sqrt(1.0 - sine * sine);
    let l_first = 2.0 * cosine;
    let l_second = sqrt_three * sine - cosine;
    let l_third = -sqrt_three * sine - cosine;

    // Squared overlaps with the three eigenvectors.
    let bn = b * start;
    let moment = dot(start, bn);
    let moment_sqr = dot(bn, bn);
    let w_first = saturate(sggx_overlap(l_first, moment, moment_sqr));
    let coincident = sine < coincidence;
    let rest = 1.0 - w_first;
    let w_second = select(min(max(sggx_overlap(l_second, moment, moment_sqr), 0.0), rest), rest, coincident);
    let w_third = 1.0 - w_first - w_second;

    // Project the two others away, (B - l I)(B - l' I), by Cayley–Hamilton.
    let is_first = w_first >= max(w_second, w_third);
    let p = bn - start * select(l_first, l_second, is_first);
    let other = select(l_second, l_third, is_first || w_second >= w_third);
    let q = b * p - p * other;
    let projected = normalize(select(q, p, coincident && !is_first));

    // One step of Rayleigh quotient iteration, adj(B - (n^T B n) I) n.
    let refined = sym3_adjugate(sym3_add_diagonal(b, -sym3_quadratic(b, projected))) * projected;
    let refined_length = length(refined);
    // The length is the product of the distances to both other eigenvalues, 6 sqrt(3) sine for a close one.
    let far = refined_length > 6.0 * sqrt_three * coincidence;
    let axis = select(projected, refined * (1.0 / refined_length), far);

    // Rounding of S, 1e-7 of its trace, is all there is of a smaller deviator.
    let n = select(start, axis, size > 3e-6);
    return select(n, -n, dot(n, start) < 0.0);
}

/// `ggx_from_sggx` before the clamp of the roughness.
///
/// Cost on GCN: 268 instructions (12 at a quarter of the rate).
fn ggx_from_sggx_unclamped(s: mat3x3f, mean_normal: vec3f) -> GgxSurface {
    let axis = sggx_principal_axis(s, mean_normal);
    let n = select(axis, -axis, axis.z < 0.0);
    let m = m_n(n);
    let sx = s * m[0];
    let sy = s * m[1];
    let inv = 1.0 / max(sym3_quadratic(s, n), 1e-30);
    return GgxSurface(n, vec3f(dot(m[0], sx), dot(m[0], sy), dot(m[1], sy)) * inv);
}

/// Normal and squared roughness matrix of a filtered SGGX matrix (slide: Our Algorithm, step 3). `mean_normal`, a unit
/// vector, picks the eigenvector as in `sggx_principal_axis`. The normal returned has z ≥ 0, eigenvalues of the
/// roughness lie in [0, 1]: a microsurface rougher than alpha = 1 is clamped, because no texture can hold it.
///
/// Cost on GCN: 321 instructions (17 at a quarter of the rate).
fn ggx_from_sggx(s: mat3x3f, mean_normal: vec3f) -> GgxSurface {
    let surface = ggx_from_sggx_unclamped(s, mean_normal);
    return GgxSurface(surface.normal, sym2_clamp_eigen(surface.a, 0.0, 1.0));
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/skin_curvature.wesl, by ./x shaders. Needs: sym

// The curvature tensor of a vertex: four bytes, and the curvature towards a light.
//
// Curvature is 1/mm, convex is positive. A tensor is (xx, xy, yy) in the frame of the mesh's tangent and bitangent.
// Four bytes are a normalised vertex attribute; interpolate it as it is and decode in the pixel: means of codes
// decode to tensors without negative curvature.

/// The largest curvature that four bytes hold where nothing else is said, 1/mm: a radius of 2 mm.
const CURVATURE_RANGE: f32 = 0.5;

/// Four numbers from 0 to 1 for a positive semi-definite `tensor` and a `mean` curvature, both up to `range`:
/// `sqrt(xx), rho, sqrt(yy), sqrt(mean)`, where `rho = xy / sqrt(xx yy)` is stored as `(127 rho + 128) / 255`, so that a
/// byte holds zero exactly.
///
/// Cost on GCN: 19 instructions (6 at a quarter of the rate).
fn curvature_encode(tensor: vec3f, mean: f32, range: f32) -> vec4f {
    let inverse = 1.0 / range;
    let xx = max(tensor.x, 0.0);
    let yy = max(tensor.z, 0.0);
    let product = sqrt(xx * yy);
    let rho = select(0.0, clamp(tensor.y / product, -1.0, 1.0), product > 0.0);
    let roots = sqrt(saturate(vec3f(xx, yy, mean) * inverse));
    return vec4f(roots.x, (127.0 * rho + 128.0) / 255.0, roots.y, roots.z);
}

/// Tensor (xyz) and mean curvature (w), 1/mm, from the four numbers of `curvature_encode`.
///
/// Cost on GCN: 10 instructions.
fn curvature_decode(texel: vec4f, range: f32) -> vec4f {
    let rho = texel.y * 2.0078740157480315 - 1.0078740157480315;
    let a = range * texel.x;
    let b = texel.z;
    return vec4f(a * texel.x, a * b * rho, range * b * b, range * texel.w * texel.w);
}

/// The curvature towards a light, 1/mm (slide: Skin Shading | Implementation, CurvatureFromLight): the tensor along the
/// light's tangent and bitangent components `u_tb`, not normalised. It is the directional curvature times the squared
/// sine between normal and light: right at the terminator, less towards the light, where the table hardly varies.
///
/// Cost on GCN: 7 instructions.
fn curvature_from_light(tensor: vec3f, u_tb: vec2f) -> f32 {
    return sym2_quadratic(tensor, u_tb);
}

/// The curvature in the direction of the light's projection on the tangent plane, 1/mm: `curvature_from_light` over the
/// squared length of `u_tb`. Where the light stands in the normal there is no direction, and within some 1e-3 rad of it
/// the result goes over to the mean.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
fn curvature_from_light_normalized(tensor: vec3f, u_tb: vec2f) -> f32 {
    return (sym2_quadratic(tensor, u_tb) + 5e-7 * sym2_trace(tensor)) / (dot(u_tb, u_tb) + 1e-6);
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/skin_lighting.wesl, by ./x shaders. Needs: ggx, sh

// Light on skin: where to look into the tables, ambient light, gloss, and normals by channel.
//
// - Penner, Borshukov. Pre-Integrated Skin Shading. GPU Pro 2, 2011.
//
// A punctual light: `color += base / π * irradiance * table(skin_lut_uv(n·u, curvature, 1 / range)).rgb`, where n·u is
// not clamped, irradiance is the light's at normal incidence, and curvature is `curvature_from_light` of the light's
// tangent and bitangent components. Translucency is yours to add there: a term for light from behind belongs to this sum
// and needs nothing else from these functions.

/// How far the normals of red, green and blue turn from the normal map's towards the mesh's (Penner 2011, section 1.4,
/// who leaves the numbers to the eye): the share of each channel's light that leaves farther than a pore is wide.
const SKIN_NORMAL_BLUR: vec3f = vec3f(0.667, 0.209, 0.007);

/// Where the table of punctual light has its value for `n_u`, the unclamped cosine between normal and light, and a
/// curvature: x from the dark to the lit side, y from flat to `1 / inverse_range`. Sample with linear filtering and
/// clamped edges.
///
/// Cost on GCN: 2 instructions.
fn skin_lut_uv(n_u: f32, curvature: f32, inverse_range: f32) -> vec2f {
    return vec2f(0.5 * n_u + 0.5, curvature * inverse_range);
}

/// Irradiance of skin under ambient light: `sh_irradiance` with bands 1 and 2 multiplied, for each channel, by what the
/// profile leaves of them at the mean curvature. Clamp what rings below zero.
///
/// Cost on GCN: 53 instructions.
fn skin_irradiance(radiance: array<vec3f, 9>, normal: vec3f, h_one: vec3f, h_two: vec3f) -> vec3f {
    let basis = sh_basis(normal);
    let one = radiance[1] * basis[1] + radiance[2] * basis[2] + radiance[3] * basis[3];
    let two = radiance[4] * basis[4] + radiance[5] * basis[5] + radiance[6] * basis[6] + radiance[7] * basis[7]
        + radiance[8] * basis[8];
    return 3.14159265 * basis[0] * radiance[0] + 2.09439510 * h_one * one + 0.78539816 * h_two * two;
}

/// The gloss of skin, without Fresnel's term: distribution times visibility of two GGX lobes, `alpha_one` with the weight
/// `1 - share` and `alpha_two` with `share`. One lobe is too tight at its foot or too wide at its top.
///
/// Cost on GCN: 40 instructions (8 at a quarter of the rate).
fn skin_specular(n_h: f32, n_u: f32, n_v: f32, alpha_one: f32, alpha_two: f32, share: f32) -> f32 {
    let one = ggx_d(n_h, alpha_one) * smith_v(n_u, n_v, alpha_one);
    let two = ggx_d(n_h, alpha_two) * smith_v(n_u, n_v, alpha_two);
    return one + share * (two - one);
}

/// The normal of one channel: from the normal map's `n` towards the mesh's `n_mesh` by `blur`, 0 to 1
/// (SKIN_NORMAL_BLUR). Gloss keeps `n`. They are less than 180° apart.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
fn skin_normal(n: vec3f, n_mesh: vec3f, blur: f32) -> vec3f {
    return normalize(n + blur * (n_mesh - n));
}
