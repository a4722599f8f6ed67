//! The real-time renderer against closed forms and the reference renderer, in linear light.

use glam::{Affine3A, Vec3, Vec4, vec2, vec3};
use kinran_image::{Encoder, Encoding, Format, Level, Preset, Texture, Transfer, encode, untold};
use kinran_render::Error;
use kinran_render::realtime::{
    Channel, Gpu, GpuScene, MAX_LIGHTS, Realtime, Settings, ShaderSource, Target, left_out,
};
use kinran_render::reference::{
    self, AnisoEncoding, Background, BoundTexture, Film, MipLevel, MipTexture, RenderDielectric, RenderScene,
    SurfaceTextures, TextureFiltering, Translucency, look_at, render,
};
use kinran_render::tonemap::{Tonemap, to_srgb8};
use kinran_scene::{AlphaMode, Camera, Environment, Instance, Light, LightKind, Scene, Wrap};
use kinran_shading::{aniso_encode, aniso_from_alphas, axis_from_direction};
use std::f32::consts::PI;
use std::sync::{Arc, LazyLock, Mutex};

mod shapes;
#[path = "../../stopping.rs"]
mod stopping;
use shapes::{directional, material, scene, sphere, square};

/// One renderer for all tests, one test at a time: a software device has all cores to itself.
static RENDERER: LazyLock<Mutex<Realtime>> = LazyLock::new(|| {
    // Blocks are read on a software device too, slow as it is.
    let features = wgpu::Features::TEXTURE_COMPRESSION_BC | wgpu::Features::TIMESTAMP_QUERY;
    let gpu = Gpu::open_with(|adapter| adapter.features() & features);
    let gpu = gpu.expect("lavapipe will do: apt install mesa-vulkan-drivers");
    let renderer = Realtime::new(&gpu, &ShaderSource::default(), wgpu::TextureFormat::Rgba8Unorm);
    Mutex::new(renderer.expect("the built-in shaders compile"))
});

fn with_renderer<T>(f: impl FnOnce(&Realtime) -> T) -> T {
    // A test that failed leaves the renderer as good as it was.
    f(&RENDERER.lock().unwrap_or_else(|poisoned| poisoned.into_inner()))
}

const TRILINEAR: TextureFiltering = TextureFiltering::Mips { max_anisotropy: 1 };

/// How both renderers draw.
#[derive(Clone, Copy)]
struct Shot {
    camera: Camera,
    size: u32,
    samples: u32,
    filtering: TextureFiltering,
    settings: Settings,
}

impl Shot {
    /// Black behind everything, without shadows.
    fn new(eye: Vec3, yfov: f32) -> Self {
        let settings =
            Settings { shadows: false, background: Background::Color(Vec3::ZERO), ..Settings::default() };
        let camera = look_at(eye, Vec3::ZERO, Vec3::Y, yfov);
        Shot { camera, size: 32, samples: 16, filtering: TRILINEAR, settings }
    }

    fn realtime(&self, scene: &RenderScene) -> Film {
        with_renderer(|renderer| {
            let loaded = renderer.load(scene, &renderer.light_of(scene), self.filtering);
            let size = (self.size, self.size);
            renderer.film(&loaded, &self.camera, &self.settings, size, self.samples, &untold).unwrap()
        })
    }

    fn reference(&self, scene: &RenderScene, env_samples: u32) -> Film {
        let settings = reference::Settings {
            width: self.size,
            height: self.size,
            samples_per_pixel: 64,
            filtering: self.filtering,
            env_samples: if self.settings.reflections { env_samples } else { 0 },
            shadows: self.settings.shadows,
            background: self.settings.background,
            ..reference::Settings::default()
        };
        render(scene, &self.camera, &settings, &untold).unwrap()
    }

    /// Both pictures agree: their means within `mean`, pixels within `pixel` of the brightest, all but one in fifty of
    /// them, which lie on edges that the two renderers cover with other samples.
    fn agree(&self, what: &str, scene: &RenderScene, mean: f32, pixel: f32) {
        let (got, wanted) = (self.realtime(scene), self.reference(scene, 4));
        let (a, b) = (mean_of(&got), mean_of(&wanted));
        assert!(b.max_element() > 1e-3, "{what}: the reference is black");
        assert!(
            (a - b).abs().max_element() <= mean * b.max_element(),
            "{what}: wanted a mean of {b}, got {a}"
        );
        let brightest = wanted.pixels.as_flattened().iter().fold(0.0_f32, |m, &x| m.max(x));
        let apart = |(a, b): (&[f32; 3], &[f32; 3])| (Vec3::from(*a) - Vec3::from(*b)).abs().max_element();
        let mut errors: Vec<f32> = got.pixels.iter().zip(&wanted.pixels).map(apart).collect();
        errors.sort_by(f32::total_cmp);
        let worst = errors[errors.len() * 49 / 50] / brightest;
        assert!(worst <= pixel, "{what}: wanted pixels within {pixel} of the brightest, got {worst}");
    }

    /// The colour in the middle of the picture.
    fn middle(&self, scene: &RenderScene) -> Vec3 {
        let film = Shot { size: 1, ..*self }.realtime(scene);
        film.pixels[0].into()
    }
}

fn mean_of(film: &Film) -> Vec3 {
    film.pixels.iter().map(|&p| Vec3::from(p)).sum::<Vec3>() / film.pixels.len() as f32
}

