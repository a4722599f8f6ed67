#!/usr/bin/env bash
# Expected: the BC7 settings called opaque (`opaque_fast_settings`, `opaque_basic_settings` …) leave opaque pictures opaque:
# BC7 holds alpha 255 exactly in modes 0 to 3, which have no alpha, and in modes 4 to 7, which have.
# What happens: a share of the blocks is written in mode 6, whose lowest bit is shared by all four channels of an endpoint;
# the encoder chooses it for the colour, and alpha decodes to 254. On smooth waves that is 2 % of the texels, on brown cloth
# (one hue, lighter and darker) it is half of them, at every setting.
# Why care: alpha tests with `a == 1`, premultiplied blending and tools that ask "is any texel transparent?" take the picture
# for a translucent one; engines sort such materials, and lose depth writes.
# Version: intel_tex_2 0.5.0 (ISPC Texture Compressor), bcdec_rs 0.2.1 as decoder. Source: ispc_texcomp/kernel.ispc,
# bc7_enc_mode456.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
mkdir src
cat > Cargo.toml <<'TOML'
[package]
name = "opaque"
version = "0.0.0"
edition = "2021"
[dependencies]
intel_tex_2 = "=0.5.0"
bcdec_rs = "=0.2.1"
TOML
cat > src/main.rs <<'RS'
use intel_tex_2::{bc7, RgbaSurface};

const SIDE: u32 = 128;

fn main() {
    // Brown cloth, opaque: one colour, lighter and darker from texel to texel.
    let texel = |i: u32| {
        let noise = (i.wrapping_mul(747_796_405) ^ 0x9E37_79B9).wrapping_mul(0x85EB_CA6B) >> 24;
        let light = 0.5 + noise as f32 / 510.0;
        [(150.0 * light) as u8, (110.0 * light) as u8, (80.0 * light) as u8, 255]
    };
    let data: Vec<u8> = (0..SIDE * SIDE).flat_map(texel).collect();
    let surface = RgbaSurface { data: &data, width: SIDE, height: SIDE, stride: SIDE * 4 };
    let mut shares = Vec::new();
    for (name, settings) in [
        ("opaque_fast_settings", bc7::opaque_fast_settings()),
        ("opaque_basic_settings", bc7::opaque_basic_settings()),
        ("opaque_slow_settings", bc7::opaque_slow_settings()),
    ] {
        let blocks = bc7::compress_blocks(&settings, &surface);
        let mut lost = 0;
        for block in blocks.chunks_exact(16) {
            let mut texels = [0; 64];
            bcdec_rs::bc7(block, &mut texels, 16);
            lost += texels.chunks_exact(4).filter(|texel| texel[3] != 255).count();
        }
        let share = 100.0 * lost as f64 / f64::from(SIDE * SIDE);
        println!("{name}: {share:.1} % of the texels are not opaque");
        shares.push(share);
    }
    assert!(shares[0] > 10.0 && shares.iter().all(|share| *share > 0.0), "opaque pictures stay opaque now");
}
RS
# The prebuilt encoder is C++ and does not say so to the linker.
RUSTFLAGS="-C link-arg=-lstdc++" cargo build --quiet
sed -n '/^name = "\(intel_tex_2\|bcdec_rs\)"/{N;s/name = "\(.*\)"\nversion = "\(.*\)"/\1 \2/p}' Cargo.lock
target/debug/opaque
