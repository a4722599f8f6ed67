// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/frame.wesl, by ./x shaders. Needs: nothing else

// The frame in which an anisotropic texel lives.

#ifndef KINRAN_FRAME_GLSL
#define KINRAN_FRAME_GLSL

/// The shortest-arc rotation that takes z = (0, 0, 1) to the unit vector `n` (slide: Our Algorithm, step 1).
///
/// Its first two columns are the tangent and bitangent of every aniso texel; a Gram–Schmidt tangent differs from them
/// by 0.44° at a tilt of 10° and 18° at 60°, so decode with these. Orthonormal to 3e-7 for n.z ≥ 0; where `1 + n.z`
/// is below 1e-6 the half turn about x is returned, whose third column is −z.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
mat3 m_n(vec3 n) {
    float d = 1.0 + n.z;
    if (d < 1e-6) {
        return mat3(vec3(1.0, 0.0, 0.0), vec3(0.0, -1.0, 0.0), vec3(0.0, 0.0, -1.0));
    }
    float a = 1.0 / d;
    float xy = (-(n.x) * n.y) * a;
    return mat3(vec3((n.z + ((n.y * n.y) * a)), xy, -(n.x)), vec3(xy, (n.z + ((n.x * n.x) * a)), -(n.y)), n);
}

/// A unit normal from the xy of a normal map, each in [−1, 1]. Where x² + y² exceeds one, as compression and
/// filtering make it do, the normal lies on the horizon in the same direction.
///
/// Cost on GCN: 8 instructions (2 at a quarter of the rate).
vec3 normal_from_xy(float x, float y) {
    float xy_squared = (x * x) + (y * y);
    float scale = inversesqrt(max(xy_squared, 1.0));
    return vec3((x * scale), (y * scale), sqrt(max((1.0 - xy_squared), 0.0)));
}

#endif
