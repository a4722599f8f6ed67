//! What is stored decodes to what was filtered, and the errors that the report states are the errors made.
#![allow(clippy::print_stdout, reason = "measured numbers, and what was skipped")]

mod common;

use std::sync::Arc;

use common::exact::{Exact, V3, alphas, box_weights, degrees, exact, ggx_d, sggx, unit};
use common::{Random, Surface, filtered, levels_of, maps_of};
use glam::{Vec3, vec2, vec3};
use kinran_bake::aniso::{
    Filter, Kernel, NormalMap, RoughnessMaps, ScalarMap, Sheet, SheetRequest, SurfaceMaps, SurfaceOptions,
    bake_surface, decode_aniso, decode_khr, ndf_error,
};
use kinran_image::{Channels, Encoder, Encoding, Format, Image, Pixels, Preset, untold};
use kinran_scene::Wrap;
use kinran_shading::{Sym2, aniso_from_alphas};

const PLAIN: Encoding = Encoding { format: Format::Rgba8, encoder: Encoder::Portable, preset: Preset::Fast };

fn to_8_bits(v: [f32; 3]) -> [f32; 4] {
    let [r, g, b] = v.map(|v| (v * 255.0).round() / 255.0);
    [r, g, b, 1.0]
}

fn surfaces(count: usize, slope: f32) -> Vec<Surface> {
    let mut random = Random::new(21);
    (0..count).map(|_| random.texel((0.03, 0.95), slope)).collect()
}

/// Angle between the axes of the larger roughness, degrees.
fn turned(a: Exact, b: Exact) -> f64 {
    let axis = |a: [f64; 3]| 0.5 * (2.0 * a[1]).atan2(a[0] - a[2]);
    let d = (axis(a.1) - axis(b.1)).rem_euclid(std::f64::consts::PI);
    d.min(std::f64::consts::PI - d).to_degrees()
}

/// Unrounded texels decode to what they were made of; a correlation within a tenth of a step of zero is moved to
/// there, which is all the room that is left.
#[test]
fn decoding_is_not_the_inverse_of_encoding() {
    for (n, a) in surfaces(2000, 0.4) {
        let texel = |sheet: Sheet| {
            let [r, g, b] = sheet.encode(n, a);
            [r, g, b, 1.0]
        };
        let wanted = exact((n, a));
        for (name, got) in [
            ("aniso", decode_aniso(texel(Sheet::Normal), texel(Sheet::Aniso))),
            (
                "KHR",
                decode_khr(
                    texel(Sheet::Normal),
                    texel(Sheet::Roughness)[1],
                    Some(texel(Sheet::KhrAnisotropy)),
                ),
            ),
        ] {
            let got = exact(got);
            let (w, g) = (alphas(wanted.1), alphas(got.1));
            let clear = w[0] > 1.1 * w[1];
            assert!(
                degrees(wanted.0, got.0) < 0.05
                    && (w[0] - g[0]).abs() < 5e-4
                    && (w[1] - g[1]).abs() < 5e-4
                    && (!clear || turned(wanted, got) < 0.3),
                "{name}: wanted {wanted:?} {w:?}, got {got:?} {g:?}"
            );
        }
    }
}

/// Eight bits: both alphas of `KHR_materials_anisotropy` within what half a step of its two numbers makes of
/// them, the direction within 0.5° of where an exact normal would turn it.
#[test]
fn khr_textures_lose_more_than_8_bits() {
    let mut worst = [0.0_f64; 3];
    for (n, a) in surfaces(5000, 0.2) {
        let normal = Sheet::Normal.encode(n, a);
        let (r, k) = (to_8_bits(Sheet::Roughness.encode(n, a)), to_8_bits(Sheet::KhrAnisotropy.encode(n, a)));
        let (wanted, got) =
            (exact((n, a)), exact(decode_khr([normal[0], normal[1], normal[2], 1.0], r[1], Some(k))));
        let (w, g) = (alphas(wanted.1), alphas(got.1));
        // d(r²) = 2 r dr, d(b + (1 - b) s²) = (1 - s²) db + 2 (1 - b) s ds, with dr = ds = 1/510, and second
        // order.
        let half = 0.5 / 255.0;
        let s = ((w[0] - w[1]) / (1.0 - w[1])).max(0.0).sqrt();
        let b_bound = 2.0 * w[1].sqrt() * half + half * half + 1e-5;
        let t_bound = (1.0 - s * s) * b_bound + (1.0 - w[1]) * (2.0 * s * half + half * half) + 1e-5;
        assert!(
            (w[0] - g[0]).abs() <= t_bound && (w[1] - g[1]).abs() <= b_bound,
            "wanted {w:?}, got {g:?}, allowed {t_bound} and {b_bound}"
        );
        let angle = if w[0] > 1.2 * w[1] { turned(wanted, got) } else { 0.0 };
        assert!(angle < 0.5, "axis {angle} degrees off: wanted {wanted:?}, got {got:?}");
        worst = [worst[0].max((w[0] - g[0]).abs()), worst[1].max((w[1] - g[1]).abs()), worst[2].max(angle)];
    }
    println!(
        "largest errors: alpha_t {:.4}, alpha_b {:.4}, axis {:.2} degrees",
        worst[0], worst[1], worst[2]
    );
}

