//! Colour, metalness and lobe, filtered together and one by one.

use std::collections::BTreeMap;
use std::path::Path;

use kinran::bake::{FolderOptions, GltfOptions, folder, gltf, understand};
use kinran::options::Container;
use kinran::report::Report;
use kinran::{Files, Memory, Task, check};
use kinran_bake::aniso::Filter;
use kinran_bake::linear_from_srgb;
use kinran_image::{Channels, Encoder, Format, Image, Pixels, decode_image, decode_ktx2, encode_png, untold};
use kinran_scene::{Needs, Scene, TextureRef};

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

/// Chipped paint, texel by texel, with factors; `rest` is of the material.
fn bake_paint(rest: &str, change: fn(&mut GltfOptions)) -> (Memory, Report) {
    let json = r#"{
      "asset": { "version": "2.0" }, "extensionsUsed": ["KHR_materials_ior", "KHR_texture_transform"],
      "materials": [{ "name": "paint", "normalTexture": { "index": 0, "texCoord": 1 }, REST
        "pbrMetallicRoughness": { "baseColorFactor": [0.9, 0.8, 1, 1], "metallicFactor": 0.9,
          "baseColorTexture": { "index": 1, "texCoord": 1 },
          "metallicRoughnessTexture": { "index": 2, "texCoord": 1 } } }],
      "textures": [{ "source": 0, "sampler": 0 }, { "source": 1, "sampler": 0 }, { "source": 2, "sampler": 0 }],
      "samplers": [{ "wrapS": 33648 }],
      "images": [{ "uri": "bumps.png" }, { "uri": "color.png" }, { "uri": "metal.png" }]
    }"#;
    let files: Memory = [
        ("model.gltf", json.replace("REST", rest).into_bytes()),
        ("bumps.png", normals()),
        ("color.png", png(SIZE, Channels::Rgb, 6, |v| v)),
        ("metal.png", png(SIZE, Channels::Rgb, 7, patches)),
    ]
    .into_iter()
    .collect();
    let mut how = GltfOptions::default();
    (how.all_textures, how.textures.encoder) = (true, Some(Encoder::Portable));
    change(&mut how);
    let out = Memory::new();
    let report = gltf(&files, Path::new("model.gltf"), &how, &out, Task::QUIET).unwrap();
    (out, report)
}

/// By sums over level 0: what a footprint scatters and reflects, and what its texel in the baked file does, as
/// `KHR_materials_specular` has it. Gives the root mean squares of the differences.
fn colors_lost(out: &Memory) -> [f64; 2] {
    let scene = Scene::load_in(out, Path::new("model.gltf"), &[], &Needs::ALL, &|_| {}, &untold).unwrap();
    let m = &scene.materials[0];
    let texture = |place: Option<&TextureRef>| {
        let runtime = place.and_then(|place| scene.textures[place.runtime?].clone());
        runtime.map(|texture| (0..texture.levels.len()).map(|l| texture.decode_level(l).unwrap()).collect())
    };
    let color: Vec<Vec<[f32; 4]>> = texture(m.base_color.as_ref()).unwrap();
    let metal: Vec<Vec<[f32; 4]>> = texture(m.metallic_roughness.as_ref()).unwrap();
    let specular: Option<Vec<Vec<[f32; 4]>>> =
        texture(m.dielectric.as_ref().and_then(|dielectric| dielectric.color.as_ref()));
    let factor =
        m.dielectric.as_ref().map(|dielectric| f64::from(dielectric.color_factor.x * dielectric.f0()));
    // What scatters and what reflects of a texel, three channels each.
    let seen = |level: usize, i: usize| -> [f64; 6] {
        let light = |code: f32| f64::from(linear_from_srgb(code));
        let metallic = f64::from(m.metallic_factor * metal[level][i][2]);
        let f0: [f64; 3] = std::array::from_fn(|c| match (&specular, factor) {
            (Some(specular), Some(factor)) => (factor * light(specular[level][i][c])).min(1.0),
            _ => 0.04,
        });
        let inside = 1.0 - f0.into_iter().fold(0.0, f64::max);
        std::array::from_fn(|k| {
            let c = k % 3;
            let base = f64::from(m.base_color_factor[c]) * light(color[level][i][c]);
            if k < 3 { base * (1.0 - metallic) * inside } else { base * metallic + f0[c] * (1.0 - metallic) }
        })
    };
    let (width, mut sums, mut count) = (SIZE.0 as usize, [0.0; 2], 0.0);
    for (level, texels) in color.iter().enumerate().skip(1).take(3) {
        let side = 1 << level;
        for i in 0..texels.len() {
            let (x, y) = (i % (width >> level) * side, i / (width >> level) * side);
            let got = seen(level, i);
            for (k, got) in got.into_iter().enumerate() {
                let footprint = (0..side * side).map(|t| seen(0, (y + t / side) * width + x + t % side)[k]);
                let wanted = footprint.sum::<f64>() / (side * side) as f64;
                sums[k / 3] += (got - wanted).powi(2) / 3.0;
            }
            count += 1.0;
        }
    }
    sums.map(|sum: f64| (sum / count).sqrt())
}

