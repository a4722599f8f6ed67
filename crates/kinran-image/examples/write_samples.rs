//! Writes every format and container for `tools/check_textures`, and what our own decoder makes of them.
//!
//! `cargo run --release -p kinran-image --example write_samples -- FOLDER` writes `NAME.ktx2` or `NAME.dds`
//! and beside each `NAME.f32`: all levels from 0, rows of RGBA texels as little-endian floats.

use std::path::Path;

use kinran_image::{
    Encoder, Encoding, Error, Format, Level, Preset, Role, Texture, Transfer, encode, encode_half,
    full_level_count, level_size, write_atomically_with, write_texture,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args_os().nth(1).ok_or("usage: write_samples FOLDER")?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    for (width, height) in [(64, 64), (61, 35), (1, 5)] {
        for (format, transfer) in [
            (Format::Bc1, Transfer::Linear),
            (Format::Bc1, Transfer::Srgb),
            (Format::Bc4, Transfer::Linear),
            (Format::Bc5, Transfer::Linear),
            (Format::Bc7, Transfer::Linear),
            (Format::Bc7, Transfer::Srgb),
            (Format::Rgba8, Transfer::Linear),
            (Format::Rgba8, Transfer::Srgb),
            (Format::Rgba16F, Transfer::Linear),
            (Format::Uastc, Transfer::Linear),
            (Format::Uastc, Transfer::Srgb),
        ] {
            if !format.has_encoder() {
                continue;
            }
            let texture = sample(format, transfer, width, height)?;
            let name = format!("{format:?}_{transfer:?}_{width}x{height}").to_lowercase();
            for (kind, zstd) in [("plain.ktx2", None), ("zstd.ktx2", Some(3)), ("plain.dds", None)] {
                if format == Format::Uastc && kind == "plain.dds" {
                    continue;
                }
                let path = folder.join(format!("{name}_{kind}"));
                write_texture(&path, &texture, zstd)?;
                let levels = (0..texture.levels.len()).map(|i| texture.decode_level(i));
                let levels = levels.collect::<Result<Vec<_>, Error>>()?;
                write_atomically_with(&path.with_added_extension("f32"), |file| {
                    use std::io::Write;
                    for channel in levels.iter().flatten().flatten() {
                        file.write_all(&channel.to_le_bytes())?;
                    }
                    Ok(())
                })?;
            }
        }
    }
    Ok(())
}

/// A mip chain of coloured waves, flat in one corner, each level painted by itself; alpha is cut off at 1, so that blocks
/// have opaque texels beside others.
fn sample(format: Format, transfer: Transfer, width: u32, height: u32) -> Result<Texture, Error> {
    let mut levels = Vec::new();
    for i in 0..full_level_count(width, height) {
        let (width, height) = (level_size(width, i), level_size(height, i));
        let texels: Vec<[f32; 4]> = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x as f32 / width as f32, y as f32 / height as f32)))
            .map(|(u, v)| match (u, v) {
                (0.0..0.3, 0.0..0.3) => [0.25, 0.5, 0.75, 1.0],
                _ => [(9.0 * u).sin(), (9.0 * v).cos(), (7.0 * (u + v)).sin(), (5.0 * (u - v)).cos()]
                    .map(|wave: f32| 0.5 + 0.5 * wave),
            })
            .map(|[r, g, b, a]| [r, g, b, (1.3 * a).min(1.0)])
            .collect();
        let data = if format == Format::Rgba16F {
            encode_half(&texels)?
        } else {
            let bytes: Vec<u8> =
                texels.as_flattened().iter().map(|channel| (channel * 255.0).round() as u8).collect();
            let encoding = match format {
                Format::Bc5 => Role::Normal.encoding(),
                Format::Bc7 => Role::Aniso.encoding(),
                format => Encoding { format, encoder: Encoder::Portable, preset: Preset::Normal },
            };
            encode(encoding, &bytes, width, height)?
        };
        levels.push(Level { width, height, data });
    }
    let metadata = [("KinranFilter".to_string(), "none".to_string())].into();
    Ok(Texture { format, transfer, levels, metadata })
}
