//! Small documents that probe one thing each.

#[path = "../../stopping.rs"]
mod stopping;

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::{Vec2, Vec3, Vec4};
use kinran_scene::{AlphaMode, Error, LightKind, Needs, Scene, Wrap};
use proptest::prelude::*;
use serde_json::{Value, json};

/// A GLB with every kind of thing in it: indexed and plain triangles, sparse and normalised accessors, a
/// texture, a hierarchy, lights, a camera, instancing.
fn everything() -> (Value, Vec<u8>) {
    let mut bin = Vec::new();
    let mut view = |bytes: &[u8]| {
        bin.resize(bin.len().next_multiple_of(4), 0);
        bin.extend_from_slice(bytes);
        json!({ "buffer": 0, "byteOffset": bin.len() - bytes.len(), "byteLength": bytes.len() })
    };
    let floats = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let pixels = kinran_image::Pixels::U8((0..12).collect());
    let image = kinran_image::Image::new(2, 2, kinran_image::Channels::Rgb, pixels).unwrap();
    let mut views = vec![
        // A unit square in the plane z = 0.
        view(&floats(&[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.])),
        view(&[0, 1, 2, 0, 2, 3]),
        view(&[0u16, 0, 65535, 0, 65535, 65535, 0, 65535].map(u16::to_le_bytes).concat()),
        view(&[3]),
        view(&floats(&[0., 2., 0.])),
        view(&floats(&[5., 0., 0., 0., 6., 0.])),
        view(&kinran_image::encode_png(&image).unwrap()),
        view(&[0, 0, 127, 99].repeat(4)),
    ];
    views[7]["byteStride"] = json!(4);
    let json = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_lights_punctual", "KHR_texture_transform", "KHR_materials_anisotropy", "EXT_mesh_gpu_instancing"],
        "extensionsRequired": ["KHR_texture_transform"],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [
            { "scale": [2, 2, 2], "children": [1, 2, 3] },
            { "name": "square", "mesh": 0, "translation": [1, 0, 0] },
            { "camera": 0, "translation": [0, 0, 4], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "mesh": 0, "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 4 } } } },
        ],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }],
        "extensions": { "KHR_lights_punctual": { "lights": [
            { "type": "spot", "color": [1, 0.5, 0], "intensity": 4, "range": 9, "spot": { "innerConeAngle": 0.1 }, "extras": 1 },
        ] } },
        "meshes": [{ "name": "quad", "primitives": [
            { "attributes": { "POSITION": 0, "NORMAL": 5, "TEXCOORD_0": 2 }, "indices": 1, "material": 0 },
            { "attributes": { "POSITION": 3 }, "mode": 5 },
        ] }],
        "materials": [{
            "name": "brushed",
            "normalTexture": { "index": 0, "scale": 0.5, "extensions": { "KHR_texture_transform": { "offset": [0, 1], "rotation": std::f32::consts::FRAC_PI_2, "scale": [0.5, 0.5] } } },
            "alphaMode": "MASK",
            "emissiveFactor": [0.5, 0, 0],
            "extensions": {
                "KHR_materials_anisotropy": { "anisotropyStrength": 0.6, "anisotropyRotation": 1.57, "anisotropyTexture": { "index": 0 } },
                "KHR_materials_diffuse_transmission": { "diffuseTransmissionFactor": 0.25, "diffuseTransmissionTexture": { "index": 0 } },
                "KHR_materials_emissive_strength": { "emissiveStrength": 4 },
                "KHR_materials_ior": { "ior": 1.33 },
                "KHR_materials_specular": { "specularFactor": 0.5, "specularColorFactor": [1, 2, 0], "specularColorTexture": { "index": 0 } },
                "KHR_materials_clearcoat": {},
            },
        }],
        "textures": [{ "source": 0, "sampler": 0 }],
        "samplers": [{ "wrapS": 33071, "wrapT": 33648 }],
        "images": [{ "bufferView": 6, "mimeType": "image/png" }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR" },
            { "bufferView": 2, "componentType": 5123, "normalized": true, "count": 4, "type": "VEC2" },
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
              "sparse": { "count": 1, "indices": { "bufferView": 3, "componentType": 5121 }, "values": { "bufferView": 4 } } },
            { "bufferView": 5, "componentType": 5126, "count": 2, "type": "VEC3" },
            { "bufferView": 7, "componentType": 5120, "normalized": true, "count": 4, "type": "VEC3" },
        ],
        "bufferViews": views,
        "buffers": [{ "byteLength": bin.len() }],
    });
    (json, bin)
}