fn assert_near(what: &str, wanted: f32, got: f32, relative: f32) {
    assert!(
        (got - wanted).abs() <= relative * wanted.abs(),
        "{what}: wanted {wanted} ± {relative}, got {got}"
    );
}

fn prepare(scene: &Scene, environment: Option<Environment>) -> RenderScene {
    RenderScene::new(scene, vec![None; scene.materials.len()], environment).unwrap()
}

/// A surface that is the same everywhere.
fn surface(alpha_t: f32, alpha_b: f32, degrees: f32) -> SurfaceTextures {
    let texel =
        aniso_encode(aniso_from_alphas(alpha_t, alpha_b, glam::Vec2::from_angle(degrees.to_radians())));
    SurfaceTextures::new(
        BoundTexture::constant([0.5, 0.5, 1.0, 1.0]),
        BoundTexture::constant(texel.extend(1.0).to_array()),
    )
}

fn point(position: Vec3, candela: f32) -> Light {
    Light {
        kind: LightKind::Point,
        color: candela * vec3(1.0, 0.8, 0.5),
        position,
        direction: Vec3::NEG_Z,
        range: f32::INFINITY,
    }
}

/// A square of a material, lit by lights.
fn lit_square(lights: Vec<Light>) -> RenderScene {
    let mut scene = scene(vec![square(0)], vec![material(vec3(0.7, 0.4, 0.2), 0.0, 0.7)]);
    scene.lights = lights;
    prepare(&scene, None)
}

#[test]
fn a_point_light_falls_off_with_the_square_of_its_distance() {
    let shot = Shot::new(vec3(0.0, 0.0, 3.0), 0.02);
    let at = |z: f32| shot.middle(&lit_square(vec![point(vec3(0.0, 0.0, z), 5.0)])).x;
    assert_near("twice as far", at(1.0) / 4.0, at(2.0), 1e-3);
    // A range of 2 leaves (1 - (1/2)⁴) / 1 of it at distance 1 (KHR_lights_punctual).
    let ranged = Light { range: 2.0, ..point(vec3(0.0, 0.0, 1.0), 5.0) };
    assert_near("a range", at(1.0) * 15.0 / 16.0, shot.middle(&lit_square(vec![ranged])).x, 1e-3);
}

#[test]
fn punctual_lights_shine_as_in_the_reference() {
    let shot = Shot::new(vec3(0.3, 0.4, 3.0), 0.6);
    let spot = Light {
        kind: LightKind::Spot { inner_cone_angle: 0.25, outer_cone_angle: 0.6 },
        direction: vec3(0.2, -0.1, -1.0).normalize(),
        ..point(vec3(-0.3, 0.2, 1.5), 8.0)
    };
    let lights = [
        ("point", point(vec3(0.5, 0.4, 0.8), 2.0)),
        ("spot", spot),
        ("directional", directional(vec3(-0.6, -0.5, -0.7), 3.0)),
    ];
    for (name, light) in lights {
        shot.agree(name, &lit_square(vec![light]), 5e-3, 8e-3);
    }
    let all = lights.map(|(_, light)| light).to_vec();
    shot.agree("all three", &lit_square(all), 5e-3, 8e-3);
}

#[test]
fn the_deferred_path_has_the_reference_s_lobes() {
    let shot = Shot::new(vec3(0.0, 0.0, 3.0), 0.5);
    for (color, metallic, roughness) in
        [(vec3(0.9, 0.5, 0.2), 0.0, 0.3), (vec3(0.9, 0.5, 0.2), 1.0, 0.5), (vec3(0.2, 0.5, 0.8), 0.5, 1.0)]
    {
        let mut scene = scene(vec![sphere(48)], vec![material(color, metallic, roughness)]);
        scene.lights = vec![directional(vec3(-0.4, -0.3, -1.0), 2.0), point(vec3(1.2, 1.5, 2.0), 3.0)];
        // Eight bits of colour are off by up to one percent, those of roughness move a highlight's peak by two.
        let what = format!("roughness {roughness}, metallic {metallic}");
        shot.agree(&what, &prepare(&scene, None), 0.01, 0.02);
    }
}

#[test]
fn dielectrics_reflect_as_in_the_reference() {
    let shot = Shot::new(vec3(0.0, 0.0, 3.0), 0.5);
    let dielectrics = [
        (vec3(0.2, 0.05, 0.4), 1.0, 0.0),
        (Vec3::splat(0.04), 0.0, 0.0),
        (vec3(1.5, 0.6, 0.1), 0.7, 0.3),
        (Vec3::ONE, 1.0, 0.0),
    ];
    for (f0, strength, metallic) in dielectrics {
        let mut scene = scene(vec![sphere(48)], vec![material(vec3(0.9, 0.5, 0.2), metallic, 0.45)]);
        scene.lights = vec![directional(vec3(-0.4, -0.3, -1.0), 2.0), point(vec3(1.2, 1.5, 2.0), 3.0)];
        let uniform = Environment::from_fn(16, |d| Vec3::splat(0.4 + 0.3 * d.y));
        let mut scene = prepare(&scene, Some(uniform));
        let map = Some(BoundTexture::constant([1.0, 0.8, 0.9, 0.9]));
        scene.materials[0].dielectric = Some(RenderDielectric { f0, strength, map });
        shot.agree(&format!("f0 {f0}, strength {strength}, metallic {metallic}"), &scene, 0.01, 0.02);
    }
}

