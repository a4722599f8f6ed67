//! The same input gives the same bytes, however the work is shared out.

mod common;

use std::sync::Arc;

use common::Random;
use glam::Vec3;
use kinran_bake::aniso::{
    ColorMap, Dielectric, DirectionMap, Filter, Kernel, NormalMap, Reflectance, ReflectanceMaps,
    RoughnessMaps, ScalarMap, Sheet, SheetRequest, SurfaceMaps, SurfaceOptions, bake_surface,
};
use kinran_image::{Channels, Encoder, Encoding, Format, Image, Pixels, Preset, Texture, untold};
use kinran_scene::Wrap;

fn noise(seed: u64, width: u32, height: u32) -> Arc<Image> {
    let mut random = Random::new(seed);
    let samples = (0..width * height * 3).map(|_| random.uniform(64.0, 192.0) as u8).collect();
    Arc::new(Image::new(width, height, Channels::Rgb, Pixels::U8(samples)).unwrap())
}

fn maps(width: u32, height: u32) -> SurfaceMaps {
    SurfaceMaps {
        normal: NormalMap::new(noise(1, width, height), false),
        roughness: RoughnessMaps::Gloss {
            u: ScalarMap::channel(noise(2, width, height), 0),
            v: ScalarMap::channel(noise(3, width, height), 1),
            direction: Some(DirectionMap::Vector(noise(4, width, height))),
        },
        wrap: [Wrap::Repeat; 2],
        weights: None,
    }
}

fn reflectance(width: u32, height: u32) -> Reflectance {
    Reflectance {
        maps: ReflectanceMaps::Metallic {
            base: ColorMap { image: Some(noise(5, width, height)), factor: Vec3::ONE },
            metallic: ScalarMap::channel(noise(6, width / 2, height / 2), 0),
            dielectric: Dielectric::default(),
        },
        wrap: [Wrap::Repeat; 2],
    }
}

/// The first `rows` rows of an image.
fn top(image: &Image, rows: u32) -> Arc<Image> {
    let Pixels::U8(samples) = &image.pixels else { panic!("8 bits") };
    let samples = samples[..(image.width * rows * 3) as usize].to_vec();
    Arc::new(Image::new(image.width, rows, Channels::Rgb, Pixels::U8(samples)).unwrap())
}

fn requests(encoder: Encoder, packed: &Image) -> [SheetRequest<'_>; 4] {
    let request = |sheet, format, packed_with| SheetRequest {
        sheet,
        encoding: Encoding { format, encoder, preset: Preset::Fast },
        packed_with,
    };
    [
        request(Sheet::Normal, Format::Bc5, None),
        request(Sheet::Aniso, Format::Bc7, None),
        request(Sheet::Roughness, Format::Bc7, Some(packed)),
        request(Sheet::KhrAnisotropy, Format::Rgba16F, None),
    ]
}

#[test]
fn bytes_depend_on_the_number_of_threads() {
    let packed = noise(9, 70, 50);
    for encoder in [Encoder::Portable, Encoder::Ispc] {
        for (filter, is_weighted) in Filter::ALL.into_iter().flat_map(|f| [(f, false), (f, true)]) {
            let kernel = if filter == Filter::Param { Kernel::Tent } else { Kernel::Box };
            let bake = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let options = SurfaceOptions { filter, kernel };
                pool.install(|| {
                    let weights = is_weighted.then(|| reflectance(70, 50).weights((70, 50))).flatten();
                    let maps = SurfaceMaps { weights: weights.map(Arc::new), ..maps(70, 50) };
                    bake_surface(&maps, options, &requests(encoder, &packed), &untold).unwrap()
                })
            };
            let one = bake(1);
            for threads in [2, 3, 8] {
                let many = bake(threads);
                let what = format!("{encoder:?} {filter:?}, weighted {is_weighted}: {threads} threads");
                assert!(one.textures == many.textures, "{what}, other bytes");
                assert_eq!(one.levels, many.levels, "{what}");
            }
        }
    }
}

/// Rows that see the same texels have the same bytes, whatever lies below them.
#[test]
fn a_row_depends_on_rows_below_its_footprint() {
    let all = maps(64, 128);
    let RoughnessMaps::Gloss { u, v, direction: Some(DirectionMap::Vector(direction)) } = &all.roughness
    else {
        panic!("maps() makes gloss")
    };
    let half = |image: &Arc<Image>| top(image, 64);
    let scalar = |map: &ScalarMap| ScalarMap {
        image: map.image.as_ref().map(|(image, channel)| (half(image), *channel)),
        ..*map
    };
    let upper = SurfaceMaps {
        normal: NormalMap::new(half(all.normal.image.as_ref().unwrap()), false),
        roughness: RoughnessMaps::Gloss {
            u: scalar(u),
            v: scalar(v),
            direction: Some(DirectionMap::Vector(half(direction))),
        },
        wrap: all.wrap,
        weights: None,
    };
    let packed = noise(9, 64, 128);
    let upper_packed = top(&packed, 64);
    for filter in Filter::ALL {
        let options = SurfaceOptions { filter, kernel: Kernel::Box };
        let bake = |maps: &SurfaceMaps, packed: &Image| -> Vec<Texture> {
            bake_surface(maps, options, &requests(Encoder::Portable, packed), &untold).unwrap().textures
        };
        for (whole, part) in bake(&all, &packed).iter().zip(bake(&upper, &upper_packed)) {
            // Whole rows of blocks, down to levels that are one block high.
            for (level, (whole, part)) in whole.levels.iter().zip(&part.levels).enumerate().take(5) {
                assert!(
                    whole.data[..part.data.len()] == part.data,
                    "{filter:?}: level {level} depends on what lies below"
                );
            }
        }
    }
}