#[test]
fn the_isotropic_roughness_is_not_the_mean_of_squares() {
    for (n, a) in surfaces(500, 0.2) {
        let roughness = f64::from(Sheet::IsotropicRoughness.encode(n, a)[1]);
        let (_, got) = decode_khr([0.5, 0.5, 1.0, 1.0], roughness as f32, None);
        let wanted = 0.5 * (f64::from(a.xx) + f64::from(a.yy));
        assert!((roughness.powi(4) - wanted).abs() < 1e-5, "wanted {wanted}, got {}", roughness.powi(4));
        assert!((f64::from(got.xx) - wanted).abs() < 1e-5 && got.xx == got.yy && got.xy == 0.0, "{got:?}");
    }
}

fn noise(seed: u64, width: u32, height: u32, channels: Channels) -> Arc<Image> {
    let mut random = Random::new(seed);
    let count = (width * height) as usize * channels.count();
    let samples = (0..count).map(|_| random.uniform(0.0, 256.0) as u8).collect();
    Arc::new(Image::new(width, height, channels, Pixels::U8(samples)).unwrap())
}

/// Red, blue and alpha as they were on level 0 and averaged, rounded once, from there on; green at level 0 as
/// authored where it is not smoother than anything is shaded.
#[test]
fn packed_channels_are_lost() {
    for (width, height) in [(16_u32, 16_u32), (11, 6)] {
        let orm = noise(4, width, height, Channels::Rgba);
        let maps = SurfaceMaps {
            normal: NormalMap::new(noise(5, width, height, Channels::Rgb), false),
            roughness: RoughnessMaps::Isotropic(ScalarMap::channel(orm.clone(), 1)),
            wrap: [Wrap::Repeat; 2],
            weights: None,
        };
        for sheet in [Sheet::Roughness, Sheet::IsotropicRoughness] {
            for format in [Format::Rgba8, Format::Rgba16F] {
                let request =
                    SheetRequest { sheet, encoding: Encoding { format, ..PLAIN }, packed_with: Some(&orm) };
                let baked = bake_surface(&maps, SurfaceOptions::default(), &[request], &untold).unwrap();
                let (columns, rows) = (box_weights(width as usize), box_weights(height as usize));
                for level in 0..baked.textures[0].levels.len() {
                    let texels = baked.textures[0].decode_level(level).unwrap();
                    for (i, got) in texels.iter().enumerate() {
                        let (x, y) = (i % columns[level].len(), i / columns[level].len());
                        let mut mean = [0.0; 4];
                        for (v, wy) in rows[level][y].iter().enumerate() {
                            for (u, wx) in columns[level][x].iter().enumerate() {
                                let texel = orm.texel(u as u32, v as u32);
                                (0..4).for_each(|c| mean[c] += wx * wy * 255.0 * f64::from(texel[c]));
                            }
                        }
                        for channel in [0, 2, 3] {
                            let got = f64::from(got[channel]) * 255.0;
                            let allowed = if level == 0 { 0.07 } else { 0.58 };
                            assert!(
                                (got - mean[channel]).abs() < allowed,
                                "{width}x{height} {format:?} level {level} ({x}, {y}), channel {channel}: wanted \
                                 {mean:?}, got {got}"
                            );
                        }
                        if level == 0 {
                            let (got, wanted) =
                                (f64::from(got[1]) * 255.0, mean[1].max(255.0 * (1.0_f64 / 255.0).sqrt()));
                            assert!(
                                (got - wanted).abs() < 0.58,
                                "green of ({x}, {y}): wanted {wanted}, got {got}"
                            );
                        }
                    }
                }
            }
        }
    }
}

