//! Work that is stopped ends soon, with an error, and gives nothing half-done.

mod common;
mod shapes;
#[path = "../../stopping.rs"]
mod stopping;

use std::sync::Arc;

use common::Random;
use glam::Vec3;
use kinran_bake::aniso::{
    ColorMap, Dielectric, Filter, Kernel, NormalMap, Reflectance, ReflectanceMaps, RoughnessMaps, ScalarMap,
    Sheet, SheetRequest, SurfaceMaps, SurfaceOptions, bake_surface,
};
use kinran_bake::curvature::{CurvatureError, Mesh, Method, Options, bake_curvature, estimated_normals};
use kinran_bake::detail::{
    DetailOptions, FADE_TRIALS, Layer, MapKind, Target, Tile, TileOptions, bearable_opacity, compare,
    lowest_resolution, solve,
};
use kinran_bake::metal::{Apart, base_and_metal};
use kinran_bake::skin_lut::{INTERPOLATION_GRID, Profile, punctual_interpolation_error, punctual_table};
use kinran_bake::{bake_cutout, bake_plain, plain_levels};
use kinran_image::{
    Cancelled, Channels, Encoder, Encoding, Error, Format, Image, Pixels, Preset, Transfer, full_level_count,
    level_size,
};
use kinran_scene::Wrap;
use stopping::assert_stops;

/// Higher than three levels of bands, for averages make three levels at a time.
const SIZE: (u32, u32) = (40, 400);

const RGBA8: Encoding = Encoding { format: Format::Rgba8, encoder: Encoder::Portable, preset: Preset::Fast };

fn noise(seed: u64) -> Arc<Image> {
    let mut random = Random::new(seed);
    let samples = (0..SIZE.0 * SIZE.1 * 3).map(|_| random.uniform(64.0, 192.0) as u8).collect();
    Arc::new(Image::new(SIZE.0, SIZE.1, Channels::Rgb, Pixels::U8(samples)).unwrap())
}

/// Texels of a mip chain.
fn texels(size: (u32, u32)) -> u64 {
    (0..full_level_count(size.0, size.1))
        .map(|level| u64::from(level_size(size.0, level)) * u64::from(level_size(size.1, level)))
        .sum()
}

fn of_image(error: &Error) -> bool {
    matches!(error, Error::Cancelled(_))
}

#[test]
fn a_stopped_surface_is_baked_on() {
    let maps = SurfaceMaps {
        normal: NormalMap::new(noise(1), false),
        roughness: RoughnessMaps::Isotropic(ScalarMap::channel(noise(2), 0)),
        wrap: [Wrap::Repeat; 2],
        weights: None,
    };
    let packed = noise(3);
    let request = |sheet, packed_with| SheetRequest { sheet, encoding: RGBA8, packed_with };
    let requests = [request(Sheet::Normal, None), request(Sheet::Roughness, Some(&*packed))];
    // By averages, and footprint by footprint.
    for filter in [Filter::Linear, Filter::Dpd] {
        let options = SurfaceOptions { filter, kernel: Kernel::Box };
        assert_stops(filter.name(), texels(SIZE), of_image, |tick| {
            bake_surface(&maps, options, &requests, tick)
        });
    }
}

#[test]
fn a_stopped_colour_is_baked_on() {
    let image = noise(4);
    let Pixels::U8(samples) = &image.pixels else { panic!("8 bits") };
    let (colors, _) = samples.as_chunks::<3>();
    let samples = colors.iter().flat_map(|[r, g, b]| [*r, *g, *b, *r]).collect();
    let holes = Image::new(SIZE.0, SIZE.1, Channels::Rgba, Pixels::U8(samples)).unwrap();
    let wrap = [Wrap::Repeat; 2];
    assert_stops(
        "levels",
        texels(SIZE),
        |_: &Cancelled| true,
        |tick| plain_levels(&image, SIZE, Transfer::Srgb, Kernel::Tent, wrap, tick),
    );
    assert_stops("texture", texels(SIZE), of_image, |tick| {
        bake_plain(&image, Transfer::Srgb, RGBA8, Kernel::Box, wrap, tick)
    });
    assert_stops("cut-out texture", texels(SIZE), of_image, |tick| {
        bake_cutout(&holes, 0.5, RGBA8, Kernel::Box, wrap, tick)
    });
}

