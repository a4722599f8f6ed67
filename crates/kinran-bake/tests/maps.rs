//! Level 0 of every kind of authored map against scalar formulas in f64.

mod common;

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use common::exact::{V3, beyond, clamped, degrees, dot, exact, m_n, unit};
use common::{Random, Surface, levels_of};
use kinran_bake::aniso::{
    DirectionMap, Filter, Kernel, NormalMap, NormalZ, RoughnessMaps, ScalarMap, SurfaceMaps,
};
use kinran_image::{Channels, Image, Pixels};
use kinran_scene::Wrap;

const ALPHA_MIN: f64 = 1.0 / 255.0;
const WIDTH: u32 = 23;
const HEIGHT: u32 = 5;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Depth {
    Eight,
    Sixteen,
    Float,
}
const DEPTHS: [Depth; 3] = [Depth::Eight, Depth::Sixteen, Depth::Float];

/// Samples in [0, 1] and the image of them.
fn image(seed: u64, (width, height): (u32, u32), channels: Channels, depth: Depth) -> Arc<Image> {
    let mut random = Random::new(seed);
    let count = width as usize * height as usize * channels.count();
    let samples: Vec<f32> = (0..count).map(|_| random.uniform(0.0, 1.0)).collect();
    let pixels = match depth {
        Depth::Eight => Pixels::U8(samples.iter().map(|v| (v * 255.0) as u8).collect()),
        Depth::Sixteen => Pixels::U16(samples.iter().map(|v| (v * 65535.0) as u16).collect()),
        Depth::Float => Pixels::F32(samples),
    };
    Arc::new(Image::new(width, height, channels, pixels).unwrap())
}

/// A channel as a person expects it: grey for all colours, alpha 1 where there is none.
fn sample(image: &Image, x: usize, y: usize, channel: usize) -> f64 {
    let n = image.channels.count();
    let at = match (n, channel) {
        (1 | 3, 3) => return 1.0,
        (2, 3) => 1,
        (1 | 2, _) => 0,
        _ => channel,
    };
    let i = (y * image.width as usize + x) * n + at;
    match &image.pixels {
        Pixels::U8(v) => f64::from(v[i]) / 255.0,
        Pixels::U16(v) => f64::from(v[i]) / 65535.0,
        Pixels::F32(v) => f64::from(v[i]),
    }
}

/// Linear interpolation between texel centres at the centre of texel `(x, y)` of `size`.
fn enlarged(image: &Image, x: usize, y: usize, channel: usize, size: (u32, u32), wrap: Wrap) -> f64 {
    let place = |i: usize, from: u32, to: u32| {
        let p = (i as f64 + 0.5) * f64::from(from) / f64::from(to) - 0.5;
        (p.floor() as i64, p - p.floor(), i64::from(from))
    };
    let (x0, fx, w) = place(x, image.width, size.0);
    let (y0, fy, h) = place(y, image.height, size.1);
    let at = |dx, dy| sample(image, beyond(x0 + dx, w, wrap), beyond(y0 + dy, h, wrap), channel);
    (at(0, 0) * (1.0 - fx) + at(1, 0) * fx) * (1.0 - fy) + (at(0, 1) * (1.0 - fx) + at(1, 1) * fx) * fy
}

fn normal_of(x: f64, y: f64) -> V3 {
    let r = x.hypot(y);
    if r > 1.0 { [x / r, y / r, 0.0] } else { [x, y, (1.0 - r * r).sqrt()] }
}

fn alpha_of(roughness: f64) -> f64 {
    (roughness * roughness).max(ALPHA_MIN)
}

/// Squared roughness in the frame of M_n, for alphas along and across the direction that a renderer gets from
/// the painted one by Gram–Schmidt against the normal.
fn matrix(n: V3, painted: [f64; 2], along: f64, across: f64) -> [f64; 3] {
    let d = [painted[0], painted[1], 0.0];
    let t = unit(std::array::from_fn(|k| d[k] - dot(d, n) * n[k]));
    let m = m_n(n);
    let (x, y) = (dot(t, [m[0][0], m[1][0], m[2][0]]), dot(t, [m[0][1], m[1][1], m[2][1]]));
    let (l1, l2) = (along * along, across * across);
    [l1 * x * x + l2 * y * y, (l1 - l2) * x * y, l1 * y * y + l2 * x * x]
}

fn close(case: &str, texel: usize, got: Surface, n: V3, a: [f64; 3]) {
    let e = exact(got);
    let off = (0..3).map(|k| (e.1[k] - a[k]).abs()).fold(0.0, f64::max);
    assert!(
        degrees(e.0, n) < 0.02 && off < 2e-5,
        "{case}, texel {texel}: wanted normal {n:?} and {a:?}, got {e:?}"
    );
}

