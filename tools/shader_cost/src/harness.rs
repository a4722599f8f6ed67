//! Shaders around the library: lobes under lights, and functions alone.
//!
//! Whatever a real shader would not know before it runs comes from buffers, never from constants.

use std::collections::BTreeMap;

use naga::{ArraySize, Handle, Module, Scalar, ScalarKind, Type, TypeInner};

/// A way to shade a pixel under lights.
pub(crate) struct Row {
    /// Its name in the budget.
    pub(crate) id: &'static str,
    /// Its name for people.
    pub(crate) title: &'static str,
    setup: String,
    /// Statements for a light `u` at cosine `n_u`.
    light: String,
    /// BRDF times cosine for that light.
    reflected: &'static str,
    ambient: String,
}

/// A row for each lobe. Set-up is counted over that of the first, Lambert alone.
pub(crate) fn rows() -> Vec<Row> {
    let isotropic_setup = "
    let v = normalize(pixel.v);
    let alpha = pixel.alphas.x;
    let n_v = max(dot(n, v), 1e-4);";
    let isotropic = "
        let h = normalize(u + v);
        let f = schlick_f(pixel.f0, saturate(dot(u, h)));
        let specular = ggx_d(saturate(dot(n, h)), alpha) * smith_v(n_u, n_v, alpha) * f;";

    // Everything anisotropic works in a frame (t, b, n) around the normal: the mesh's with a cross product, or the two
    // vectors of `m_n`, which an aniso texel needs, as they come from normal mapping.
    let view = "
    let v = normalize(pixel.v);";
    let given = "
    let t = normalize(pixel.tangent);
    let b = cross(n, t);
    let alpha_t = pixel.alphas.x;
    let alpha_b = pixel.alphas.y;";
    let decoded = "
    let decoded = aniso_decode(pixel.texel, normalize(pixel.tangent), pixel.bitangent);
    let t = decoded.tangent;
    let b = decoded.bitangent;
    let alpha_t = decoded.alpha_t;
    let alpha_b = decoded.alpha_b;";
    let matrix = "
    let t = normalize(pixel.tangent);
    let b = pixel.bitangent;
    let a = aniso_decode_matrix(pixel.texel);";
    let local_v = "
    let local_v = vec3f(dot(t, v), dot(b, v), max(dot(n, v), 1e-4));";
    let compensation = "
    let compensation = multiscatter_compensation(pixel.f0, local_v, alpha_t, alpha_b);";
    let anisotropic = "
        let local_u = vec3f(dot(t, u), dot(b, u), n_u);
        let h = normalize(local_u + local_v);
        let f = schlick_f(pixel.f0, saturate(dot(local_u, h)));
        let d_v = ggx_aniso_d(h, alpha_t, alpha_b) * smith_aniso_v(local_u, local_v, alpha_t, alpha_b);
        let specular = d_v * f;";
    let compensated = "
        let local_u = vec3f(dot(t, u), dot(b, u), n_u);
        let h = normalize(local_u + local_v);
        let f = schlick_f(pixel.f0, saturate(dot(local_u, h))) * compensation;
        let d_v = ggx_aniso_d(h, alpha_t, alpha_b) * smith_aniso_v(local_u, local_v, alpha_t, alpha_b);
        let specular = d_v * f;";
    let from_matrix = "
        let local_u = vec3f(dot(t, u), dot(b, u), n_u);
        let h = normalize(local_u + local_v);
        let f = schlick_f(pixel.f0, saturate(dot(local_u, h)));
        let specular = ggx_matrix_d(h, a) * smith_matrix_v(local_u, local_v, a) * f;";
    let harmonics = "
    color += pixel.base * max(sh_evaluate(scene.irradiance, n), vec3f(0.0));";

    let row = |id, title, setup: &[&str], specular: &str, ambient: &str| Row {
        id,
        title,
        setup: setup.concat(),
        light: specular.to_owned(),
        reflected: if specular.is_empty() { "n_u * pixel.base" } else { "n_u * (pixel.base + specular)" },
        ambient: ambient.to_owned(),
    };
    let mut rows = vec![
        row("lambert", "Lambert alone", &[], "", ""),
        row("ggx", "isotropic GGX", &[isotropic_setup], isotropic, ""),
        row("ggx_aniso", "anisotropic GGX, alphas given", &[view, given, local_v], anisotropic, ""),
        row(
            "aniso_decode",
            "**aniso texel, decoded, anisotropic GGX**",
            &[view, decoded, local_v],
            anisotropic,
            "",
        ),
        row("ggx_matrix", "aniso texel as a matrix, no decode", &[view, matrix, local_v], from_matrix, ""),
        row(
            "multiscatter",
            "aniso texel, decoded, with energy compensation",
            &[view, decoded, local_v, compensation],
            compensated,
            "",
        ),
        row("sh", "Lambert with ambient light from spherical harmonics", &[], "", harmonics),
    ];

    // Fuzz. The fibres' direction is a texel brought to world space; coefficients are the material's.
    let fibres = "
    let fibre = normalize(pixel.fibre);
    let fuzz = fuzz_view(max(dot(n, v), 1e-4), dot(fibre, v), pixel.fuzz.x, pixel.fuzz.y);";
    let scattered = "
        let t_u = dot(fibre, u);
        let layer = fuzz_light(fuzz, n_u, t_u, dot(u, v));";
    let attenuated = "
        let down = fuzz_p_s(coefficients, n_u, t_u);
        let left = fuzz_attenuation(layer.penetrated, fuzz.escaped, down, pixel.fibre_color);";
    // |u + v|² from u·v, which the layer needs too.
    let anisotropic_under = "
        let local_u = vec3f(dot(t, u), dot(b, u), n_u);
        let u_v = dot(local_u, local_v);
        let h = (local_u + local_v) * inverseSqrt(2.000002 + 2.0 * u_v);
        let f = schlick_f(pixel.f0, saturate(dot(local_u, h)));
        let d_v = ggx_aniso_d(h, alpha_t, alpha_b) * smith_aniso_v(local_u, local_v, alpha_t, alpha_b);
        let specular = d_v * f;
        let t_u = dot(fibre, u);
        let layer = fuzz_light(fuzz, n_u, t_u, u_v);";
    let exactly = "
        let down = fibre_p_s(n_u, t_u, dot(fibre, n), pixel.fuzz.y);
        let left = fuzz_attenuation(layer.penetrated, fuzz.escaped, down, pixel.fibre_color);";
    let coefficients = "
    let coefficients = array<f32, 6>(
        scene.p_s[0].x, scene.p_s[0].y, scene.p_s[0].z, scene.p_s[0].w, scene.p_s[1].x, scene.p_s[1].y);";
    let deferred = "
    let n_v = max(dot(n, v), 1e-4);
    let escaped = fuzz_deferred_escape(n_v);
    let fuzz_color = pixel.base * FUZZ_DEFERRED_ALBEDO * pixel.fuzz.x;
    let lambert = pixel.base * (1.0 - pixel.fuzz.x);";
    let deferred_safe = "
    let n_v = max(dot(n, v), 1e-4);
    let escaped = fuzz_deferred_escape(n_v);
    let fuzz_color = fuzz_deferred_color(pixel.base, n_v) * pixel.fuzz.x;
    let lambert = pixel.base * (1.0 - pixel.fuzz.x);";
    let soft = "
        let layer = fuzz_deferred(dot(n, u), n_v, dot(u, v), escaped);";
    let under = "
    let under = fuzz_ambient_attenuation(fuzz.escaped, fuzz_q(pixel.fuzz.x), scene.p_s[1].z, pixel.fibre_color);
    color += pixel.base * under * max(sh_evaluate(scene.irradiance, n), vec3f(0.0));";
    let ambient_talk = "
    let g_terms = array<f32, 4>(-0.6763, 0.0807, 0.8184, -0.4401);
    let g = fuzz_g_talk(g_terms, pixel.fuzz.x, fuzz.n_v);
    let up = 1.0 - fuzz_p_s(coefficients, fuzz.n_v, fuzz.t_v);
    color += pixel.fibre_color * (g * up) * fuzz_ambient_mean(scene.radiance, n);";
    let ambient_ours = "
    let factor_terms = array<f32, 8>(
        scene.ambient[0].x, scene.ambient[0].y, scene.ambient[0].z, scene.ambient[0].w,
        scene.ambient[1].x, scene.ambient[1].y, scene.ambient[1].z, scene.ambient[1].w);
    let direction_terms = array<f32, 4>(
        scene.ambient[2].x, scene.ambient[2].y, scene.ambient[2].z, scene.ambient[2].w);
    let gathered = fuzz_g(pixel.fuzz.x, fuzz.n_v) * fuzz_ambient_factor(factor_terms, fuzz.n_v, fuzz.t_v);
    let towards = fuzz_ambient_direction(direction_terms, n, v, fibre);
    color += pixel.fibre_color * gathered * fuzz_ambient_radiance(scene.radiance, towards);";
    let fuzz_row = |id, title, setup: &[&str], light: &[&str], reflected, ambient: &[&str]| Row {
        id,
        title,
        setup: setup.concat(),
        light: light.concat(),
        reflected,
        ambient: ambient.concat(),
    };
    rows.extend([
        fuzz_row(
            "fuzz",
            "**fuzz over Lambert**, base not attenuated",
            &[view, fibres],
            &[scattered],
            "n_u * (pixel.base + pixel.fibre_color * layer.lobe)",
            &[],
        ),
        fuzz_row(
            "fuzz_attenuated",
            "**fuzz over Lambert, attenuated** (P_p, P_e, P_s by six coefficients)",
            &[view, fibres, coefficients],
            &[scattered, attenuated],
            "n_u * (pixel.base * left + pixel.fibre_color * layer.lobe)",
            &[],
        ),
        fuzz_row(
            "fuzz_exact",
            "fuzz over Lambert, attenuated, P_s in closed form",
            &[view, fibres],
            &[scattered, exactly],
            "n_u * (pixel.base * left + pixel.fibre_color * layer.lobe)",
            &[],
        ),
        fuzz_row(
            "aniso_fuzz",
            "**aniso texel, decoded, under attenuated fuzz**",
            &[view, decoded, local_v, fibres, coefficients],
            &[anisotropic_under, attenuated],
            "n_u * ((pixel.base + specular) * left + pixel.fibre_color * layer.lobe)",
            &[],
        ),
        fuzz_row(
            "fuzz_deferred",
            "deferred fuzz",
            &[view, deferred],
            &[soft],
            "(n_u * lambert + fuzz_color * layer)",
            &[],
        ),
        fuzz_row(
            "fuzz_deferred_safe",
            "deferred fuzz that never exceeds one",
            &[view, deferred_safe],
            &[soft],
            "(n_u * lambert + fuzz_color * layer)",
            &[],
        ),
        fuzz_row(
            "fuzz_ambient_talk",
            "attenuated fuzz, ambient light as the talk has it",
            &[view, fibres, coefficients],
            &[scattered, attenuated],
            "n_u * (pixel.base * left + pixel.fibre_color * layer.lobe)",
            &[under, ambient_talk],
        ),
        fuzz_row(
            "fuzz_ambient",
            "attenuated fuzz, ambient light along the lobe",
            &[view, fibres, coefficients],
            &[scattered, attenuated],
            "n_u * (pixel.base * left + pixel.fibre_color * layer.lobe)",
            &[under, ambient_ours],
        ),
    ]);

    // Skin reads its table from a texture; codes of curvature come as a vertex leaves them.
    let curved = "
    let t = normalize(pixel.tangent);
    let b = pixel.bitangent;
    let curvature = curvature_decode(vec4f(pixel.texel, pixel.alphas.x), pixel.alphas.y);";
    let by_mean = "
        let at = skin_lut_uv(dot(n, u), curvature.w, 2.0);";
    let by_direction = "
        let along = curvature_from_light(curvature.xyz, vec2f(dot(t, u), dot(b, u)));
        let at = skin_lut_uv(dot(n, u), along, 2.0);";
    let normalized = "
        let along = curvature_from_light_normalized(curvature.xyz, vec2f(dot(t, u), dot(b, u)));
        let at = skin_lut_uv(dot(n, u), along, 2.0);";
    let scattered = "pixel.base * textureSampleLevel(table, clamped, at, 0.0).rgb";
    let skin_row = |id, title, light: &str| fuzz_row(id, title, &[curved], &[light], scattered, &[]);
    rows.extend([
        skin_row("skin_mean", "skin with mean curvature", by_mean),
        skin_row("skin", "**skin with directional curvature**", by_direction),
        skin_row("skin_normalized", "skin with normalised directional curvature", normalized),
    ]);
    rows
}

