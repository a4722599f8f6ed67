//! Maps blended from tiles: the reference renderer against the formulas, the real-time one against the reference.

use std::sync::Arc;

use glam::{Mat3, Vec2, Vec3, vec2, vec3};
use kinran_image::{Channels, Image, Pixels, untold};
use kinran_render::reference::{
    Background, BoundTexture, DetailShown, Film, MipTexture, RenderScene, Settings, SurfaceTextures, look_at,
    render,
};
use kinran_scene::{Detail, DetailLayer, DetailMap, DetailMask, LayerTransform, Scene, TextureRef, Wrap};
use kinran_shading::detail::{detail_mask, detail_over, overlay_color, rnm, smooth_overlay_color};
use kinran_shading::normal_from_xy;

#[allow(dead_code, reason = "tests share it")]
mod shapes;
use shapes::{directional, material, scene, square};

/// Images, and materials that refer to them.
struct Pictures(Vec<Option<Arc<Image>>>);

impl Pictures {
    fn add(&mut self, side: u32, wrap: Wrap, texel: impl Fn(u32, u32) -> [u8; 4]) -> Option<TextureRef> {
        let bytes = (0..side * side).flat_map(|i| texel(i % side, i / side)).collect();
        let image = Image::new(side, side, Channels::Rgba, Pixels::U8(bytes)).unwrap();
        self.0.push(Some(Arc::new(image)));
        Some(TextureRef {
            image: self.0.len() - 1,
            runtime: None,
            uv_set: 0,
            transform: Mat3::IDENTITY,
            wrap: [wrap; 2],
        })
    }
}

fn of(detail: Option<Detail>, pictures: &Pictures) -> Scene {
    let mut m = material(vec3(0.5, 0.5, 0.5), 0.25, 0.8);
    m.base_color_factor = Vec3::ONE.extend(1.0);
    m.detail = detail;
    let mut scene = scene(vec![square(0)], vec![m]);
    scene.images.clone_from(&pictures.0);
    scene.textures = vec![None; pictures.0.len()];
    scene.lights.push(directional(vec3(-0.4, -0.3, -1.0), 3.0));
    scene
}

fn drawn(scene: &RenderScene, size: u32, eye: Vec3, samples: u32) -> Film {
    let settings = Settings {
        width: size,
        height: size,
        samples_per_pixel: samples,
        background: Background::Color(Vec3::ZERO),
        ..Settings::default()
    };
    render(scene, &look_at(eye, Vec3::ZERO, Vec3::Y, 0.6), &settings, &untold).unwrap()
}

fn one(value: Vec3) -> [u8; 4] {
    (value * 255.0).round().extend(255.0).to_array().map(|v| v as u8)
}

/// What byte 255 x stands for in a synthesized map.
fn s_of(texel: Vec3) -> Vec3 {
    ((texel * 255.0).round() - 1.0) / 254.0
}