/// In bytes that are not compressed, so that what is lost was lost by the choice.
fn plain(how: &mut GltfOptions) {
    (how.textures.color_format, how.textures.aniso_format) = (Some(Format::Rgba8), Some(Format::Rgba8));
}

#[test]
fn a_specular_colour_does_not_bring_both_colours_back() {
    let (out, report) = bake_paint("", |how| {
        plain(how);
        how.separate_specular = true;
    });
    let lost = colors_lost(&out);
    let [pair, apart] = [true, false].map(|correlated| {
        let (out, _) = match correlated {
            true => bake_paint("", plain),
            false => bake_paint("", |how| {
                plain(how);
                how.textures.correlated = false;
            }),
        };
        colors_lost(&out)
    });
    for k in 0..2 {
        assert!(lost[k] < 0.012, "{lost:?} of 1; in pairs {pair:?}, one by one {apart:?}");
        assert!(lost[k] < 0.45 * pair[k] && pair[k] < apart[k], "{lost:?}; {pair:?}, {apart:?}");
    }
    assert!(!report.warnings.iter().any(|warning| warning.contains("specular")), "{:?}", report.warnings);
}

#[test]
fn a_specular_colour_is_not_as_authored_up_close_or_lies_elsewhere() {
    let (out, _) = bake_paint("", |how| {
        how.separate_specular = true;
        how.textures.container = Some(Container::Both);
    });
    let scene = Scene::load_in(&out, Path::new("model.gltf"), &[], &Needs::ALL, &|_| {}, &untold).unwrap();
    let m = &scene.materials[0];
    let dielectric = m.dielectric.as_ref().expect("KHR_materials_specular");
    let place = dielectric.color.as_ref().expect("specularColorTexture");
    assert!(place.lies_as(m.base_color.as_ref().unwrap()), "{place:?}");
    let texture = scene.textures[place.runtime.expect("mips")].clone().unwrap();
    assert_eq!((texture.levels[0].width, texture.levels[0].height), SIZE);
    let factor = dielectric.color_factor.x * dielectric.f0();
    for texel in texture.decode_level(0).unwrap() {
        for code in &texel[..3] {
            let f0 = factor * linear_from_srgb(*code);
            assert!((f0 - 0.04).abs() < 1e-6, "level 0 reflects {f0}, {texel:?}");
        }
        assert!(texel[3] == 1.0, "alpha of {texel:?}");
    }
    // What others see instead.
    let fallback = out.read("model_paint_specular-color.png".as_ref()).unwrap();
    let fallback = decode_image(Path::new("fallback.png"), &fallback).unwrap();
    assert_eq!((fallback.width, fallback.height, &fallback.pixels), (1, 1, &Pixels::U8(vec![56; 3])));
    for (name, _) in out.files() {
        if ["ktx2", "dds", "gltf", "json"].iter().any(|end| name.extension().unwrap() == *end) {
            assert_eq!(check(&out, &name).unwrap().findings, [], "{}", name.display());
        }
    }
    // Anything else in its place is found.
    let text = String::from_utf8(out.read("model.gltf".as_ref()).unwrap()).unwrap();
    let swapped = text.replacen("_specular-color.ktx2", "_roughness.ktx2", 1);
    assert_ne!(swapped, text);
    out.insert("model.gltf", swapped.into_bytes());
    let findings = check(&out, Path::new("model.gltf")).unwrap().findings;
    let said = findings.iter().map(|finding| format!("{}: {}", finding.place, finding.problem));
    let said: Vec<String> = said.collect();
    let wanted = "specularColorTexture";
    let stands = "roughness and stands for specular-color or color";
    assert!(said.iter().any(|said| said.contains(wanted) && said.contains(stands)), "{said:?}");
}

