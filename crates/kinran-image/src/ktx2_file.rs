//! KTX 2.0 containers (Khronos KTX File Format Specification 2.0.4), plain or with Zstandard levels.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use ktx2::dfd::{Basic, Block};
use ktx2::{Header, Index, KeyValueDataIterator, LevelIndex, SupercompressionScheme};
use rayon::prelude::*;

use crate::basis::{self, Kind};
use crate::image::check_sides;
use crate::texture::{full_level_count, level_size};
use crate::{Error, Format, Level, Texture, Transfer};

/// The bytes of a texture as a KTX2 file. Levels are compressed in parallel, each by itself: the bytes do not
/// depend on the number of threads.
///
/// `zstd` is the compression level of every mip level's bytes, 1 to 22 (3 is fast and close to the best),
/// or `None` for plain levels that can be uploaded from the file as they are. The texture's metadata are
/// stored sorted, as UTF-8 with a NUL, joined by `KTXorientation` "rd" and `KTXwriter`. BC1 is tagged as
/// RGBA, the only kind that DDS has too; no block uses the transparent index.
///
/// # Errors
/// [`Error::Unsupported`] where [`Texture::check`] refuses the texture, a metadata key is empty or has a
/// NUL, or the compression level is out of range.
pub fn encode_ktx2(texture: &Texture, zstd: Option<i32>) -> Result<Vec<u8>, Error> {
    texture.check()?;
    texture.check_transfer()?;
    if let Some(level) = zstd
        && !zstd::compression_level_range().contains(&level)
    {
        return Err(Error::Unsupported(format!("Zstandard has no compression level {level}; use 1 to 22")));
    }
    let format = ktx2_format(texture.format, texture.transfer);
    let (block, type_size) = match format {
        Some(format) => {
            let (mut descriptor, type_size) = Basic::from_format(format)
                .map_err(|e| Error::Unsupported(format!("{:?}: {e}", texture.format)))?;
            // Linear maps are no colours.
            if texture.transfer == Transfer::Linear {
                descriptor.color_primaries = None;
            }
            (Block::Basic(descriptor).to_vec(), type_size)
        }
        None => (basis::descriptor(texture.transfer, !is_opaque(texture)?).to_vec(), 1),
    };
    let key_values = key_value_data(&texture.metadata)?;

    // Lay out the sections: header, level index, descriptor, key/values, levels from the smallest up.
    let dfd_offset = Header::LENGTH + texture.levels.len() * LevelIndex::LENGTH;
    let dfd_length = 4 + block.len();
    let kvd_offset = dfd_offset + dfd_length;
    let first = &texture.levels[0];
    let header = Header {
        format,
        type_size,
        pixel_width: first.width,
        pixel_height: first.height,
        pixel_depth: 0,
        layer_count: 0,
        face_count: 1,
        level_count: texture.levels.len() as u32,
        supercompression_scheme: zstd.map(|_| SupercompressionScheme::Zstandard),
        index: Index {
            dfd_byte_offset: dfd_offset as u32,
            dfd_byte_length: dfd_length as u32,
            kvd_byte_offset: kvd_offset as u32,
            kvd_byte_length: key_values.len() as u32,
            sgd_byte_offset: 0,
            sgd_byte_length: 0,
        },
    };
    let mut file = header.as_bytes().to_vec();
    file.resize(dfd_offset, 0);
    file.extend((dfd_length as u32).to_le_bytes());
    file.extend(block);
    file.extend(key_values);

    let compressed: Option<Vec<Vec<u8>>> = zstd
        .map(|quality| {
            let compress = |(i, level): (usize, &Level)| {
                zstd::bulk::compress(&level.data, quality)
                    .map_err(|e| Error::Unsupported(format!("Zstandard failed on level {i}: {e}")))
            };
            texture.levels.par_iter().enumerate().map(compress).collect()
        })
        .transpose()?;

    // Plain levels start at a multiple of their block's size and of 4, compressed ones anywhere.
    let alignment = if zstd.is_some() { 1 } else { texture.format.block_bytes().max(4) };
    for (i, level) in texture.levels.iter().enumerate().rev() {
        file.resize(file.len().next_multiple_of(alignment), 0);
        let start = file.len();
        file.extend_from_slice(compressed.as_ref().map_or(&level.data, |levels| &levels[i]));
        let index = LevelIndex {
            byte_offset: start as u64,
            byte_length: (file.len() - start) as u64,
            uncompressed_byte_length: level.data.len() as u64,
        };
        file[Header::LENGTH + i * LevelIndex::LENGTH..][..LevelIndex::LENGTH]
            .copy_from_slice(&index.as_bytes());
    }
    Ok(file)
}