#[test]
fn the_forward_path_has_the_reference_s_anisotropic_lobes() {
    let shot = Shot::new(vec3(0.2, 0.8, 3.0), 0.5);
    for (alpha_t, alpha_b, degrees) in
        [(0.5, 0.1, 0.0), (0.8, 0.04, 30.0), (0.3, 0.3, 0.0), (0.4, 0.2, -75.0)]
    {
        let mut scene = scene(vec![sphere(48)], vec![material(vec3(0.9, 0.7, 0.4), 1.0, 1.0)]);
        scene.lights = vec![directional(vec3(-0.4, -0.6, -1.0), 2.0)];
        let mut scene = prepare(&scene, None);
        scene.materials[0].surface = Some(surface(alpha_t, alpha_b, degrees));
        shot.agree(&format!("alphas {alpha_t}, {alpha_b} at {degrees}°"), &scene, 5e-3, 0.02);
    }
}

#[test]
fn deferred_and_forward_agree_on_round_lobes() {
    let mut scene = scene(vec![sphere(32)], vec![material(vec3(0.8, 0.6, 0.3), 0.4, 0.6)]);
    scene.lights = vec![directional(vec3(-0.4, -0.6, -1.0), 2.0)];
    let uniform = Environment::from_fn(16, |d| Vec3::splat(0.4 + 0.3 * d.y));
    let deferred = prepare(&scene, Some(uniform));
    let mut forward = deferred.clone();
    forward.materials[0].surface = Some(surface(0.36, 0.36, 0.0));
    let shot = Shot::new(vec3(0.0, 0.0, 3.0), 0.5);
    let [a, b] = [&deferred, &forward].map(|scene| shot.realtime(scene));
    let worst = a.pixels.as_flattened().iter().zip(b.pixels.as_flattened()).map(|(a, b)| (a - b).abs());
    let worst = worst.fold(0.0, f32::max);
    assert!(worst < 0.01, "deferred and forward are {worst} apart");

    // Everything through the G-buffer: the same once more.
    let settings = Settings { all_deferred: true, ..shot.settings };
    let forced = Shot { settings, ..shot }.realtime(&forward);
    let worst = a.pixels.as_flattened().iter().zip(forced.pixels.as_flattened()).map(|(a, b)| (a - b).abs());
    let worst = worst.fold(0.0, f32::max);
    assert!(worst < 0.01, "deferred and forced to be so are {worst} apart");
}

/// A floor of side 2 and above its middle a sheet of side 1, half a metre high, in light that falls steeply or flat.
fn sheet_over_floor(direction: Vec3) -> RenderScene {
    let mut scene = scene(vec![square(0)], vec![material(Vec3::splat(0.8), 0.0, 1.0); 2]);
    scene.primitives.push(square(1));
    let transform = Affine3A::from_translation(vec3(0.0, 0.0, 0.5)) * Affine3A::from_scale(Vec3::splat(0.5));
    scene.instances.push(Instance { primitive: 1, transform });
    scene.lights = vec![directional(direction, PI)];
    prepare(&scene, None)
}

#[test]
fn the_shadow_map_darkens_what_the_reference_s_rays_do() {
    let shot = Shot::new(vec3(0.1, -2.6, 2.6), 0.7);
    let shot = Shot { size: 64, settings: Settings { shadows: true, ..shot.settings }, ..shot };
    for direction in [vec3(0.0, 0.0, -1.0), vec3(0.5, 0.3, -1.0), vec3(1.0, -0.4, -0.6)] {
        shot.agree(&format!("light along {direction}"), &sheet_over_floor(direction), 0.01, 0.05);
    }
}

#[test]
fn slanted_light_does_not_shadow_the_surface_it_falls_on() {
    for (what, shape) in [("a square", square(0)), ("a sphere", sphere(64))] {
        for cosine in [0.9_f32, 0.5, 0.2, 0.06] {
            let mut scene = scene(vec![shape.clone()], vec![material(Vec3::splat(0.8), 0.0, 1.0)]);
            let sine = (1.0 - cosine * cosine).sqrt();
            scene.lights = vec![directional(-vec3(0.8 * sine, 0.6 * sine, cosine), PI)];
            let scene = prepare(&scene, None);
            let shot = Shot::new(vec3(0.0, 0.0, 3.0), 0.7);
            let shadowed = Shot { settings: Settings { shadows: true, ..shot.settings }, ..shot };
            let (with, without) = (mean_of(&shadowed.realtime(&scene)).y, mean_of(&shot.realtime(&scene)).y);
            // A sphere's terminator has no light to lose, but a texel of the map.
            assert!(
                with <= without * 1.0001 && with > 0.998 * without,
                "{what}, light at cosine {cosine}: {without} without shadows, {with} with"
            );
        }
    }
}