impl Row {
    /// The row under so many lights, unrolled.
    pub(crate) fn shader(&self, library: &str, lights: usize) -> String {
        let Row { setup, light: statements, reflected, ambient, .. } = self;
        // The layer divides by it.
        let least = if statements.contains("fuzz_light") { "1e-4" } else { "0.0" };
        let light = |i: usize| {
            format!(
                "    {{
        let u = scene.lights[{i}].direction.xyz;
        let n_u = max(dot(n, u), {least});{statements}
        color += scene.lights[{i}].irradiance.xyz * {reflected};
    }}\n"
            )
        };
        let lights: String = (0..lights).map(light).collect();
        format!(
            "{library}
struct Light {{ direction: vec4f, irradiance: vec4f }}
struct Scene {{
    lights: array<Light, 8>,
    irradiance: array<vec3f, 9>,
    radiance: array<vec3f, 9>,
    p_s: array<vec4f, 2>,
    ambient: array<vec4f, 3>,
}}
struct Pixel {{ n: vec3f, v: vec3f, tangent: vec3f, bitangent: vec3f, texel: vec3f, f0: vec3f, base: vec3f, alphas: vec2f, fibre: vec3f,
    fibre_color: vec3f, fuzz: vec2f }}
@group(0) @binding(0) var<storage, read> pixels: array<Pixel>;
@group(0) @binding(1) var<storage, read_write> colors: array<vec4f>;
@group(0) @binding(2) var<uniform> scene: Scene;
@group(0) @binding(3) var table: texture_2d<f32>;
@group(0) @binding(4) var clamped: sampler;
@compute @workgroup_size(64)
fn main(@builtin(local_invocation_index) i: u32) {{
    let pixel = pixels[i];
    let n = normalize(pixel.n);
    var color = vec3f(0.0);{setup}
{lights}{ambient}
    colors[i] = vec4f(color, 1.0);
}}
"
        )
    }
}

