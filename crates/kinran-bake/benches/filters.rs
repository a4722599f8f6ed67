//! MPix/s of level 0 for a full mip chain by every filter, one core, beside a copy of the same bytes.
//!
//! Run with `cargo bench -p kinran-bake --bench filters`; divan prints "Mitem/s", where an item is a texel of level 0.

use std::convert::Infallible;
use std::sync::Arc;

use divan::Bencher;
use divan::counter::ItemsCount;
use kinran_bake::aniso::{Filter, Kernel, NormalMap, RoughnessMaps, SurfaceMaps, coarser_levels};
use kinran_image::{Channels, Image, Pixels};
use kinran_scene::Wrap;

/// Texels along a side.
const SIDE: u32 = 2048;

fn main() {
    divan::main();
}

/// A twill of two thread directions with bumps and noise: every texel differs.
fn surface() -> SurfaceMaps {
    let mut normal = Vec::new();
    let mut aniso = Vec::new();
    let mut state = 1u32;
    for y in 0..SIDE {
        for x in 0..SIDE {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let noise = (state >> 24) as f32 / 255.0 - 0.5;
            let warp = ((x + y) / 8) % 2 == 0;
            let wave = (x as f32 * 0.7).sin() * 0.3 + noise * 0.2;
            let bump = (y as f32 * 0.5).cos() * 0.25 + noise * 0.1;
            let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
            normal.extend([byte(0.5 + 0.5 * wave), byte(0.5 + 0.5 * bump), 255]);
            let (along, across) = (0.5 + 0.1 * noise, 0.15 + 0.05 * noise);
            aniso.extend(if warp {
                [byte(along), byte(0.5 + 0.1 * noise), byte(across)]
            } else {
                [byte(across), byte(0.5 - 0.1 * noise), byte(along)]
            });
        }
    }
    let image = |pixels| Arc::new(Image::new(SIDE, SIDE, Channels::Rgb, Pixels::U8(pixels)).unwrap());
    SurfaceMaps {
        normal: NormalMap::new(image(normal), false),
        roughness: RoughnessMaps::Encoded(image(aniso)),
        wrap: [Wrap::Repeat; 2],
        weights: None,
    }
}

#[divan::bench(args = Filter::ALL.map(Filter::name), sample_count = 3, sample_size = 1)]
fn mip_chain(bencher: Bencher, name: &str) {
    let filter = Filter::ALL.into_iter().find(|f| f.name() == name).unwrap();
    let maps = surface();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    bencher.counter(ItemsCount::new(SIDE * SIDE)).bench_local(|| {
        pool.install(|| {
            coarser_levels(&maps, filter, Kernel::Box, |band| Ok::<_, Infallible>(band.texels.axx[0]))
        })
    });
}

#[divan::bench(sample_count = 10)]
fn copy_of_the_maps(bencher: Bencher) {
    let maps = vec![1u8; (SIDE * SIDE * 6) as usize];
    bencher.counter(ItemsCount::new(SIDE * SIDE)).bench_local(|| divan::black_box(&maps).clone());
}