#[test]
fn holes_let_light_through() {
    let mut scene = sheet_over_floor(vec3(0.0, 0.0, -1.0));
    let shot = Shot::new(vec3(0.0, -3.0, 0.6), 0.02);
    let shot = Shot { settings: Settings { shadows: true, ..shot.settings }, ..shot };
    let mut under = |alpha: f32| {
        scene.materials[1].alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
        scene.materials[1].base_color_factor.w = alpha;
        shot.middle(&scene).y
    };
    let (solid, hole) = (under(0.6), under(0.4));
    assert!(solid == 0.0 && hole > 0.1, "under the solid {solid}, under the hole {hole}");
}

#[test]
fn a_white_surface_in_uniform_light_is_as_bright_as_the_light() {
    let uniform = || Some(Environment::from_fn(16, |_| Vec3::splat(0.5)));
    let shot = Shot::new(vec3(0.0, 0.0, 3.0), 0.02);
    for (metallic, roughness) in [(0.0, 0.2), (0.0, 0.9), (1.0, 0.2), (1.0, 0.6), (1.0, 1.0)] {
        let scene = scene(vec![square(0)], vec![material(Vec3::ONE, metallic, roughness)]);
        let mut scene = prepare(&scene, uniform());
        let got = shot.middle(&scene);
        assert_near(&format!("deferred, roughness {roughness}, metallic {metallic}"), 0.5, got.y, 0.01);
        scene.materials[0].surface = Some(surface(roughness * roughness, 0.1 * roughness, 20.0));
        let got = shot.middle(&scene);
        assert_near(&format!("forward, roughness {roughness}, metallic {metallic}"), 0.5, got.y, 0.01);
    }
}

#[test]
fn ambient_light_is_the_order_two_irradiance() {
    // Radiance 1 + y has irradiance pi (1 + 2/3 n·y), which order two holds exactly.
    let environment = Environment::from_fn(64, |d| Vec3::splat(1.0 + d.y));
    // Linear 0.5029 is code 188 of 255, so that the G-buffer's eight bits lose nothing.
    let scene = scene(vec![sphere(64)], vec![material(Vec3::splat(0.502_886_5), 0.0, 1.0)]);
    let scene = prepare(&scene, Some(environment));
    let shot = Shot::new(vec3(0.0, 0.0, 3.0), 0.4);
    let shot = Shot { settings: Settings { reflections: false, ..shot.settings }, ..shot };
    shot.agree("what scatters", &scene, 3e-3, 5e-3);
    let top =
        Shot { camera: look_at(vec3(0.0, 3.0, 0.0), Vec3::ZERO, Vec3::Z, 0.001), ..shot }.middle(&scene);
    let bottom =
        Shot { camera: look_at(vec3(0.0, -3.0, 0.0), Vec3::ZERO, Vec3::Z, 0.001), ..shot }.middle(&scene);
    assert_near("top over bottom", 5.0, top.y / bottom.y, 5e-3);
}

#[test]
fn the_probe_reflects_as_the_reference_does() {
    // A bright window, a dim floor and sky.
    let environment = || {
        Environment::from_fn(128, |d| {
            let window = d.x > 0.2 && d.x < 0.7 && d.y > 0.1 && d.y < 0.6 && d.z > 0.0;
            if window { vec3(4.0, 3.6, 3.0) } else { Vec3::splat(0.2 + 0.1 * d.y) }
        })
    };
    let shot = Shot::new(vec3(0.0, 0.3, 3.0), 0.6);
    let shot = Shot { samples: 64, ..shot };
    // The first frames' taps are as wide as their share of the lobe, which tells where the lobe is wide itself.
    for (roughness, mean, pixel) in
        [(0.1, 0.01, 0.02), (0.4, 0.01, 0.02), (0.7, 0.02, 0.04), (1.0, 0.03, 0.06)]
    {
        let scene = scene(vec![sphere(48)], vec![material(vec3(0.9, 0.8, 0.6), 1.0, roughness)]);
        let scene = prepare(&scene, Some(environment()));
        shot.agree(&format!("roughness {roughness}"), &scene, mean, pixel);
    }
    for (alpha_t, alpha_b, degrees) in [(0.3, 0.05, 0.0), (0.5, 0.2, 60.0)] {
        let scene = scene(vec![sphere(48)], vec![material(vec3(0.9, 0.8, 0.6), 1.0, 1.0)]);
        let mut scene = prepare(&scene, Some(environment()));
        scene.materials[0].surface = Some(surface(alpha_t, alpha_b, degrees));
        shot.agree(&format!("alphas {alpha_t}, {alpha_b} at {degrees}°"), &scene, 0.02, 0.03);
    }
}

/// An 8-bit texture of 64 texels a side, with mips, encoded and decoded.
fn encoded_texture(
    format: Format,
    transfer: Transfer,
    texel: impl Fn(f32, f32) -> [f32; 3],
) -> Arc<MipTexture> {
    let encoding = Encoding { format, encoder: Encoder::Portable, preset: Preset::Fast };
    let levels = (0..7).map(|level| {
        let side = 64 >> level;
        let texels: Vec<u8> = (0..side * side)
            .flat_map(|i: u32| {
                let place = |i: u32| (i as f32 + 0.5) / side as f32;
                let [r, g, b] = texel(place(i % side), place(i / side)).map(|x| (x * 255.0).round() as u8);
                [r, g, b, 255]
            })
            .collect();
        Level { width: side, height: side, data: encode(encoding, &texels, side, side).unwrap() }
    });
    let texture = Texture { format, transfer, levels: levels.collect(), metadata: Default::default() };
    Arc::new(MipTexture::from_texture(&texture, [Wrap::Repeat; 2]).unwrap())
}

