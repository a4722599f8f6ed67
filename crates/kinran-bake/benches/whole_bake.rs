//! A whole 4096² bake, PNG files in to KTX2 files out, beside the bare block encoders on the same pixels.
//!
//! Run with `cargo bench -p kinran-bake --bench whole_bake`; `KINRAN_SIDE` sets another size. Each row is the
//! fastest of three runs, in seconds of wall time, on one thread and on two.
#![allow(clippy::print_stdout, reason = "the table is the result")]

use std::path::Path;
use std::time::Instant;

use kinran_bake::aniso::{Filter, Kernel, Sheet, SheetRequest, SurfaceOptions, bake_surface};
use kinran_bake::folder::{Hints, scan};
use kinran_image::{
    Channels, Image, Pixels, Role, Texture, encode_ktx2, encode_parallel, write_atomically, write_png,
};
use rayon::prelude::*;

fn main() {
    let side: u32 = std::env::var("KINRAN_SIDE").ok().and_then(|s| s.parse().ok()).unwrap_or(4096);
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_maps(folder.path(), side);

    // What the encoders get, level by level.
    let sheets = sheets();
    let baked = bake(folder.path(), Filter::Linear, &sheets);
    let pixels: Vec<Vec<(u32, u32, Vec<u8>)>> = baked.iter().map(rgba8_levels).collect();

    println!("{side}² normal (BC5) and aniso (BC7) map, all levels; fastest of 3, seconds of wall time");
    println!(
        "{:24} {:>9} {:>9} {:>7} {:>9} {:>9}",
        "", "1 thread", "2 threads", "gain", "x bare, 1", "x bare, 2"
    );
    let mut bare = [0.0; 2];
    for (name, run) in
        [("bare encoders", None), ("bake, linear", Some(Filter::Linear)), ("bake, ml", Some(Filter::Ml))]
    {
        let times = [1, 2].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| {
                fastest(|| match run {
                    None => {
                        for (request, levels) in sheets.iter().zip(&pixels) {
                            for (width, height, rgba8) in levels {
                                let data = encode_parallel(request.encoding, rgba8, *width, *height);
                                std::hint::black_box(data.expect("encoded"));
                            }
                        }
                    }
                    Some(filter) => write(folder.path(), &bake(folder.path(), filter, &sheets)),
                })
            })
        });
        if run.is_none() {
            bare = times;
        }
        println!(
            "{name:24} {:9.2} {:9.2} {:7.2} {:9.2} {:9.2}",
            times[0],
            times[1],
            times[0] / times[1],
            times[0] / bare[0],
            times[1] / bare[1]
        );
    }
}

fn fastest(mut run: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..3 {
        let start = Instant::now();
        run();
        best = best.min(start.elapsed().as_secs_f64());
    }
    best
}

fn sheets() -> [SheetRequest<'static>; 2] {
    [(Sheet::Normal, Role::Normal), (Sheet::Aniso, Role::Aniso)].map(|(sheet, role)| SheetRequest {
        sheet,
        encoding: role.encoding(),
        packed_with: None,
    })
}

fn bake(folder: &Path, filter: Filter, sheets: &[SheetRequest]) -> Vec<Texture> {
    let found = scan(folder, &Hints::default()).expect("maps");
    let loaded = found.materials[0].load().expect("loaded");
    let maps = loaded.surface.expect("a surface");
    let options = SurfaceOptions { filter, kernel: Kernel::Box };
    bake_surface(&maps, options, sheets, &|_| {}).expect("baked").textures
}

fn write(folder: &Path, textures: &[Texture]) {
    textures.par_iter().enumerate().for_each(|(i, texture)| {
        let bytes = encode_ktx2(texture, Some(3)).expect("a container");
        write_atomically(&folder.join(format!("out_{i}.ktx2")), &bytes).expect("written");
    });
}

fn rgba8_levels(texture: &Texture) -> Vec<(u32, u32, Vec<u8>)> {
    texture
        .levels
        .iter()
        .enumerate()
        .map(|(i, level)| {
            let texels = texture.decode_level(i).expect("decoded");
            let bytes = texels.iter().flatten().map(|v| (v * 255.0 + 0.5) as u8).collect();
            (level.width, level.height, bytes)
        })
        .collect()
}

/// Woven normals and an aniso map, as PNG.
fn write_maps(folder: &Path, side: u32) {
    let mut normal = Vec::with_capacity((side * side * 3) as usize);
    let mut aniso = Vec::with_capacity((side * side * 3) as usize);
    let mut state = 1_u32;
    for y in 0..side {
        for x in 0..side {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let noise = (state >> 28) as f32 / 15.0 - 0.5;
            let warp = ((x / 16) + (y / 16)) % 2 == 0;
            let (u, v) = ((x % 16) as f32 / 16.0 - 0.5, (y % 16) as f32 / 16.0 - 0.5);
            let (nx, ny) = if warp { (u * 0.9, v * 0.2) } else { (u * 0.2, v * 0.9) };
            let nz = (1.0 - nx * nx - ny * ny).sqrt();
            let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
            normal.extend([nx, ny, nz].map(|c| byte(0.5 + 0.5 * c + 0.01 * noise)));
            let (along, across) = (0.15 + 0.03 * noise, 0.5 + 0.06 * noise);
            aniso.extend(if warp {
                [byte(along), 128, byte(across)]
            } else {
                [byte(across), 128, byte(along)]
            });
        }
    }
    for (name, pixels) in [("weave_normal.png", normal), ("weave_aniso.png", aniso)] {
        let image = Image::new(side, side, Channels::Rgb, Pixels::U8(pixels)).expect("an image");
        write_png(&folder.join(name), &image).expect("written");
    }
}
