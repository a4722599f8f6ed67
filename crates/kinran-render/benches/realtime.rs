//! What each pass of the real-time renderer costs: milliseconds for a million lit pixels, by the device's own clock.
//!
//! The model is a sphere that fills the picture, so that nearly every pixel is lit. Lavapipe, which draws on the CPU,
//! gives figures to compare passes and revisions with; they say nothing about a GPU.

#![allow(clippy::print_stdout, reason = "the table is what this bench is for")]

use glam::{Mat3, Vec3, vec3};
use kinran_render::realtime::{Gpu, Realtime, Settings, ShaderSource, Target};
use kinran_render::reference::{
    Background, BoundTexture, MipLevel, MipTexture, RenderScene, SurfaceTextures, TextureFiltering, look_at,
};
use kinran_scene::{Environment, Light, LightKind, Wrap};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

#[path = "../tests/shapes/mod.rs"]
#[allow(dead_code, reason = "the tests use all of it")]
mod shapes;

/// Pixels along a side.
const SIZE: u32 = 512;

/// Frames, of which the fastest of each pass counts.
const FRAMES: usize = 12;

fn main() {
    // Cargo hands its own flags on.
    let gpu = Gpu::open().expect("a Vulkan device");
    let renderer = Realtime::new(&gpu, &ShaderSource::default(), wgpu::TextureFormat::Rgba8Unorm)
        .expect("the built-in shaders compile");
    println!("ms for a million lit pixels, {SIZE}² pixels, fastest of {FRAMES} frames\n");
    let passes = ["shadow", "fill", "light", "forward", "accumulate"];
    println!("| scene | {} | all |\n| --- |{}", passes.join(" | "), " ---: |".repeat(passes.len() + 1));
    for (name, scene) in scenes() {
        let times = fastest(&renderer, &scene);
        // The sphere's disc: it touches the picture's sides.
        let lit = f64::from(SIZE * SIZE) * std::f64::consts::FRAC_PI_4 / 1e6;
        let per_million = |time: Duration| time.as_secs_f64() * 1e3 / lit;
        let cells = passes.map(|p| times.get(p).map_or("-".into(), |&t| format!("{:.0}", per_million(t))));
        let all: Duration = times.values().sum();
        println!("| {name} | {} | {:.0} |", cells.join(" | "), per_million(all));
    }
}

fn fastest(renderer: &Realtime, scene: &RenderScene) -> BTreeMap<&'static str, Duration> {
    let light = renderer.light_of(scene);
    let loaded = renderer.load(scene, &light, TextureFiltering::Mips { max_anisotropy: 1 });
    // A unit sphere seen from afar touches the sides where sin(yfov / 2) = 1 / distance.
    let camera = look_at(vec3(0.0, 0.0, 8.0), Vec3::ZERO, Vec3::Y, 2.0 * (1.0_f32 / 8.0).asin());
    let settings = Settings { background: Background::Color(Vec3::ZERO), ..Settings::default() };
    let mut target = Target::new(renderer, (SIZE, SIZE));
    let mut fastest: BTreeMap<&'static str, Duration> = BTreeMap::new();
    for _ in 0..FRAMES {
        target.clear(renderer);
        let times =
            renderer.pass_times(&loaded, &camera, &settings, &mut target).expect("a device with a clock");
        for time in times {
            let best = fastest.entry(time.pass).or_insert(time.time);
            *best = time.time.min(*best);
        }
    }
    fastest
}

/// One directional light with shadows, or four lights in an environment; each deferred and forward.
fn scenes() -> Vec<(&'static str, RenderScene)> {
    let scene = |lights: usize, environment: bool, forward: bool| {
        let sphere = shapes::sphere(64);
        let mut scene = shapes::scene(vec![sphere], vec![shapes::material(vec3(0.9, 0.6, 0.3), 1.0, 0.4)]);
        scene.lights = vec![shapes::directional(vec3(-0.6, -0.6, -0.5), 2.0)];
        scene.lights.extend((1..lights).map(|i| Light {
            kind: LightKind::Point,
            color: Vec3::ONE,
            position: vec3(i as f32 - 2.0, 1.5, 2.0),
            direction: Vec3::NEG_Z,
            range: f32::INFINITY,
        }));
        let environment = environment.then(Environment::studio);
        let mut scene = RenderScene::new(&scene, vec![None], environment).expect("one material");
        if forward {
            scene.materials[0].surface = Some(SurfaceTextures::new(texture(), texture()));
        }
        scene
    };
    vec![
        ("deferred, 1 light", scene(1, false, false)),
        ("forward, 1 light", scene(1, false, true)),
        ("deferred, 4 lights, environment", scene(4, true, false)),
        ("forward, 4 lights, environment", scene(4, true, true)),
    ]
}

/// A mip chain of 512² texels that vary.
fn texture() -> BoundTexture {
    let levels = (0..=9).map(|k| {
        let size = 512u32 >> k;
        let texel = |i: u32| {
            let f = (i.wrapping_mul(0x9E37_79B9) >> 8) as f32 / 16_777_216.0;
            [0.45 + 0.1 * f, 0.55 - 0.1 * f, 0.3, 1.0]
        };
        MipLevel { width: size, height: size, texels: (0..size * size).map(texel).collect() }
    });
    BoundTexture {
        texture: Arc::new(MipTexture { levels: levels.collect(), wrap: [Wrap::Repeat; 2], encoded: None }),
        uv_set: 0,
        transform: Mat3::IDENTITY,
    }
}
