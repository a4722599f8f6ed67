//! The reference renderer against closed forms, quadrature and itself.

use glam::{Affine3A, DVec3, Mat3, Vec2, Vec3, Vec4, dvec3, vec2, vec3};
use kinran_image::{Channels, Image, Pixels, Transfer, untold};
use kinran_render::{
    Error,
    reference::{
        Background, BoundTexture, Film, Geometry, MipLevel, MipTexture, PictureCamera, RenderMaterial,
        RenderScene, Settings, ShadingRate, SurfaceTextures, Surroundings, TextureFiltering, look_at, render,
    },
};
use kinran_scene::{
    AlphaMode, Camera, Dielectric, Environment, Instance, Light, LightKind, Scene, TextureRef, Wrap,
};
use kinran_shading::{aniso_encode, aniso_from_alphas, m_n, multiscatter_compensation};
use std::{f64::consts::PI, sync::Arc};

mod shapes;
#[path = "../../stopping.rs"]
mod stopping;
use shapes::{directional, material, scene, sphere, square};

fn prepare(scene: &Scene, environment: Option<Environment>) -> RenderScene {
    RenderScene::new(scene, vec![None; scene.materials.len()], environment).unwrap()
}

fn settings(size: u32, samples_per_pixel: u32) -> Settings {
    Settings {
        width: size,
        height: size,
        samples_per_pixel,
        background: Background::Color(Vec3::ZERO),
        ..Settings::default()
    }
}

fn draw(scene: &RenderScene, camera: &Camera, settings: &Settings) -> Film {
    render(scene, camera, settings, &untold).unwrap()
}

/// One ray from `eye` to the origin.
fn radiance_at_origin(scene: &RenderScene, eye: Vec3, samples: u32) -> Vec3 {
    let up = if eye.normalize().y.abs() > 0.9 { Vec3::NEG_Z } else { Vec3::Y };
    let camera = look_at(eye, Vec3::ZERO, up, 1e-4);
    Vec3::from(draw(scene, &camera, &settings(1, samples)).pixels[0])
}

fn mean(film: &Film) -> Vec3 {
    film.pixels.iter().map(|&p| Vec3::from(p)).sum::<Vec3>() / film.pixels.len() as f32
}

fn assert_near(what: &str, wanted: f64, got: f32, relative: f64) {
    let error = (f64::from(got) - wanted).abs();
    assert!(error <= relative * wanted.abs(), "{what}: wanted {wanted} ± {relative} of it, got {got}");
}

/// Isotropic GGX with height-correlated Smith and Schlick, written from the papers in double precision: the single
/// scattering BRDF for f0, without cosine.
fn ggx(u: DVec3, v: DVec3, alpha: f64, f0: f64) -> f64 {
    ggx_to(u, v, alpha, f0, 1.0)
}

/// The same for Schlick from `f0` to `f90` at grazing.
fn ggx_to(u: DVec3, v: DVec3, alpha: f64, f0: f64, f90: f64) -> f64 {
    let h = (u + v).normalize();
    let a2 = alpha * alpha;
    let d = a2 / (PI * (h.z * h.z * (a2 - 1.0) + 1.0).powi(2));
    let lambda = |c: f64| 0.5 * ((1.0 + a2 * (1.0 / (c * c) - 1.0)).sqrt() - 1.0);
    let g = 1.0 / (1.0 + lambda(u.z) + lambda(v.z));
    let f = f0 + (f90 - f0) * (1.0 - v.dot(h)).powi(5);
    d * g * f / (4.0 * u.z * v.z)
}

/// The integral of `f(u)` over the upper hemisphere, midpoint rule in the unit disc of projected directions.
fn integrate(f: impl Fn(DVec3) -> f64) -> f64 {
    const N: usize = 800;
    let mut sum = 0.0;
    for i in 0..N {
        for j in 0..2 * N {
            let (z, phi) = ((i as f64 + 0.5) / N as f64, PI * (j as f64 + 0.5) / N as f64);
            let s = (1.0 - z * z).sqrt();
            sum += f(dvec3(s * phi.cos(), s * phi.sin(), z));
        }
    }
    sum * 2.0 * PI / (2 * N * N) as f64
}

/// Lambert under compensated GGX, the whole model in double precision with its albedos integrated.
struct Model {
    v: DVec3,
    alpha: f64,
    f0: f64,
    diffuse: f64,
    compensation: f64,
}

impl Model {
    fn new(n_v: f64, roughness: f64, base: f64, metallic: f64) -> Self {
        let v = dvec3((1.0 - n_v * n_v).sqrt(), 0.0, n_v);
        let alpha = roughness * roughness;
        let white = integrate(|u| ggx(u, v, alpha, 1.0) * u.z);
        let compensation = |f0: f64| 1.0 + f0 * (1.0 / white - 1.0);
        let dielectric = integrate(|u| ggx(u, v, alpha, 0.04) * u.z) * compensation(0.04);
        let f0 = 0.04 + (base - 0.04) * metallic;
        Model {
            v,
            alpha,
            f0,
            diffuse: base * (1.0 - metallic) * (1.0 - dielectric),
            compensation: compensation(f0),
        }
    }

    fn specular(&self, u: DVec3) -> f64 {
        ggx(u, self.v, self.alpha, self.f0) * self.compensation
    }
}

#[test]
fn a_plane_under_one_light_has_the_closed_form_radiance() {
    let light_direction = vec3(0.3, -0.5, -0.8).normalize();
    let u = -light_direction.as_dvec3();
    for (roughness, base, metallic) in [(0.3, 0.7, 1.0), (0.5, 0.6, 0.0), (0.8, 0.2, 0.4), (1.0, 1.0, 1.0)] {
        for eye in [vec3(0.0, 0.0, 3.0), vec3(2.0, 0.0, 1.5), vec3(2.5, 0.0, 0.7)] {
            let mut scene = scene(
                vec![square(0)],
                vec![material(Vec3::splat(base as f32), metallic as f32, roughness as f32)],
            );
            scene.lights = vec![directional(light_direction, 5.0)];
            let got = radiance_at_origin(&prepare(&scene, None), eye, 1).y;
            let model = Model::new(f64::from(eye.normalize().z), roughness, base, metallic);
            let wanted = 5.0 * u.z * (model.diffuse / PI + model.specular(u));
            // The fitted albedo that compensation divides by errs by up to 0.011 of 0.4 to 1.
            assert_near(
                &format!("roughness {roughness} base {base} metallic {metallic} eye {eye}"),
                wanted,
                got,
                0.03,
            );
        }
    }
}

/// `KHR_materials_specular` and `KHR_materials_ior`: reflectance from `strength · min(color · f0, 1)` to `strength`, mixed with
/// that of metal; under it what the channel that reflects most leaves.
#[test]
fn a_dielectric_reflects_other_than_its_extensions_say() {
    let light_direction = vec3(-0.8, 0.1, -0.5).normalize();
    let u = -light_direction.as_dvec3();
    let (roughness, base, eye) = (0.4_f64, 0.6_f64, vec3(2.5, 0.0, 0.7));
    let cases = [
        (Dielectric { ior: 1.8, ..Dielectric::default() }, 0.0),
        (Dielectric { strength: 0.3, ..Dielectric::default() }, 0.0),
        (Dielectric { strength: 0.0, ..Dielectric::default() }, 0.0),
        (Dielectric { strength: 0.5, color_factor: vec3(1.0, 0.2, 40.0), ..Dielectric::default() }, 0.5),
        (Dielectric { ior: 0.0, color_factor: vec3(0.9, 0.5, 0.1), ..Dielectric::default() }, 0.0),
        (Dielectric { ior: 1.0, ..Dielectric::default() }, 0.0),
    ];
    for (dielectric, metallic) in cases {
        let mut material = material(Vec3::splat(base as f32), metallic as f32, roughness as f32);
        material.dielectric = Some(dielectric.clone());
        let mut scene = scene(vec![square(0)], vec![material]);
        scene.lights = vec![directional(light_direction, 5.0)];
        let got = radiance_at_origin(&prepare(&scene, None), eye, 1);

        let n_v = f64::from(eye.normalize().z);
        let (v, alpha) = (dvec3((1.0 - n_v * n_v).sqrt(), 0.0, n_v), roughness * roughness);
        let white = integrate(|u| ggx(u, v, alpha, 1.0) * u.z);
        let (ior, strength) = (f64::from(dielectric.ior), f64::from(dielectric.strength));
        let colors = dielectric.color_factor.as_dvec3().to_array();
        let f0 = colors.map(|color| (((ior - 1.0) / (ior + 1.0)).powi(2) * color).min(1.0));
        let largest = f0.into_iter().fold(0.0, f64::max);
        let compensation = |f0: f64| 1.0 + f0 * (1.0 / white - 1.0);
        let taken = strength * integrate(|u| ggx(u, v, alpha, largest) * u.z) * compensation(largest);
        let f90 = strength + (1.0 - strength) * metallic;
        for (channel, f0) in f0.into_iter().enumerate() {
            let f0 = strength * f0 * (1.0 - metallic) + base * metallic;
            let again = if f90 > 0.0 { compensation(f0 / f90) } else { 1.0 };
            let specular = ggx_to(u, v, alpha, f0, f90) * again;
            let wanted = 5.0 * u.z * (base * (1.0 - metallic) * (1.0 - taken) / PI + specular);
            // As above.
            assert_near(&format!("{dielectric:?}, channel {channel}"), wanted, got[channel], 0.03);
        }
    }
}

