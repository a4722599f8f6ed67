// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/beckmann.wesl, by ./x shaders. Needs: nothing else

// The Beckmann distribution and LEAN mapping, to compare with.
//
// Beckmann, Spizzichino. The Scattering of Electromagnetic Waves from Rough Surfaces. 1963.
// Olano, Baker. LEAN Mapping. I3D 2010.

#ifndef KINRAN_BECKMANN_METAL
#define KINRAN_BECKMANN_METAL

#include <metal_stdlib>

/// Beckmann's sigma, the standard deviation of slopes, that stands for a GGX alpha (slide: LEAN Mapping):
/// `alpha / sqrt(2)`.
///
/// Cost on GCN: 1 instruction.
inline float sigma_from_alpha(
    float alpha
) {
    return alpha * 0.70710677;
}

/// The inverse of `sigma_from_alpha`.
///
/// Cost on GCN: 1 instruction.
inline float alpha_from_sigma(
    float sigma
) {
    return sigma * 1.4142135;
}

/// Distribution of microfacet normals per steradian with slope deviations `sigma_t`, `sigma_b` along x and y
/// (Beckmann 1963): `exp(-(x²/σt² + y²/σb²) / (2 z²)) / (2π σt σb z⁴)`, zero below the horizon.
///
/// Cost on GCN: 20 instructions (5 at a quarter of the rate).
inline float beckmann_aniso_d(
    metal::float3 h,
    float sigma_t,
    float sigma_b
) {
    if (h.z <= 0.000001) {
        return 0.0;
    }
    float z_sqr = h.z * h.z;
    float x = h.x / sigma_t;
    float y = h.y / sigma_b;
    return metal::exp((-0.5 * ((x * x) + (y * y))) / z_sqr) / ((((6.2831855 * sigma_t) * sigma_b) * z_sqr) * z_sqr);
}

/// Slope towards which a unit normal leans: `n.xy / n.z`. `n.z` must be positive.
///
/// Cost on GCN: 3 instructions (1 at a quarter of the rate).
inline metal::float2 slope_from_normal(
    metal::float3 n
) {
    return n.xy / metal::float2(n.z);
}

