//! Texels to and from the formats GPUs sample: BC1, BC4, BC5, BC7, RGBA8 and half floats, and UASTC, which becomes one of
//! theirs.
//!
//! Blocks are encoded independently of each other and images in strips of whole block rows, so the bytes
//! depend neither on the number of threads nor on where an image was cut. [`Encoder::Portable`] gives the
//! same bytes on every machine. [`Encoder::Ispc`] picks SSE2, SSE4, AVX or AVX2 code when it runs, whose
//! float rounding differs: the same bytes on the same kind of CPU only.

use half::f16;
use half::slice::HalfFloatSliceExt;
use rayon::prelude::*;

use crate::basis;
use crate::image::check_sides;
use crate::opaque::{keep_opaque, with_own_alpha};
use crate::{Error, Format};

/// Who compresses blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Encoder {
    /// Intel's ISPC texture compressor (`intel_tex_2`), in builds with the feature `ispc`.
    Ispc,
    /// The `dds` crate: safe Rust, everywhere, same bytes on every machine.
    Portable,
}

/// How much time a block may cost.
///
/// Speed on one core in MPix/s and error in dB (PSNR of the channels the format keeps), on the woven maps of
/// `benches/block.rs`, AMD EPYC of the first generation, `cargo bench -p kinran-image --bench block -- --table`.
/// Speeds are good to about a fifth; decoded by `bcdec_rs`. ISPC's BC7 is slower by the blocks that are fitted again so
/// that opaque ones stay opaque: on an AMD EPYC of the third generation Fast went from 42.6 to 19.1 MPix/s, Normal from 6.0
/// to 5.8, Best not measurably; colour lost 0.02 dB at most on these maps, 0.2 dB on smooth gradients. The portable encoder
/// has no such blocks here.
///
/// | format, map | encoder | Fast | Normal | Best |
/// |---|---|---|---|---|
/// | BC7 colour | ISPC | 13, 41.8 dB | 3, 47.0 dB | 0.6, 47.2 dB |
/// | BC7 colour | portable | 1.6, 43.5 dB | 0.3, 46.7 dB | 0.1, 47.7 dB |
/// | BC7 aniso | ISPC | 12, 37.3 dB | 3, 43.3 dB | 0.6, 43.8 dB |
/// | BC7 aniso | portable | 1.5, 42.0 dB | 0.4, 43.6 dB | 0.1, 43.9 dB |
/// | BC5 normal | ISPC | 220, 40.2 dB | the same | the same |
/// | BC5 normal | portable | 39, 41.4 dB | 17, 41.9 dB | 3.7, 43.2 dB |
/// | BC4 normal X | ISPC | 270, 40.2 dB | the same | the same |
/// | BC4 normal X | portable | 65, 41.4 dB | 30, 41.9 dB | 7.9, 43.3 dB |
/// | BC1 colour | ISPC | 320, 37.9 dB | the same | the same |
/// | BC1 colour | portable | 16, 38.8 dB | 6.7, 38.9 dB | 1.6, 39.2 dB |
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Preset {
    /// For previews: ISPC "ultra fast", portable "fast".
    Fast,
    /// For every day: ISPC "very fast", portable "normal".
    Normal,
    /// For release builds: ISPC "basic", portable "high". ISPC's "slow" takes seven times as long as "basic"
    /// for a gain of 0.1 to 0.2 dB and is left out.
    Best,
}

/// A block format and how to get there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Encoding {
    /// The layout of the bytes.
    pub format: Format,
    /// Who compresses; of [`Format::Uastc`], which has one encoder, it says nothing.
    pub encoder: Encoder,
    /// How long that may take.
    pub preset: Preset,
}

/// What a map holds, as far as its compression is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Role {
    /// What an eye sees: albedo, emission.
    Color,
    /// The X and Y of unit vectors.
    Normal,
    /// The three numbers of an anisotropic lobe.
    Aniso,
    /// Up to four unrelated masks: occlusion, roughness, metallic, height.
    Data,
}

