//! A whole 4096² bake, PNG files in to KTX2 files out, beside the bare block encoders on the same pixels.
//!
//! Run with `cargo bench -p kinran-bake --bench whole_bake`; `KINRAN_SIDE` sets another size. Each row is the
//! fastest of five runs, in seconds of wall time, on one thread and on two; a bake and the encoders that it is held
//! against run in turns, so that a machine whose speed swings does so for both. A bare row compresses, level by
//! level, exactly the bytes that the bake under it compresses, with the same encoders and presets: the
//! defaults of `Role`, portable BC5 at "fast" and ISPC BC7 at "very fast".
#![allow(clippy::print_stdout, reason = "the table is the result")]

use std::path::Path;
use std::time::Instant;

use kinran_bake::aniso::{Filter, Kernel, Sheet, SheetRequest, SurfaceOptions, bake_surface};
use kinran_bake::folder::{Hints, LoadedMaterial, scan};
use kinran_image::{
    Channels, Format, Image, Pixels, Role, Texture, encode_ktx2, encode_parallel, read_image, untold,
    write_atomically, write_png,
};
use rayon::prelude::*;

/// Zstandard level of the files, the command line's default.
const ZSTD: i32 = 3;

/// Runs of each row.
const RUNS: usize = 5;

fn main() {
    let side: u32 = std::env::var("KINRAN_SIDE").ok().and_then(|s| s.parse().ok()).unwrap_or(4096);
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_maps(folder.path(), side);
    let sheets = sheets();

    println!("{side}² normal (BC5) and aniso (BC7) map, all levels; fastest of {RUNS}, seconds of wall time");
    println!(
        "{:24} {:>9} {:>9} {:>7} {:>9} {:>9}",
        "", "1 thread", "2 threads", "gain", "x bare, 1", "x bare, 2"
    );
    for filter in [Filter::Linear, Filter::Ml] {
        let pixels = pixels(folder.path(), filter);
        let bare = || {
            for (request, texture) in sheets.iter().zip(&pixels) {
                for level in &texture.levels {
                    let data = encode_parallel(request.encoding, &level.data, level.width, level.height);
                    std::hint::black_box(data.expect("encoded"));
                }
            }
        };
        let whole = || write(folder.path(), &bake(&load(folder.path()), filter, &sheets));
        let [bare, whole] = in_turns([&bare, &whole]);
        print_row(&format!("bare encoders, {}", filter.name()), bare, None);
        print_row(&format!("bake, {}", filter.name()), whole, Some(bare));
    }

    println!("\nwhat a bake does beside filtering and compressing");
    let textures = bake(&load(folder.path()), Filter::Linear, &sheets);
    let read = || {
        for file in ["weave_normal.png", "weave_aniso.png"] {
            std::hint::black_box(read_image(&folder.path().join(file)).expect("read"));
        }
    };
    let check = || drop(load(folder.path()));
    let supercompress = || {
        textures.par_iter().for_each(|texture| {
            std::hint::black_box(encode_ktx2(texture, Some(ZSTD)).expect("a container"));
        });
    };
    let write = || write(folder.path(), &textures);
    let times = in_turns([&read, &check, &supercompress, &write]);
    let names = ["reading PNG", "reading and checking", "Zstandard", "Zstandard and writing"];
    for (name, times) in names.into_iter().zip(times) {
        print_row(name, times, None);
    }
}

/// Times of each job on one thread and on two, the jobs run in turns.
fn in_turns<const N: usize>(jobs: [&(dyn Fn() + Sync); N]) -> [[f64; 2]; N] {
    let pools =
        [1, 2].map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads"));
    let mut fastest = [[f64::INFINITY; 2]; N];
    for _ in 0..RUNS {
        for (i, pool) in pools.iter().enumerate() {
            for (job, fastest) in jobs.iter().zip(&mut fastest) {
                let start = Instant::now();
                pool.install(job);
                fastest[i] = fastest[i].min(start.elapsed().as_secs_f64());
            }
        }
    }
    fastest
}

fn print_row(name: &str, times: [f64; 2], bare: Option<[f64; 2]>) {
    let beside = bare
        .map_or_else(String::new, |bare| format!(" {:9.2} {:9.2}", times[0] / bare[0], times[1] / bare[1]));
    println!("{name:24} {:9.3} {:9.3} {:7.2}{beside}", times[0], times[1], times[0] / times[1]);
}

fn sheets() -> [SheetRequest<'static>; 2] {
    [(Sheet::Normal, Role::Normal), (Sheet::Aniso, Role::Aniso)].map(|(sheet, role)| SheetRequest {
        sheet,
        encoding: role.encoding(),
        packed_with: None,
    })
}

fn load(folder: &Path) -> LoadedMaterial {
    scan(folder, &Hints::default()).expect("maps").materials[0].load().expect("loaded")
}

fn bake(loaded: &LoadedMaterial, filter: Filter, sheets: &[SheetRequest]) -> Vec<Texture> {
    let maps = loaded.surface.as_ref().expect("a surface");
    let options = SurfaceOptions { filter, kernel: Kernel::Box };
    bake_surface(maps, options, sheets, &untold).expect("baked").textures
}

/// What the encoders get, level by level: the same bake without compression.
fn pixels(folder: &Path, filter: Filter) -> Vec<Texture> {
    let mut plain = sheets();
    for request in &mut plain {
        request.encoding.format = Format::Rgba8;
    }
    bake(&load(folder), filter, &plain)
}

fn write(folder: &Path, textures: &[Texture]) {
    textures.par_iter().enumerate().for_each(|(i, texture)| {
        let bytes = encode_ktx2(texture, Some(ZSTD)).expect("a container");
        write_atomically(&folder.join(format!("out_{i}.ktx2")), &bytes).expect("written");
    });
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
