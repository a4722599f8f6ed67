// A surface in light. The model is the reference renderer's: GGX with multiscatter compensation over Lambert, which has
// what the specular lobe leaves.

// Reflectance of a dielectric at normal incidence (glTF 2.0, appendix B).
const DIELECTRIC_F0: f32 = 0.04;
// Smallest cosine between shading normal and view.
const N_V_MIN: f32 = 1e-3;

struct Surface {
    position: vec3f,
    // Of the mesh, towards the viewer.
    geometric_normal: vec3f,
    normal: vec3f,
    tangent: vec3f,
    bitangent: vec3f,
    alpha_t: f32,
    alpha_b: f32,
    base_color: vec3f,
    metallic: f32,
    // Reflectance at normal incidence of what is not metal, and the share that there is of it.
    dielectric: vec3f,
    strength: f32,
    // 0 opaque, 1: what is not reflected passes through.
    transmissive: f32,
    // Share of the scattered light that comes out on the other side, and its colour.
    translucency: f32,
    translucent_color: vec3f,
    occlusion: f32,
    emitted: vec3f,
    opacity: f32,
    fuzz: Fuzz,
}

// What follows from a surface for one view.
struct Lobe {
    // View in the shading frame.
    v: vec3f,
    // At normal incidence, over what is reflected at grazing.
    base_reflectance: vec3f,
    // For light that is scattered more than once, times what is reflected at grazing.
    compensation: vec3f,
    // Directional albedo of the specular lobe.
    albedo: vec3f,
    diffuse: vec3f,
    // Albedo of the Lambert lobe for light from behind.
    translucent: vec3f,
    transmitted: vec3f,
}

// What a surface of this albedo scatters of a light, per steradian, without the cosine: Lambert's lobe. So it is also what is
// scattered of an irradiance.
fn diffuse_lobe(albedo: vec3f) -> vec3f {
    return albedo / PI;
}

// The part of the specular albedo that Schlick's (1 - v·h)^5 carries, from the reference renderer's table.
fn grazing_albedo(n_v: f32, alpha: f32) -> f32 {
    let size = vec2f(textureDimensions(albedo_map));
    let place = sqrt(saturate(vec2f(n_v, alpha)));
    return textureSampleLevel(albedo_map, clamp_sampler, (place * (size - 1.0) + 0.5) / size, 0.0).r;
}

fn lobe_of(surface: Surface, view: vec3f) -> Lobe {
    let v = vec3f(dot(surface.tangent, view), dot(surface.bitangent, view), max(dot(surface.normal, view), N_V_MIN));
    let alpha = ggx_albedo_alpha(v, surface.alpha_t, surface.alpha_b);
    let white = ggx_directional_albedo(v.z, alpha);
    let grazing = grazing_albedo(v.z, alpha);
    let weight = mix(surface.strength, 1.0, surface.metallic);
    let reflectance = mix(surface.strength * surface.dielectric, surface.base_color, surface.metallic);
    let base_reflectance = select(vec3f(0.0), reflectance / weight, weight > 0.0);
    let compensation = multiscatter_compensation(base_reflectance, v, surface.alpha_t, surface.alpha_b);
    let single = base_reflectance * (white - grazing) + grazing;

    let f0 = max(surface.dielectric.r, max(surface.dielectric.g, surface.dielectric.b));
    let dielectric = (f0 * (white - grazing) + grazing)
        * multiscatter_compensation(vec3f(f0), v, surface.alpha_t, surface.alpha_b).x;
    let inside = (1.0 - surface.metallic) * (1.0 - surface.strength * min(dielectric, 1.0));
    let scattered = inside * (1.0 - surface.transmissive);
    return Lobe(
        v,
        base_reflectance,
        weight * compensation,
        weight * min(single * compensation, vec3f(1.0)),
        surface.base_color * scattered * (1.0 - surface.translucency),
        surface.translucent_color * scattered * surface.translucency,
        surface.base_color * inside * surface.transmissive,
    );
}

struct Incident {
    direction: vec3f,
    irradiance: vec3f,
}

// What arrives from a punctual light (KHR_lights_punctual), without shadows.
fn incident(light: Light, position: vec3f) -> Incident {
    if light.position.w < 0.5 {
        return Incident(-light.direction.xyz, light.color.rgb);
    }
    let to_light = light.position.xyz - position;
    let distance_sqr = max(dot(to_light, to_light), 1e-12);
    let direction = to_light * inverseSqrt(distance_sqr);
    let ramp = saturate((-dot(direction, light.direction.xyz) - light.cone.y) / max(light.cone.x - light.cone.y, 1e-3));
    let falloff = select(1.0, ramp * ramp, light.position.w > 1.5);
    let ratio = distance_sqr / (light.direction.w * light.direction.w);
    let window = saturate(1.0 - ratio * ratio);
    return Incident(direction, light.color.rgb * (falloff * window / distance_sqr));
}

