//! Typed images, block compression, KTX2 and DDS.
//!
//! [`Image`] is what a person authored (PNG, JPEG, TGA, BMP, WebP, TIFF, HDR, EXR), [`Texture`] is what an engine
//! loads (a mip chain in one [`Format`], in a KTX2 or DDS container). Every reader takes bytes that may
//! be damaged or hostile and answers with an [`Error`] that names the file and the reason.
//!
//! ```
//! use kinran_image::{Channels, Encoder, Encoding, Format, Image, Level, Pixels, Preset, Texture, Transfer};
//! use kinran_image::{decode_image, decode_ktx2, encode, encode_ktx2, encode_png};
//!
//! // An authored image, by way of PNG.
//! let grey = Image::new(8, 8, Channels::R, Pixels::U8((0..64).map(|i| 4 * i).collect()))?;
//! let image = decode_image("ramp.png".as_ref(), &encode_png(&grey)?)?;
//! assert_eq!(image, Image { transfer: image.transfer, ..grey });
//!
//! // Its texels in blocks, in a container that engines load.
//! let encoding = Encoding { format: Format::Bc4, encoder: Encoder::Portable, preset: Preset::Normal };
//! let rgba8: Vec<u8> = (0..64).flat_map(|i| [4 * i, 0, 0, 255]).collect();
//! let levels = vec![Level { width: 8, height: 8, data: encode(encoding, &rgba8, 8, 8)? }];
//! let texture = Texture { format: Format::Bc4, transfer: Transfer::Linear, levels, metadata: Default::default() };
//! let file = encode_ktx2(&texture, None)?;
//! let back = decode_ktx2("ramp.ktx2".as_ref(), &file)?;
//! assert!((back.decode_level(0)?[9][0] - 36.0 / 255.0).abs() < 0.02);
//! # Ok::<(), kinran_image::Error>(())
//! ```

mod basis;
mod block;
mod dds_file;
mod error;
mod files;
mod format;
mod image;
mod ktx2_file;
mod opaque;
mod read;
mod size;
pub mod srgb;
mod texture;
mod texture_file;
mod tick;
mod unfinished;
mod write;

pub use block::{Encoder, Encoding, Preset, Role, decode, encode, encode_half, encode_parallel};
pub use dds_file::{decode_dds, encode_dds};
pub use error::{Error, io_reason};
pub use files::{Disk, Entry, Files, Memory, plain};
pub use format::{Format, Transfer};
pub use image::{Channels, Image, MAX_IMAGE_BYTES, MAX_SIDE, Pixels};
pub use ktx2_file::{decode_ktx2, encode_ktx2};
pub use read::{IMAGE_EXTENSIONS, decode_image, decode_layer, has_image_extension, read_image, read_layer};
pub use size::{image_size, image_size_of};
pub use texture::{Level, Texture, full_level_count, level_size};
pub use texture_file::{decode_texture, read_texture, write_texture};
pub use tick::{Cancelled, Tick, untold};
pub use unfinished::{Unfinished, make_folder, remove_empty_folders, remove_unfinished};
pub use write::{
    Staging, encode_exr_planes, encode_png, is_temporary, write_atomically, write_atomically_in,
    write_atomically_with, write_exr, write_exr_planes, write_png,
};