impl Role {
    /// The measured default (the numbers stand at [`Preset`]).
    ///
    /// - Normals: portable BC5 at its fastest. It is 1.2 dB better than ISPC's and still ten times as fast as
    ///   the BC7 of the map that goes with it.
    /// - All others: ISPC BC7 "very fast", at 5 to 6 dB above "ultra fast" and within half a decibel of what
    ///   takes five times as long. Without the feature `ispc` the portable encoder at its fastest: half the
    ///   speed, 1.3 dB less on aniso maps, 3.6 dB less on colour.
    pub fn encoding(self) -> Encoding {
        let bc7 = if cfg!(feature = "ispc") {
            Encoding { format: Format::Bc7, encoder: Encoder::Ispc, preset: Preset::Normal }
        } else {
            Encoding { format: Format::Bc7, encoder: Encoder::Portable, preset: Preset::Fast }
        };
        match self {
            Role::Normal => {
                Encoding { format: Format::Bc5, encoder: Encoder::Portable, preset: Preset::Fast }
            }
            Role::Color | Role::Aniso | Role::Data => bc7,
        }
    }
}

/// Block rows in one unit of work: 16 texel rows, about 20 ms of BC7 at a width of 4096.
const STRIP_ROWS: usize = 4;

/// Encodes 8-bit RGBA texels, on the calling thread alone.
///
/// `rgba8` is `width * height * 4` bytes, rows packed, R first. BC1 keeps R, G and B, BC4 keeps R, BC5
/// keeps R and G. Sides that are no multiple of 4 are filled up by repeating the last texel. Blocks of
/// one colour decode to exactly that colour in BC4, BC5, BC7 and UASTC (in BC5 each channel by itself), opaque texels to
/// alpha 255 in all formats (in UASTC where all of a block are).
/// Encoding a part that starts at a multiple of 4 rows gives exactly the corresponding bytes of the whole.
///
/// # Errors
/// [`Error::Unsupported`] where a side is 0 or above [`MAX_SIDE`](crate::MAX_SIDE), `rgba8` has another
/// length, the format is [`Format::Rgba16F`] (see [`encode_half`]), or the encoder is not built in.
pub fn encode(encoding: Encoding, rgba8: &[u8], width: u32, height: u32) -> Result<Vec<u8>, Error> {
    check_request(encoding, rgba8, width, height)?;
    if encoding.format == Format::Rgba8 {
        return Ok(rgba8.to_vec());
    }
    let mut out = vec![0; encoding.format.level_bytes(width, height)];
    for (i, strip) in out.chunks_mut(strip_bytes(encoding.format, width)).enumerate() {
        encode_strip(encoding, rgba8, width, height, i * STRIP_ROWS, strip)?;
    }
    Ok(out)
}

/// [`encode`] on all threads of the current rayon pool, to the same bytes.
///
/// # Errors
/// As [`encode`].
pub fn encode_parallel(encoding: Encoding, rgba8: &[u8], width: u32, height: u32) -> Result<Vec<u8>, Error> {
    check_request(encoding, rgba8, width, height)?;
    if encoding.format == Format::Rgba8 {
        return Ok(rgba8.to_vec());
    }
    let mut out = vec![0; encoding.format.level_bytes(width, height)];
    out.par_chunks_mut(strip_bytes(encoding.format, width))
        .enumerate()
        .try_for_each(|(i, strip)| encode_strip(encoding, rgba8, width, height, i * STRIP_ROWS, strip))?;
    Ok(out)
}

fn strip_bytes(format: Format, width: u32) -> usize {
    format.level_bytes(width, 4) * STRIP_ROWS
}

fn check_request(encoding: Encoding, rgba8: &[u8], width: u32, height: u32) -> Result<(), Error> {
    check_sides(width, height).map_err(Error::Unsupported)?;
    let wanted = width as usize * height as usize * 4;
    if rgba8.len() != wanted {
        let got = rgba8.len();
        return Err(Error::Unsupported(format!("{width}x{height} RGBA8 takes {wanted} bytes, got {got}")));
    }
    if encoding.format == Format::Rgba16F {
        return Err(Error::Unsupported("half floats are encoded from floats, by encode_half".into()));
    }
    if encoding.format == Format::Uastc {
        return basis::check_request(width);
    }
    if encoding.encoder == Encoder::Ispc && !cfg!(feature = "ispc") {
        return Err(Error::Unsupported(
            "this build has no ISPC encoder; use the portable one, or build with the feature `ispc`".into(),
        ));
    }
    Ok(())
}

