//! Textures on their way to files.

use kinran_image::{Texture, encode_dds, encode_ktx2};

use crate::content::Content;
use crate::options::Container;
use crate::report::Output;
use crate::{Error, Sink};

/// Writes a texture in the containers asked for, with the key that says what it holds; `zstd` is the level of KTX2 files, 0 for
/// none. Gives the reports of the files.
pub(crate) fn put_texture(
    container: Container,
    zstd: i32,
    name: &str,
    map: Content,
    mut texture: Texture,
    out: &dyn Sink,
) -> Result<Vec<Output>, Error> {
    map.mark(&mut texture);
    let put = |extension: &&str| {
        let file = format!("{name}.{extension}");
        let bytes = match *extension {
            "dds" => encode_dds(&texture)?,
            _ => encode_ktx2(&texture, (zstd > 0).then_some(zstd))?,
        };
        out.put(&file, &bytes)?;
        Ok(Output::new(file, map, &texture, &bytes))
    };
    container.extensions().iter().map(put).collect()
}
