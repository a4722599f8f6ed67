// The G-buffer of the deferred path.
//
// base:    rgb base colour (sRGB), a: translucent in the top bit, fuzziness in the other seven.
// normal:  unit normal, octahedral, 16 bits a component in one word.
// factors: r perceptual roughness, g metallic, b occlusion, a: where translucent, the share of the scattered light that
//          comes out on the other side, in the base colour.
// What a surface emits goes straight to the picture.

struct GBuffer {
    @location(0) base: vec4f,
    @location(1) normal: u32,
    @location(2) factors: vec4f,
    @location(3) emitted: vec4f,
}

@fragment
fn fill(in: Varying, @builtin(front_facing) front: bool) -> GBuffer {
    let surface = surface_at(in, front);
    if surface.opacity == 0.0 {
        discard;
    }
    let roughness = sqrt(sqrt(surface.alpha_t * surface.alpha_b));
    let fuzziness = select(0.0, surface.fuzz.amount, surface.fuzz.kind == FUZZ_SIMPLE);
    return GBuffer(
        vec4f(surface.base_color, fuzziness_code(fuzziness, f32(surface.translucency > 0.0)) / 255.0),
        octahedral_encode(surface.normal),
        vec4f(roughness, surface.metallic, surface.occlusion, surface.translucency),
        vec4f(surface.emitted, 1.0),
    );
}
