// The forward path: anisotropic GGX, and whatever else does not fit into the G-buffer.

fn lit(surface: Surface, lobe: Lobe, skin: Skin) -> vec3f {
    var around = lobe;
    if skin.kind > 0u {
        around = skin_around(skin, surface, lobe);
    }
    var sum = surface.emitted + ambient(surface, around);
    for (var i = 0u; i < frame.counts.x; i++) {
        let light = frame.lights[i];
        let incoming = incident(light, surface.position);
        let u = vec3f(
            dot(surface.tangent, incoming.direction),
            dot(surface.bitangent, incoming.direction),
            dot(surface.normal, incoming.direction),
        );
        if skin.kind > 0u {
            // Where the mesh turns away, the table says how far light comes around it.
            let turned_away = dot(surface.geometric_normal, incoming.direction) <= 0.0;
            var direct = select(1.0, 0.0, turned_away);
            var scattered = vec3f(1.0);
            if light.color.w > 0.5 && !turned_away {
                if material.skin_shadow.x > 0.0 {
                    direct = skin_filtered_shadow(surface.position, surface.geometric_normal, incoming.direction);
                    scattered = skin_in_penumbra(direct);
                } else {
                    direct = shadow(surface.position, surface.geometric_normal, incoming.direction);
                    scattered = vec3f(direct);
                }
            }
            let cosine = skin_punctual(skin, incoming.direction, turned_away);
            var gloss = vec3f(0.0);
            if u.z > 0.0 && direct > 0.0 {
                gloss = skin_gloss(surface, lobe, u) * u.z;
            }
            let diffuse = diffuse_lobe(lobe.diffuse) * scattered;
            sum += fuzz_over_skin(surface.fuzz, incoming.direction, diffuse, cosine, gloss, direct)
                * incoming.irradiance;
            continue;
        }
        if u.z <= 0.0 {
            sum += from_behind(surface, lobe, light, incoming, u.z);
        }
        if u.z <= 0.0 && surface.fuzz.kind == FUZZ_NONE {
            continue;
        }
        var visible = 1.0;
        if light.color.w > 0.5 {
            visible = shadow(surface.position, surface.geometric_normal, incoming.direction);
        }
        let base = (diffuse_lobe(lobe.diffuse) + specular_anisotropic(surface, lobe, u)) * u.z;
        let lit = select(vec3f(0.0), base, u.z > 0.0);
        sum += fuzz_over(surface.fuzz, incoming.direction, lit, lobe.diffuse) * incoming.irradiance * visible;
    }
    return sum;
}

@fragment
fn opaque(in: Varying, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let surface = surface_at(in, front);
    if surface.opacity == 0.0 {
        discard;
    }
    let view = normalize(frame.camera.xyz - in.position);
    let skin = skin_at(in, surface, front);
    if frame.counts.z == 7u {
        return vec4f(skin_false_color(skin.curvature.w), 1.0);
    }
    return vec4f(shown(surface, lit(surface, lobe_of(surface, view), skin), uv(in, 0u)), 1.0);
}

// What a blended surface adds to what is behind it.
@fragment
fn blended(in: Varying, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let surface = surface_at(in, front);
    let view = normalize(frame.camera.xyz - in.position);
    return vec4f(surface.opacity * lit(surface, lobe_of(surface, view), skin_at(in, surface, front)), 1.0);
}

// What a blended surface leaves of what is behind it.
@fragment
fn transmittance(in: Varying, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let surface = surface_at(in, front);
    let view = normalize(frame.camera.xyz - in.position);
    let through = 1.0 - surface.opacity + surface.opacity * lobe_of(surface, view).transmitted;
    return vec4f(through, 1.0);
}
