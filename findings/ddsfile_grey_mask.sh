#!/usr/bin/env bash
# Expected: of a DDS file of 8-bit grey (DDPF_LUMINANCE, as GIMP, nvcompress and DirectXTex write masks and heights) the
# parser gives the mask that says which bits are the grey. The field's own text promises it: "Red (or luminance) channel
# bitmask".
# What happens: the count of bits is read for grey files and the mask is not: it is None unless the file is RGB. Written
# again, the file has 0 in its place, a grey texture without a single bit.
# Why care: whoever tells the layouts of old DDS files apart by their masks, as the format wants, takes every grey file
# for unknown, and whoever rewrites one loses it in silence.
# Version: ddsfile 0.6.0. Source: src/format/pixel_format.rs, `PixelFormat::read`.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
cargo init --quiet --name check --vcs none
cargo add --quiet ddsfile@=0.6.0
cat > src/main.rs <<'RS'
use ddsfile::Dds;

fn main() {
    // 2 x 2 texels of 8-bit grey, whose mask is 0xff.
    let mut words = vec![0x2053_4444_u32, 124, 0x1007, 2, 2, 2, 0, 0];
    words.extend([0; 11]);
    words.extend([32, 0x2_0000, 0, 8, 0xff, 0, 0, 0]);
    words.extend([0x1000, 0, 0, 0, 0]);
    let mut file: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    file.extend([10, 90, 170, 250]);
    let dds = Dds::read(file.as_slice()).expect("a sound file");
    let pixels = &dds.header.spf;
    let mut again = Vec::new();
    dds.write(&mut again).expect("written");
    let mask = |file: &[u8]| u32::from_le_bytes(file[92..96].try_into().unwrap());
    println!("bits {:?}, mask {:?}", pixels.rgb_bit_count, pixels.r_bit_mask);
    println!("mask in the file {:#x}, in the file written again {:#x}", mask(&file), mask(&again));
    let same = pixels.rgb_bit_count == Some(8) && pixels.r_bit_mask.is_none() && mask(&again) == 0;
    std::process::exit(if same { 0 } else { 1 });
}
RS
cargo run --quiet