#[test]
fn compressed_textures_read_as_they_do_decoded() {
    assert!(
        with_renderer(|r| r.gpu().device.features().contains(wgpu::Features::TEXTURE_COMPRESSION_BC)),
        "lavapipe reads block-compressed textures"
    );
    let bind = |texture: Arc<MipTexture>| BoundTexture { texture, ..BoundTexture::constant([0.0; 4]) };
    let wave = |x: f32, y: f32| 0.5 + 0.3 * (12.0 * x + 7.0 * y).sin();
    let textures = [
        encoded_texture(Format::Bc5, Transfer::Linear, |x, y| [wave(x, y), wave(y, -x), 1.0]),
        encoded_texture(Format::Bc7, Transfer::Linear, |x, y| [0.4 + 0.3 * x, 0.3 + 0.4 * y, 0.3]),
        encoded_texture(Format::Bc7, Transfer::Srgb, |x, y| [x, y, wave(x, y)]),
        encoded_texture(Format::Bc1, Transfer::Linear, |x, _| [1.0, 1.0, x]),
    ];
    let picture = |encoded: bool| {
        let [normal, aniso, color, metallic] = textures.clone().map(|texture| {
            bind(if encoded { texture } else { Arc::new(MipTexture { encoded: None, ..(*texture).clone() }) })
        });
        let mut scene = lit_square(vec![directional(vec3(0.3, -0.3, -1.0), PI)]);
        scene.materials[0].surface = Some(SurfaceTextures::new(normal, aniso));
        scene.materials[0].base_color = Some(color);
        scene.materials[0].metallic_roughness = Some(metallic);
        let shot = Shot::new(vec3(0.0, 0.0, 3.0), 0.7);
        (shot.realtime(&scene), scene, shot)
    };
    let ((read, scene, shot), (decoded, ..)) = (picture(true), picture(false));
    let worst = read.pixels.as_flattened().iter().zip(decoded.pixels.as_flattened());
    let worst = worst.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    // Half floats hold what was decoded to one part in two thousand, and highlights are steep.
    assert!(worst < 0.01, "compressed and decoded pictures are {worst} apart");
    shot.agree("compressed", &scene, 0.02, 0.03);
}

#[test]
fn alpha_masks_blends_and_lets_through_as_in_the_reference() {
    let shot = Shot::new(vec3(0.0, 0.0, 3.0), 0.4);
    let settings = Settings { background: Background::Color(vec3(0.2, 0.3, 0.9)), ..shot.settings };
    let shot = Shot { settings, ..shot };
    let sheet = |change: fn(&mut reference::RenderMaterial)| {
        let mut scene = lit_square(vec![directional(vec3(0.0, 0.0, -1.0), 1.0)]);
        change(&mut scene.materials[0]);
        scene
    };
    let holes: fn(&mut reference::RenderMaterial) = |m| {
        m.alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
        m.base_color_factor.w = 0.4;
    };
    let seen = shot.middle(&sheet(holes));
    assert!(
        (seen - vec3(0.2, 0.3, 0.9)).abs().max_element() < 1e-3,
        "a hole shows what is behind it, not {seen}"
    );
    shot.agree("solid", &sheet(|m| m.alpha_mode = AlphaMode::Mask { cutoff: 0.5 }), 5e-3, 8e-3);
    shot.agree(
        "blended",
        &sheet(|m| {
            m.alpha_mode = AlphaMode::Blend;
            m.base_color_factor.w = 0.3;
        }),
        5e-3,
        8e-3,
    );
    shot.agree("clear", &sheet(|m| m.transmission = 1.0), 5e-3, 8e-3);
    shot.agree("emitting", &sheet(|m| m.emissive_factor = vec3(0.5, 0.1, 0.9)), 5e-3, 8e-3);
}

/// A sheet that scatters `share` of its light to its other side, in a colour.
fn translucent(color: Vec3, share: f32, lights: Vec<Light>) -> RenderScene {
    let mut scene = lit_square(lights);
    scene.materials[0].base_color_factor = Vec4::new(0.7, 0.4, 0.2, 1.0);
    scene.materials[0].double_sided = true;
    scene.materials[0].translucency =
        Some(Translucency { factor: share, map: None, color_factor: color, color: None });
    scene
}

#[test]
fn thin_sheets_glow_from_behind_as_in_the_reference() {
    let shot = Shot::new(vec3(0.4, 0.3, 3.0), 0.6);
    let shot = Shot { settings: Settings { shadows: true, ..shot.settings }, ..shot };
    let behind = || vec![directional(vec3(0.3, 0.1, 1.0), PI)];
    let both = || vec![directional(vec3(0.3, 0.1, 1.0), PI), point(vec3(0.3, 0.5, 1.0), 2.0)];
    // Its own colour takes the deferred path, another one the forward path.
    let own = vec3(0.7, 0.4, 0.2);
    for (path, color) in [("deferred", own), ("forward", vec3(0.2, 0.9, 0.3))] {
        shot.agree(&format!("{path}, from behind"), &translucent(color, 0.5, behind()), 5e-3, 6e-3);
        shot.agree(&format!("{path}, from both sides"), &translucent(color, 0.5, both()), 5e-3, 6e-3);
    }
    // Without a share it is black from behind, and what comes through is in proportion to the share.
    let at = |share| shot.middle(&translucent(own, share, behind())).y;
    assert_eq!(at(0.0), 0.0, "an opaque sheet glows");
    assert_near("twice the share", 2.0 * at(0.25), at(0.5), 0.01);

    // In light from all around both sides count.
    let mut scene = translucent(own, 0.5, Vec::new());
    let lit =
        prepare(&shapes::scene(vec![], vec![]), Some(Environment::from_fn(64, |d| Vec3::splat(1.0 + d.z))));
    scene.surroundings = lit.surroundings;
    let settings = Settings { reflections: false, ..shot.settings };
    Shot { settings, ..shot }.agree("ambient", &scene, 5e-3, 6e-3);
}

