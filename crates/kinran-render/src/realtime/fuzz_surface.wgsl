// Fuzz of a material at a point of a mesh.

const FUZZ_TILTS: u32 = 17u;

struct FuzzMaterial {
    // x kind, y phase, z attenuation, w 1: ambient light as the talk has it.
    flags: vec4u,
    // x density or fuzziness, y alpha, z normal smoothness, w 1: directions from the texture.
    factors: vec4f,
    color: vec4f,
    // Fibres in tangent space.
    direction: vec4f,
    // For each tilt from upright to lying: P_s and R, ambient factor, ambient direction.
    coefficients: array<vec4f, 5 * FUZZ_TILTS>,
    // Rows of the transforms of direction, colour and amount; w of the first row is the UV set.
    transforms: array<vec4f, 6>,
}

@group(1) @binding(19) var<uniform> fuzz_material: FuzzMaterial;
@group(1) @binding(20) var fuzz_direction_map: texture_2d<f32>;
@group(1) @binding(21) var fuzz_color_map: texture_2d<f32>;
@group(1) @binding(22) var fuzz_amount_map: texture_2d<f32>;
@group(1) @binding(23) var fuzz_direction_sampler: sampler;
@group(1) @binding(24) var fuzz_color_sampler: sampler;
@group(1) @binding(25) var fuzz_amount_sampler: sampler;
// The ambient factor of combed fibres, a layer for each tilt.
@group(1) @binding(29) var fuzz_table: texture_3d<f32>;

fn fuzz_uv(in: Varying, texture: u32) -> vec2f {
    let row = fuzz_material.transforms[2u * texture];
    let below = fuzz_material.transforms[2u * texture + 1u];
    let uv = vec3f(select(in.uvs.xy, in.uvs.zw, row.w > 0.5), 1.0);
    return vec2f(dot(row.xyz, uv), dot(below.xyz, uv));
}

// `to_world` is the mesh's tangent frame, turned to the viewer.
fn fuzz_at(in: Varying, surface: Surface, to_world: mat3x3f, view: vec3f) -> Fuzz {
    let mapped = textureSample(fuzz_direction_map, fuzz_direction_sampler, fuzz_uv(in, 0u)).xyz * 2.0 - 1.0;
    let color = textureSample(fuzz_color_map, fuzz_color_sampler, fuzz_uv(in, 1u)).rgb;
    let amount = textureSample(fuzz_amount_map, fuzz_amount_sampler, fuzz_uv(in, 2u)).r;
    let factors = fuzz_material.factors;
    var fuzz: Fuzz;
    fuzz.amount = factors.x * amount;
    if fuzz_material.flags.x == FUZZ_NONE || fuzz.amount <= 0.0 {
        return fuzz;
    }
    if fuzz_material.flags.x == FUZZ_SIMPLE {
        return fuzz_simple(saturate(fuzz.amount), surface.normal, view, lobe_of(surface, view).diffuse);
    }
    fuzz.kind = FUZZ_LAYER;
    fuzz.phase = fuzz_material.flags.y;
    fuzz.attenuation = fuzz_material.flags.z;
    fuzz.talk_ambient = fuzz_material.flags.w;
    fuzz.alpha = factors.y;
    fuzz.color = fuzz_material.color.rgb * color;
    fuzz.normal = fuzz_smooth_normal(surface.normal, surface.geometric_normal, factors.z);
    let fibre = normalize(to_world * select(fuzz_material.direction.xyz, mapped, factors.w > 0.5));
    // Fits are for fibres above the horizon; a fibre has no sign.
    let t_n = dot(fibre, fuzz.normal);
    fuzz.fibre = select(fibre, -fibre, t_n < 0.0);
    fuzz.v = view;
    let n_v = max(dot(fuzz.normal, view), N_V_MIN);
    fuzz.view = fuzz_view(n_v, dot(fuzz.fibre, view), fuzz.amount, fuzz.alpha);

    // Coefficients between those of the nearest tilts.
    fuzz.t_n = abs(t_n);
    let place = acos(saturate(fuzz.t_n)) * (f32(FUZZ_TILTS - 1u) / (0.5 * PI));
    let low = min(u32(place), FUZZ_TILTS - 2u);
    let f = place - f32(low);
    let a = 5u * low;
    let down = mix(fuzz_material.coefficients[a], fuzz_material.coefficients[a + 5u], f);
    let more = mix(fuzz_material.coefficients[a + 1u], fuzz_material.coefficients[a + 6u], f);
    let first = mix(fuzz_material.coefficients[a + 2u], fuzz_material.coefficients[a + 7u], f);
    let second = mix(fuzz_material.coefficients[a + 3u], fuzz_material.coefficients[a + 8u], f);
    let mean = mix(fuzz_material.coefficients[a + 4u], fuzz_material.coefficients[a + 9u], f);
    fuzz.p_s = array<f32, 6>(down.x, down.y, down.z, down.w, more.x, more.y);
    fuzz.downward = more.z;
    if fuzz.alpha < FUZZ_COMBED_ALPHA {
        let layer = (place + 0.5) / f32(FUZZ_TILTS);
        let at = vec3f(fuzz_ambient_place(n_v, fuzz.view.t_v, fuzz.t_n), layer);
        let texel = textureSampleLevel(fuzz_table, clamp_sampler, at, 0.0).xy;
        fuzz.factor = fuzz_ambient_tabulated(texel, fuzz.amount, n_v);
    } else {
        let terms = array<f32, 8>(first.x, first.y, first.z, first.w, second.x, second.y, second.z, second.w);
        fuzz.factor = fuzz_ambient_factor(terms, n_v, fuzz.view.t_v);
    }
    fuzz.direction = array<f32, 4>(mean.x, mean.y, mean.z, mean.w);
    return fuzz;
}