/// Encodes the block rows from `first` on that fill `out`.
fn encode_strip(
    encoding: Encoding,
    rgba8: &[u8],
    width: u32,
    height: u32,
    first: usize,
    out: &mut [u8],
) -> Result<(), Error> {
    let (w, h) = (width as usize, height as usize);
    let block_columns = w.div_ceil(4);
    let padded_w = block_columns * 4;
    let block_rows = out.len() / (block_columns * encoding.format.block_bytes());
    let rows = first * 4..(first + block_rows) * 4;
    debug_assert_eq!(
        out.len(),
        block_rows * block_columns * encoding.format.block_bytes(),
        "whole rows of blocks"
    );
    debug_assert!(rows.start < h && rows.end < h + 4, "rows {rows:?} of {h}");

    // BC1 is RGB here; an encoder that looks at alpha would punch holes.
    let drop_alpha = encoding.format == Format::Bc1 && encoding.encoder == Encoder::Portable;
    let mut padded = Vec::new();
    let texels = if padded_w == w && rows.end <= h && !drop_alpha {
        &rgba8[rows.start * w * 4..rows.end * w * 4]
    } else {
        padded.reserve_exact(rows.len() * padded_w * 4);
        for y in rows {
            let row = &rgba8[y.min(h - 1) * w * 4..][..w * 4];
            padded.extend_from_slice(row);
            for _ in w..padded_w {
                padded.extend_from_slice(&row[(w - 1) * 4..]);
            }
        }
        if drop_alpha {
            padded.iter_mut().skip(3).step_by(4).for_each(|a| *a = 255);
        }
        &padded
    };

    match encoding.encoder {
        _ if encoding.format == Format::Uastc => return encode_uastc(encoding.preset, texels, padded_w, out),
        Encoder::Portable => encode_portable(encoding, texels, padded_w, out)?,
        #[cfg(feature = "ispc")]
        Encoder::Ispc => encode_ispc(encoding, texels, padded_w, out),
        #[cfg(not(feature = "ispc"))]
        Encoder::Ispc => unreachable!("refused by check_request"),
    }
    if encoding.format == Format::Bc7 {
        for (i, block) in out.as_chunks_mut::<16>().0.iter_mut().enumerate() {
            let texels = block_of(texels, padded_w, i);
            if is_opaque(&texels) {
                keep_opaque(&texels, block);
            } else if loses_opaque_texels(&texels, block) {
                // At its fastest the portable encoder knows only modes that store alpha by itself here.
                let encoding = Encoding { preset: Preset::Fast, ..encoding };
                encode_portable(encoding, texels.as_flattened(), 4, block)?;
                if loses_opaque_texels(&texels, block) {
                    *block = with_own_alpha(&texels);
                }
            }
        }
    }
    write_constant_blocks(encoding.format, texels, padded_w, out);
    Ok(())
}

/// The texels of block `i` of packed rows of `width` texels, a multiple of 4.
fn block_of(texels: &[u8], width: usize, i: usize) -> [[u8; 4]; 16] {
    let corner = i / (width / 4) * 4 * width + i % (width / 4) * 4;
    std::array::from_fn(|t| {
        let at = (corner + t / 4 * width + t % 4) * 4;
        [texels[at], texels[at + 1], texels[at + 2], texels[at + 3]]
    })
}

/// Whether a texel that is opaque is not any more.
fn loses_opaque_texels(texels: &[[u8; 4]; 16], block: &[u8; 16]) -> bool {
    if texels.iter().all(|texel| texel[3] != 255) {
        return false;
    }
    let mut decoded = [0; 64];
    bcdec_rs::bc7(block, &mut decoded, 16);
    texels.iter().zip(decoded.as_chunks::<4>().0).any(|(texel, got)| texel[3] == 255 && got[3] != 255)
}

fn is_opaque(block: &[[u8; 4]; 16]) -> bool {
    block.iter().all(|texel| texel[3] == 255)
}

fn encode_portable(encoding: Encoding, texels: &[u8], width: usize, out: &mut [u8]) -> Result<(), Error> {
    let format = match encoding.format {
        Format::Bc1 => dds::Format::BC1_UNORM,
        Format::Bc4 => dds::Format::BC4_UNORM,
        Format::Bc5 => dds::Format::BC5_UNORM,
        Format::Bc7 => dds::Format::BC7_UNORM,
        Format::Uastc | Format::Rgba8 | Format::Rgba16F => unreachable!("not this encoder's"),
    };
    let mut options = dds::EncodeOptions::default();
    options.parallel = false;
    options.quality = match encoding.preset {
        Preset::Fast => dds::CompressionQuality::Fast,
        Preset::Normal => dds::CompressionQuality::Normal,
        Preset::Best => dds::CompressionQuality::High,
    };
    let size = dds::Size::new(width as u32, (texels.len() / (width * 4)) as u32);
    let view = dds::ImageView::new(texels, size, dds::ColorFormat::RGBA_U8)
        .ok_or_else(|| Error::Unsupported("the portable encoder refused the image's size".into()))?;
    let mut rest = out;
    dds::encode(&mut rest, view, format, None, &options)
        .map_err(|e| Error::Unsupported(format!("the portable encoder failed: {e}")))
}

