// A material at a point of a mesh.

// False in pipelines for materials that are neither fuzzy nor skin, which are most.
override LAYERED: bool = true;

struct Material {
    base_color: vec4f,
    // rgb emitted, w occlusion strength.
    emissive: vec4f,
    // x metallic, y roughness, z alpha cutoff, w transmissive.
    factors: vec4f,
    // x 1: normals and roughness from the surface textures, 2: anisotropy and roughness as KHR_materials_anisotropy has
    // them, y alpha mode: 0 opaque, 1 mask, 2 blend.
    flags: vec2u,
    // Strength and rotation of KHR_materials_anisotropy.
    khr: vec2f,
    // x roughness, y anisotropy, z rotation, w normal scale: turned by hand, see Adjustment.
    adjustment: vec4f,
    // rgb colour of light that comes through diffusely, w its share.
    translucency: vec4f,
    // rgb reflectance at normal incidence of what is not metal, w the share that there is of it.
    dielectric: vec4f,
    // Rows of the nine textures' transforms; w of the first row is the UV set.
    transforms: array<vec4f, 18>,
    // x 0: no skin, else which curvature: 1 zero, 2 mean, 3 directional, 4 normalised; y one over the largest
    // curvature of the tables, z that of the vertices' codes, w roughness of the second lobe of gloss.
    skin: vec4f,
    // xyz how far the normals of red, green and blue turn to the mesh's, w weight of the second lobe.
    skin_gloss: vec4f,
    // x side of the square across the light that shadows are filtered over, in the world's unit, 0 for shadows as they
    // are; y one over it, 1/mm.
    skin_shadow: vec4f,
}

@group(1) @binding(0) var<uniform> material: Material;
@group(1) @binding(1) var normal_map: texture_2d<f32>;
@group(1) @binding(2) var aniso_map: texture_2d<f32>;
@group(1) @binding(3) var base_color_map: texture_2d<f32>;
@group(1) @binding(4) var metallic_roughness_map: texture_2d<f32>;
@group(1) @binding(5) var occlusion_map: texture_2d<f32>;
@group(1) @binding(6) var emissive_map: texture_2d<f32>;
@group(1) @binding(7) var translucency_map: texture_2d<f32>;
@group(1) @binding(8) var translucent_color_map: texture_2d<f32>;
@group(1) @binding(9) var specular_map: texture_2d<f32>;
@group(1) @binding(10) var normal_sampler: sampler;
@group(1) @binding(11) var aniso_sampler: sampler;
@group(1) @binding(12) var base_color_sampler: sampler;
@group(1) @binding(13) var metallic_roughness_sampler: sampler;
@group(1) @binding(14) var occlusion_sampler: sampler;
@group(1) @binding(15) var emissive_sampler: sampler;
@group(1) @binding(16) var translucency_sampler: sampler;
@group(1) @binding(17) var translucent_color_sampler: sampler;
@group(1) @binding(18) var specular_sampler: sampler;
@group(1) @binding(26) var skin_table: texture_2d<f32>;
@group(1) @binding(27) var skin_ambient_table: texture_2d<f32>;
@group(1) @binding(28) var skin_penumbra_table: texture_2d<f32>;

struct Vertex {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uvs: vec4f,
    @location(4) color: vec4f,
    @location(5) curvature: vec4f,
}

struct Varying {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uvs: vec4f,
    @location(4) color: vec4f,
    @location(5) curvature: vec4f,
}

@vertex
fn vertex(in: Vertex) -> Varying {
    let clip = frame.view_projection * vec4f(in.position, 1.0);
    return Varying(clip, in.position, in.normal, in.tangent, in.uvs, in.color, in.curvature);
}

fn uv(in: Varying, texture: u32) -> vec2f {
    let row = material.transforms[2u * texture];
    let below = material.transforms[2u * texture + 1u];
    let uv = vec3f(select(in.uvs.xy, in.uvs.zw, row.w > 0.5), 1.0);
    return vec2f(dot(row.xyz, uv), dot(below.xyz, uv));
}

fn base_color_at(in: Varying) -> vec4f {
    let own = textureSample(base_color_map, base_color_sampler, uv(in, 2u));
    return material.base_color * in.color * detail_base_color(in, own);
}