/// Whether no texel of UASTC is seen through.
fn is_opaque(texture: &Texture) -> Result<bool, Error> {
    let mut opaque = true;
    for level in &texture.levels {
        opaque &= basis::is_opaque(&level.data, level.width).map_err(Error::Unsupported)?;
    }
    Ok(opaque)
}

/// The key/value section: entries sorted by key, each a length, "key NUL value NUL" and padding to 4.
fn key_value_data(metadata: &BTreeMap<String, String>) -> Result<Vec<u8>, Error> {
    let mut entries = metadata.clone();
    entries.insert("KTXorientation".into(), "rd".into());
    entries.insert("KTXwriter".into(), concat!("Kinran ", env!("CARGO_PKG_VERSION")).into());
    let mut bytes = Vec::new();
    for (key, value) in &entries {
        if key.is_empty() || key.contains('\0') || value.contains('\0') {
            return Err(Error::Unsupported(format!("metadata {key:?} = {value:?} is empty or holds a NUL")));
        }
        let length = key.len() + 1 + value.len() + 1;
        bytes.extend((length as u32).to_le_bytes());
        for part in [key, value] {
            bytes.extend_from_slice(part.as_bytes());
            bytes.push(0);
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    Ok(bytes)
}

/// The format of a header; Basis Universal's have none.
fn ktx2_format(format: Format, transfer: Transfer) -> Option<ktx2::Format> {
    use Transfer::Srgb;
    Some(match (format, transfer) {
        (Format::Uastc, _) => return None,
        (Format::Bc1, Srgb) => ktx2::Format::BC1_RGBA_SRGB_BLOCK,
        (Format::Bc1, _) => ktx2::Format::BC1_RGBA_UNORM_BLOCK,
        (Format::Bc4, _) => ktx2::Format::BC4_UNORM_BLOCK,
        (Format::Bc5, _) => ktx2::Format::BC5_UNORM_BLOCK,
        (Format::Bc7, Srgb) => ktx2::Format::BC7_SRGB_BLOCK,
        (Format::Bc7, _) => ktx2::Format::BC7_UNORM_BLOCK,
        (Format::Rgba8, Srgb) => ktx2::Format::R8G8B8A8_SRGB,
        (Format::Rgba8, _) => ktx2::Format::R8G8B8A8_UNORM,
        (Format::Rgba16F, _) => ktx2::Format::R16G16B16A16_SFLOAT,
    })
}

/// Reads a KTX2 file: 2D, one layer, one face, in one of our formats, plain or with Zstandard levels, or of BasisLZ
/// (ETC1S), whose levels become [`Format::Rgba8`]. Its text metadata are kept, binary ones dropped.
///
/// # Errors
/// [`Error::Malformed`] under the name `name`, for every file that is not exactly that.
pub fn decode_ktx2(name: &Path, bytes: &[u8]) -> Result<Texture, Error> {
    parse(bytes).map_err(|reason| Error::malformed(name, format!("KTX2: {reason}")))
}

fn parse(bytes: &[u8]) -> Result<Texture, String> {
    // The crate's Reader is not used: it also parses the data format descriptor, and panics on one whose
    // texel block has a side of 256. The format says all that is needed here.
    let truncated = || crate::error::TRUNCATED.to_string();
    let (head, rest) = bytes.split_first_chunk::<{ Header::LENGTH }>().ok_or_else(truncated)?;
    let header = Header::from_bytes(head).map_err(|e| format!("{e}; the file is damaged"))?;
    let (format, transfer, kind) = match header.format {
        Some(f) => our_format(f).map(|(format, transfer)| (format, transfer, None)).ok_or_else(|| {
            format!("format {f:?} is not read; convert to BC1, BC4, BC5, BC7, RGBA8, RGBA16F or UASTC")
        })?,
        None => {
            let (kind, transfer) = basis::described(bytes, header.index.dfd_byte_offset as usize)?;
            let format = if kind == Kind::Uastc { Format::Uastc } else { Format::Rgba8 };
            (format, transfer, Some(kind))
        }
    };
    let (width, height) = (header.pixel_width, header.pixel_height);
    check_sides(width, height)?;
    if header.pixel_depth > 1 || header.layer_count > 1 || header.face_count != 1 {
        return Err("it is a volume, an array or a cube; only plain 2D textures are read".into());
    }
    let level_count = header.level_count.max(1) as usize;
    if level_count > full_level_count(width, height) {
        return Err(format!("it claims {level_count} levels, more than {width}x{height} can have"));
    }
    let is_basis_lz = kind == Some(Kind::Etc1s);
    match header.supercompression_scheme {
        Some(SupercompressionScheme::BasisLZ) if is_basis_lz => {}
        None | Some(SupercompressionScheme::Zstandard) if !is_basis_lz => {}
        _ => return Err("its supercompression is not read; use Zstandard, BasisLZ or none".into()),
    }

    let section = |offset: u64, length: u64| {
        let end = offset.checked_add(length).and_then(|end| usize::try_from(end).ok());
        end.and_then(|end| bytes.get(offset as usize..end)).ok_or_else(truncated)
    };
    let mut levels = Vec::with_capacity(level_count);
    if is_basis_lz {
        let texels = basis::decode_etc1s(bytes, width, height, level_count)?.into_iter().enumerate();
        levels = texels
            .map(|(i, data)| Level { width: level_size(width, i), height: level_size(height, i), data })
            .collect();
    }
    let (index, _) = rest.as_chunks::<{ LevelIndex::LENGTH }>();
    for (i, entry) in index.get(..level_count).ok_or_else(truncated)?.iter().enumerate().skip(levels.len()) {
        let entry = LevelIndex::from_bytes(entry);
        let stored = section(entry.byte_offset, entry.byte_length)?;
        let (width, height) = (level_size(width, i), level_size(height, i));
        let wanted = format.level_bytes(width, height);
        let data = match header.supercompression_scheme {
            None => stored.to_vec(),
            Some(_) => decompress(stored, wanted).map_err(|e| format!("level {i}: {e}"))?,
        };
        if data.len() != wanted || entry.uncompressed_byte_length != wanted as u64 {
            return Err(format!("level {i}, {width}x{height} in {format:?}, must hold {wanted} bytes"));
        }
        let level = Level { width, height, data };
        // What is no block of UASTC is found here, where the file has a name.
        if format == Format::Uastc {
            basis::is_opaque(&level.data, level.width).map_err(|e| format!("level {i}: {e}"))?;
        }
        levels.push(level);
    }

    let mut metadata = BTreeMap::new();
    let key_values = section(header.index.kvd_byte_offset.into(), header.index.kvd_byte_length.into())?;
    for (key, value) in KeyValueDataIterator::new(key_values) {
        let value = value.strip_suffix(&[0]).unwrap_or(value);
        if let Ok(text) = std::str::from_utf8(value)
            && !key.is_empty()
            && !text.contains('\0')
        {
            metadata.insert(key.to_string(), text.to_string());
        }
    }
    if let Some(orientation) = metadata.get("KTXorientation")
        && orientation != "rd"
    {
        return Err(format!("its orientation is {orientation:?}; only \"rd\", rows from the top, is read"));
    }
    Ok(Texture { format, transfer, levels, metadata })
}

/// Decompresses at most one byte more than is wanted, so that a bomb costs no memory.
fn decompress(data: &[u8], wanted: usize) -> Result<Vec<u8>, String> {
    let mut out = Vec::new();
    zstd::Decoder::new(data)
        .and_then(|decoder| decoder.take(wanted as u64 + 1).read_to_end(&mut out))
        .map_err(|e| format!("{e}; the file is damaged"))?;
    Ok(out)
}

fn our_format(format: ktx2::Format) -> Option<(Format, Transfer)> {
    use ktx2::Format as F;
    Some(match format {
        F::BC1_RGBA_UNORM_BLOCK | F::BC1_RGB_UNORM_BLOCK => (Format::Bc1, Transfer::Linear),
        F::BC1_RGBA_SRGB_BLOCK | F::BC1_RGB_SRGB_BLOCK => (Format::Bc1, Transfer::Srgb),
        F::BC4_UNORM_BLOCK => (Format::Bc4, Transfer::Linear),
        F::BC5_UNORM_BLOCK => (Format::Bc5, Transfer::Linear),
        F::BC7_UNORM_BLOCK => (Format::Bc7, Transfer::Linear),
        F::BC7_SRGB_BLOCK => (Format::Bc7, Transfer::Srgb),
        F::R8G8B8A8_UNORM => (Format::Rgba8, Transfer::Linear),
        F::R8G8B8A8_SRGB => (Format::Rgba8, Transfer::Srgb),
        F::R16G16B16A16_SFLOAT => (Format::Rgba16F, Transfer::Linear),
        _ => return None,
    })
}