fn glb(json: &Value, bin: &[u8]) -> Vec<u8> {
    let mut json = serde_json::to_vec(json).unwrap();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = b"glTF".to_vec();
    for n in [2, (28 + json.len() + bin.len().next_multiple_of(4)) as u32, json.len() as u32] {
        out.extend(n.to_le_bytes());
    }
    out.extend(b"JSON");
    out.extend(json);
    out.extend((bin.len().next_multiple_of(4) as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(bin);
    out.resize(out.len().next_multiple_of(4), 0);
    out
}

fn load(bytes: &[u8]) -> Result<Scene, Error> {
    Scene::from_bytes(Path::new("test.glb"), bytes, &|path| {
        Err(std::io::Error::other(format!("no {path} here")))
    })
}

fn assert_near(what: &str, want: Vec3, got: Vec3) {
    assert!((want - got).length() < 1e-5, "{what}: wanted {want}, got {got}");
}

#[test]
fn a_stopped_document_is_read_on() {
    let folder = tempfile::tempdir().unwrap();
    let (json, bin) = everything();
    let plain = folder.path().join("everything.glb");
    std::fs::write(&plain, glb(&json, &bin)).unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    for path in [plain, data.join("draco_edgebreaker.glb"), data.join("meshopt_ext.glb")] {
        let units = AtomicU64::new(0);
        let expect = |more| _ = units.fetch_add(more, Ordering::Relaxed);
        Scene::load_watched(&path, &[], &Needs::ALL, &expect, &kinran_image::untold).unwrap();
        let is_cancelled = |error: &Error| matches!(error, Error::Cancelled(_));
        stopping::assert_stops(&path.to_string_lossy(), units.into_inner(), is_cancelled, |tick| {
            Scene::load_watched(&path, &[], &Needs::ALL, &|_| {}, tick)
        });
    }
}

#[test]
fn everything_arrives_where_it_belongs() {
    let (json, bin) = everything();
    let scene = load(&glb(&json, &bin)).unwrap();
    let [square, strip] = &scene.primitives[..] else { panic!("{} primitives", scene.primitives.len()) };

    // The strip has no material of its own, no UVs and no normals; its last vertex is replaced.
    assert_eq!((square.material, strip.material), (0, 1));
    assert_eq!(scene.materials[1].name, "default");
    assert_eq!(strip.triangles.len(), 2);
    assert_eq!(strip.positions.len(), 6, "flat normals need a vertex for each corner");
    assert!(strip.positions.contains(&Vec3::new(0., 2., 0.)), "{:?}", strip.positions);
    assert!(!strip.positions.contains(&Vec3::Y), "{:?}", strip.positions);
    assert_near("normal of the first triangle of the strip", Vec3::Z, strip.normals[0]);
    assert_near("strips alternate their winding", Vec3::NEG_Z, strip.normals[3]);

    // v runs downwards in glTF, and in this square upwards in space: the bitangent is -y.
    assert_eq!(square.triangles.len(), 2);
    assert_eq!(square.positions.len(), 4, "corners that agree stay one vertex");
    for (i, position) in square.positions.iter().enumerate() {
        assert_eq!(square.uvs[0][i], Vec2::new(position.x, position.y));
        assert_near("normal", Vec3::Z, square.normals[i]);
        let tangent: Vec4 = square.tangents[i];
        assert_near("tangent", Vec3::X, tangent.truncate());
        assert_near("bitangent", Vec3::NEG_Y, square.normals[i].cross(tangent.truncate()) * tangent.w);
    }

    let places: Vec<Vec3> = scene.instances.iter().map(|i| i.transform.transform_point3(Vec3::X)).collect();
    let want = [[4., 0., 0.], [4., 0., 0.], [12., 0., 0.], [12., 0., 0.], [2., 12., 0.], [2., 12., 0.]];
    assert_eq!(places, want.map(Vec3::from));
    assert_eq!(scene.triangle_count(), 12);
    let [min, max] = scene.bounds().unwrap();
    assert_eq!((min, max), (Vec3::ZERO, Vec3::new(12., 16., 0.)));

    let camera = &scene.cameras[0];
    assert_near("the camera", Vec3::new(0., 0., 8.), camera.transform.translation.into());
    assert_near("the camera has no scale", Vec3::Z, camera.transform.matrix3.z_axis.into());
    let light = &scene.lights[0];
    assert_near("light", Vec3::NEG_Z, light.direction);
    assert_eq!((light.color, light.range), (Vec3::new(4., 2., 0.), 9.));
    assert!(matches!(light.kind, LightKind::Spot { inner_cone_angle: 0.1, .. }), "{:?}", light.kind);

    let material = &scene.materials[0];
    let normal = material.normal.as_ref().unwrap();
    assert_eq!(material.normal_scale, 0.5);
    assert_eq!(normal.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert_eq!(material.alpha_mode, AlphaMode::Mask { cutoff: 0.5 });
    assert_eq!(material.emissive_factor, Vec3::new(2., 0., 0.));
    assert_eq!(material.ignored_extensions, ["KHR_materials_clearcoat"]);
    let anisotropy = material.anisotropy.as_ref().unwrap();
    assert_eq!((anisotropy.strength, anisotropy.rotation), (0.6, 1.57));
    assert!(anisotropy.texture.is_some());
    let through = material.diffuse_transmission.as_ref().unwrap();
    assert_eq!((through.factor, through.color_factor), (0.25, Vec3::ONE));
    assert!(through.texture.is_some() && through.color.is_none());
    let dielectric = material.dielectric.as_ref().unwrap();
    assert_eq!((dielectric.ior, dielectric.strength), (1.33, 0.5));
    assert_eq!(dielectric.color_factor, Vec3::new(1., 2., 0.));
    assert!(dielectric.strength_texture.is_none() && dielectric.color.is_some());
    let image = scene.images[0].as_ref().unwrap();
    assert_eq!(image.pixels, kinran_image::Pixels::U8((0..12).collect()));

    // The extension's own example: this transform takes the lower left quarter of the image.
    let [min, max] = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE]
        .map(|uv| (normal.transform * uv.extend(1.0)).truncate())
        .iter()
        .fold([Vec2::MAX, Vec2::MIN], |[min, max], &uv| [min.min(uv), max.max(uv)]);
    assert!(
        min.distance(Vec2::new(0., 0.5)) < 1e-6 && max.distance(Vec2::new(0.5, 1.)) < 1e-6,
        "{min} {max}"
    );
    assert_eq!(scene.warnings, Vec::<String>::new());
}

/// Textures without PNG or JPEG, as a baker for one engine writes them.
#[test]
fn engine_textures_stand_in_for_missing_images() {
    use kinran_image::{Channels, Format, Level, Pixels, Texture, Transfer, encode_dds, encode_ktx2};
    for (format, channels) in
        [(Format::Bc7, Channels::Rgba), (Format::Bc5, Channels::Rgb), (Format::Bc4, Channels::R)]
    {
        let level = Level { width: 4, height: 4, data: vec![0; format.level_bytes(4, 4)] };
        let texture =
            Texture { format, transfer: Transfer::Linear, levels: vec![level], metadata: Default::default() };
        for (extension, bytes) in [
            ("KHR_texture_basisu", encode_ktx2(&texture, None).unwrap()),
            ("MSFT_texture_dds", encode_dds(&texture).unwrap()),
        ] {
            let (mut json, mut bin) = everything();
            bin.resize(bin.len().next_multiple_of(4), 0);
            json["bufferViews"][6] =
                json!({ "buffer": 0, "byteOffset": bin.len(), "byteLength": bytes.len() });
            bin.extend(bytes);
            json["buffers"][0]["byteLength"] = json!(bin.len());
            json["textures"][0] = json!({ "extensions": { extension: { "source": 0 } } });
            json["extensionsRequired"] = json!([extension]);
            let scene =
                load(&glb(&json, &bin)).unwrap_or_else(|error| panic!("{extension} {format:?}: {error}"));
            let image = scene.images[0].as_ref().unwrap();
            assert_eq!(
                (image.width, image.height, image.channels),
                (4, 4, channels),
                "{extension} {format:?}"
            );
            let floats = matches!(image.pixels, Pixels::F32(_));
            assert_eq!(floats, format != Format::Bc7, "{extension} {format:?}");
            if let (Format::Bc5, Pixels::F32(samples)) = (format, &image.pixels) {
                // Blocks of zeros are x = y = -1, outside the unit disc: no z is left.
                assert_eq!(samples[..3], [0.0, 0.0, 0.5], "{extension}");
            }
        }
    }
}

/// A WebP alone, as optimisers leave it, and beside a PNG that is taken then.
#[test]
fn webp_textures_are_read_where_they_stand_alone() {
    let webp = include_bytes!("../../kinran-image/tests/data/rgb.webp");
    for alone in [true, false] {
        let (mut json, mut bin) = everything();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": bin.len(), "byteLength": webp.len() });
        bin.extend(webp);
        json["buffers"][0]["byteLength"] = json!(bin.len());
        let views = json["bufferViews"].as_array_mut().unwrap();
        views.push(view);
        let view = views.len() - 1;
        let images = json["images"].as_array_mut().unwrap();
        images.push(json!({ "bufferView": view, "mimeType": "image/webp" }));
        let image = images.len() - 1;
        let texture = &mut json["textures"][0];
        texture["extensions"] = json!({ "EXT_texture_webp": { "source": image } });
        if alone {
            texture.as_object_mut().unwrap().remove("source");
            json["extensionsRequired"] = json!(["EXT_texture_webp"]);
        }
        let scene = load(&glb(&json, &bin)).unwrap();
        let read = scene.images[image].as_ref();
        assert_eq!(read.map(|image| (image.width, image.height)), alone.then_some((13, 11)));
        // Texel (3, 2) as it was painted: 3 * 12 + 2, 2 * 17, 255 - 3 * 12 - 2.
        let texel = read.map(|image| image.texel(3, 2).map(|v| (v * 255.0).round()));
        assert_eq!(texel, alone.then_some([38.0, 34.0, 217.0, 255.0]));
    }
}

#[test]
fn engine_textures_beside_images_are_read_too_or_their_loss_is_told() {
    use kinran_image::{Format, Level, Texture, Transfer, encode_ktx2};
    let level = Level { width: 4, height: 4, data: vec![0; 16] };
    let texture = Texture {
        format: Format::Bc7,
        transfer: Transfer::Linear,
        levels: vec![level],
        metadata: Default::default(),
    };
    let good = encode_ktx2(&texture, None).unwrap();
    let with = |file: &[u8]| {
        let (mut json, mut bin) = everything();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": bin.len(), "byteLength": file.len() });
        bin.extend(file);
        json["buffers"][0]["byteLength"] = json!(bin.len());
        let views = json["bufferViews"].as_array_mut().unwrap();
        views.push(view);
        let view = views.len() - 1;
        let images = json["images"].as_array_mut().unwrap();
        images.push(json!({ "bufferView": view }));
        let image = images.len() - 1;
        json["textures"][0]["extensions"] = json!({ "KHR_texture_basisu": { "source": image } });
        (load(&glb(&json, &bin)).unwrap(), image)
    };
    let (scene, image) = with(&good);
    assert_eq!(scene.textures[image].as_deref().map(|t| &t.levels), Some(&texture.levels));
    let place = scene.materials.iter().flat_map(|m| m.textures()).find(|t| t.runtime == Some(image));
    assert!(place.is_some_and(|t| t.image != image), "the PNG is still the image: {place:?}");

    let (scene, image) = with(&good[..good.len() - 9]);
    let told = scene.warnings.iter().any(|w| w.contains(&format!("image {image}")) && w.contains("PNG"));
    assert!(scene.textures[image].is_none() && told, "{:?}", scene.warnings);
}

#[test]
fn an_aniso_texture_is_read_where_its_extension_says() {
    let (mut json, bin) = everything();
    json["materials"][0]["extensions"]["KINRAN_materials_aniso"] =
        json!({ "anisoTexture": { "index": 0, "texCoord": 1 } });
    let scene = load(&glb(&json, &bin)).unwrap();
    assert_eq!(scene.materials[0].aniso.as_ref().map(|t| t.uv_set), Some(1));
    assert!(!scene.materials[0].ignored_extensions.iter().any(|e| e == "KINRAN_materials_aniso"));
    json["materials"][0]["extensions"]["KINRAN_materials_aniso"] = json!({ "texture": { "index": 0 } });
    let error = load(&glb(&json, &bin)).unwrap_err().to_string();
    assert!(error.contains("KINRAN_materials_aniso") && error.contains("anisoTexture"), "{error}");
}

/// Each of these must be refused by one sentence that holds all the given words.
#[test]
fn hostile_documents_are_refused_by_name() {
    let huge = u64::MAX;
    let cases: Vec<(&str, Value, &[&str])> = vec![
        ("/asset/version", json!("1.0"), &["test.glb", "glTF version", "2.0"]),
        ("/extensionsRequired/0", json!("KHR_made_up"), &["KHR_made_up", "export it without"]),
        ("/extensionsRequired/0", json!("ACME_holes"), &["ACME_holes"]),
        ("/buffers/0/byteLength", json!(100_000), &["buffer 0", "100000", "truncated"]),
        ("/buffers/0/byteLength", json!(huge), &["buffer 0", "truncated"]),
        ("/buffers/0/uri", json!("http://example.org/a.bin"), &["buffer 0", "not relative"]),
        ("/buffers/0/uri", json!("/etc/passwd"), &["buffer 0", "relative"]),
        ("/buffers/0/uri", json!("gone.bin"), &["buffer 0", "gone.bin", "cannot be read"]),
        ("/buffers/0/uri", json!("data:;base64,!!"), &["buffer 0", "base64"]),
        ("/bufferViews/0/byteLength", json!(huge), &["POSITION", "bufferView 0"]),
        ("/bufferViews/0/byteOffset", json!(huge), &["POSITION", "bufferView 0"]),
        ("/bufferViews/0/buffer", json!(7), &["buffer 7 does not exist"]),
        ("/bufferViews/0/byteStride", json!(1), &["byteStride 1"]),
        ("/bufferViews/0/byteStride", json!(huge), &["POSITION", "bufferView 0"]),
        ("/accessors/0/count", json!(1_000_000_000), &["POSITION", "1000000000"]),
        ("/accessors/1/count", json!(1_000_000_000), &["indices", "1000000000"]),
        ("/accessors/0/count", json!(huge), &["POSITION"]),
        ("/accessors/0/byteOffset", json!(huge), &["POSITION"]),
        ("/accessors/0/bufferView", json!(99), &["bufferView 99 does not exist"]),
        ("/accessors/0/componentType", json!(5130), &["componentType 5130"]),
        ("/accessors/0/type", json!("MAT4"), &["MAT4"]),
        ("/accessors/2/count", json!(3), &["TEXCOORD_0 has 3 elements", "POSITION 4"]),
        ("/accessors/3/sparse/count", json!(5), &["replaces 5"]),
        ("/accessors/1/componentType", json!(5126), &["indices of componentType 5126"]),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            json!(99),
            &["mesh 0 \"quad\", primitive 0", "accessor 99"],
        ),
        ("/meshes/0/primitives/0/indices", json!(99), &["accessor 99 does not exist"]),
        ("/meshes/0/primitives/0/material", json!(99), &["material 99 does not exist"]),
        ("/meshes/0/primitives/0/mode", json!(9), &["mode 9"]),
        ("/nodes/1/mesh", json!(99), &["node 1 \"square\"", "mesh 99"]),
        ("/nodes/0/children/0", json!(0), &["node 0", "reached twice"]),
        ("/nodes/0/children/0", json!(99), &["node 99 does not exist"]),
        ("/nodes/0/scale/0", json!(1e300), &["node", "too large"]),
        ("/nodes/1/rotation", json!([0, 0, 0, 0]), &["node 1", "rotation"]),
        ("/nodes/2/camera", json!(5), &["camera 5"]),
        ("/nodes/2/extensions/KHR_lights_punctual/light", json!(5), &["light 5"]),
        ("/cameras/0/perspective/yfov", json!(-1), &["camera 0", "yfov"]),
        ("/extensions/KHR_lights_punctual/lights/0/color/0", json!(3e38), &["light 0", "intensity"]),
        ("/materials/0/normalTexture/index", json!(9), &["material 0 \"brushed\"", "texture 9"]),
        ("/materials/0/emissiveFactor/0", json!(3e38), &["material 0", "emissiveFactor"]),
        ("/textures/0/source", json!(9), &["image 9"]),
        ("/textures/0/sampler", json!(9), &["sampler 9"]),
        ("/samplers/0/wrapS", json!(1), &["wrap mode 1"]),
        ("/images/0/bufferView", json!(0), &["image 0"]),
        ("/scene", json!(3), &["scene 3"]),
        ("/materials/0/alphaCutoff", json!(1e200), &["JSON", "out of range"]),
        ("/accessors", json!("many"), &["JSON"]),
    ];
    for (pointer, value, words) in cases {
        let (mut json, bin) = everything();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        match json.pointer_mut(parent).unwrap() {
            Value::Object(object) => drop(object.insert(key.into(), value.clone())),
            Value::Array(array) => array[key.parse::<usize>().unwrap()] = value.clone(),
            other => panic!("{pointer}: {other}"),
        }
        let error = match load(&glb(&json, &bin)) {
            Ok(_) => panic!("{pointer} = {value} was accepted"),
            Err(error) => error.to_string(),
        };
        for word in words {
            assert!(error.contains(word), "{pointer} = {value}: no {word:?} in {error:?}");
        }
        assert!(error.contains("test.glb"), "{pointer} = {value}: no file name in {error:?}");
    }
}

#[test]
fn vertices_that_are_not_numbers_and_indices_out_of_range_are_named() {
    let (json, mut bin) = everything();
    bin[4..8].copy_from_slice(&f32::NAN.to_le_bytes());
    let error = load(&glb(&json, &bin)).unwrap_err().to_string();
    assert!(
        error.contains("mesh 0 \"quad\", primitive 0: POSITION: element 0") && error.contains("NaN"),
        "{error}"
    );

    let (json, mut bin) = everything();
    let offset = json["bufferViews"][1]["byteOffset"].as_u64().unwrap() as usize;
    bin[offset + 5] = 200;
    let error = load(&glb(&json, &bin)).unwrap_err().to_string();
    assert!(error.contains("index number 5 is 200, and there are 4 vertices"), "{error}");
}

/// A few kilobytes of JSON that ask for terabytes: by sparse accessors without bytes, and by many
/// primitives that share theirs.
#[test]
fn small_files_cannot_expand_without_bound() {
    let (mut json, bin) = everything();
    json["accessors"][0] = json!({ "componentType": 5126, "count": 1_000_000_000_000u64, "type": "VEC3" });
    let error = load(&glb(&json, &bin)).unwrap_err().to_string();
    assert!(error.contains("POSITION") && error.contains("more than its bytes can hold"), "{error}");

    let (mut json, bin) = everything();
    json["accessors"][0] = json!({ "componentType": 5126, "count": 1 << 20, "type": "VEC3" });
    json["meshes"][0]["primitives"] =
        vec![json!({ "attributes": { "POSITION": 0, "NORMAL": 0 } }); 4000].into();
    let error = load(&glb(&json, &bin)).unwrap_err().to_string();
    assert!(error.contains("by sharing"), "{error}");
}

#[test]
fn harmless_flaws_are_mended_with_a_warning() {
    let cases: [(&str, Value, &str); 6] = [
        ("/meshes/0/primitives/1/mode", json!(0), "points or lines"),
        ("/meshes/0/primitives/1/attributes", json!({}), "no POSITION"),
        ("/accessors/1/count", json!(5), "no multiple of three"),
        ("/nodes/1/scale", json!([1, 1, 0]), "scaled to nothing"),
        ("/materials/0/normalTexture/texCoord", json!(1), "no TEXCOORD_1"),
        ("/materials/0/pbrMetallicRoughness", json!({ "roughnessFactor": 3 }), "clamped"),
    ];
    for (pointer, value, word) in cases {
        let (mut json, bin) = everything();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        json.pointer_mut(parent).unwrap().as_object_mut().unwrap().insert(key.into(), value.clone());
        let scene = load(&glb(&json, &bin)).unwrap_or_else(|error| panic!("{pointer} = {value}: {error}"));
        assert!(
            scene.warnings.iter().any(|warning| warning.contains(word)),
            "{pointer}: {:?}",
            scene.warnings
        );
    }
}

#[test]
fn paths_that_are_no_documents_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let error = Scene::load(folder.path()).unwrap_err().to_string();
    assert!(
        error.contains("is a folder; name a file in it") && error.contains(folder.path().to_str().unwrap()),
        "{error}"
    );
    let gone = folder.path().join("gone.glb");
    assert!(Scene::load(&gone).unwrap_err().to_string().contains("gone.glb"));
    for (name, content, word) in [
        ("a.glb", &b"glTF"[..], "cut off"),
        ("b.png", b"\x89PNG\r\n\x1a\n", "`.png` is not read; give .glb, .gltf or .obj"),
        ("no_extension", b"solid ball", "is not glTF"),
        ("c.gltf", b"", "is not glTF"),
        ("d.gltf", b"{\"asset\":", "JSON"),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        let error = Scene::load(&path).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains(name), "{name}: {error}");
    }
}

