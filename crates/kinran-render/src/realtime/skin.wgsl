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
    if !LAYERED {
        return Skin();
    }
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

// The share of the shadowed light that reaches skin, filtered over a square across the light: the shadow map is asked along
// lines from the point's tangent plane. What stands nearer than half the square's side casts no shadow, since hollows
// rise above the plane. Frames shift the lines, so that their mean is a continuous square.
fn skin_filtered_shadow(position: vec3f, normal: vec3f, direction: vec3f) -> f32 {
    let width = material.skin_shadow.x;
    let basis = m_n(select(direction, -direction, direction.z < 0.0));
    let slope = 1.0 / max(dot(normal, direction), 0.1);
    let m = frame.light_projection;
    let across = basis[0] - direction * (dot(basis[0], normal) * slope);
    let down = basis[1] - direction * (dot(basis[1], normal) * slope);
    let middle = (m * vec4f(position + 0.5 * width * direction, 1.0)).xyz;
    let x = (m * vec4f(width * across, 0.0)).xyz;
    let y = (m * vec4f(width * down, 0.0)).xyz;
    // Roberts's sequence.
    let shift = fract(0.5 + f32(frame.counts.w) * vec2f(0.75487767, 0.56984029));
    var lit = 0.0;
    for (var i = 0; i < 6; i++) {
        for (var j = 0; j < 6; j++) {
            let place = (vec2f(f32(i), f32(j)) + shift) / 6.0 - 0.5;
            let clip = middle + place.x * x + place.y * y;
            let uv = clip.xy * vec2f(0.5, -0.5) + 0.5;
            let seen = textureSampleCompareLevel(shadow_map, shadow_sampler, uv, clip.z);
            lit += select(seen, 1.0, any(abs(clip.xy) > vec2f(1.0)));
        }
    }
    return lit / 36.0;
}

// What part of a light skin gets in a penumbra that a filtered shadow of `lit` places it in.
fn skin_in_penumbra(lit: f32) -> vec3f {
    let place = vec2f(lit, material.skin_shadow.y);
    return textureSampleLevel(skin_penumbra_table, clamp_sampler, place, 0.0).rgb;
}

// Irradiance from all around.
fn skin_irradiance_at(skin: Skin, normal: vec3f) -> vec3f {
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
    return max(skin_irradiance(radiance, normal, h_one, h_two), vec3f(0.0));
}

// The lobe of skin for light from all around: a Lambert surface as much brighter as its harmonics are.
fn skin_around(skin: Skin, surface: Surface, lobe: Lobe) -> Lobe {
    var around = lobe;
    if frame.counts.y == 0u {
        return around;
    }
    var coefficients: array<vec3f, 9>;
    for (var i = 0; i < 9; i++) {
        coefficients[i] = frame.irradiance[i].rgb;
    }
    let plain = max(sh_evaluate(coefficients, surface.normal), vec3f(1e-6));
    around.diffuse *= skin_irradiance_at(skin, surface.normal) / plain;
    return around;
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
