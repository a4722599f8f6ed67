// The shadow map: depth from a directional light.

@vertex
fn depth(@location(0) position: vec3f) -> @builtin(position) vec4f {
    return frame.light_projection * vec4f(position, 1.0);
}