/// The colour of a specular map is in red, green and blue of one image, its share in the alpha of another, which may be larger.
#[test]
fn a_specular_map_is_read_from_a_channel_that_is_not_its_own() {
    let image = |side: u32, texel: [u8; 4]| {
        let samples = texel.repeat((side * side) as usize);
        Some(Arc::new(Image::new(side, side, Channels::Rgba, Pixels::U8(samples)).unwrap()))
    };
    let place = |image| TextureRef {
        image,
        runtime: None,
        uv_set: 0,
        transform: Mat3::IDENTITY,
        wrap: [Wrap::Repeat; 2],
    };
    let white = [1.0; 3];
    let tint = [0.0, 1.0, 0.215_860_5];
    for (name, color, share, wanted) in [
        ("none", false, false, None),
        ("colour", true, false, Some((2, tint, 1.0))),
        ("share", false, true, Some((4, white, 0.2))),
        ("both", true, true, Some((4, tint, 0.2))),
    ] {
        let mut scene = scene(vec![square(0)], vec![material(Vec3::ONE, 0.0, 0.5)]);
        scene.images = vec![image(2, [0, 255, 128, 7]), image(4, [9, 9, 9, 51])];
        scene.materials[0].dielectric = Some(Dielectric {
            color: color.then(|| place(0)),
            strength_texture: share.then(|| place(1)),
            ..Dielectric::default()
        });
        let prepared = prepare(&scene, None);
        let map = &prepared.materials[0].dielectric.as_ref().unwrap().map;
        let Some((side, color, share)) = wanted else {
            assert!(map.is_none(), "{name}: a map without an image");
            continue;
        };
        let levels = &map.as_ref().unwrap().texture.levels;
        assert_eq!((levels[0].width, levels[0].height), (side, side), "{name}: size");
        for texel in levels.iter().flat_map(|level| &level.texels) {
            let apart = Vec4::from(*texel) - Vec3::from(color).extend(share);
            assert!(apart.abs().max_element() < 1e-5, "{name}: wanted {color:?} {share}, got {texel:?}");
        }
    }
}

#[test]
fn a_sphere_under_one_light_has_the_closed_form_radiance() {
    let mut scene = scene(vec![sphere(128)], vec![material(Vec3::splat(0.5), 0.0, 0.6)]);
    let light_direction = vec3(-0.6, -0.3, -0.7).normalize();
    scene.lights = vec![directional(light_direction, 2.0)];
    let prepared = prepare(&scene, None);
    for target in [vec3(0.0, 0.0, 1.0), vec3(0.5, 0.2, 0.8), vec3(-0.1, 0.7, 0.6)] {
        let n = target.normalize();
        let eye = vec3(0.2, 0.1, 6.0);
        let camera = look_at(eye, n, Vec3::Y, 1e-4);
        let got = draw(&prepared, &camera, &settings(1, 1)).pixels[0][1];

        let view = (eye - n).normalize();
        let basis =
            Mat3::from_cols((view - n * n.dot(view)).normalize(), n.cross(view).normalize(), n).transpose();
        let u = (basis * -light_direction).as_dvec3();
        let model = Model::new(f64::from(n.dot(view)), 0.6, 0.5, 0.0);
        let wanted = 2.0 * u.z * (model.diffuse / PI + model.specular(u));
        assert_near(&format!("at {n}"), wanted, got, 0.02);
    }
}

#[test]
fn white_furnace() {
    // (metallic, roughness, tolerance): the fitted albedo that compensation divides by errs by up to 0.011, of 0.45
    // where roughness is 1.
    let cases = [(1.0, 0.2, 0.02), (1.0, 0.5, 0.02), (1.0, 1.0, 0.03), (0.0, 0.3, 0.02), (0.0, 1.0, 0.02)];
    for (metallic, roughness, tolerance) in cases {
        let scene = scene(vec![sphere(64)], vec![material(Vec3::ONE, metallic, roughness)]);
        let scene = prepare(&scene, Some(Environment::from_fn(16, |_| Vec3::ONE)));
        for n_v in [0.2f32, 0.5, 0.8, 1.0] {
            // Every ray meets the sphere at the same angle.
            let normal = vec3((1.0 - n_v * n_v).sqrt(), 0.0, n_v);
            let camera = look_at(normal + 3.0 * Vec3::Z, normal, Vec3::Y, 1e-4);
            let got = draw(&scene, &camera, &settings(16, 64));
            assert_near(
                &format!("metallic {metallic} roughness {roughness} n_v {n_v}"),
                1.0,
                mean(&got).y,
                tolerance,
            );
        }
        let camera = look_at(3.0 * Vec3::Z, Vec3::ZERO, Vec3::Y, 0.6);
        let sum = draw(&scene, &camera, &settings(64, 16));
        let lit: Vec<f32> = sum.pixels.iter().map(|p| p[1]).filter(|&v| v > 0.0).collect();
        let mean = lit.iter().sum::<f32>() / lit.len() as f32;
        assert!(lit.len() > 3000, "the sphere covers {} pixels", lit.len());
        assert_near(&format!("whole sphere, metallic {metallic} roughness {roughness}"), 1.0, mean, 0.02);
    }
}

#[test]
fn environment_reflection_equals_quadrature() {
    // A dim gradient with a bright spot of 12 degrees.
    let spot = vec3(0.5, 0.3, 0.8).normalize();
    let light = move |d: Vec3| {
        let bright = if d.dot(spot) > 12f32.to_radians().cos() { 30.0 } else { 0.0 };
        Vec3::splat(0.4 + 0.3 * d.y + bright)
    };
    let environment = Environment::from_fn(512, light);
    for (roughness, eye) in
        [(0.25, vec3(0.0, 0.0, 2.0)), (0.5, vec3(-1.2, 0.0, 1.5)), (0.9, vec3(-2.0, 0.0, 0.8))]
    {
        let base = 0.8;
        let scene = scene(vec![square(0)], vec![material(Vec3::splat(base as f32), 1.0, roughness as f32)]);
        let prepared = prepare(&scene, Some(environment.clone()));
        let got = radiance_at_origin(&prepared, eye, 1 << 14).y;

        // The model's view lies in the xz plane with x ≥ 0; so does the eye's, with x ≤ 0.
        let model = Model::new(f64::from(eye.normalize().z), roughness, base, 1.0);
        let wanted = integrate(|u| {
            let world = dvec3(-u.x, u.y, u.z).as_vec3();
            model.specular(u) * u.z * f64::from(light(world).x)
        });
        assert_near(&format!("roughness {roughness} eye {eye}"), wanted, got, 0.02);
    }
}