#[cfg(feature = "uastc")]
fn encode_uastc(preset: Preset, texels: &[u8], width: usize, out: &mut [u8]) -> Result<(), Error> {
    use kinran_uastc::Effort;

    let effort = match preset {
        Preset::Fast => Effort::Fast,
        Preset::Normal => Effort::Normal,
        Preset::Best => Effort::Best,
    };
    let height = texels.len() / (width * 4);
    let blocks = kinran_uastc::encode(texels, width as u32, height as u32, effort)
        .map_err(|reason| Error::Unsupported(format!("UASTC: {reason}")))?;
    out.copy_from_slice(&blocks);
    Ok(())
}

#[cfg(not(feature = "uastc"))]
fn encode_uastc(_: Preset, _: &[u8], _: usize, _: &mut [u8]) -> Result<(), Error> {
    unreachable!("refused by check_request")
}

#[cfg(feature = "ispc")]
fn encode_ispc(encoding: Encoding, texels: &[u8], width: usize, out: &mut [u8]) {
    use intel_tex_2::{RSurface, RgSurface, RgbaSurface, bc1, bc4, bc5, bc7};

    fn channels<const N: usize>(texels: &[u8]) -> Vec<u8> {
        texels.chunks_exact(4).flat_map(|t| t[..N].iter().copied()).collect()
    }
    let (w, h) = (width as u32, (texels.len() / (width * 4)) as u32);
    match encoding.format {
        Format::Bc1 => {
            bc1::compress_blocks_into(&RgbaSurface { data: texels, width: w, height: h, stride: w * 4 }, out);
        }
        Format::Bc4 => {
            let data = &channels::<1>(texels);
            bc4::compress_blocks_into(&RSurface { data, width: w, height: h, stride: w }, out);
        }
        Format::Bc5 => {
            let data = &channels::<2>(texels);
            bc5::compress_blocks_into(&RgSurface { data, width: w, height: h, stride: w * 2 }, out);
        }
        Format::Bc7 => {
            let compress = |opaque: bool, data: &[u8], width: u32, height: u32, out: &mut [u8]| {
                let settings = match (encoding.preset, opaque) {
                    (Preset::Fast, true) => bc7::opaque_ultra_fast_settings(),
                    (Preset::Fast, false) => bc7::alpha_ultra_fast_settings(),
                    (Preset::Normal, true) => bc7::opaque_very_fast_settings(),
                    (Preset::Normal, false) => bc7::alpha_very_fast_settings(),
                    (Preset::Best, true) => bc7::opaque_basic_settings(),
                    (Preset::Best, false) => bc7::alpha_basic_settings(),
                };
                let surface = RgbaSurface { data, width, height, stride: width * 4 };
                bc7::compress_blocks_into(&settings, &surface, out);
            };
            // Opaque blocks need none of the modes with alpha, and keep theirs without. Where an image has both kinds,
            // each is put in a row of its own.
            let (opaque, others): (Vec<usize>, Vec<usize>) =
                (0..out.len() / 16).partition(|&i| is_opaque(&block_of(texels, width, i)));
            for (is_opaque, blocks) in [(true, opaque), (false, others)] {
                if blocks.len() == out.len() / 16 {
                    compress(is_opaque, texels, w, h, out);
                } else if !blocks.is_empty() {
                    let columns = blocks.len() as u32;
                    let mut row = vec![0; blocks.len() * 64];
                    for (x, &i) in blocks.iter().enumerate() {
                        for (t, texel) in block_of(texels, width, i).iter().enumerate() {
                            row[(t / 4 * blocks.len() * 4 + x * 4 + t % 4) * 4..][..4].copy_from_slice(texel);
                        }
                    }
                    let mut encoded = vec![0; blocks.len() * 16];
                    compress(is_opaque, &row, columns * 4, 4, &mut encoded);
                    for (&i, block) in blocks.iter().zip(encoded.chunks_exact(16)) {
                        out[i * 16..][..16].copy_from_slice(block);
                    }
                }
            }
        }
        Format::Uastc | Format::Rgba8 | Format::Rgba16F => unreachable!("not this encoder's"),
    }
}

