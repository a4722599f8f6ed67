//! MPix/s of the detail solver on one core, beside a copy of the bytes it touches; and a whole solution with BC1 beside
//! the bare encoder.
//!
//! Run with `cargo bench -p kinran-bake --bench detail`; divan prints "Mitem/s", where an item is a texel.

use divan::Bencher;
use divan::counter::ItemsCount;
use glam::Vec2;
use kinran_bake::detail::{
    DetailOptions, Layer, LayerTransform, MapKind, Target, Tile, TileOptions, solve, synthesize,
};
use kinran_image::{Channels, Encoder, Encoding, Format, Image, Pixels, Preset, encode, untold};

/// Texels along a side of the target.
const SIDE: u32 = 2048;

/// Along a side of the tile.
const TILE: u32 = 512;

fn main() {
    divan::main();
}

/// Slow colours with grain: every texel differs.
fn picture(side: u32, seed: u32) -> Image {
    let mut state = seed;
    let bytes = (0..side * side)
        .flat_map(|i| {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let (x, y, grain) = ((i % side) as f32, (i / side) as f32, (state >> 24) as f32 * 0.2);
            [0.0, 1.0, 2.0]
                .map(|c| (90.0 + 50.0 * ((x * 0.02 + c).sin() + (y * 0.03).cos()) * 0.7 + grain) as u8)
        })
        .collect();
    Image::new(side, side, Channels::Rgb, Pixels::U8(bytes)).unwrap()
}

const BC1: Encoding = Encoding { format: Format::Bc1, encoder: Encoder::Portable, preset: Preset::Normal };

fn tile(kind: MapKind) -> Tile {
    Tile::new(&picture(TILE, 7), TileOptions::new(kind, BC1)).unwrap()
}

fn repeated(tile: &Tile) -> Layer<'_> {
    let scale = Vec2::splat((SIDE / TILE) as f32);
    Layer { transform: LayerTransform { scale, ..LayerTransform::default() }, ..Layer::new(tile) }
}

/// One layer, `s` in 8 bits out, into memory that is there: as bands of a whole solution have it.
#[divan::bench(args = [MapKind::Color, MapKind::Normal, MapKind::Aniso], sample_count = 5, sample_size = 1)]
fn solver(bencher: Bencher, kind: MapKind) {
    let (tile, target) = (tile(kind), Target::new(&picture(SIDE, 1), kind, false).unwrap());
    let options = DetailOptions::new(BC1);
    let mut rgba8 = vec![1; (SIDE * SIDE * 4) as usize];
    bencher
        .counter(ItemsCount::new(SIDE * SIDE))
        .bench_local(|| synthesize(&target, &[repeated(&tile)], &options, 0, &mut rgba8).unwrap());
}

/// What the solver reads of the target in floats, copied.
#[divan::bench(sample_count = 10)]
fn copy_of_the_target(bencher: Bencher) {
    let planes = vec![0.5_f32; (SIDE * SIDE * 3) as usize];
    let mut copy = vec![0.25_f32; planes.len()];
    bencher
        .counter(ItemsCount::new(SIDE * SIDE))
        .bench_local(|| divan::black_box(&mut copy).copy_from_slice(divan::black_box(&planes)));
}

/// Side of the target that is solved whole.
const WHOLE: u32 = 1024;

/// All mips, solved, compressed and chosen, errors measured; `false` keeps the encoder's blocks.
#[divan::bench(args = [false, true], sample_count = 3, sample_size = 1)]
fn whole_solution(bencher: Bencher, choose: bool) {
    let (tile, target) =
        (tile(MapKind::Color), Target::new(&picture(WHOLE, 1), MapKind::Color, false).unwrap());
    let options = DetailOptions { choose, ..DetailOptions::new(BC1) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    bencher
        .counter(ItemsCount::new(WHOLE * WHOLE))
        .bench_local(|| pool.install(|| solve(&target, &[repeated(&tile)], &options, &untold).unwrap()));
}

/// The encoder on the same texels and their mips.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn bare_encoder(bencher: Bencher) {
    let (tile, target) =
        (tile(MapKind::Color), Target::new(&picture(WHOLE, 1), MapKind::Color, false).unwrap());
    let options = DetailOptions::new(BC1);
    let levels: Vec<Vec<u8>> = (0..target.levels.len())
        .map(|level| {
            let mut rgba8 = Vec::new();
            synthesize(&target, &[repeated(&tile)], &options, level, &mut rgba8).unwrap();
            rgba8
        })
        .collect();
    bencher.counter(ItemsCount::new(WHOLE * WHOLE)).bench_local(|| {
        for (planes, bytes) in target.levels.iter().zip(&levels) {
            divan::black_box(encode(BC1, bytes, planes.width, planes.height).unwrap());
        }
    });
}