/// The same picture as a material without tiles, whose maps are constants by the formulas.
#[test]
fn what_is_shown_is_what_the_formulas_say() {
    let (s, a, b, mask) =
        (vec3(0.6, 0.3, 0.8), vec3(0.4, 0.7, 0.2), vec3(0.9, 0.1, 0.5), vec3(0.3, 0.6, 0.1));
    let rounded = |v: Vec3| (v * 255.0).round() / 255.0;
    let contrast = 1.5;
    let alpha = detail_mask(rounded(mask).y, contrast);
    for map in [DetailMap::BaseColor, DetailMap::Data, DetailMap::Normal, DetailMap::Aniso] {
        for (on, plain) in [([true, true], false), ([true, false], true), ([false, true], false)] {
            let mut pictures = Pictures(Vec::new());
            let constant =
                |pictures: &mut Pictures, value: Vec3| pictures.add(1, Wrap::Repeat, |_, _| one(value));
            let mut detail = Detail { plain_overlay: plain, aniso_alpha: 0.3, ..Detail::default() };
            detail.maps[map as usize] = constant(&mut pictures, s);
            for (tile, masked) in [(a, false), (b, true)] {
                let mut layer = DetailLayer::default();
                layer.tiles[map as usize] = constant(&mut pictures, tile);
                layer.mask = masked.then(|| DetailMask {
                    texture: constant(&mut pictures, mask).unwrap(),
                    channel: 1,
                    contrast,
                });
                detail.layers.push(layer);
            }
            let scene = of(Some(detail), &pictures);
            let mut blended = RenderScene::new(&scene, vec![None], None).unwrap();
            let shown = blended.materials[0].detail.as_mut().unwrap();
            for (layer, on) in shown.layers.iter_mut().zip(on) {
                layer.on = on;
            }

            // What each layer is, over what asks for nothing.
            let of_layer = |texel: Vec3| match map {
                DetailMap::BaseColor => Vec3::from(rounded(texel).to_array().map(from_srgb)),
                DetailMap::Normal => {
                    let xy = rounded(texel) * 2.0 - 1.0;
                    normal_from_xy(xy.x, xy.y)
                }
                _ => rounded(texel),
            };
            let mut d = match map {
                DetailMap::Normal => Vec3::Z,
                DetailMap::Aniso => rounded(s),
                _ => Vec3::splat(0.5),
            };
            if on[0] {
                d = of_layer(a);
            }
            if on[1] {
                d = d.lerp(of_layer(b), alpha);
            }
            let base = s_of(s) * 2.0 - 1.0;
            let base = normal_from_xy(base.x, base.y);
            let d = if map == DetailMap::Normal { d.normalize() } else { d };
            let (alone, together) = match map {
                DetailMap::Normal => (base, rnm(base, d)),
                DetailMap::Aniso => (rounded(s), detail_over(rounded(s), d, 0.3)),
                _ if plain => (s_of(s), overlay_color(s_of(s), d)),
                _ => (s_of(s), smooth_overlay_color(s_of(s), d)),
            };
            for (mode, value) in [
                (DetailShown::Blended, Some(together)),
                (DetailShown::Detail, Some(d)),
                (DetailShown::Synthesized, Some(alone)),
                (DetailShown::Target, None),
            ] {
                blended.materials[0].detail.as_mut().unwrap().shown = mode;
                let mut plain_scene = of(None, &Pictures(Vec::new()));
                let mut surface = None;
                match (map, value) {
                    (_, None) => {}
                    (DetailMap::BaseColor, Some(v)) => {
                        plain_scene.materials[0].base_color_factor = v.extend(1.0)
                    }
                    (DetailMap::Data, Some(v)) => {
                        plain_scene.materials[0].roughness_factor *= v.y;
                        plain_scene.materials[0].metallic_factor *= v.z;
                    }
                    (DetailMap::Normal, Some(v)) => {
                        // The roughness of a material with a surface is in its aniso texels.
                        let rough = 0.8 * 0.8;
                        surface = Some(SurfaceTextures::new(
                            BoundTexture::constant((v * 0.5 + 0.5).extend(1.0).to_array()),
                            BoundTexture::constant([rough, 0.5, rough, 1.0]),
                        ));
                    }
                    (DetailMap::Aniso, Some(v)) => {
                        surface = Some(SurfaceTextures::new(
                            BoundTexture::constant([0.5, 0.5, 1.0, 1.0]),
                            BoundTexture::constant(v.extend(1.0).to_array()),
                        ));
                    }
                }
                let wanted = RenderScene::new(&plain_scene, vec![surface], None).unwrap();
                let eye = vec3(0.3, 0.5, 3.0);
                let (got, wanted) = (drawn(&blended, 3, eye, 1), drawn(&wanted, 3, eye, 1));
                for (got, wanted) in got.pixels.iter().zip(&wanted.pixels) {
                    let (got, wanted) = (Vec3::from(*got), Vec3::from(*wanted));
                    assert!(
                        (got - wanted).abs().max_element() < 2e-4,
                        "{map:?}, {mode:?}, layers {on:?}: wanted {wanted}, got {got}"
                    );
                }
            }
        }
    }
}

