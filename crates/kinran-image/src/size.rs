use std::fs::File;
use std::io::{Cursor, Read};
use std::path::Path;

use image::ImageReader;

use crate::MAX_SIDE;

/// Width and height of an image file by its header alone; nothing where the header does not tell or the file is no
/// image of at most [`MAX_SIDE`] texels along a side. Whether the rest of the file is sound is not asked: for estimates.
pub fn image_size(path: &Path) -> Option<(u32, u32)> {
    let mut head = [0; 28];
    let read = File::open(path).ok()?.read_exact(&mut head);
    let size = match read.ok().and_then(|()| texture_size(&head)) {
        Some(size) => size,
        None => ImageReader::open(path).ok()?.with_guessed_format().ok()?.into_dimensions().ok()?,
    };
    (size.0.max(size.1) <= MAX_SIDE).then_some(size)
}

/// As [`image_size`], of an image file's bytes.
pub fn image_size_of(bytes: &[u8]) -> Option<(u32, u32)> {
    let size = match texture_size(bytes) {
        Some(size) => size,
        None => ImageReader::new(Cursor::new(bytes)).with_guessed_format().ok()?.into_dimensions().ok()?,
    };
    (size.0.max(size.1) <= MAX_SIDE).then_some(size)
}

/// Width and height in the header of a KTX2 or DDS file.
fn texture_size(head: &[u8]) -> Option<(u32, u32)> {
    let number = |at: usize| Some(u32::from_le_bytes(head.get(at..at + 4)?.try_into().ok()?));
    if head.starts_with(b"DDS ") {
        return Some((number(16)?, number(12)?));
    }
    head.starts_with(&ktx2::MAGIC).then(|| Some((number(20)?, number(24)?)))?
}
