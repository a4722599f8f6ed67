//! Any bytes are a texture that its own containers can write again, or an error.

#![no_main]

use std::path::Path;

use kinran_image::{decode_dds, decode_ktx2, decode_texture, encode_dds, encode_ktx2};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let name = Path::new("fuzz");
    if let Ok(mut texture) = decode_texture(name, bytes) {
        texture.transfer = texture.transfer.of_content(false);
        texture.check().expect("what is read is valid");
        let ktx2 = encode_ktx2(&texture, None).expect("what is read can be written");
        let back = decode_ktx2(name, &ktx2).expect("what is written can be read");
        assert_eq!(back.levels, texture.levels);
        let dds = encode_dds(&texture).expect("what is read can be written");
        assert_eq!(decode_dds(name, &dds).expect("what is written can be read").levels, texture.levels);
        for level in 0..texture.levels.len() {
            texture.decode_level(level).expect("valid levels decode");
        }
    }
});