#[test]
fn no_environment_samples_leave_the_specular_reflection_black() {
    let scene = scene(vec![square(0)], vec![material(Vec3::ONE, 1.0, 0.5)]);
    let prepared = prepare(&scene, Some(Environment::from_fn(16, |_| Vec3::ONE)));
    let camera = look_at(3.0 * Vec3::Z, Vec3::ZERO, Vec3::Y, 1e-4);
    let film = draw(&prepared, &camera, &Settings { env_samples: 0, ..settings(1, 4) });
    assert_eq!(film.pixels, [[0.0; 3]]);
}

#[test]
fn diffuse_environment_light_equals_the_integral_of_the_cosine() {
    // A gradient is of band one, which order-2 irradiance holds exactly.
    let axis = vec3(0.3, 0.8, 0.5).normalize();
    let light = Surroundings::new(Environment::from_fn(256, |d| Vec3::splat(1.0 + 0.5 * d.dot(axis))));
    for n in [axis, -axis, Vec3::X, vec3(-0.4, 0.1, 0.9).normalize()] {
        let wanted = PI + 0.5 * 2.0 * PI / 3.0 * f64::from(n.dot(axis));
        assert_near(&format!("irradiance on {n}"), wanted, light.irradiance(n).y, 1e-3);
    }
}

#[test]
fn occlusion_dims_the_environment_and_not_the_lights() {
    let half = BoundTexture::constant([0.25, 1.0, 1.0, 1.0]);
    let mut scene = scene(vec![square(0)], vec![material(Vec3::splat(0.5), 0.0, 0.7)]);
    let environment = Environment::from_fn(16, |_| Vec3::ONE);
    let lit = |scene: &RenderScene| radiance_at_origin(scene, vec3(0.0, 0.3, 3.0), 64).y;

    let mut ambient = prepare(&scene, Some(environment));
    let open = lit(&ambient);
    ambient.materials[0].occlusion = Some(half.clone());
    ambient.materials[0].occlusion_strength = 0.8;
    assert_near("ambient", f64::from(open) * (1.0 + 0.8 * (0.25 - 1.0)), lit(&ambient), 1e-4);

    scene.lights = vec![directional(-Vec3::Z, 1.0)];
    let mut direct = prepare(&scene, None);
    let open = lit(&direct);
    direct.materials[0].occlusion = Some(half);
    assert_eq!(open, lit(&direct), "a light is occluded by the map");
}

#[test]
fn shadows_of_opaque_masked_blended_and_clear_sheets() {
    let base = 0.5;
    let light = directional(vec3(0.0, -0.6, -1.0), 1.0);
    let radiance = |sheet: Option<RenderMaterial>, shadows: bool| {
        let mut scene = scene(vec![square(0)], vec![material(Vec3::splat(base), 0.0, 1.0)]);
        scene.materials.push(material(Vec3::ONE, 0.0, 1.0));
        scene.lights = vec![light];
        if sheet.is_some() {
            // Between the light and the origin, out of the camera's way.
            scene.primitives.push(square(1));
            let transform = Affine3A::from_translation(vec3(0.0, 1.2, 2.0));
            scene.instances.push(Instance { primitive: 1, transform });
        }
        let mut prepared = prepare(&scene, None);
        if let Some(sheet) = sheet {
            prepared.materials[1] = sheet;
        }
        let camera = look_at(vec3(0.0, -2.0, 2.0), Vec3::ZERO, Vec3::Y, 1e-4);
        draw(&prepared, &camera, &Settings { shadows, ..settings(1, 1) }).pixels[0]
    };
    let sheet = |alpha: f32, alpha_mode: AlphaMode, transmissive: bool| {
        let scene = scene(vec![square(0)], vec![material(vec3(0.2, 0.5, 1.0), 0.0, 1.0)]);
        let mut sheet = prepare(&scene, None).materials[0].clone();
        sheet.base_color_factor.w = alpha;
        sheet.alpha_mode = alpha_mode;
        sheet.transmission = f32::from(u8::from(transmissive));
        sheet
    };
    let lit = radiance(None, true);
    assert!(lit[1] > 0.05, "the plane is dark: {lit:?}");
    let mask = AlphaMode::Mask { cutoff: 0.5 };
    let cases = [
        ("opaque", sheet(0.0, AlphaMode::Opaque, false), [0.0; 3]),
        ("masked, above the cutoff", sheet(0.6, mask, false), [0.0; 3]),
        ("masked, below the cutoff", sheet(0.4, mask, false), [1.0; 3]),
        ("blended", sheet(0.25, AlphaMode::Blend, false), [0.75; 3]),
        ("clear", sheet(1.0, AlphaMode::Opaque, true), [0.2 * 0.96, 0.5 * 0.96, 0.96]),
    ];
    for (name, sheet, share) in cases {
        let got = radiance(Some(sheet.clone()), true);
        for c in 0..3 {
            let wanted = lit[c] * share[c];
            assert!((got[c] - wanted).abs() < 1e-5, "{name}: wanted {wanted} in channel {c}, got {got:?}");
        }
        assert_eq!(radiance(Some(sheet), false), lit, "{name} casts a shadow with shadows off");
    }
}

#[test]
fn coarse_smooth_spheres_do_not_shadow_their_bright_side() {
    let mut scene = scene(vec![sphere(8)], vec![material(Vec3::ONE, 0.0, 1.0)]);
    scene.lights = vec![directional(vec3(-1.0, -0.2, -0.1), 1.0)];
    let prepared = prepare(&scene, None);
    let camera = look_at(vec3(0.0, 0.0, 4.0), Vec3::ZERO, Vec3::Y, 0.6);
    let with = draw(&prepared, &camera, &settings(96, 4));
    let without = draw(&prepared, &camera, &Settings { shadows: false, ..settings(96, 4) });
    let (with, without) = (mean(&with).y, mean(&without).y);
    // Facets turned away from the light still cut the terminator a little.
    assert!(with > 0.985 * without && with <= without, "lit {without} without shadows, {with} with");
}

#[test]
fn a_scene_looks_the_same_in_micrometres_and_in_kilometres() {
    let picture = |scale: f32| {
        let mut scene = scene(vec![sphere(48), square(0)], vec![material(Vec3::splat(0.8), 0.0, 0.5)]);
        scene.instances[0].transform = Affine3A::from_scale(Vec3::splat(0.3 * scale));
        let behind = Affine3A::from_translation(vec3(0.0, 0.0, -0.5 * scale));
        scene.instances[1].transform = behind * Affine3A::from_scale(Vec3::splat(scale));
        scene.lights = vec![directional(vec3(-0.6, -0.3, -1.0), 1.0)];
        let camera = look_at(vec3(0.0, 0.0, 3.0 * scale), Vec3::ZERO, Vec3::Y, 0.5);
        mean(&draw(&prepare(&scene, None), &camera, &settings(64, 4))).y
    };
    let wanted = picture(1.0);
    for scale in [1e-6, 1e-3, 1e3, 1e6] {
        assert_near(&format!("scale {scale}"), f64::from(wanted), picture(scale), 1e-3);
    }
}

#[test]
fn absurd_coordinates_do_not_panic() {
    for scale in [1e-30f32, 1e-12, 1e12, 1e19, 1e30, 3e38] {
        let mut scene = scene(vec![sphere(4)], vec![material(Vec3::ONE, 0.5, 0.5)]);
        for p in &mut scene.primitives[0].positions {
            *p *= scale;
        }
        scene.lights = vec![directional(Vec3::NEG_Z, 1.0)];
        let prepared = prepare(&scene, Some(Environment::from_fn(4, |_| Vec3::ONE)));
        let camera = look_at(vec3(0.0, 0.0, 2.0), Vec3::ZERO, Vec3::Y, 0.5);
        let film = draw(&prepared, &camera, &settings(8, 1));
        assert!(film.pixels.as_flattened().iter().all(|v| v.is_finite()), "scale {scale}: {:?}", film.pixels);
    }
}

