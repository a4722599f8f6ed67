//! Block encoders and decoders in texels a second; the numbers of [`kinran_image::Preset`].
//!
//! `cargo bench -p kinran-image --bench block` times whole images; with `-- --table` it prints the table of
//! speed and error by map instead. There each row of blocks is timed by itself on one thread and the best of
//! five counts, so that other programs on the machine disturb little.

#![allow(clippy::print_stdout, reason = "the table is what it is run for")]

use std::time::{Duration, Instant};

use divan::{Bencher, counter::ItemsCount};
use kinran_image::{Encoder, Encoding, Format, Preset, decode, encode};

/// Texels along each side of the maps.
const SIDE: u32 = 512;

/// The maps the encoders are measured on, 8-bit RGBA, opaque, one part in eight of each flat.
#[derive(Clone, Copy, Debug)]
enum Map {
    /// Unit normals of a twill of round threads with fibres, as XY.
    Normal,
    /// An aniso map of the same cloth: width along and across the thread, correlation.
    Aniso,
    /// Printed cloth under a photographer's light: colours, stains, grain.
    Color,
}

fn main() {
    if std::env::args().any(|a| a == "--table") {
        print_table();
    } else {
        divan::main();
    }
}

fn encodings() -> Vec<Encoding> {
    let mut all = Vec::new();
    for format in [Format::Bc1, Format::Bc4, Format::Bc5, Format::Bc7] {
        let ispc = cfg!(feature = "ispc").then_some(Encoder::Ispc);
        for encoder in ispc.into_iter().chain([Encoder::Portable]) {
            for preset in [Preset::Fast, Preset::Normal, Preset::Best] {
                // Intel's encoder has one speed for formats other than BC7.
                if encoder == Encoder::Portable || format == Format::Bc7 || preset == Preset::Fast {
                    all.push(Encoding { format, encoder, preset });
                }
            }
        }
    }
    all
}

fn maps(format: Format) -> &'static [Map] {
    match format {
        Format::Bc4 | Format::Bc5 => &[Map::Normal],
        _ => &[Map::Color, Map::Aniso],
    }
}

#[divan::bench(args = encodings(), sample_count = 5, sample_size = 1)]
fn encode_block(bencher: Bencher<'_, '_>, encoding: &Encoding) {
    let texels = paint(maps(encoding.format)[maps(encoding.format).len() - 1]);
    bencher
        .counter(ItemsCount::new(SIDE * SIDE))
        .bench(|| encode(*encoding, &texels, SIDE, SIDE).expect("a valid request"));
}

#[divan::bench(args = [Format::Bc1, Format::Bc5, Format::Bc7], sample_count = 10, sample_size = 1)]
fn decode_block(bencher: Bencher<'_, '_>, format: Format) {
    let encoding = Encoding { format, encoder: Encoder::Portable, preset: Preset::Fast };
    let data = encode(encoding, &paint(Map::Normal), SIDE, SIDE).expect("a valid request");
    bencher
        .counter(ItemsCount::new(SIDE * SIDE))
        .bench(|| decode(format, &data, SIDE, SIDE).expect("a valid request"));
}

fn print_table() {
    for encoding in encodings() {
        let Encoding { format, encoder, preset } = encoding;
        for &map in maps(format) {
            let texels = paint(map);
            let data = encode(encoding, &texels, SIDE, SIDE).expect("a valid request");
            let decoded = decode(format, &data, SIDE, SIDE).expect("a valid request");
            let channels = match format {
                Format::Bc4 => 1,
                Format::Bc5 => 2,
                _ => 3,
            };
            let mut squares = 0.0;
            for (wanted, got) in texels.chunks_exact(4).zip(&decoded) {
                for c in 0..channels {
                    squares += (f64::from(wanted[c]) / 255.0 - f64::from(got[c])).powi(2);
                }
            }
            let db = -10.0 * (squares / f64::from(SIDE * SIDE) / channels as f64).log10();
            let mut time = Duration::ZERO;
            for rows in texels.chunks((SIDE * 4 * 4) as usize) {
                let best = (0..5).map(|_| {
                    let start = Instant::now();
                    divan::black_box(encode(encoding, rows, SIDE, 4)).expect("a valid request");
                    start.elapsed()
                });
                time += best.min().unwrap_or_default();
            }
            let speed = f64::from(SIDE * SIDE) / 1e6 / time.as_secs_f64();
            println!("| {format:?} | {encoder:?} {preset:?} | {map:?} | {speed:.2} MPix/s | {db:.2} dB |");
        }
    }
}

