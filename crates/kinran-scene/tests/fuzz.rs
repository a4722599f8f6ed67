//! `KINRAN_materials_fuzz` and `KHR_materials_sheen`, read and written.

use std::path::Path;

use glam::Vec3;
use kinran_scene::{
    Document, Fuzz, FuzzAttenuation, FuzzDirection, FuzzLayer, FuzzPhase, SHEEN_MATCH, Scene,
};
use kinran_shading::fuzz::fuzz_brdf;
use serde_json::{Value, json};

#[allow(dead_code, clippy::print_stderr, reason = "a skipped test says so")]
mod common;

fn document(extensions: Value) -> Vec<u8> {
    let document = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KINRAN_materials_fuzz", "KHR_materials_sheen"],
        "materials": [{ "name": "felt", "extensions": extensions }],
    });
    document.to_string().into_bytes()
}

fn load(extensions: Value) -> Result<Scene, kinran_scene::Error> {
    let nothing = |path: &str| panic!("{path} was asked for");
    Scene::from_bytes(Path::new("felt.gltf"), &document(extensions), &nothing)
}

fn fuzz(extensions: Value) -> Option<Fuzz> {
    load(extensions).unwrap().materials[0].fuzz.clone()
}

#[test]
fn a_layer_is_read_with_its_defaults() {
    assert_eq!(fuzz(json!({ "KINRAN_materials_fuzz": {} })), Some(Fuzz::Layer(FuzzLayer::default())));
    let read = fuzz(json!({ "KINRAN_materials_fuzz": {
        "phase": "velvet", "density": 0.5, "spread": 0.75, "fiberColorFactor": [1, 0.5, 0.25],
        "tilt": std::f64::consts::FRAC_PI_2, "azimuth": -1.5, "normalSmoothness": 0.25, "attenuation": "unscattered",
        "directionEncoding": "angles",
    } }));
    let wanted = FuzzLayer {
        phase: FuzzPhase::Velvet,
        density: 0.5,
        spread: 0.75,
        color: Vec3::new(1.0, 0.5, 0.25),
        tilt: std::f32::consts::FRAC_PI_2,
        azimuth: -1.5,
        normal_smoothness: 0.25,
        attenuation: FuzzAttenuation::Unscattered,
        direction_encoding: FuzzDirection::Angles,
        ..FuzzLayer::default()
    };
    assert_eq!(read, Some(Fuzz::Layer(wanted)));
    let simple = fuzz(json!({ "KINRAN_materials_fuzz": { "fuzziness": 0.5 } }));
    assert_eq!(simple, Some(Fuzz::Simple { fuzziness: 0.5, texture: None }));
}

#[test]
fn a_parameter_out_of_range_is_refused_by_material_field_and_range() {
    for (field, value, range) in [
        ("density", json!(2.5), "0 to 2"),
        ("density", json!(-0.1), "0 to 2"),
        ("spread", json!(1.5), "0 to 1"),
        ("tilt", json!(1.6), "0 to 1.57"),
        ("fiberColorFactor", json!([0.5, 1.5, 0.5]), "0 to 1"),
        ("normalSmoothness", json!(2), "0 to 1"),
        ("fuzziness", json!(-1), "0 to 1"),
        ("attenuation", json!("some"), "full, unscattered, albedo, none"),
        ("phase", json!("fibre"), "fiber, velvet"),
        ("directionEncoding", json!("tilt"), "vector, angles"),
        ("densty", json!(0.2), "unknown field"),
    ] {
        let error = load(json!({ "KINRAN_materials_fuzz": { field: value } })).unwrap_err().to_string();
        for part in ["felt.gltf", "material 0 \"felt\"", "KINRAN_materials_fuzz", field, range] {
            assert!(error.contains(part), "{field}: no {part:?} in {error:?}");
        }
    }
}

#[test]
fn sheen_is_read_as_upright_fibres_and_yields_to_our_own() {
    let sheen = json!({ "sheenColorFactor": [0.5, 0.25, 0.125], "sheenRoughnessFactor": 0.7 });
    let Some(Fuzz::Layer(layer)) = fuzz(json!({ "KHR_materials_sheen": sheen })) else { panic!("no layer") };
    assert_eq!((layer.tilt, layer.density, layer.spread), (0.0, 1.5, 0.492));
    assert_eq!(layer.color, Vec3::new(0.5, 0.25, 0.125));
    assert_eq!(layer.attenuation, FuzzAttenuation::Albedo);
    assert_eq!(fuzz(json!({ "KHR_materials_sheen": {} })), None, "black sheen");
    let both = fuzz(json!({ "KHR_materials_sheen": sheen, "KINRAN_materials_fuzz": { "density": 0.1 } }));
    assert_eq!(both, Some(Fuzz::Layer(FuzzLayer { density: 0.1, ..FuzzLayer::default() })));
}

