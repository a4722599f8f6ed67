//! Fuzz from the command line, and in both renderers.

#![allow(clippy::print_stdout, reason = "the tests tell how near their bounds are")]

#[cfg(feature = "gpu")]
#[path = "../../sample_assets.rs"]
mod sample_assets;

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::json;

fn kinran(arguments: &[&str]) -> (bool, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_kinran")).args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.success(), text(output.stdout), text(output.stderr))
}

#[test]
fn fits_are_printed_as_a_table_as_json_and_as_constants() {
    let (ok, table, _) = kinran(&["fit", "fuzz", "--tilt", "30", "--spread", "0.2"]);
    assert!(
        ok && ["p_s", "ambient", "direction", "r", "b", "g", "q"].iter().all(|name| table.contains(name)),
        "{table}"
    );

    let (ok, json, _) = kinran(&["--json", "fit", "fuzz", "--tilt", "30", "--spread", "0.2"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(ok);
    for key in ["p_s", "b", "r", "g", "q"] {
        assert!(json[key]["max_error"].is_number() && json[key]["coefficients"].is_array(), "{key}: {json}");
    }
    let first = json["p_s"]["coefficients"][0].as_f64().unwrap();
    assert!((first - 0.5034).abs() < 0.02, "c_0 of P_s at 30°, alpha 0.447: {first}");

    for (language, wanted) in [
        ("wgsl", "const FUZZ_P_S = array<f32, 6>("),
        ("hlsl", "static const float FUZZ_P_S[6] = {"),
        ("glsl", "const float FUZZ_P_S[6] = float[6]("),
        ("msl", "constant float FUZZ_P_S[6] = {"),
        // As `kinran shaders` calls them.
        ("glsl-450", "const float FUZZ_P_S[6] = float[6]("),
        ("glsl-es-300", "const float FUZZ_P_S[6] = float[6]("),
        ("wesl", "const FUZZ_P_S = array<f32, 6>("),
    ] {
        let (ok, text, _) = kinran(&["fit", "fuzz", "--tilt", "30", "--spread", "0.2", "--lang", language]);
        assert!(ok && text.contains(wanted), "{language}: {text}");
    }
}

/// The talk's six coefficients overshoot P_s of combed fibres.
#[test]
fn coefficients_that_make_energy_are_handed_out_in_silence() {
    let said = |spread: &str, more: &[&str]| {
        let (ok, out, error) = kinran(&[more, &["fit", "fuzz", "--tilt", "60", "--spread", spread]].concat());
        assert!(ok, "{error}");
        out
    };
    for (spread, makes_energy) in [("0.01", true), ("0.2", false)] {
        let json: serde_json::Value = serde_json::from_str(&said(spread, &["--json"])).unwrap();
        let returned = json["returned"].as_f64().unwrap();
        assert_eq!(returned > 1.0, makes_energy, "spread {spread}: {returned}");
        assert_eq!(json["warning"].is_string(), makes_energy, "{json}");
        assert_eq!(said(spread, &[]).contains("warning: the coefficients of p_s make energy"), makes_energy);
        // So combed, and the polynomial of ambient light is off as well.
        assert_eq!(said(spread, &[]).contains("fibres as combed as these need --table"), makes_energy);
        let (_, constants, _) =
            kinran(&["fit", "fuzz", "--tilt", "60", "--spread", spread, "--lang", "wgsl"]);
        assert_eq!(
            constants.contains("// Warning: the coefficients of p_s make energy"),
            makes_energy,
            "{constants}"
        );
    }
}

#[test]
fn tables_and_plots_are_written_and_bad_angles_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (table, plots) = (file("table.exr"), file("plots.svg"));
    let (ok, _, error) =
        kinran(&["fit", "fuzz", "--tilt", "60", "--spread", "0.02", "--table", &table, "--plots", &plots]);
    assert!(ok, "{error}");
    let svg = std::fs::read_to_string(&plots).unwrap();
    // Two phase functions, four parameters, five values.
    assert_eq!(svg.matches("<polygon").count(), 40);
    assert!(!svg.contains("NaN"), "a curve has no number");
    let image = kinran_image::read_image(Path::new(&table)).unwrap();
    assert_eq!((image.width, image.height), (48, 48));

    for (arguments, part) in [
        (["fit", "fuzz", "--tilt", "95", "--spread", "0.2"], "0 to 90"),
        (["fit", "fuzz", "--tilt", "30", "--spread", "2"], "0 to 1"),
    ] {
        let (ok, _, error) = kinran(&arguments);
        assert!(!ok && error.contains(part), "{error}");
    }
}

/// A square with a bumpy normal map under fibres whose every parameter differs from its default, beside its files; a second
/// material has the simple form.
fn square_with_fuzz(folder: &Path) -> PathBuf {
    use kinran_image::{Channels, Image, Pixels, write_png};

    let picture = |name: &str, texel: fn(u32) -> [u8; 3]| {
        let pixels = Pixels::U8((0..256).flat_map(texel).collect());
        write_png(&folder.join(name), &Image::new(16, 16, Channels::Rgb, pixels).unwrap()).unwrap();
    };
    picture("bumps.png", |i| [100 + (i * 7 % 57) as u8, 128, 250]);
    picture("fibres.png", |i| [(i % 16 * 16) as u8, 64, 0]);
    picture("dye.png", |i| [200, (i % 16 * 10) as u8, 60]);
    picture("worn.png", |i| [if i % 16 < 8 { 255 } else { 90 }; 3]);
    let floats: [f32; 32] = [
        0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., // positions
        0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1., // normals
        0., 1., 1., 1., 1., 0., 0., 0., // UVs
    ];
    let mut bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    std::fs::write(folder.join("square.bin"), bytes).unwrap();
    let view = |offset: u32, length: u32| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    let attributes = json!({ "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 });
    let primitives =
        [0, 1].map(|material| json!({ "attributes": attributes, "indices": 3, "material": material }));
    let images = ["bumps.png", "fibres.png", "dye.png", "worn.png"].map(|uri| json!({ "uri": uri }));
    let textures = [0, 1, 2, 3].map(|source| json!({ "source": source, "sampler": 0 }));
    let document = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KINRAN_materials_fuzz"],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": primitives }],
        "buffers": [{ "uri": "square.bin", "byteLength": 140 }],
        "bufferViews": [view(0, 48), view(48, 48), view(96, 32), view(128, 12)],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] },
            { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
        "images": images,
        "samplers": [{}],
        "textures": textures,
        "materials": [
            {
                "name": "velvet",
                "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0.7 },
                "normalTexture": { "index": 0 },
                "extensions": { "KINRAN_materials_fuzz": {
                    "phase": "velvet", "density": 0.4, "densityTexture": { "index": 3 }, "spread": 0.3,
                    "fiberColorFactor": [0.9, 0.8, 0.5], "fiberColorTexture": { "index": 2 },
                    "directionTexture": { "index": 1 }, "directionEncoding": "angles",
                    "normalSmoothness": 0.5, "attenuation": "unscattered",
                } },
            },
            {
                "name": "felt",
                "normalTexture": { "index": 0 },
                "extensions": {
                    "KINRAN_materials_fuzz": { "fuzziness": 0.6, "fuzzinessTexture": { "index": 3 } },
                },
            },
        ],
    });
    let path = folder.join("square.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    path
}

