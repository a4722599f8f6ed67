//! `KINRAN_materials_detail`, read and written.

use std::path::Path;

use glam::{Mat2, Vec2, vec2, vec3};
use kinran_image::{Channels, Encoder, Encoding, Format, Image, Level, Pixels, Preset, Texture, Transfer};
use kinran_scene::{
    DETAIL_EXTENSION, Detail, DetailLayer, DetailMap, DetailMask, Document, LayerTransform, Scene,
    TextureRef, Wrap,
};
use serde_json::{Value, json};

fn document(detail: Value) -> Vec<u8> {
    let document = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": [DETAIL_EXTENSION, "KHR_texture_basisu"],
        "materials": [{ "name": "wall", "extensions": { DETAIL_EXTENSION: detail } }],
        "textures": [
            { "source": 0 },
            { "extensions": { "KHR_texture_basisu": { "source": 1 } } },
            { "source": 0, "sampler": 0 },
        ],
        "samplers": [{ "wrapS": 33071, "wrapT": 33071 }],
        "images": [{ "uri": "s.png" }, { "uri": "tile.ktx2" }],
    });
    document.to_string().into_bytes()
}

/// Levels that no average of each other gives.
fn tile() -> Texture {
    let encoding = Encoding { format: Format::Rgba8, encoder: Encoder::Portable, preset: Preset::Fast };
    let level = |side: u32, value: u8| Level {
        width: side,
        height: side,
        data: kinran_image::encode(encoding, &vec![value; (side * side * 4) as usize], side, side).unwrap(),
    };
    Texture {
        format: Format::Rgba8,
        transfer: Transfer::Srgb,
        levels: vec![level(2, 10), level(1, 200)],
        metadata: Default::default(),
    }
}

fn load(detail: Value) -> Result<Scene, kinran_scene::Error> {
    let png = Image::new(1, 1, Channels::Rgb, Pixels::U8(vec![128; 3])).unwrap();
    let resolve = |path: &str| {
        Ok(match path {
            "s.png" => kinran_image::encode_png(&png).unwrap(),
            "tile.ktx2" => kinran_image::encode_ktx2(&tile(), None).unwrap(),
            other => panic!("{other} was asked for"),
        })
    };
    Scene::from_bytes(Path::new("wall.gltf"), &document(detail), &resolve)
}

fn place(image: usize, wrap: Wrap) -> Option<TextureRef> {
    Some(TextureRef {
        image,
        runtime: (image == 1).then_some(1),
        uv_set: 0,
        transform: glam::Mat3::IDENTITY,
        wrap: [wrap; 2],
    })
}

#[test]
fn layers_are_read_with_their_defaults_and_samplers_do_not_count() {
    let scene = load(
        json!({ "baseColorTexture": { "index": 2 }, "layers": [{ "baseColorTexture": { "index": 1 } }] }),
    );
    let scene = scene.unwrap();
    let mut wanted = Detail { layers: vec![DetailLayer::default()], ..Detail::default() };
    wanted.maps[0] = place(0, Wrap::Repeat);
    wanted.layers[0].tiles[0] = place(1, Wrap::Repeat);
    assert_eq!(scene.materials[0].detail, Some(wanted));
    assert!(scene.materials[0].ignored_extensions.is_empty());
}

#[test]
fn a_tile_keeps_its_own_levels_and_transfer() {
    let scene = load(json!({ "dataTexture": { "index": 0 }, "layers": [{ "dataTexture": { "index": 1 } }] }))
        .unwrap();
    let texture = scene.textures[1].as_deref().expect("the tile's levels");
    assert_eq!((texture.transfer, texture.levels.len()), (Transfer::Srgb, 2));
    assert_eq!(texture.levels[1].data, [200; 4]);
    assert!(scene.textures[0].is_none(), "a PNG has no levels of its own");
}

/// Everything that differs from its default.
fn all() -> Detail {
    let layer = DetailLayer {
        transform: LayerTransform {
            scale: vec2(4.0, -2.5),
            rotation: 0.5,
            offset: vec2(0.25, -1.0),
            mirror: true,
        },
        hsv: vec3(-0.125, 0.5, 1.5),
        mask: None,
        opacity: 1.0,
        tiles: [place(1, Wrap::Mirror), None, place(1, Wrap::Mirror), place(1, Wrap::Mirror)],
    };
    let over = DetailLayer {
        mask: Some(DetailMask { texture: place(0, Wrap::Repeat).unwrap(), channel: 3, contrast: 2.0 }),
        tiles: [place(1, Wrap::Repeat), place(1, Wrap::Repeat), None, None],
        opacity: 0.625,
        ..DetailLayer::default()
    };
    Detail {
        plain_overlay: true,
        maps: std::array::from_fn(|_| place(0, Wrap::Repeat)),
        channels: [Some(2), None, Some(0)],
        aniso_alpha: 0.25,
        layers: vec![layer, over],
    }
}

