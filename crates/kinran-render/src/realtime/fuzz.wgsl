// A layer of fibres over a surface, and the simple form that seven bits of the G-buffer hold.

const FUZZ_NONE: u32 = 0u;
const FUZZ_LAYER: u32 = 1u;
const FUZZ_SIMPLE: u32 = 2u;

// Fuzz at a point for a view; directions in world space.
struct Fuzz {
    kind: u32,
    // 0 fibres, 1 velvet.
    phase: u32,
    // 0 full, 1 unscattered, 2 albedo, 3 none.
    attenuation: u32,
    // 1: light from all around as the talk has it.
    talk_ambient: u32,
    // Density of a layer, fuzziness of the simple form.
    amount: f32,
    alpha: f32,
    color: vec3f,
    normal: vec3f,
    fibre: vec3f,
    t_n: f32,
    v: vec3f,
    view: FuzzView,
    p_s: array<f32, 6>,
    downward: f32,
    // The layer's ambient light over fuzz_g.
    factor: f32,
    direction: array<f32, 4>,
}

// The simple form over a surface of this normal and diffuse albedo.
fn fuzz_simple(fuzziness: f32, normal: vec3f, v: vec3f, diffuse: vec3f) -> Fuzz {
    var fuzz: Fuzz;
    let n_v = max(dot(normal, v), N_V_MIN);
    fuzz.kind = select(FUZZ_NONE, FUZZ_SIMPLE, fuzziness > 0.0);
    fuzz.amount = fuzziness;
    fuzz.normal = normal;
    fuzz.v = v;
    fuzz.view.n_v = n_v;
    fuzz.view.escaped = fuzz_deferred_escape(n_v);
    fuzz.color = fuzz_deferred_color(diffuse, n_v);
    return fuzz;
}

// The layer over what the base reflects for a light along `u`, BRDF times cosine.
fn fuzz_over(fuzz: Fuzz, u: vec3f, base: vec3f, diffuse: vec3f) -> vec3f {
    if fuzz.kind == FUZZ_NONE {
        return base;
    }
    let n_u = dot(fuzz.normal, u);
    let u_v = dot(fuzz.v, u);
    if fuzz.kind == FUZZ_SIMPLE {
        let soft = fuzz.color * fuzz_deferred(n_u, fuzz.view.n_v, u_v, fuzz.view.escaped);
        return base + fuzz.amount * (soft - diffuse_lobe(diffuse) * max(n_u, 0.0));
    }
    if n_u <= 1e-4 {
        return vec3f(0.0);
    }
    let t_u = dot(fuzz.fibre, u);
    var layer = fuzz_light(fuzz.view, n_u, t_u, u_v);
    if fuzz.phase == 1u {
        let p = velvet_phase(u_v, t_u, fuzz.view.t_v, velvet_k(fuzz.alpha * fuzz.alpha));
        layer.lobe = fuzz_layer(p, layer.penetrated * fuzz.view.escaped, n_u, fuzz.view.n_v);
    }
    let down = fuzz_downward(fuzz, n_u, t_u);
    var left = fuzz_attenuation(layer.penetrated, fuzz.view.escaped, down, fuzz.color);
    if fuzz.attenuation > 1u {
        left = vec3f(fuzz_left(fuzz));
    }
    return base * left + fuzz.color * (layer.lobe * n_u);
}