/// 100 000 nodes in a row: a recursion would overflow the stack.
#[test]
fn deep_hierarchies_do_not_overflow() {
    let nodes: Vec<Value> =
        (1..=100_000).map(|child| json!({ "children": [child] })).chain([json!({})]).collect();
    let json = json!({ "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": nodes });
    assert!(load(&glb(&json, &[])).unwrap().instances.is_empty());
}

#[test]
fn truncation_anywhere_is_an_error_not_a_panic() {
    let (json, bin) = everything();
    let whole = glb(&json, &bin);
    for length in 0..whole.len() {
        assert!(load(&whole[..length]).is_err(), "the first {length} of {} bytes were accepted", whole.len());
        let path = Path::new("test.glb");
        assert!(kinran_scene::Document::from_bytes(path, &whole[..length]).is_err(), "{length} bytes");
    }
}

/// Reads a damaged document in all ways that there are; whatever comes out, it comes out.
fn read_all_ways(bytes: &[u8]) {
    if let Ok(scene) = load(bytes) {
        let camera = scene.default_camera(1.0);
        assert_eq!(camera.is_some(), scene.triangle_count() > 0);
    }
    let folder = tempfile::tempdir().unwrap();
    if let Ok(document) = kinran_scene::Document::from_bytes(&folder.path().join("in.glb"), bytes) {
        let _ = document.write(folder.path().join("out.glb"));
        let _ = document.write(folder.path().join("out.gltf"));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn damaged_bytes_never_panic(flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8)) {
        let (json, bin) = everything();
        let mut bytes = glb(&json, &bin);
        for (at, value) in flips {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        read_all_ways(&bytes);
    }

    /// Damage that survives the JSON parser: any number anywhere becomes any other.
    #[test]
    fn damaged_numbers_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), prop_oneof![
            Just(json!(0)), Just(json!(1)), Just(json!(u64::MAX)), Just(json!(u32::MAX)), Just(json!(-1)),
            Just(json!(1e300)), Just(json!(null)), Just(json!("x")), Just(json!([])), (0u64..300).prop_map(|n| json!(n)),
        ]), 1..4),
    ) {
        let (mut json, bin) = everything();
        for (at, value) in changes {
            let mut leaves = Vec::new();
            numbers(&json, String::new(), &mut leaves);
            let pointer = &leaves[at.index(leaves.len())];
            *json.pointer_mut(pointer).unwrap() = value;
        }
        read_all_ways(&glb(&json, &bin));
    }
}

