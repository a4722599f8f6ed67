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