// The layer over skin, of which `diffuse * cosine` scatters and `gloss` does not; the share `direct` of the light is not in
// shadow. Light that scatters came in where the surface faces it more: it was dimmed as light at the mean of `cosine` over
// the channels is.
fn fuzz_over_skin(fuzz: Fuzz, u: vec3f, diffuse: vec3f, cosine: vec3f, gloss: vec3f, direct: f32) -> vec3f {
    let scattered = diffuse * cosine;
    if fuzz.kind == FUZZ_NONE {
        return scattered + gloss * direct;
    }
    if fuzz.kind == FUZZ_SIMPLE {
        return scattered * (1.0 - fuzz.amount) + fuzz_over(fuzz, u, gloss, vec3f(0.0)) * direct;
    }
    let n_u = clamp((cosine.r + cosine.g + cosine.b) / 3.0, 1e-4, 1.0);
    let penetrated = fuzz_passage(fuzz.amount, n_u);
    let down = fuzz_downward(fuzz, n_u, dot(fuzz.fibre, u));
    var left = fuzz_attenuation(penetrated, fuzz.view.escaped, down, fuzz.color);
    if fuzz.attenuation > 1u {
        left = vec3f(fuzz_left(fuzz));
    }
    return scattered * left + fuzz_over(fuzz, u, gloss, vec3f(0.0)) * direct;
}

// P_s: what a fibre sends down of a light. Combed fibres, which coefficients cannot follow, take the closed form.
fn fuzz_downward(fuzz: Fuzz, n_u: f32, t_u: f32) -> f32 {
    if fuzz.attenuation == 1u {
        return 0.0;
    }
    if fuzz.phase == 0u && fuzz.alpha < FUZZ_COMBED_ALPHA {
        return fibre_p_s(n_u, t_u, fuzz.t_n, fuzz.alpha);
    }
    return fuzz_p_s(fuzz.p_s, n_u, t_u);
}

// What attenuation by the layer's albedo leaves, or by nothing.
fn fuzz_left(fuzz: Fuzz) -> f32 {
    let gathered = fuzz_g(fuzz.amount, fuzz.view.n_v) * fuzz.factor;
    let albedo = min(gathered * max(fuzz.color.r, max(fuzz.color.g, fuzz.color.b)), 1.0);
    return select(1.0 - albedo, 1.0, fuzz.attenuation == 3u);
}

// The layer over the base's ambient light, from the coefficients of irradiance.
fn fuzz_over_ambient(fuzz: Fuzz, diffuse: vec3f, specular: vec3f, irradiance: array<vec3f, 9>) -> vec3f {
    if fuzz.kind == FUZZ_NONE {
        return diffuse + specular;
    }
    if fuzz.kind == FUZZ_SIMPLE {
        // Nearly isotropic fibres send up half of what the layer's geometry gathers.
        let around = max(sh_evaluate(irradiance, fuzz.normal), vec3f(0.0)) / PI;
        let soft = fuzz.color * around * (0.5 * fuzz_g(FUZZ_DEFERRED_DENSITY, fuzz.view.n_v));
        return mix(diffuse, soft, fuzz.amount) + specular;
    }
    var radiance: array<vec3f, 9>;
    radiance[0] = irradiance[0] / PI;
    for (var i = 1; i < 4; i++) {
        radiance[i] = irradiance[i] / (2.0 * PI / 3.0);
    }
    let n_v = fuzz.view.n_v;
    let t_v = fuzz.view.t_v;
    let towards = fuzz_ambient_direction(fuzz.direction, fuzz.normal, fuzz.v, fuzz.fibre);
    let gathered = fuzz_g(fuzz.amount, n_v) * fuzz.factor;
    var lobe = gathered * fuzz_ambient_radiance(radiance, towards);
    if fuzz.talk_ambient == 1u {
        // Least squares of the relative error for n·v from 0.1 and densities from 0.01 to 0.5.
        let g = fuzz_g_talk(array<f32, 4>(-0.6763, 0.0807, 0.8184, -0.4401), fuzz.amount, n_v);
        lobe = g * (1.0 - fuzz_p_s(fuzz.p_s, n_v, t_v)) * fuzz_ambient_mean(radiance, fuzz.normal);
    }
    let down = select(fuzz.downward, 0.0, fuzz.attenuation == 1u);
    var left = fuzz_ambient_attenuation(fuzz.view.escaped, fuzz_q(fuzz.amount), down, fuzz.color);
    if fuzz.attenuation > 1u {
        left = vec3f(fuzz_left(fuzz));
    }
    return (diffuse + specular) * left + fuzz.color * lobe;
}