/// Pointers to all numbers.
fn numbers(value: &Value, pointer: String, out: &mut Vec<String>) {
    match value {
        Value::Number(_) => out.push(pointer),
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(i, value)| numbers(value, format!("{pointer}/{i}"), out));
        }
        Value::Object(object) => {
            object.iter().for_each(|(key, value)| numbers(value, format!("{pointer}/{key}"), out));
        }
        _ => {}
    }
}

#[test]
fn an_obj_is_read_in_triangles_and_a_bad_one_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let load = |text: &str| {
        let path = folder.path().join("a.obj");
        std::fs::write(&path, text).unwrap();
        Scene::load(&path).map_err(|e| e.to_string())
    };
    let corners = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    let scene = load(&format!("{corners}f 1/1 2/2 3/3 4/4\n")).unwrap();
    let primitive = &scene.primitives[0];
    assert_eq!(primitive.triangles.len(), 2, "a square is two triangles");
    assert!(primitive.source.lacks_normals);
    assert!(primitive.normals.iter().all(|n| (*n - Vec3::Z).length() < 1e-6));
    let at = primitive.positions.iter().position(|p| p.x == 2.0 && p.y == 1.0).unwrap();
    assert_eq!(primitive.uvs[0][at], Vec2::new(1.0, 0.0), "v runs down");

    // It is grey, and says so where it names materials.
    assert_eq!(scene.warnings, [""; 0]);
    let scene = load(&format!("mtllib a.mtl\n{corners}usemtl cloth\nf 1/1 2/2 3/3 4/4\n")).unwrap();
    assert!(
        scene.warnings.len() == 1 && scene.warnings[0].contains("materials of .mtl files are not read"),
        "wanted a warning of a.mtl, got {:?}",
        scene.warnings
    );
    for (text, part) in [
        (format!("{corners}f 1 2 1000000000\n"), "a.obj: line 9: a face names v 1000000000, and there are 4"),
        (corners.to_owned(), "a.obj: the OBJ has no faces"),
        ("v 0 0\nf 1 1 1\n".to_owned(), "a.obj: line 1: a v line"),
        (format!("{}f 1 2 3\n", corners.replace("v 2 1 0", "v nan 1 0")), "POSITION"),
    ] {
        let error = load(&text).unwrap_err();
        assert!(error.contains(part), "{text}: {error}");
    }
}