fn level_0(normal: NormalMap, roughness: RoughnessMaps, wrap: Wrap) -> Vec<Surface> {
    let maps = SurfaceMaps { normal, roughness, wrap: [wrap; 2], weights: None };
    levels_of(&maps, Filter::Naive, Kernel::Box).swap_remove(0)
}

/// A normal map whose texels stay off the horizon, where the direction's projection is not defined.
fn gentle(seed: u64, depth: Depth) -> Arc<Image> {
    let mut random = Random::new(seed);
    let samples: Vec<f32> = (0..WIDTH * HEIGHT * 3).map(|_| random.uniform(0.25, 0.75)).collect();
    let pixels = match depth {
        Depth::Eight => Pixels::U8(samples.iter().map(|v| (v * 255.0) as u8).collect()),
        Depth::Sixteen => Pixels::U16(samples.iter().map(|v| (v * 65535.0) as u16).collect()),
        Depth::Float => Pixels::F32(samples),
    };
    Arc::new(Image::new(WIDTH, HEIGHT, Channels::Rgb, pixels).unwrap())
}

fn at(i: usize) -> (usize, usize) {
    (i % WIDTH as usize, i / WIDTH as usize)
}

fn gentle_normal(image: &Image, i: usize) -> V3 {
    let (x, y) = at(i);
    normal_of(sample(image, x, y, 0) * 2.0 - 1.0, sample(image, x, y, 1) * 2.0 - 1.0)
}

#[test]
fn normals_are_read_upside_down_or_at_the_wrong_depth() {
    for depth in DEPTHS {
        for channels in [Channels::Rgb, Channels::Rgba] {
            let map = image(7, (WIDTH, HEIGHT), channels, depth);
            for (y_down, scale) in
                [(false, 1.0), (true, 1.0), (false, 0.3), (true, 2.5), (false, -1.0), (false, 0.0)]
            {
                let normal =
                    NormalMap { image: Some(map.clone()), z: NormalZ::Rebuilt, y_down, signed: false, scale };
                let got = level_0(normal, RoughnessMaps::Isotropic(ScalarMap::constant(0.5)), Wrap::Repeat);
                for (i, got) in got.into_iter().enumerate() {
                    let (x, y) = at(i);
                    let gy = sample(&map, x, y, 1) * 2.0 - 1.0;
                    let n = normal_of(sample(&map, x, y, 0) * 2.0 - 1.0, if y_down { -gy } else { gy });
                    let s = f64::from(scale);
                    let wanted = [n[0] * s, n[1] * s, n[2]];
                    // Nothing is left of a normal on the horizon that is scaled by zero.
                    let wanted = if dot(wanted, wanted) > 0.0 { unit(wanted) } else { [0.0, 0.0, 1.0] };
                    close(
                        &format!("{depth:?} {channels:?} y_down {y_down} scale {scale}"),
                        i,
                        got,
                        wanted,
                        [0.0625, 0.0, 0.0625],
                    );
                }
            }
        }
    }
}

/// glTF 2.0 section 3.9.3: `normalize((2c - 1) * (s, s, 1))`, of vectors of any length; what points into the surface is laid
/// on it.
#[test]
fn blue_is_ignored_or_scaled() {
    for depth in DEPTHS {
        for (channels, y_down, scale) in [
            (Channels::Rgb, false, 1.0),
            (Channels::Rgba, false, 2.0),
            (Channels::Rgb, true, 0.3),
            (Channels::Rgb, false, -1.0),
        ] {
            let map = image(9, (WIDTH, HEIGHT), channels, depth);
            let normal = NormalMap { y_down, ..NormalMap::gltf(map.clone(), scale) };
            let got = level_0(normal, RoughnessMaps::Isotropic(ScalarMap::constant(0.5)), Wrap::Repeat);
            for (i, got) in got.into_iter().enumerate() {
                let (x, y) = at(i);
                let [r, g, b] = [0, 1, 2].map(|c| sample(&map, x, y, c) * 2.0 - 1.0);
                let s = f64::from(scale);
                let wanted = [r * s, if y_down { -g } else { g } * s, b.max(0.0)];
                let what = format!("{depth:?} {channels:?} y_down {y_down} scale {scale}");
                close(&what, i, got, unit(wanted), [0.0625, 0.0, 0.0625]);
            }
        }
    }
    // Two channels have no blue, and no vector is flat.
    let two = Arc::new(Image::new(1, 1, Channels::Rg, Pixels::U8(vec![128, 255])).unwrap());
    let zero = Arc::new(Image::new(1, 1, Channels::Rgb, Pixels::F32(vec![0.5; 3])).unwrap());
    for (map, wanted) in [(two, normal_of(128.0 / 127.5 - 1.0, 128.0 / 127.5 - 1.0)), (zero, [0.0, 0.0, 1.0])]
    {
        let maps = SurfaceMaps {
            normal: NormalMap::gltf(map, 1.0),
            roughness: RoughnessMaps::Isotropic(ScalarMap::constant(0.5)),
            wrap: [Wrap::Repeat; 2],
            weights: None,
        };
        let got = levels_of(&maps, Filter::Naive, Kernel::Box)[0][0];
        close("one texel", 0, got, wanted, [0.0625, 0.0, 0.0625]);
    }
}