#[test]
fn punctual_lights_fall_off_as_the_extension_says() {
    let scene = scene(vec![square(0)], vec![material(Vec3::ONE, 0.0, 1.0)]);
    let radiance = |light: Light| {
        let mut prepared = prepare(&scene, None);
        prepared.lights = vec![light];
        radiance_at_origin(&prepared, vec3(0.0, 1.0, 2.0), 1).y
    };
    let one_lux = radiance(directional(Vec3::NEG_Z, 1.0));
    let light = |kind, z: f32, direction: Vec3, range: f32| Light {
        kind,
        color: Vec3::splat(3.0),
        position: vec3(0.0, 0.0, z),
        direction: direction.normalize(),
        range,
    };
    let spot = LightKind::Spot { inner_cone_angle: 0.2, outer_cone_angle: 0.5 };
    // Off axis by 0.35 radians.
    let tilted = vec3(0.35f32.sin(), 0.0, -(0.35f32.cos()));
    let ramp = (0.35f64.cos() - 0.5f64.cos()) / (0.2f64.cos() - 0.5f64.cos());
    let cases = [
        ("point at 1 m", light(LightKind::Point, 1.0, Vec3::NEG_Z, f32::INFINITY), 3.0),
        ("point at 2 m", light(LightKind::Point, 2.0, Vec3::NEG_Z, f32::INFINITY), 0.75),
        (
            "point at 2 m, range 3 m",
            light(LightKind::Point, 2.0, Vec3::NEG_Z, 3.0),
            0.75 * (1.0 - 16.0 / 81.0),
        ),
        ("point out of range", light(LightKind::Point, 2.0, Vec3::NEG_Z, 1.9), 0.0),
        ("spot on its axis", light(spot, 1.0, Vec3::NEG_Z, f32::INFINITY), 3.0),
        ("spot in the ramp", light(spot, 1.0, tilted, f32::INFINITY), 3.0 * ramp * ramp),
        ("spot outside", light(spot, 1.0, vec3(0.6, 0.0, -0.8), f32::INFINITY), 0.0),
    ];
    for (name, light, lux) in cases {
        // Cosines within the cone's ramp differ by 0.05, known to 1e-7.
        assert_near(name, lux * f64::from(one_lux), radiance(light), 2e-3);
    }
}

#[test]
fn emission_is_what_is_seen() {
    let mut m = material(Vec3::ZERO, 0.0, 1.0);
    m.emissive_factor = vec3(3.0, 0.25, 40.0);
    let prepared = prepare(&scene(vec![square(0)], vec![m]), None);
    assert_eq!(radiance_at_origin(&prepared, vec3(0.5, 0.0, 2.0), 4), vec3(3.0, 0.25, 40.0));
}

#[test]
fn texture_footprints_match_rays_through_neighbouring_pixels() {
    let scene = scene(vec![square(0)], vec![material(Vec3::ONE, 0.0, 1.0)]);
    let geometry = Geometry::new(&scene).unwrap();
    for eye in [vec3(0.1, 0.2, 3.0), vec3(-1.5, 1.0, 0.8), vec3(0.0, -3.0, 0.3)] {
        let camera = PictureCamera::new(&look_at(eye, vec3(0.2, 0.1, 0.0), Vec3::Z + Vec3::Y, 0.1), 200, 150);
        for (x, y) in [(100.5, 75.5), (80.5, 60.0), (110.0, 90.0)] {
            let uv = |x: f32, y: f32| {
                let ray = camera.ray(x, y);
                // The same plane in double precision; rays of the test meet it within the square.
                let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
                let p = o - d * (o.z / d.z);
                (0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y)
            };
            let ray = camera.ray(x, y);
            let Some(hit) = geometry.bvh().closest_hit(ray.origin, ray.direction, 0.0, f32::INFINITY) else {
                panic!("the ray at ({x}, {y}) from {eye} misses");
            };
            let point = geometry.surface_point(&hit, &ray);
            let here = uv(x, y);
            assert!((f64::from(point.uv[0].x) - here.0).abs() < 1e-5, "uv {} wanted {here:?}", point.uv[0]);
            const H: f32 = 0.05;
            for (name, got, (a, b)) in [
                ("dx", point.uv_dx[0], (uv(x - H, y), uv(x + H, y))),
                ("dy", point.uv_dy[0], (uv(x, y - H), uv(x, y + H))),
            ] {
                let wanted = vec2((b.0 - a.0) as f32, (b.1 - a.1) as f32) / (2.0 * H);
                // Directions in single precision leave 1e-7 / H of noise in the difference.
                let error = (got - wanted).length();
                assert!(
                    error < 1e-2 * wanted.length() + 1e-5,
                    "{name} from {eye}: wanted {wanted}, got {got}"
                );
            }
        }
    }
}

/// A texture whose level k holds the number k in R.
fn level_numbers(size: u32) -> BoundTexture {
    let levels = (0..=size.ilog2()).map(|k| {
        let side = size >> k;
        MipLevel {
            width: side,
            height: side,
            texels: vec![[k as f32, 0.0, 0.0, 1.0]; (side * side) as usize],
        }
    });
    let texture = MipTexture { levels: levels.collect(), wrap: [Wrap::Repeat; 2], encoded: None };
    BoundTexture { texture: Arc::new(texture), uv_set: 0, transform: Mat3::IDENTITY }
}

#[test]
fn level_of_detail_on_a_plane_is_analytic() {
    let mut m = material(Vec3::ZERO, 0.0, 1.0);
    m.emissive_factor = Vec3::ONE;
    let mut prepared = prepare(&scene(vec![square(0)], vec![m]), None);
    let transform = Mat3::from_scale(vec2(4.0, 4.0));
    prepared.materials[0].emissive = Some(BoundTexture { transform, ..level_numbers(512) });
    for (distance, tilt) in [(2.0f32, 0.0f32), (7.0, 0.0), (4.0, 1.0), (4.0, 1.4)] {
        let eye = distance * vec3(0.0, -tilt.sin(), tilt.cos());
        let camera = look_at(eye, Vec3::ZERO, Vec3::Y, 0.5);
        let size = 401;
        // At the picture's centre a pixel covers p metres across, p / cos(tilt) along; 1024 texels are a metre.
        let p = distance * 2.0 * 0.25f32.tan() / size as f32;
        let (across, along) = (1024.0 * p, 1024.0 * p / tilt.cos());
        for max_anisotropy in [1, 4, 16] {
            let filtering = TextureFiltering::Mips { max_anisotropy };
            let film = draw(&prepared, &camera, &Settings { filtering, ..settings(size, 1) });
            let got = film.pixels[(size * size / 2) as usize][0];
            let wanted = f64::from((along / (along / across).min(max_anisotropy as f32)).log2());
            assert!(
                (f64::from(got) - wanted).abs() < 0.03,
                "distance {distance} tilt {tilt} {max_anisotropy}x: wanted {wanted}, got {got}"
            );
        }
        let film =
            draw(&prepared, &camera, &Settings { filtering: TextureFiltering::Level0, ..settings(size, 1) });
        assert_eq!(film.pixels[(size * size / 2) as usize][0], 0.0, "ground truth reads a coarser level");
    }
}

