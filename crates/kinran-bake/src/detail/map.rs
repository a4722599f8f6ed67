//! Maps as planes of the numbers a sampler filters, level by level.

use kinran_image::srgb::{byte_from_linear, linear_from_byte, linear_from_srgb, linear_of_codes};
use kinran_image::{
    Cancelled, Channels, Encoding, Error, Format, Image, Level, Pixels, Texture, Tick, Transfer, encode,
    level_size,
};
use kinran_scene::Wrap;
use kinran_shading::normal_from_xy;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::aniso::{Kernel, Taps};
use crate::mips::{BAND_ROWS, PlaneRows, TILE, reduce_levels, unorm8};

/// What a map holds, which decides how it is blended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MapKind {
    /// sRGB colour: albedo, specular colour. Blended in linear light, by overlay.
    Color,
    /// Up to three unrelated numbers: roughness, gloss, specular, occlusion, metallic. Blended by overlay.
    Data,
    /// Tangent-space normals, +Y. Blended by reoriented normal mapping.
    Normal,
    /// Aniso texels. Blended by "over".
    Aniso,
}

impl MapKind {
    /// The name in reports and options.
    pub fn name(self) -> &'static str {
        match self {
            MapKind::Color => "color",
            MapKind::Data => "data",
            MapKind::Normal => "normal",
            MapKind::Aniso => "aniso",
        }
    }

    /// How tiles and targets of this kind are stored.
    pub fn transfer(self) -> Transfer {
        if self == MapKind::Color { Transfer::Srgb } else { Transfer::Linear }
    }

    /// Channels that are blended.
    pub fn channels(self) -> usize {
        if self == MapKind::Normal { 2 } else { 3 }
    }
}

/// One level of a map as a sampler sees it: linear light, normals in [−1, 1].
#[derive(Clone, Debug, PartialEq)]
pub struct Planes {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Four planes of `width * height`, each row by row. Normals have x, y, z and one.
    pub samples: Vec<f32>,
}

impl Planes {
    /// Four planes of zeros.
    pub(crate) fn zeros(width: u32, height: u32) -> Self {
        Planes { width, height, samples: vec![0.0; width as usize * height as usize * 4] }
    }

    /// One plane.
    pub fn plane(&self, channel: usize) -> &[f32] {
        let len = self.width as usize * self.height as usize;
        &self.samples[channel * len..][..len]
    }

    /// One row of one plane.
    pub(crate) fn row(&self, channel: usize, y: usize) -> &[f32] {
        &self.plane(channel)[y * self.width as usize..][..self.width as usize]
    }
}

/// Calls `write` for each row with the row's part of each of the four planes, in parallel.
pub(crate) fn for_each_row(planes: &mut Planes, write: impl Fn(usize, [&mut [f32]; 4]) + Sync + Send) {
    let width = planes.width as usize;
    let len = width * planes.height as usize;
    let (a, b) = planes.samples.split_at_mut(2 * len);
    let ((p0, p1), (p2, p3)) = (a.split_at_mut(len), b.split_at_mut(len));
    p0.par_chunks_exact_mut(width)
        .zip(p1.par_chunks_exact_mut(width))
        .zip(p2.par_chunks_exact_mut(width))
        .zip(p3.par_chunks_exact_mut(width))
        .enumerate()
        .for_each(|(y, (((r0, r1), r2), r3))| write(y, [r0, r1, r2, r3]));
}

