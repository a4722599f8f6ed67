// Adds a jittered frame to the sum of those before.

@group(1) @binding(0) var sum_texture: texture_2d<f32>;
@group(1) @binding(1) var frame_texture: texture_2d<f32>;

@vertex
fn everywhere(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

// w counts the frames.
@fragment
fn add(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let at = vec2i(pixel.xy);
    return textureLoad(sum_texture, at, 0) + vec4f(textureLoad(frame_texture, at, 0).rgb, 1.0);
}