/// Unit normal of a slope.
///
/// Cost on GCN: 5 instructions (1 at a quarter of the rate).
inline metal::float3 normal_from_slope(
    metal::float2 slope
) {
    return metal::float3(slope, 1.0) * metal::rsqrt(1.0 + metal::dot(slope, slope));
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_hsv.wesl, by ./x shaders. Needs: nothing else

// Hue, saturation and value.

#ifndef KINRAN_DETAIL_HSV_METAL
#define KINRAN_DETAIL_HSV_METAL

#include <metal_stdlib>

/// A linear colour in [0, 1]³ with its hue turned by `shift.x` turns, its HSV saturation multiplied by `shift.y` and its
/// value by `shift.z`; `(0, 1, 1)` leaves it as it is. Both are clamped to 1 (Smith. Color gamut transform pairs. 1978).
///
/// Cost on GCN: 42 instructions (2 at a quarter of the rate).
inline metal::float3 hsv_shift(
    metal::float3 color,
    metal::float3 shift
) {
    float value = metal::max(color.x, metal::max(color.y, color.z));
    float chroma = value - metal::min(color.x, metal::min(color.y, color.z));
    float scale = 1.0 / metal::max(chroma, 0.00000000000000000001);
    metal::float3 differences = (color.yzx - color.zxy) * scale;
    float green_or_blue = (color.y >= value) ? (2.0 + differences.y) : (4.0 + differences.z);
    float sector = (color.x >= value) ? differences.x : green_or_blue;
    float hue = (sector * 0.16666667) + shift.x;
    float saturation = metal::saturate((chroma / metal::max(value, 0.00000000000000000001)) * shift.y);
    metal::float3 k = 6.0 * metal::fract(metal::float3(hue) + metal::float3(0.0, 0.6666667, 0.33333334));
    metal::float3 weight = metal::saturate(metal::abs(k - metal::float3(3.0)) - metal::float3(1.0));
    return metal::saturate(value * shift.z) * (metal::float3(1.0) + ((weight - metal::float3(1.0)) * saturation));
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_normal.wesl, by ./x shaders. Needs: nothing else

// Normals laid over each other.

#ifndef KINRAN_DETAIL_NORMAL_METAL
#define KINRAN_DETAIL_NORMAL_METAL

#include <metal_stdlib>

/// Reoriented normal mapping: the unit normal `detail` in the frame of the unit normal `base`, both with z ≥ 0; equals
/// `m_n(base) * detail` (slide: Detail Maps; Barré-Brisebois and Hill. Blending in Detail. 2012). In detail mapping
/// the synthesized normal is the base.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
inline metal::float3 rnm(
    metal::float3 base,
    metal::float3 detail
) {
    metal::float3 t = base + metal::float3(0.0, 0.0, 1.0);
    metal::float3 u = detail * metal::float3(-1.0, -1.0, 1.0);
    return (t * (metal::dot(t, u) / t.z)) - u;
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_over.wesl, by ./x shaders. Needs: nothing else

// Alpha blending, for aniso texels.

#ifndef KINRAN_DETAIL_OVER_METAL
#define KINRAN_DETAIL_OVER_METAL

#include <metal_stdlib>

/// The texel `detail` over the texel `s` with opacity `alpha` in [0, 1] (slide: Detail Maps, "aniso maps blended with
/// regular alpha blending"). Every mixture of aniso texels decodes to a positive semi-definite matrix.
///
/// Cost on GCN: 6 instructions.
inline metal::float3 detail_over(
    metal::float3 s,
    metal::float3 detail,
    float alpha
) {
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

#ifndef KINRAN_DETAIL_OVERLAY_METAL
#define KINRAN_DETAIL_OVERLAY_METAL

#include <metal_stdlib>

/// Overlay of a detail `d` by a synthesized value `s`, both in [0, 1] (slide: Detail Maps | Our Approach):
/// `2sd` below s = 1/2, `1 - 2(1-s)(1-d)` from there on.
///
/// Cost on GCN: 7 instructions.
inline float overlay(
    float s,
    float d
) {
    return (s < 0.5) ? ((2.0 * s) * d) : (1.0 - ((2.0 * (1.0 - s)) * (1.0 - d)));
}

/// `overlay` of each channel.
///
/// Cost on GCN: 21 instructions.
inline metal::float3 overlay_color(
    metal::float3 s,
    metal::float3 d
) {
    return metal::select(metal::float3(1.0) - ((2.0 * (metal::float3(1.0) - s)) * (metal::float3(1.0) - d)), (2.0 * s) * d, s < metal::float3(0.5));
}

/// The talk's smooth overlay, finer near `t = d` where a dark detail is brightened (slide: Detail Maps | Blending): as
/// `overlay`, but `lerp(2sd, s, (2s-1)²)` where s ≥ 1/2 and d < 1/2.
///
/// Cost on GCN: 13 instructions.
inline float smooth_overlay(
    float s,
    float d
) {
    float x = (2.0 * s) - 1.0;
    float low = (2.0 * s) * d;
    float bright = 1.0 - ((2.0 * (1.0 - s)) * (1.0 - d));
    float dark = low + (((s - low) * x) * x);
    return (s < 0.5) ? low : ((d < 0.5) ? dark : bright);
}

/// `smooth_overlay` of each channel.
///
/// Cost on GCN: 39 instructions.
inline metal::float3 smooth_overlay_color(
    metal::float3 s,
    metal::float3 d
) {
    metal::float3 x = (2.0 * s) - metal::float3(1.0);
    metal::float3 low = (2.0 * s) * d;
    metal::float3 bright = metal::float3(1.0) - ((2.0 * (metal::float3(1.0) - s)) * (metal::float3(1.0) - d));
    metal::float3 dark = low + (((s - low) * x) * x);
    return metal::select(metal::select(bright, dark, d < metal::float3(0.5)), low, s < metal::float3(0.5));
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/frame.wesl, by ./x shaders. Needs: nothing else

// The frame in which an anisotropic texel lives.

#ifndef KINRAN_FRAME_METAL
#define KINRAN_FRAME_METAL

#include <metal_stdlib>

/// The shortest-arc rotation that takes z = (0, 0, 1) to the unit vector `n` (slide: Our Algorithm, step 1).
///
/// Its first two columns are the tangent and bitangent of every aniso texel; a Gram–Schmidt tangent differs from them
/// by 0.44° at a tilt of 10° and 18° at 60°, so decode with these. Orthonormal to 3e-7 for n.z ≥ 0; where `1 + n.z`
/// is below 1e-6 the half turn about x is returned, whose third column is −z.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
inline metal::float3x3 m_n(
    metal::float3 n
) {
    float d = 1.0 + n.z;
    if (d < 0.000001) {
        return metal::float3x3(metal::float3(1.0, 0.0, 0.0), metal::float3(0.0, -1.0, 0.0), metal::float3(0.0, 0.0, -1.0));
    }
    float a = 1.0 / d;
    float xy = (-(n.x) * n.y) * a;
    return metal::float3x3(metal::float3(n.z + ((n.y * n.y) * a), xy, -(n.x)), metal::float3(xy, n.z + ((n.x * n.x) * a), -(n.y)), n);
}

/// A unit normal from the xy of a normal map, each in [−1, 1]. Where x² + y² exceeds one, as compression and
/// filtering make it do, the normal lies on the horizon in the same direction.
///
/// Cost on GCN: 8 instructions (2 at a quarter of the rate).
inline metal::float3 normal_from_xy(
    float x,
    float y
) {
    float xy_squared = (x * x) + (y * y);
    float scale = metal::rsqrt(metal::max(xy_squared, 1.0));
    return metal::float3(x * scale, y * scale, metal::sqrt(metal::max(1.0 - xy_squared, 0.0)));
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/multiscatter.wesl, by ./x shaders. Needs: nothing else

// Energy that microfacet models lose between the facets, given back.
//
// Turquin. Practical multiple scattering compensation for microfacet models. 2019.

#ifndef KINRAN_MULTISCATTER_METAL
#define KINRAN_MULTISCATTER_METAL

#include <metal_stdlib>

/// Directional albedo of the single-scattering GGX lobe with height-correlated Smith masking and F = 1, for a view at
/// cosine `n_v` (0 to 1): the share of a white furnace that comes back, 0.307 (= 1 − ln 2) to 1. A rational fit,
/// within 0.011 of quadrature (0.004 RMS) for alpha and n_v in [0.005, 1]; it takes the place of a lookup table.
///
/// Cost on GCN: 27 instructions (1 at a quarter of the rate).
inline float ggx_directional_albedo(
    float n_v,
    float alpha
) {
    float m_sqr = n_v * n_v;
    float a_sqr = alpha * alpha;
    float p = (((0.00023917 + (0.004272 * alpha)) + (0.014007 * a_sqr)) + (((0.1302 - (0.075028 * alpha)) + (3.2169 * a_sqr)) * n_v)) + (((-0.03449 - (0.18897 * alpha)) + (0.089879 * a_sqr)) * m_sqr);
    float q = (((-0.000019263 + (0.0054598 * alpha)) + (1.0288 * a_sqr)) + (((0.0019317 - (1.1331 * alpha)) + (5.3123 * a_sqr)) * n_v)) + (((1.0 - (1.3516 * alpha)) - (0.3803 * a_sqr)) * m_sqr);
    return metal::clamp(1.0 - ((alpha * p) / q), 0.3, 1.0);
}

/// Factor on the single-scattering lobe that restores the energy of all further bounces, `1 + f0 (1/E - 1)` (Turquin
/// 2019, eq. 16), per pixel. The factor depends on the view alone, so the compensated lobe is not reciprocal. An
/// anisotropic lobe uses the isotropic albedo at `alpha = sqrt((alpha_t² + alpha_b²)/2)`.
///
/// Cost on GCN: 38 instructions (3 at a quarter of the rate).
inline metal::float3 multiscatter_compensation(
    metal::float3 f0_,
    float n_v,
    float alpha_t,
    float alpha_b
) {
    float alpha = metal::sqrt(0.5 * ((alpha_t * alpha_t) + (alpha_b * alpha_b)));
    float _e11 = ggx_directional_albedo(metal::saturate(n_v), alpha);
    return metal::float3(1.0) + (f0_ * ((1.0 / _e11) - 1.0));
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

#ifndef KINRAN_SH_METAL
#define KINRAN_SH_METAL

#include <metal_stdlib>

#ifndef KINRAN_FLOAT9ARRAY_METAL
#define KINRAN_FLOAT9ARRAY_METAL
struct Float9Array {
    float inner[9];
};
#endif

#ifndef KINRAN_FLOAT3X9ARRAY_METAL
#define KINRAN_FLOAT3X9ARRAY_METAL
struct Float3x9Array {
    metal::float3 inner[9];
};
#endif

/// The basis functions at a unit direction.
///
/// Cost on GCN: 14 instructions.
inline Float9Array sh_basis(
    metal::float3 direction
) {
    float x = direction.x;
    float y = direction.y;
    float z = direction.z;
    return Float9Array {{0.2820948, 0.48860252 * y, 0.48860252 * z, 0.48860252 * x, (1.0925484 * x) * y, (1.0925484 * y) * z, 0.31539157 * (((3.0 * z) * z) - 1.0), (1.0925484 * x) * z, 0.5462742 * ((x * x) - (y * y))}};
}

/// The function that the coefficients stand for, at a unit direction; negative where it rings.
///
/// Cost on GCN: 41 instructions.
inline metal::float3 sh_evaluate(
    Float3x9Array coefficients,
    metal::float3 direction
) {
    Float9Array _e2 = sh_basis(direction);
    return ((((((((coefficients.inner[0] * _e2.inner[0]) + (coefficients.inner[1] * _e2.inner[1])) + (coefficients.inner[2] * _e2.inner[2])) + (coefficients.inner[3] * _e2.inner[3])) + (coefficients.inner[4] * _e2.inner[4])) + (coefficients.inner[5] * _e2.inner[5])) + (coefficients.inner[6] * _e2.inner[6])) + (coefficients.inner[7] * _e2.inner[7])) + (coefficients.inner[8] * _e2.inner[8]);
}

/// Coefficients of irradiance from those of radiance (eq. 7), once per environment; `sh_evaluate` of the result is
/// `sh_irradiance`, three multiplications a coefficient cheaper.
///
/// Cost on GCN: 27 instructions.
inline Float3x9Array sh_convolve_cosine(
    Float3x9Array radiance
) {
    return Float3x9Array {{radiance.inner[0] * 3.1415927, radiance.inner[1] * 2.0943952, radiance.inner[2] * 2.0943952, radiance.inner[3] * 2.0943952, radiance.inner[4] * 0.7853982, radiance.inner[5] * 0.7853982, radiance.inner[6] * 0.7853982, radiance.inner[7] * 0.7853982, radiance.inner[8] * 0.7853982}};
}

/// Irradiance on a surface with unit `normal`, the integral of radiance times the clamped cosine. Light from one small
/// spot can make it slightly negative on the far side; clamp where that matters.
///
/// Cost on GCN: 65 instructions.
inline metal::float3 sh_irradiance(
    Float3x9Array radiance,
    metal::float3 normal
) {
    Float3x9Array _e2 = sh_convolve_cosine(radiance);
    metal::float3 _e3 = sh_evaluate(_e2, normal);
    return _e3;
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sym.wesl, by ./x shaders. Needs: nothing else

// Symmetric matrices. A 2×2 one is a vec3f (xx, xy, yy), so that sums and scalings are the language's own; a 3×3
// one is a mat3x3f.

#ifndef KINRAN_SYM_METAL
#define KINRAN_SYM_METAL

#include <metal_stdlib>

/// Eigenvalues of a positive semi-definite 2×2 matrix and the unit eigenvector of the larger.
struct SymEigen {
    float larger;
    float smaller;
    metal::float2 axis;
};

/// The 2×2 matrix with eigenvalue `l1` along the unit vector `axis` and `l2` across it.
///
/// Cost on GCN: 11 instructions.
inline metal::float3 sym2_from_eigen(
    float l1_,
    float l2_,
    metal::float2 axis
) {
    return metal::float3(((l1_ * axis.x) * axis.x) + ((l2_ * axis.y) * axis.y), ((l1_ - l2_) * axis.x) * axis.y, ((l1_ * axis.y) * axis.y) + ((l2_ * axis.x) * axis.x));
}

/// `v v^T`.
///
/// Cost on GCN: 3 instructions.
inline metal::float3 sym2_outer(
    metal::float2 v
) {
    return metal::float3(v.x * v.x, v.x * v.y, v.y * v.y);
}

/// Determinant of a 2×2 matrix.
///
/// Cost on GCN: 2 instructions.
inline float sym2_det(
    metal::float3 a
) {
    return (a.x * a.z) - (a.y * a.y);
}

/// Trace of a 2×2 matrix.
///
/// Cost on GCN: 1 instruction.
inline float sym2_trace(
    metal::float3 a
) {
    return a.x + a.z;
}

/// `v^T A v`.
///
/// Cost on GCN: 7 instructions.
inline float sym2_quadratic(
    metal::float3 a,
    metal::float2 v
) {
    return (((a.x * v.x) * v.x) + (((2.0 * a.y) * v.x) * v.y)) + ((a.z * v.y) * v.y);
}

/// Eigenvalues and axis of a positive semi-definite matrix, both at least zero. The axis has x ≥ 0 (and y = +1
/// where x = 0) and is (1, 0) when both eigenvalues are equal. The smaller is `det / larger`, which keeps its digits
/// where the textbook's half difference cancels.
///
/// Cost on GCN: 33 instructions (5 at a quarter of the rate).
inline SymEigen sym2_eigen(
    metal::float3 a
) {
    bool local = {};
    float half_difference = 0.5 * (a.x - a.z);
    float radius = metal::sqrt((half_difference * half_difference) + (a.y * a.y));
    float larger = (0.5 * (a.x + a.z)) + radius;
    if (!((radius <= (0.000000000001 * larger)))) {
        local = larger <= 0.0;
    } else {
        local = true;
    }
    bool _e27 = local;
    if (_e27) {
        return SymEigen {metal::max(larger, 0.0), metal::max(larger - (2.0 * radius), 0.0), metal::float2(1.0, 0.0)};
    }
    float _e39 = sym2_det(a);
    float smaller = metal::min(metal::max(_e39 / larger, 0.0), larger);
    float long_ = metal::sqrt(0.5 + ((0.5 * metal::abs(half_difference)) / radius));
    float short_ = (0.5 * metal::abs(a.y)) / (radius * long_);
    float side = (a.y < 0.0) ? -1.0 : 1.0;
    metal::float2 axis = (half_difference >= 0.0) ? metal::float2(long_, side * short_) : metal::float2(short_, side * long_);
    return SymEigen {larger, smaller, axis};
}

/// The same eigenvectors with both eigenvalues clamped to `[lo, hi]`, `lo` ≥ 0. A matrix within the range comes back
/// as it is.
///
/// Cost on GCN: 54 instructions (5 at a quarter of the rate).
inline metal::float3 sym2_clamp_eigen(
    metal::float3 a,
    float lo,
    float hi
) {
    bool local = {};
    SymEigen _e3 = sym2_eigen(a);
    metal::float3 _e9 = sym2_from_eigen(metal::clamp(_e3.larger, lo, hi), metal::clamp(_e3.smaller, lo, hi), _e3.axis);
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
inline metal::float3 sym2_sqrt(
    metal::float3 a
) {
    float _e1 = sym2_det(a);
    float root_det = metal::sqrt(metal::max(_e1, 0.0));
    float _e5 = sym2_trace(a);
    float scale = metal::sqrt(_e5 + (2.0 * root_det));
    if (scale == 0.0) {
        return metal::float3(0.0);
    }
    return (a + metal::float3(root_det, 0.0, root_det)) * (1.0 / scale);
}

/// `v^T A v`.
///
/// Cost on GCN: 12 instructions.
inline float sym3_quadratic(
    metal::float3x3 a,
    metal::float3 v
) {
    return metal::dot(v, a * v);
}

/// Trace of a 3×3 matrix.
///
/// Cost on GCN: 2 instructions.
inline float sym3_trace(
    metal::float3x3 a
) {
    return (a[0].x + a[1].y) + a[2].z;
}

/// The adjugate of a symmetric matrix: `A adj(A) = det(A) I`. Its columns are the cross products of A's.
///
/// Cost on GCN: 18 instructions.
inline metal::float3x3 sym3_adjugate(
    metal::float3x3 a
) {
    return metal::float3x3(metal::cross(a[1], a[2]), metal::cross(a[2], a[0]), metal::cross(a[0], a[1]));
}

/// Determinant of a symmetric 3×3 matrix.
///
/// Cost on GCN: 9 instructions.
inline float sym3_det(
    metal::float3x3 a
) {
    return metal::dot(a[0], metal::cross(a[1], a[2]));
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

#ifndef KINRAN_ANISO_METAL
#define KINRAN_ANISO_METAL

#include <metal_stdlib>


/// What a light needs of an aniso texel.
struct AnisoDecoded {
    float alpha_t;
    float alpha_b;
    char _pad2[8];
    metal::float3 tangent;
    metal::float3 bitangent;
};

/// Smallest GGX roughness to shade with: one step of an 8-bit aniso channel.
constant float ALPHA_MIN = 0.003921569;

/// GGX alpha of a perceptual roughness in [0, 1]: its square, at least ALPHA_MIN.
///
/// Cost on GCN: 2 instructions.
inline float alpha_from_roughness(
    float roughness
) {
    return metal::max(roughness * roughness, ALPHA_MIN);
}

/// GGX alpha of a gloss in [0, 1]: `(1 - gloss)²`, at least ALPHA_MIN.
///
/// Cost on GCN: 3 instructions.
inline float alpha_from_gloss(
    float gloss
) {
    float _e3 = alpha_from_roughness(1.0 - gloss);
    return _e3;
}

/// Texel of a squared roughness matrix `s` (xx, xy, yy); each component in [0, 1]. rho is 0 where Sxx or Syy is 0.
///
/// Cost on GCN: 11 instructions (3 at a quarter of the rate).
inline metal::float3 aniso_encode(
    metal::float3 s
) {
    float product = s.x * s.z;
    float rho = (product > 0.0) ? metal::clamp(s.y * metal::rsqrt(product), -1.0, 1.0) : 0.0;
    return metal::float3(metal::sqrt(metal::saturate(s.x)), (0.5 * rho) + 0.5, metal::sqrt(metal::saturate(s.z)));
}

/// Squared roughness matrix (xx, xy, yy) of a texel: positive semi-definite for every texel in [0, 1]³.
///
/// With `ggx_matrix_d` and `smith_matrix_v` this is all the decoding a light needs: cheaper than `aniso_decode` for a
/// few lights. Add `sym2_clamp_eigen` where a determinant of zero would divide.
///
/// Cost on GCN: 5 instructions.
inline metal::float3 aniso_decode_matrix(
    metal::float3 texel
) {
    return metal::float3(texel.x * texel.x, (texel.x * ((texel.y * 2.0) - 1.0)) * texel.z, texel.z * texel.z);
}

/// Principal roughnesses and directions of a texel (slide: Our Algorithm, `DecodeSggx`), in the frame of the two unit
/// vectors given, which are the first two columns of `m_n` brought to world space.
///
/// Differs from the slide in two points. alpha_b is `sqrt(det) / alpha_t` with `det = Sxx Syy (1 - rho²)`, where the
/// slide's half difference cancels. And Sxy = 0 counts as positive: with HLSL's `sign`, which is zero there, the
/// tangent vanishes on every texel aligned with the bitangent. The axis comes from cos² and sin² of its angle, within
/// 0.03° of the exact one.
///
/// Cost on GCN: 37 instructions (5 at a quarter of the rate).
inline AnisoDecoded aniso_decode(
    metal::float3 texel,
    metal::float3 tangent,
    metal::float3 bitangent
) {
    float rho = (texel.y * 2.0) - 1.0;
    float product = texel.x * texel.z;
    float sxy = product * rho;
    float sxx = texel.x * texel.x;
    float syy = texel.z * texel.z;
    float half_difference = (0.5 * (sxx - syy)) + 0.000000000001;
    float discr_sqr = 4.0 * ((half_difference * half_difference) + (sxy * sxy));
    float discr_rcp = metal::rsqrt(discr_sqr);
    float alpha_t_sqr = 0.5 * ((sxx + syy) + (discr_sqr * discr_rcp));
    float alpha_t_rcp = metal::rsqrt(alpha_t_sqr);
    float alpha_t = alpha_t_sqr * alpha_t_rcp;
    float alpha_b = (product * metal::sqrt(1.0 - (rho * rho))) * alpha_t_rcp;
    float c_sqr = metal::saturate((half_difference * discr_rcp) + 0.5);
    float c = metal::sqrt(c_sqr);
    float s_abs = metal::sqrt(1.0 - c_sqr);
    float s = (sxy < 0.0) ? -(s_abs) : s_abs;
    return AnisoDecoded {metal::clamp(alpha_t, ALPHA_MIN, 1.0), metal::clamp(alpha_b, ALPHA_MIN, 1.0), {}, (c * tangent) + (s * bitangent), (c * bitangent) - (s * tangent)};
}

/// Squared roughness matrix (xx, xy, yy) with `alpha_t` along the unit vector `axis` of the `m_n` frame, `alpha_b`
/// across.
///
/// Cost on GCN: 13 instructions.
inline metal::float3 aniso_from_alphas(
    float alpha_t,
    float alpha_b,
    metal::float2 axis
) {
    metal::float3 _e5 = sym2_from_eigen(alpha_t * alpha_t, alpha_b * alpha_b, axis);
    return _e5;
}

/// Direction in the `m_n` frame of a direction painted in the mesh's tangent plane: what Gram–Schmidt, `d - (d·n) n`,
/// makes of it. Both are unit vectors; where nothing is left of it, the direction stays as it is.
///
/// Cost on GCN: 23 instructions (2 at a quarter of the rate).
inline metal::float2 axis_from_direction(
    metal::float2 direction,
    metal::float3 n
) {
    metal::float3x3 _e2 = m_n(n);
    metal::float2 axis = metal::float2(metal::dot(_e2[0].xy, direction), metal::dot(_e2[1].xy, direction));
    float length_squared = metal::dot(axis, axis);
    return (length_squared > 0.000000000001) ? (axis * metal::rsqrt(length_squared)) : direction;
}

/// The inverse of `axis_from_direction`: the unit direction in the mesh's tangent plane that Gram–Schmidt against `n`
/// turns into `axis` of the `m_n` frame.
///
/// Cost on GCN: 31 instructions (2 at a quarter of the rate).
inline metal::float2 direction_from_axis(
    metal::float2 axis,
    metal::float3 n
) {
    metal::float3x3 _e2 = m_n(n);
    metal::float3 t = (_e2[0] * axis.x) + (_e2[1] * axis.y);
    metal::float2 d = (t.xy * n.z) - (t.z * n.xy);
    float length_squared = metal::dot(d, d);
    return (length_squared > 0.000000000001) ? (d * metal::rsqrt(length_squared)) : axis;
}

/// Principal alphas (alpha_t, alpha_b) of `KHR_materials_anisotropy`: `alpha_b = roughness²`,
/// `alpha_t = mix(alpha_b, 1, strength²)`.
///
/// Cost on GCN: 5 instructions.
inline metal::float2 alphas_from_khr_anisotropy(
    float roughness,
    float strength
) {
    float _e2 = alpha_from_roughness(roughness);
    return metal::float2(_e2 + (((1.0 - _e2) * strength) * strength), _e2);
}

/// Perceptual roughness and anisotropy strength of `KHR_materials_anisotropy` for `alpha_t ≥ alpha_b`; the inverse of
/// `alphas_from_khr_anisotropy`.
///
/// Cost on GCN: 8 instructions (3 at a quarter of the rate).
inline metal::float2 khr_anisotropy_from_alphas(
    float alpha_t,
    float alpha_b
) {
    float rest = 1.0 - alpha_b;
    float strength = (rest > 0.0) ? metal::sqrt(metal::saturate((alpha_t - alpha_b) / rest)) : 0.0;
    return metal::float2(metal::sqrt(alpha_b), strength);
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_layer.wesl, by ./x shaders. Needs: aniso

// What a tiled layer's texels go through before they are blended: place, colour, direction, mask. Between `detail_uv`
// and the rest stands the texture fetch, with the hardware's filter and its repeating or mirroring address mode.

#ifndef KINRAN_DETAIL_LAYER_METAL
#define KINRAN_DETAIL_LAYER_METAL

#include <metal_stdlib>


/// The synthesized value of a texel in [0, 1]: byte 128 is 1/2, 1 and 0 are 0, 255 is 1. Without this mapping 8 bits do
/// not hold the neutral 1/2, and a detail equal to its target would come out 0.4 % off.
///
/// Cost on GCN: 6 instructions.
inline metal::float3 detail_from_texel(
    metal::float3 texel
) {
    return metal::saturate((texel * 1.003937) - metal::float3(0.003937008));
}

/// Place in the tile: the mesh's `uv` scaled and rotated by `matrix`, then moved. The matrix is
/// `KHR_texture_transform`'s, with columns `(cos sx, -sin sx)` and `(sin sy, cos sy)`.
///
/// Cost on GCN: 4 instructions.
inline metal::float2 detail_uv(
    metal::float2 uv,
    metal::float2x2 matrix_,
    metal::float2 offset
) {
    return (matrix_ * uv) + offset;
}

/// Signs that mirrored tiling gives the directions in a tile at `uv`: −1 along an axis in every other tile.
///
/// Cost on GCN: 6 instructions.
inline metal::float2 detail_mirror(
    metal::float2 uv
) {
    return metal::float2(1.0) - (4.0 * metal::fract(0.5 * metal::floor(uv)));
}

/// Opacity of a layer: the mask's contrast raised around 1/2. `contrast` 1 leaves it as it is, 0 makes it 1/2.
///
/// Cost on GCN: 2 instructions.
inline float detail_mask(
    float mask,
    float contrast
) {
    return metal::saturate(((mask - 0.5) * contrast) + 0.5);
}

/// A tile's normal in the mesh's tangent space. `rotation` is the cosine and sine of the layer's rotation, `mirror` what
/// `detail_mirror` says, or ones. A change of scale leaves slopes as they are.
///
/// Cost on GCN: 6 instructions.
inline metal::float3 detail_turn_normal(
    metal::float3 n,
    metal::float2 rotation,
    metal::float2 mirror
) {
    metal::float2 xy = n.xy * mirror;
    return metal::float3((rotation.x * xy.x) + (rotation.y * xy.y), (rotation.x * xy.y) - (rotation.y * xy.x), n.z);
}

/// A tile's aniso texel in the mesh's tangent space; as `detail_turn_normal`.
///
/// Cost on GCN: 32 instructions (3 at a quarter of the rate).
inline metal::float3 detail_turn_aniso(
    metal::float3 texel,
    metal::float2 rotation,
    metal::float2 mirror
) {
    metal::float3 _e3 = aniso_decode_matrix(texel);
    float xy = (_e3.y * mirror.x) * mirror.y;
    float c = rotation.x;
    float s = rotation.y;
    float across = ((2.0 * c) * s) * xy;
    metal::float3 _e42 = aniso_encode(metal::float3((((c * c) * _e3.x) + across) + ((s * s) * _e3.z), ((c * s) * (_e3.z - _e3.x)) + (((c * c) - (s * s)) * xy), (((s * s) * _e3.x) - across) + ((c * c) * _e3.z)));
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

#ifndef KINRAN_GGX_METAL
#define KINRAN_GGX_METAL

#include <metal_stdlib>


/// The smallest positive normal number: keeps divisions finite.
constant float MIN_POSITIVE = 0.000000000000000000000000000000000000011754944;

/// 1 / π.
constant float FRAC_1_PI = 0.31830987;

/// Isotropic distribution of microfacet normals per steradian, `n_h = n·h` (Walter 2007, eq. 33). One ulp of `n_h`
/// moves the peak by `2.4e-7 / alpha²`; where that matters, `ggx_aniso_d` has all the digits.
///
/// Cost on GCN: 10 instructions (1 at a quarter of the rate).
inline float ggx_d(
    float n_h,
    float alpha
) {
    float a_sqr = alpha * alpha;
    float q = ((1.0 - n_h) * (1.0 + n_h)) + ((a_sqr * n_h) * n_h);
    return (a_sqr * FRAC_1_PI) / (q * q);
}

/// Anisotropic distribution of microfacet normals per steradian (slide: Our Algorithm, the form with
/// `(alpha_t alpha_b)^3`), for `h` in the upper hemisphere. Its integral against n·h over there is one.
///
/// Cost on GCN: 12 instructions (1 at a quarter of the rate).
inline float ggx_aniso_d(
    metal::float3 h,
    float alpha_t,
    float alpha_b
) {
    float alpha_tb = alpha_t * alpha_b;
    metal::float3 v = metal::float3(h.x * alpha_b, h.y * alpha_t, h.z * alpha_tb);
    float w = alpha_tb / metal::dot(v, v);
    return ((alpha_tb * FRAC_1_PI) * w) * w;
}

/// `ggx_aniso_d` from the squared roughness matrix `a` (xx, xy, yy), with no eigen decode:
/// `|A|^(3/2) / (π (h.xy^T adj(A) h.xy + |A| h.z²)²)`. `|A|` must be positive.
///
/// Cost on GCN: 17 instructions (2 at a quarter of the rate).
inline float ggx_matrix_d(
    metal::float3 h,
    metal::float3 a
) {
    float _e2 = sym2_det(a);
    float _e9 = sym2_quadratic(metal::float3(a.z, -(a.y), a.x), h.xy);
    float w = _e2 / (_e9 + ((_e2 * h.z) * h.z));
    return ((metal::rsqrt(_e2) * FRAC_1_PI) * w) * w;
}

/// Visibility from the two terms of `2 n·u n·v (1 + Λ(u) + Λ(v))`: `n·v |u'|` and `n·u |v'|`, where the prime
/// stretches a direction by the roughness. Finite, and meaningless, where both directions graze.
///
/// Cost on GCN: 3 instructions (1 at a quarter of the rate).
inline float smith_v_of_terms(
    float u,
    float v
) {
    return 0.5 / metal::max(u + v, MIN_POSITIVE);
}

/// Height-correlated Smith visibility `G2 / (4 n·u n·v)`, isotropic (Heitz 2014, eq. 99).
///
/// Cost on GCN: 12 instructions (3 at a quarter of the rate).
inline float smith_v(
    float n_u,
    float n_v,
    float alpha
) {
    float a_sqr = alpha * alpha;
    float v = n_u * metal::sqrt(((n_v * n_v) * (1.0 - a_sqr)) + a_sqr);
    float u = n_v * metal::sqrt(((n_u * n_u) * (1.0 - a_sqr)) + a_sqr);
    float _e18 = smith_v_of_terms(u, v);
    return _e18;
}

/// Height-correlated Smith visibility `G2 / (4 n·u n·v)`, anisotropic (Heitz 2014, eq. 99 with the lambda of section
/// 5.3). `u` and `v` lie in the upper hemisphere.
///
/// Cost on GCN: 16 instructions (3 at a quarter of the rate).
inline float smith_aniso_v(
    metal::float3 u,
    metal::float3 v,
    float alpha_t,
    float alpha_b
) {
    metal::float3 stretch = metal::float3(alpha_t, alpha_b, 1.0);
    float _e14 = smith_v_of_terms(v.z * metal::length(u * stretch), u.z * metal::length(v * stretch));
    return _e14;
}

/// `smith_aniso_v` from the squared roughness matrix `a` (xx, xy, yy), with no eigen decode.
///
/// Cost on GCN: 21 instructions (3 at a quarter of the rate).
inline float smith_matrix_v(
    metal::float3 u,
    metal::float3 v,
    metal::float3 a
) {
    float _e4 = sym2_quadratic(a, u.xy);
    float stretched_u = metal::sqrt(_e4 + (u.z * u.z));
    float _e11 = sym2_quadratic(a, v.xy);
    float stretched_v = metal::sqrt(_e11 + (v.z * v.z));
    float _e21 = smith_v_of_terms(v.z * stretched_u, u.z * stretched_v);
    return _e21;
}

/// Smith masking of `v` alone, 0 to 1 (Heitz 2014, eq. 43).
///
/// Cost on GCN: 10 instructions (2 at a quarter of the rate).
inline float smith_aniso_g1(
    metal::float3 v,
    float alpha_t,
    float alpha_b
) {
    return (2.0 * v.z) / (v.z + metal::length(v * metal::float3(alpha_t, alpha_b, 1.0)));
}

/// Fresnel reflectance by Schlick's approximation (1994) from `f0` at normal incidence to one at grazing.
///
/// Cost on GCN: 10 instructions.
inline metal::float3 schlick_f(
    metal::float3 f0_1,
    float v_h
) {
    float m = metal::saturate(1.0 - v_h);
    float m_sqr = m * m;
    return f0_1 + ((metal::float3(1.0) - f0_1) * ((m_sqr * m_sqr) * m));
}

/// A microfacet normal distributed as `ggx_vndf_pdf` for the view direction `v`, from two uniform numbers in [0, 1)
/// (Dupuy, Benyoub 2023, listing 3).
///
/// Cost on GCN: 32 instructions (5 at a quarter of the rate).
inline metal::float3 ggx_vndf_sample(
    metal::float3 v,
    float alpha_t,
    float alpha_b,
    metal::float2 xi
) {
    metal::float3 stretch = metal::float3(alpha_t, alpha_b, 1.0);
    metal::float3 v_std = metal::normalize(v * stretch);
    float phi = 6.2831855 * xi.x;
    float z = ((1.0 - xi.y) * (1.0 + v_std.z)) - v_std.z;
    float sin_theta = metal::sqrt(metal::max(1.0 - (z * z), 0.0));
    metal::float3 cap = metal::float3(sin_theta * metal::cos(phi), sin_theta * metal::sin(phi), z);
    metal::float3 h = (cap + v_std) * stretch;
    float length_squared = metal::dot(h, h);
    return (length_squared > 0.0) ? (h * metal::rsqrt(length_squared)) : metal::float3(0.0, 0.0, 1.0);
}

/// Density per steradian of microfacet normals visible from `v`: `G1(v) max(v·h, 0) D(h) / n·v` (Heitz 2014, eq. 16).
/// Divide by `4 v·h` for the density of the reflected direction.
///
/// Cost on GCN: 29 instructions (3 at a quarter of the rate).
inline float ggx_vndf_pdf(
    metal::float3 v,
    metal::float3 h,
    float alpha_t,
    float alpha_b
) {
    if (h.z <= 0.0) {
        return 0.0;
    }
    float g_over_n_v = 2.0 / (v.z + metal::length(v * metal::float3(alpha_t, alpha_b, 1.0)));
    float _e20 = ggx_aniso_d(h, alpha_t, alpha_b);
    return (g_over_n_v * metal::max(metal::dot(v, h), 0.0)) * _e20;
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sggx.wesl, by ./x shaders. Needs: frame, sym

// SGGX matrices: a normal and its anisotropic roughness as one thing that can be averaged.
//
// Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

#ifndef KINRAN_SGGX_METAL
#define KINRAN_SGGX_METAL

#include <metal_stdlib>


/// A surface: unit normal, and squared roughness matrix (xx, xy, yy) in the frame of `m_n`.
struct GgxSurface {
    metal::float3 normal;
    metal::float3 a;
};

/// A distribution of slopes: centre and squared roughness (xx, xy, yy), both dimensionless.
struct SlopeDistribution {
    metal::float2 m;
    char _pad1[8];
    metal::float3 a;
};

/// `S = M_n [A 0; 0 1] M_n^T` (slide: Our Algorithm, step 1): the SGGX matrix of a GGX surface with unit normal `n`
/// and squared roughness matrix `a` (xx, xy, yy) in the frame of `m_n`.
///
/// Cost on GCN: 51 instructions (1 at a quarter of the rate).
inline metal::float3x3 sggx_from_ggx(
    metal::float3 n,
    metal::float3 a
) {
    metal::float3x3 _e2 = m_n(n);
    metal::float3 ax = (_e2[0] * a.x) + (_e2[1] * a.y);
    metal::float3 ay = (_e2[0] * a.y) + (_e2[1] * a.z);
    return metal::float3x3(((ax * _e2[0].x) + (ay * _e2[1].x)) + (n * n.x), ((ax * _e2[0].y) + (ay * _e2[1].y)) + (n * n.y), ((ax * _e2[0].z) + (ay * _e2[1].z)) + (n * n.z));
}

/// Area of the microflakes projected along the unit vector `w`: `sqrt(w^T S w)` (Heitz 2015).
///
/// Cost on GCN: 14 instructions (1 at a quarter of the rate).
inline float sggx_projected_area(
    metal::float3x3 s,
    metal::float3 w
) {
    float _e2 = sym3_quadratic(s, w);
    return metal::sqrt(metal::max(_e2, 0.0));
}

/// Distribution of microflake normals at the unit vector `h`, a density per steradian over the sphere:
/// `1 / (π sqrt|S| (h^T S^-1 h)^2)` (Heitz 2015), written as `|S|^(3/2) / (π (h^T adj(S) h)^2)`. `s` must have a
/// positive determinant. Single precision leaves a relative error of 1e-5 over the smallest eigenvalue.
///
/// Cost on GCN: 39 instructions (2 at a quarter of the rate).
inline float sggx_d(
    metal::float3x3 s,
    metal::float3 h
) {
    float _e2 = sym3_det(s);
    metal::float3x3 _e3 = sym3_adjugate(s);
    float _e4 = sym3_quadratic(_e3, h);
    return (_e2 * metal::sqrt(_e2)) / ((3.1415927 * _e4) * _e4);
}

/// The slope distribution an SGGX matrix with zz > 0 stands for, seen from the z axis: `S / S_zz = [A + m m^T, m;
/// m^T, 1]`. The slopes follow a bivariate Student-t with two degrees of freedom.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
inline SlopeDistribution slopes_from_sggx(
    metal::float3x3 s
) {
    float inv = 1.0 / s[2].z;
    metal::float2 m = s[2].xy * inv;
    metal::float3 a = (metal::float3(s[0].x, s[0].y, s[1].y) * inv) - metal::float3(m.x * m.x, m.x * m.y, m.y * m.y);
    return SlopeDistribution {m, {}, a};
}

/// The SGGX matrix with zz = 1 of a slope distribution; the inverse of `slopes_from_sggx`.
///
/// Cost on GCN: 3 instructions.
inline metal::float3x3 sggx_from_slopes(
    metal::float2 m,
    metal::float3 a
) {
    float xy = a.y + (m.x * m.y);
    return metal::float3x3(metal::float3(a.x + (m.x * m.x), xy, m.x), metal::float3(xy, a.z + (m.y * m.y), m.y), metal::float3(m, 1.0));
}

/// The talk's power iteration (slide: Our Algorithm, step 3): `steps` times `n = S n / |S n|` from `start`. The
/// tangent of the error shrinks by the ratio of the two largest eigenvalues a step; in V grooves steeper than 45° it
/// leaves the surface for its walls. `sggx_principal_axis` has neither fault.
///
/// Cost on GCN: 34 instructions (2 at a quarter of the rate), one round of its loop.
inline metal::float3 sggx_power_iteration(
    metal::float3x3 s,
    metal::float3 start,
    uint steps
) {
    metal::float3 n = {};
    uint i = 0u;
    float _e3 = sym3_trace(s);
    float scale = 1.0 / metal::max(_e3, 0.000000000000000000000000000001);
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
            metal::float3 _e13 = n;
            metal::float3 next = (s * _e13) * scale;
            float length_squared = metal::dot(next, next);
            metal::float3 _e17 = n;
            n = (length_squared > 0.0) ? (next * metal::rsqrt(length_squared)) : _e17;
        }
    }
    metal::float3 _e26 = n;
    return _e26;
}

/// Squared overlap with the eigenvector of `l`, from the moments m' B m and |B m|² of a deviator of unit size.
///
/// Cost on GCN: 7 instructions (1 at a quarter of the rate).
inline float sggx_overlap(
    float l,
    float moment,
    float moment_sqr
) {
    return (((moment_sqr + (l * moment)) + (l * l)) - 3.0) / (((3.0 * l) * l) - 3.0);
}

/// The unit eigenvector of `s` with the largest overlap with the unit vector `start`, signed to agree with it.
/// Started at the mean normal of a footprint it finds the filtered normal, also where the largest eigenvalue is
/// another one (V grooves steeper than 45°). Where eigenvalues coincide, to 0.1 % of their spread, it is the
/// projection of `start` on their space; `start` itself if `s` is a multiple of the identity. No trigonometry.
///
/// Cost on GCN: 204 instructions (10 at a quarter of the rate).
inline metal::float3 sggx_principal_axis(
    metal::float3x3 s,
    metal::float3 start
) {
    bool local_2 = {};
    bool local_3 = {};
    metal::float3x3 identity = metal::float3x3(metal::float3(1.0, 0.0, 0.0), metal::float3(0.0, 1.0, 0.0), metal::float3(0.0, 0.0, 1.0));
    float _e17 = sym3_trace(s);
    metal::float3x3 deviator = (s * (1.0 / _e17)) - (identity * 0.33333334);
    float squares = (metal::dot(deviator[0], deviator[0]) + metal::dot(deviator[1], deviator[1])) + metal::dot(deviator[2], deviator[2]);
    float size = metal::sqrt(squares * 0.16666667);
    metal::float3x3 unit = deviator * (1.0 / size);
    float _e41 = sym3_det(unit);
    float r = 0.5 * _e41;
    metal::float3x3 b = unit * ((r < 0.0) ? -1.0 : 1.0);
    float t_sqr = metal::max(0.5 - (0.5 * metal::abs(r)), 0.0);
    float series = 1.0 + (t_sqr * (0.09259259 + (t_sqr * (0.039609052 + (t_sqr * 0.023157675)))));
    float sine = (metal::sqrt(t_sqr) * 0.6666667) * series;
    float cosine = metal::sqrt(1.0 - (sine * sine));
    float l_first = 2.0 * cosine;
    float l_second = (1.7320508 * sine) - cosine;
    float l_third = (-(1.7320508) * sine) - cosine;
    metal::float3 bn = b * start;
    float moment = metal::dot(start, bn);
    float moment_sqr = metal::dot(bn, bn);
    float _e85 = sggx_overlap(l_first, moment, moment_sqr);
    float w_first = metal::saturate(_e85);
    bool coincident = sine < 0.001;
    float rest = 1.0 - w_first;
    float _e90 = sggx_overlap(l_second, moment, moment_sqr);
    float w_second = coincident ? rest : metal::min(metal::max(_e90, 0.0), rest);
    float w_third = (1.0 - w_first) - w_second;
    bool is_first = w_first >= metal::max(w_second, w_third);
    metal::float3 p = bn - (start * (is_first ? l_second : l_first));
    if (!(is_first)) {
        local_2 = w_second >= w_third;
    } else {
        local_2 = true;
    }
    bool _e108 = local_2;
    float other = _e108 ? l_third : l_second;
    metal::float3 q = (b * p) - (p * other);
    if (coincident) {
        local_3 = !(is_first);
    } else {
        local_3 = false;
    }
    bool _e117 = local_3;
    metal::float3 projected = metal::normalize(_e117 ? p : q);
    float _e120 = sym3_quadratic(b, projected);
    metal::float3x3 _e123 = sym3_adjugate(b - (identity * _e120));
    metal::float3 refined = _e123 * projected;
    float refined_length = metal::length(refined);
    bool far = refined_length > ((6.0 * 1.7320508) * 0.001);
    metal::float3 axis = far ? (refined * (1.0 / refined_length)) : projected;
    metal::float3 n = (size > 0.000003) ? axis : start;
    return (metal::dot(n, start) < 0.0) ? -(n) : n;
}

/// `ggx_from_sggx` before the clamp of the roughness.
///
/// Cost on GCN: 268 instructions (12 at a quarter of the rate).
inline GgxSurface ggx_from_sggx_unclamped(
    metal::float3x3 s,
    metal::float3 mean_normal
) {
    metal::float3 _e2 = sggx_principal_axis(s, mean_normal);
    metal::float3 n = (_e2.z < 0.0) ? -(_e2) : _e2;
    metal::float3x3 _e8 = m_n(n);
    metal::float3 sx = s * _e8[0];
    metal::float3 sy = s * _e8[1];
    float _e13 = sym3_quadratic(s, n);
    float inv = 1.0 / metal::max(_e13, 0.000000000000000000000000000001);
    return GgxSurface {n, metal::float3(metal::dot(_e8[0], sx), metal::dot(_e8[0], sy), metal::dot(_e8[1], sy)) * inv};
}

/// Normal and squared roughness matrix of a filtered SGGX matrix (slide: Our Algorithm, step 3). `mean_normal`, a unit
/// vector, picks the eigenvector as in `sggx_principal_axis`. The normal returned has z ≥ 0, eigenvalues of the
/// roughness lie in [0, 1]: a microsurface rougher than alpha = 1 is clamped, because no texture can hold it.
///
/// Cost on GCN: 321 instructions (17 at a quarter of the rate).
inline GgxSurface ggx_from_sggx(
    metal::float3x3 s,
    metal::float3 mean_normal
) {
    GgxSurface _e2 = ggx_from_sggx_unclamped(s, mean_normal);
    metal::float3 _e7 = sym2_clamp_eigen(_e2.a, 0.0, 1.0);
    return GgxSurface {_e2.normal, _e7};
}

#endif
