//! UASTC blocks by the encoder of Basis Universal 1.16 (C++, Apache-2.0, Binomial LLC).
//!
//! The one crate of the workspace with `unsafe` in it: the calls to C++.
//!
//! ```
//! let grey = [128; 4 * 4 * 4];
//! let block = kinran_uastc::encode(&grey, 4, 4, kinran_uastc::Effort::Fast)?;
//! assert_eq!(block.len(), 16);
//! # Ok::<(), String>(())
//! ```

use std::sync::Once;

use basis_universal_sys as sys;

/// The longest side that the encoder takes.
pub const MAX_SIDE: u32 = 16384;

/// How long the encoder looks for the best mode of a block.
///
/// Levels of its scale of 0 to 4; from 3 on it takes ten times as long as 1 for a gain of 0.2 dB at most on normals and
/// masks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Level 0, "fastest".
    Fast,
    /// Level 1, "faster".
    Normal,
    /// Level 2, "default".
    Best,
}

/// Blocks of 16 bytes, row by row, of 8-bit RGBA texels, on the calling thread alone.
///
/// `rgba8` is `width * height * 4` bytes, rows packed. Each block depends on its own 16 texels and on nothing else; blocks
/// of one colour decode to exactly that colour.
///
/// # Errors
/// Where a side is 0, no multiple of 4 or above [`MAX_SIDE`], `rgba8` has another length, or the encoder fails.
pub fn encode(rgba8: &[u8], width: u32, height: u32, effort: Effort) -> Result<Vec<u8>, String> {
    let is_side = |side: u32| side > 0 && side.is_multiple_of(4) && side <= MAX_SIDE;
    if !is_side(width) || !is_side(height) {
        return Err(format!("{width}x{height}: sides are multiples of 4 from 4 to {MAX_SIDE}"));
    }
    let wanted = width as usize * height as usize * 4;
    if rgba8.len() != wanted {
        return Err(format!("{width}x{height} RGBA8 takes {wanted} bytes, got {}", rgba8.len()));
    }
    let file = basis_file(rgba8, width, height, effort)?;
    only_slice(&file)
        .filter(|blocks| blocks.len() == wanted / 4)
        .map(<[u8]>::to_vec)
        .ok_or_else(|| "the encoder's file does not hold the blocks that were asked for".into())
}

/// The blocks of a .basis file with one slice.
///
/// Layout (`basisu_file_headers.h`): the header has the offset of the table of slices at byte 65; in the table's first entry
/// stand the offset of the slice's bytes at 13 and their count at 17.
fn only_slice(file: &[u8]) -> Option<&[u8]> {
    let number = |at: usize| Some(u32::from_le_bytes(*file.get(at..)?.first_chunk()?) as usize);
    let entry = number(65)?;
    let (offset, length) = (number(entry.checked_add(13)?)?, number(entry.checked_add(17)?)?);
    file.get(offset..offset.checked_add(length)?)
}

/// What the encoder makes of an image: a .basis file.
#[allow(unsafe_code)]
fn basis_file(rgba8: &[u8], width: u32, height: u32, effort: Effort) -> Result<Vec<u8>, String> {
    static READY: Once = Once::new();
    // SAFETY: it fills tables, and nothing reads them before it is done, nor calls it again.
    READY.call_once(|| unsafe { sys::basisu_encoder_init() });

    let level = match effort {
        Effort::Fast => sys::UastcPackFlags_PackUASTCLevelFastest,
        Effort::Normal => sys::UastcPackFlags_PackUASTCLevelFaster,
        Effort::Best => sys::UastcPackFlags_PackUASTCLevelDefault,
    };
    // SAFETY: both objects are made here, used by this thread alone and deleted once, below, with no way out between. The
    // image copies `width * height * 4` bytes, which `rgba8` has (checked by the caller), and its sides are within the
    // encoder's. The output belongs to the compressor and is copied before that is deleted; its pointer is null where
    // nothing was made, which the status tells.
    unsafe {
        let params = sys::compressor_params_new();
        sys::compressor_params_set_status_output(params, false);
        sys::compressor_params_set_uastc(params, true);
        sys::compressor_params_set_perceptual(params, false);
        sys::compressor_params_set_pack_uastc_flags(params, level);
        let image = sys::compressor_params_get_or_create_source_image(params, 0);
        sys::image_init(image, rgba8.as_ptr(), width, height, 4);
        // One thread: the calling one.
        let compressor = sys::compressor_new(1);
        let file = if !sys::compressor_init(compressor, params) {
            Err("the encoder refuses its parameters".into())
        } else {
            match sys::compressor_process(compressor) {
                sys::basisu_basis_compressor_error_code_cECSuccess => {
                    let file = sys::compressor_get_output_basis_file(compressor);
                    Ok(std::slice::from_raw_parts(file.pData, file.length as usize).to_vec())
                }
                code => Err(format!("the encoder fails with code {code}")),
            }
        };
        sys::compressor_delete(compressor);
        sys::compressor_params_delete(params);
        file
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_that_the_encoder_would_read_beyond_are_refused() {
        for (bytes, width, height) in [(0, 0, 4), (63, 4, 4), (64, 5, 4), (64, 4, 3), (64, 16388, 4)] {
            assert!(
                encode(&vec![0; bytes], width, height, Effort::Fast).is_err(),
                "{bytes} {width}x{height}"
            );
        }
    }

    #[test]
    fn files_that_end_too_early_have_no_slice() {
        let file = basis_file(&[7; 64], 4, 4, Effort::Fast).unwrap();
        assert_eq!(only_slice(&file).map(<[u8]>::len), Some(16));
        assert!((0..file.len()).all(|end| only_slice(&file[..end]).is_none()), "cut");
    }

    #[test]
    fn blocks_depend_on_what_lies_beside_them() {
        let texels: Vec<u8> = (0..16 * 8 * 4u32).map(|i| (i * i * 31 / 7 % 251) as u8).collect();
        for effort in [Effort::Fast, Effort::Normal, Effort::Best] {
            let whole = encode(&texels, 16, 8, effort).unwrap();
            let below = encode(&texels[16 * 4 * 4..], 16, 4, effort).unwrap();
            assert_eq!(whole[64..], below, "{effort:?}: the second row of blocks, by itself");
        }
    }
}