/// An image's texels as a sampler would see them uncompressed. Colour is encoded as [`Image::transfer`] says.
///
/// # Errors
/// [`Error::Unsupported`] where a blended sample lies outside [0, 1] (colour and data) or a normal map is grey.
pub(crate) fn planes_of_image(image: &Image, kind: MapKind, y_down: bool) -> Result<Planes, Error> {
    let grey = matches!(image.channels, Channels::R | Channels::Rg);
    if grey && matches!(kind, MapKind::Normal | MapKind::Aniso) {
        let what = if kind == MapKind::Normal { "a normal map" } else { "an aniso map" };
        return Err(Error::Unsupported(format!(
            "{what} has different channels, but this image is grey; say what else it is"
        )));
    }
    let floats = matches!(image.pixels, Pixels::F32(_));
    if let (Pixels::F32(samples), true) = (&image.pixels, kind != MapKind::Normal)
        && let Some(i) = samples.iter().position(|v| !(0.0..=1.0).contains(v))
    {
        let texel = i / image.channels.count();
        return Err(Error::Unsupported(format!(
            "texel ({}, {}) is {}; detail maps blend values from 0 to 1, scale the image before",
            texel % image.width as usize,
            texel / image.width as usize,
            samples[i],
        )));
    }
    let signed = matches!(&image.pixels, Pixels::F32(samples) if samples.iter().any(|v| *v < 0.0));
    let linear = |v: f32| match image.pixels {
        _ if image.transfer == Transfer::Linear => v,
        Pixels::U8(_) => linear_from_byte((v * 255.0 + 0.5) as u8),
        Pixels::U16(_) => linear_of_codes()[(v * 65535.0 + 0.5) as usize],
        Pixels::F32(_) => linear_from_srgb(v),
    };

    let mut planes = Planes::zeros(image.width, image.height);
    for_each_row(&mut planes, |y, out| {
        let mut row = Vec::new();
        image.row_rgba_f32(y as u32, &mut row);
        let [p0, p1, p2, p3] = out;
        for (x, texel) in row.iter().enumerate() {
            let [a, b, c] = match kind {
                MapKind::Color => [linear(texel[0]), linear(texel[1]), linear(texel[2])],
                MapKind::Data | MapKind::Aniso => [texel[0], texel[1], texel[2]],
                MapKind::Normal => {
                    let component = |v: f32| if floats && signed { v } else { v * 2.0 - 1.0 };
                    let y = component(texel[1]);
                    normal_from_xy(component(texel[0]), if y_down { -y } else { y }).to_array()
                }
            };
            (p0[x], p1[x], p2[x], p3[x]) = (a, b, c, texel[3]);
        }
    });
    Ok(planes)
}

impl PlaneRows for Planes {
    const PLANES: usize = 4;
    type Scratch = ();

    #[inline(always)]
    fn sum_rows(&self, rows: &Taps, x0: usize, len: usize, (): &mut (), sums: &mut [[f32; TILE]]) {
        for (channel, sums) in sums.iter_mut().enumerate() {
            sums[..len].fill(0.0);
            for &(y, weight) in rows {
                for (sum, v) in sums[..len].iter_mut().zip(&self.row(channel, y as usize)[x0..]) {
                    *sum += v * weight;
                }
            }
        }
    }
}

/// A map's mip chain down to 1×1, every level an average of level 0 (a box, which does not reach over borders). Normals are averaged as vectors and made unit
/// length again. `tick` is told of no units.
pub(crate) fn mip_chain(finest: Planes, kind: MapKind, tick: &Tick<'_>) -> Result<Vec<Planes>, Cancelled> {
    let size = (finest.width, finest.height);
    let coarser = reduce_levels(&finest, size, Kernel::Box, [Wrap::Repeat; 2], |band, (): &mut ()| {
        tick(0)?;
        Ok::<_, Cancelled>((band.y0, band.samples.to_vec()))
    })?;
    let coarser: Vec<Planes> = coarser
        .into_iter()
        .enumerate()
        .map(|(i, bands)| {
            let mut planes = Planes::zeros(level_size(size.0, i + 1), level_size(size.1, i + 1));
            let (width, len) = (planes.width as usize, planes.width as usize * planes.height as usize);
            for (y0, samples) in bands {
                for (row, samples) in samples.chunks_exact(4 * width).enumerate() {
                    for (channel, samples) in samples.chunks_exact(width).enumerate() {
                        planes.samples[channel * len + (y0 + row) * width..][..width]
                            .copy_from_slice(samples);
                    }
                }
            }
            if kind == MapKind::Normal {
                for_each_row(&mut planes, |_, [x, y, z, _]| {
                    for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
                        let n = glam::vec3(*x, *y, *z).normalize_or(glam::Vec3::Z);
                        (*x, *y, *z) = (n.x, n.y, n.z);
                    }
                });
            }
            planes
        })
        .collect();
    Ok(std::iter::once(finest).chain(coarser).collect())
}

