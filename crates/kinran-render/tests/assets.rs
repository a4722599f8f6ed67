//! Khronos' test models, judged by what their own labels say.

#[path = "../../sample_assets.rs"]
mod sample_assets;

use glam::{Vec2, Vec3, vec2, vec3};
use kinran_image::{Transfer, untold};
use kinran_render::reference::{
    Background, BoundTexture, Film, MipLevel, MipTexture, RenderScene, Settings, SurfaceTextures,
    TextureFiltering, look_at, render,
};
use kinran_scene::{Environment, Light, Material, Scene, Wrap};
use kinran_shading::{alphas_from_khr_anisotropy, aniso_encode, aniso_from_alphas};
use sample_assets::sample_assets;
use std::sync::Arc;

#[allow(dead_code, reason = "other tests use all of it")]
mod shapes;

fn load(model: &str) -> Option<Scene> {
    let assets = sample_assets()?;
    Some(Scene::load(assets.join("meshes").join(model)).unwrap())
}

/// Level 0 of a material's `KHR_materials_anisotropy` on flat normals, its rotation times `sense`.
fn anisotropy(scene: &Scene, material: &Material, sense: f32) -> Option<SurfaceTextures> {
    let khr = material.anisotropy.as_ref()?;
    let encode = |direction: Vec2, strength: f32| {
        let (alpha_t, alpha_b) =
            alphas_from_khr_anisotropy(material.roughness_factor, strength * khr.strength);
        let axis = Vec2::from_angle(sense * khr.rotation).rotate(direction.normalize());
        aniso_encode(aniso_from_alphas(alpha_t, alpha_b, axis)).extend(1.0).to_array()
    };
    let aniso = match &khr.texture {
        None => BoundTexture::constant(encode(Vec2::X, 1.0)),
        Some(place) => {
            let image = scene.images[place.image].as_ref()?;
            let texel = |i: u32| {
                let [r, g, b, _] = image.texel(i % image.width, i / image.width);
                encode(vec2(2.0 * r - 1.0, sense * (2.0 * g - 1.0)), b)
            };
            let texels = (0..image.width * image.height).map(texel).collect();
            let level = MipLevel { width: image.width, height: image.height, texels };
            BoundTexture::new(
                Arc::new(MipTexture { levels: vec![level], wrap: place.wrap, encoded: None }),
                place,
            )
        }
    };
    Some(SurfaceTextures::new(BoundTexture::constant([0.5, 0.5, 0.0, 1.0]), aniso))
}

const PIXELS_PER_UNIT: f32 = 48.0;

/// The front of a model around `centre`, six `unit`s wide and high, nearly without perspective.
fn front(scene: &RenderScene, centre: Vec3, unit: f32) -> Film {
    let eye = centre + vec3(0.0, 0.0, 3000.0 * unit);
    let camera = look_at(eye, centre, Vec3::Y, 2.0 * (3.0f32 / 3000.0).atan());
    let size = (6.0 * PIXELS_PER_UNIT) as u32;
    let settings = Settings {
        width: size,
        height: size,
        samples_per_pixel: 16,
        filtering: TextureFiltering::Level0,
        env_samples: 4,
        shadows: false,
        background: Background::Color(Vec3::ZERO),
        ..Settings::default()
    };
    render(scene, &camera, &settings, &untold).unwrap()
}

/// The rectangle of a picture from [`front`] around a place, in units from its centre, +y up.
fn crop(film: &Film, centre: Vec2, half: Vec2) -> Vec<Vec3> {
    let corner = (vec2(3.0, 3.0) + vec2(centre.x, -centre.y) - half) * PIXELS_PER_UNIT;
    let (x0, y0) = (corner.x.round() as usize, corner.y.round() as usize);
    let (w, h) = ((2.0 * half.x * PIXELS_PER_UNIT) as usize, (2.0 * half.y * PIXELS_PER_UNIT) as usize);
    let pixel = |x: usize, y: usize| Vec3::from(film.pixels[y * film.width as usize + x]);
    (y0..y0 + h).flat_map(|y| (x0..x0 + w).map(move |x| pixel(x, y))).collect()
}

/// Sum of absolute differences over the sum of the first picture.
fn difference(a: &[Vec3], b: &[Vec3]) -> f32 {
    let sum = |f: &dyn Fn(usize) -> Vec3| (0..a.len()).map(|i| f(i).element_sum()).sum::<f32>();
    sum(&|i| (a[i] - b[i]).abs()) / sum(&|i| a[i])
}

