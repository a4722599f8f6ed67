// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/beckmann.wesl, by ./x shaders. Needs: nothing else

// The Beckmann distribution and LEAN mapping, to compare with.
//
// Beckmann, Spizzichino. The Scattering of Electromagnetic Waves from Rough Surfaces. 1963.
// Olano, Baker. LEAN Mapping. I3D 2010.

#ifndef KINRAN_BECKMANN_HLSL
#define KINRAN_BECKMANN_HLSL

/// Beckmann's sigma, the standard deviation of slopes, that stands for a GGX alpha (slide: LEAN Mapping):
/// `alpha / sqrt(2)`.
///
/// Cost on GCN: 1 instruction.
float sigma_from_alpha(float alpha)
{
    return alpha * 0.70710677;
}

/// The inverse of `sigma_from_alpha`.
///
/// Cost on GCN: 1 instruction.
float alpha_from_sigma(float sigma)
{
    return sigma * 1.4142135;
}

/// Distribution of microfacet normals per steradian with slope deviations `sigma_t`, `sigma_b` along x and y
/// (Beckmann 1963): `exp(-(x²/σt² + y²/σb²) / (2 z²)) / (2π σt σb z⁴)`, zero below the horizon.
///
/// Cost on GCN: 20 instructions (5 at a quarter of the rate).
float beckmann_aniso_d(float3 h, float sigma_t, float sigma_b)
{
    if (h.z <= 1e-6) {
        return 0.0;
    }
    float z_sqr = h.z * h.z;
    float x = h.x / sigma_t;
    float y = h.y / sigma_b;
    return exp(((-0.5 * ((x * x) + (y * y))) / z_sqr)) / ((((6.2831855 * sigma_t) * sigma_b) * z_sqr) * z_sqr);
}

/// Slope towards which a unit normal with z ≥ 0 leans: `n.xy / n.z`, a million at most.
///
/// Cost on GCN: 4 instructions (1 at a quarter of the rate).
float2 slope_from_normal(float3 n)
{
    return n.xy / (max(n.z, 1e-6)).xx;
}

