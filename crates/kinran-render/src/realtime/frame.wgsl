// What every pass of a frame knows: camera, light, and how light from all around is looked up.

const MAX_LIGHTS: u32 = 16;
const PI: f32 = 3.14159265;

struct Light {
    // xyz position, w: 0 directional, 1 point, 2 spot.
    position: vec4f,
    // xyz unit direction in which light travels, w range.
    direction: vec4f,
    // rgb lux or candela, w: 1 when the shadow map is this light's.
    color: vec4f,
    // x cosine of the inner, y of the outer cone angle.
    cone: vec4f,
}

struct Frame {
    view_projection: mat4x4f,
    inverse_view_projection: mat4x4f,
    // World to the shadow map's clip space.
    light_projection: mat4x4f,
    // xyz position, w: 0 when the environment is not reflected.
    camera: vec4f,
    // rgb, w: 1 when the environment is seen instead.
    background: vec4f,
    // Irradiance of the environment.
    irradiance: array<vec4f, 9>,
    // x lights, y 1: there is an environment, z the channel shown, w the frame.
    counts: vec4u,
    // xy size in pixels, z exposure factor, w tone curve.
    display: vec4f,
    lights: array<Light, MAX_LIGHTS>,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var environment_map: texture_2d<f32>;
@group(0) @binding(2) var albedo_map: texture_2d<f32>;
@group(0) @binding(3) var shadow_map: texture_depth_2d;
@group(0) @binding(4) var around_sampler: sampler;
@group(0) @binding(5) var clamp_sampler: sampler;
@group(0) @binding(6) var shadow_sampler: sampler_comparison;

// Texture coordinates of a direction in an equirectangular image: the centre is -z, +y the top row.
fn equirectangular(direction: vec3f) -> vec2f {
    let u = 0.5 + atan2(direction.x, -direction.z) / (2.0 * PI);
    return vec2f(u, acos(clamp(direction.y, -1.0, 1.0)) / PI);
}

// The environment's mean radiance over `solid_angle` about `direction`.
fn probe(direction: vec3f, solid_angle: f32) -> vec3f {
    let size = vec2f(textureDimensions(environment_map));
    // Rows narrow towards the poles, the last one to the sine of half a row.
    let narrowing = max(sqrt(saturate(1.0 - direction.y * direction.y)), 0.5 * PI / size.y);
    let texel = 2.0 * PI * PI / (size.x * size.y) * narrowing;
    let level = 0.5 * log2(solid_angle / texel);
    return textureSampleLevel(environment_map, around_sampler, equirectangular(direction), level).rgb;
}

fn background(direction: vec3f) -> vec3f {
    if frame.background.w < 0.5 {
        return frame.background.rgb;
    }
    return textureSampleLevel(environment_map, around_sampler, equirectangular(direction), 0.0).rgb;
}
