//! Typed images, block compression, KTX2 and DDS.
//!
//! [`Image`] is what a person authored (PNG, JPEG, TGA, BMP, WebP, TIFF, HDR, EXR), [`Texture`] is what an engine
//! loads (a mip chain in one [`Format`], in a KTX2 or DDS container). Every reader takes bytes that may
//! be damaged or hostile and answers with an [`Error`] that names the file and the reason.

mod block;
mod dds_file;
mod error;
mod format;
mod image;
mod ktx2_file;
mod opaque;
mod read;
mod size;
pub mod srgb;
mod texture;
mod texture_file;
mod unfinished;
mod write;

pub use block::{Encoder, Encoding, Preset, Role, decode, encode, encode_half, encode_parallel};
pub use dds_file::{decode_dds, encode_dds};
pub use error::{Error, io_reason};
pub use format::{Format, Transfer};
pub use image::{Channels, Image, MAX_IMAGE_BYTES, MAX_SIDE, Pixels};
pub use ktx2_file::{decode_ktx2, encode_ktx2};
pub use read::{IMAGE_EXTENSIONS, decode_image, has_image_extension, read_image, read_layer};
pub use size::{image_size, image_size_of};
pub use texture::{Level, Texture, full_level_count, level_size};
pub use texture_file::{decode_texture, read_texture, write_texture};
pub use unfinished::{Unfinished, remove_unfinished};
pub use write::{
    encode_png, is_temporary, write_atomically, write_atomically_in, write_atomically_with, write_exr,
    write_exr_planes, write_png,
};
