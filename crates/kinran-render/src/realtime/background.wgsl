// What is seen where there is no surface.

struct Sky {
    @builtin(position) clip: vec4f,
    @location(0) ndc: vec2f,
}

@vertex
fn far(@builtin(vertex_index) index: u32) -> Sky {
    let ndc = vec2f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0);
    return Sky(vec4f(ndc, 1.0, 1.0), ndc);
}

@fragment
fn sky(in: Sky) -> @location(0) vec4f {
    let world = frame.inverse_view_projection * vec4f(in.ndc, 1.0, 1.0);
    return vec4f(background(normalize(world.xyz / world.w - frame.camera.xyz)), 1.0);
}