/// IEC 61966-2-1.
fn from_srgb(code: f32) -> f32 {
    if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

#[test]
fn tiles_lie_where_their_transform_and_the_scale_s_slider_say() {
    let mut pictures = Pictures(Vec::new());
    // A tile whose left half is black, over a synthesized map that asks for nothing.
    let mut detail = Detail::default();
    detail.maps[0] = pictures.add(1, Wrap::Repeat, |_, _| [128, 128, 128, 255]);
    let transform = LayerTransform { scale: vec2(1.0, 1.0), ..LayerTransform::default() };
    let mut layer = DetailLayer { transform, ..DetailLayer::default() };
    layer.tiles[0] = pictures.add(64, Wrap::Repeat, |x, _| if x < 32 { [0, 0, 0, 255] } else { [255; 4] });
    detail.layers.push(layer);
    let scene = of(Some(detail), &pictures);
    let mut prepared = RenderScene::new(&scene, vec![None], None).unwrap();
    let halves = |prepared: &RenderScene| {
        let film = drawn(prepared, 16, vec3(0.0, 0.0, 3.2), 4);
        let row = &film.pixels[8 * 16..9 * 16];
        [row[3][0], row[6][0], row[10][0], row[12][0]].map(|v| v > 0.3)
    };
    assert_eq!(halves(&prepared), [false, false, true, true]);
    prepared.materials[0].detail.as_mut().unwrap().tile_scale = 2.0;
    assert_eq!(halves(&prepared), [false, true, false, true]);
}

#[cfg(feature = "gpu")]
mod realtime {
    use kinran_render::realtime::{Gpu, Realtime, Settings as GpuSettings, ShaderSource};
    use kinran_render::reference::TextureFiltering;
    use kinran_scene::AlphaMode;

    use super::*;

    /// All four maps, three layers, everything that a layer may say.
    fn everything() -> RenderScene {
        let mut pictures = Pictures(Vec::new());
        let pattern = |seed: u32, low: u32, range: u32| {
            move |x: u32, y: u32| {
                let at = |k: u32| {
                    let wave = ((x * (k + 1) + seed) as f32 * 0.45).sin()
                        * ((y * (3 - k) + seed) as f32 * 0.31).cos();
                    (low as f32 + range as f32 * (0.5 + 0.5 * wave)) as u8
                };
                [at(0), at(1), at(2), at(1)]
            }
        };
        let mut detail =
            Detail { aniso_alpha: 0.4, channels: [Some(2), Some(0), Some(1)], ..Detail::default() };
        for map in DetailMap::ALL {
            let (low, range) = if map == DetailMap::Normal { (90, 76) } else { (60, 150) };
            let seed = map as u32;
            detail.maps[map as usize] = pictures.add(32, Wrap::Repeat, pattern(seed, low, range));
        }
        let transforms = [
            LayerTransform { scale: Vec2::splat(2.0), ..LayerTransform::default() },
            LayerTransform { scale: vec2(1.5, 2.5), rotation: 0.5, offset: vec2(0.3, 0.1), mirror: true },
            LayerTransform { scale: vec2(-1.0, 3.0), rotation: -1.2, ..LayerTransform::default() },
        ];
        for (i, transform) in transforms.into_iter().enumerate() {
            let seed = 7 * i as u32;
            let mut layer =
                DetailLayer { transform, hsv: vec3(0.1 * i as f32, 0.8, 1.1), ..DetailLayer::default() };
            let wrap = if transform.mirror { Wrap::Mirror } else { Wrap::Repeat };
            for map in DetailMap::ALL {
                // The last layer has no normals.
                if i < 2 || map != DetailMap::Normal {
                    let (low, range) = if map == DetailMap::Normal { (90, 76) } else { (40, 190) };
                    layer.tiles[map as usize] =
                        pictures.add(16, wrap, pattern(seed + map as u32, low, range));
                }
            }
            layer.mask = (i > 0).then(|| DetailMask {
                texture: pictures.add(16, Wrap::Repeat, pattern(seed + 5, 0, 255)).unwrap(),
                channel: i + 1,
                contrast: 2.0,
            });
            detail.layers.push(layer);
        }
        RenderScene::new(&of(Some(detail), &pictures), vec![None], None).unwrap()
    }

    #[test]
    fn both_renderers_blend_the_same_maps() {
        let gpu = Gpu::open().expect("lavapipe will do: apt install mesa-vulkan-drivers");
        let renderer =
            Realtime::new(&gpu, &ShaderSource::default(), wgpu::TextureFormat::Rgba8Unorm).unwrap();
        let scene = everything();
        let eye = vec3(0.9, 0.6, 2.6);
        let background = Background::Color(Vec3::ZERO);
        let settings = GpuSettings { shadows: false, background, ..GpuSettings::default() };
        let camera = look_at(eye, Vec3::ZERO, Vec3::Y, 0.6);
        let filtering = TextureFiltering::Mips { max_anisotropy: 1 };
        let (size, samples) = (48, 64);
        let mut loaded = renderer.load(&scene, &renderer.light_of(&scene), filtering);
        let agree = |what: &str, wanted: &RenderScene, loaded: &kinran_render::realtime::GpuScene| {
            let got = renderer.film(loaded, &camera, &settings, (size, size), samples, &untold).unwrap();
            let settings = Settings {
                width: size,
                height: size,
                samples_per_pixel: samples,
                filtering,
                env_samples: 0,
                shadows: false,
                background,
                ..Settings::default()
            };
            let wanted = render(wanted, &camera, &settings, &untold).unwrap();
            let mut apart: Vec<f32> = got
                .pixels
                .iter()
                .zip(&wanted.pixels)
                .map(|(a, b)| (Vec3::from(*a) - Vec3::from(*b)).abs().max_element())
                .collect();
            apart.sort_by(f32::total_cmp);
            let brightest = wanted.pixels.as_flattened().iter().fold(0.0_f32, |m, &x| m.max(x));
            let worst = apart[apart.len() * 49 / 50] / brightest;
            // Places between texels are known to 1/256 of one; the square's edge is covered by other samples.
            assert!(brightest > 0.1 && worst < 0.02, "{what}: pixels are {worst} of {brightest} apart");
            wanted.pixels
        };

        let mut seen = Vec::new();
        for (what, change) in [
            ("blended", (|_| {}) as fn(&mut kinran_render::reference::RenderDetail)),
            ("only detail", |d| d.shown = DetailShown::Detail),
            ("synthesized", |d| d.shown = DetailShown::Synthesized),
            ("target", |d| d.shown = DetailShown::Target),
            ("first layer off", |d| d.layers[0].on = false),
            ("last two layers off", |d| (d.layers[1].on, d.layers[2].on) = (false, false)),
            ("finer tiles", |d| d.tile_scale = 1.7),
            ("plain overlay", |d| d.detail.plain_overlay = true),
        ] {
            let mut material = scene.materials[0].clone();
            change(material.detail.as_mut().unwrap());
            loaded.set_material(&gpu, 0, &material, Default::default());
            let wanted = RenderScene { materials: vec![material], ..scene.clone() };
            let picture = agree(what, &wanted, &loaded);
            assert!(!seen.contains(&picture), "{what} looks like another");
            seen.push(picture);
        }

        // Through the G-buffer, and where alpha is that of the synthesized map.
        let mut round = scene.clone();
        let detail = round.materials[0].detail.as_mut().unwrap();
        detail.maps[DetailMap::Aniso as usize] = None;
        agree("deferred", &round, &renderer.load(&round, &renderer.light_of(&round), filtering));
        round.materials[0].alpha_mode = AlphaMode::Blend;
        agree("blended by alpha", &round, &renderer.load(&round, &renderer.light_of(&round), filtering));
    }

    #[test]
    fn a_tile_s_own_levels_are_drawn() {
        // Of a texture whose levels have nothing to do with each other, the first is not seen from afar.
        let levels = (0..4).map(|level| {
            let side = 8_u32 >> level;
            let texel = if level == 0 { [1.0, 0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0, 1.0] };
            kinran_render::reference::MipLevel {
                width: side,
                height: side,
                texels: vec![texel; (side * side) as usize],
            }
        });
        let texture = MipTexture { levels: levels.collect(), wrap: [Wrap::Repeat; 2], encoded: None };
        let mut pictures = Pictures(Vec::new());
        let mut detail = Detail::default();
        detail.maps[0] = pictures.add(1, Wrap::Repeat, |_, _| [128, 128, 128, 255]);
        let mut layer = DetailLayer::default();
        layer.transform.scale = Vec2::splat(64.0);
        layer.tiles[0] = pictures.add(1, Wrap::Repeat, |_, _| [255; 4]);
        detail.layers.push(layer);
        let mut scene = RenderScene::new(&of(Some(detail), &pictures), vec![None], None).unwrap();
        scene.materials[0].detail.as_mut().unwrap().layers[0].tiles[0] = Some(Arc::new(texture));
        let film = drawn(&scene, 8, vec3(0.0, 0.0, 3.2), 1);
        let [r, g, _] = film.pixels[8 * 4 + 4];
        assert!(g > 10.0 * r, "red {r}, green {g}");
    }
}
