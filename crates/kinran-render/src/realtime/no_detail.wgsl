// A material whose maps are its own; detail.wgsl is in this file's place where they are blended from tiles.

fn detail_base_color(in: Varying, own: vec4f) -> vec4f {
    return own;
}

// `own` is occlusion, roughness, metallic.
fn detail_data(in: Varying, own: vec3f) -> vec3f {
    return own;
}

fn detail_normal(in: Varying, own: vec3f) -> vec3f {
    return own;
}

fn detail_aniso(in: Varying, own: vec3f) -> vec3f {
    return own;
}