#[test]
fn textures_are_filtered_as_asked() {
    // Fine stripes on a slanted floor: trilinear filtering washes them out, anisotropic filtering keeps them, level 0
    // aliases.
    let texels = (0..256 * 256).map(|i: u32| {
        let on = f32::from(u8::from((i % 256 / 8).is_multiple_of(2)));
        [on, on, on, 1.0]
    });
    let mut levels = vec![MipLevel { width: 256, height: 256, texels: texels.collect() }];
    while let Some(top) = levels.last().filter(|level| level.width > 1) {
        let (side, texels) = (top.width / 2, &top.texels);
        let texel = |i: u32| {
            let at = |dx, dy| texels[((2 * (i / side) + dy) * 2 * side + 2 * (i % side) + dx) as usize];
            let sum: Vec4 = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)].map(Vec4::from_array).into_iter().sum();
            (0.25 * sum).to_array()
        };
        levels.push(MipLevel { width: side, height: side, texels: (0..side * side).map(texel).collect() });
    }
    let texture = Arc::new(MipTexture { levels, wrap: [Wrap::Repeat; 2], encoded: None });
    let mut scene = lit_square(vec![directional(vec3(0.0, 0.0, -1.0), PI)]);
    scene.materials[0].base_color = Some(BoundTexture { texture, ..BoundTexture::constant([0.0; 4]) });
    let contrast = |filtering| {
        let shot = Shot { size: 128, filtering, ..Shot::new(vec3(0.0, -2.7, 0.35), 0.5) };
        let film = shot.realtime(&scene);
        // Neighbouring pixels of the rows in the middle.
        let row = &film.pixels[64 * 128..66 * 128];
        (row.windows(2).map(|p| (p[0][0] - p[1][0]).abs()).sum::<f32>() / row.len() as f32, shot)
    };
    let (trilinear, shot) = contrast(TRILINEAR);
    let (anisotropic, _) = contrast(TextureFiltering::Mips { max_anisotropy: 16 });
    let (level_0, _) = contrast(TextureFiltering::Level0);
    assert!(
        anisotropic > 1.5 * trilinear && level_0 > 1.5 * trilinear,
        "contrast: trilinear {trilinear}, 16 places {anisotropic}, level 0 {level_0}"
    );
    shot.agree("trilinear", &scene, 0.01, 0.05);
}

#[test]
fn what_is_left_out_is_said() {
    let lights = |count: usize| lit_square(vec![point(Vec3::Z, 0.1); count]);
    let shot = Shot::new(vec3(0.0, 0.0, 3.0), 0.02);
    let settings = shot.settings;
    assert_eq!(left_out(&lights(MAX_LIGHTS), &settings), Vec::<String>::new());
    let said = left_out(&lights(MAX_LIGHTS + 3), &settings);
    assert!(said.len() == 1 && said[0].contains("16 of 19 lights"), "got {said:?}");
    let one = shot.middle(&lights(1)).y;
    assert_near("sixteen lights", 16.0 * one, shot.middle(&lights(MAX_LIGHTS)).y, 2e-3);
    assert_near("nineteen lights", 16.0 * one, shot.middle(&lights(MAX_LIGHTS + 3)).y, 2e-3);

    let said = left_out(&lights(2), &Settings { shadows: true, ..settings });
    assert!(said.len() == 1 && said[0].contains("2 of 2 lights cast no shadows"), "got {said:?}");
    let blurred = Settings { background: Background::Environment { blur: 0.1 }, ..settings };
    assert!(left_out(&lights(1), &blurred)[0].contains("sharp"));
}

#[test]
fn channels_show_what_they_name() {
    let mut scene = lit_square(vec![directional(vec3(0.0, 0.0, -1.0), 1.0)]);
    scene.materials[0].surface = Some(surface(0.6, 0.2, 0.0));
    let shot = Shot::new(vec3(0.0, 0.0, 3.0), 0.02);
    for (channel, wanted) in [
        (Channel::Normal, vec3(0.5, 0.5, 1.0)),
        (Channel::AlphaT, Vec3::splat(0.6)),
        (Channel::AlphaB, Vec3::splat(0.2)),
        (Channel::Mip, Vec3::ZERO),
        (Channel::BaseColor, vec3(0.7, 0.4, 0.2)),
        // Along x: hue 0, two thirds anisotropic.
        (Channel::Direction, vec3(1.0, 0.25, 0.25) * (2.0 / 3.0)),
    ] {
        let got = Shot { settings: Settings { channel, ..shot.settings }, ..shot }.middle(&scene);
        assert!((got - wanted).abs().max_element() < 2e-3, "{channel:?}: wanted {wanted}, got {got}");
    }
}