/// Unit normal of a slope.
///
/// Cost on GCN: 5 instructions (1 at a quarter of the rate).
float3 normal_from_slope(float2 slope)
{
    return float3(slope, 1.0) * rsqrt((1.0 + dot(slope, slope)));
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_hsv.wesl, by ./x shaders. Needs: nothing else

// Hue, saturation and value.

#ifndef KINRAN_DETAIL_HSV_HLSL
#define KINRAN_DETAIL_HSV_HLSL

/// A linear colour in [0, 1]³ with its hue turned by `shift.x` turns, its HSV saturation multiplied by `shift.y` and its
/// value by `shift.z`; `(0, 1, 1)` leaves it as it is. Both are clamped to 1 (Smith. Color gamut transform pairs. 1978).
///
/// Cost on GCN: 42 instructions (2 at a quarter of the rate).
float3 hsv_shift(float3 color, float3 shift)
{
    float value = max(color.x, max(color.y, color.z));
    float chroma = value - min(color.x, min(color.y, color.z));
    float scale = 1.0 / max(chroma, 1e-20);
    float3 differences = (color.yzx - color.zxy) * scale;
    float green_or_blue = (color.y >= value) ? (2.0 + differences.y) : (4.0 + differences.z);
    float sector = (color.x >= value) ? differences.x : green_or_blue;
    float hue = (sector * 0.16666667) + shift.x;
    float saturation = saturate(((chroma / max(value, 1e-20)) * shift.y));
    float3 k = 6.0 * frac(((hue).xxx + float3(0.0, 0.6666667, 0.33333334)));
    float3 weight = saturate((abs((k - (3.0).xxx)) - (1.0).xxx));
    return saturate((value * shift.z)) * ((1.0).xxx + ((weight - (1.0).xxx) * saturation));
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_normal.wesl, by ./x shaders. Needs: nothing else

// Normals laid over each other.

#ifndef KINRAN_DETAIL_NORMAL_HLSL
#define KINRAN_DETAIL_NORMAL_HLSL

/// Reoriented normal mapping: the unit normal `detail` in the frame of the unit normal `base`, both with z ≥ 0; equals
/// `m_n(base) * detail` (slide: Detail Maps; Barré-Brisebois and Hill. Blending in Detail. 2012). In detail mapping
/// the synthesized normal is the base.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
float3 rnm(float3 base, float3 detail)
{
    float3 t = base + float3(0.0, 0.0, 1.0);
    float3 u = detail * float3(-1.0, -1.0, 1.0);
    return (t * (dot(t, u) / t.z)) - u;
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_over.wesl, by ./x shaders. Needs: nothing else

// Alpha blending, for aniso texels.

#ifndef KINRAN_DETAIL_OVER_HLSL
#define KINRAN_DETAIL_OVER_HLSL

/// The texel `detail` over the texel `s` with opacity `alpha` in [0, 1] (slide: Detail Maps, "aniso maps blended with
/// regular alpha blending"). Every mixture of aniso texels decodes to a positive semi-definite matrix.
///
/// Cost on GCN: 6 instructions.
float3 detail_over(float3 s, float3 detail, float alpha)
{
    return s + ((detail - s) * alpha);
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_overlay.wesl, by ./x shaders. Needs: nothing else

// Overlay and the talk's smooth overlay: a synthesized value `s` lays itself over a detail `d` so that every target can
// be reached (slides: Detail Maps). Both are solved for `s` when textures are baked.
//
// Colour is linear light: sample the tile with sRGB decoding, the synthesized map without.

#ifndef KINRAN_DETAIL_OVERLAY_HLSL
#define KINRAN_DETAIL_OVERLAY_HLSL

/// Overlay of a detail `d` by a synthesized value `s`, both in [0, 1] (slide: Detail Maps | Our Approach):
/// `2sd` below s = 1/2, `1 - 2(1-s)(1-d)` from there on.
///
/// Cost on GCN: 7 instructions.
float overlay(float s, float d)
{
    return (s < 0.5) ? ((2.0 * s) * d) : (1.0 - ((2.0 * (1.0 - s)) * (1.0 - d)));
}

/// `overlay` of each channel.
///
/// Cost on GCN: 21 instructions.
float3 overlay_color(float3 s, float3 d)
{
    const float _e4 = overlay(s.x, d.x);
    const float _e7 = overlay(s.y, d.y);
    const float _e10 = overlay(s.z, d.z);
    return float3(_e4, _e7, _e10);
}

/// The talk's smooth overlay, finer near `t = d` where a dark detail is brightened (slide: Detail Maps | Blending): as
/// `overlay`, but `lerp(2sd, s, (2s-1)²)` where s ≥ 1/2 and d < 1/2.
///
/// Cost on GCN: 13 instructions.
float smooth_overlay(float s, float d)
{
    float x = (2.0 * s) - 1.0;
    float low = (2.0 * s) * d;
    float bright = 1.0 - ((2.0 * (1.0 - s)) * (1.0 - d));
    float dark = low + (((s - low) * x) * x);
    return (s < 0.5) ? low : ((d < 0.5) ? dark : bright);
}

/// `smooth_overlay` of each channel.
///
/// Cost on GCN: 39 instructions.
float3 smooth_overlay_color(float3 s, float3 d)
{
    const float _e4 = smooth_overlay(s.x, d.x);
    const float _e7 = smooth_overlay(s.y, d.y);
    const float _e10 = smooth_overlay(s.z, d.z);
    return float3(_e4, _e7, _e10);
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/frame.wesl, by ./x shaders. Needs: nothing else

// The frame in which an anisotropic texel lives.

#ifndef KINRAN_FRAME_HLSL
#define KINRAN_FRAME_HLSL

/// The shortest-arc rotation that takes z = (0, 0, 1) to the unit vector `n` (slide: Our Algorithm, step 1).
///
/// Its first two columns are the tangent and bitangent of every aniso texel; a Gram–Schmidt tangent differs from them
/// by 0.44° at a tilt of 10° and 18° at 60°, so decode with these. Orthonormal to 3e-7 for n.z ≥ 0; where `1 + n.z`
/// is below 1e-6 the half turn about x is returned, whose third column is −z.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
float3x3 m_n(float3 n)
{
    float d = 1.0 + n.z;
    if (d < 1e-6) {
        return float3x3(float3(1.0, 0.0, 0.0), float3(0.0, -1.0, 0.0), float3(0.0, 0.0, -1.0));
    }
    float a = 1.0 / d;
    float xy = (-(n.x) * n.y) * a;
    return float3x3(float3((n.z + ((n.y * n.y) * a)), xy, -(n.x)), float3(xy, (n.z + ((n.x * n.x) * a)), -(n.y)), n);
}

/// A unit normal from the xy of a normal map, each in [−1, 1]. Where x² + y² exceeds one, as compression and
/// filtering make it do, the normal lies on the horizon in the same direction.
///
/// Cost on GCN: 8 instructions (2 at a quarter of the rate).
float3 normal_from_xy(float x, float y)
{
    float xy_squared = (x * x) + (y * y);
    float scale = rsqrt(max(xy_squared, 1.0));
    return float3((x * scale), (y * scale), sqrt(max((1.0 - xy_squared), 0.0)));
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_p_s.wesl, by ./x shaders. Needs: nothing else

// P_s: the share of scattered light that a fibre sends down to the base.
//
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

#ifndef KINRAN_FUZZ_P_S_HLSL
#define KINRAN_FUZZ_P_S_HLSL

/// A step of Laguerre's iteration for the largest root of `l³ + square l² + linear l + constant`, whose roots are all
/// real.
///
/// Cost on GCN: 18 instructions (2 at a quarter of the rate).
float fibre_p_s_step(float l, float constant, float linear_, float square)
{
    float value = ((((l + square) * l) + linear_) * l) + constant;
    float slope = (((3.0 * l) + (2.0 * square)) * l) + linear_;
    float bend = (6.0 * l) + (2.0 * square);
    float root = sqrt(max((((4.0 * slope) * slope) - ((6.0 * value) * bend)), 0.0));
    return l - ((3.0 * value) / max((slope + root), 1e-20));
}

/// P_s of SGGX fibres, exactly (slide: Base Layer, "no analytical expression"): one minus the integral of
/// `fibre_phase(u, v)` over the `v` above the horizon, for a light at cosines `n_u` ≥ 0 to the normal and `t_u` to the
/// fibres, whose own cosine to the normal is `t_n`. It is the form factor of an elliptic cone: with the positive root λ
/// of `χ = λ³ + (α² c + 2 k t_u t_n) λ² - (α² + k (1 - t_u² - t_n²)) λ - α² c`, `c = n_u`, `k = 1 - α²`,
/// `1 - P_s = λ sqrt((λ + c) (λ + α² c/σ²)) / χ'(λ)`. Laguerre's iteration from 1 falls on λ.
///
/// Cost on GCN: 92 instructions (11 at a quarter of the rate).
float fibre_p_s(float n_u, float t_u, float t_n, float alpha)
{
    float alpha_sqr = alpha * alpha;
    float k = 1.0 - alpha_sqr;
    float constant = -(alpha_sqr) * n_u;
    float linear_1 = -((alpha_sqr + (k * ((1.0 - (t_u * t_u)) - (t_n * t_n)))));
    float square = (alpha_sqr * n_u) + (((2.0 * k) * t_u) * t_n);
    const float _e24 = fibre_p_s_step(1.0, constant, linear_1, square);
    const float _e25 = fibre_p_s_step(_e24, constant, linear_1, square);
    const float _e26 = fibre_p_s_step(_e25, constant, linear_1, square);
    const float _e27 = fibre_p_s_step(_e26, constant, linear_1, square);
    float slope = (((3.0 * _e27) + (2.0 * square)) * _e27) + linear_1;
    float area_sqr = 1.0 - ((k * t_u) * t_u);
    float upward = (_e27 * sqrt(max(((_e27 + n_u) * (_e27 + ((alpha_sqr * n_u) / area_sqr))), 0.0))) / max(slope, 1e-20);
    return saturate((1.0 - upward));
}

/// P_s by the talk's six coefficients (slide: Base Layer), fitted for one tilt and one spread: `c_0 + c_1 n_u + c_2 t_u +
/// c_3 n_u² + c_4 n_u t_u + c_5 t_u²`, clamped to [0, 1]. `kinran fit fuzz` prints them with their error.
///
/// Cost on GCN: 5 instructions.
float fuzz_p_s(float coefficients[6], float n_u, float t_u)
{
    float across = n_u * ((coefficients[1] + (coefficients[3] * n_u)) + (coefficients[4] * t_u));
    return saturate(((coefficients[0] + across) + (t_u * (coefficients[2] + (coefficients[5] * t_u)))));
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_phase.wesl, by ./x shaders. Needs: nothing else

// How a fibre scatters: the SGGX phase function of specular fibres, and Schlick's for velvet.
//
// Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.
// Schlick. An Inexpensive BRDF Model for Physically-based Rendering. Eurographics 1994.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

#ifndef KINRAN_FUZZ_PHASE_HLSL
#define KINRAN_FUZZ_PHASE_HLSL

/// Smallest roughness of fibres to shade with.
static const float FUZZ_ALPHA_MIN = 0.1;

/// Roughness of fibres from their spread, 0 (combed) to 1 (in all directions): its root, at least FUZZ_ALPHA_MIN.
///
/// Cost on GCN: 2 instructions (1 at a quarter of the rate).
float fuzz_alpha(float spread)
{
    return sqrt(max(spread, 0.010000001));
}

/// Schlick's k of the velvet phase from the fibres' spread: `1 - spread`, at most 0.99.
///
/// Cost on GCN: 2 instructions.
float velvet_k(float spread)
{
    return 1.0 - max(spread, 0.010000001);
}

/// Direction of fibres in a frame with z along the normal: `tilt` away from the normal (0 upright, π/2 lying),
/// `azimuth` counter-clockwise from x, both in radians.
///
/// Cost on GCN: 10 instructions (4 at a quarter of the rate).
float3 fibre_direction(float tilt, float azimuth)
{
    float sine = sin(tilt);
    return float3((sine * cos(azimuth)), (sine * sin(azimuth)), cos(tilt));
}

/// Distribution of the fibres' microflake normals at cosine `t_h` to their direction, per steradian over the sphere
/// (slide: Phase Function, `D_F`): `α³ / (π (t_h² (1 - α²) + α²)²)`.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
float fibre_d(float t_h, float alpha)
{
    float alpha_sqr = alpha * alpha;
    float q = ((t_h * t_h) * (1.0 - alpha_sqr)) + alpha_sqr;
    return (alpha_sqr * alpha) / ((3.1415927 * q) * q);
}

/// Projected area of the fibres' microflakes along a direction at cosine `t_w` to them (slide: Phase Function, `σ_F`):
/// `sqrt(1 - t_w² (1 - α²))`.
///
/// Cost on GCN: 4 instructions (1 at a quarter of the rate).
float fibre_projected_area(float t_w, float alpha)
{
    return sqrt((1.0 - ((t_w * t_w) * (1.0 - (alpha * alpha)))));
}

/// The fibres' phase function per steradian (slide: Phase Function, `p_F`): `D_F(h) / (4 σ_F(u))` for light from `u`
/// and a view along `v`, from `u_v = u·v`, `t_u = t·u` and `t_v = t·v`. Not symmetric.
///
/// Cost on GCN: 18 instructions (2 at a quarter of the rate).
float fibre_phase(float u_v, float t_u, float t_v, float alpha)
{
    float w = 2.000002 + (2.0 * u_v);
    float s = t_u + t_v;
    float alpha_sqr = alpha * alpha;
    float k = 1.0 - alpha_sqr;
    float m = ((s * s) * k) + (alpha_sqr * w);
    return ((((alpha_sqr * alpha) * w) * w) * rsqrt((1.0 - ((t_u * t_u) * k)))) / ((12.566371 * m) * m);
}

/// Normalisation r(k) of the velvet phase: `sqrt(1-k) / (1 + (2 sqrt(2) - 1) k)`, for k in [0, 0.99]. With it the phase
/// scatters at most what arrives, and 0.88 of it at least for light across the fibres.
///
/// Cost on GCN: 5 instructions (2 at a quarter of the rate).
float velvet_normalization(float k)
{
    return sqrt((1.0 - k)) / (1.0 + (1.8284271 * k));
}

/// The velvet phase per steradian (slide: Velvet Scattering, `p_V`): `r(k) (1-k²) / (4π (1 - k sin(t, h))²)`, arguments
/// as in `fibre_phase`, k in [0, 0.99] as `velvet_k` gives it. The slide's k has the other sign, which scatters forward.
///
/// Cost on GCN: 19 instructions (5 at a quarter of the rate).
float velvet_phase(float u_v, float t_u, float t_v, float k)
{
    float w = 2.000002 + (2.0 * u_v);
    float s = t_u + t_v;
    float q = 1.0 - (k * sqrt(max((1.0 - ((s * s) / w)), 0.0)));
    const float _e19 = velvet_normalization(k);
    return (_e19 * (1.0 - (k * k))) / ((12.566371 * q) * q);
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_layer.wesl, by ./x shaders. Needs: fuzz_phase

// The layer of fibres: what it scatters to the viewer and what it leaves of the base.
//
// Koenderink, Pont. The Secret of Velvety Skin. Machine Vision and Applications 2003.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

#ifndef KINRAN_FUZZ_LAYER_HLSL
#define KINRAN_FUZZ_LAYER_HLSL


/// What the layer's lobe needs of a view, once a pixel.
struct FuzzView {
    float n_v;
    float t_v;
    float escaped;
    float exponent;
    float squeeze;
    float root;
    float root_along;
};

/// What the layer makes of a light.
struct FuzzLight {
    float lobe;
    float penetrated;
};

/// Cosines below this one, of light or view and normal, count as it: a layer of density 1e-4 lets nothing pass there, and
/// quotients stay finite at the horizon.
static const float FUZZ_COSINE_MIN = 1e-6;

/// Share of light that passes the layer along a direction at cosine `n_w` ≥ 0 to the normal without meeting a fibre:
/// `e^(-d / n_w)`. Towards the light it is the talk's `P_p`, towards the viewer `P_e`.
///
/// Cost on GCN: 5 instructions (2 at a quarter of the rate).
float fuzz_passage(float density, float n_w)
{
    return exp2(((-1.442695 * density) / max(n_w, FUZZ_COSINE_MIN)));
}

/// The layer's BRDF for a fibre albedo of one (slide: New Model): `p (1 - passed) / (n_u + n_v)`, where `passed` is
/// `fuzz_passage` along the light times that along the view, and `phase` the phase function; for cosines ≥ 0. Where both
/// vanish the BRDF is infinite, and this is its value at FUZZ_COSINE_MIN.
///
/// Cost on GCN: 6 instructions (1 at a quarter of the rate).
float fuzz_layer(float phase, float passed, float n_u, float n_v)
{
    return (phase * (1.0 - passed)) / max((n_u + n_v), FUZZ_COSINE_MIN);
}

/// BRDF of a layer of SGGX fibres for an albedo of one, per steradian, zero below the horizon; `u` light, `v` view and
/// `t` fibre direction are unit vectors in a frame with z along the normal. Not reciprocal: `f(u, v) σ(u) = f(v, u)
/// σ(v)`.
///
/// Cost on GCN: 44 instructions (6 at a quarter of the rate).
float fuzz_brdf(float3 u, float3 v, float3 t, float density, float alpha)
{
    const float _e6 = fuzz_passage(density, u.z);
    const float _e8 = fuzz_passage(density, v.z);
    float passed = _e6 * _e8;
    const float _e13 = fibre_phase(dot(u, v), dot(t, u), dot(t, v), alpha);
    const float _e16 = fuzz_layer(_e13, passed, u.z, v.z);
    return (min(u.z, v.z) > 0.0) ? _e16 : 0.0;
}

/// `fuzz_brdf` with the velvet phase of asymmetry `k`; reciprocal.
///
/// Cost on GCN: 45 instructions (9 at a quarter of the rate).
float fuzz_velvet_brdf(float3 u, float3 v, float3 t, float density, float k)
{
    const float _e6 = fuzz_passage(density, u.z);
    const float _e8 = fuzz_passage(density, v.z);
    float passed = _e6 * _e8;
    const float _e13 = velvet_phase(dot(u, v), dot(t, u), dot(t, v), k);
    const float _e16 = fuzz_layer(_e13, passed, u.z, v.z);
    return (min(u.z, v.z) > 0.0) ? _e16 : 0.0;
}

/// BRDF of a layer whose extinction follows the fibres' projected area, as in a true microflake volume:
/// `D/4 (1 - e^(-d (σ_u/n_u + σ_v/n_v))) / (σ_v n_u + σ_u n_v)`. Reciprocal.
///
/// Cost on GCN: 54 instructions (8 at a quarter of the rate).
float fuzz_reciprocal_brdf(float3 u, float3 v, float3 t, float density, float alpha)
{
    float3 h = normalize((u + v));
    const float _e8 = fibre_projected_area(dot(t, u), alpha);
    const float _e10 = fibre_projected_area(dot(t, v), alpha);
    const float _e13 = fuzz_passage((density * _e8), u.z);
    const float _e16 = fuzz_passage((density * _e10), v.z);
    float passed = _e13 * _e16;
    const float _e19 = fibre_d(dot(t, h), alpha);
    float value = ((0.25 * _e19) * (1.0 - passed)) / ((_e10 * u.z) + (_e8 * v.z));
    return (min(u.z, v.z) > 0.0) ? value : 0.0;
}

#ifndef KINRAN_CONSTRUCTFUZZVIEW_HLSL
#define KINRAN_CONSTRUCTFUZZVIEW_HLSL
FuzzView ConstructFuzzView(float arg0, float arg1, float arg2, float arg3, float arg4, float arg5, float arg6) {
    FuzzView ret = (FuzzView)0;
    ret.n_v = arg0;
    ret.t_v = arg1;
    ret.escaped = arg2;
    ret.exponent = arg3;
    ret.squeeze = arg4;
    ret.root = arg5;
    ret.root_along = arg6;
    return ret;
}
#endif

/// Prepares `fuzz_light` for a view at cosine `n_v` ≥ 0 to the normal and `t_v` to the fibres.
///
/// Cost on GCN: 13 instructions (3 at a quarter of the rate).
FuzzView fuzz_view(float n_v, float t_v, float density, float alpha)
{
    float exponent = -1.442695 * max(density, 1e-20);
    float n = max(n_v, FUZZ_COSINE_MIN);
    float alpha_sqr = alpha * alpha;
    float k = 1.0 - alpha_sqr;
    float root = 157.91367 * alpha_sqr;
    const FuzzView fuzzview = ConstructFuzzView(n, t_v, exp2((exponent / n)), exponent, ((0.5 * k) / alpha_sqr), root, (root * k));
    return fuzzview;
}

#ifndef KINRAN_CONSTRUCTFUZZLIGHT_HLSL
#define KINRAN_CONSTRUCTFUZZLIGHT_HLSL
FuzzLight ConstructFuzzLight(float arg0, float arg1) {
    FuzzLight ret = (FuzzLight)0;
    ret.lobe = arg0;
    ret.penetrated = arg1;
    return ret;
}
#endif

/// Lobe and penetration for a light at cosines `n_u` ≥ 0 to the normal, `t_u` to the fibres and `u_v` to the view:
/// `fuzz_brdf` with one exponential for both and all that is known of the view drawn together. The cosines are the same
/// in every frame.
///
/// Cost on GCN: 19 instructions (4 at a quarter of the rate).
FuzzLight fuzz_light(FuzzView view, float n_u, float t_u, float u_v)
{
    float penetrated = exp2((view.exponent / n_u));
    float scattered = 1.0 - (penetrated * view.escaped);
    float w = 1.000001 + u_v;
    float s = t_u + view.t_v;
    float m = ((s * s) * view.squeeze) + w;
    float over_area = rsqrt((view.root - ((t_u * t_u) * view.root_along)));
    const FuzzLight fuzzlight = ConstructFuzzLight(((((w * w) * scattered) * over_area) / ((m * m) * (n_u + view.n_v))), penetrated);
    return fuzzlight;
}

/// Factor on the base's BRDF (slide: Base Layer, `c_atten`): `(P_p + c_f (1 - P_p) P_s) P_e`, for the share `penetrated`
/// that reaches the base, `escaped` that leaves it towards the viewer, and `downward` (P_s) of the scattered light that
/// goes down. With `downward` = 0 it is the talk's cheaper variant.
///
/// Cost on GCN: 8 instructions.
float3 fuzz_attenuation(float penetrated, float escaped, float downward, float3 fibre_color)
{
    float scattered = downward - (penetrated * downward);
    return ((penetrated * escaped)).xxx + ((fibre_color * escaped) * scattered);
}

/// The normal for the layer, between the normal-mapped `n` and the mesh's `vertex_normal` (slide: Deferred):
/// `smoothness` 0 keeps `n`, 1 takes the mesh's. They are less than 180° apart.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
float3 fuzz_smooth_normal(float3 n, float3 vertex_normal, float smoothness)
{
    return normalize((n + ((vertex_normal - n) * smoothness)));
}

#endif

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

#ifndef KINRAN_FUZZ_AMBIENT_HLSL
#define KINRAN_FUZZ_AMBIENT_HLSL


/// Nodes of the ambient table along each of its sides, the first and the last at the ends of their ranges.
static const uint FUZZ_TABLE_SIZE = 48u;

/// Fibres of a smaller alpha are combed: six coefficients miss P_s by more than 0.09 and eight the ambient light by more
/// than 14 %. `fibre_p_s` and the table take their places.
static const float FUZZ_COMBED_ALPHA = 0.3;

/// Mean over the hemisphere of the layer's BRDF times cosine over phase (slide: Ambient Lighting, `G~`), for a view at
/// cosine `n_v`: `F (1 - e^-y) (1 - y e^-y / 10)` with `F = 1 - n_v ln(1 + 1/n_v)` and `y = d / (n_v F)`. Within -3.6 %
/// and +4.8 % of the closed form for densities in [0.002, 3] and n_v ≥ 0.002; finite for all n_v in [0, 1].
///
/// Cost on GCN: 16 instructions (4 at a quarter of the rate).
float fuzz_g(float density, float n_v)
{
    float x = max(n_v, FUZZ_COSINE_MIN);
    float dense = 1.0 - (x * log((1.0 + (1.0 / x))));
    float y = density / (x * dense);
    float e = exp2((-1.442695 * y));
    return (dense * (1.0 - e)) * (1.0 - ((0.1 * y) * e));
}

/// The talk's form of `fuzz_g`, `d (1 + c_0 x + c_1 x²) / (d + c_2 x + c_3 x³)`, by four coefficients; zero where there are
/// no fibres.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
float fuzz_g_talk(float coefficients[4], float density, float n_v)
{
    float above = 1.0 + (n_v * (coefficients[0] + (coefficients[1] * n_v)));
    return (density * above) / max((density + (n_v * (coefficients[2] + ((coefficients[3] * n_v) * n_v)))), 1e-20);
}

/// Share of uniform irradiance that reaches the base unscattered, `2 E_3(d)` (slide: Ambient Shadowing, `Q~`); within
/// 0.00043 for densities in [0, 3].
///
/// Cost on GCN: 11 instructions (2 at a quarter of the rate).
float fuzz_q(float density)
{
    float above = 1.0 + (density * (3.07323 + (0.102541 * density)));
    const float _e9 = fuzz_passage(density, 1.0);
    return (_e9 * above) / (1.0 + (density * (4.02006 + (1.98275 * density))));
}

/// The talk's form of `fuzz_q`, `1 + c_0 d + c_1 d²`, by two coefficients; turns up outside the range of its fit.
///
/// Cost on GCN: 2 instructions.
float fuzz_q_talk(float coefficients[2], float density)
{
    return 1.0 + (density * (coefficients[0] + (coefficients[1] * density)));
}

/// What the phase function gathers of uniform light, over `fuzz_g`, as a polynomial of the view fitted for one tilt and
/// one spread over densities of 0.05 to 0.5: the talk's six terms and the third and fourth power of `t_v`.
///
/// Cost on GCN: 8 instructions.
float fuzz_ambient_factor(float coefficients[8], float n_v, float t_v)
{
    float along = t_v * (coefficients[2] + (t_v * (coefficients[5] + (t_v * (coefficients[6] + (t_v * coefficients[7]))))));
    float across = n_v * ((coefficients[1] + (coefficients[3] * n_v)) + (coefficients[4] * t_v));
    return max(((coefficients[0] + across) + along), 0.0);
}

/// Texture coordinates in the table that replaces `fuzz_ambient_factor` for combed fibres, of FUZZ_TABLE_SIZE texels a
/// side: x runs with `n_v` from 0 to 1, y with the cosine of the azimuth between view and fibre. `t_n` is `t·n`.
///
/// Cost on GCN: 11 instructions (1 at a quarter of the rate).
float2 fuzz_ambient_place(float n_v, float t_v, float t_n)
{
    float sines = sqrt(max(((1.0 - (n_v * n_v)) * (1.0 - (t_n * t_n))), 1e-12));
    float azimuth = saturate((0.5 + ((0.5 * (t_v - (n_v * t_n))) / sines)));
    return (float2(n_v, azimuth) * (1.0 - 0.020833334)) + ((0.5 * 0.020833334)).xx;
}

/// The factor from what the table holds at `fuzz_ambient_place`, interpolated bilinearly: x for a thin layer, y what a
/// dense one adds to it.
///
/// Cost on GCN: 5 instructions (1 at a quarter of the rate).
float fuzz_ambient_tabulated(float2 texel, float density, float n_v)
{
    return texel.x + ((texel.y * density) / max((density + n_v), 1e-20));
}

/// Mean direction of the light that the lobe gathers, shorter than one, by four coefficients of the same fit:
/// `c_0 n + c_1 v + (c_2 + c_3 t_v) t`.
///
/// Cost on GCN: 13 instructions.
float3 fuzz_ambient_direction(float coefficients[4], float3 n, float3 v, float3 t)
{
    return ((n * coefficients[0]) + (v * coefficients[1])) + (t * (coefficients[2] + (coefficients[3] * dot(t, v))));
}

/// Mean radiance in the lobe, from the coefficients of `radiance` up to order 1 and `fuzz_ambient_direction`; exact for
/// light that varies linearly with direction. Never negative.
///
/// Cost on GCN: 18 instructions.
float3 fuzz_ambient_radiance(float3 radiance[9], float3 direction)
{
    float3 linear_2 = ((radiance[3] * direction.x) + (radiance[1] * direction.y)) + (radiance[2] * direction.z);
    return max(((radiance[0] * 0.2820948) + (linear_2 * 0.48860252)), (0.0).xxx);
}

/// Mean radiance over the hemisphere about the unit vector `n`: the talk's light. Never negative.
///
/// Cost on GCN: 21 instructions.
float3 fuzz_ambient_mean(float3 radiance[9], float3 n)
{
    const float3 _e4 = fuzz_ambient_radiance(radiance, (n * 0.5));
    return _e4;
}

/// Factor on the base's ambient light, diffuse or from a specular probe (slide: Ambient Shadowing, `c_atten`):
/// `P_e (Q + c_f R (1 - Q))`. `downward` is R, the mean of P_s over uniform irradiance, which depends on tilt and spread;
/// 1/2 for fibres in all directions. The slide's R lacks a 1/π.
///
/// Cost on GCN: 8 instructions.
float3 fuzz_ambient_attenuation(float escaped, float q, float downward, float3 fibre_color)
{
    return ((q).xxx + (fibre_color * (downward * (1.0 - q)))) * escaped;
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_deferred.wesl, by ./x shaders. Needs: fuzz_layer

// Fuzz by seven bits of a G-buffer: fixed fibres over Lambert, for moss and felt.
//
// McAuley. Extension to Energy-Conserving Wrapped Diffuse. 2013.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

#ifndef KINRAN_FUZZ_DEFERRED_HLSL
#define KINRAN_FUZZ_DEFERRED_HLSL


/// Density of the layer.
static const float FUZZ_DEFERRED_DENSITY = 0.5;

/// Roughness of the fibres: a spread of 0.9. They stand along the normal.
static const float FUZZ_DEFERRED_ALPHA = 0.9486833;

/// Albedo of the fibres over that of the Lambert base.
static const float FUZZ_DEFERRED_ALBEDO = 5.0;

/// How far light wraps around the terminator, as a cosine.
static const float FUZZ_WRAP = 0.2;

/// `(1+n)/(2 (1+w)^(1+n))` for n = 2: with it the wrapped cosine integrates to π over the sphere.
static const float FUZZ_WRAP_SCALE = 0.86805546;

/// The cosine of light and normal, softened by wrapping (McAuley 2013; slide: Deferred), n = 2:
/// `(1+n)/(2(1+w)) (max(n_u + w, 0)/(1+w))^n`. Its integral over the sphere is π. Where no light arrives it is 1e-8
/// rather than zero, so that the layer may divide by it.
///
/// Cost on GCN: 4 instructions.
float fuzz_wrap(float n_u)
{
    float c = max((n_u + FUZZ_WRAP), 0.0001);
    return (FUZZ_WRAP_SCALE * c) * c;
}

/// P_e of the deferred layer, once a pixel.
///
/// Cost on GCN: 4 instructions (2 at a quarter of the rate).
float fuzz_deferred_escape(float n_v)
{
    const float _e2 = fuzz_passage(FUZZ_DEFERRED_DENSITY, n_v);
    return _e2;
}

/// BRDF times cosine of the deferred layer for a fibre albedo of one, from the cosines of light and view with the normal
/// and with each other and `fuzz_deferred_escape`. Lights down to `n_u = -FUZZ_WRAP` reach it. The picture is
/// `lerp(Lambert, this, fuzziness)`; the base is not shadowed. It is `fibre_phase` and `fuzz_layer` times cosine with
/// `fuzz_wrap` for the light's cosine, every constant factor drawn into another.
///
/// Cost on GCN: 23 instructions (4 at a quarter of the rate).
float fuzz_deferred(float n_u, float n_v, float u_v, float escaped)
{
    float c = max((n_u + FUZZ_WRAP), 0.0001);
    float wrapped = c * c;
    float passed = exp2((-0.8309924 / wrapped)) * escaped;
    float w = 1.000001 + u_v;
    float s = n_u + n_v;
    float m = ((s * s) * 0.055555534) + w;
    float over_area = rsqrt((142.1223 - ((n_u * n_u) * 14.212225)));
    float above = (((w * w) * wrapped) * (1.0 - passed)) * over_area;
    return above / ((m * m) * (wrapped + (n_v * 1.1520001)));
}

/// Albedo of the fibres over a Lambert base of albedo `base`: `5 base`, as the talk has it, but no more than the layer
/// can have without returning more than arrives. The talk's alone exceeds one at grazing where `base` is above 0.35.
///
/// Cost on GCN: 8 instructions.
float3 fuzz_deferred_color(float3 base, float n_v)
{
    return min((base * FUZZ_DEFERRED_ALBEDO), ((1.7241 + (7.5257 * n_v))).xxx);
}

/// Eight bits of a G-buffer, a whole number from 0 to 255, from a fuzziness in [0, 1], rounded to 1/127, below a `flag` in
/// the top bit (0 or 1: translucency, in the talk). A channel of the format unorm8 wants it over 255.
///
/// Cost on GCN: 4 instructions.
float fuzziness_code(float fuzziness, float flag)
{
    return (128.0 * flag) + floor(((saturate(fuzziness) * 127.0) + 0.5));
}

/// Fuzziness of eight bits, the flag left out. What a channel of the format unorm8 gives, times 255, need not be whole.
///
/// Cost on GCN: 4 instructions.
float fuzziness_from_code(float code)
{
    return (code - ((code > 127.5) ? 128.0 : 0.0)) * 0.007874016;
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/multiscatter.wesl, by ./x shaders. Needs: nothing else

// Energy that microfacet models lose between the facets, given back.
//
// Turquin. Practical multiple scattering compensation for microfacet models. 2019.

#ifndef KINRAN_MULTISCATTER_HLSL
#define KINRAN_MULTISCATTER_HLSL

/// Directional albedo of the single-scattering GGX lobe with height-correlated Smith masking and F = 1, for a view at
/// cosine `n_v` (0 to 1): the share of a white furnace that comes back, 0.307 (= 1 − ln 2) to 1. A rational fit,
/// within 0.011 of quadrature (0.004 RMS) for alpha and n_v in [0.005, 1]; it takes the place of a lookup table.
///
/// Cost on GCN: 27 instructions (1 at a quarter of the rate).
float ggx_directional_albedo(float n_v, float alpha)
{
    float m_sqr = n_v * n_v;
    float a_sqr = alpha * alpha;
    float p = (((0.00023917 + (0.004272 * alpha)) + (0.014007 * a_sqr)) + (((0.1302 - (0.075028 * alpha)) + (3.2169 * a_sqr)) * n_v)) + (((-0.03449 - (0.18897 * alpha)) + (0.089879 * a_sqr)) * m_sqr);
    float q = (((-1.9263e-5 + (0.0054598 * alpha)) + (1.0288 * a_sqr)) + (((0.0019317 - (1.1331 * alpha)) + (5.3123 * a_sqr)) * n_v)) + (((1.0 - (1.3516 * alpha)) - (0.3803 * a_sqr)) * m_sqr);
    return clamp((1.0 - ((alpha * p) / q)), 0.3, 1.0);
}

/// Roughness of the isotropic lobe whose albedo stands for that of an anisotropic one, for the unit view `v` in the frame
/// of the alphas: squared, the mean of `alpha_t²` and `alpha_b²` from above; the flatter the view, the more that across it
/// counts, towards which facets send most light: `(alpha_t² + alpha_b² + 0.8 (alpha_t² - alpha_b²) (v.y⁴ - v.x⁴)) / 2`.
/// RMS error of the albedo 0.019 over random pairs in [0.05, 1] and all views, worst 0.32 at a flat view across the pair
/// (1, 0.05).
///
/// Cost on GCN: 10 instructions (1 at a quarter of the rate).
float ggx_albedo_alpha(float3 v, float alpha_t, float alpha_b)
{
    float t = alpha_t * alpha_t;
    float b = alpha_b * alpha_b;
    float x = v.x * v.x;
    float y = v.y * v.y;
    return sqrt(((0.5 * (t + b)) + ((0.4 * (t - b)) * ((y * y) - (x * x)))));
}

/// Factor on the single-scattering lobe that restores the energy of all further bounces, `1 + f0 (1/E - 1)` (Turquin
/// 2019, eq. 16), per pixel, for the unit view `v` in the frame of the alphas, z along the normal. The factor depends on
/// the view alone, so the compensated lobe is not reciprocal. An anisotropic lobe uses the isotropic albedo at
/// `ggx_albedo_alpha`.
///
/// Cost on GCN: 44 instructions (3 at a quarter of the rate).
float3 multiscatter_compensation(float3 f0_, float3 v, float alpha_t, float alpha_b)
{
    const float _e6 = ggx_albedo_alpha(v, alpha_t, alpha_b);
    const float _e7 = ggx_directional_albedo(saturate(v.z), _e6);
    return (1.0).xxx + (f0_ * ((1.0 / _e7) - 1.0));
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sh.wesl, by ./x shaders. Needs: nothing else

// Order-2 spherical harmonics: distant light by nine coefficients.
//
// Ramamoorthi and Hanrahan. An Efficient Representation for Irradiance Environment Maps. SIGGRAPH 2001.
//
// Coefficients stand in the order (l, m) = (0,0), (1,-1), (1,0), (1,1), (2,-2) .. (2,2). The basis is orthonormal
// over the sphere, its polar axis is z, without the Condon-Shortley phase.

#ifndef KINRAN_SH_HLSL
#define KINRAN_SH_HLSL

#ifndef KINRAN_RET_CONSTRUCTARRAY9_FLOAT_HLSL
#define KINRAN_RET_CONSTRUCTARRAY9_FLOAT_HLSL
typedef float ret_Constructarray9_float_[9];
#endif

#ifndef KINRAN_CONSTRUCTARRAY9_FLOAT_HLSL
#define KINRAN_CONSTRUCTARRAY9_FLOAT_HLSL
ret_Constructarray9_float_ Constructarray9_float_(float arg0, float arg1, float arg2, float arg3, float arg4, float arg5, float arg6, float arg7, float arg8) {
    float ret[9] = { arg0, arg1, arg2, arg3, arg4, arg5, arg6, arg7, arg8 };
    return ret;
}
#endif

#ifndef KINRAN_RET_SH_BASIS_HLSL
#define KINRAN_RET_SH_BASIS_HLSL
typedef float ret_sh_basis[9];
#endif

/// The basis functions at a unit direction.
///
/// Cost on GCN: 14 instructions.
ret_sh_basis sh_basis(float3 direction)
{
    float x = direction.x;
    float y = direction.y;
    float z = direction.z;
    return Constructarray9_float_(0.2820948, (0.48860252 * y), (0.48860252 * z), (0.48860252 * x), ((1.0925484 * x) * y), ((1.0925484 * y) * z), (0.31539157 * (((3.0 * z) * z) - 1.0)), ((1.0925484 * x) * z), (0.5462742 * ((x * x) - (y * y))));
}

/// The function that the coefficients stand for, at a unit direction; negative where it rings.
///
/// Cost on GCN: 41 instructions.
float3 sh_evaluate(float3 coefficients[9], float3 direction)
{
    const float _e2[9] = sh_basis(direction);
    return ((((((((coefficients[0] * _e2[0]) + (coefficients[1] * _e2[1])) + (coefficients[2] * _e2[2])) + (coefficients[3] * _e2[3])) + (coefficients[4] * _e2[4])) + (coefficients[5] * _e2[5])) + (coefficients[6] * _e2[6])) + (coefficients[7] * _e2[7])) + (coefficients[8] * _e2[8]);
}

#ifndef KINRAN_RET_CONSTRUCTARRAY9_FLOAT3_HLSL
#define KINRAN_RET_CONSTRUCTARRAY9_FLOAT3_HLSL
typedef float3 ret_Constructarray9_float3_[9];
#endif

#ifndef KINRAN_CONSTRUCTARRAY9_FLOAT3_HLSL
#define KINRAN_CONSTRUCTARRAY9_FLOAT3_HLSL
ret_Constructarray9_float3_ Constructarray9_float3_(float3 arg0, float3 arg1, float3 arg2, float3 arg3, float3 arg4, float3 arg5, float3 arg6, float3 arg7, float3 arg8) {
    float3 ret[9] = { arg0, arg1, arg2, arg3, arg4, arg5, arg6, arg7, arg8 };
    return ret;
}
#endif

#ifndef KINRAN_RET_SH_CONVOLVE_COSINE_HLSL
#define KINRAN_RET_SH_CONVOLVE_COSINE_HLSL
typedef float3 ret_sh_convolve_cosine[9];
#endif

/// Coefficients of irradiance from those of radiance (eq. 7), once per environment; `sh_evaluate` of the result is
/// `sh_irradiance`, three multiplications a coefficient cheaper.
///
/// Cost on GCN: 27 instructions.
ret_sh_convolve_cosine sh_convolve_cosine(float3 radiance[9])
{
    return Constructarray9_float3_((radiance[0] * 3.1415927), (radiance[1] * 2.0943952), (radiance[2] * 2.0943952), (radiance[3] * 2.0943952), (radiance[4] * 0.7853982), (radiance[5] * 0.7853982), (radiance[6] * 0.7853982), (radiance[7] * 0.7853982), (radiance[8] * 0.7853982));
}

/// Irradiance on a surface with unit `normal`, the integral of radiance times the clamped cosine. Light from one small
/// spot can make it slightly negative on the far side; clamp where that matters.
///
/// Cost on GCN: 65 instructions.
float3 sh_irradiance(float3 radiance[9], float3 normal)
{
    const float3 _e2[9] = sh_convolve_cosine(radiance);
    const float3 _e3 = sh_evaluate(_e2, normal);
    return _e3;
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sym.wesl, by ./x shaders. Needs: nothing else

// Symmetric matrices. A 2×2 one is a vec3f (xx, xy, yy), so that sums and scalings are the language's own; a 3×3
// one is a mat3x3f.

#ifndef KINRAN_SYM_HLSL
#define KINRAN_SYM_HLSL

/// Eigenvalues of a positive semi-definite 2×2 matrix and the unit eigenvector of the larger.
struct SymEigen {
    float larger;
    float smaller;
    float2 axis;
};

/// The 2×2 matrix with eigenvalue `l1` along the unit vector `axis` and `l2` across it.
///
/// Cost on GCN: 11 instructions.
float3 sym2_from_eigen(float l1_, float l2_, float2 axis)
{
    return float3((((l1_ * axis.x) * axis.x) + ((l2_ * axis.y) * axis.y)), (((l1_ - l2_) * axis.x) * axis.y), (((l1_ * axis.y) * axis.y) + ((l2_ * axis.x) * axis.x)));
}

/// `v v^T`.
///
/// Cost on GCN: 3 instructions.
float3 sym2_outer(float2 v)
{
    return float3((v.x * v.x), (v.x * v.y), (v.y * v.y));
}

/// Determinant of a 2×2 matrix.
///
/// Cost on GCN: 2 instructions.
float sym2_det(float3 a)
{
    return (a.x * a.z) - (a.y * a.y);
}

/// Trace of a 2×2 matrix.
///
/// Cost on GCN: 1 instruction.
float sym2_trace(float3 a)
{
    return a.x + a.z;
}

/// `v^T A v`.
///
/// Cost on GCN: 7 instructions.
float sym2_quadratic(float3 a, float2 v)
{
    return (((a.x * v.x) * v.x) + (((2.0 * a.y) * v.x) * v.y)) + ((a.z * v.y) * v.y);
}

#ifndef KINRAN_CONSTRUCTSYMEIGEN_HLSL
#define KINRAN_CONSTRUCTSYMEIGEN_HLSL
SymEigen ConstructSymEigen(float arg0, float arg1, float2 arg2) {
    SymEigen ret = (SymEigen)0;
    ret.larger = arg0;
    ret.smaller = arg1;
    ret.axis = arg2;
    return ret;
}
#endif

/// Eigenvalues and axis of a positive semi-definite matrix, both at least zero. The axis has x ≥ 0 (and y = +1
/// where x = 0) and is (1, 0) when both eigenvalues are equal. The smaller is `det / larger`, which keeps its digits
/// where the textbook's half difference cancels.
///
/// Cost on GCN: 33 instructions (5 at a quarter of the rate).
SymEigen sym2_eigen(float3 a)
{
    bool local = (bool)0;

    float half_difference = 0.5 * (a.x - a.z);
    float radius = sqrt(((half_difference * half_difference) + (a.y * a.y)));
    float larger = (0.5 * (a.x + a.z)) + radius;
    if (!((radius <= (1e-12 * larger)))) {
        local = larger <= 0.0;
    } else {
        local = true;
    }
    bool _e27 = local;
    if (_e27) {
        const SymEigen symeigen = ConstructSymEigen(max(larger, 0.0), max((larger - (2.0 * radius)), 0.0), float2(1.0, 0.0));
        return symeigen;
    }
    const float _e39 = sym2_det(a);
    float smaller = min(max((_e39 / larger), 0.0), larger);
    float long_ = sqrt((0.5 + ((0.5 * abs(half_difference)) / radius)));
    float short_ = (0.5 * abs(a.y)) / (radius * long_);
    float side = (a.y < 0.0) ? -1.0 : 1.0;
    float2 axis = (half_difference >= 0.0) ? float2(long_, (side * short_)) : float2(short_, (side * long_));
    const SymEigen symeigen_1 = ConstructSymEigen(larger, smaller, axis);
    return symeigen_1;
}

/// The same eigenvectors with both eigenvalues clamped to `[lo, hi]`, `lo` ≥ 0. A matrix within the range comes back
/// as it is.
///
/// Cost on GCN: 54 instructions (5 at a quarter of the rate).
float3 sym2_clamp_eigen(float3 a, float lo, float hi)
{
    bool local = (bool)0;

    const SymEigen _e3 = sym2_eigen(a);
    const float3 _e9 = sym2_from_eigen(clamp(_e3.larger, lo, hi), clamp(_e3.smaller, lo, hi), _e3.axis);
    if (_e3.larger <= hi) {
        local = _e3.smaller > lo;
    } else {
        local = false;
    }
    bool _e17 = local;
    return _e17 ? a : _e9;
}

/// The positive semi-definite square root of a positive semi-definite matrix:
/// `(A + sqrt(det) I) / sqrt(trace + 2 sqrt(det))`, by Cayley–Hamilton.
///
/// Cost on GCN: 17 instructions (3 at a quarter of the rate).
float3 sym2_sqrt(float3 a)
{
    const float _e1 = sym2_det(a);
    float root_det = sqrt(max(_e1, 0.0));
    const float _e5 = sym2_trace(a);
    float scale = sqrt((_e5 + (2.0 * root_det)));
    if (scale == 0.0) {
        return (0.0).xxx;
    }
    return (a + float3(root_det, 0.0, root_det)) * (1.0 / scale);
}

/// `k A`. Column by column: a matrix times a number, which HLSL writes `mul(k, A)`, is refused by Slang for WGSL.
///
/// Cost on GCN: 9 instructions.
float3x3 sym3_scale(float3x3 a, float k)
{
    return float3x3((a[0] * k), (a[1] * k), (a[2] * k));
}

/// `A + d I`.
///
/// Cost on GCN: 3 instructions.
float3x3 sym3_add_diagonal(float3x3 a, float d)
{
    return float3x3((a[0] + float3(d, 0.0, 0.0)), (a[1] + float3(0.0, d, 0.0)), (a[2] + float3(0.0, 0.0, d)));
}

/// `v^T A v`.
///
/// Cost on GCN: 12 instructions.
float sym3_quadratic(float3x3 a, float3 v)
{
    return dot(v, mul(v, a));
}

/// Trace of a 3×3 matrix.
///
/// Cost on GCN: 2 instructions.
float sym3_trace(float3x3 a)
{
    return (a[0].x + a[1].y) + a[2].z;
}

/// The adjugate of a symmetric matrix: `A adj(A) = det(A) I`. Its columns are the cross products of A's.
///
/// Cost on GCN: 18 instructions.
float3x3 sym3_adjugate(float3x3 a)
{
    return float3x3(cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1]));
}

/// Determinant of a symmetric 3×3 matrix.
///
/// Cost on GCN: 9 instructions.
float sym3_det(float3x3 a)
{
    return dot(a[0], cross(a[1], a[2]));
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/aniso.wesl, by ./x shaders. Needs: frame, sym

// The aniso texel: squared roughness as three numbers that survive 8 bits, filtering and BC7.
//
// A texel holds [sqrt(Sxx), rho/2 + 1/2, sqrt(Syy)] with rho = Sxy / sqrt(Sxx Syy) (slide: Our Algorithm, step 4).
// S is alpha² as a symmetric matrix in the frame of `m_n`. Sample the texture with the hardware's filter; every
// average of texels decodes to a positive semi-definite matrix.

#ifndef KINRAN_ANISO_HLSL
#define KINRAN_ANISO_HLSL


/// What a light needs of an aniso texel.
struct AnisoDecoded {
    float alpha_t;
    float alpha_b;
    float3 tangent;
    float3 bitangent;
};

/// Smallest GGX roughness to shade with: one step of an 8-bit aniso channel.
static const float ALPHA_MIN = 0.003921569;

/// GGX alpha of a perceptual roughness in [0, 1]: its square, at least ALPHA_MIN.
///
/// Cost on GCN: 2 instructions.
float alpha_from_roughness(float roughness)
{
    return max((roughness * roughness), ALPHA_MIN);
}

/// GGX alpha of a gloss in [0, 1]: `(1 - gloss)²`, at least ALPHA_MIN.
///
/// Cost on GCN: 3 instructions.
float alpha_from_gloss(float gloss)
{
    const float _e3 = alpha_from_roughness((1.0 - gloss));
    return _e3;
}

/// Texel of a squared roughness matrix `s` (xx, xy, yy); each component in [0, 1]. rho is 0 where Sxx or Syy is 0.
///
/// Cost on GCN: 11 instructions (3 at a quarter of the rate).
float3 aniso_encode(float3 s)
{
    float product = s.x * s.z;
    float rho = (product > 0.0) ? clamp((s.y * rsqrt(product)), -1.0, 1.0) : 0.0;
    return float3(sqrt(saturate(s.x)), ((0.5 * rho) + 0.5), sqrt(saturate(s.z)));
}

/// Squared roughness matrix (xx, xy, yy) of a texel: positive semi-definite for every texel in [0, 1]³.
///
/// With `ggx_matrix_d` and `smith_matrix_v` this is all the decoding a light needs: cheaper than `aniso_decode` for a
/// few lights. Add `sym2_clamp_eigen` where a determinant of zero would divide.
///
/// Cost on GCN: 5 instructions.
float3 aniso_decode_matrix(float3 texel)
{
    return float3((texel.x * texel.x), ((texel.x * ((texel.y * 2.0) - 1.0)) * texel.z), (texel.z * texel.z));
}

#ifndef KINRAN_CONSTRUCTANISODECODED_HLSL
#define KINRAN_CONSTRUCTANISODECODED_HLSL
AnisoDecoded ConstructAnisoDecoded(float arg0, float arg1, float3 arg2, float3 arg3) {
    AnisoDecoded ret = (AnisoDecoded)0;
    ret.alpha_t = arg0;
    ret.alpha_b = arg1;
    ret.tangent = arg2;
    ret.bitangent = arg3;
    return ret;
}
#endif

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
AnisoDecoded aniso_decode(float3 texel, float3 tangent, float3 bitangent)
{
    float rho = (texel.y * 2.0) - 1.0;
    float sxy_twice = 2.0 * ((texel.x * texel.z) * rho);
    float sxx = texel.x * texel.x;
    float sum = (texel.z * texel.z) + sxx;
    float difference = sxx - (texel.z * texel.z);
    float discr_sqr = (sxy_twice * sxy_twice) + ((difference * difference) + 1e-18);
    float discr_rcp = rsqrt(discr_sqr);
    float alpha_t_sqr = max((0.5 * ((discr_sqr * discr_rcp) + sum)), 1.53787e-5);
    float alpha_b_sqr = max((0.5 * (sum - (discr_sqr * discr_rcp))), 1.53787e-5);
    float c_sqr = saturate((0.5 * ((difference * discr_rcp) + 1.0)));
    float c = sqrt(c_sqr);
    float s_abs = sqrt((1.0 - c_sqr));
    float s = (sxy_twice < 0.0) ? -(s_abs) : s_abs;
    const AnisoDecoded anisodecoded = ConstructAnisoDecoded(saturate(sqrt(alpha_t_sqr)), saturate(sqrt(alpha_b_sqr)), ((c * tangent) + (s * bitangent)), ((c * bitangent) - (s * tangent)));
    return anisodecoded;
}

/// Squared roughness matrix (xx, xy, yy) with `alpha_t` along the unit vector `axis` of the `m_n` frame, `alpha_b`
/// across.
///
/// Cost on GCN: 13 instructions.
float3 aniso_from_alphas(float alpha_t, float alpha_b, float2 axis)
{
    const float3 _e5 = sym2_from_eigen((alpha_t * alpha_t), (alpha_b * alpha_b), axis);
    return _e5;
}

/// Direction in the `m_n` frame of a direction painted in the mesh's tangent plane: what Gram–Schmidt, `d - (d·n) n`,
/// makes of it. Both are unit vectors; where nothing is left of it, the direction stays as it is.
///
/// Cost on GCN: 23 instructions (2 at a quarter of the rate).
float2 axis_from_direction(float2 direction, float3 n)
{
    const float3x3 _e2 = m_n(n);
    float2 axis = float2(dot(_e2[0].xy, direction), dot(_e2[1].xy, direction));
    float length_squared = dot(axis, axis);
    return (length_squared > 1e-12) ? (axis * rsqrt(length_squared)) : direction;
}

/// The inverse of `axis_from_direction`: the unit direction in the mesh's tangent plane that Gram–Schmidt against `n`
/// turns into `axis` of the `m_n` frame.
///
/// Cost on GCN: 31 instructions (2 at a quarter of the rate).
float2 direction_from_axis(float2 axis, float3 n)
{
    const float3x3 _e2 = m_n(n);
    float3 t = (_e2[0] * axis.x) + (_e2[1] * axis.y);
    float2 d = (t.xy * n.z) - (t.z * n.xy);
    float length_squared = dot(d, d);
    return (length_squared > 1e-12) ? (d * rsqrt(length_squared)) : axis;
}

/// Principal alphas (alpha_t, alpha_b) of `KHR_materials_anisotropy`: `alpha_b = roughness²`,
/// `alpha_t = mix(alpha_b, 1, strength²)`.
///
/// Cost on GCN: 5 instructions.
float2 alphas_from_khr_anisotropy(float roughness, float strength)
{
    const float _e2 = alpha_from_roughness(roughness);
    return float2((_e2 + (((1.0 - _e2) * strength) * strength)), _e2);
}

/// Perceptual roughness and anisotropy strength of `KHR_materials_anisotropy` for `alpha_t ≥ alpha_b`; the inverse of
/// `alphas_from_khr_anisotropy`.
///
/// Cost on GCN: 8 instructions (3 at a quarter of the rate).
float2 khr_anisotropy_from_alphas(float alpha_t, float alpha_b)
{
    float rest = 1.0 - alpha_b;
    float strength = (rest > 0.0) ? sqrt(saturate(((alpha_t - alpha_b) / rest))) : 0.0;
    return float2(sqrt(alpha_b), strength);
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_layer.wesl, by ./x shaders. Needs: aniso

// What a tiled layer's texels go through before they are blended: place, colour, direction, mask. Between `detail_uv`
// and the rest stands the texture fetch, with the hardware's filter and its repeating or mirroring address mode.

#ifndef KINRAN_DETAIL_LAYER_HLSL
#define KINRAN_DETAIL_LAYER_HLSL


/// The synthesized value of a texel in [0, 1]: byte 128 is 1/2, 1 and 0 are 0, 255 is 1. Without this mapping 8 bits do
/// not hold the neutral 1/2, and a detail equal to its target would come out 0.4 % off.
///
/// Cost on GCN: 6 instructions.
float3 detail_from_texel(float3 texel)
{
    return saturate(((texel * 1.003937) - (0.003937008).xxx));
}

/// Place in the tile: the mesh's `uv` scaled and rotated by `matrix`, then moved. The matrix is
/// `KHR_texture_transform`'s, with columns `(cos sx, -sin sx)` and `(sin sy, cos sy)`.
///
/// Cost on GCN: 4 instructions.
float2 detail_uv(float2 uv, float2x2 matrix_, float2 offset)
{
    return mul(uv, matrix_) + offset;
}

/// Signs that mirrored tiling gives the directions in a tile at `uv`: −1 along an axis in every other tile.
///
/// Cost on GCN: 6 instructions.
float2 detail_mirror(float2 uv)
{
    return (1.0).xx - (4.0 * frac((0.5 * floor(uv))));
}

/// Opacity of a layer: the mask's contrast raised around 1/2. `contrast` 1 leaves it as it is, 0 makes it 1/2.
///
/// Cost on GCN: 2 instructions.
float detail_mask(float mask, float contrast)
{
    return saturate((((mask - 0.5) * contrast) + 0.5));
}

/// A tile's normal in the mesh's tangent space. `rotation` is the cosine and sine of the layer's rotation, `mirror` what
/// `detail_mirror` says, or ones. A change of scale leaves slopes as they are.
///
/// Cost on GCN: 6 instructions.
float3 detail_turn_normal(float3 n, float2 rotation, float2 mirror)
{
    float2 xy = n.xy * mirror;
    return float3(((rotation.x * xy.x) + (rotation.y * xy.y)), ((rotation.x * xy.y) - (rotation.y * xy.x)), n.z);
}

/// A tile's aniso texel in the mesh's tangent space; as `detail_turn_normal`.
///
/// Cost on GCN: 32 instructions (3 at a quarter of the rate).
float3 detail_turn_aniso(float3 texel, float2 rotation, float2 mirror)
{
    const float3 _e3 = aniso_decode_matrix(texel);
    float xy = (_e3.y * mirror.x) * mirror.y;
    float c = rotation.x;
    float s = rotation.y;
    float across = ((2.0 * c) * s) * xy;
    const float3 _e42 = aniso_encode(float3(((((c * c) * _e3.x) + across) + ((s * s) * _e3.z)), (((c * s) * (_e3.z - _e3.x)) + (((c * c) - (s * s)) * xy)), ((((s * s) * _e3.x) - across) + ((c * c) * _e3.z))));
    return _e42;
}

#endif

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

#ifndef KINRAN_GGX_HLSL
#define KINRAN_GGX_HLSL


/// 1 / π.
static const float FRAC_1_PI = 0.31830987;

/// Isotropic distribution of microfacet normals per steradian, `n_h = n·h` (Walter 2007, eq. 33). One ulp of `n_h`
/// moves the peak by `2.4e-7 / alpha²`; where that matters, `ggx_aniso_d` has all the digits.
///
/// Cost on GCN: 10 instructions (1 at a quarter of the rate).
float ggx_d(float n_h, float alpha)
{
    float a_sqr = alpha * alpha;
    float q = ((1.0 - n_h) * (1.0 + n_h)) + ((a_sqr * n_h) * n_h);
    return (a_sqr * FRAC_1_PI) / (q * q);
}

/// Anisotropic distribution of microfacet normals per steradian (slide: Our Algorithm, the form with
/// `(alpha_t alpha_b)^3`), for `h` in the upper hemisphere. Its integral against n·h over there is one.
///
/// Cost on GCN: 12 instructions (1 at a quarter of the rate).
float ggx_aniso_d(float3 h, float alpha_t, float alpha_b)
{
    float alpha_tb = alpha_t * alpha_b;
    float3 v = float3((h.x * alpha_b), (h.y * alpha_t), (h.z * alpha_tb));
    float w = alpha_tb / dot(v, v);
    return ((alpha_tb * FRAC_1_PI) * w) * w;
}

/// `ggx_aniso_d` from the squared roughness matrix `a` (xx, xy, yy), with no eigen decode:
/// `|A|^(3/2) / (π (h.xy^T adj(A) h.xy + |A| h.z²)²)`. `|A|` must be positive.
///
/// Cost on GCN: 17 instructions (2 at a quarter of the rate).
float ggx_matrix_d(float3 h, float3 a)
{
    const float _e2 = sym2_det(a);
    const float _e9 = sym2_quadratic(float3(a.z, -(a.y), a.x), h.xy);
    float w = _e2 / (_e9 + ((_e2 * h.z) * h.z));
    return ((rsqrt(_e2) * FRAC_1_PI) * w) * w;
}

/// Visibility from the two terms of `2 n·u n·v (1 + Λ(u) + Λ(v))`: `n·v |u'|` and `n·u |v'|`, where the prime
/// stretches a direction by the roughness. Finite, and meaningless, where both directions graze: their sum is 8e-9 where
/// both cosines are 1e-6 and alpha is ALPHA_MIN. The bound keeps the product with the sharpest peak finite too.
///
/// Cost on GCN: 3 instructions (1 at a quarter of the rate).
float smith_v_of_terms(float u, float v)
{
    return 0.5 / max((u + v), 1e-12);
}

/// Height-correlated Smith visibility `G2 / (4 n·u n·v)`, isotropic (Heitz 2014, eq. 99).
///
/// Cost on GCN: 12 instructions (3 at a quarter of the rate).
float smith_v(float n_u, float n_v, float alpha)
{
    float a_sqr = alpha * alpha;
    float v = n_u * sqrt((((n_v * n_v) * (1.0 - a_sqr)) + a_sqr));
    float u = n_v * sqrt((((n_u * n_u) * (1.0 - a_sqr)) + a_sqr));
    const float _e18 = smith_v_of_terms(u, v);
    return _e18;
}

/// Height-correlated Smith visibility `G2 / (4 n·u n·v)`, anisotropic (Heitz 2014, eq. 99 with the lambda of section
/// 5.3). `u` and `v` lie in the upper hemisphere.
///
/// Cost on GCN: 16 instructions (3 at a quarter of the rate).
float smith_aniso_v(float3 u, float3 v, float alpha_t, float alpha_b)
{
    float3 stretch = float3(alpha_t, alpha_b, 1.0);
    const float _e14 = smith_v_of_terms((v.z * length((u * stretch))), (u.z * length((v * stretch))));
    return _e14;
}

/// `smith_aniso_v` from the squared roughness matrix `a` (xx, xy, yy), with no eigen decode.
///
/// Cost on GCN: 21 instructions (3 at a quarter of the rate).
float smith_matrix_v(float3 u, float3 v, float3 a)
{
    const float _e4 = sym2_quadratic(a, u.xy);
    float stretched_u = sqrt((_e4 + (u.z * u.z)));
    const float _e11 = sym2_quadratic(a, v.xy);
    float stretched_v = sqrt((_e11 + (v.z * v.z)));
    const float _e21 = smith_v_of_terms((v.z * stretched_u), (u.z * stretched_v));
    return _e21;
}

/// Smith masking of `v` alone, 0 to 1 (Heitz 2014, eq. 43).
///
/// Cost on GCN: 10 instructions (2 at a quarter of the rate).
float smith_aniso_g1(float3 v, float alpha_t, float alpha_b)
{
    return (2.0 * v.z) / (v.z + length((v * float3(alpha_t, alpha_b, 1.0))));
}

/// Fresnel reflectance by Schlick's approximation (1994) from `f0` at normal incidence to one at grazing.
///
/// Cost on GCN: 10 instructions.
float3 schlick_f(float3 f0_1, float v_h)
{
    float m = saturate((1.0 - v_h));
    float m_sqr = m * m;
    return f0_1 + (((1.0).xxx - f0_1) * ((m_sqr * m_sqr) * m));
}

/// A microfacet normal distributed as `ggx_vndf_pdf` for the view direction `v`, from two uniform numbers in [0, 1)
/// (Dupuy, Benyoub 2023, listing 3).
///
/// Cost on GCN: 32 instructions (5 at a quarter of the rate).
float3 ggx_vndf_sample(float3 v, float alpha_t, float alpha_b, float2 xi)
{
    float3 stretch = float3(alpha_t, alpha_b, 1.0);
    float3 v_std = normalize((v * stretch));
    float phi = 6.2831855 * xi.x;
    float z = ((1.0 - xi.y) * (1.0 + v_std.z)) - v_std.z;
    float sin_theta = sqrt(max((1.0 - (z * z)), 0.0));
    float3 cap = float3((sin_theta * cos(phi)), (sin_theta * sin(phi)), z);
    float3 h = (cap + v_std) * stretch;
    float length_squared = dot(h, h);
    return (length_squared > 0.0) ? (h * rsqrt(length_squared)) : float3(0.0, 0.0, 1.0);
}

/// Density per steradian of microfacet normals visible from `v`: `G1(v) max(v·h, 0) D(h) / n·v` (Heitz 2014, eq. 16).
/// Divide by `4 v·h` for the density of the reflected direction.
///
/// Cost on GCN: 29 instructions (3 at a quarter of the rate).
float ggx_vndf_pdf(float3 v, float3 h, float alpha_t, float alpha_b)
{
    if (h.z <= 0.0) {
        return 0.0;
    }
    float g_over_n_v = 2.0 / (v.z + length((v * float3(alpha_t, alpha_b, 1.0))));
    const float _e20 = ggx_aniso_d(h, alpha_t, alpha_b);
    return (g_over_n_v * max(dot(v, h), 0.0)) * _e20;
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_sampling.wesl, by ./x shaders. Needs: fuzz_phase, ggx

// Light directions for a view, where a layer of fibres and its base scatter from.
//
// Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.

#ifndef KINRAN_FUZZ_SAMPLING_HLSL
#define KINRAN_FUZZ_SAMPLING_HLSL


/// A light direction distributed as `fuzz_pdf` for the view `v`, from two uniform numbers in [0, 1): `v` reflected on a
/// visible normal of the fibres (Heitz 2015, section 4). It may lie below the horizon, where the layer receives nothing:
/// the density covers the sphere.
///
/// Cost on GCN: 58 instructions (6 at a quarter of the rate).
float3 fuzz_sample(float3 v, float3 t, float alpha, float2 xi)
{
    float3 squeezed_v = v - (t * ((1.0 - alpha) * dot(t, v)));
    float phi = 6.2831855 * xi.x;
    float z = 1.0 - (2.0 * xi.y);
    float r = sqrt(max((1.0 - (z * z)), 0.0));
    float3 axis = normalize(squeezed_v);
    float3 sum = float3((r * cos(phi)), (r * sin(phi)), z) + axis;
    float3 m = normalize(((dot(sum, sum) > 1e-12) ? sum : axis));
    float3 h = normalize((m - (t * ((1.0 - alpha) * dot(t, m)))));
    return (h * (2.0 * dot(v, h))) - v;
}

/// Density per steradian of `fuzz_sample`: `D_F(h) / (4 σ_F(v))`.
///
/// Cost on GCN: 27 instructions (2 at a quarter of the rate).
float fuzz_pdf(float3 u, float3 v, float3 t, float alpha)
{
    const float _e7 = fibre_phase(dot(u, v), dot(t, v), dot(t, u), alpha);
    return _e7;
}

/// Probabilities of sampling the layer, the base's specular lobe and its diffuse one, in proportion to the light that
/// each is expected to send; each at least 5 % of the largest, so that a wrong guess only adds noise.
///
/// Cost on GCN: 12 instructions (1 at a quarter of the rate).
float3 fuzz_over_base_shares(float fuzz, float specular, float diffuse)
{
    float least = 0.05 * max(max(fuzz, max(specular, diffuse)), 1e-6);
    float3 shares = max(float3(fuzz, specular, diffuse), (least).xxx);
    return shares / (((shares.x + shares.y) + shares.z)).xxx;
}

/// A light direction for a layer of fibres over GGX and Lambert, distributed as `fuzz_over_base_pdf`; vectors in the
/// frame of the alphas, z along the normal, `shares` as `fuzz_over_base_shares` gives them.
///
/// Cost on GCN: 118 instructions (18 at a quarter of the rate).
float3 fuzz_over_base_sample(float3 v, float3 t, float alpha, float alpha_t, float alpha_b, float3 shares, float2 xi)
{
    if (xi.x < shares.x) {
        const float3 _e15 = fuzz_sample(v, t, alpha, float2((xi.x / shares.x), xi.y));
        return _e15;
    }
    float rest = xi.x - shares.x;
    if (rest < shares.y) {
        const float3 _e25 = ggx_vndf_sample(v, alpha_t, alpha_b, float2((rest / shares.y), xi.y));
        return (_e25 * (2.0 * dot(v, _e25))) - v;
    }
    float x = saturate(((rest - shares.y) / shares.z));
    float phi = 6.2831855 * xi.y;
    float r = sqrt(x);
    return float3((r * cos(phi)), (r * sin(phi)), sqrt((1.0 - x)));
}

/// Density per steradian of `fuzz_over_base_sample`, over the sphere.
///
/// Cost on GCN: 84 instructions (7 at a quarter of the rate).
float fuzz_over_base_pdf(float3 u, float3 v, float3 t, float alpha, float alpha_t, float alpha_b, float3 shares)
{
    float3 sum = u + v;
    float3 h = normalize(((dot(sum, sum) > 1e-12) ? sum : t));
    const float _e13 = ggx_vndf_pdf(v, h, alpha_t, alpha_b);
    float specular = _e13 / max((4.0 * dot(v, h)), 1e-12);
    float diffuse = max(u.z, 0.0) * 0.31830987;
    const float _e26 = fuzz_pdf(u, v, t, alpha);
    return ((shares.x * _e26) + (shares.y * specular)) + (shares.z * diffuse);
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sggx.wesl, by ./x shaders. Needs: frame, sym

// SGGX matrices: a normal and its anisotropic roughness as one thing that can be averaged.
//
// Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

#ifndef KINRAN_SGGX_HLSL
#define KINRAN_SGGX_HLSL


/// A surface: unit normal, and squared roughness matrix (xx, xy, yy) in the frame of `m_n`.
struct GgxSurface {
    float3 normal;
    float3 a;
};

/// A distribution of slopes: centre and squared roughness (xx, xy, yy), both dimensionless.
struct SlopeDistribution {
    float2 m;
    float3 a;
};

/// `S = M_n [A 0; 0 1] M_n^T` (slide: Our Algorithm, step 1): the SGGX matrix of a GGX surface with unit normal `n`
/// and squared roughness matrix `a` (xx, xy, yy) in the frame of `m_n`.
///
/// Cost on GCN: 51 instructions (1 at a quarter of the rate).
float3x3 sggx_from_ggx(float3 n, float3 a)
{
    const float3x3 _e2 = m_n(n);
    float3 ax = (_e2[0] * a.x) + (_e2[1] * a.y);
    float3 ay = (_e2[0] * a.y) + (_e2[1] * a.z);
    return float3x3((((ax * _e2[0].x) + (ay * _e2[1].x)) + (n * n.x)), (((ax * _e2[0].y) + (ay * _e2[1].y)) + (n * n.y)), (((ax * _e2[0].z) + (ay * _e2[1].z)) + (n * n.z)));
}

/// Area of the microflakes projected along the unit vector `w`: `sqrt(w^T S w)` (Heitz 2015).
///
/// Cost on GCN: 14 instructions (1 at a quarter of the rate).
float sggx_projected_area(float3x3 s, float3 w)
{
    const float _e2 = sym3_quadratic(s, w);
    return sqrt(max(_e2, 0.0));
}

/// Distribution of microflake normals at the unit vector `h`, a density per steradian over the sphere:
/// `1 / (π sqrt|S| (h^T S^-1 h)^2)` (Heitz 2015), written as `|S|^(3/2) / (π (h^T adj(S) h)^2)`. `s` must have a
/// positive determinant. Single precision leaves a relative error of 1e-5 over the smallest eigenvalue.
///
/// Cost on GCN: 39 instructions (2 at a quarter of the rate).
float sggx_d(float3x3 s, float3 h)
{
    const float _e2 = sym3_det(s);
    const float3x3 _e3 = sym3_adjugate(s);
    const float _e4 = sym3_quadratic(_e3, h);
    return (_e2 * sqrt(_e2)) / ((3.1415927 * _e4) * _e4);
}

#ifndef KINRAN_CONSTRUCTSLOPEDISTRIBUTION_HLSL
#define KINRAN_CONSTRUCTSLOPEDISTRIBUTION_HLSL
SlopeDistribution ConstructSlopeDistribution(float2 arg0, float3 arg1) {
    SlopeDistribution ret = (SlopeDistribution)0;
    ret.m = arg0;
    ret.a = arg1;
    return ret;
}
#endif

/// The slope distribution an SGGX matrix with zz > 0 stands for, seen from the z axis: `S / S_zz = [A + m m^T, m;
/// m^T, 1]`. The slopes follow a bivariate Student-t with two degrees of freedom.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
SlopeDistribution slopes_from_sggx(float3x3 s)
{
    float inv = 1.0 / s[2].z;
    float2 m = s[2].xy * inv;
    float3 a = (float3(s[0].x, s[0].y, s[1].y) * inv) - float3((m.x * m.x), (m.x * m.y), (m.y * m.y));
    const SlopeDistribution slopedistribution = ConstructSlopeDistribution(m, a);
    return slopedistribution;
}

/// The SGGX matrix with zz = 1 of a slope distribution; the inverse of `slopes_from_sggx`.
///
/// Cost on GCN: 3 instructions.
float3x3 sggx_from_slopes(float2 m, float3 a)
{
    float xy = a.y + (m.x * m.y);
    return float3x3(float3((a.x + (m.x * m.x)), xy, m.x), float3(xy, (a.z + (m.y * m.y)), m.y), float3(m, 1.0));
}

/// The talk's power iteration (slide: Our Algorithm, step 3): `steps` times `n = S n / |S n|` from `start`. The
/// tangent of the error shrinks by the ratio of the two largest eigenvalues a step; in V grooves steeper than 45° it
/// leaves the surface for its walls. `sggx_principal_axis` has neither fault.
///
/// Cost on GCN: 34 instructions (2 at a quarter of the rate), one round of its loop.
float3 sggx_power_iteration(float3x3 s, float3 start, uint steps)
{
    float3 n = (float3)0;
    uint i = 0u;

    const float _e3 = sym3_trace(s);
    float scale = 1.0 / max(_e3, 1e-30);
    n = start;
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            uint _e24 = i;
            i = _e24 + 1u;
        }
        loop_init = false;
        uint _e11 = i;
        if (_e11 < steps) {
        } else {
            break;
        }
        {
            float3 _e13 = n;
            float3 next = mul(_e13, s) * scale;
            float length_squared = dot(next, next);
            float3 _e17 = n;
            n = (length_squared > 0.0) ? (next * rsqrt(length_squared)) : _e17;
        }
    }
    float3 _e26 = n;
    return _e26;
}

/// Squared overlap with the eigenvector of `l`, from the moments m' B m and |B m|² of a deviator of unit size.
///
/// Cost on GCN: 7 instructions (1 at a quarter of the rate).
float sggx_overlap(float l, float moment, float moment_sqr)
{
    return (((moment_sqr + (l * moment)) + (l * l)) - 3.0) / (((3.0 * l) * l) - 3.0);
}

/// The unit eigenvector of `s` with the largest overlap with the unit vector `start`, signed to agree with it.
/// Started at the mean normal of a footprint it finds the filtered normal, also where the largest eigenvalue is
/// another one (V grooves steeper than 45°). Where eigenvalues coincide, to 0.1 % of their spread, it is the
/// projection of `start` on their space; `start` itself if `s` is a multiple of the identity. No trigonometry.
///
/// Cost on GCN: 204 instructions (10 at a quarter of the rate).
float3 sggx_principal_axis(float3x3 s, float3 start)
{
    bool local_2 = (bool)0;
    bool local_3 = (bool)0;

    const float _e4 = sym3_trace(s);
    const float3x3 _e7 = sym3_scale(s, (1.0 / _e4));
    const float3x3 _e9 = sym3_add_diagonal(_e7, -0.33333334);
    float squares = (dot(_e9[0], _e9[0]) + dot(_e9[1], _e9[1])) + dot(_e9[2], _e9[2]);
    float size = sqrt((squares * 0.16666667));
    const float3x3 _e26 = sym3_scale(_e9, (1.0 / size));
    const float _e27 = sym3_det(_e26);
    float r = 0.5 * _e27;
    const float3x3 _e35 = sym3_scale(_e26, ((r < 0.0) ? -1.0 : 1.0));
    float t_sqr = max((0.5 - (0.5 * abs(r))), 0.0);
    float series = 1.0 + (t_sqr * (0.09259259 + (t_sqr * (0.039609052 + (t_sqr * 0.023157675)))));
    float sine = (sqrt(t_sqr) * 0.6666667) * series;
    float cosine = sqrt((1.0 - (sine * sine)));
    float l_first = 2.0 * cosine;
    float l_second = (1.7320508 * sine) - cosine;
    float l_third = (-(1.7320508) * sine) - cosine;
    float3 bn = mul(start, _e35);
    float moment = dot(start, bn);
    float moment_sqr = dot(bn, bn);
    const float _e71 = sggx_overlap(l_first, moment, moment_sqr);
    float w_first = saturate(_e71);
    bool coincident = sine < 0.001;
    float rest = 1.0 - w_first;
    const float _e76 = sggx_overlap(l_second, moment, moment_sqr);
    float w_second = coincident ? rest : min(max(_e76, 0.0), rest);
    float w_third = (1.0 - w_first) - w_second;
    bool is_first = w_first >= max(w_second, w_third);
    float3 p = bn - (start * (is_first ? l_second : l_first));
    if (!(is_first)) {
        local_2 = w_second >= w_third;
    } else {
        local_2 = true;
    }
    bool _e94 = local_2;
    float other = _e94 ? l_third : l_second;
    float3 q = mul(p, _e35) - (p * other);
    if (coincident) {
        local_3 = !(is_first);
    } else {
        local_3 = false;
    }
    bool _e103 = local_3;
    float3 projected = normalize((_e103 ? p : q));
    const float _e106 = sym3_quadratic(_e35, projected);
    const float3x3 _e108 = sym3_add_diagonal(_e35, -(_e106));
    const float3x3 _e109 = sym3_adjugate(_e108);
    float3 refined = mul(projected, _e109);
    float refined_length = length(refined);
    bool far = refined_length > ((6.0 * 1.7320508) * 0.001);
    float3 axis = far ? (refined * (1.0 / refined_length)) : projected;
    float3 n = (size > 3e-6) ? axis : start;
    return (dot(n, start) < 0.0) ? -(n) : n;
}

#ifndef KINRAN_CONSTRUCTGGXSURFACE_HLSL
#define KINRAN_CONSTRUCTGGXSURFACE_HLSL
GgxSurface ConstructGgxSurface(float3 arg0, float3 arg1) {
    GgxSurface ret = (GgxSurface)0;
    ret.normal = arg0;
    ret.a = arg1;
    return ret;
}
#endif

/// `ggx_from_sggx` before the clamp of the roughness.
///
/// Cost on GCN: 268 instructions (12 at a quarter of the rate).
GgxSurface ggx_from_sggx_unclamped(float3x3 s, float3 mean_normal)
{
    const float3 _e2 = sggx_principal_axis(s, mean_normal);
    float3 n = (_e2.z < 0.0) ? -(_e2) : _e2;
    const float3x3 _e8 = m_n(n);
    float3 sx = mul(_e8[0], s);
    float3 sy = mul(_e8[1], s);
    const float _e13 = sym3_quadratic(s, n);
    float inv = 1.0 / max(_e13, 1e-30);
    const GgxSurface ggxsurface = ConstructGgxSurface(n, (float3(dot(_e8[0], sx), dot(_e8[0], sy), dot(_e8[1], sy)) * inv));
    return ggxsurface;
}

/// Normal and squared roughness matrix of a filtered SGGX matrix (slide: Our Algorithm, step 3). `mean_normal`, a unit
/// vector, picks the eigenvector as in `sggx_principal_axis`. The normal returned has z ≥ 0, eigenvalues of the
/// roughness lie in [0, 1]: a microsurface rougher than alpha = 1 is clamped, because no texture can hold it.
///
/// Cost on GCN: 321 instructions (17 at a quarter of the rate).
GgxSurface ggx_from_sggx(float3x3 s, float3 mean_normal)
{
    const GgxSurface _e2 = ggx_from_sggx_unclamped(s, mean_normal);
    const float3 _e7 = sym2_clamp_eigen(_e2.a, 0.0, 1.0);
    const GgxSurface ggxsurface = ConstructGgxSurface(_e2.normal, _e7);
    return ggxsurface;
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/skin_curvature.wesl, by ./x shaders. Needs: sym

// The curvature tensor of a vertex: four bytes, and the curvature towards a light.
//
// Curvature is 1/mm, convex is positive. A tensor is (xx, xy, yy) in the frame of the mesh's tangent and bitangent.
// Four bytes are a normalised vertex attribute; interpolate it as it is and decode in the pixel: means of codes
// decode to tensors without negative curvature.

#ifndef KINRAN_SKIN_CURVATURE_HLSL
#define KINRAN_SKIN_CURVATURE_HLSL


/// The largest curvature that four bytes hold where nothing else is said, 1/mm: a radius of 2 mm.
static const float CURVATURE_RANGE = 0.5;

/// Four numbers from 0 to 1 for a positive semi-definite `tensor` and a `mean` curvature, both up to `range`:
/// `sqrt(xx), rho, sqrt(yy), sqrt(mean)`, where `rho = xy / sqrt(xx yy)` is stored as `(127 rho + 128) / 255`, so that a
/// byte holds zero exactly.
///
/// Cost on GCN: 19 instructions (6 at a quarter of the rate).
float4 curvature_encode(float3 tensor, float mean, float range)
{
    float inverse = 1.0 / range;
    float xx = max(tensor.x, 0.0);
    float yy = max(tensor.z, 0.0);
    float product = sqrt((xx * yy));
    float rho = (product > 0.0) ? clamp((tensor.y / product), -1.0, 1.0) : 0.0;
    float3 roots = sqrt(saturate((float3(xx, yy, mean) * inverse)));
    return float4(roots.x, (((127.0 * rho) + 128.0) / 255.0), roots.y, roots.z);
}

/// Tensor (xyz) and mean curvature (w), 1/mm, from the four numbers of `curvature_encode`.
///
/// Cost on GCN: 10 instructions.
float4 curvature_decode(float4 texel, float range)
{
    float rho = (texel.y * 2.007874) - 1.007874;
    float a = range * texel.x;
    float b = texel.z;
    return float4((a * texel.x), ((a * b) * rho), ((range * b) * b), ((range * texel.w) * texel.w));
}

/// The curvature towards a light, 1/mm (slide: Skin Shading | Implementation, CurvatureFromLight): the tensor along the
/// light's tangent and bitangent components `u_tb`, not normalised. It is the directional curvature times the squared
/// sine between normal and light: right at the terminator, less towards the light, where the table hardly varies.
///
/// Cost on GCN: 7 instructions.
float curvature_from_light(float3 tensor, float2 u_tb)
{
    const float _e2 = sym2_quadratic(tensor, u_tb);
    return _e2;
}

/// The curvature in the direction of the light's projection on the tangent plane, 1/mm: `curvature_from_light` over the
/// squared length of `u_tb`. Where the light stands in the normal there is no direction, and within some 1e-3 rad of it
/// the result goes over to the mean.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
float curvature_from_light_normalized(float3 tensor, float2 u_tb)
{
    const float _e2 = sym2_quadratic(tensor, u_tb);
    const float _e3 = sym2_trace(tensor);
    return (_e2 + (5e-7 * _e3)) / (dot(u_tb, u_tb) + 1e-6);
}

#endif

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

#ifndef KINRAN_SKIN_LIGHTING_HLSL
#define KINRAN_SKIN_LIGHTING_HLSL


/// How far the normals of red, green and blue turn from the normal map's towards the mesh's (Penner 2011, section 1.4,
/// who leaves the numbers to the eye): the share of each channel's light that leaves farther than a pore is wide.
static const float3 SKIN_NORMAL_BLUR = float3(0.667, 0.209, 0.007);

/// Where the table of punctual light has its value for `n_u`, the unclamped cosine between normal and light, and a
/// curvature: x from the dark to the lit side, y from flat to `1 / inverse_range`. Sample with linear filtering and
/// clamped edges.
///
/// Cost on GCN: 2 instructions.
float2 skin_lut_uv(float n_u, float curvature, float inverse_range)
{
    return float2(((0.5 * n_u) + 0.5), (curvature * inverse_range));
}

/// Irradiance of skin under ambient light: `sh_irradiance` with bands 1 and 2 multiplied, for each channel, by what the
/// profile leaves of them at the mean curvature. Clamp what rings below zero.
///
/// Cost on GCN: 53 instructions.
float3 skin_irradiance(float3 radiance[9], float3 normal, float3 h_one, float3 h_two)
{
    const float _e4[9] = sh_basis(normal);
    float3 one = ((radiance[1] * _e4[1]) + (radiance[2] * _e4[2])) + (radiance[3] * _e4[3]);
    float3 two = ((((radiance[4] * _e4[4]) + (radiance[5] * _e4[5])) + (radiance[6] * _e4[6])) + (radiance[7] * _e4[7])) + (radiance[8] * _e4[8]);
    return (((3.1415927 * _e4[0]) * radiance[0]) + ((2.0943952 * h_one) * one)) + ((0.7853982 * h_two) * two);
}

/// The gloss of skin, without Fresnel's term: distribution times visibility of two GGX lobes, `alpha_one` with the weight
/// `1 - share` and `alpha_two` with `share`. One lobe is too tight at its foot or too wide at its top.
///
/// Cost on GCN: 40 instructions (8 at a quarter of the rate).
float skin_specular(float n_h, float n_u, float n_v, float alpha_one, float alpha_two, float share)
{
    const float _e6 = ggx_d(n_h, alpha_one);
    const float _e7 = smith_v(n_u, n_v, alpha_one);
    float one = _e6 * _e7;
    const float _e9 = ggx_d(n_h, alpha_two);
    const float _e10 = smith_v(n_u, n_v, alpha_two);
    float two = _e9 * _e10;
    return one + (share * (two - one));
}

/// The normal of one channel: from the normal map's `n` towards the mesh's `n_mesh` by `blur`, 0 to 1
/// (SKIN_NORMAL_BLUR). Gloss keeps `n`. They are less than 180° apart.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
float3 skin_normal(float3 n, float3 n_mesh, float blur)
{
    return normalize((n + (blur * (n_mesh - n))));
}

#endif
