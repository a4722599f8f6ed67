// Maps that are blended from tiles and a synthesized map; no_detail.wgsl is in this file's place where there are none.

const DETAIL_BLENDED: u32 = 0;
const DETAIL_DETAIL: u32 = 1;
const DETAIL_SYNTHESIZED: u32 = 2;
const DETAIL_TARGET: u32 = 3;

struct DetailLayer {
    // Columns of the matrix.
    matrix: vec4f,
    // xy offset, zw cosine and sine of the rotation.
    place: vec4f,
    // xyz hue, saturation, value; w 1: every other tile is mirrored.
    hsv: vec4f,
    // x channel, y contrast, z 1: there is a mask; w opacity.
    mask: vec4f,
    // 1 where there is a tile for a map and the layer is on.
    tiles: vec4f,
}

struct DetailMaterial {
    // x what is shown, y 1: plain overlay.
    flags: vec4u,
    // 1 where there is a synthesized map: base colour, normal, data, aniso.
    maps: vec4u,
    // Channels of occlusion, roughness, metallic in the data map; 3: none.
    channels: vec4u,
    // x opacity over an aniso map.
    factors: vec4f,
    // Rows of the synthesized maps' transforms; w of the first row is the UV set.
    transforms: array<vec4f, 8>,
    layers: array<DetailLayer, 3>,
}

@group(2) @binding(0) var<uniform> detail: DetailMaterial;
@group(2) @binding(1) var detail_color_map: texture_2d<f32>;
@group(2) @binding(2) var detail_normal_map: texture_2d<f32>;
@group(2) @binding(3) var detail_data_map: texture_2d<f32>;
@group(2) @binding(4) var detail_aniso_map: texture_2d<f32>;
@group(2) @binding(5) var detail_color_tile_a: texture_2d<f32>;
@group(2) @binding(6) var detail_normal_tile_a: texture_2d<f32>;
@group(2) @binding(7) var detail_data_tile_a: texture_2d<f32>;
@group(2) @binding(8) var detail_aniso_tile_a: texture_2d<f32>;
@group(2) @binding(9) var detail_color_tile_b: texture_2d<f32>;
@group(2) @binding(10) var detail_normal_tile_b: texture_2d<f32>;
@group(2) @binding(11) var detail_data_tile_b: texture_2d<f32>;
@group(2) @binding(12) var detail_aniso_tile_b: texture_2d<f32>;
@group(2) @binding(13) var detail_color_tile_c: texture_2d<f32>;
@group(2) @binding(14) var detail_normal_tile_c: texture_2d<f32>;
@group(2) @binding(15) var detail_data_tile_c: texture_2d<f32>;
@group(2) @binding(16) var detail_aniso_tile_c: texture_2d<f32>;
@group(2) @binding(17) var detail_mask_b: texture_2d<f32>;
@group(2) @binding(18) var detail_mask_c: texture_2d<f32>;
@group(2) @binding(19) var detail_sampler: sampler;
@group(2) @binding(20) var detail_sampler_a: sampler;
@group(2) @binding(21) var detail_sampler_b: sampler;
@group(2) @binding(22) var detail_sampler_c: sampler;

fn detail_map_uv(in: Varying, map: u32) -> vec2f {
    let row = detail.transforms[2u * map];
    let below = detail.transforms[2u * map + 1u];
    let uv = vec3f(select(in.uvs.xy, in.uvs.zw, row.w > 0.5), 1.0);
    return vec2f(dot(row.xyz, uv), dot(below.xyz, uv));
}

fn detail_is_shown(map: u32) -> bool {
    return detail.maps[map] == 1u && detail.flags.x != DETAIL_TARGET;
}

fn detail_place(layer: u32, at: vec2f) -> vec2f {
    let m = detail.layers[layer].matrix;
    return detail_uv(at, mat2x2f(m.xy, m.zw), detail.layers[layer].place.xy);
}

fn detail_mirror_of(layer: u32, at: vec2f) -> vec2f {
    return select(vec2f(1.0), detail_mirror(detail_place(layer, at)), detail.layers[layer].hsv.w > 0.5);
}

// How much of a layer is seen, where it has a tile.
fn detail_alpha(layer: u32, map: u32, mask: vec4f) -> f32 {
    let said = detail.layers[layer];
    let alpha = select(1.0, detail_mask(mask[u32(said.mask.x)], said.mask.y), said.mask.z > 0.5);
    return alpha * said.mask.w * said.tiles[map];
}

fn detail_shifted(layer: u32, texel: vec4f) -> vec3f {
    return hsv_shift(texel.rgb, detail.layers[layer].hsv.xyz);
}

fn detail_turned(layer: u32, at: vec2f, texel: vec4f) -> vec3f {
    let n = normal_from_xy(texel.r * 2.0 - 1.0, texel.g * 2.0 - 1.0);
    return detail_turn_normal(n, detail.layers[layer].place.zw, detail_mirror_of(layer, at));
}

fn detail_turned_aniso(layer: u32, at: vec2f, texel: vec4f) -> vec3f {
    return detail_turn_aniso(texel.rgb, detail.layers[layer].place.zw, detail_mirror_of(layer, at));
}

