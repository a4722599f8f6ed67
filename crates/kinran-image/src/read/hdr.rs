//! Radiance HDR: RGBE, rows from the top (Ward, "The RADIANCE Picture File Format").

use std::io::{BufRead, Read, Seek};

use image::codecs::hdr::HdrDecoder;

use super::{decode_samples, image_error};
use crate::Image;

/// Bytes of a header that are looked at; those of real files have a few hundred.
const HEADER: u64 = 1 << 16;

pub(super) fn decode<R: BufRead + Seek>(mut file: R, stored: u64) -> Result<Image, String> {
    let mut head = Vec::new();
    file.by_ref().take(HEADER).read_to_end(&mut head).map_err(|e| e.to_string())?;
    file.rewind().map_err(|e| e.to_string())?;
    let note = look_at_header(&head)?;
    let mut image = HdrDecoder::new_nonstrict(file)
        .map_err(|e| image_error(&e))
        .and_then(|d| decode_samples(d, stored))?;
    image.notes.extend(note);
    Ok(image)
}

/// What is said of a header: an error with the right advice where the decoder would say something else, a note on
/// exposure.
fn look_at_header(head: &[u8]) -> Result<Option<String>, String> {
    let mut lines = head.split(|&byte| byte == b'\n').map(String::from_utf8_lossy);
    let mut exposure = 1.0;
    for line in lines.by_ref().take_while(|line| !line.is_empty()) {
        if line.ends_with('\r') {
            return Err(
                "its lines end in CR LF, as a transfer in text mode leaves them, and its texels are \
                        likely damaged in the same way; fetch it again in binary mode, or save it again"
                    .into(),
            );
        }
        match line.split_once('=').map(|(name, value)| (name.trim(), value.trim())) {
            Some(("FORMAT", "32-bit_rle_xyze")) => {
                return Err("its colours are XYZ (FORMAT=32-bit_rle_xyze); save it as RGB".into());
            }
            Some(("EXPOSURE", value)) => exposure *= value.parse().unwrap_or(1.0),
            _ => {}
        }
    }
    if let Some(line) = lines.next()
        && let [y, height, x, width] = line.split_whitespace().collect::<Vec<_>>()[..]
        && (y, x) != ("-Y", "+X")
        && [y, x].iter().all(|axis| ["+X", "-X", "+Y", "-Y"].contains(axis))
    {
        return Err(format!(
            "its texels lie as \"{y} {height} {x} {width}\"; read are rows from the top with texels from the \
             left, \"-Y HEIGHT +X WIDTH\", as most programs save them: turn it round and save it again"
        ));
    }
    // The values are stored multiplied by the product of all exposures.
    Ok((exposure != 1.0).then(|| {
        format!(
            "its header says EXPOSURE {exposure}; values are taken as stored, {exposure} times the radiance"
        )
    }))
}