/// The numbers of the report, from the textures as a reader of files sees them.
#[test]
fn reported_errors_are_not_those_made() {
    let mut random = Random::new(31);
    let texels: Vec<Surface> = (0..32 * 24).map(|_| random.texel((0.05, 0.6), 0.2)).collect();
    let maps = maps_of(&texels, 32, Wrap::Repeat);
    let request =
        |sheet, format| SheetRequest { sheet, encoding: Encoding { format, ..PLAIN }, packed_with: None };
    for khr in [false, true] {
        let requests = if khr {
            vec![
                request(Sheet::Normal, Format::Bc5),
                request(Sheet::Roughness, Format::Bc7),
                request(Sheet::KhrAnisotropy, Format::Bc7),
            ]
        } else {
            vec![request(Sheet::Normal, Format::Bc5), request(Sheet::Aniso, Format::Bc7)]
        };
        for filter in [Filter::Ml, Filter::Linear] {
            let options = SurfaceOptions { filter, kernel: Kernel::Box };
            let baked = bake_surface(&maps, options, &requests, &untold).unwrap();
            for (level, filtered) in levels_of(&maps, filter, Kernel::Box).iter().enumerate() {
                let stored: Vec<_> = baked.textures.iter().map(|t| t.decode_level(level).unwrap()).collect();
                let (mut angle, mut largest, mut t, mut b) = (0.0, 0.0_f64, 0.0, 0.0);
                for (i, texel) in filtered.iter().enumerate() {
                    let got = exact(if khr {
                        decode_khr(stored[0][i], stored[1][i][1], Some(stored[2][i]))
                    } else {
                        decode_aniso(stored[0][i], stored[1][i])
                    });
                    let wanted = exact(*texel);
                    let d = degrees(wanted.0, got.0);
                    let (w, g) = (alphas(wanted.1), alphas(got.1));
                    (angle, largest) = (angle + d * d, largest.max(d));
                    (t, b) = (t + (w[0] - g[0]).powi(2), b + (w[1] - g[1]).powi(2));
                }
                let rms = |sum: f64| (sum / filtered.len() as f64).sqrt();
                let e = baked.levels[level];
                for (name, wanted, got) in [
                    ("normal_rms_degrees", rms(angle), e.normal_rms_degrees),
                    ("normal_max_degrees", largest, e.normal_max_degrees),
                    ("alpha_t_rms", rms(t), e.alpha_t_rms),
                    ("alpha_b_rms", rms(b), e.alpha_b_rms),
                ] {
                    let off = (wanted - f64::from(got)).abs();
                    assert!(
                        off < 1e-4 + 1e-3 * wanted,
                        "{filter:?} level {level} {name}: wanted {wanted}, got {got}"
                    );
                }
                assert_eq!((e.width, e.height), ((32 >> level).max(1), (24 >> level).max(1)));
            }
        }
    }
}

/// Levels 1 and 2 of a small texture have few enough texels that all of them are probed, with all of their
/// footprint.
#[test]
fn the_filters_reported_error_is_of_other_footprints() {
    let mut random = Random::new(32);
    let texels: Vec<Surface> = (0..8 * 8).map(|_| random.texel((0.05, 0.6), 0.2)).collect();
    let maps = maps_of(&texels, 8, Wrap::Repeat);
    let request = SheetRequest { sheet: Sheet::Aniso, encoding: PLAIN, packed_with: None };
    let baked = bake_surface(&maps, SurfaceOptions::default(), &[request], &untold).unwrap();
    let levels = levels_of(&maps, Filter::Ml, Kernel::Box);
    assert_eq!(baked.levels[0].ndf_l2, 0.0);
    for level in 1..4 {
        let (side, width) = (1 << level, 8 >> level);
        let sum: f64 = (0..width * width)
            .map(|i| {
                let (x, y) = (i % width * side, i / width * side);
                let footprint: Vec<Surface> =
                    (0..side * side).map(|j| levels[0][(y + j / side) * 8 + x + j % side]).collect();
                f64::from(ndf_error(&footprint, levels[level][i])).powi(2)
            })
            .sum();
        let (wanted, got) = ((sum / (width * width) as f64).sqrt(), f64::from(baked.levels[level].ndf_l2));
        assert!((wanted - got).abs() < 1e-4, "level {level}: wanted {wanted}, got {got}");
    }
}