/// A shader that calls a function `calls` times, each time with other inputs and into other outputs.
pub(crate) fn function_shader(
    library: &str,
    module: &Module,
    function: &naga::Function,
    calls: usize,
) -> String {
    let name = function.name.as_deref().unwrap_or_default();
    let mut body = String::new();
    let (mut inputs, mut outputs) = (0_usize, Vec::new());
    for call in 0..calls {
        inputs = 0;
        outputs.clear();
        let mut next = || {
            inputs += 1;
            format!("lanes[i].calls[{call}].x[{}][{}]", (inputs - 1) / 4, (inputs - 1) % 4)
        };
        let arguments: Vec<_> = function.arguments.iter().map(|a| build(module, a.ty, &mut next)).collect();
        if let Some(result) = &function.result {
            take_apart(module, result.ty, &format!("result_{call}_"), &mut outputs);
        }
        body += &format!("    let result_{call}_ = {name}({});\n", arguments.join(", "));
        for (k, output) in outputs.iter().enumerate() {
            body += &format!("    results[i].calls[{call}].x[{}][{}] = {output};\n", k / 4, k % 4);
        }
    }
    let (inputs, outputs) = (inputs.div_ceil(4).max(1), outputs.len().div_ceil(4).max(1));
    format!(
        "{library}
struct Input {{ x: array<vec4f, {inputs}> }}
struct Output {{ x: array<vec4f, {outputs}> }}
struct Lane {{ calls: array<Input, {calls}> }}
struct Result {{ calls: array<Output, {calls}> }}
@group(0) @binding(0) var<storage, read> lanes: array<Lane>;
@group(0) @binding(1) var<storage, read_write> results: array<Result>;
@compute @workgroup_size(64)
fn main(@builtin(local_invocation_index) i: u32) {{
{body}}}
"
    )
}