// The share of the shadowed light that reaches a point on the side of its surface that `normal` points to, by
// percentage-closer filtering over 3 × 3 texels, each of them filtered bilinearly.
fn shadow(position: vec3f, normal: vec3f, direction: vec3f) -> f32 {
    let size = f32(textureDimensions(shadow_map).x);
    // Lifted along the normal by what the plane of the surface rises over the filter's reach, two texels along both
    // axes, and half a texel for rounding: a surface in plain light is not its own shadow.
    let m = frame.light_projection;
    let texel = 2.0 / (size * length(vec3f(m[0].x, m[1].x, m[2].x)));
    let cosine = dot(normal, direction);
    let lift = texel * (0.5 + 2.8284 * sqrt(saturate(1.0 - cosine * cosine)));
    let clip = m * vec4f(position + normal * lift, 1.0);
    let uv = clip.xy * vec2f(0.5, -0.5) + 0.5;
    var lit = 0.0;
    for (var i = -1; i <= 1; i++) {
        for (var j = -1; j <= 1; j++) {
            let offset = vec2f(f32(i), f32(j)) / size;
            lit += textureSampleCompareLevel(shadow_map, shadow_sampler, uv + offset, clip.z);
        }
    }
    let outside = any(abs(clip.xy) > vec2f(1.0));
    return select(lit / 9.0, 1.0, outside);
}

// What comes through of a light from behind; `n_u` is the cosine between normal and light, not above zero.
fn from_behind(surface: Surface, lobe: Lobe, light: Light, incoming: Incident, n_u: f32) -> vec3f {
    if all(lobe.translucent == vec3f(0.0)) {
        return vec3f(0.0);
    }
    var visible = 1.0;
    if light.color.w > 0.5 {
        visible = shadow(surface.position, -surface.geometric_normal, incoming.direction);
    }
    return diffuse_lobe(lobe.translucent) * incoming.irradiance * (-n_u * visible);
}

// Specular lobe times nothing: per steradian, without the cosine. `u` lies above the horizon.
fn specular_anisotropic(surface: Surface, lobe: Lobe, u: vec3f) -> vec3f {
    let h = normalize(u + lobe.v);
    let d = ggx_aniso_d(h, surface.alpha_t, surface.alpha_b);
    let visibility = smith_aniso_v(u, lobe.v, surface.alpha_t, surface.alpha_b);
    return d * visibility * schlick_f(lobe.base_reflectance, dot(lobe.v, h)) * lobe.compensation;
}

fn specular_isotropic(surface: Surface, lobe: Lobe, u: vec3f) -> vec3f {
    let h = normalize(u + lobe.v);
    let d = ggx_d(saturate(h.z), surface.alpha_t);
    let visibility = smith_v(u.z, lobe.v.z, surface.alpha_t);
    return d * visibility * schlick_f(lobe.base_reflectance, dot(lobe.v, h)) * lobe.compensation;
}

// Lookups of the environment for a pixel's reflection; chosen by eye.
const TAPS: u32 = 8u;

// Light from all around, diffuse by spherical harmonics, specular by visible normals of the lobe, each reflecting the
// environment filtered to its share of the lobe (Krivanek, Colbert 2008). One frame's taps cover the lobe, so that it is
// smooth by itself; the n-th frame's are as narrow as those of n frames need be, so that their mean goes to the lobe's
// own. Taps count as differences to one lookup over the whole lobe, a control variate, so that a frame's light is right in
// the mean and exact where light is the same all around. They come in pairs half a turn apart: a tangent that turns round
// at a seam of the mesh changes nothing.
fn ambient(surface: Surface, lobe: Lobe) -> vec3f {
    if frame.counts.y == 0u {
        return vec3f(0.0);
    }
    var coefficients: array<vec3f, 9>;
    for (var i = 0; i < 9; i++) {
        coefficients[i] = frame.irradiance[i].rgb;
    }
    var diffuse = diffuse_lobe(lobe.diffuse) * max(sh_evaluate(coefficients, surface.normal), vec3f(0.0));
    if any(lobe.translucent > vec3f(0.0)) {
        diffuse += diffuse_lobe(lobe.translucent) * max(sh_evaluate(coefficients, -surface.normal), vec3f(0.0));
    }
    if frame.camera.w == 0.0 {
        return surface.occlusion * diffuse;
    }

    let to_world = mat3x3f(surface.tangent, surface.bitangent, surface.normal);
    let share = 1.0 / f32(TAPS * (frame.counts.w + 1u));
    // A lookup as wide as the lobe has the lobe's albedo; the taps add how far they are from it, by what they pass.
    let middle = normalize(to_world * vec3f(-lobe.v.xy, lobe.v.z));
    let wide = probe(middle, min(4.0 * PI * surface.alpha_t * surface.alpha_b, 2.0 * PI));
    let passed_by_view = 4.0 * lobe.v.z / (f32(TAPS) * smith_aniso_g1(lobe.v, surface.alpha_t, surface.alpha_b));
    var sum = vec3f(0.0);
    for (var i = 0u; i < TAPS; i++) {
        // The R2 sequence (Roberts 2018).
        let pair = f32((frame.counts.w * TAPS + i) / 2u);
        let xi = fract(0.5 + pair * vec2f(0.75487766, 0.56984029) + vec2f(0.5 * f32(i & 1u), 0.0));
        let h = ggx_vndf_sample(lobe.v, surface.alpha_t, surface.alpha_b, xi);
        let v_h = dot(lobe.v, h);
        let u = 2.0 * v_h * h - lobe.v;
        if u.z <= 0.0 {
            continue;
        }
        let density = ggx_vndf_pdf(lobe.v, h, surface.alpha_t, surface.alpha_b) / (4.0 * v_h);
        let passed = passed_by_view * smith_aniso_v(u, lobe.v, surface.alpha_t, surface.alpha_b) * u.z;
        let difference = probe(to_world * u, share / density) - wide;
        sum += passed * schlick_f(lobe.base_reflectance, v_h) * difference;
    }
    let specular = max(lobe.albedo * wide + lobe.compensation * sum, vec3f(0.0));
    return surface.occlusion * fuzz_over_ambient(surface.fuzz, diffuse, specular, coefficients);
}