/// `sqrt(∫ (D' - D)² h.z dω / ∫ D² h.z dω)` on a grid of slopes that crowds where lobes are narrow.
fn dense_error(texels: &[Exact], fit: Exact) -> f64 {
    const RINGS: usize = 300;
    const SECTORS: usize = 360;
    // The smallest roughness that is shaded, as in the estimate.
    let floored = |(n, a): Exact| (n, sggx((n, [a[0] + 1e-7, a[1], a[2] + 1e-7])));
    let lobes: Vec<_> = texels.iter().map(|t| floored(*t)).collect();
    let fitted = floored(fit);
    let d = |(n, s): (V3, common::exact::M3), h: V3| {
        if common::exact::dot(n, h) > 0.0 { ggx_d(s, h) } else { 0.0 }
    };
    let (mut error, mut norm) = (0.0, 0.0);
    for ring in 0..RINGS {
        let t = (ring as f64 + 0.5) / RINGS as f64;
        let (r, dr) = (0.3 * t / (1.0 - t), 0.3 / ((1.0 - t) * (1.0 - t)) / RINGS as f64);
        for sector in 0..SECTORS {
            let phi = std::f64::consts::TAU * (sector as f64 + 0.5) / SECTORS as f64;
            let h = unit([r * phi.cos(), r * phi.sin(), 1.0]);
            let mean = lobes.iter().map(|l| d(*l, h)).sum::<f64>() / lobes.len() as f64;
            let difference = d(fitted, h) - mean;
            // h.z dω = h.z⁴ r dr dφ
            let weight = h[2].powi(4) * r * dr;
            error += difference * difference * weight;
            norm += mean * mean * weight;
        }
    }
    (error / norm).sqrt()
}

#[test]
fn the_estimate_of_the_lobes_error_strays_from_quadrature() {
    let mut random = Random::new(33);
    let iso = |a: f32| (Vec3::Z, Sym2::scalar(a * a));
    let tilted = |degrees: f32, a: f32| {
        let (s, c) = degrees.to_radians().sin_cos();
        (vec3(s, 0.0, c), Sym2::scalar(a * a))
    };
    let crossed = |x: f32, y: f32| (Vec3::Z, aniso_from_alphas(0.4, 0.1, vec2(x, y)));
    let mut cases: Vec<(String, Vec<Surface>)> = vec![
        ("alpha 0.1 and 0.3".into(), vec![iso(0.1), iso(0.3)]),
        ("alpha 0.2 and 0.3".into(), vec![iso(0.2), iso(0.3)]),
        ("V groove of 10 degrees".into(), vec![tilted(10.0, 0.1), tilted(-10.0, 0.1)]),
        ("cross".into(), vec![crossed(1.0, 0.0), crossed(0.0, 1.0)]),
        ("constant".into(), vec![tilted(20.0, 0.3), tilted(20.0, 0.3)]),
    ];
    for (name, alpha, slope) in
        [("metal", (0.1, 0.3), 0.1), ("cloth", (0.3, 0.6), 0.15), ("strong normals", (0.15, 0.5), 0.3)]
    {
        for k in 0..4 {
            cases.push((format!("{name} {k}"), (0..16).map(|_| random.texel(alpha, slope)).collect()));
        }
    }
    for (name, texels) in &cases {
        // Two flat lobes give 32 samples, too few for their tails.
        let allowed = if texels.len() == 2 { 0.22 } else { 0.1 };
        for filter in [Filter::Ml, Filter::Linear, Filter::Naive] {
            let fit = filtered(texels, texels.len() as u32, filter);
            let all: Vec<Exact> = texels.iter().map(|t| exact(*t)).collect();
            let (wanted, got) = (dense_error(&all, exact(fit)), f64::from(ndf_error(texels, fit)));
            println!("{name}, {}: wanted {wanted:.4}, got {got:.4}", filter.name());
            assert!(
                (got - wanted).abs() < 1e-3 + allowed * wanted,
                "{name}, {}: wanted {wanted}, got {got}",
                filter.name()
            );
        }
    }
}
