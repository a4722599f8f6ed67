//! DDS containers (Microsoft, "Programming Guide for DDS"), written with the DX10 header, read with the older one too.

use std::collections::BTreeMap;
use std::path::Path;

use ddsfile::{
    AlphaMode, Caps2, D3D10ResourceDimension, Dds, DxgiFormat, Header, Header10, MiscFlag, PixelFormat,
    PixelFormatFlags,
};

use crate::image::check_sides;
use crate::texture::{full_level_count, level_size};
use crate::{Error, Format, Level, Texture, Transfer};

/// The bytes of a texture as a DDS file. DDS has no place for metadata.
///
/// # Errors
/// [`Error::Unsupported`] where [`Texture::check`] refuses the texture, its format is [`Format::Uastc`], which DDS has no
/// number for, or level 0 takes 4 GiB or more, which the header cannot say.
pub fn encode_dds(texture: &Texture) -> Result<Vec<u8>, Error> {
    texture.check()?;
    texture.check_transfer()?;
    let first = &texture.levels[0];
    if u32::try_from(first.data.len()).is_err() {
        return Err(Error::Unsupported("DDS holds less than 4 GiB; write KTX2 or a block format".into()));
    }
    let format = dxgi_format(texture.format, texture.transfer)
        .ok_or_else(|| Error::Unsupported("DDS holds no UASTC; write KTX2 or another format".into()))?;
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

fn dxgi_format(format: Format, transfer: Transfer) -> Option<DxgiFormat> {
    use Transfer::Srgb;
    Some(match (format, transfer) {
        (Format::Uastc, _) => return None,
        (Format::Bc1, Srgb) => DxgiFormat::BC1_UNorm_sRGB,
        (Format::Bc1, _) => DxgiFormat::BC1_UNorm,
        (Format::Bc4, _) => DxgiFormat::BC4_UNorm,
        (Format::Bc5, _) => DxgiFormat::BC5_UNorm,
        (Format::Bc7, Srgb) => DxgiFormat::BC7_UNorm_sRGB,
        (Format::Bc7, _) => DxgiFormat::BC7_UNorm,
        (Format::Rgba8, Srgb) => DxgiFormat::R8G8B8A8_UNorm_sRGB,
        (Format::Rgba8, _) => DxgiFormat::R8G8B8A8_UNorm,
        (Format::Rgba16F, _) => DxgiFormat::R16G16B16A16_Float,
    })
}

/// Reads a DDS file: a 2D texture in one of our formats, or in 8 to 32 bits a texel with channels of whole bytes in any
/// order, which become RGBA8.
///
/// Headers that are older than DirectX 10 (`DXT1`, `ATI1`, `ATI2`, `BC4U`, `BC5U`, plain ones) and typeless formats do not
/// say whether colour is sRGB: [`Transfer::Unsaid`], but for BC4 and BC5, which cannot be.
///
/// # Errors
/// [`Error::Malformed`] under the name `name`, for every file that is not exactly that.
pub fn decode_dds(name: &Path, bytes: &[u8]) -> Result<Texture, Error> {
    parse(bytes).map_err(|reason| Error::malformed(name, format!("DDS: {reason}")))
}

/// A file's layout: the format its texels get, what is known of their colours, and where the bytes of plain ones are.
type Layout = (Format, Transfer, Option<Order>);

/// Where texels of whole bytes have their channels.
#[derive(Clone, Copy)]
struct Order {
    /// Bytes of a texel.
    bytes: usize,
    /// Which of them hold red, green, blue and alpha; what is not there is 255.
    channels: [Option<usize>; 4],
}

fn parse(bytes: &[u8]) -> Result<Texture, String> {
    // Only the headers go through the parser, which would copy the texels.
    const HEADER: usize = 4 + 124;
    const HEADERS: usize = HEADER + 20;
    let head = &bytes[..bytes.len().min(HEADERS)];
    let dds = Dds::read(head).map_err(|e| format!("{e}; the file is damaged or truncated, save it again"))?;
    let (layout, data) = match &dds.header10 {
        Some(header10) => {
            let f = header10.dxgi_format;
            (modern(f).ok_or_else(|| format!("format {f:?}")), HEADERS)
        }
        None => (legacy(&dds.header.spf, head), HEADER),
    };
    let (format, transfer, order) = layout
        .map_err(|format| format!("{format} is not read; convert to BC1, BC4, BC5, BC7, RGBA8 or RGBA16F"))?;
    let (width, height) = (dds.header.width, dds.header.height);
    check_sides(width, height)?;
    let array = dds.header10.as_ref().is_some_and(|header10| {
        header10.resource_dimension != D3D10ResourceDimension::Texture2D
            || header10.array_size > 1
            || header10.misc_flag.contains(MiscFlag::TEXTURECUBE)
    });
    if array || dds.header.caps2.intersects(Caps2::CUBEMAP | Caps2::VOLUME) {
        return Err("it is a volume, an array or a cube; only plain 2D textures are read".into());
    }
    let level_count = dds.header.mip_map_count.unwrap_or(1).max(1) as usize;
    if level_count > full_level_count(width, height) {
        return Err(format!("it claims {level_count} levels, more than {width}x{height} can have"));
    }

    let mut rest = &bytes[data..];
    let mut levels = Vec::with_capacity(level_count);
    for i in 0..level_count {
        let (width, height) = (level_size(width, i), level_size(height, i));
        let wanted = match order {
            Some(order) => width as usize * height as usize * order.bytes,
            None => format.level_bytes(width, height),
        };
        let Some((data, after)) = rest.split_at_checked(wanted) else {
            let left = rest.len();
            return Err(format!(
                "level {i}, {width}x{height} in {format:?}, needs {wanted} bytes, {left} are left"
            ));
        };
        let texel = |order: Order, texel: &[u8]| order.channels.map(|at| at.map_or(255, |at| texel[at]));
        let data = match order {
            Some(order) => data.chunks_exact(order.bytes).flat_map(|t| texel(order, t)).collect(),
            None => data.to_vec(),
        };
        levels.push(Level { width, height, data });
        rest = after;
    }
    Ok(Texture { format, transfer, levels, metadata: BTreeMap::new() })
}

/// Blue first, as Windows has it.
const BGRA: Option<Order> = Some(Order { bytes: 4, channels: [Some(2), Some(1), Some(0), Some(3)] });
const BGRX: Option<Order> = Some(Order { bytes: 4, channels: [Some(2), Some(1), Some(0), None] });

fn modern(format: DxgiFormat) -> Option<Layout> {
    use DxgiFormat as F;
    use Transfer::{Linear, Srgb, Unsaid};
    Some(match format {
        F::BC1_UNorm => (Format::Bc1, Linear, None),
        F::BC1_UNorm_sRGB => (Format::Bc1, Srgb, None),
        F::BC1_Typeless => (Format::Bc1, Unsaid, None),
        F::BC4_UNorm | F::BC4_Typeless => (Format::Bc4, Linear, None),
        F::BC5_UNorm | F::BC5_Typeless => (Format::Bc5, Linear, None),
        F::BC7_UNorm => (Format::Bc7, Linear, None),
        F::BC7_UNorm_sRGB => (Format::Bc7, Srgb, None),
        F::BC7_Typeless => (Format::Bc7, Unsaid, None),
        F::R8G8B8A8_UNorm => (Format::Rgba8, Linear, None),
        F::R8G8B8A8_UNorm_sRGB => (Format::Rgba8, Srgb, None),
        F::R8G8B8A8_Typeless => (Format::Rgba8, Unsaid, None),
        F::B8G8R8A8_UNorm => (Format::Rgba8, Linear, BGRA),
        F::B8G8R8A8_UNorm_sRGB => (Format::Rgba8, Srgb, BGRA),
        F::B8G8R8A8_Typeless => (Format::Rgba8, Unsaid, BGRA),
        F::B8G8R8X8_UNorm => (Format::Rgba8, Linear, BGRX),
        F::B8G8R8X8_UNorm_sRGB => (Format::Rgba8, Srgb, BGRX),
        F::B8G8R8X8_Typeless => (Format::Rgba8, Unsaid, BGRX),
        F::R16G16B16A16_Float => (Format::Rgba16F, Linear, None),
        _ => return None,
    })
}

/// Where a header has the mask of red, or of grey.
const RED_MASK: usize = 92;

/// The layout that a header from before DirectX 10 describes, or what to call it where it is none of ours.
fn legacy(pixels: &PixelFormat, head: &[u8]) -> Result<Layout, String> {
    /// `D3DFMT_A16B16G16R16F`.
    const HALF_FLOATS: u32 = 113;
    use Transfer::{Linear, Unsaid};
    if let Some(code) = &pixels.fourcc {
        return Ok(match &code.0.to_le_bytes() {
            b"DXT1" => (Format::Bc1, Unsaid, None),
            b"ATI1" | b"BC4U" => (Format::Bc4, Linear, None),
            b"ATI2" | b"BC5U" | b"A2XY" => (Format::Bc5, Linear, None),
            _ if code.0 == HALF_FLOATS => (Format::Rgba16F, Linear, None),
            letters if letters.iter().all(u8::is_ascii_graphic) => {
                return Err(format!("format \"{}\"", String::from_utf8_lossy(letters)));
            }
            _ => return Err(format!("format {}", code.0)),
        });
    }
    // Masks of whole bytes.
    let byte = |mask: Option<u32>| match mask {
        Some(0xff) => Some(0),
        Some(0xff00) => Some(1),
        Some(0xff_0000) => Some(2),
        Some(0xff00_0000) => Some(3),
        _ => None,
    };
    // The parser leaves out the mask of what is grey.
    let red = head.get(RED_MASK..RED_MASK + 4).and_then(|mask| mask.try_into().ok()).map(u32::from_le_bytes);
    let red = byte(red);
    let color = if pixels.flags.contains(PixelFormatFlags::RGB) {
        [red, byte(pixels.g_bit_mask), byte(pixels.b_bit_mask)]
    } else if pixels.flags.contains(PixelFormatFlags::LUMINANCE) {
        [red; 3]
    } else {
        [None; 3]
    };
    let alpha = pixels.a_bit_mask.filter(|mask| *mask != 0).map(|mask| byte(Some(mask)));
    let bits = pixels.rgb_bit_count.unwrap_or(0);
    let (bytes, channels) = (bits as usize / 8, [color[0], color[1], color[2], alpha.flatten()]);
    let is_plain = bits.is_multiple_of(8)
        && bytes <= 4
        && color.iter().all(Option::is_some)
        && alpha != Some(None)
        && channels.iter().flatten().all(|&at| at < bytes);
    match pixels.rgb_bit_count {
        _ if is_plain => Ok((Format::Rgba8, Unsaid, Some(Order { bytes, channels }))),
        Some(bits) => Err(format!("a plain format of {bits} bits a texel")),
        None => Err("a format without a name".into()),
    }
}
