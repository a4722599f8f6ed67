//! The real-time renderer beside the reference at 256 samples a pixel: mean FLIP in direct light and in the studio.
//!
//! Both sides filter textures trilinearly, since drivers differ in what they make of 16 places (lavapipe's picture is
//! sharper than the specification's formula), and no light casts shadows, since a point light has no shadow map. With
//! `KINRAN_PICTURES=DIR` both pictures and their difference are written there.

#![allow(
    clippy::print_stderr,
    reason = "the numbers are what the documentation quotes, and skipped tests say so"
)]

#[path = "../../sample_assets.rs"]
mod sample_assets;

use std::path::{Path, PathBuf};
use std::process::Command;

use kinran_image::{Channels, Image, Pixels, read_image, write_png};
use kinran_render::metrics::flip;
use sample_assets::sample_assets;

/// The largest mean FLIP.
const WANTED: f64 = 0.05;

/// Pixels along a side.
const SIDE: u32 = 128;

fn kinran(args: &[&str]) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_kinran")).args(args).output().expect("kinran does not start");
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn pixels(path: &Path) -> Vec<[u8; 3]> {
    let image = read_image(path).unwrap();
    let Pixels::U8(samples) = image.pixels else { panic!("{}: not 8 bits", path.display()) };
    samples.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()
}

/// Both renderers' pictures of a model; their FLIP, printed.
fn compare(name: &str, model: &Path, light: &[&str], folder: &Path) -> (String, f64) {
    let pictures: Vec<PathBuf> =
        ["cpu", "gpu"].iter().map(|backend| folder.join(format!("{name}_{backend}.png"))).collect();
    for (backend, picture) in ["cpu", "gpu"].iter().zip(&pictures) {
        let size = format!("{SIDE}x{SIDE}");
        let (model, picture) = (model.to_str().unwrap(), picture.to_str().unwrap());
        // 32 jittered frames suffice, since the GPU filters textures.
        let samples = if *backend == "cpu" { "256" } else { "32" };
        let fixed = ["--quiet", "render", model, "-o", picture, "--backend", backend, "--spp", samples];
        let fixed = [&fixed[..], &["--size", &size]].concat();
        // The mips are the same on both sides, so the fastest filter will do.
        let same = ["--max-anisotropy", "1", "--no-shadows", "--filter", "linear"];
        kinran(&[&fixed[..], &same, light].concat());
    }
    let [reference, test] = [&pictures[0], &pictures[1]].map(|path| pixels(path));
    let lit = reference.iter().filter(|p| p.iter().any(|&c| c > 100)).count();
    assert!(lit > reference.len() / 100, "{name}: the reference shows next to nothing");
    let flip = flip(&reference, &test, SIDE, SIDE).unwrap();
    eprintln!("{name}: mean FLIP {:.4}", flip.mean);
    let apart: Vec<u8> = reference
        .as_flattened()
        .iter()
        .zip(test.as_flattened())
        .map(|(a, b)| a.abs_diff(*b).saturating_mul(4))
        .collect();
    let difference = Image::new(SIDE, SIDE, Channels::Rgb, Pixels::U8(apart)).unwrap();
    write_png(&folder.join(format!("{name}_difference_x4.png")), &difference).unwrap();
    (name.into(), f64::from(flip.mean))
}

/// Where pictures go, and what keeps that place.
fn pictures() -> (PathBuf, Option<tempfile::TempDir>) {
    if let Some(folder) = std::env::var_os("KINRAN_PICTURES").map(PathBuf::from) {
        std::fs::create_dir_all(&folder).unwrap();
        return (folder, None);
    }
    let folder = tempfile::tempdir().unwrap();
    (folder.path().into(), Some(folder))
}

fn check(results: &[(String, f64)]) {
    let worse: Vec<_> = results.iter().filter(|(_, flip)| *flip > WANTED).collect();
    assert!(worse.is_empty(), "mean FLIP above {WANTED}: {worse:?}");
}

/// Two directional lights and nothing else.
const LIGHTS: [&str; 6] = ["--env", "none", "--light", "-0.5,0.7,0.6", "--light", "0.8,0.2,0.5"];

/// The built-in environment.
const STUDIO: [&str; 2] = ["--env", "studio"];

#[test]
fn sample_assets_look_as_in_the_reference() {
    let Some(assets) = sample_assets() else { return };
    let (folder, _guard) = pictures();
    let models = [
        ("barn_lamp", "anisotropy_barn_lamp/AnisotropyBarnLamp.gltf"),
        ("disc", "anisotropy_disc_test/AnisotropyDiscTest.glb"),
    ];
    let lights: [(_, &[_]); 2] = [("lights", &LIGHTS), ("studio", &STUDIO)];
    let results = models.iter().flat_map(|(name, file)| {
        let model = assets.join("meshes").join(file);
        let (folder, name) = (&folder, *name);
        lights.map(|(light, flags)| compare(&format!("{name}_{light}"), &model, flags, folder))
    });
    check(&results.collect::<Vec<_>>());
}

#[test]
fn the_demo_looks_as_in_the_reference() {
    let (folder, _guard) = pictures();
    let demo = tempfile::tempdir().unwrap();
    kinran(&["--quiet", "demo", "--quick", "-o", demo.path().to_str().unwrap()]);
    // Without an environment, the light of the file.
    let lights: [(_, &[_]); 2] = [("light", &["--env", "none"]), ("studio", &STUDIO)];
    let results = ["brocade", "twill", "brushed_disc"].iter().flat_map(|name| {
        let model = demo.path().join(format!("{name}.glb"));
        let folder = &folder;
        lights.map(|(light, flags)| {
            let flags = [&["--camera", "0"], flags].concat();
            compare(&format!("{name}_{light}"), &model, &flags, folder)
        })
    });
    check(&results.collect::<Vec<_>>());
}

/// Mesa looks for a display also where nothing is shown, and calls it an error that it finds no folder to look in.
#[test]
fn a_picture_that_is_drawn_is_called_an_error() {
    let folder = tempfile::tempdir().unwrap();
    kinran(&["--quiet", "demo", "--quick", "-o", folder.path().to_str().unwrap()]);
    let (model, picture) = (folder.path().join("twill.glb"), folder.path().join("twill.png"));
    let output = Command::new(env!("CARGO_BIN_EXE_kinran"))
        .args(["render", model.to_str().unwrap(), "-o", picture.to_str().unwrap(), "--backend", "gpu"])
        .args(["--size", "16x16", "--spp", "1", "--filter", "linear"])
        .env_remove("XDG_RUNTIME_DIR")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr).to_lowercase();
    assert!(output.status.success() && picture.exists(), "{said}");
    assert!(!said.contains("error"), "{said}");
}
