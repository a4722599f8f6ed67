// Skin by pre-integration (Penner, Borshukov 2011), with the talk's directional curvature. What the reference renderer does.

struct Skin {
    // See Material.skin.
    kind: u32,
    // The mesh's, not the normal map's.
    tangent: vec3f,
    bitangent: vec3f,
    // xx, xy, yy and mean, 1/mm.
    curvature: vec4f,
    normal_red: vec3f,
    normal_green: vec3f,
    normal_blue: vec3f,
}

fn skin_at(in: Varying, surface: Surface, front: bool) -> Skin {
    let mesh = normalize(in.normal);
    let n = surface.normal;
    return Skin(
        select(0u, u32(material.skin.x), front),
        normalize(in.tangent.xyz),
        normalize(in.tangent.w * cross(in.normal, in.tangent.xyz)),
        curvature_decode(in.curvature, material.skin.z),
        skin_normal(n, mesh, material.skin_gloss.x),
        skin_normal(n, mesh, material.skin_gloss.y),
        skin_normal(n, mesh, material.skin_gloss.z),
    );
}

fn skin_read(n_u: f32, curvature: f32) -> vec3f {
    return textureSampleLevel(skin_table, clamp_sampler, skin_lut_uv(n_u, curvature, material.skin.y), 0.0).rgb;
}

// What part of a light along `u` leaves the skin again, times pi. Where the mesh turns away, bumps do not turn it back into
// a light that they cannot see.
fn skin_punctual(skin: Skin, u: vec3f, turned_away: bool) -> vec3f {
    let cosines = vec3f(dot(skin.normal_red, u), dot(skin.normal_green, u), dot(skin.normal_blue, u));
    let n_u = min(cosines, vec3f(select(1.0, 0.0, turned_away)));
    let u_tb = vec2f(dot(skin.tangent, u), dot(skin.bitangent, u));
    var curvature = skin.curvature.w;
    switch skin.kind {
        case 1u: { return max(n_u, vec3f(0.0)); }
        case 3u: { curvature = curvature_from_light(skin.curvature.xyz, u_tb); }
        case 4u: { curvature = curvature_from_light_normalized(skin.curvature.xyz, u_tb); }
        default: {}
    }
    let red = skin_read(n_u.x, curvature);
    if all(material.skin_gloss.xyz == vec3f(0.0)) {
        return red;
    }
    return vec3f(red.r, skin_read(n_u.y, curvature).g, skin_read(n_u.z, curvature).b);
}

// Diffuse light from all around, of a surface whose other ambient light is without it.
fn skin_ambient(skin: Skin, surface: Surface, diffuse: vec3f) -> vec3f {
    if frame.counts.y == 0u {
        return vec3f(0.0);
    }
    // The frame has irradiance; the library wants radiance.
    let lobe = array<f32, 9>(PI, PI / 1.5, PI / 1.5, PI / 1.5, PI / 4.0, PI / 4.0, PI / 4.0, PI / 4.0, PI / 4.0);
    var radiance: array<vec3f, 9>;
    for (var i = 0; i < 9; i++) {
        radiance[i] = frame.irradiance[i].rgb / lobe[i];
    }
    var h_one = vec3f(1.0);
    var h_two = vec3f(1.0);
    if skin.kind > 1u {
        let at = skin.curvature.w * material.skin.y;
        h_one = textureSampleLevel(skin_ambient_table, clamp_sampler, vec2f(at, 0.25), 0.0).rgb;
        h_two = textureSampleLevel(skin_ambient_table, clamp_sampler, vec2f(at, 0.75), 0.0).rgb;
    }
    let irradiance = max(skin_irradiance(radiance, surface.normal, h_one, h_two), vec3f(0.0));
    return surface.occlusion * diffuse / PI * irradiance;
}

// The specular lobe with a second one, for `u` above the horizon.
fn skin_gloss(surface: Surface, lobe: Lobe, u: vec3f) -> vec3f {
    let h = normalize(u + lobe.v);
    let first = ggx_aniso_d(h, surface.alpha_t, surface.alpha_b)
        * smith_aniso_v(u, lobe.v, surface.alpha_t, surface.alpha_b);
    let second = ggx_d(h.z, material.skin.w) * smith_v(u.z, lobe.v.z, material.skin.w);
    let both = mix(first, second, material.skin_gloss.w);
    return both * schlick_f(lobe.base_reflectance, dot(lobe.v, h)) * lobe.compensation;
}

// Curvature in false colour: black flat, over red and yellow to white at the largest that vertices hold.
fn skin_false_color(curvature: f32) -> vec3f {
    return saturate(3.0 * curvature / material.skin.z - vec3f(0.0, 1.0, 2.0));
}
