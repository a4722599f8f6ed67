//! Fuzz from the command line, and in both renderers.

#![allow(clippy::print_stdout, reason = "the tests tell how near their bounds are")]

use std::process::Command;

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
    ] {
        let (ok, text, _) = kinran(&["fit", "fuzz", "--tilt", "30", "--spread", "0.2", "--lang", language]);
        assert!(ok && text.contains(wanted), "{language}: {text}");
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
    let image = kinran_image::read_image(std::path::Path::new(&table)).unwrap();
    assert_eq!((image.width, image.height), (64, 64));

    for (arguments, part) in [
        (["fit", "fuzz", "--tilt", "95", "--spread", "0.2"], "0 to 90"),
        (["fit", "fuzz", "--tilt", "30", "--spread", "2"], "0 to 1"),
    ] {
        let (ok, _, error) = kinran(&arguments);
        assert!(!ok && error.contains(part), "{error}");
    }
}

#[cfg(feature = "gpu")]
mod realtime {
    use glam::{Affine3A, Vec3, vec2, vec3};
    use kinran::surfaces::fuzz_coefficients;
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
        prepared.fit_fuzz(fuzz_coefficients);
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
        let wanted = render(scene, &camera, &settings, &|_, _| {}).unwrap();
        let settings = GpuSettings { shadows: false, background, ..GpuSettings::default() };
        let loaded =
            renderer.load(scene, &renderer.light_of(scene), TextureFiltering::Mips { max_anisotropy: 16 });
        let got = renderer.film(&loaded, &camera, &settings, (SIZE, SIZE), 16, &|_, _| {}).unwrap();
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
        cases.push(("dense", Fuzz::Layer(FuzzLayer { density: 0.5, spread: 0.05, tilt: 1.2, ..layer })));
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
        let layer =
            FuzzLayer { tilt: 23f32.to_radians(), color: vec3(0.8, 0.5, 0.3), ..FuzzLayer::default() };
        let mut scene = prepared(Fuzz::Layer(layer), None, Some(sky()));
        let ours = difference(&renderer, &scene, 256);
        scene.materials[0].fuzz.as_mut().unwrap().talk_ambient = true;
        let talk = difference(&renderer, &scene, 256);
        println!("environment: FLIP {ours:.4} ours, {talk:.4} the talk's");
        assert!(ours < talk && ours < 0.05, "ours {ours}, the talk's {talk}");
    }
}