#[test]
fn sample_assets_with_bands_turned_alike_differ() {
    let Some(mut scene) = load("anisotropy_rotation_test/AnisotropyRotationTest.glb") else { return };
    let lights: Vec<Light> =
        [vec3(-0.3, -0.5, -1.0), vec3(0.7, 0.1, -1.0)].map(|d| shapes::directional(d, 1.0)).into();
    for m in &mut scene.materials {
        m.base_color = None;
        // The model's 0.1 makes a ridge of light thinner than a pixel.
        m.roughness_factor = 0.4;
    }
    let bands = [("rotation", vec2(-1.5, -1.0)), ("texture", vec2(-1.5, 1.0)), ("both", vec2(1.5, -1.0))];
    let differences = |sense: f32| {
        let surfaces = scene.materials.iter().map(|m| anisotropy(&scene, m, sense)).collect();
        let mut prepared = RenderScene::new(&scene, surfaces, None).unwrap();
        prepared.lights = lights.clone();
        let film = front(&prepared, Vec3::ZERO, 1.0);
        let half = vec2(0.9, 0.4);
        let plain = crop(&film, vec2(-1.5, 0.0), half);
        assert!(plain.iter().map(|p| p.y).sum::<f32>() > 50.0, "the plain band is dark");
        bands.map(|(name, centre)| (name, difference(&plain, &crop(&film, centre, half))))
    };
    for (name, d) in differences(1.0) {
        // The texture's 8-bit direction is good to half a degree.
        assert!(d < 0.1, "the band with {name} differs from the plain one by {d}");
    }
    for (name, d) in differences(-1.0) {
        assert!(
            d > 0.5,
            "the band with {name}, turned the wrong way, differs by {d} only: the test is blind"
        );
    }
}

#[test]
fn bumps_mapped_in_sample_assets_look_unlike_modelled_ones() {
    let Some(scene) = load("normal_tangent_test/NormalTangentTest.glb") else { return };
    let [min, max] = scene.bounds().unwrap();
    let place = scene.materials[0].normal.clone().unwrap();
    let image = scene.images[place.image].as_ref().unwrap();
    let texture = MipTexture::from_image(image, Transfer::Linear, [Wrap::Repeat; 2]);
    // One roughness for all, so that highlights are wide enough to compare.
    let surface = |flip: f32| {
        let texels =
            texture.levels[0].texels.iter().map(|t| [t[0], 0.5 + flip * (t[1] - 0.5), 0.0, 1.0]).collect();
        let level = MipLevel { texels, ..texture.levels[0].clone() };
        let normal = MipTexture { levels: vec![level], wrap: place.wrap, encoded: None };
        let aniso = BoundTexture::constant([0.2, 0.5, 0.2, 1.0]);
        SurfaceTextures::new(BoundTexture::new(Arc::new(normal), &place), aniso)
    };
    let environment = || Environment::from_fn(64, |d| vec3(0.2 + d.x, 0.2 + d.y, 0.2 - d.y).max(Vec3::ZERO));
    let differences = |flip: f32| {
        let mut prepared = RenderScene::new(&scene, vec![Some(surface(flip))], Some(environment())).unwrap();
        prepared.materials[0].occlusion = None;
        prepared.materials[0].metallic_roughness = None;
        prepared.materials[0].metallic_factor = 1.0;
        prepared.materials[0].base_color = None;
        let film = front(&prepared, 0.5 * (min + max), (max - min).max_element() / 6.0);

        // Five rows of three pairs, modelled on the left and mapped on the right, measured in the picture.
        let rows = [2.5, 1.417, 0.333, -0.75, -1.82];
        let pairs = [(-2.59, -1.729), (-0.43, 0.43), (1.729, 2.59)];
        // Within the bump, whose radius is 0.27.
        let half = vec2(0.18, 0.18);
        let cells = rows.iter().flat_map(|&y| pairs.map(|(a, b)| (vec2(a, y), vec2(b, y))));
        cells.map(|(a, b)| difference(&crop(&film, a, half), &crop(&film, b, half))).collect::<Vec<f32>>()
    };
    let right = differences(1.0);
    assert!(right.iter().all(|&d| d < 0.08), "mapped and modelled bumps differ by {right:?}");
    let wrong = differences(-1.0);
    assert!(wrong.iter().all(|&d| d > 0.5), "with green turned around they differ by {wrong:?} only: blind");
}
