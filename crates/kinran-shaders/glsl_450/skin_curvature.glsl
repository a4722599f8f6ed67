// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/skin_curvature.wesl, by ./x shaders. Needs: sym

// The curvature tensor of a vertex: four bytes, and the curvature towards a light.
//
// Curvature is 1/mm, convex is positive. A tensor is (xx, xy, yy) in the frame of the mesh's tangent and bitangent.
// Four bytes are a normalised vertex attribute; interpolate it as it is and decode in the pixel: means of codes
// decode to tensors without negative curvature.

#ifndef KINRAN_SKIN_CURVATURE_GLSL
#define KINRAN_SKIN_CURVATURE_GLSL

#include "sym.glsl"

/// The largest curvature that four bytes hold where nothing else is said, 1/mm: a radius of 2 mm.
const float CURVATURE_RANGE = 0.5;

/// Four numbers from 0 to 1 for a positive semi-definite `tensor` and a `mean` curvature, both up to `range`:
/// `sqrt(xx), rho, sqrt(yy), sqrt(mean)`, where `rho = xy / sqrt(xx yy)` is stored as `(127 rho + 128) / 255`, so that a
/// byte holds zero exactly.
///
/// Cost on GCN: 19 instructions (6 at a quarter of the rate).
vec4 curvature_encode(vec3 tensor, float mean, float range) {
    float inverse_ = 1.0 / range;
    float xx = max(tensor.x, 0.0);
    float yy = max(tensor.z, 0.0);
    float product = sqrt((xx * yy));
    float rho = (product > 0.0) ? clamp((tensor.y / product), -1.0, 1.0) : 0.0;
    vec3 roots = sqrt(clamp((vec3(xx, yy, mean) * inverse_), vec3(0.0), vec3(1.0)));
    return vec4(roots.x, (((127.0 * rho) + 128.0) / 255.0), roots.y, roots.z);
}

/// Tensor (xyz) and mean curvature (w), 1/mm, from the four numbers of `curvature_encode`.
///
/// Cost on GCN: 10 instructions.
vec4 curvature_decode(vec4 texel, float range) {
    float rho = (texel.y * 2.007874) - 1.007874;
    float a = range * texel.x;
    float b = texel.z;
    return vec4((a * texel.x), ((a * b) * rho), ((range * b) * b), ((range * texel.w) * texel.w));
}

/// The curvature towards a light, 1/mm (slide: Skin Shading | Implementation, CurvatureFromLight): the tensor along the
/// light's tangent and bitangent components `u_tb`, not normalised. It is the directional curvature times the squared
/// sine between normal and light: right at the terminator, less towards the light, where the table hardly varies.
///
/// Cost on GCN: 7 instructions.
float curvature_from_light(vec3 tensor, vec2 u_tb) {
    float _e2 = sym2_quadratic(tensor, u_tb);
    return _e2;
}

/// The curvature in the direction of the light's projection on the tangent plane, 1/mm: `curvature_from_light` over the
/// squared length of `u_tb`. Where the light stands in the normal there is no direction, and within some 1e-3 rad of it
/// the result goes over to the mean.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
float curvature_from_light_normalized(vec3 tensor, vec2 u_tb) {
    float _e2 = sym2_quadratic(tensor, u_tb);
    float _e3 = sym2_trace(tensor);
    return (_e2 + (5e-7 * _e3)) / (dot(u_tb, u_tb) + 1e-6);
}

#endif