#[test]
fn what_is_written_is_read_again() {
    let detail = all();
    let mut document =
        Document::from_bytes(Path::new("wall.gltf"), &document(json!({ "leftover": 1 }))).unwrap();
    detail.write(document.material_mut(0), |image| image);
    let written = document.material(0)["extensions"][DETAIL_EXTENSION].clone();
    assert_eq!(load(written).unwrap().materials[0].detail, Some(detail));
}

#[test]
fn a_layer_lies_as_texture_transforms_lie() {
    let transform =
        LayerTransform { scale: vec2(2.0, 3.0), rotation: 0.5, offset: Vec2::ZERO, mirror: false };
    let (sin, cos) = (libm::sinf(0.5), libm::cosf(0.5));
    // `u' = u sx cos + v sy sin`, `v' = v sy cos - u sx sin`.
    let wanted = Mat2::from_cols(vec2(2.0 * cos, -2.0 * sin), vec2(3.0 * sin, 3.0 * cos));
    assert!((transform.matrix() - wanted).abs_diff_eq(Mat2::ZERO, 1e-6), "{:?}", transform.matrix());
    let quarter = LayerTransform { rotation: std::f32::consts::FRAC_PI_2, ..LayerTransform::default() };
    assert_eq!(quarter.cos_sin(), Vec2::Y);
}

#[test]
fn what_cannot_be_meant_is_refused_by_material_and_field() {
    let tile = json!({ "index": 1 });
    let layer = |field: &str, value: Value| json!({ "baseColorTexture": tile, field: value });
    let with = |layers: Value| json!({ "baseColorTexture": { "index": 0 }, "layers": layers });
    let plain = json!({ "baseColorTexture": tile });
    for (detail, part) in [
        (with(json!([])), "1 to 3"),
        (with(json!([plain, plain])), "layers[1]: there is no maskTexture"),
        (
            with(json!([layer("maskTexture", tile.clone())])),
            "layers[0]: the bottom layer takes no maskTexture",
        ),
        (with(json!([layer("scale", json!([1, 0]))])), "scale"),
        (with(json!([layer("saturation", json!(-1))])), "saturation"),
        (with(json!([layer("opacity", json!(1.5))])), "0 to 1"),
        (with(json!([layer("maskChannel", json!("x"))])), "r, g, b, a"),
        (with(json!([layer("scal", json!([1, 1]))])), "unknown field"),
        (json!({ "layers": [plain] }), "there is no synthesized map"),
        (json!({ "anisoTexture": tile, "anisoAlpha": 2, "layers": [plain] }), "anisoAlpha"),
        (json!({ "dataTexture": tile, "occlusionChannel": "a", "layers": [plain] }), "none, r, g, b"),
        (json!({ "baseColorTexture": tile, "blend": "soft", "layers": [plain] }), "smooth, plain"),
        (json!({ "baseColorTexture": { "index": 9 }, "layers": [plain] }), "texture 9 does not exist"),
    ] {
        let error = load(detail.clone()).unwrap_err().to_string();
        for part in ["wall.gltf", "material 0 \"wall\"", DETAIL_EXTENSION, part] {
            assert!(error.contains(part), "{detail}: no {part:?} in {error:?}");
        }
    }
}

#[test]
fn the_schema_knows_every_property() {
    let schema = include_str!("../../../docs/schema/KINRAN_materials_detail.schema.json");
    let schema: Value = serde_json::from_str(schema).unwrap();
    let mut document = Document::from_bytes(Path::new("wall.gltf"), &document(json!({}))).unwrap();
    all().write(document.material_mut(0), |image| image);
    let written = &document.material(0)["extensions"][DETAIL_EXTENSION];
    for key in written.as_object().unwrap().keys() {
        assert!(schema["properties"].get(key).is_some(), "{key} is not in the schema");
    }
    for layer in written["layers"].as_array().unwrap() {
        for key in layer.as_object().unwrap().keys() {
            assert!(
                schema["$defs"]["layer"]["properties"].get(key).is_some(),
                "{key} of a layer is not in it"
            );
        }
    }
    for map in DetailMap::ALL {
        assert!(schema["properties"].get(map.property()).is_some());
    }
}