#[test]
fn a_pixel_is_shaded_beside_its_centre() {
    let mut m = material(Vec3::ZERO, 0.0, 1.0);
    m.emissive_factor = Vec3::ONE;
    let mut prepared = prepare(&scene(vec![square(0)], vec![m]), None);
    // Noise much finer than pixels, so that no other place shows the same.
    let side = 256u32;
    let noise = |i: u32| ((i.wrapping_mul(2_654_435_761) >> 8) & 0xFFFF) as f32 / 65535.0;
    let texels = (0..side * side).map(|i| [noise(i), 0.0, 0.0, 1.0]).collect();
    let texture = Arc::new(MipTexture {
        levels: vec![MipLevel { width: side, height: side, texels }],
        wrap: [Wrap::Repeat; 2],
        encoded: None,
    });
    prepared.materials[0].emissive =
        Some(BoundTexture { texture: texture.clone(), uv_set: 0, transform: Mat3::IDENTITY });
    let (size, distance) = (24u32, 3.0f32);
    let camera = look_at(distance * Vec3::Z, Vec3::ZERO, Vec3::Y, 0.5);
    let shading = ShadingRate::Pixel;
    let film = draw(&prepared, &camera, &Settings { shading, ..settings(size, 8) });
    for (i, pixel) in film.pixels.iter().enumerate() {
        let place = |k: u32| ((k as f32 + 0.5) / size as f32 - 0.5) * 2.0 * distance * 0.25f32.tan();
        // The square goes from -1 to 1, v downwards.
        let uv = vec2(place(i as u32 % size), place(i as u32 / size)) * 0.5 + 0.5;
        let wanted = texture.sample_level(uv, 0).x;
        assert!((pixel[0] - wanted).abs() < 0.02, "pixel {i}: wanted {wanted}, got {}", pixel[0]);
    }
}

/// What a pixel shows besides the surface at its centre would be lost, or take that one's light.
#[test]
fn edges_are_jagged_where_a_pixel_is_shaded_once() {
    // A white square before a darker one of the same material, and nothing behind.
    let (mut front, mut back) = (square(0), square(0));
    front.colors = vec![Vec4::ONE; 4];
    back.colors = vec![Vec4::new(0.3, 0.3, 0.3, 1.0); 4];
    for (primitive, by) in [(&mut front, vec3(0.313, 0.207, 1.0)), (&mut back, Vec3::ZERO)] {
        primitive.positions.iter_mut().for_each(|p| *p += by);
    }
    let mut both = scene(vec![front, back], vec![material(Vec3::ONE, 0.0, 1.0)]);
    both.lights = vec![directional(Vec3::NEG_Z, 2.0)];
    let prepared = prepare(&both, None);
    let camera = look_at(6.0 * Vec3::Z, Vec3::ZERO, Vec3::Y, 0.5);
    let shot = |shading| draw(&prepared, &camera, &Settings { shading, shadows: false, ..settings(33, 16) });
    let (by_sample, by_pixel) = (shot(ShadingRate::Sample), shot(ShadingRate::Pixel));
    let mut mixed = 0;
    for (i, (wanted, got)) in by_sample.pixels.iter().zip(&by_pixel.pixels).enumerate() {
        assert!((wanted[0] - got[0]).abs() < 4e-3, "pixel {i}: wanted {wanted:?}, got {got:?}");
        mixed += u32::from((0.1..0.25).contains(&wanted[0]) || (0.3..0.55).contains(&wanted[0]));
    }
    assert!(mixed > 20, "only {mixed} pixels lie on edges");
}

#[test]
fn places_are_not_chosen_as_often_as_they_count_in_mips() {
    let mut m = material(Vec3::ZERO, 0.0, 1.0);
    m.emissive_factor = Vec3::ONE;
    let mut prepared = prepare(&scene(vec![square(0)], vec![m]), None);
    let wrap = [Wrap::Repeat; 2];
    let red = |(width, height): (u32, u32), value: &dyn Fn(u32, u32) -> f32| {
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let pixels = Pixels::F32(places.flat_map(|(x, y)| [value(x, y), 0.0, 0.0]).collect());
        let image = Image::new(width, height, Channels::Rgb, pixels).unwrap();
        let texture = Arc::new(MipTexture::from_image(&image, Transfer::Linear, wrap));
        BoundTexture { texture, uv_set: 0, transform: Mat3::from_scale(Vec2::splat(4.0)) }
    };
    for (size, eye) in
        [((64, 64), vec3(0.0, 0.0, 4.0)), ((96, 80), vec3(0.5, -3.0, 1.5)), ((48, 100), vec3(0.0, 0.2, 7.0))]
    {
        let noise = |x: u32, y: u32| {
            let i = (y % size.1) * size.0 + x % size.0;
            (i.wrapping_mul(2_654_435_761) >> 24) as f32 / 255.0
        };
        // Bilinear reads at all places of a texel: an eighth of each neighbour along both axes.
        let weights = [(size.0 - 1, 0.125), (0, 0.75), (1, 0.125)];
        let blurred = |x: u32, y: u32| -> f32 {
            let row = |y: u32| weights.map(|(dx, w)| w * noise(x + dx, y)).iter().sum::<f32>();
            [(size.1 - 1, 0.125), (0, 0.75), (1, 0.125)].map(|(dy, w)| w * row(y + dy)).iter().sum()
        };
        // A pixel covers more than two texels, so that level 0 itself is not read.
        let camera = look_at(eye, Vec3::ZERO, Vec3::Y, 0.2);
        for max_anisotropy in [1, 8] {
            let mut shot = |texture, filtering| {
                prepared.materials[0].emissive = Some(texture);
                let shading = ShadingRate::Pixel;
                draw(&prepared, &camera, &Settings { filtering, shading, ..settings(12, 4096) })
            };
            let mips = shot(red(size, &blurred), TextureFiltering::Mips { max_anisotropy });
            let texels = TextureFiltering::Texels { max_anisotropy, lobes_only: false, sample: [0; 2] };
            let got = shot(red(size, &noise), texels);
            for (i, (wanted, got)) in mips.pixels.iter().zip(&got.pixels).enumerate() {
                // A deviation of 0.29 for each of the samples: 0.0045 of their mean.
                let off = (wanted[0] - got[0]).abs();
                assert!(
                    off < 0.018,
                    "{size:?}, {max_anisotropy}x, pixel {i}: wanted {wanted:?}, got {got:?}"
                );
            }
        }
    }
}

#[test]
fn lobes_that_do_not_count_are_seen() {
    // Stripes that tilt to the left and to the right, several of them in a pixel; those to the right count for so much.
    let texture = |right: f32, counts: f32| {
        let texel = |i: u32| match i % 64 / 16 % 2 {
            0 => [0.5 - 0.5 * 0.3, 0.5, 1.0, 1.0],
            _ => [0.5 + 0.5 * right, 0.5, 1.0, counts],
        };
        let levels = vec![MipLevel { width: 64, height: 64, texels: (0..64 * 64).map(texel).collect() }];
        let texture = MipTexture { levels, wrap: [Wrap::Repeat; 2], encoded: None };
        BoundTexture { texture: Arc::new(texture), uv_set: 0, transform: Mat3::IDENTITY }
    };
    let mut lit = scene(vec![square(0)], vec![material(Vec3::ONE, 1.0, 0.5)]);
    lit.lights = vec![directional(vec3(0.5, 0.0, -1.0), 1.0)];
    let mut prepared = prepare(&lit, None);
    let aniso = BoundTexture::constant([0.3, 0.5, 0.3, 1.0]);
    let camera = look_at(12.0 * Vec3::Z, Vec3::ZERO, Vec3::Y, 0.1);
    let mut shot = |right, counts| {
        let surface = SurfaceTextures::new(texture(right, counts), aniso.clone());
        prepared.materials[0].surface = Some(surface);
        let filtering = TextureFiltering::Texels { max_anisotropy: 1, lobes_only: true, sample: [0; 2] };
        let shading = ShadingRate::Pixel;
        mean(&draw(&prepared, &camera, &Settings { filtering, shading, ..settings(1, 4096) })).x
    };
    let (both, few, left) = (shot(0.3, 1.0), shot(0.3, 0.001), shot(-0.3, 1.0));
    // A sixteenth of the places lies between two stripes.
    assert!((few / left - 1.0).abs() < 0.06, "that count 1 in 1000: wanted {left}, got {few}");
    assert!((both / left - 1.0).abs() > 0.2, "that count as much: {both}, without them {left}");
}

#[test]
fn a_shrunk_picture_is_not_the_mean_of_what_it_covers() {
    let film = Film { width: 3, height: 2, pixels: (0..6).map(|i| [i as f32, 1.0, 0.0]).collect() };
    let shrunk = film.shrunk(2);
    assert_eq!((shrunk.width, shrunk.height), (2, 1));
    assert_eq!(shrunk.pixels, [[2.0, 1.0, 0.0], [3.5, 1.0, 0.0]]);
}

