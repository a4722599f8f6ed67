//! Colour, metalness and lobe, filtered together and one by one.

use std::collections::BTreeMap;
use std::path::Path;

use kinran::bake::{FolderOptions, GltfOptions, folder, gltf, understand};
use kinran::report::Report;
use kinran::{Memory, Task};
use kinran_bake::aniso::Filter;
use kinran_image::{Channels, Encoder, Format, Image, Pixels, decode_ktx2, encode_png};

type Baked = (BTreeMap<String, Vec<u8>>, Vec<Report>);

/// A picture of this size; a sample is what `of` makes of a number that differs everywhere.
fn png((width, height): (u32, u32), channels: Channels, seed: u32, of: fn(u8) -> u8) -> Vec<u8> {
    let count = width * height * channels.count() as u32;
    let noise = |i: u32| ((i.wrapping_mul(2_654_435_761) ^ seed.wrapping_mul(40_503)) >> 7) as u8;
    let samples = (0..count).map(|i| of(noise(i))).collect();
    encode_png(&Image::new(width, height, channels, Pixels::U8(samples)).unwrap()).unwrap()
}

const SIZE: (u32, u32) = (32, 16);

/// Bumps of up to 7 degrees.
fn normals() -> Vec<u8> {
    let noise = |i: u32| (i.wrapping_mul(2_654_435_761) >> 28) as u8;
    let texels = (0..SIZE.0 * SIZE.1).flat_map(|i| [120 + noise(2 * i), 120 + noise(2 * i + 1), 255]);
    let pixels = Pixels::U8(texels.collect());
    encode_png(&Image::new(SIZE.0, SIZE.1, Channels::Rgb, pixels).unwrap()).unwrap()
}

/// Metal or none, texel by texel.
fn patches(v: u8) -> u8 {
    if v < 128 { 0 } else { 255 }
}

fn written(out: &Memory) -> BTreeMap<String, Vec<u8>> {
    out.files().into_iter().map(|(name, bytes)| (name.display().to_string(), bytes.to_vec())).collect()
}

/// A folder of maps with this metalness and a colour of this size.
fn bake_maps(metallic: Vec<u8>, color: (u32, u32), correlated: bool, filter: Filter) -> Baked {
    let files: Memory = [
        ("cloth/silk_normal_gl.png", normals()),
        ("cloth/silk_roughness.png", png(SIZE, Channels::R, 2, |v| v / 2)),
        ("cloth/silk_basecolor.png", png(color, Channels::Rgb, 3, |v| v)),
        ("cloth/silk_metallic.png", metallic),
    ]
    .into_iter()
    .collect();
    let mut how = FolderOptions::default();
    (how.textures.correlated, how.textures.filter) = (correlated, filter);
    (how.textures.encoder, how.textures.color_format) = (Some(Encoder::Portable), Some(Format::Rgba8));
    let (input, out) = (Path::new("cloth"), Memory::new());
    let understood = understand(&files, input, &how).unwrap();
    let reports = folder(&files, input, &understood, &how, &out, Task::QUIET).unwrap();
    (written(&out), reports)
}

#[test]
fn mixed_metal_is_filtered_one_by_one() {
    let mixed = || png(SIZE, Channels::R, 4, patches);
    let (together, _) = bake_maps(mixed(), SIZE, true, Filter::Ml);
    let (apart, _) = bake_maps(mixed(), SIZE, false, Filter::Ml);
    for name in ["silk_normal.ktx2", "silk_aniso.ktx2", "silk_orm.ktx2", "silk_color.ktx2"] {
        assert_ne!(together[name], apart[name], "{name}");
    }
    let [together, apart] =
        [together, apart].map(|files| decode_ktx2(Path::new("color"), &files["silk_color.ktx2"]).unwrap());
    assert_eq!(together.levels.len(), apart.levels.len());
    assert_eq!(together.levels[0].data, apart.levels[0].data, "level 0 is as authored");
    assert_ne!(together.levels[1].data, apart.levels[1].data, "level 1");
}