/// What is written comes back, and the sheen beside it comes back as what it was made of.
#[test]
fn a_layer_survives_writing_and_leaves_a_sheen_for_others() {
    let layer = FuzzLayer {
        density: 0.35,
        spread: 0.565,
        color: Vec3::new(0.3, 0.2, 0.1),
        tilt: 0.4,
        azimuth: 1.25,
        attenuation: FuzzAttenuation::None,
        direction_encoding: FuzzDirection::Angles,
        ..FuzzLayer::default()
    };
    for wanted in [Fuzz::Layer(layer), Fuzz::Simple { fuzziness: 0.75, texture: None }] {
        let mut document = Document::from_bytes(Path::new("felt.gltf"), &document(json!({}))).unwrap();
        wanted.write(document.material_mut(0));
        let extensions = document.material(0)["extensions"].clone();
        assert_eq!(fuzz(extensions.clone()), Some(wanted.clone()), "{extensions}");
        let sheen = &extensions["KHR_materials_sheen"];
        if let Fuzz::Layer(layer) = wanted {
            let roughness = sheen["sheenRoughnessFactor"].as_f64().unwrap();
            assert!((roughness - 0.85).abs() < 1e-6, "{sheen}");
            let red = sheen["sheenColorFactor"][0].as_f64().unwrap() as f32;
            assert!(red > 0.0 && red < layer.color.x, "a thinner layer is a darker sheen: {sheen}");
        }
    }
    // A sheen that was read is written as it was.
    let read = FuzzLayer::from_sheen(Vec3::new(0.5, 0.25, 0.125), 0.6);
    let (color, roughness) = read.to_sheen();
    assert!(
        (roughness - 0.6).abs() < 1e-4 && color.abs_diff_eq(Vec3::new(0.5, 0.25, 0.125), 1e-3),
        "{color} {roughness}"
    );
}

#[test]
fn sample_assets_lose_their_sheen() {
    let Some(assets) = common::sample_assets() else { return };
    let scene = Scene::load(assets.join("meshes/sheen_chair/SheenChair.gltf")).unwrap();
    assert!(scene.materials.iter().any(|m| matches!(m.fuzz, Some(Fuzz::Layer(_)))), "no fuzz was read");
}

/// Khronos' sheen: Charlie's distribution, shadowing by the fit of Estevez and Kulla.
fn sheen(n_u: f64, n_v: f64, n_h: f64, roughness: f64) -> f64 {
    let alpha = roughness * roughness;
    let l = |x: f64| {
        let f = (1.0 - alpha) * (1.0 - alpha);
        let mix = |a: f64, b: f64| a * f + b * (1.0 - f);
        let (a, b, c) = (mix(21.5473, 25.3245), mix(3.82987, 3.32435), mix(0.19823, 0.16801));
        let (d, e) = (mix(-1.97760, -1.27393), mix(-4.32054, -4.85967));
        a / (1.0 + b * x.powf(c)) + d * x + e
    };
    let lambda = |x: f64| if x < 0.5 { l(x).exp() } else { (2.0 * l(0.5) - l(1.0 - x)).exp() };
    let distribution =
        (2.0 + 1.0 / alpha) * (1.0 - n_h * n_h).max(0.0).sqrt().powf(1.0 / alpha) / std::f64::consts::TAU;
    let visibility = (1.0 / ((1.0 + lambda(n_u) + lambda(n_v)) * 4.0 * n_u * n_v)).min(1.0);
    distribution * visibility
}

/// The stated errors are those of the stated parameters, and no neighbour does better.
#[test]
fn the_match_of_sheen_is_as_good_as_stated_and_no_neighbour_is_better() {
    let stated = [0.85, 0.77, 0.62, 0.43, 0.23, 0.17, 0.16];
    for ([roughness, density, spread, albedo], stated) in SHEEN_MATCH.into_iter().zip(stated) {
        let error = |density: f32, spread: f32, albedo: f32| {
            let (mut off, mut all) = (0.0, 0.0);
            const N: u32 = 24;
            for i in 0..N {
                for j in 0..N {
                    for k in 0..N {
                        let at = |i: u32| (f64::from(i) + 0.5) / f64::from(N);
                        let (z, x, phi) = (at(i), at(j), at(k) * std::f64::consts::PI);
                        let (r, s) = ((1.0 - z * z).sqrt(), (1.0 - x * x).sqrt());
                        let u = glam::DVec3::new(r * phi.cos(), r * phi.sin(), z);
                        let v = glam::DVec3::new(s, 0.0, x);
                        let wanted = sheen(z, x, (u + v).normalize().z, roughness.into()) * z;
                        let alpha = kinran_shading::fuzz::fuzz_alpha(spread);
                        let brdf = fuzz_brdf(u.as_vec3(), v.as_vec3(), Vec3::Z, density, alpha);
                        let got = f64::from(albedo * brdf) * z;
                        off += (got - wanted) * (got - wanted);
                        all += wanted * wanted;
                    }
                }
            }
            (off / all).sqrt()
        };
        let best = error(density, spread, albedo);
        assert!((best - stated).abs() < 0.03, "roughness {roughness}: stated {stated}, is {best}");
        for (d, s, a) in [(1.2, 1.0, 1.0), (0.8, 1.0, 1.0), (1.0, 1.2, 1.0), (1.0, 0.8, 1.0), (1.0, 1.0, 0.9)]
        {
            if density * d <= 1.5 {
                let other = error(density * d, spread * s, albedo * a);
                assert!(
                    other > best - 0.005,
                    "roughness {roughness}: {d} {s} {a} has {other}, the match {best}"
                );
            }
        }
    }
}
