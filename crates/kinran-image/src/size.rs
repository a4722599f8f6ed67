use std::path::Path;

use image::ImageReader;

use crate::MAX_SIDE;

/// Width and height of an image file by its header alone; nothing where the header does not tell or the file is no
/// image of at most [`MAX_SIDE`] texels along a side. Whether the rest of the file is sound is not asked: for estimates.
pub fn image_size(path: &Path) -> Option<(u32, u32)> {
    let size = ImageReader::open(path).ok()?.with_guessed_format().ok()?.into_dimensions().ok()?;
    (size.0.max(size.1) <= MAX_SIDE).then_some(size)
}