/// Replaces blocks of one colour by ones that decode to exactly that colour.
fn write_constant_blocks(format: Format, texels: &[u8], width: usize, out: &mut [u8]) {
    let block_columns = width / 4;
    for (i, block) in out.chunks_exact_mut(format.block_bytes()).enumerate() {
        let corner = (i / block_columns * 4 * width + i % block_columns * 4) * 4;
        let first = [texels[corner], texels[corner + 1], texels[corner + 2], texels[corner + 3]];
        let constant = |channel: usize| {
            (0..16).all(|t| texels[corner + (t / 4 * width + t % 4) * 4 + channel] == first[channel])
        };
        match format {
            Format::Bc4 => {
                if constant(0) {
                    block.copy_from_slice(&constant_bc4(first[0]));
                }
            }
            Format::Bc5 => {
                for (channel, half) in block.chunks_exact_mut(8).enumerate() {
                    if constant(channel) {
                        half.copy_from_slice(&constant_bc4(first[channel]));
                    }
                }
            }
            Format::Bc7 => {
                if (0..4).all(constant) {
                    block.copy_from_slice(&constant_bc7(first));
                }
            }
            Format::Bc1 | Format::Uastc | Format::Rgba8 | Format::Rgba16F => {}
        }
    }
}

/// The BC4 block whose texels are all `value`: both end points, and every index at the first.
fn constant_bc4(value: u8) -> [u8; 8] {
    [value, value, 0, 0, 0, 0, 0, 0]
}

/// The BC7 block whose texels are all `rgba`.
///
/// Modes whose end points share their lowest bit among the channels (mode 6) reach only colours that are all
/// even or all odd there: of 4096 opaque colours, 3840 random and 256 greys, ISPC misses 2909 at "ultra
/// fast", 25 at "very fast" and 6 at "basic" by 1/255; the portable encoder misses none. Mode 5 stores colour
/// with 7 bits but interpolates between two of them, and a third of the way lies every value of 8 bits; its
/// alpha has 8.
fn constant_bc7(rgba: [u8; 4]) -> [u8; 16] {
    let mut bits: u128 = 1 << 5;
    let mut at = 8;
    let mut put = |value: u8, count: u32| {
        bits |= u128::from(value) << at;
        at += count;
    };
    for channel in &rgba[..3] {
        let [a, b] = MODE_5_ENDS[usize::from(*channel)];
        put(a, 7);
        put(b, 7);
    }
    put(rgba[3], 8);
    put(rgba[3], 8);
    // Index 1 for all colours: the first texel's has one bit, the others' two. Alpha indices stay 0.
    put(1, 1);
    for _ in 1..16 {
        put(1, 2);
    }
    bits.to_le_bytes()
}

/// For each value of 8 bits the two 7-bit end points that interpolate to it with weight 21/64, the second
/// of the four weights of 2-bit indices (Khronos Data Format 1.4, section 20.1, tables of BPTC).
const MODE_5_ENDS: [[u8; 2]; 256] = {
    let mut ends = [[0; 2]; 256];
    let mut value = 0;
    while value < 256 {
        // Both lie next to the value's upper 7 bits, at most one step apart.
        let near = value as i32 / 2;
        let mut found = false;
        let mut k = 0;
        while k < 9 {
            let (a, b) = (near + k / 3 - 1, near + k % 3 - 1);
            if a >= 0 && b >= 0 && a < 128 && b < 128 {
                let (wide_a, wide_b) = (a << 1 | a >> 6, b << 1 | b >> 6);
                if ((64 - 21) * wide_a + 21 * wide_b + 32) >> 6 == value as i32 {
                    ends[value] = [a as u8, b as u8];
                    found = true;
                }
            }
            k += 1;
        }
        assert!(found, "every value of 8 bits has its pair");
        value += 1;
    }
    ends
};