#[test]
fn a_bake_keeps_fuzz_and_leaves_a_sheen_for_others() {
    use kinran_scene::{Fuzz, Scene};

    let (source, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let model = square_with_fuzz(source.path());
    let read =
        |path: &Path| -> serde_json::Value { serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap() };
    for (i, flags) in [&[][..], &["--all-textures"], &["--container", "both"]].into_iter().enumerate() {
        let out = folder.path().join(i.to_string());
        let (model, out_text) = (model.to_string_lossy(), out.to_string_lossy());
        let (ok, said, error) = kinran(&[&["bake", &model, "-o", &out_text], flags].concat());
        assert!(ok, "{flags:?}: {said}{error}");

        // The extension as it was, but for where its textures lie; sheen beside it with the same dye.
        let baked = out.join("square.gltf");
        let (before, after) = (read(Path::new(&*model)), read(&baked));
        for name in ["KINRAN_materials_fuzz", "KHR_materials_sheen"] {
            let used = after["extensionsUsed"].as_array().unwrap();
            assert!(used.iter().any(|used| used == name), "{flags:?}: {name} is not listed: {used:?}");
        }
        for m in 0..2 {
            let of = |document: &serde_json::Value| document["materials"][m]["extensions"].clone();
            let (was, is) = (of(&before)["KINRAN_materials_fuzz"].clone(), of(&after));
            for (key, value) in was.as_object().unwrap() {
                let kept = &is["KINRAN_materials_fuzz"][key];
                assert!(key.ends_with("Texture") || kept == value, "{flags:?}: {key} was {value}, is {kept}");
            }
            assert!(is["KHR_materials_sheen"]["sheenRoughnessFactor"].is_number(), "{flags:?}: {is}");
        }
        let extensions = &after["materials"][0]["extensions"];
        assert_eq!(
            extensions["KHR_materials_sheen"]["sheenColorTexture"],
            extensions["KINRAN_materials_fuzz"]["fiberColorTexture"]
        );

        // The textures are found where they lie now.
        let images = |path: &Path| {
            let scene = Scene::load(path).unwrap();
            let fuzz: Vec<Fuzz> = scene.materials[..2].iter().filter_map(|m| m.fuzz.clone()).collect();
            assert_eq!(fuzz.len(), 2, "{}", path.display());
            let places = fuzz.iter().flat_map(Fuzz::textures).map(|place| place.image);
            places.map(|i| scene.images[i].as_ref().expect("it is used").pixels.clone()).collect::<Vec<_>>()
        };
        assert_eq!(images(Path::new(&*model)), images(&baked), "{flags:?}");

        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tools/check_gltf/validate.sh");
        match Command::new(script).arg(&baked).output() {
            Ok(output) if !matches!(output.status.code(), Some(2 | 127) | None) => {
                let report = String::from_utf8_lossy(&output.stdout);
                assert!(output.status.success(), "{flags:?}: {report}");
            }
            _ => println!("SKIPPED: gltf-validator cannot be run here"),
        }
    }
}

#[test]
fn between_the_tilts_of_a_fit_its_error_stays_within_what_is_stated() {
    use glam::DVec3;
    use kinran_bake::fuzz_fit::{Fibres, Phase};
    use kinran_cli::Progress;
    use kinran_cli::surfaces::fuzz_fits;
    use kinran_scene::FuzzPhase;
    use kinran_shading::fuzz::{fuzz_alpha, fuzz_g};

    let mut stated = Vec::new();
    for (spread, low, high) in [(0.01, 0.93, 1.3), (0.04, 0.95, 1.1), (0.09, 0.8, 1.2), (0.2, 0.9, 1.1)] {
        let fits = fuzz_fits(FuzzPhase::Fibre, spread, &Progress::default()).unwrap();
        let mut range = (f64::INFINITY, 0.0f64);
        let mut dark = 0.0f64;
        // Halfway between neighbours, and a third from one.
        for tilt in [0.5f64, 2.33, 4.5, 7.5, 9.67, 12.5, 15.5].map(|i| (i * 5.625).to_radians()) {
            let t = DVec3::new(tilt.sin(), 0.0, tilt.cos());
            let fibres = Fibres::new(Phase::Fibre, t, fuzz_alpha(spread).into());
            for x in [0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 1.0f64] {
                for azimuth in 0..9 {
                    let phi = std::f64::consts::PI * f64::from(azimuth) / 8.0;
                    let r = (1.0 - x * x).sqrt();
                    let v = DVec3::new(r * phi.cos(), r * phi.sin(), x);
                    let exact = fibres.gathered(v, &[0.05, 0.2, 0.5]);
                    for (density, (light, _)) in [0.05f32, 0.2, 0.5].into_iter().zip(exact.layers) {
                        let factor =
                            fits.ambient_factor(density, x as f32, t.dot(v) as f32, tilt.cos() as f32);
                        let g = f64::from(fuzz_g(density, x as f32));
                        let got = g * f64::from(factor);
                        // Where next to nothing is gathered a ratio says little.
                        if light > 0.1 * g {
                            range = (range.0.min(got / light), range.1.max(got / light));
                        } else {
                            dark = dark.max((got - light).abs() / g);
                        }
                    }
                }
            }
        }
        println!("spread {spread}: {:.3} to {:.3}; {dark:.3} of G where it is dark", range.0, range.1);
        stated.push((range.0 > low && range.1 < high && dark < 0.05, spread, range, dark));
    }
    assert!(stated.iter().all(|row| row.0), "within, spread, ratio, difference in the dark: {stated:?}");
}

#[cfg(feature = "gpu")]
mod realtime {
    use crate::sample_assets::sample_assets;
    use glam::{Affine3A, Vec3, vec2, vec3};
    use kinran_cli::Progress;
    use kinran_cli::surfaces::fuzz_fits;
    use kinran_image::untold;
    use kinran_render::metrics::flip;
    use kinran_render::realtime::{Gpu, Realtime, Settings as GpuSettings, ShaderSource};
    use kinran_render::reference::{Background, RenderScene, Settings, TextureFiltering, look_at, render};
    use kinran_render::tonemap::{Tonemap, to_srgb8};
    use kinran_scene::{
        Environment, Fuzz, FuzzAttenuation, FuzzLayer, FuzzPhase, Instance, Light, LightKind, Scene,
    };

    const SIZE: u32 = 64;

    /// A unit sphere, its material grey and rough, from a document as files have them.
    fn sphere() -> Scene {
        let rings = 48;
        let columns = 2 * rings;
        let (mut positions, mut uvs, mut tangents) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..=rings {
            for j in 0..=columns {
                let uv = vec2(j as f32 / columns as f32, i as f32 / rings as f32);
                let (theta, phi) = (uv.y * std::f32::consts::PI, uv.x * std::f32::consts::TAU);
                positions.push(vec3(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos()));
                tangents.push(vec3(phi.cos(), 0.0, -phi.sin()).extend(1.0));
                uvs.push(uv);
            }
        }
        let corner = |i: u32, j: u32| i * (columns + 1) + j;
        let triangles = (0..rings)
            .flat_map(|i| (0..columns).map(move |j| (i, j)))
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        let document = br#"{"asset":{"version":"2.0"},"materials":[{"pbrMetallicRoughness":
            {"baseColorFactor":[0.3,0.25,0.2,1],"metallicFactor":0,"roughnessFactor":0.6}}]}"#;
        let mut scene =
            Scene::from_bytes("sphere.gltf".as_ref(), document, &|_| unreachable!("nothing is beside it"))
                .unwrap();
        scene.primitives.push(kinran_scene::Primitive {
            normals: positions.clone(),
            positions,
            tangents,
            uvs: [uvs, Vec::new()],
            colors: Vec::new(),
            curvature: None,
            triangles,
            material: 0,
            source: Default::default(),
        });
        scene.instances.push(Instance { primitive: 0, transform: Affine3A::IDENTITY });
        scene
    }

    fn prepared(fuzz: Fuzz, light: Option<Vec3>, environment: Option<Environment>) -> RenderScene {
        let mut scene = sphere();
        scene.materials[0].fuzz = Some(fuzz);
        scene.lights.extend(light.map(|to_light| Light {
            kind: LightKind::Directional,
            color: Vec3::splat(3.0),
            position: Vec3::ZERO,
            direction: -to_light.normalize(),
            range: f32::INFINITY,
        }));
        let mut prepared = RenderScene::new(&scene, vec![None], environment).unwrap();
        prepared.fit_fuzz(|phase, spread| fuzz_fits(phase, spread, &Progress::default())).unwrap();
        prepared
    }

    /// Mean FLIP of both renderers' pictures.
    fn difference(renderer: &Realtime, scene: &RenderScene, spp: u32) -> f32 {
        let camera = look_at(vec3(0.0, 0.6, 3.4), Vec3::ZERO, Vec3::Y, 0.7);
        let background = Background::Color(Vec3::splat(0.02));
        let settings = Settings {
            width: SIZE,
            height: SIZE,
            samples_per_pixel: spp,
            shadows: false,
            background,
            ..Settings::default()
        };
        let wanted = render(scene, &camera, &settings, &untold).unwrap();
        let settings = GpuSettings { shadows: false, background, ..GpuSettings::default() };
        let loaded =
            renderer.load(scene, &renderer.light_of(scene), TextureFiltering::Mips { max_anisotropy: 16 });
        let got = renderer.film(&loaded, &camera, &settings, (SIZE, SIZE), 16, &untold).unwrap();
        let shown = |pixels: &[[f32; 3]]| to_srgb8(pixels, 0.0, Tonemap::Aces);
        flip(&shown(&wanted.pixels), &shown(&got.pixels), SIZE, SIZE).unwrap().mean
    }

    fn device() -> Option<Realtime> {
        let open = || Realtime::new(&Gpu::open()?, &ShaderSource::default(), wgpu::TextureFormat::Rgba8Unorm);
        match open() {
            Ok(renderer) => Some(renderer),
            Err(e) => {
                assert!(std::env::var_os("KINRAN_REQUIRE_GPU").is_none(), "{e}");
                println!("SKIPPED: {e}");
                None
            }
        }
    }

    #[test]
    fn both_renderers_draw_the_same_fuzz_in_direct_light() {
        let Some(renderer) = device() else { return };
        let layer =
            FuzzLayer { tilt: 23f32.to_radians(), color: vec3(0.8, 0.5, 0.3), ..FuzzLayer::default() };
        let mut cases = vec![("simple", Fuzz::Simple { fuzziness: 0.8, texture: None })];
        for attenuation in [FuzzAttenuation::Full, FuzzAttenuation::Unscattered, FuzzAttenuation::Albedo] {
            cases.push(("fibres", Fuzz::Layer(FuzzLayer { attenuation, ..layer.clone() })));
        }
        cases.push(("velvet", Fuzz::Layer(FuzzLayer { phase: FuzzPhase::Velvet, ..layer.clone() })));
        cases.push((
            "dense",
            Fuzz::Layer(FuzzLayer { density: 0.5, spread: 0.05, tilt: 1.2, ..layer.clone() }),
        ));
        // Combed fibres over a base that shows what they send down to it.
        for attenuation in [FuzzAttenuation::Full, FuzzAttenuation::Albedo] {
            let combed = FuzzLayer { density: 0.5, spread: 0.01, tilt: 0.6, attenuation, ..layer.clone() };
            cases.push(("combed", Fuzz::Layer(combed)));
        }
        for (name, fuzz) in cases {
            let flip = difference(&renderer, &prepared(fuzz, Some(vec3(0.5, 0.7, 0.6)), None), 256);
            println!("{name}: FLIP {flip:.4} in direct light");
            assert!(flip < 0.05, "{name}: FLIP {flip}");
        }
    }

    #[test]
    fn light_along_the_lobe_is_nearer_to_the_reference_than_the_talks() {
        let Some(renderer) = device() else { return };
        let sky = || {
            let sun = vec3(0.6, 0.5, 0.6).normalize();
            Environment::from_fn(64, |d| {
                Vec3::splat(0.2) + vec3(2.0, 1.7, 1.3) * (d.dot(sun).max(0.0)).powi(8)
            })
        };
        for spread in [0.2, 0.01] {
            let color = vec3(0.8, 0.5, 0.3);
            let layer = FuzzLayer { spread, tilt: 23f32.to_radians(), color, ..FuzzLayer::default() };
            let mut scene = prepared(Fuzz::Layer(layer), None, Some(sky()));
            let ours = difference(&renderer, &scene, 256);
            scene.materials[0].fuzz.as_mut().unwrap().talk_ambient = true;
            let talk = difference(&renderer, &scene, 256);
            println!("environment, spread {spread}: FLIP {ours:.4} ours, {talk:.4} the talk's");
            assert!(ours < talk && ours < 0.05, "spread {spread}: ours {ours}, the talk's {talk}");
        }
    }

    /// `kinran fuzz --sheet realtime` on the assets that the pictures show.
    #[test]
    fn sample_assets_in_velvet_are_near_the_reference() {
        if let Err(e) = Gpu::open() {
            assert!(std::env::var_os("KINRAN_REQUIRE_GPU").is_none(), "{e}");
            return println!("SKIPPED: {e}");
        }
        let Some(assets) = sample_assets() else { return };
        let velvet = "--density 0.5 --spread 0.1 --tilt 50 --direction swirl --color 0.5,0.05,0.1";
        for (what, model, fibres) in [
            (
                "velvety horse",
                "meshes/horse_statue_01/horse_statue_01_1k.gltf",
                "--direction noise --color 0.8,0.75,0.7",
            ),
            ("crushed velvet", "meshes/sofa_03/sofa_03_1k.gltf", velvet),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let (model, out) = (assets.join(model), folder.path().to_string_lossy().into_owned());
            let model = model.to_string_lossy();
            // Few samples: docs/fuzz.md has the figures of 256. Their noise counts as difference too.
            let flags = "--sheet realtime --size 96x96 --spp 16 --light=-0.6,0.7,0.5 --base 0.05,0.01,0.015 \
                --roughness 0.7";
            let arguments = flags.split_whitespace().chain(fibres.split_whitespace());
            let arguments: Vec<&str> =
                ["--json", "fuzz", &model, "-o", &out].into_iter().chain(arguments).collect();
            let (ok, said, error) = super::kinran(&arguments);
            assert!(ok, "{what}: {error}");
            let said: serde_json::Value = serde_json::from_str(&said).unwrap();
            let flip = |light: &str| {
                let all = said["flip"].as_array().unwrap();
                all.iter().find(|row| row["light"] == light).and_then(|row| row["flip"].as_f64()).unwrap()
            };
            let (direct, ours) = (flip("direct light"), flip("environment, ours"));
            let talk = flip("environment, the talk's");
            println!(
                "{what}: FLIP {direct:.4} in direct light, {ours:.4} in an environment, the talk's {talk:.4}"
            );
            assert!(direct <= 0.05 && ours < talk, "{what}: {direct}, ours {ours}, the talk's {talk}");
        }
    }
}