/// The 8-bit texels of a level of a tile or a target.
pub(crate) fn bytes_of_planes(planes: &Planes, kind: MapKind) -> Vec<u8> {
    let len = planes.width as usize * planes.height as usize;
    let mut bytes = vec![0; len * 4];
    let width = planes.width as usize;
    bytes.par_chunks_exact_mut(width * 4).enumerate().for_each(|(y, out)| {
        for channel in 0..4 {
            for (texel, &v) in out.chunks_exact_mut(4).zip(planes.row(channel, y)) {
                texel[channel] = match kind {
                    MapKind::Color if channel < 3 => byte_from_linear(v),
                    MapKind::Normal if channel < 3 => unorm8((v * 0.5 + 0.5).clamp(0.0, 1.0)),
                    _ => unorm8(v.clamp(0.0, 1.0)),
                };
            }
        }
    });
    bytes
}

/// A map's chain, compressed, in parallel; `tick` is told of texels of all levels.
///
/// # Errors
/// [`Error::Unsupported`] where the encoder refuses, [`Error::Cancelled`] where `tick` does.
pub(crate) fn compress(
    levels: &[Planes],
    kind: MapKind,
    encoding: Encoding,
    tick: &Tick<'_>,
) -> Result<Texture, Error> {
    let levels = levels
        .iter()
        .map(|planes| {
            let width = planes.width as usize;
            let bands: Vec<Vec<u8>> = bytes_of_planes(planes, kind)
                .par_chunks(width * 4 * BAND_ROWS as usize)
                .map(|band| {
                    let rows = band.len() / (4 * width);
                    let blocks = encode(encoding, band, planes.width, rows as u32)?;
                    tick((width * rows) as u64)?;
                    Ok(blocks)
                })
                .collect::<Result<_, Error>>()?;
            Ok(Level { width: planes.width, height: planes.height, data: bands.concat() })
        })
        .collect::<Result<_, Error>>()?;
    Ok(texture(encoding.format, kind.transfer(), levels))
}

/// A texture of these levels; formats without an sRGB form stay linear.
pub(crate) fn texture(format: Format, transfer: Transfer, levels: Vec<Level>) -> Texture {
    let transfer = if format.has_srgb() { transfer } else { Transfer::Linear };
    Texture { format, transfer, levels, metadata: std::collections::BTreeMap::new() }
}

/// A level as the GPU's sampler sees it.
///
/// # Errors
/// [`Error::Unsupported`] where the level's data are not what its size demands.
pub(crate) fn decoded_level(texture: &Texture, level: usize, kind: MapKind) -> Result<Planes, Error> {
    let texels = texture.decode_level(level)?;
    let Level { width, height, .. } = texture.levels[level];
    let mut planes = Planes::zeros(width, height);
    let srgb = kind == MapKind::Color && texture.transfer.of_content(true) == Transfer::Srgb;
    for_each_row(&mut planes, |y, out| {
        let [p0, p1, p2, p3] = out;
        for (x, texel) in texels[y * width as usize..][..width as usize].iter().enumerate() {
            // One channel stands for all three.
            let stored = |c: usize| if texture.format == Format::Bc4 { 0 } else { c };
            let channel = |c: usize| {
                let c = stored(c);
                if kind == MapKind::Normal {
                    texel[c] * 2.0 - 1.0
                } else if srgb {
                    linear_from_byte((texel[c] * 255.0 + 0.5) as u8)
                } else {
                    texel[c]
                }
            };
            (p0[x], p1[x], p2[x], p3[x]) = (channel(0), channel(1), channel(2), texel[3]);
        }
    });
    Ok(planes)
}

/// A level of `s` as the sampler returns it: linear, whichever way it is stored.
///
/// # Errors
/// As [`decoded_level`].
pub(crate) fn synthesized_level(texture: &Texture, level: usize) -> Result<Planes, Error> {
    let kind = if texture.transfer == Transfer::Srgb { MapKind::Color } else { MapKind::Data };
    decoded_level(texture, level, kind)
}
