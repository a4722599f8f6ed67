//! Any bytes are an image or an error, by content, and as a TGA, which has no magic number.

#![no_main]

use std::path::Path;

use kinran_image::decode_image;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(image) = decode_image(Path::new("fuzz.tga"), bytes) {
        let samples = image.width as usize * image.height as usize * image.channels.count();
        assert_eq!(image.pixels.len(), samples);
    }
});