#[test]
fn a_stopped_detail_map_is_solved_on() {
    let bc1 = Encoding { format: Format::Bc1, ..RGBA8 };
    let (image, kind) = (noise(5), MapKind::Color);
    let all = texels(SIZE);
    assert_stops("tile", all, of_image, |tick| Tile::bake(&image, TileOptions::new(kind, bc1), tick));

    let tile = Tile::new(&image, TileOptions::new(kind, bc1)).unwrap();
    let target = Target::new(&noise(6), kind, false).unwrap();
    let layers = [Layer::new(&tile)];
    let options = DetailOptions::new(bc1);
    assert_stops("solution", all, of_image, |tick| solve(&target, &layers, &options, tick));
    // Four solutions, and the target by itself.
    assert_stops("comparison", 5 * all, of_image, |tick| compare(&target, &layers, &options, tick));
    // Nothing is worse than this bound: every resolution is tried.
    let of_level = |level| texels((level_size(SIZE.0, level), level_size(SIZE.1, level)));
    let every = (0..target.levels.len()).map(of_level).sum();
    assert_stops("resolution", every, of_image, |tick| {
        lowest_resolution(&target, &layers, &options, f32::INFINITY, tick)
    });
    // Noise over other noise is not borne, and no halving of it: every opacity is tried.
    let faded = FADE_TRIALS * (all - of_level(2));
    assert_stops("opacity", faded, of_image, |tick| bearable_opacity(&target, &layers, &options, tick));
}

#[test]
fn a_stopped_pair_of_colour_and_metalness_is_chosen_on() {
    let reflectance = Reflectance {
        maps: ReflectanceMaps::Metallic {
            base: ColorMap { image: Some(noise(4)), factor: Vec3::ONE },
            metallic: ScalarMap::channel(noise(5), 0),
            dielectric: Dielectric::default(),
        },
        wrap: [Wrap::Repeat; 2],
    };
    let of_pair = |error: &Apart| matches!(error, Apart::Cancelled(_));
    assert_stops("pairs", texels(SIZE), of_pair, |tick| {
        base_and_metal(&reflectance, SIZE, Kernel::Box, false, tick)
    });
}

#[test]
fn a_stopped_table_of_skin_is_integrated_on() {
    let (width, height, range) = (16, 24, 0.5);
    for (name, profile) in [("Gaussians", Profile::default()), ("Burley", Profile::Burley([1.2, 0.5, 0.3]))] {
        let radial = profile.radial().unwrap();
        let points = (width * height) as u64;
        assert_stops(
            name,
            points,
            |_: &Cancelled| true,
            |tick| punctual_table(radial, width, height, range, tick),
        );
        let table = punctual_table(radial, width, height, range, &kinran_image::untold).unwrap();
        let grid = points * (INTERPOLATION_GRID * INTERPOLATION_GRID) as u64;
        assert_stops(
            &format!("the error of {name}"),
            grid,
            |_: &Cancelled| true,
            |tick| punctual_interpolation_error(radial, &table, range, tick),
        );
    }
}

#[test]
fn a_stopped_curvature_is_baked_on() {
    // More points than two of the pieces that are fitted at a time.
    let torus = shapes::torus((100, 100), 1.0, 0.4, 0.2);
    let triangles = torus.triangles.len() as u64;
    for method in [Method::Normals, Method::Fit] {
        for normals in [Some(&*torus.normals), None] {
            for blur in [vec![], vec![30.0, 10.0]] {
                let name = format!("{method:?}, normals {}, blur {blur:?}", normals.is_some());
                let options = Options { method, millimetres: 100.0, blur, clamp: true };
                let (positions, triangles_of) = (&*torus.positions, &*torus.triangles);
                let mesh = Mesh { positions, normals, tangents: None, triangles: triangles_of };
                let is_cancelled = |e: &CurvatureError| *e == CurvatureError::Cancelled(Cancelled);
                assert_stops(&name, triangles, is_cancelled, |tick| bake_curvature(&mesh, &options, tick));
            }
        }
    }
    assert_stops(
        "estimated normals",
        triangles,
        |_: &Cancelled| true,
        |tick| estimated_normals(&torus.positions, &torus.triangles, tick),
    );
}