#[test]
fn what_reflects_alike_changes_with_its_colour() {
    for (name, of) in [("cloth", (|_| 0) as fn(u8) -> u8), ("gloss as metalness of a quarter", |_| 64)] {
        let metallic = || png(SIZE, Channels::R, 4, of);
        let (on, off) = (
            bake_maps(metallic(), SIZE, true, Filter::Ml).0,
            bake_maps(metallic(), SIZE, false, Filter::Ml).0,
        );
        // A metalness that is not zero reflects what its colour says, and weighs by it.
        let changed: Vec<&String> = on.keys().filter(|name| on[*name] != off[*name]).collect();
        let wanted: &[&str] = if name == "cloth" {
            &[]
        } else {
            &["silk.kinran.json", "silk_aniso.ktx2", "silk_normal.ktx2", "silk_orm.ktx2"]
        };
        assert_eq!(changed, wanted, "{name}");
    }
    let mixed = || png(SIZE, Channels::R, 4, patches);
    let [on, off] = [true, false].map(|on| bake_maps(mixed(), SIZE, on, Filter::Naive).0);
    assert!(on == off, "what mip generators do knows no metal");
}

#[test]
fn maps_of_sizes_that_do_not_fit_are_not_told() {
    let mixed = || png(SIZE, Channels::R, 4, patches);
    for (size, fits) in [((64, 32), true), ((16, 8), true), ((48, 16), false)] {
        let (together, reports) = bake_maps(mixed(), size, true, Filter::Ml);
        let (apart, _) = bake_maps(mixed(), size, false, Filter::Ml);
        assert_ne!(together["silk_normal.ktx2"], apart["silk_normal.ktx2"], "{size:?}: lobes are weighed");
        assert_eq!(together["silk_color.ktx2"] == apart["silk_color.ktx2"], !fits, "{size:?}");
        let told = reports[0].warnings.iter().any(|warning| warning.contains("averaged one by one"));
        assert_eq!(told, !fits, "{size:?}: {:?}", reports[0].warnings);
    }
}

/// Two materials of one base colour, the second with another metalness or the same.
fn bake_model(second: &str, correlated: bool) -> Baked {
    let json = r#"{
      "asset": { "version": "2.0" },
      "materials": [
        { "name": "armour", "normalTexture": { "index": 0 },
          "pbrMetallicRoughness": { "baseColorTexture": { "index": 1 }, "metallicRoughnessTexture": { "index": 2 } } },
        { "name": "shield", "normalTexture": { "index": 0 },
          "pbrMetallicRoughness": { "baseColorTexture": { "index": 1 }, SECOND } }],
      "textures": [{ "source": 0 }, { "source": 1 }, { "source": 2 }, { "source": 3 }],
      "images": [{ "uri": "bumps.png" }, { "uri": "color.png" }, { "uri": "metal.png" }, { "uri": "other.png" }]
    }"#;
    let files: Memory = [
        ("model.gltf", json.replace("SECOND", second).into_bytes()),
        ("bumps.png", normals()),
        ("color.png", png(SIZE, Channels::Rgb, 6, |v| v)),
        ("metal.png", png(SIZE, Channels::Rgb, 7, patches)),
        ("other.png", png(SIZE, Channels::Rgb, 8, patches)),
    ]
    .into_iter()
    .collect();
    let mut how = GltfOptions::default();
    (how.all_textures, how.textures.correlated) = (true, correlated);
    how.textures.encoder = Some(Encoder::Portable);
    let out = Memory::new();
    let report = gltf(&files, Path::new("model.gltf"), &how, &out, Task::QUIET).unwrap();
    (written(&out), vec![report])
}