#[test]
fn passes_with_nothing_to_do_cost_nothing() {
    let passes = |scene: &RenderScene, shadows| {
        with_renderer(|renderer| {
            let loaded = renderer.load(scene, &renderer.light_of(scene), TRILINEAR);
            let mut target = Target::new(renderer, (64, 64));
            let shot = Shot::new(vec3(0.0, 0.0, 3.0), 0.6);
            let settings = Settings { shadows, ..shot.settings };
            let times = renderer.pass_times(&loaded, &shot.camera, &settings, &mut target).unwrap();
            assert!(times.iter().all(|t| t.time.as_secs() < 60), "got {times:?}");
            times.iter().map(|time| time.pass).collect::<Vec<_>>()
        })
    };
    let deferred = lit_square(vec![directional(vec3(0.0, 0.0, -1.0), 1.0)]);
    assert_eq!(passes(&deferred, true), ["shadow", "fill", "light", "forward", "accumulate"]);
    let mut forward = deferred;
    forward.materials[0].surface = Some(surface(0.6, 0.2, 0.0));
    assert_eq!(passes(&forward, false), ["forward", "accumulate"]);
}

#[test]
fn a_stopped_picture_is_drawn_on() {
    let scene = lit_square(Vec::new());
    let shot = Shot::new(vec3(0.0, 0.0, 3.0), 0.6);
    with_renderer(|renderer| {
        let loaded = renderer.load(&scene, &renderer.light_of(&scene), TRILINEAR);
        let is_cancelled = |error: &Error| matches!(error, Error::Cancelled(_));
        stopping::assert_stops("film", 10, is_cancelled, |tick| {
            renderer.film(&loaded, &shot.camera, &shot.settings, (16, 16), 10, tick)
        });
    });
}

#[test]
fn sizes_and_samples_that_cannot_be_drawn_are_refused() {
    let scene = lit_square(Vec::new());
    let shot = Shot::new(vec3(0.0, 0.0, 3.0), 0.6);
    for (size, samples, name) in [((0, 8), 1, "width"), ((8, 1 << 20), 1, "height"), ((8, 8), 0, "samples")] {
        let error = with_renderer(|renderer| {
            let loaded = renderer.load(&scene, &renderer.light_of(&scene), TRILINEAR);
            renderer.film(&loaded, &shot.camera, &shot.settings, size, samples, &untold).unwrap_err()
        });
        assert!(
            matches!(error, Error::Setting { name: got, .. } if got == name),
            "wanted {name}, got {error}"
        );
    }
}

/// What a renderer says to a folder of shaders.
fn complaint(folder: &std::path::Path) -> Option<String> {
    with_renderer(|renderer| {
        let source = ShaderSource { folder: Some(folder.into()) };
        Realtime::new(renderer.gpu(), &source, wgpu::TextureFormat::Rgba8Unorm).err().map(|e| e.to_string())
    })
}

#[test]
fn a_folder_of_shaders_is_read_or_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    assert_eq!(complaint(folder.path()), None, "an empty folder changes nothing");

    write("tonmap.wgsl", "");
    let said = complaint(folder.path()).unwrap();
    assert!(said.contains("tonmap.wgsl") && said.contains("tonemap.wgsl"), "got {said}");
    std::fs::remove_file(folder.path().join("tonmap.wgsl")).unwrap();

    let (_, forward) = ShaderSource::files().find(|(name, _)| *name == "forward.wgsl").unwrap();
    write("forward.wgsl", &forward.replacen("var sum =", "var sum = nonsense +", 1));
    let said = complaint(folder.path()).unwrap();
    assert!(said.contains("forward.wgsl:") && said.contains("nonsense"), "got {said}");

    let missing = folder.path().join("missing");
    let said = complaint(&missing).unwrap();
    assert!(said.contains("missing"), "got {said}");
}

#[test]
fn a_reflection_is_that_of_the_same_place_in_the_environment() {
    // A mirror that faces the viewer shows what is behind the viewer's back, upright and reversed.
    let environment = Environment::from_fn(256, |d| vec3(0.5 + 0.5 * d.x, 0.5 + 0.5 * d.y, 0.5 + 0.5 * d.z));
    let mut scene = scene(vec![square(0)], vec![material(Vec3::ONE, 1.0, 0.0)]);
    scene.lights = Vec::new();
    let scene = prepare(&scene, Some(environment));
    for slope in [vec2(0.0, 0.0), vec2(0.4, 0.0), vec2(-0.2, 0.5)] {
        let eye = slope.extend(1.0).normalize() * 3.0;
        let seen = Shot::new(eye, 0.005).middle(&scene);
        let u = vec3(-eye.x, -eye.y, eye.z).normalize();
        let wanted = 0.5 + 0.5 * u;
        assert!((seen - wanted).abs().max_element() < 0.01, "from {eye}: wanted {wanted}, got {seen}");
    }
}

