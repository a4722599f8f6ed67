//! Texture files in and out, whichever container.

use std::path::Path;

use crate::{Error, Texture, decode_dds, decode_ktx2, encode_dds, encode_ktx2, write_atomically};

/// Reads a KTX2 or DDS file, told by its content. See [`decode_ktx2`] and [`decode_dds`].
///
/// # Errors
/// [`Error::Io`] where the file cannot be read, [`Error::Malformed`] where its content is not a texture
/// that is read here.
pub fn read_texture(path: &Path) -> Result<Texture, Error> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    decode_texture(path, &bytes)
}

/// Decodes a KTX2 or DDS file that is in memory already; `name` stands for it in errors.
///
/// # Errors
/// As [`read_texture`].
pub fn decode_texture(name: &Path, bytes: &[u8]) -> Result<Texture, Error> {
    match bytes {
        [b'D', b'D', b'S', b' ', ..] => decode_dds(name, bytes),
        _ if bytes.starts_with(&ktx2::MAGIC) => decode_ktx2(name, bytes),
        [] => Err(Error::malformed(name, "the file is empty; write it again, or leave it out")),
        _ => Err(Error::malformed(name, "the file is neither KTX2 nor DDS; textures are read from these")),
    }
}

/// Writes a texture to a file that ends in `.ktx2` or `.dds`, whole or not at all.
///
/// `zstd` is the compression level of KTX2 (see [`encode_ktx2`]); DDS cannot compress and does not look
/// at it.
///
/// # Errors
/// [`Error::Unsupported`] where the extension is another or the container cannot hold the texture,
/// [`Error::Io`] as [`write_atomically`].
pub fn write_texture(path: &Path, texture: &Texture, zstd: Option<i32>) -> Result<(), Error> {
    let extension = path.extension().unwrap_or_default();
    let bytes = if extension.eq_ignore_ascii_case("ktx2") {
        encode_ktx2(texture, zstd)?
    } else if extension.eq_ignore_ascii_case("dds") {
        encode_dds(texture)?
    } else {
        return Err(Error::Unsupported(format!(
            "{}: textures are written as .ktx2 or .dds, name the file so",
            path.display()
        )));
    };
    write_atomically(path, &bytes)
}
