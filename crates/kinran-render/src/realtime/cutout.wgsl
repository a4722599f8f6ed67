// The shadow map where materials have holes.

@vertex
fn cutout_depth(in: Vertex) -> Varying {
    let clip = frame.light_projection * vec4f(in.position, 1.0);
    return Varying(clip, in.position, in.normal, in.tangent, in.uvs, in.color, in.curvature);
}

@fragment
fn cutout(in: Varying) {
    if base_color_at(in).a < material.factors.z {
        discard;
    }
}