/// WGSL that makes a value of a type from numbers.
fn build(module: &Module, ty: Handle<Type>, next: &mut impl FnMut() -> String) -> String {
    let list = |count: usize, next: &mut dyn FnMut() -> String| -> String {
        (0..count).map(|_| next()).collect::<Vec<_>>().join(", ")
    };
    match &module.types[ty].inner {
        TypeInner::Scalar(Scalar { kind: ScalarKind::Uint, .. }) => format!("u32({})", next()),
        TypeInner::Scalar(_) => next(),
        TypeInner::Vector { size, .. } => format!("vec{}f({})", *size as u8, list(*size as usize, next)),
        TypeInner::Matrix { columns, rows, .. } => {
            let count = *columns as usize * *rows as usize;
            format!("mat{}x{}f({})", *columns as u8, *rows as u8, list(count, next))
        }
        TypeInner::Array { base, size: ArraySize::Constant(size), .. } => {
            let elements: Vec<_> = (0..size.get()).map(|_| build(module, *base, next)).collect();
            format!("array({})", elements.join(", "))
        }
        TypeInner::Struct { members, .. } => {
            let values: Vec<_> = members.iter().map(|m| build(module, m.ty, next)).collect();
            format!("{}({})", module.types[ty].name.as_deref().unwrap_or_default(), values.join(", "))
        }
        other => panic!("the harness cannot make {other:?}; teach it"),
    }
}