/// What is written without the flag stays, byte by byte, and it is told why.
#[test]
fn a_specular_colour_that_is_of_no_use_changes_files() {
    type Change = fn(&mut GltfOptions);
    let separate: Change = |how| how.separate_specular = true;
    let cases: [(&str, Change, Change, &str); 4] = [
        (
            r#""extensions": { "KHR_materials_ior": { "ior": 1.4 } },"#,
            |_| {},
            separate,
            "no specular colour is chosen for it, since KHR_materials_specular or KHR_materials_ior",
        ),
        (
            "",
            |how| how.all_textures = false,
            |how| (how.all_textures, how.separate_specular) = (false, true),
            "--separate-specular has nothing to act on: no colour is baked; --all-textures asks for it",
        ),
        (
            "",
            |how| how.textures.correlated = false,
            |how| (how.textures.correlated, how.separate_specular) = (false, true),
            "--separate-specular has nothing to act on: base colour and metalness are averaged one by one",
        ),
        (
            r#""alphaMode": "OPAQUE","#,
            |how| how.textures.filter = Filter::Naive,
            |how| (how.textures.filter, how.separate_specular) = (Filter::Naive, true),
            "--separate-specular has nothing to act on",
        ),
    ];
    for (rest, without, with, wanted) in cases {
        let ((without, _), (with, report)) = (bake_paint(rest, without), bake_paint(rest, with));
        let told = report.warnings.iter().filter(|warning| warning.contains(wanted)).count();
        assert_eq!(told, 1, "{wanted}: {:?}", report.warnings);
        let [without, with] = [without, with].map(|out| {
            let mut files = written(&out);
            files.remove("model.kinran.json");
            files
        });
        assert!(without == with, "{wanted}: {:?}, {:?}", without.keys(), with.keys());
    }
    // Cloth has no metal to part from.
    let same = |separate: bool| {
        let files: Memory = [
            (
                "model.gltf",
                br#"{ "asset": { "version": "2.0" }, "materials": [{ "name": "cloth", "normalTexture": { "index": 0 },
                  "pbrMetallicRoughness": { "baseColorTexture": { "index": 1 }, "metallicFactor": 0 } }],
                  "textures": [{ "source": 0 }, { "source": 1 }],
                  "images": [{ "uri": "bumps.png" }, { "uri": "color.png" }] }"#
                    .to_vec(),
            ),
            ("bumps.png", normals()),
            ("color.png", png(SIZE, Channels::Rgb, 6, |v| v)),
        ]
        .into_iter()
        .collect();
        let mut how = GltfOptions::default();
        (how.all_textures, how.separate_specular) = (true, separate);
        let out = Memory::new();
        let report = gltf(&files, Path::new("model.gltf"), &how, &out, Task::QUIET).unwrap();
        let mut files = written(&out);
        files.remove("model.kinran.json");
        (files, report.warnings)
    };
    let ((without, quiet), (with, told)) = (same(false), same(true));
    assert!(without == with && told.len() == quiet.len() + 1, "{quiet:?}, {told:?}");
}
