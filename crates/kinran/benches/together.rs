//! A folder with colour, occlusion, roughness and metalness, PNG files in to KTX2 files out, with colour, metal and lobe filtered
//! together and one by one, in turns.
//!
//! Run with `cargo bench -p kinran --bench together`; `KINRAN_SIDE` sets another size than 2048.
#![allow(clippy::print_stdout, reason = "the table is the result")]

use std::path::Path;
use std::time::Instant;

use kinran::bake::{FolderOptions, folder, understand};
use kinran::{Memory, Task};
use kinran_image::{Channels, Image, Pixels, encode_png};

/// Runs of each row.
const RUNS: usize = 7;

fn main() {
    let side: u32 = std::env::var("KINRAN_SIDE").ok().and_then(|s| s.parse().ok()).unwrap_or(2048);
    let (input, files) = (Path::new("paint"), maps(side));
    println!("{side}² normal, colour and packed map, all levels; fastest of {RUNS}, seconds of wall time");
    println!("{:24} {:>9} {:>9} {:>7}", "", "together", "apart", "ratio");
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let mut fastest = [f64::INFINITY; 2];
        for _ in 0..RUNS {
            for (fastest, correlated) in fastest.iter_mut().zip([true, false]) {
                let mut how = FolderOptions::default();
                how.textures.correlated = correlated;
                let start = Instant::now();
                pool.install(|| {
                    let understood = understand(&files, input, &how).expect("maps");
                    folder(&files, input, &understood, &how, &Memory::new(), Task::QUIET).expect("baked");
                });
                *fastest = fastest.min(start.elapsed().as_secs_f64());
            }
        }
        let [on, off] = fastest;
        println!("{:24} {on:9.3} {off:9.3} {:7.3}", format!("threads: {threads}"), on / off);
    }
}

/// Chipped paint on steel: flakes of some texels, every texel a little different.
fn maps(side: u32) -> Memory {
    let png = |texel: &dyn Fn(bool, u8) -> [u8; 3]| {
        let texels = (0..side * side).flat_map(|i| {
            let hash = |v: u32| {
                let v = (v ^ v >> 15).wrapping_mul(2_654_435_761);
                v ^ v >> 13
            };
            let flake = hash(i / side / 8 * side + i % side / 8) >> 24 < 100;
            texel(flake, (hash(i) >> 27) as u8)
        });
        let pixels = Pixels::U8(texels.collect());
        encode_png(&Image::new(side, side, Channels::Rgb, pixels).expect("an image")).expect("encoded")
    };
    let normal = png(&|flake, noise| [if flake { 112 } else { 126 } + noise / 2, 112 + noise, 250]);
    let color = png(&|flake, noise| if flake { [200 - noise, 196, 190] } else { [150 + noise, 40, 30] });
    let orm = png(&|flake, noise| if flake { [255, 60 + noise, 255] } else { [230, 140 + noise, 0] });
    let maps = [("normal_gl", normal), ("basecolor", color), ("occlusionRoughnessMetallic", orm)];
    maps.map(|(role, png)| (format!("paint/paint_{role}.png"), png)).into_iter().collect()
}
