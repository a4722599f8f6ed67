//! Pictures of a solved level, for people.

use glam::Vec3;
use kinran_image::srgb::code_from_linear;
use kinran_image::{Channels, Error, Image, Pixels, Transfer, encode_parallel};
use kinran_shading::detail::detail_from_texel;
use kinran_shading::normal_from_xy;

use super::layer::{DetailRows, Layer, RowRoom, Seen};
use super::map::{MapKind, Planes, bytes_of_planes, decoded_level, synthesized_level, texture};
use super::solve::{DetailOptions, Solved, Target, blend};
use crate::mips::unorm8;

/// Factor on differences in pictures of errors, chosen by eye: a step of 8 bits shows, and eight are as bright as can be.
pub const ERROR_GAIN: f32 = 32.0;

/// Pictures of one level: RGB, 8 bits, colour in sRGB.
#[derive(Clone, Debug)]
pub struct LevelPictures {
    /// The detail alone, as the GPU decodes it.
    pub detail: Image,
    /// `s`, as stored; for normals with the z that is not.
    pub synthesized: Image,
    /// Both together.
    pub blended: Image,
    /// What was wanted.
    pub target: Image,
    /// The target by itself, compressed as `s` is.
    pub compressed_target: Image,
    /// Absolute difference between blended and wanted, [`ERROR_GAIN`] times.
    pub error: Image,
    /// The same of the compressed target.
    pub target_error: Image,
}

/// Pictures of level `level` of `s`.
///
/// # Errors
/// [`Error::Unsupported`] where there is no such level or it cannot be decoded.
pub fn level_pictures(
    target: &Target,
    layers: &[Layer],
    options: &DetailOptions,
    solved: &Solved,
    level: usize,
) -> Result<LevelPictures, Error> {
    let stored = synthesized_level(&solved.texture, level)?;
    let srgb = solved.texture.transfer == Transfer::Srgb;
    let wanted = &target.levels[options.first_level + level];
    let (width, height) = (wanted.width, wanted.height);
    let encoded = encode_parallel(options.encoding, &bytes_of_planes(wanted, target.kind), width, height)?;
    let level = kinran_image::Level { width, height, data: encoded };
    let alone = texture(options.encoding.format, target.kind.transfer(), vec![level]);
    let alone = decoded_level(&alone, 0, target.kind)?;

    let rows = DetailRows::new(layers, target.kind, (width, height), Seen::Decoded);
    let (mut room, mut row) = (RowRoom::default(), <[Vec<f32>; 3]>::default());
    let mut pictures: [Vec<u8>; 7] = Default::default();
    for y in 0..height as usize {
        rows.row(y, &mut room, &mut row);
        for x in 0..width as usize {
            let texel = texel_of(&stored, x, y);
            let detail = Vec3::from(row.each_ref().map(|plane| plane[x]));
            let blended = blend(texel, detail, target.kind, options);
            let vector = |planes: &Planes| match target.kind {
                MapKind::Normal => normal_from_xy(planes.row(0, y)[x], planes.row(1, y)[x]),
                _ => texel_of(planes, x, y),
            };
            let [blended, wanted, alone] =
                [blended, vector(wanted), vector(&alone)].map(|v| shown(v, target.kind));
            let synthesized = match target.kind {
                MapKind::Normal => {
                    let s = detail_from_texel(texel) * 2.0 - 1.0;
                    shown(normal_from_xy(s.x, s.y), target.kind)
                }
                _ if srgb => shown(texel, MapKind::Color),
                _ => texel,
            };
            let error = |v: Vec3| ((v - wanted) * ERROR_GAIN).abs().min(Vec3::ONE);
            let all = [
                shown(detail, target.kind),
                synthesized,
                blended,
                wanted,
                alone,
                error(blended),
                error(alone),
            ];
            for (picture, v) in pictures.iter_mut().zip(all) {
                picture.extend(v.to_array().map(|v| unorm8(v.clamp(0.0, 1.0))));
            }
        }
    }
    let [detail, synthesized, blended, wanted, alone, error, target_error] =
        pictures.map(|bytes| Image::new(width, height, Channels::Rgb, Pixels::U8(bytes)));
    Ok(LevelPictures {
        detail: detail?,
        synthesized: synthesized?,
        blended: blended?,
        target: wanted?,
        compressed_target: alone?,
        error: error?,
        target_error: target_error?,
    })
}

fn texel_of(planes: &Planes, x: usize, y: usize) -> Vec3 {
    Vec3::from(std::array::from_fn(|c| planes.row(c, y)[x]))
}

/// A blended value as a picture shows it.
fn shown(v: Vec3, kind: MapKind) -> Vec3 {
    match kind {
        MapKind::Color => Vec3::from(v.to_array().map(code_from_linear)),
        MapKind::Normal => v * 0.5 + 0.5,
        MapKind::Data | MapKind::Aniso => v,
    }
}
