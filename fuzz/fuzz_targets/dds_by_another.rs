//! What is written as DDS, whatever its blocks, is read by a crate that is not ours as it is by us: every texel of every level.

#![no_main]

use std::path::Path;

use dds::{ColorFormat, Decoder, ImageViewMut, Size};
use kinran_image::{Format, Level, Texture, Transfer, decode_dds, encode_dds, full_level_count, level_size};
use libfuzzer_sys::fuzz_target;

/// Largest difference between two decoders of a format, of 1: BC4 and BC5 are decoded to floats here and to 8 bits there, and
/// decoders of BC1 may round its thirds either way.
fn tolerance(format: Format) -> f32 {
    match format {
        Format::Bc7 | Format::Rgba8 => 0.1 / 255.0,
        _ => 1.1 / 255.0,
    }
}

fuzz_target!(|input: (u8, u8, u8, Vec<u8>)| {
    let (kind, width, height, bytes) = input;
    let (width, height) = (u32::from(width) % 33 + 1, u32::from(height) % 33 + 1);
    let format = [Format::Bc1, Format::Bc4, Format::Bc5, Format::Bc7, Format::Rgba8][usize::from(kind) % 5];
    if bytes.is_empty() {
        return;
    }
    let mut data = bytes.iter().copied().cycle();
    let levels: Vec<Level> = (0..full_level_count(width, height))
        .map(|level| {
            let (width, height) = (level_size(width, level), level_size(height, level));
            let data = data.by_ref().take(format.level_bytes(width, height)).collect();
            Level { width, height, data }
        })
        .collect();
    let texture = Texture { format, transfer: Transfer::Linear, levels, metadata: Default::default() };
    let file = encode_dds(&texture).expect("a sound texture can be written");
    assert_eq!(decode_dds(Path::new("fuzz.dds"), &file).expect("what is written can be read"), texture);

    let mut decoder = Decoder::new(file.as_slice()).expect("another reader takes the file");
    for (i, level) in texture.levels.iter().enumerate() {
        let mut rgba = vec![0; level.width as usize * level.height as usize * 4];
        let size = Size::new(level.width, level.height);
        let view = ImageViewMut::new(&mut rgba, size, ColorFormat::RGBA_U8).expect("a view of all texels");
        decoder.read_surface(view).expect("another reader finds every level");
        let ours = texture.decode_level(i).expect("a sound level decodes");
        for (texel, (ours, theirs)) in ours.iter().zip(rgba.chunks_exact(4)).enumerate() {
            for channel in 0..4 {
                // What a format does not hold is filled in differently.
                if format == Format::Bc4 && channel > 0 || format == Format::Bc5 && channel > 1 {
                    continue;
                }
                let theirs = f32::from(theirs[channel]) / 255.0;
                assert!(
                    (ours[channel] - theirs).abs() <= tolerance(format),
                    "{format:?}, level {i}, texel {texel}, channel {channel}: {} here, {theirs} there",
                    ours[channel]
                );
            }
        }
    }
});