fn paint(map: Map) -> Vec<u8> {
    let texels = (0..SIDE * SIDE).flat_map(|i| {
        let (x, y) = (i % SIDE, i / SIDE);
        let flat = x < SIDE / 4 && y < SIDE / 2;
        let rgb = match map {
            _ if flat => [0.5, 0.5, 0.5],
            Map::Normal => {
                let [nx, ny] = thread(x, y).normal;
                [0.5 + 0.5 * nx, 0.5 + 0.5 * ny, 0.0]
            }
            Map::Aniso => {
                let t = thread(x, y);
                let along = 0.15 + 0.05 * noise(x / 3, y / 3, 1);
                let across = 0.4 + 0.05 * noise(x, y, 2);
                let (s, c) = (0.3 * (noise(x / 6, y / 6, 3) - 0.5) + 0.05 * (noise(x, y, 7) - 0.5)).sin_cos();
                let (a, b) = if t.warp { (along, across) } else { (across, along) };
                let (xx, yy, xy) =
                    (a * a * c * c + b * b * s * s, a * a * s * s + b * b * c * c, (a * a - b * b) * s * c);
                [xx.sqrt(), 0.5 + 0.5 * xy / (xx * yy).sqrt(), yy.sqrt()]
            }
            Map::Color => {
                let base = if thread(x, y).warp { [0.55, 0.2, 0.15] } else { [0.2, 0.3, 0.5] };
                let stain = 0.6 + 0.4 * (x as f32 * 0.03).sin() * (y as f32 * 0.021).cos();
                let grain = 0.9 + 0.2 * noise(x, y, 4);
                let speck = 0.03 * noise(x / 2, y / 2, 8);
                [base[0] * stain * grain, base[1] * stain + speck, base[2] * grain - speck]
            }
        };
        let [r, g, b] = rgb.map(|c: f32| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
        [r, g, b, 255]
    });
    texels.collect()
}

struct Thread {
    /// Whether the thread on top runs along y.
    warp: bool,
    normal: [f32; 2],
}

/// A 2/2 twill of threads 6 texels wide, so that most blocks hold an edge, each a half cylinder with fine
/// fibres.
fn thread(x: u32, y: u32) -> Thread {
    let warp = (x / 6 + y / 6) % 4 < 2;
    let (across, along) = if warp { (x, y) } else { (y, x) };
    let offset = (across % 6) as f32 / 3.0 - 0.8333;
    let fibre = 0.3 * (noise(across, along / 4, 5) - 0.5);
    let bend = 0.5 * ((along % 12) as f32 / 12.0 - 0.5) + 0.05 * (noise(across, along, 6) - 0.5);
    let tilt = [(0.7 * offset + fibre).clamp(-0.95, 0.95), bend];
    Thread { warp, normal: if warp { tilt } else { [tilt[1], tilt[0]] } }
}

/// A hash of the cell in 0 to 1.
fn noise(x: u32, y: u32, layer: u32) -> f32 {
    let mut h = x.wrapping_mul(0x85eb_ca6b) ^ y.wrapping_mul(0xc2b2_ae35) ^ layer.wrapping_mul(0x27d4_eb2f);
    h = (h ^ h >> 15).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ h >> 12).wrapping_mul(0x297a_2d39);
    (h ^ h >> 15) as f32 / u32::MAX as f32
}