#[test]
fn texture_transforms_and_the_second_uv_set_count_for_the_footprint() {
    let mut m = material(Vec3::ZERO, 0.0, 1.0);
    m.emissive_factor = Vec3::ONE;
    let mut primitive = square(0);
    primitive.uvs[1] = primitive.uvs[0].iter().map(|&uv| 4.0 * uv).collect();
    let mut prepared = prepare(&scene(vec![primitive], vec![m]), None);
    let camera = look_at(6.0 * Vec3::Z, Vec3::ZERO, Vec3::Y, 0.5);
    let mut lod = |uv_set, transform| {
        prepared.materials[0].emissive = Some(BoundTexture { uv_set, transform, ..level_numbers(512) });
        draw(&prepared, &camera, &settings(65, 1)).pixels[65 * 32 + 32][0]
    };
    let plain = lod(0, Mat3::IDENTITY);
    assert!((lod(1, Mat3::IDENTITY) - plain - 2.0).abs() < 1e-4, "four times the frequency is two levels");
    assert!((lod(0, Mat3::from_scale(vec2(2.0, 2.0))) - plain - 1.0).abs() < 1e-4, "twice is one level");
}

/// A normal map of one round bump that fills the square, and its encoding.
fn bump(size: u32, y_up: bool) -> BoundTexture {
    let texels = (0..size * size).map(|i| {
        let at = |k: u32| (k as f32 + 0.5) / size as f32 * 2.0 - 1.0;
        let (x, y) = (at(i % size), -at(i / size));
        let slope = if x * x + y * y < 0.8 { vec2(x, y) * 0.8 } else { Vec2::ZERO };
        let slope = if y_up { slope } else { vec2(slope.x, -slope.y) };
        [0.5 + 0.5 * slope.x, 0.5 + 0.5 * slope.y, 0.0, 1.0]
    });
    let level = MipLevel { width: size, height: size, texels: texels.collect() };
    let texture = MipTexture { levels: vec![level], wrap: [Wrap::Clamp; 2], encoded: None };
    BoundTexture { texture: Arc::new(texture), uv_set: 0, transform: Mat3::IDENTITY }
}

/// Mean brightness of the right half minus that of the left, and of the upper minus the lower.
fn asymmetry(film: &Film) -> Vec2 {
    let (w, h) = (film.width as usize, film.height as usize);
    let mut sum = Vec2::ZERO;
    for (i, p) in film.pixels.iter().enumerate() {
        let side = vec2(if i % w >= w / 2 { 1.0 } else { -1.0 }, if i / w < h / 2 { 1.0 } else { -1.0 });
        sum += side * p[1];
    }
    sum / (0.5 * film.pixels.len() as f32)
}

#[test]
fn a_bump_is_bright_on_the_side_of_the_light() {
    let isotropic = BoundTexture::constant([0.5, 0.5, 0.5, 1.0]);
    let camera = look_at(4.0 * Vec3::Z, Vec3::ZERO, Vec3::Y, 0.5);
    let lit = |from: Vec3, transform: Affine3A, camera: &Camera, double_sided: bool| {
        let mut scene = scene(vec![square(0)], vec![material(Vec3::splat(0.8), 0.0, 0.7)]);
        scene.materials[0].double_sided = double_sided;
        scene.instances[0].transform = transform;
        scene.lights = vec![directional(-from, 1.0)];
        let surface = SurfaceTextures::new(bump(64, true), isotropic.clone());
        let prepared = RenderScene::new(&scene, vec![Some(surface)], None).unwrap();
        asymmetry(&draw(&prepared, camera, &settings(64, 4)))
    };
    let right = lit(vec3(1.0, 0.0, 1.0), Affine3A::IDENTITY, &camera, false);
    assert!(right.x > 0.05 && right.y.abs() < 0.01, "light from the right: {right}");
    let above = lit(vec3(0.0, 1.0, 1.0), Affine3A::IDENTITY, &camera, false);
    assert!(above.y > 0.05 && above.x.abs() < 0.01, "light from above: {above}");

    // A mirroring instance mirrors the relief with the rest.
    let mirrored = Affine3A::from_scale(vec3(-1.0, 1.0, 1.0));
    let right = lit(vec3(1.0, 0.0, 1.0), mirrored, &camera, false);
    assert!(right.x > 0.05 && right.y.abs() < 0.01, "mirrored, light from the right: {right}");
    let above = lit(vec3(0.0, 1.0, 1.0), mirrored, &camera, false);
    assert!(above.y > 0.05 && above.x.abs() < 0.01, "mirrored, light from above: {above}");

    // From behind, the bump is a dent: bright on the side away from the light. The camera is turned about y, so
    // the world's +x is its left.
    let behind = look_at(-4.0 * Vec3::Z, Vec3::ZERO, Vec3::Y, 0.5);
    let dent = lit(vec3(1.0, 0.0, -1.0), Affine3A::IDENTITY, &behind, true);
    assert!(dent.x > 0.05 && dent.y.abs() < 0.01, "from behind: {dent}");
    let culled = lit(vec3(1.0, 0.0, -1.0), Affine3A::IDENTITY, &behind, false);
    assert_eq!(culled, Vec2::ZERO, "a single-sided back face is visible");
}

/// Principal axis of a picture's brightness about its centroid: the angle from +x towards +y in (-pi/2, pi/2], and
/// the ratio of the standard deviations along and across.
fn elongation(film: &Film) -> (f32, f32) {
    let w = film.width as usize;
    let place = |i: usize| vec2((i % w) as f32, -((i / w) as f32));
    let total: f32 = film.pixels.iter().map(|p| p[1]).sum();
    let weighted = |f: &dyn Fn(Vec2) -> f32| -> f32 {
        film.pixels.iter().enumerate().map(|(i, p)| p[1] * f(place(i))).sum::<f32>() / total
    };
    let c = vec2(weighted(&|p| p.x), weighted(&|p| p.y));
    let (xx, xy, yy) = (
        weighted(&|p| (p.x - c.x).powi(2)),
        weighted(&|p| (p.x - c.x) * (p.y - c.y)),
        weighted(&|p| (p.y - c.y).powi(2)),
    );
    let discriminant = ((xx - yy).powi(2) + 4.0 * xy * xy).sqrt();
    (0.5 * (2.0 * xy).atan2(xx - yy), ((xx + yy + discriminant) / (xx + yy - discriminant)).sqrt())
}

#[test]
fn highlights_stretch_along_the_direction_of_larger_roughness() {
    let camera = look_at(vec3(0.0, 0.0, 3.0), Vec3::ZERO, Vec3::Y, 0.6);
    let mut scene = scene(vec![square(0)], vec![material(Vec3::ONE, 1.0, 0.5)]);
    scene.lights = vec![Light {
        kind: LightKind::Point,
        color: Vec3::ONE,
        position: vec3(0.0, 0.0, 3.0),
        direction: Vec3::NEG_Z,
        range: f32::INFINITY,
    }];
    let flat = BoundTexture::constant([0.5, 0.5, 0.0, 1.0]);
    for (degrees, mirror) in [(0.0f32, 1.0), (90.0, 1.0), (30.0, 1.0), (-55.0, 1.0), (30.0, -1.0)] {
        let axis = Vec2::from_angle(degrees.to_radians());
        let texel = aniso_encode(aniso_from_alphas(0.3, 0.05, axis)).extend(1.0).to_array();
        let surface = SurfaceTextures::new(flat.clone(), BoundTexture::constant(texel));
        scene.instances[0].transform = Affine3A::from_scale(vec3(mirror, 1.0, 1.0));
        let prepared = RenderScene::new(&scene, vec![Some(surface)], None).unwrap();
        let (angle, ratio) = elongation(&draw(&prepared, &camera, &settings(96, 4)));
        let wanted = degrees.to_radians() * mirror;
        let off = (angle - wanted).sin().abs();
        assert!(
            off < 0.03 && ratio > 2.0,
            "{degrees}°, mirrored {mirror}: at {}°, ratio {ratio}",
            angle.to_degrees()
        );
    }
}