/// Encodes float texels as [`Format::Rgba16F`], rounding to the nearest half float, ties to even.
///
/// # Errors
/// [`Error::Unsupported`] naming the first texel that is NaN, infinite or rounds beyond 65504, the largest
/// half float.
pub fn encode_half(rgba: &[[f32; 4]]) -> Result<Vec<u8>, Error> {
    let mut halves = vec![f16::ZERO; rgba.len() * 4];
    halves.convert_from_f32_slice(rgba.as_flattened());
    if let Some(i) = halves.iter().position(|h| !h.is_finite()) {
        let (texel, channel, value) = (i / 4, i % 4, rgba[i / 4][i % 4]);
        return Err(Error::Unsupported(format!(
            "texel {texel} is {value} in channel {channel}; half floats end at 65504, scale the map down"
        )));
    }
    Ok(halves.reinterpret_cast().iter().flat_map(|bits: &u16| bits.to_le_bytes()).collect())
}

/// Decodes a level to the values a sampler reads: unsigned normalised channels in 0 to 1, floats as they
/// are, missing channels 0 and missing alpha 1. BC4 and BC5 interpolate in floats as GPUs do, so their
/// values are not all multiples of 1/255. sRGB is not linearised.
///
/// # Errors
/// [`Error::Unsupported`] where a side is 0 or above [`MAX_SIDE`](crate::MAX_SIDE), `data` is not
/// [`Format::level_bytes`] long, or a block of UASTC is none.
pub fn decode(format: Format, data: &[u8], width: u32, height: u32) -> Result<Vec<[f32; 4]>, Error> {
    check_sides(width, height).map_err(Error::Unsupported)?;
    let wanted = format.level_bytes(width, height);
    if data.len() != wanted {
        let got = data.len();
        return Err(Error::Unsupported(format!(
            "{width}x{height} in {format:?} takes {wanted} bytes, got {got}"
        )));
    }
    let w = width as usize;
    let mut texels = vec![[0.0; 4]; w * height as usize];
    let side = format.block_side() as usize;
    let row_bytes = format.level_bytes(width, 1);
    if format == Format::Uastc {
        let rows = w * side * basis::DECODED_ROWS;
        texels
            .par_chunks_mut(rows)
            .zip(data.par_chunks(row_bytes * basis::DECODED_ROWS))
            .try_for_each(|(texels, blocks)| basis::decode_blocks(blocks, width, texels))
            .map_err(|reason| Error::Unsupported(format!("{width}x{height} in {format:?}: {reason}")))?;
        return Ok(texels);
    }
    texels.par_chunks_mut(w * side).zip(data.par_chunks(row_bytes)).for_each(|(rows, blocks)| {
        let block_height = rows.len() / w;
        for (bx, block) in blocks.chunks_exact(format.block_bytes()).enumerate() {
            let block = decode_block(format, block);
            let x = bx * side;
            let block_width = side.min(w - x);
            for y in 0..block_height {
                rows[y * w + x..][..block_width].copy_from_slice(&block[y * side..][..block_width]);
            }
        }
    });
    Ok(texels)
}

/// The texels of one block, row by row; formats without blocks fill the first only.
fn decode_block(format: Format, block: &[u8]) -> [[f32; 4]; 16] {
    let mut texels = [[0.0, 0.0, 0.0, 1.0]; 16];
    let mut bytes = [0u8; 64];
    match format {
        Format::Bc1 | Format::Bc7 => {
            let decode = if format == Format::Bc1 { bcdec_rs::bc1 } else { bcdec_rs::bc7 };
            decode(block, &mut bytes, 16);
            for (texel, b) in texels.iter_mut().zip(bytes.as_chunks::<4>().0) {
                *texel = b.map(|s| f32::from(s) / 255.0);
            }
        }
        Format::Bc4 => {
            let mut red = [0.0; 16];
            bcdec_rs::bc4_float(block, &mut red, 4, false);
            for (texel, r) in texels.iter_mut().zip(red) {
                texel[0] = r;
            }
        }
        Format::Bc5 => {
            let mut red_green = [0.0; 32];
            bcdec_rs::bc5_float(block, &mut red_green, 8, false);
            for (texel, [r, g]) in texels.iter_mut().zip(red_green.as_chunks::<2>().0) {
                (texel[0], texel[1]) = (*r, *g);
            }
        }
        Format::Uastc => unreachable!("decoded row by row"),
        Format::Rgba8 => texels[0] = std::array::from_fn(|c| f32::from(block[c]) / 255.0),
        Format::Rgba16F => {
            texels[0] =
                std::array::from_fn(|c| f16::from_le_bytes([block[2 * c], block[2 * c + 1]]).to_f32());
        }
    }
    texels
}
