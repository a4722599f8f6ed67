//! Rays and shaded samples a second, on one core.
//!
//! `closest_hit` and `any_hit` shoot a picture's rays at a sphere; `shaded_samples` renders the sphere alone,
//! filling the picture, so that every sample is shaded.

use divan::{Bencher, counter::ItemsCount};
use glam::{Mat3, Vec3};
use kinran_image::untold;
use kinran_render::reference::{
    Background, BoundTexture, CameraRay, Geometry, MipLevel, MipTexture, PictureCamera, RenderScene,
    Settings, SurfaceTextures, TextureFiltering, look_at, render,
};
use kinran_scene::{Camera, Environment, Scene, Wrap};
use std::sync::Arc;

#[path = "../tests/shapes/mod.rs"]
#[allow(dead_code, reason = "the tests use all of it")]
mod shapes;

fn main() {
    divan::main();
}

/// A unit sphere of `4 rings²` triangles, of metal, under a light.
fn scene(rings: u32) -> Scene {
    let metal = shapes::material(Vec3::new(0.9, 0.6, 0.3), 1.0, 0.4);
    let light = shapes::directional(Vec3::new(-0.6, -0.6, -0.5), 1.0);
    Scene { lights: vec![light], ..shapes::scene(vec![shapes::sphere(rings)], vec![metal]) }
}

/// A mip chain of 1024² texels that vary.
fn texture() -> BoundTexture {
    let levels = (0..=10).map(|k| {
        let size = 1024u32 >> k;
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

const SIZE: u32 = 128;

/// The sphere fills the picture.
fn camera() -> Camera {
    look_at(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, Vec3::Y, 0.4)
}

fn rays() -> Vec<CameraRay> {
    let picture = PictureCamera::new(&camera(), SIZE, SIZE);
    (0..SIZE * SIZE).map(|i| picture.ray((i % SIZE) as f32 + 0.5, (i / SIZE) as f32 + 0.5)).collect()
}

#[divan::bench(args = [16, 64, 256])]
fn closest_hit(bencher: Bencher<'_, '_>, rings: u32) {
    let geometry = Geometry::new(&scene(rings)).expect("a small scene");
    let rays = rays();
    bencher.counter(ItemsCount::new(rays.len())).bench_local(|| {
        rays.iter()
            .filter(|r| geometry.bvh().closest_hit(r.origin, r.direction, 0.0, f32::INFINITY).is_some())
            .count()
    });
}

#[divan::bench(args = [16, 64, 256])]
fn any_hit(bencher: Bencher<'_, '_>, rings: u32) {
    let geometry = Geometry::new(&scene(rings)).expect("a small scene");
    let rays = rays();
    bencher.counter(ItemsCount::new(rays.len())).bench_local(|| {
        rays.iter().filter(|r| geometry.bvh().any_hit(r.origin, r.direction, 0.0, f32::INFINITY)).count()
    });
}

#[divan::bench(args = ["light, level 0", "environment, level 0", "environment, trilinear", "environment, 16x"])]
fn shaded_samples(bencher: Bencher<'_, '_>, what: &str) {
    let environment = what
        .starts_with("environment")
        .then(|| Environment::from_fn(512, |d| Vec3::splat(1.0 + d.y + if d.x > 0.99 { 50.0 } else { 0.0 })));
    let mut scene = scene(64);
    if environment.is_some() {
        scene.lights.clear();
    }
    let surface = SurfaceTextures::new(texture(), texture());
    let scene = RenderScene::new(&scene, vec![Some(surface)], environment).expect("one material");
    let settings = Settings {
        width: SIZE,
        height: SIZE,
        samples_per_pixel: 4,
        filtering: match what.rsplit(' ').next() {
            Some("trilinear") => TextureFiltering::Mips { max_anisotropy: 1 },
            Some("16x") => TextureFiltering::Mips { max_anisotropy: 16 },
            _ => TextureFiltering::Level0,
        },
        background: Background::Color(Vec3::ZERO),
        ..Settings::default()
    };
    let camera = camera();
    let one_core = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    bencher.counter(ItemsCount::new(4 * (SIZE * SIZE) as usize)).bench_local(|| {
        one_core.install(|| render(&scene, &camera, &settings, &untold).expect("valid settings"))
    });
}
