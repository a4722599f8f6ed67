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
