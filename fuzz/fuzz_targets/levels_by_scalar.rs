//! Plain mip chains, which are made in lanes, against averages in double precision, one texel at a time.

#![no_main]

use kinran_bake::aniso::{Kernel, footprints};
use kinran_bake::plain_levels;
use kinran_image::{Channels, Image, Pixels, Transfer, full_level_count, untold};
use kinran_scene::Wrap;
use libfuzzer_sys::fuzz_target;

fn linear(code: u8) -> f64 {
    let v = f64::from(code) / 255.0;
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

fn srgb(v: f64) -> f64 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

fuzz_target!(|input: (u8, u8, bool, u8, Vec<u8>)| {
    let (width, height, tent, wrap, bytes) = input;
    if bytes.is_empty() {
        return;
    }
    let (width, height) = (u32::from(width) % 100 + 1, u32::from(height) % 100 + 1);
    let kernel = if tent { Kernel::Tent } else { Kernel::Box };
    let wrap = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror][usize::from(wrap) % 3];
    let samples: Vec<u8> = bytes.iter().copied().cycle().take((width * height) as usize).collect();
    let image = Image::new(width, height, Channels::R, Pixels::U8(samples.clone())).expect("a sound image");
    let levels = plain_levels(&image, (width, height), Transfer::Srgb, kernel, [wrap; 2], &untold);
    let levels = levels.expect("nobody stops it");
    let count = full_level_count(width, height);
    let (columns, rows) = (footprints(width, count, kernel, wrap), footprints(height, count, kernel, wrap));
    for level in 1..count {
        let (columns, rows) = (&columns[level - 1], &rows[level - 1]);
        for (y, down) in rows.iter().enumerate() {
            for (x, across) in columns.iter().enumerate() {
                let mut sum = 0.0;
                for &(j, v) in down {
                    for &(i, u) in across {
                        sum += f64::from(u) * f64::from(v) * linear(samples[(j * width + i) as usize]);
                    }
                }
                let wanted = 255.0 * srgb(sum);
                let got = levels[level].rgba8[4 * (y * columns.len() + x)];
                assert!(
                    (f64::from(got) - wanted).abs() <= 0.5 + 2e-3,
                    "level {level}, ({x}, {y}): wanted {wanted}, got {got}"
                );
            }
        }
    }
});