/// WGSL for each number of a value.
fn take_apart(module: &Module, ty: Handle<Type>, value: &str, into: &mut Vec<String>) {
    match &module.types[ty].inner {
        TypeInner::Scalar(_) => into.push(value.to_owned()),
        TypeInner::Vector { size, .. } => into.extend((0..*size as usize).map(|i| format!("{value}[{i}]"))),
        TypeInner::Matrix { columns, rows, .. } => {
            let (columns, rows) = (*columns as usize, *rows as usize);
            into.extend((0..columns * rows).map(|i| format!("{value}[{}][{}]", i / rows, i % rows)));
        }
        TypeInner::Array { base, size: ArraySize::Constant(size), .. } => {
            (0..size.get()).for_each(|i| take_apart(module, *base, &format!("{value}[{i}]"), into));
        }
        TypeInner::Struct { members, .. } => {
            for member in members {
                let name = member.name.as_deref().unwrap_or_default();
                take_apart(module, member.ty, &format!("{value}.{name}"), into);
            }
        }
        other => panic!("the harness cannot take apart {other:?}; teach it"),
    }
}

/// SPIR-V of a shader, without the guards that WebGPU asks for.
pub(crate) fn to_spirv(wgsl: &str) -> Result<Vec<u32>, crate::Error> {
    use naga::back::spv;
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    let module = naga::front::wgsl::parse_str(wgsl).map_err(|e| e.emit_to_string(wgsl))?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
    let options = spv::Options { force_loop_bounding: false, ..spv::Options::default() };
    Ok(spv::write_vec(&module, &info.map_err(|e| e.emit_to_string(wgsl))?, &options, None)?)
}

/// Instructions of the compiler's code that compute, rather than load, store, wait or end, and how many of those run
/// at a quarter of the rate.
pub(crate) fn computing_instructions(code: &str) -> (u64, u64) {
    let others = [
        "s_waitcnt",
        "s_load",
        "s_buffer",
        "s_endpgm",
        "s_nop",
        "s_branch",
        "s_cbranch",
        "s_clause",
        "s_delay",
    ];
    let slow = ["v_rcp", "v_rsq", "v_sqrt", "v_exp", "v_log", "v_sin", "v_cos"];
    let is_any = |name: &str, prefixes: &[&str]| prefixes.iter().any(|prefix| name.starts_with(prefix));
    let (mut all, mut quarter_rate) = (0, 0);
    for line in code.lines().filter_map(|line| line.strip_prefix('\t')) {
        let operation = line.rsplit_once(" = ").map_or(line, |(_, after)| after);
        let name = operation.split_whitespace().next().unwrap_or_default();
        if is_any(name, &["v_", "s_"]) && !is_any(name, &others) {
            all += 1;
            quarter_rate += u64::from(is_any(name, &slow));
        }
    }
    (all, quarter_rate)
}

/// Functions by name.
pub(crate) fn functions(module: &Module) -> BTreeMap<String, &naga::Function> {
    module.functions.iter().map(|(_, f)| (f.name.clone().unwrap_or_default(), f)).collect()
}