fn surface_at(in: Varying, front: bool) -> Surface {
    var surface: Surface;
    let view = normalize(frame.camera.xyz - in.position);
    let base = base_color_at(in);
    let own_data = textureSample(metallic_roughness_map, metallic_roughness_sampler, uv(in, 3u));
    let own_occlusion = textureSample(occlusion_map, occlusion_sampler, uv(in, 4u)).r;
    let data = detail_data(in, vec3f(own_occlusion, own_data.g, own_data.b));
    let emissive = textureSample(emissive_map, emissive_sampler, uv(in, 5u)).rgb;
    let translucency = textureSample(translucency_map, translucency_sampler, uv(in, 6u)).a;
    let translucent_color = textureSample(translucent_color_map, translucent_color_sampler, uv(in, 7u)).rgb;
    let specular = textureSample(specular_map, specular_sampler, uv(in, 8u));
    let normal_xy = textureSample(normal_map, normal_sampler, uv(in, 0u)).rg * 2.0 - 1.0;
    let texel = textureSample(aniso_map, aniso_sampler, uv(in, 1u)).rgb;

    // Normal and roughness in the tangent frame of the mesh, which is not normalised: MikkTSpace.
    let roughness = saturate(material.factors.y * data.y);
    let alpha = alpha_from_roughness(roughness);
    let mapped = material.flags.x > 0u;
    let own_normal = select(vec3f(0.0, 0.0, 1.0), normal_from_xy(normal_xy.x, normal_xy.y), mapped);
    let tilted = detail_normal(in, own_normal).xy * material.adjustment.w;
    let n = normal_from_xy(tilted.x, tilted.y);
    var encoded = select(vec3f(alpha, 0.5, alpha), texel, mapped);
    if material.flags.x == 2u {
        let alphas = alphas_from_khr_anisotropy(roughness, material.khr.x * texel.b);
        let turn = vec2f(cos(material.khr.y), sin(material.khr.y));
        let held = texel.rg * 2.0 - 1.0;
        let direction = vec2f(turn.x * held.x - turn.y * held.y, turn.y * held.x + turn.x * held.y);
        encoded = aniso_encode(aniso_from_alphas(alphas.x, alphas.y, axis_from_direction(direction, n)));
    }
    encoded = detail_aniso(in, encoded);

    // To world space. Back faces are the same relief seen from behind.
    let side = select(-1.0, 1.0, front);
    let to_world = mat3x3f(in.tangent.xyz, in.tangent.w * cross(in.normal, in.tangent.xyz), in.normal);
    var normal = normalize(to_world * n * side);
    let n_v = dot(normal, view);
    if n_v < N_V_MIN {
        normal = normalize(normal + (N_V_MIN - n_v) * view);
    }
    let basis = m_n(n);
    let along = to_world * basis[0] * side;
    let tangent = normalize(along - normal * dot(normal, along));
    let across = cross(normal, tangent);
    let bitangent = select(across, -across, dot(across, to_world * basis[1] * side) < 0.0);
    let aniso = aniso_decode(encoded, tangent, bitangent);

    surface.position = in.position;
    surface.geometric_normal = normalize(in.normal) * side;
    surface.normal = normal;
    let c = cos(material.adjustment.z);
    let s = sin(material.adjustment.z);
    surface.tangent = c * aniso.tangent + s * aniso.bitangent;
    surface.bitangent = c * aniso.bitangent - s * aniso.tangent;
    let mean = sqrt(aniso.alpha_t * aniso.alpha_b) * material.adjustment.x;
    let stretch = pow(aniso.alpha_t / aniso.alpha_b, 0.5 * material.adjustment.y);
    surface.alpha_t = clamp(mean * stretch, ALPHA_MIN, 1.0);
    surface.alpha_b = clamp(mean / stretch, ALPHA_MIN, 1.0);
    surface.base_color = base.rgb;
    surface.metallic = saturate(material.factors.x * data.z);
    surface.dielectric = saturate(material.dielectric.rgb * specular.rgb);
    surface.strength = saturate(material.dielectric.w * specular.a);
    surface.transmissive = material.factors.w;
    surface.translucency = saturate(material.translucency.w * translucency);
    surface.translucent_color = material.translucency.rgb * translucent_color;
    surface.occlusion = 1.0 + material.emissive.w * (data.x - 1.0);
    surface.emitted = material.emissive.rgb * emissive;
    surface.opacity = select(1.0, saturate(base.a), material.flags.y == 2u);
    if material.flags.y == 1u && base.a < material.factors.z {
        surface.opacity = 0.0;
    }
    if LAYERED {
        surface.fuzz = fuzz_at(in, surface, to_world * side, view);
    }
    return surface;
}
