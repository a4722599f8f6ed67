// What a person may want to look at instead of the picture.

// `picture`, or the channel of the surface that the frame asks for; `at` is where its normal map is read.
fn shown(surface: Surface, picture: vec3f, at: vec2f) -> vec3f {
    // Twice the angle, since a direction of roughness has no sign, as hue; the world's x and z span the circle.
    let doubled = 2.0 * atan2(surface.tangent.z, surface.tangent.x);
    let hue = 0.5 + 0.5 * cos(vec3f(doubled) + vec3f(0.0, 2.0944, 4.1888));
    let texels = vec2f(textureDimensions(normal_map));
    let footprint = max(length(dpdx(at) * texels), length(dpdy(at) * texels));
    switch frame.counts.z {
        case 1u: { return surface.normal * 0.5 + 0.5; }
        case 2u: { return vec3f(surface.alpha_t); }
        case 3u: { return vec3f(surface.alpha_b); }
        case 4u: { return hue * (1.0 - surface.alpha_b / surface.alpha_t); }
        case 5u: { return vec3f(saturate(log2(max(footprint, 1.0)) / 10.0)); }
        case 6u: { return surface.base_color; }
        default: { return picture; }
    }
}
