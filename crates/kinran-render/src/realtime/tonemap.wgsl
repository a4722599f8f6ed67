// From scene radiance to display values; the twin of tonemap.rs, where the sources stand.

@group(1) @binding(0) var sum_texture: texture_2d<f32>;

@vertex
fn everywhere(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

fn srgb_oetf(linear: vec3f) -> vec3f {
    let x = saturate(linear);
    return select(1.055 * pow(x, vec3f(1.0 / 2.4)) - 0.055, 12.92 * x, x <= vec3f(0.0031308));
}

fn aces(x: vec3f) -> vec3f {
    let input = mat3x3f(
        vec3f(0.59719, 0.07600, 0.02840),
        vec3f(0.35458, 0.90834, 0.13383),
        vec3f(0.04823, 0.01566, 0.83777),
    );
    let output = mat3x3f(
        vec3f(1.60475, -0.10208, -0.00327),
        vec3f(-0.53108, 1.10813, -0.07276),
        vec3f(-0.07367, -0.00605, 1.07602),
    );
    let v = min(input * x, vec3f(1e15));
    let a = v * (v + 0.0245786) - 0.000090537;
    let b = v * (0.983729 * v + 0.432951) + 0.238081;
    return output * (a / b);
}

fn agx(x: vec3f) -> vec3f {
    let inset = mat3x3f(
        vec3f(0.84247906, 0.042328242, 0.042375655),
        vec3f(0.0784336, 0.87846864, 0.0784336),
        vec3f(0.079223745, 0.079166130, 0.879143),
    );
    let outset = mat3x3f(
        vec3f(1.196879, -0.052896852, -0.052971636),
        vec3f(-0.09802088, 1.1519031, -0.098043450),
        vec3f(-0.09902974, -0.09896118, 1.1510737),
    );
    let min_ev = -12.47393;
    let max_ev = 4.026069;
    let ev = log2(max(inset * x, vec3f(1.1754944e-38)));
    let t = saturate((ev - min_ev) / (max_ev - min_ev));
    let t2 = t * t;
    let t4 = t2 * t2;
    let curve = 15.5 * t4 * t2 - 40.14 * t4 * t + 31.96 * t4 - 6.868 * t2 * t + 0.4298 * t2 + 0.1191 * t - 0.00232;
    return pow(max(outset * curve, vec3f(0.0)), vec3f(2.2));
}

// Display-encoded, for a target that does not encode by itself.
@fragment
fn display(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let sum = textureLoad(sum_texture, vec2i(pixel.xy), 0);
    var shown = max(sum.rgb / max(sum.w, 1.0), vec3f(0.0));
    // A channel is shown as it is.
    if frame.counts.z == 0u {
        let radiance = shown * frame.display.z;
        shown = radiance;
        switch u32(frame.display.w) {
            case 1u: { shown = aces(radiance); }
            case 2u: { shown = agx(radiance); }
            default: {}
        }
    }
    return vec4f(srgb_oetf(shown), 1.0);
}