/// A primitive of an OBJ must not take what another face has, nor end at what other tools write.
#[test]
fn an_obj_of_any_tool_is_read_as_it_stands() {
    let folder = tempfile::tempdir().unwrap();
    let load = |text: &[u8]| {
        let path = folder.path().join("a.obj");
        std::fs::write(&path, text).unwrap();
        Scene::load(&path).unwrap_or_else(|e| panic!("{}: {e}", String::from_utf8_lossy(text)))
    };
    let corners = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 -1\n";
    // Lines, points, curves and a comment in Latin-1 that ends with a backslash.
    let text =
        [b"# caf\xe9 in C:\\\n".as_slice(), corners.as_bytes(), b"l 1 2 3\np 1\ncurv 0 1 1 2\nf 1 2 3\n"];
    let scene = load(&text.concat());
    assert_eq!(scene.primitives[0].triangles.len(), 1);
    // Faces with and without normals and UVs.
    let scene = load(
        format!("{corners}f 1//1 2//1 3//1\nf 1/1 2/2 3/3\nf 1 3 4\nf 1/1/1 2/2/1 3/3/1\nf 1//1 2 3\n")
            .as_bytes(),
    );
    let kinds: Vec<(usize, bool, bool)> = scene
        .primitives
        .iter()
        .map(|p| (p.triangles.len(), p.source.lacks_normals, p.uvs[0].is_empty()))
        .collect();
    assert_eq!(kinds, [(1, false, true), (1, true, false), (2, true, true), (1, false, false)]);
    assert!(scene.primitives[0].normals.iter().all(|n| *n == Vec3::NEG_Z), "authored normals");
    assert!(scene.primitives[2].normals.iter().all(|n| *n == Vec3::Z), "flat normals");
    // A line goes on; indices count from the end; four corners and a colour for each vertex.
    let scene = load("v 0 0 0 1 0 0\nv 2 0 \\\n 0\nv 2 1 0\nv 0 1 0\r\nf -4 -3 \\\r\n-2 -1\n".as_bytes());
    assert_eq!(scene.primitives[0].triangles.len(), 2);
    assert_eq!(scene.bounds().unwrap(), [Vec3::ZERO, Vec3::new(2.0, 1.0, 0.0)]);
}

