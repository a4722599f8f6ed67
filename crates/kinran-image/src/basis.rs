//! Basis Universal in KTX2: blocks of UASTC, written and read, and other people's ETC1S, read.
//!
//! UASTC LDR 4x4 (Binomial, "UASTC Texture Specification") is a subset of ASTC 4x4 that turns into BC7, ASTC, ETC2 and
//! others without being decoded: what `KHR_texture_basisu` allows in glTF beside ETC1S. It is decoded by the crate
//! `basisu`.

use basisu::{DecodeFlags, TargetFormat, Transcoder};
use rayon::prelude::*;

use crate::image::MAX_IMAGE_BYTES;
use crate::{Error, Format, Transfer};

/// The two texel formats of Basis Universal that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Uastc,
    Etc1s,
}

/// Refuses what cannot be encoded.
pub(crate) fn check_request(width: u32) -> Result<(), Error> {
    if !Format::Uastc.has_encoder() {
        return Err(Error::Unsupported(
            "this build has no encoder for UASTC; build with the feature `uastc`, or choose another format"
                .into(),
        ));
    }
    if width > MAX_WIDTH {
        return Err(Error::Unsupported(format!("UASTC ends at {MAX_WIDTH} texels a row, not {width}")));
    }
    Ok(())
}

/// Texels in a row that the encoder takes.
const MAX_WIDTH: u32 = 16384;

/// Rows of blocks that are decoded at a time: the decoder takes whole files, and the header that each piece gets is 0.2 % of
/// one of 1024 texels a row; chosen by eye.
pub(crate) const DECODED_ROWS: usize = 16;

/// Decodes rows of blocks, at most [`DECODED_ROWS`], to packed rows of `width` texels.
pub(crate) fn decode_blocks(blocks: &[u8], width: u32, texels: &mut [[f32; 4]]) -> Result<(), String> {
    let decoded = rgba8(blocks, width, texels.len() as u32 / width)?;
    for (texel, rgba) in texels.iter_mut().zip(decoded.as_chunks::<4>().0) {
        *texel = rgba.map(|sample| f32::from(sample) / 255.0);
    }
    Ok(())
}

/// Whether all texels of blocks, rows of `width` texels, are opaque; an error where a block is none of UASTC.
pub(crate) fn is_opaque(blocks: &[u8], width: u32) -> Result<bool, String> {
    let row_bytes = width.div_ceil(4) as usize * 16;
    let strips = blocks.par_chunks(row_bytes * DECODED_ROWS);
    let opaque = strips.map(|blocks| {
        let height = (blocks.len() / row_bytes * 4) as u32;
        let decoded = rgba8(blocks, width, height)?;
        Ok(decoded.as_chunks::<4>().0.iter().all(|texel| texel[3] == 255))
    });
    opaque.try_reduce(|| true, |a, b| Ok(a && b))
}

fn rgba8(blocks: &[u8], width: u32, height: u32) -> Result<Vec<u8>, String> {
    let file = plain_file(blocks, width, height);
    Transcoder::new(&file)
        .and_then(|file| file.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE))
        .map_err(|_| "a block is none of UASTC; the file is damaged".into())
}

/// A KTX2 file around one level of UASTC, for the decoder: header, index of levels, descriptor, blocks (KTX File Format
/// Specification 2.0.4, section 3).
fn plain_file(blocks: &[u8], width: u32, height: u32) -> Vec<u8> {
    const DESCRIPTOR: u32 = 80 + 24;
    const LEVEL: u32 = DESCRIPTOR + 44 + 12;
    let mut file = ktx2::MAGIC.to_vec();
    // Format, size of a type, sides, depth, layers, faces, levels, scheme, and the index of the sections.
    for word in [0, 1, width, height, 0, 0, 1, 1, 0, DESCRIPTOR, 44, 0, 0, 0, 0, 0, 0] {
        file.extend(u32::to_le_bytes(word));
    }
    for number in [u64::from(LEVEL), blocks.len() as u64, blocks.len() as u64] {
        file.extend(number.to_le_bytes());
    }
    file.extend(44u32.to_le_bytes());
    file.extend(descriptor(Transfer::Linear, true));
    file.resize(LEVEL as usize, 0);
    file.extend_from_slice(blocks);
    file
}

/// The colour models of UASTC and ETC1S (Khronos Data Format 1.4, table 5.6).
const MODEL_UASTC: u8 = 166;
const MODEL_ETC1S: u8 = 163;

/// The basic data format descriptor block of UASTC (Khronos Data Format 1.4, section 5).
///
/// One sample of 128 bits, in a block of 4 x 4 texels and 16 bytes (also under Zstandard, KTX 2.0.4 section 3.10.2); its
/// channel is RGB (0) or RGBA (3). Of linear maps the primaries are unspecified, as `KHR_texture_basisu` wants.
pub(crate) fn descriptor(transfer: Transfer, alpha: bool) -> [u8; 40] {
    let (primaries, function) = if transfer == Transfer::Srgb { (1, 2) } else { (0, 1) };
    let channel: u32 = if alpha { 3 } else { 0 };
    let model = u32::from_le_bytes([MODEL_UASTC, primaries, function, 0]);
    let words = [0, 2 | 40 << 16, model, 0x0303, 16, 0, 127 << 16 | channel << 24, 0, 0, u32::MAX];
    let mut bytes = [0; 40];
    for (bytes, word) in bytes.as_chunks_mut().0.iter_mut().zip(words) {
        *bytes = word.to_le_bytes();
    }
    bytes
}

/// What the descriptor of a file without a Vulkan format says.
pub(crate) fn described(file: &[u8], offset: usize) -> Result<(Kind, Transfer), String> {
    let descriptor = file.get(offset..).and_then(<[u8]>::first_chunk::<16>);
    let Some([.., model, _, function, _]) = descriptor else {
        return Err(crate::error::TRUNCATED.into());
    };
    let transfer = if *function == 2 { Transfer::Srgb } else { Transfer::Linear };
    match *model {
        MODEL_UASTC => Ok((Kind::Uastc, transfer)),
        MODEL_ETC1S => Ok((Kind::Etc1s, transfer)),
        model => Err(format!(
            "its colour model is {model}; of Basis Universal's ETC1S and UASTC with 8 bits are read"
        )),
    }
}

/// The texels of each level of an ETC1S file, as RGBA of 8 bits.
pub(crate) fn decode_etc1s(
    file: &[u8],
    width: u32,
    height: u32,
    levels: usize,
) -> Result<Vec<Vec<u8>>, String> {
    if u64::from(width) * u64::from(height) * 4 > MAX_IMAGE_BYTES {
        return Err(format!("{width}x{height} texels of ETC1S are too many"));
    }
    let damaged = "the file is damaged, or of a kind of ETC1S that is not read";
    let transcoder = Transcoder::new(file).map_err(|_| damaged)?;
    let level = |level: usize| {
        transcoder
            .transcode(level as u32, TargetFormat::Rgba32, DecodeFlags::NONE)
            .map_err(|_| format!("level {level}: {damaged}"))
    };
    (0..levels).map(level).collect()
}