#[test]
fn signed_floats_are_taken_for_unsigned_ones() {
    let mut random = Random::new(8);
    let samples: Vec<f32> = (0..WIDTH * HEIGHT * 3).map(|_| random.uniform(-0.9, 0.9)).collect();
    let map = Arc::new(Image::new(WIDTH, HEIGHT, Channels::Rgb, Pixels::F32(samples)).unwrap());
    for y_down in [false, true] {
        let normal = NormalMap::new(map.clone(), y_down);
        assert!(normal.signed, "negative samples are not seen");
        let got = level_0(normal, RoughnessMaps::Isotropic(ScalarMap::constant(1.0)), Wrap::Repeat);
        for (i, got) in got.into_iter().enumerate() {
            let (x, y) = at(i);
            let gy = sample(&map, x, y, 1);
            let n = normal_of(sample(&map, x, y, 0), if y_down { -gy } else { gy });
            close("signed", i, got, n, [1.0, 0.0, 1.0]);
        }
    }
    assert!(!NormalMap::new(image(1, (2, 2), Channels::Rgb, Depth::Float), false).signed);
}

#[test]
fn roughness_is_squared_once_too_often_or_read_from_another_channel() {
    for depth in DEPTHS {
        for channels in [Channels::R, Channels::Rg, Channels::Rgb, Channels::Rgba] {
            let map = image(9, (WIDTH, HEIGHT), channels, depth);
            for channel in 0..4 {
                for factor in [1.0, 0.5, 3.0] {
                    let roughness =
                        RoughnessMaps::Isotropic(ScalarMap { image: Some((map.clone(), channel)), factor });
                    for (i, got) in
                        level_0(NormalMap::flat(), roughness, Wrap::Repeat).into_iter().enumerate()
                    {
                        let (x, y) = at(i);
                        let alpha = alpha_of((sample(&map, x, y, channel) * f64::from(factor)).min(1.0));
                        let wanted = [alpha * alpha, 0.0, alpha * alpha];
                        close(
                            &format!("{depth:?} {channels:?}[{channel}] {factor}"),
                            i,
                            got,
                            [0.0, 0.0, 1.0],
                            wanted,
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn gloss_is_laid_across_its_direction() {
    for depth in DEPTHS {
        let size = (WIDTH, HEIGHT);
        let (normal, u, v) =
            (gentle(1, depth), image(2, size, Channels::R, depth), image(3, size, Channels::Rgb, depth));
        let grey = image(4, size, Channels::R, depth);
        let vectors = image(5, size, Channels::Rgb, depth);
        let angle = |span| Some(DirectionMap::Angle { map: ScalarMap::channel(grey.clone(), 0), span });
        for (name, direction) in [
            ("none", None),
            ("angle of a turn", angle(TAU)),
            ("angle of half a turn", angle(PI)),
            ("vector", Some(DirectionMap::Vector(vectors.clone()))),
        ] {
            let roughness = RoughnessMaps::Gloss {
                u: ScalarMap::channel(u.clone(), 0),
                v: ScalarMap::channel(v.clone(), 2),
                direction,
            };
            let got = level_0(NormalMap::new(normal.clone(), false), roughness, Wrap::Repeat);
            for (i, got) in got.into_iter().enumerate() {
                let (x, y) = at(i);
                let n = gentle_normal(&normal, i);
                let turn = |span: f32| {
                    let phi = sample(&grey, x, y, 0) * f64::from(span);
                    [phi.cos(), phi.sin()]
                };
                let painted = match name {
                    "none" => [1.0, 0.0],
                    "angle of a turn" => turn(TAU),
                    "angle of half a turn" => turn(PI),
                    _ => [0, 1].map(|c| sample(&vectors, x, y, c) * 2.0 - 1.0),
                };
                let along = alpha_of(1.0 - sample(&u, x, y, 0));
                let across = alpha_of(1.0 - sample(&v, x, y, 2));
                close(&format!("{depth:?}, direction: {name}"), i, got, n, matrix(n, painted, along, across));
            }
        }
    }
}

#[test]
fn khr_rotation_turns_the_wrong_way() {
    for depth in DEPTHS {
        let size = (WIDTH, HEIGHT);
        let (normal, orm, texture) =
            (gentle(1, depth), image(2, size, Channels::Rgb, depth), image(3, size, Channels::Rgb, depth));
        for (strength, rotation, textured) in
            [(1.0, 0.0, true), (0.7, 0.0, false), (0.6, 0.5, true), (1.0, -2.0, true), (0.9, PI / 2.0, false)]
        {
            let roughness = RoughnessMaps::Khr {
                roughness: ScalarMap { image: Some((orm.clone(), 1)), factor: 0.9 },
                strength,
                rotation,
                texture: textured.then(|| texture.clone()),
            };
            let got = level_0(NormalMap::new(normal.clone(), false), roughness, Wrap::Repeat);
            for (i, got) in got.into_iter().enumerate() {
                let (x, y) = at(i);
                let n = gentle_normal(&normal, i);
                let (d, s) = if textured {
                    let d = [0, 1].map(|c| sample(&texture, x, y, c) * 2.0 - 1.0);
                    (d, sample(&texture, x, y, 2) * f64::from(strength))
                } else {
                    ([1.0, 0.0], f64::from(strength))
                };
                let (sin, cos) = f64::from(rotation).sin_cos();
                let painted = [cos * d[0] - sin * d[1], sin * d[0] + cos * d[1]];
                let across = alpha_of(sample(&orm, x, y, 1) * f64::from(0.9_f32));
                let along = across + (1.0 - across) * s * s;
                let case = format!("{depth:?} strength {strength} rotation {rotation} textured {textured}");
                close(&case, i, got, n, matrix(n, painted, along, across));
            }
        }
    }
}

#[test]
fn encoded_maps_lose_their_correlation() {
    for depth in DEPTHS {
        let map = image(6, (WIDTH, HEIGHT), Channels::Rgb, depth);
        let got = level_0(NormalMap::flat(), RoughnessMaps::Encoded(map.clone()), Wrap::Repeat);
        for (i, got) in got.into_iter().enumerate() {
            let (x, y) = at(i);
            let [a, rho, b] = [0, 1, 2].map(|c| sample(&map, x, y, c));
            let (a, b) = (a.max(ALPHA_MIN), b.max(ALPHA_MIN));
            close(
                &format!("{depth:?}"),
                i,
                got,
                [0.0, 0.0, 1.0],
                clamped([a * a, a * b * (2.0 * rho - 1.0), b * b]),
            );
        }
    }
}

/// Every map smaller than the largest is enlarged by linear interpolation, also over the border.
#[test]
fn small_maps_are_stretched_by_half_a_texel() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        for depth in DEPTHS {
            let normal = gentle(1, depth);
            for small in [(7, 3), (1, 1), (1, 5), (23, 2), (11, 5)] {
                for channels in [Channels::R, Channels::Rgb] {
                    let map = image(2, small, channels, depth);
                    let roughness = RoughnessMaps::Isotropic(ScalarMap::channel(map.clone(), 1));
                    let got = level_0(NormalMap::new(normal.clone(), false), roughness, wrap);
                    for (i, got) in got.into_iter().enumerate() {
                        let (x, y) = at(i);
                        let alpha = alpha_of(enlarged(&map, x, y, 1, (WIDTH, HEIGHT), wrap));
                        let case = format!("{wrap:?} {depth:?} {small:?} {channels:?}");
                        close(&case, i, got, gentle_normal(&normal, i), [alpha * alpha, 0.0, alpha * alpha]);
                    }
                }
            }
        }
    }
}

/// 8 bits have no zero: a vector of (127, 128) points nowhere, and the tangent is as good as any.
#[test]
fn directions_without_length_are_nan() {
    for code in [[127, 127, 255], [128, 128, 255], [127, 128, 255]] {
        let texture = Arc::new(Image::new(1, 1, Channels::Rgb, Pixels::U8(code.to_vec())).unwrap());
        let roughness = RoughnessMaps::Khr {
            roughness: ScalarMap::constant(0.3),
            strength: 1.0,
            rotation: 0.0,
            texture: Some(texture),
        };
        let got = level_0(NormalMap::flat(), roughness, Wrap::Repeat)[0];
        close("no direction", 0, got, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0081]);
    }
}
