//! DDS containers with the DX10 header (Microsoft, "Programming Guide for DDS").

use std::collections::BTreeMap;
use std::path::Path;

use ddsfile::{AlphaMode, Caps2, D3D10ResourceDimension, Dds, DxgiFormat, Header, Header10, MiscFlag};

use crate::image::check_sides;
use crate::texture::{full_level_count, level_size};
use crate::{Error, Format, Level, Texture, Transfer};

/// The bytes of a texture as a DDS file. DDS has no place for metadata.
///
/// # Errors
/// [`Error::Unsupported`] where [`Texture::check`] refuses the texture, or level 0 takes 4 GiB or more,
/// which the header cannot say.
pub fn encode_dds(texture: &Texture) -> Result<Vec<u8>, Error> {
    texture.check()?;
    let first = &texture.levels[0];
    if u32::try_from(first.data.len()).is_err() {
        return Err(Error::Unsupported("DDS holds less than 4 GiB; write KTX2 or a block format".into()));
    }
    let format = dxgi_format(texture.format, texture.transfer);
    let levels = texture.levels.len() as u32;
    let header = Header::new_dxgi(first.height, first.width, None, format, Some(levels), None, None)
        .map_err(|e| Error::Unsupported(format!("DDS: {e}")))?;
    let dimension = D3D10ResourceDimension::Texture2D;
    let dds = Dds {
        header,
        header10: Some(Header10::new(format, false, dimension, 1, AlphaMode::Unknown)),
        data: Vec::new(),
    };
    let mut file = Vec::new();
    dds.write(&mut file).map_err(|e| Error::Unsupported(format!("DDS: {e}")))?;
    for level in &texture.levels {
        file.extend_from_slice(&level.data);
    }
    Ok(file)
}

fn dxgi_format(format: Format, transfer: Transfer) -> DxgiFormat {
    use Transfer::{Linear, Srgb};
    match (format, transfer) {
        (Format::Bc1, Linear) => DxgiFormat::BC1_UNorm,
        (Format::Bc1, Srgb) => DxgiFormat::BC1_UNorm_sRGB,
        (Format::Bc4, _) => DxgiFormat::BC4_UNorm,
        (Format::Bc5, _) => DxgiFormat::BC5_UNorm,
        (Format::Bc7, Linear) => DxgiFormat::BC7_UNorm,
        (Format::Bc7, Srgb) => DxgiFormat::BC7_UNorm_sRGB,
        (Format::Rgba8, Linear) => DxgiFormat::R8G8B8A8_UNorm,
        (Format::Rgba8, Srgb) => DxgiFormat::R8G8B8A8_UNorm_sRGB,
        (Format::Rgba16F, _) => DxgiFormat::R16G16B16A16_Float,
    }
}

/// Reads a DDS file with a DX10 header: a 2D texture in one of our formats.
///
/// # Errors
/// [`Error::Malformed`] under the name `name`, for every file that is not exactly that.
pub fn decode_dds(name: &Path, bytes: &[u8]) -> Result<Texture, Error> {
    parse(bytes).map_err(|reason| Error::malformed(name, format!("DDS: {reason}")))
}

fn parse(bytes: &[u8]) -> Result<Texture, String> {
    // Only the headers go through the parser, which would copy the texels.
    const HEADERS: usize = 4 + 124 + 20;
    let head = &bytes[..bytes.len().min(HEADERS)];
    let dds = Dds::read(head).map_err(|e| format!("{e}; the file is damaged or truncated"))?;
    let Some(header10) = dds.header10 else {
        return Err("it has no DX10 header, so nothing says whether it is sRGB; convert it with one".into());
    };
    let Some((format, transfer)) = our_format(header10.dxgi_format) else {
        let f = header10.dxgi_format;
        return Err(format!("format {f:?} is not read; convert to BC1, BC4, BC5, BC7, RGBA8 or RGBA16F"));
    };
    let (width, height) = (dds.header.width, dds.header.height);
    check_sides(width, height)?;
    if header10.resource_dimension != D3D10ResourceDimension::Texture2D
        || header10.array_size > 1
        || header10.misc_flag.contains(MiscFlag::TEXTURECUBE)
        || dds.header.caps2.intersects(Caps2::CUBEMAP | Caps2::VOLUME)
    {
        return Err("it is a volume, an array or a cube; only plain 2D textures are read".into());
    }
    let level_count = dds.header.mip_map_count.unwrap_or(1).max(1) as usize;
    if level_count > full_level_count(width, height) {
        return Err(format!("it claims {level_count} levels, more than {width}x{height} can have"));
    }

    let mut rest = &bytes[HEADERS..];
    let mut levels = Vec::with_capacity(level_count);
    for i in 0..level_count {
        let (width, height) = (level_size(width, i), level_size(height, i));
        let wanted = format.level_bytes(width, height);
        let Some((data, after)) = rest.split_at_checked(wanted) else {
            let left = rest.len();
            return Err(format!(
                "level {i}, {width}x{height} in {format:?}, needs {wanted} bytes, {left} are left"
            ));
        };
        levels.push(Level { width, height, data: data.to_vec() });
        rest = after;
    }
    Ok(Texture { format, transfer, levels, metadata: BTreeMap::new() })
}

fn our_format(format: DxgiFormat) -> Option<(Format, Transfer)> {
    Some(match format {
        DxgiFormat::BC1_UNorm => (Format::Bc1, Transfer::Linear),
        DxgiFormat::BC1_UNorm_sRGB => (Format::Bc1, Transfer::Srgb),
        DxgiFormat::BC4_UNorm => (Format::Bc4, Transfer::Linear),
        DxgiFormat::BC5_UNorm => (Format::Bc5, Transfer::Linear),
        DxgiFormat::BC7_UNorm => (Format::Bc7, Transfer::Linear),
        DxgiFormat::BC7_UNorm_sRGB => (Format::Bc7, Transfer::Srgb),
        DxgiFormat::R8G8B8A8_UNorm => (Format::Rgba8, Transfer::Linear),
        DxgiFormat::R8G8B8A8_UNorm_sRGB => (Format::Rgba8, Transfer::Srgb),
        DxgiFormat::R16G16B16A16_Float => (Format::Rgba16F, Transfer::Linear),
        _ => return None,
    })
}