/// What exporters get wrong around the JSON, and chunks that glTF does not know.
#[test]
fn a_glb_with_odd_chunks_is_read_and_kept() {
    let (json, bin) = everything();
    let plain = load(&glb(&json, &bin)).unwrap();
    let chunk =
        |kind: &[u8; 4], bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], kind, bytes].concat();
    let text = serde_json::to_vec(&json).unwrap();
    let padded = |with: u8| {
        let mut text = text.clone();
        text.resize((text.len() + 4).next_multiple_of(4), with);
        text
    };
    let mut bin = bin;
    bin.resize(bin.len().next_multiple_of(4), 0);
    let build = |text: &[u8]| {
        let chunks = [chunk(b"JSON", text), chunk(b"BIN\0", &bin), chunk(b"XTRA", b"kept")].concat();
        [&b"glTF"[..], &2u32.to_le_bytes(), &(12 + chunks.len() as u32).to_le_bytes(), &chunks].concat()
    };
    let marked = [b"\xef\xbb\xbf".as_slice(), &padded(b' ')[..text.len() + 1]].concat();
    for (what, text, warning) in [
        ("spaces", padded(b' '), None),
        ("zeros", padded(0), Some("padded with zeros")),
        ("a byte order mark", marked, Some("byte order mark")),
    ] {
        let bytes = build(&text);
        let scene = load(&bytes).unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_eq!(scene.primitives, plain.primitives, "{what}");
        let told = warning.is_none_or(|word| scene.warnings.iter().any(|w| w.contains(word)));
        assert!(told, "{what}: {:?}", scene.warnings);
        let folder = tempfile::tempdir().unwrap();
        let document = kinran_scene::Document::from_bytes(&folder.path().join("in.vrm"), &bytes).unwrap();
        document.write(folder.path().join("out.vrm")).unwrap();
        let written = std::fs::read(folder.path().join("out.vrm")).unwrap();
        assert_eq!(&written[..4], b"glTF", "{what}");
        assert_eq!(u32::from_le_bytes(written[8..12].try_into().unwrap()) as usize, written.len(), "{what}");
        assert!(written.ends_with(&chunk(b"XTRA", b"kept")), "{what}: the unknown chunk is gone");
        assert_eq!(load(&written).unwrap().primitives, plain.primitives, "{what}, written");
        let lost = document.write(folder.path().join("out.gltf")).unwrap();
        assert!(lost.iter().any(|w| w.contains("XTRA")), "{what}: {lost:?}");
    }
}