#[test]
fn a_tilted_texel_s_matrix_is_read_in_the_shortest_arc_frame() {
    // At a tilt of 34 degrees and azimuth 45, a Gram–Schmidt tangent would be 5 degrees off.
    let n = vec3(0.4, 0.4, 0.68f32.sqrt());
    let m = m_n(n);
    let normal = BoundTexture::constant([0.5 + 0.5 * n.x, 0.5 + 0.5 * n.y, 0.0, 1.0]);
    let mut scene = scene(vec![square(0)], vec![material(Vec3::ONE, 1.0, 0.5)]);
    let (alpha_t, alpha_b) = (0.4f32, 0.1f32);
    let texel = aniso_encode(aniso_from_alphas(alpha_t, alpha_b, Vec2::X)).extend(1.0).to_array();
    let view = (m * vec3(0.1, -0.1, 1.0)).normalize();
    for h in [m * vec3(0.2, 0.1, 1.0), m * vec3(-0.1, 0.15, 1.0), m * vec3(0.3, -0.05, 1.0)] {
        let h = h.normalize();
        let light = 2.0 * view.dot(h) * h - view;
        scene.lights = vec![directional(-light, 1.0)];
        let surface = SurfaceTextures::new(normal.clone(), BoundTexture::constant(texel));
        let prepared = RenderScene::new(&scene, vec![Some(surface)], None).unwrap();
        let got = radiance_at_origin(&prepared, 3.0 * view, 1).y;

        let local = |d: Vec3| (m.transpose() * d).as_dvec3();
        let (u, v, h) = (local(light), local(view), local(h));
        let (at, ab) = (f64::from(alpha_t), f64::from(alpha_b));
        let d = 1.0 / (PI * at * ab * ((h.x / at).powi(2) + (h.y / ab).powi(2) + h.z * h.z).powi(2));
        let lambda =
            |w: DVec3| 0.5 * ((1.0 + ((at * w.x).powi(2) + (ab * w.y).powi(2)) / (w.z * w.z)).sqrt() - 1.0);
        let wanted = d / ((1.0 + lambda(u) + lambda(v)) * 4.0 * v.z);
        let compensation = multiscatter_compensation(Vec3::ONE, v.as_vec3(), alpha_t, alpha_b).x;
        assert_near(&format!("half vector {h}"), wanted * f64::from(compensation), got, 2e-3);
    }
}

#[test]
fn the_environment_is_where_its_image_says() {
    let environment = || {
        Environment::from_fn(64, |d| {
            let face = d.abs().max_position();
            Vec3::from(match (face, d[face] > 0.0) {
                (0, true) => [1.0, 0.0, 0.0],
                (0, false) => [0.0, 1.0, 0.0],
                (1, true) => [0.0, 0.0, 1.0],
                (1, false) => [1.0, 1.0, 0.0],
                (2, true) => [0.0, 1.0, 1.0],
                _ => [1.0, 0.0, 1.0],
            })
        })
    };
    let empty = prepare(&Scene::default(), Some(environment()));
    let background = Background::Environment { blur: 0.0 };
    let look = |direction: Vec3, up: Vec3, blur: f32| {
        let camera = look_at(Vec3::ZERO, direction, up, 0.1);
        let background = if blur > 0.0 { Background::Environment { blur } } else { background };
        Vec3::from(draw(&empty, &camera, &Settings { background, ..settings(1, 64) }).pixels[0])
    };
    for (direction, up, color) in [
        (Vec3::X, Vec3::Y, vec3(1.0, 0.0, 0.0)),
        (Vec3::NEG_X, Vec3::Y, vec3(0.0, 1.0, 0.0)),
        (Vec3::Y, Vec3::Z, vec3(0.0, 0.0, 1.0)),
        (Vec3::NEG_Y, Vec3::Z, vec3(1.0, 1.0, 0.0)),
        (Vec3::Z, Vec3::Y, vec3(0.0, 1.0, 1.0)),
        (Vec3::NEG_Z, Vec3::Y, vec3(1.0, 0.0, 1.0)),
    ] {
        assert!((look(direction, up, 0.0) - color).length() < 1e-5, "towards {direction}");
        assert!(
            (look(direction, up, 0.3) - color).length() < 1e-5,
            "towards {direction}, blurred within its face"
        );
    }
    let seam = look(vec3(1.0, 0.0, -1.0), Vec3::Y, 0.5);
    assert!((seam - vec3(1.0, 0.0, 0.5)).length() < 0.1, "half of two faces: {seam}");

    // A mirror facing +z shows a camera at +z what lies behind it.
    let mirror = prepare(&scene(vec![square(0)], vec![material(Vec3::ONE, 1.0, 0.0)]), Some(environment()));
    let seen = radiance_at_origin(&mirror, 3.0 * Vec3::Z, 64);
    assert!((seen - vec3(0.0, 1.0, 1.0)).length() < 0.02, "in the mirror: {seen}");
    // From the upper right, it shows the left and what is below.
    let seen = radiance_at_origin(&mirror, vec3(3.0, 0.0, 0.5), 64);
    assert!((seen - vec3(0.0, 1.0, 0.0)).length() < 0.02, "in the mirror from the right: {seen}");
}

/// A scene with a bit of everything, small.
fn busy_scene() -> (RenderScene, Camera) {
    let mut scene = scene(
        vec![sphere(24), square(1)],
        vec![material(vec3(0.9, 0.5, 0.2), 1.0, 0.4), material(vec3(0.3, 0.6, 0.9), 0.0, 0.6)],
    );
    scene.materials[1].alpha_mode = AlphaMode::Blend;
    scene.materials[1].base_color_factor.w = 0.6;
    scene.materials[1].double_sided = true;
    scene.instances[1].transform = Affine3A::from_translation(vec3(0.3, 0.2, 1.3));
    scene.lights = vec![directional(vec3(-0.5, -1.0, -0.6), 2.0)];
    let environment = Environment::from_fn(32, |d| vec3(0.5 + 0.5 * d.x, 0.5 + 0.4 * d.y, 1.0 + d.z));
    let texel = aniso_encode(aniso_from_alphas(0.5, 0.1, Vec2::Y)).extend(1.0).to_array();
    let surface = SurfaceTextures::new(bump(32, true), BoundTexture::constant(texel));
    let prepared = RenderScene::new(&scene, vec![Some(surface), None], Some(environment)).unwrap();
    (prepared, look_at(vec3(0.5, 0.8, 4.0), Vec3::ZERO, Vec3::Y, 0.7))
}

#[test]
fn the_picture_does_not_depend_on_the_number_of_threads() {
    let (scene, camera) = busy_scene();
    let settings = Settings {
        width: 70,
        height: 37,
        background: Background::Environment { blur: 0.1 },
        ..settings(1, 4)
    };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| draw(&scene, &camera, &settings))
    };
    let one = with(1);
    assert_eq!(one.pixels.len(), 70 * 37);
    let bits = |film: &Film| -> Vec<u32> { film.pixels.as_flattened().iter().map(|v| v.to_bits()).collect() };
    for threads in [2, 3, 8] {
        assert_eq!(bits(&one), bits(&with(threads)), "{threads} threads draw another picture");
    }
    assert!(
        one.pixels.as_flattened().iter().all(|v| v.is_finite() && *v >= 0.0),
        "a pixel is negative or not finite"
    );
}

#[test]
fn a_stopped_picture_is_rendered_on() {
    let (scene, camera) = busy_scene();
    let is_cancelled = |error: &Error| matches!(error, Error::Cancelled(_));
    // Pixels of many samples ask more often.
    for samples in [1, 130] {
        let settings = Settings { width: 70, height: 37, ..settings(1, samples) };
        stopping::assert_stops(&format!("{samples} samples"), 70 * 37, is_cancelled, |tick| {
            render(&scene, &camera, &settings, tick)
        });
    }
}

