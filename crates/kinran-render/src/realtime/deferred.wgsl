// The deferred path's lighting: Lambert and isotropic GGX with coloured specular, once for each pixel.

@group(1) @binding(0) var base_texture: texture_2d<f32>;
@group(1) @binding(1) var normal_texture: texture_2d<u32>;
@group(1) @binding(2) var factors_texture: texture_2d<f32>;
@group(1) @binding(3) var depth_texture: texture_depth_2d;

@vertex
fn everywhere(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn light(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let at = vec2i(pixel.xy);
    let depth = textureLoad(depth_texture, at, 0);
    if depth == 1.0 {
        discard;
    }
    let ndc = pixel.xy / frame.display.xy * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0);
    let world = frame.inverse_view_projection * vec4f(ndc, depth, 1.0);
    let base = textureLoad(base_texture, at, 0);
    let factors = textureLoad(factors_texture, at, 0);

    var surface: Surface;
    surface.position = world.xyz / world.w;
    surface.normal = octahedral_decode(textureLoad(normal_texture, at, 0).r);
    surface.geometric_normal = surface.normal;
    let frame_of = m_n(select(surface.normal, -surface.normal, surface.normal.z < 0.0));
    surface.tangent = frame_of[0];
    surface.bitangent = frame_of[1];
    surface.alpha_t = alpha_from_roughness(factors.r);
    surface.alpha_b = surface.alpha_t;
    surface.base_color = base.rgb;
    surface.metallic = factors.g;
    surface.dielectric = vec3f(DIELECTRIC_F0);
    surface.strength = 1.0;
    surface.occlusion = factors.b;
    surface.translucency = select(0.0, factors.a, base.a >= 0.5);
    surface.translucent_color = base.rgb;
    surface.opacity = 1.0;

    let view = normalize(frame.camera.xyz - surface.position);
    let lobe = lobe_of(surface, view);
    surface.fuzz = fuzz_simple(fuzziness_from_code(base.a * 255.0), surface.normal, view, lobe.diffuse);
    var sum = ambient(surface, lobe);
    for (var i = 0u; i < frame.counts.x; i++) {
        let light = frame.lights[i];
        let incoming = incident(light, surface.position);
        let u = vec3f(
            dot(surface.tangent, incoming.direction),
            dot(surface.bitangent, incoming.direction),
            dot(surface.normal, incoming.direction),
        );
        if u.z <= 0.0 {
            sum += from_behind(surface, lobe, light, incoming, u.z);
        }
        if u.z <= -FUZZ_WRAP || (u.z <= 0.0 && surface.fuzz.kind == FUZZ_NONE) {
            continue;
        }
        var visible = 1.0;
        if light.color.w > 0.5 {
            visible = shadow(surface.position, surface.geometric_normal, incoming.direction);
        }
        let reflected = (diffuse_lobe(lobe.diffuse) + specular_isotropic(surface, lobe, u)) * u.z;
        let lit = select(vec3f(0.0), reflected, u.z > 0.0);
        sum += fuzz_over(surface.fuzz, incoming.direction, lit, lobe.diffuse) * incoming.irradiance * visible;
    }
    return vec4f(sum, 1.0);
}