#[test]
fn a_colour_shared_by_two_metals_is_right_for_one() {
    let colors = |files: &BTreeMap<String, Vec<u8>>| {
        files.keys().filter(|name| name.contains("color") && name.ends_with(".ktx2")).count()
    };
    for (second, correlated, wanted) in [
        (r#""metallicRoughnessTexture": { "index": 3 }"#, true, 2),
        (r#""metallicRoughnessTexture": { "index": 3 }"#, false, 1),
        (r#""metallicRoughnessTexture": { "index": 2 }"#, true, 1),
        (r#""metallicFactor": 0"#, true, 2),
    ] {
        let (files, reports) = bake_model(second, correlated);
        assert_eq!(colors(&files), wanted, "{second}, {correlated}: {:?}", files.keys());
        let told = reports[0].warnings.iter().any(|warning| warning.contains("becomes two textures"));
        assert_eq!(told, wanted == 2, "{second}, {correlated}: {:?}", reports[0].warnings);
    }
}

#[test]
fn a_model_s_mixed_metal_is_filtered_one_by_one() {
    let same = r#""metallicRoughnessTexture": { "index": 2 }"#;
    let [(together, _), (apart, _)] = [true, false].map(|correlated| bake_model(same, correlated));
    assert_eq!(together.keys().collect::<Vec<_>>(), apart.keys().collect::<Vec<_>>());
    let textures: Vec<&String> = together.keys().filter(|name| name.ends_with(".ktx2")).collect();
    assert_eq!(textures.len(), 3, "{textures:?}");
    for name in textures {
        assert_ne!(together[name], apart[name], "{name}");
    }
}

/// A material with bumps and `rest`, of whose images `missing` is not there; its base colours stay as they are.
fn bake_material(rest: &str, missing: &str, correlated: bool) -> Baked {
    let json = r#"{
      "asset": { "version": "2.0" },
      "extensionsUsed": ["KHR_materials_specular"],
      "materials": [{ "name": "armour", "normalTexture": { "index": 0 }, REST }],
      "textures": [{ "source": 0 }, { "source": 1 }, { "source": 2 }],
      "images": [{ "uri": "bumps.png" }, { "uri": "color.png" }, { "uri": "metal.png" }]
    }"#;
    let files: Memory = [
        ("model.gltf", json.replace("REST", rest).into_bytes()),
        ("bumps.png", normals()),
        ("color.png", png(SIZE, Channels::Rgba, 6, |v| v)),
        ("metal.png", png(SIZE, Channels::Rgb, 7, patches)),
    ]
    .into_iter()
    .filter(|(name, _)| *name != missing)
    .collect();
    let mut how = GltfOptions::default();
    (how.textures.correlated, how.textures.encoder) = (correlated, Some(Encoder::Portable));
    let out = Memory::new();
    let report = gltf(&files, Path::new("model.gltf"), &how, &out, Task::QUIET).unwrap();
    (written(&out), vec![report])
}

/// Lobes are weighed by what the file says reflects, also where its colours are not baked; what cannot be read stops nothing.
#[test]
fn a_model_s_lobes_forget_what_reflects() {
    let mixed = r#""pbrMetallicRoughness": { "baseColorTexture": { "index": 1 }, "metallicRoughnessTexture": { "index": 2 } }"#;
    let gold = r#""pbrMetallicRoughness": { "baseColorTexture": { "index": 1 }, "roughnessFactor": 0.3 }"#;
    let specular = |field: &str| {
        format!(
            r#""pbrMetallicRoughness": {{ "metallicFactor": 0, "roughnessFactor": 0.3 }},
               "extensions": {{ "KHR_materials_specular": {{ "{field}": {{ "index": 1 }} }} }}"#
        )
    };
    let paint = r#""pbrMetallicRoughness": { "baseColorTexture": { "index": 1 }, "metallicFactor": 0 }"#;
    for (name, rest, missing, is_weighed) in [
        ("mixed metal", mixed.to_owned(), "", true),
        ("metal of many colours", gold.to_owned(), "", true),
        ("a map of strength", specular("specularTexture"), "", true),
        ("a map of specular colour", specular("specularColorTexture"), "", true),
        ("paint", paint.to_owned(), "", false),
        ("mixed metal whose colour is lost", mixed.to_owned(), "color.png", false),
    ] {
        let [(on, told), (off, _)] = [true, false].map(|on| bake_material(&rest, missing, on));
        let textures: Vec<&String> = on.keys().filter(|name| name.ends_with(".ktx2")).collect();
        assert!(textures.iter().all(|name| !name.contains("color")), "{name}: {textures:?}");
        let normal = textures.iter().find(|name| name.contains("_normal")).unwrap();
        assert_eq!(on[*normal] != off[*normal], is_weighed, "{name}: whether {normal} changes");
        let warned = told[0].warnings.iter().any(|warning| warning.contains("what it reflects is not known"));
        assert_eq!(warned, !missing.is_empty(), "{name}: {:?}", told[0].warnings);
    }
}