#[test]
fn later_samples_go_on_where_the_first_ended_and_seeds_have_independent_noise() {
    let (scene, camera) = busy_scene();
    let part = |first_sample, samples_per_pixel, seed| {
        let size = Settings { width: 70, height: 37, ..settings(1, 1) };
        draw(&scene, &camera, &Settings { first_sample, samples_per_pixel, seed, ..size })
    };
    let (first, later, all) = (part(0, 4, 3), part(4, 4, 3), part(0, 8, 3));
    assert_ne!(first, later, "the same samples were taken twice");
    let halves = first.pixels.as_flattened().iter().zip(later.pixels.as_flattened());
    for ((a, b), wanted) in halves.zip(all.pixels.as_flattened()) {
        let got = 0.5 * (a + b);
        assert!((got - wanted).abs() <= 1e-5 * (1.0 + wanted), "wanted {wanted}, got {got}");
    }

    // Clamped, so that no pixel outweighs the others. What two differences share is the noise of a picture in both.
    let [a, b, c, d] = [1, 2, 3, 4].map(|seed| -> Vec<f32> {
        part(0, 4, seed).pixels.as_flattened().iter().map(|v| v.min(1.0)).collect()
    });
    let less = |a: &[f32], b: &[f32]| -> Vec<f32> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
    let dot = |a: &[f32], b: &[f32]| -> f32 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let correlation = |x: &[f32], y: &[f32]| dot(x, y) / (dot(x, x) * dot(y, y)).sqrt();
    let (one, half) = (correlation(&less(&a, &b), &less(&c, &d)), correlation(&less(&a, &b), &less(&a, &c)));
    assert!(one.abs() < 0.15, "noise of different seeds: wanted a correlation of 0, got {one}");
    assert!((half - 0.5).abs() < 0.15, "noise of one seed in two differences: wanted 0.5, got {half}");
}

#[test]
fn mips_and_ground_truth_agree_where_there_is_nothing_to_filter() {
    let (scene, camera) = busy_scene();
    let mut scene = scene.clone();
    let constant = |size: u32, texel: [f32; 4]| {
        let levels = (0..=size.ilog2()).map(|k| {
            let side = size >> k;
            MipLevel { width: side, height: side, texels: vec![texel; (side * side) as usize] }
        });
        let texture = MipTexture { levels: levels.collect(), wrap: [Wrap::Mirror; 2], encoded: None };
        BoundTexture { texture: Arc::new(texture), uv_set: 0, transform: Mat3::IDENTITY }
    };
    scene.materials[0].surface =
        Some(SurfaceTextures::new(constant(64, [0.6, 0.45, 0.0, 1.0]), constant(64, [0.5, 0.6, 0.2, 1.0])));
    scene.materials[0].base_color = Some(constant(16, [0.7, 0.3, 0.1, 1.0]));
    let with = |filtering| draw(&scene, &camera, &Settings { filtering, ..settings(48, 4) });
    let truth = with(TextureFiltering::Level0);
    for max_anisotropy in [1, 8] {
        let mips = with(TextureFiltering::Mips { max_anisotropy });
        for (a, b) in truth.pixels.as_flattened().iter().zip(mips.pixels.as_flattened()) {
            assert!((a - b).abs() <= 1e-3 * a.max(0.1), "{max_anisotropy}x: wanted {a}, got {b}");
        }
    }
}

#[test]
fn vertex_colours_multiply_the_base_colour() {
    let mut primitive = square(0);
    primitive.colors = vec![Vec4::new(0.5, 0.25, 1.0, 1.0); 4];
    let mut colored = scene(vec![primitive], vec![material(Vec3::ONE, 1.0, 1.0)]);
    colored.lights = vec![directional(Vec3::NEG_Z, 1.0)];
    let mut plain = scene(vec![square(0)], vec![material(vec3(0.5, 0.25, 1.0), 1.0, 1.0)]);
    plain.lights = colored.lights.clone();
    let eye = vec3(0.3, 0.0, 2.0);
    assert_eq!(
        radiance_at_origin(&prepare(&colored, None), eye, 1),
        radiance_at_origin(&prepare(&plain, None), eye, 1)
    );
}

#[test]
fn grazing_views_of_steep_reliefs_stay_finite() {
    // Normals on the horizon, seen from all around, even from below their own horizon.
    for angle in 0..16 {
        let d = Vec2::from_angle(angle as f32 * 0.4);
        let surface = SurfaceTextures::new(
            BoundTexture::constant([0.5 + 0.5 * d.x, 0.5 + 0.5 * d.y, 0.0, 1.0]),
            BoundTexture::constant([1.0, 1.0, 0.0, 1.0]),
        );
        let mut scene = scene(vec![square(0)], vec![material(Vec3::ONE, 0.5, 0.5)]);
        scene.lights = vec![directional(vec3(-1.0, -1.0, -1.0), 1.0)];
        let environment = Environment::from_fn(16, |_| Vec3::ONE);
        let prepared = RenderScene::new(&scene, vec![Some(surface)], Some(environment)).unwrap();
        for eye in [vec3(3.0, 0.0, 0.01), vec3(-3.0, 0.2, 0.5), vec3(0.0, 0.0, 1.0)] {
            let got = radiance_at_origin(&prepared, eye, 16);
            assert!(
                got.is_finite() && got.min_element() >= 0.0 && got.max_element() < 50.0,
                "{d} from {eye}: {got}"
            );
        }
    }
}

#[test]
fn an_empty_scene_is_its_background() {
    let empty = prepare(&Scene::default(), None);
    let camera = look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 0.5);
    let background = Background::Color(vec3(0.1, 0.2, 0.3));
    let film = draw(&empty, &camera, &Settings { background, ..settings(5, 3) });
    assert!(
        film.pixels.iter().all(|p| (Vec3::from(*p) - vec3(0.1, 0.2, 0.3)).length() < 1e-6),
        "{:?}",
        film.pixels
    );
    assert_eq!(empty.geometry.bounds(), None);
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let empty = prepare(&Scene::default(), None);
    let good = look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 0.5);
    let refused = |camera: &Camera, settings: Settings| match render(&empty, camera, &settings, &untold) {
        Err(Error::Setting { name, .. }) => name,
        other => panic!("{settings:?} is accepted: {:?}", other.map(|f| f.width)),
    };
    let base = settings(4, 1);
    assert_eq!(refused(&good, Settings { width: 0, ..base }), "width");
    assert_eq!(refused(&good, Settings { height: 40_000, ..base }), "height");
    assert_eq!(refused(&good, Settings { samples_per_pixel: 0, ..base }), "samples_per_pixel");
    assert_eq!(refused(&good, Settings { first_sample: u32::MAX, ..base }), "first_sample");
    assert_eq!(refused(&good, Settings { env_samples: 5000, ..base }), "env_samples");
    let filtering = TextureFiltering::Mips { max_anisotropy: 0 };
    assert_eq!(refused(&good, Settings { filtering, ..base }), "max_anisotropy");
    let background = Background::Environment { blur: f32::NAN };
    assert_eq!(refused(&good, Settings { background, ..base }), "blur");
    assert_eq!(refused(&Camera { yfov: 0.0, ..good }, base), "yfov");
    assert_eq!(refused(&Camera { yfov: f32::NAN, ..good }, base), "yfov");
}

#[test]
fn a_transform_to_infinity_is_refused() {
    let mut scene = scene(vec![square(0)], vec![material(Vec3::ONE, 0.0, 1.0)]);
    scene.instances[0].transform =
        Affine3A::from_scale(Vec3::splat(1e20)) * Affine3A::from_scale(Vec3::splat(1e18));
    scene.primitives[0].positions[0].x = 1e5;
    let error = Geometry::new(&scene).err().expect("coordinates beyond single precision are accepted");
    assert!(error.to_string().contains("infinity"), "{error}");
}

#[test]
fn surfaces_must_match_the_materials() {
    let scene = scene(vec![square(0)], vec![material(Vec3::ONE, 0.0, 1.0)]);
    assert!(matches!(RenderScene::new(&scene, Vec::new(), None), Err(Error::Scene(_))));
}
