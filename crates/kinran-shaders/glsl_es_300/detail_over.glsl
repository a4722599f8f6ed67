// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_over.wesl, by ./x shaders. Needs: nothing else

// Alpha blending, for aniso texels.

#ifndef KINRAN_DETAIL_OVER_GLSL
#define KINRAN_DETAIL_OVER_GLSL

/// The texel `detail` over the texel `s` with opacity `alpha` in [0, 1] (slide: Detail Maps, "aniso maps blended with
/// regular alpha blending"). Every mixture of aniso texels decodes to a positive semi-definite matrix.
///
/// Cost on GCN: 6 instructions.
vec3 detail_over(vec3 s, vec3 detail, float alpha) {
    return s + ((detail - s) * alpha);
}

#endif