#[test]
fn anisotropy_as_khronos_has_it_is_that_of_a_texel_on_both_renderers() {
    let n = vec3(0.3, -0.2, (1.0_f32 - 0.13).sqrt());
    let normal = BoundTexture::constant([0.5 + 0.5 * n.x, 0.5 + 0.5 * n.y, 1.0, 1.0]);
    let (roughness, strength, rotation, painted) = (0.4_f32, 0.9_f32, 0.5_f32, 0.7_f32);
    let direction = glam::Vec2::from_angle(painted);
    let khr = SurfaceTextures {
        normal: normal.clone(),
        aniso: BoundTexture::constant([0.5 + 0.5 * direction.x, 0.5 + 0.5 * direction.y, 0.8, 1.0]),
        encoding: AnisoEncoding::Khr { strength, rotation },
        colors: None,
    };
    // KHR_materials_anisotropy's own formulas, once more.
    let alpha_b = roughness * roughness;
    let s = strength * 0.8;
    let alpha_t = alpha_b + (1.0 - alpha_b) * s * s;
    let axis = axis_from_direction(glam::Vec2::from_angle(painted + rotation), n);
    let texel = aniso_encode(aniso_from_alphas(alpha_t, alpha_b, axis)).extend(1.0).to_array();
    let texel = SurfaceTextures::new(normal, BoundTexture::constant(texel));

    let mut scene = scene(vec![sphere(48)], vec![material(vec3(0.9, 0.7, 0.4), 1.0, roughness)]);
    scene.lights = vec![directional(vec3(-0.4, -0.6, -1.0), 2.0)];
    let mut scene = prepare(&scene, None);
    let shot = Shot::new(vec3(0.2, 0.8, 3.0), 0.5);
    let mut draw = |surface: &SurfaceTextures| {
        scene.materials[0].surface = Some(surface.clone());
        [shot.reference(&scene, 1), shot.realtime(&scene)]
    };
    let [khr, texel] = [draw(&khr), draw(&texel)];
    for (name, a, b) in [("reference", &khr[0], &texel[0]), ("real-time", &khr[1], &texel[1])] {
        let brightest = b.pixels.as_flattened().iter().fold(0.0_f32, |m, &x| m.max(x));
        let apart = a.pixels.as_flattened().iter().zip(b.pixels.as_flattened()).map(|(a, b)| (a - b).abs());
        let worst = apart.fold(0.0, f32::max);
        // Rounding of half floats in the picture's sum, and of the encoded square roots.
        assert!(brightest > 0.1 && worst < 2e-3 * brightest, "{name}: {worst} of {brightest} apart");
    }
}

/// A light from above and a sheet over the floor, or no sheet; then the same from a scene of another size, whose shadow map
/// covers another space. Pictures drawn in turn by one renderer are those of fresh ones.
#[test]
fn a_scene_sees_the_shadows_or_the_exposure_of_another() {
    let shaded = sheet_over_floor(vec3(0.0, 0.0, -1.0));
    let lit = lit_square(vec![directional(vec3(0.0, 0.6, -0.8), 1.0)]);
    let shot = Shot::new(vec3(0.0, -3.0, 0.6), 0.5);
    let settings = Settings { shadows: true, tonemap: Tonemap::None, ..shot.settings };
    let cases = [(&shaded, settings), (&lit, Settings { exposure: 1.5, ..settings })];
    let size = (16, 16);
    with_renderer(|renderer| {
        let mut drawn = cases.map(|(scene, settings)| {
            let loaded = renderer.load(scene, &renderer.light_of(scene), TRILINEAR);
            (loaded, settings, Target::new(renderer, size))
        });
        for _ in 0..4 {
            for (scene, settings, target) in &mut drawn {
                renderer.draw(scene, &shot.camera, settings, target);
            }
        }
        for (i, (scene, settings, target)) in drawn.iter().enumerate() {
            let fresh =
                Realtime::new(renderer.gpu(), &ShaderSource::default(), wgpu::TextureFormat::Rgba8Unorm)
                    .unwrap();
            let wanted = fresh.film(scene, &shot.camera, settings, size, 4, &untold).unwrap();
            let got = target.film(renderer.gpu()).unwrap();
            assert_eq!(got, wanted, "the film of scene {i}");
            let wanted = to_srgb8(&wanted.pixels, settings.exposure, settings.tonemap);
            let got = shown(renderer, scene, target);
            let apart = |(a, b): (&[u8; 3], &[u8; 3])| (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap();
            let worst = got.iter().zip(&wanted).map(apart).max().unwrap();
            assert!(worst <= 1, "scene {i} is shown up to {worst} codes off");
        }
    });
}

/// The picture that a window would show.
fn shown(renderer: &Realtime, scene: &GpuScene, target: &Target) -> Vec<[u8; 3]> {
    let (device, queue) = (&renderer.gpu().device, &renderer.gpu().queue);
    let (width, height) = target.size;
    let window = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    renderer.show(target, &window.create_view(&wgpu::TextureViewDescriptor::default()), scene);
    let row = (4 * width).next_multiple_of(256);
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(row * height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
    encoder.copy_texture_to_buffer(
        window.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
        window.size(),
    );
    queue.submit([encoder.finish()]);
    buffer.slice(..).map_async(wgpu::MapMode::Read, |result| result.unwrap());
    device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let bytes = buffer.slice(..).get_mapped_range().unwrap().to_vec();
    let pixels = bytes.chunks_exact(row as usize).flat_map(|row| row[..4 * width as usize].chunks_exact(4));
    pixels.map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}