/// What a task does not ask for is not judged.
#[test]
fn a_damaged_part_stops_a_task_that_does_not_need_it() {
    use kinran_scene::{Maps, Needs};
    let folder = tempfile::tempdir().unwrap();
    let (mut json, mut bin) = everything();
    json["images"].as_array_mut().unwrap().push(json!({ "uri": "gone.png" }));
    json["textures"].as_array_mut().unwrap().extend([json!({ "source": 1 }), json!({})]);
    json["materials"][0]["pbrMetallicRoughness"] = json!({ "baseColorTexture": { "index": 1 } });
    json["materials"][0]["emissiveTexture"] = json!({ "index": 2 });
    // The first vertex is no number.
    bin[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let path = folder.path().join("a.glb");
    std::fs::write(&path, glb(&json, &bin)).unwrap();
    let needs = |geometry, maps| {
        Scene::load_part(&path, &[], &Needs { geometry, rest_pose: true, maps, ..Needs::NONE })
    };
    let scene = needs(false, Maps::Surface).unwrap();
    assert!(scene.images[0].is_some(), "the normal map");
    assert!(scene.warnings.iter().any(|w| w.contains("emissiveTexture") && w.contains("left as it is")));
    assert!(needs(true, Maps::Surface).unwrap_err().to_string().contains("POSITION"));
    let error = needs(false, Maps::Plain).unwrap_err().to_string();
    assert!(error.contains("emissiveTexture"), "{error}");
    json["materials"][0].as_object_mut().unwrap().remove("emissiveTexture");
    std::fs::write(&path, glb(&json, &bin)).unwrap();
    let error = needs(false, Maps::Plain).unwrap_err().to_string();
    assert!(error.contains("gone.png"), "{error}");
}

/// Files of tests/data: what is compressed is, bit by bit, what the makers of the compressions read.
#[test]
fn compressed_geometry_is_read_as_other_geometry() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    for name in ["draco_edgebreaker", "draco_sequential", "meshopt_ext", "meshopt_khr", "meshopt_khr_float"] {
        let [packed, plain] = [name.to_owned(), format!("{name}_plain")]
            .map(|file| std::fs::read(data.join(format!("{file}.glb"))).unwrap());
        let wanted = load(&plain).unwrap();
        let got = load(&packed).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(got.primitives, wanted.primitives, "{name}");
        let [min, max] = got.bounds().unwrap();
        assert!((max - min - 0.02).abs().max_element() < 2e-5, "{name}: from {min} to {max}");

        // Written plain, with nothing of the compression left.
        let folder = tempfile::tempdir().unwrap();
        let mut document =
            kinran_scene::Document::from_bytes(&folder.path().join("in.glb"), &packed).unwrap();
        assert!(document.decompress().unwrap(), "{name} is compressed");
        let written = folder.path().join("out.glb");
        assert_eq!(document.write(&written).unwrap(), [] as [String; 0], "{name}");
        let bytes = std::fs::read(&written).unwrap();
        assert!(!String::from_utf8_lossy(&bytes).contains("compression"), "{name} still names its extension");
        assert!(bytes.len() <= plain.len() + 1200, "{name}: {} bytes, plain {}", bytes.len(), plain.len());
        assert_eq!(Scene::load(&written).unwrap().primitives, wanted.primitives, "{name}, written");

        // Damage anywhere in the streams.
        let json = u32::from_le_bytes(packed[12..16].try_into().unwrap()) as usize;
        for at in (28 + json..packed.len()).step_by(29) {
            let mut damaged = packed.clone();
            damaged[at] ^= 0x55;
            read_all_ways(&damaged);
        }
        // Textures need none of it.
        let start = 28 + json;
        let mut empty = packed.clone();
        empty[start..].fill(0xff);
        let path = folder.path().join("noise.glb");
        std::fs::write(&path, empty).unwrap();
        assert!(Scene::load(&path).is_err(), "{name}: noise was geometry");
        let needs = Needs { rest_pose: true, maps: kinran_scene::Maps::Surface, ..Needs::NONE };
        assert!(Scene::load_part(&path, &[], &needs).is_ok(), "{name}: textures need geometry");
    }
}