// Colour or data as shown.
fn detail_overlaid(s: vec3f, d: vec3f) -> vec3f {
    switch detail.flags.x {
        case DETAIL_DETAIL: { return d; }
        case DETAIL_SYNTHESIZED: { return s; }
        default: {
            if detail.flags.y == 1u {
                return overlay_color(s, d);
            }
            return smooth_overlay_color(s, d);
        }
    }
}

fn detail_base_color(in: Varying, own: vec4f) -> vec4f {
    if !detail_is_shown(0u) {
        return own;
    }
    let at = detail_map_uv(in, 0u);
    let texel = textureSample(detail_color_map, detail_sampler, at);
    let a = textureSample(detail_color_tile_a, detail_sampler_a, detail_place(0u, at));
    let b = textureSample(detail_color_tile_b, detail_sampler_b, detail_place(1u, at));
    let c = textureSample(detail_color_tile_c, detail_sampler_c, detail_place(2u, at));
    let mask_b = textureSample(detail_mask_b, detail_sampler, at);
    let mask_c = textureSample(detail_mask_c, detail_sampler, at);
    var d = mix(vec3f(0.5), detail_shifted(0u, a), detail_alpha(0u, 0u, vec4f(1.0)));
    d = mix(d, detail_shifted(1u, b), detail_alpha(1u, 0u, mask_b));
    d = mix(d, detail_shifted(2u, c), detail_alpha(2u, 0u, mask_c));
    return vec4f(detail_overlaid(detail_from_texel(texel.rgb), d), texel.a);
}

// `own` is occlusion, roughness, metallic.
fn detail_data(in: Varying, own: vec3f) -> vec3f {
    if !detail_is_shown(2u) {
        return own;
    }
    let at = detail_map_uv(in, 2u);
    let texel = textureSample(detail_data_map, detail_sampler, at);
    let a = textureSample(detail_data_tile_a, detail_sampler_a, detail_place(0u, at));
    let b = textureSample(detail_data_tile_b, detail_sampler_b, detail_place(1u, at));
    let c = textureSample(detail_data_tile_c, detail_sampler_c, detail_place(2u, at));
    let mask_b = textureSample(detail_mask_b, detail_sampler, at);
    let mask_c = textureSample(detail_mask_c, detail_sampler, at);
    var d = mix(vec3f(0.5), a.rgb, detail_alpha(0u, 2u, vec4f(1.0)));
    d = mix(d, b.rgb, detail_alpha(1u, 2u, mask_b));
    d = mix(d, c.rgb, detail_alpha(2u, 2u, mask_c));
    let data = detail_overlaid(detail_from_texel(texel.rgb), d);
    var all = own;
    for (var i = 0u; i < 3u; i++) {
        let channel = detail.channels[i];
        all[i] = select(own[i], data[min(channel, 2u)], channel < 3u);
    }
    return all;
}

fn detail_normal(in: Varying, own: vec3f) -> vec3f {
    if !detail_is_shown(1u) {
        return own;
    }
    let at = detail_map_uv(in, 1u);
    let texel = textureSample(detail_normal_map, detail_sampler, at);
    let a = textureSample(detail_normal_tile_a, detail_sampler_a, detail_place(0u, at));
    let b = textureSample(detail_normal_tile_b, detail_sampler_b, detail_place(1u, at));
    let c = textureSample(detail_normal_tile_c, detail_sampler_c, detail_place(2u, at));
    let mask_b = textureSample(detail_mask_b, detail_sampler, at);
    let mask_c = textureSample(detail_mask_c, detail_sampler, at);
    var d = mix(vec3f(0.0, 0.0, 1.0), detail_turned(0u, at, a), detail_alpha(0u, 1u, vec4f(1.0)));
    d = mix(d, detail_turned(1u, at, b), detail_alpha(1u, 1u, mask_b));
    d = normalize(mix(d, detail_turned(2u, at, c), detail_alpha(2u, 1u, mask_c)));
    let s = detail_from_texel(texel.rgb) * 2.0 - 1.0;
    let base = normal_from_xy(s.x, s.y);
    switch detail.flags.x {
        case DETAIL_DETAIL: { return d; }
        case DETAIL_SYNTHESIZED: { return base; }
        default: { return rnm(base, d); }
    }
}

fn detail_aniso(in: Varying, own: vec3f) -> vec3f {
    if !detail_is_shown(3u) {
        return own;
    }
    let at = detail_map_uv(in, 3u);
    let s = textureSample(detail_aniso_map, detail_sampler, at).rgb;
    let a = textureSample(detail_aniso_tile_a, detail_sampler_a, detail_place(0u, at));
    let b = textureSample(detail_aniso_tile_b, detail_sampler_b, detail_place(1u, at));
    let c = textureSample(detail_aniso_tile_c, detail_sampler_c, detail_place(2u, at));
    let mask_b = textureSample(detail_mask_b, detail_sampler, at);
    let mask_c = textureSample(detail_mask_c, detail_sampler, at);
    var d = mix(s, detail_turned_aniso(0u, at, a), detail_alpha(0u, 3u, vec4f(1.0)));
    d = mix(d, detail_turned_aniso(1u, at, b), detail_alpha(1u, 3u, mask_b));
    d = mix(d, detail_turned_aniso(2u, at, c), detail_alpha(2u, 3u, mask_c));
    switch detail.flags.x {
        case DETAIL_DETAIL: { return d; }
        case DETAIL_SYNTHESIZED: { return s; }
        default: { return detail_over(s, d, detail.factors.x); }
    }
}
