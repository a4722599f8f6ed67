//! Textures sampled as a GPU samples them.
//!
//! The equations are those of the Vulkan specification, chapter Image Operations: Texel Coordinate Systems,
//! Scale Factor Operation, LOD Operation, Texel Anisotropic Filtering. u runs right, v down, (0, 0) is the
//! corner of the first texel.

use super::sampler::sample_2d;
use glam::{Vec2, Vec4, vec2};
use kinran_image::srgb::linear_of_codes;
use kinran_image::{Image, Texture, Transfer, full_level_count, level_size};
use kinran_scene::Wrap;
use std::sync::Arc;

/// How textures are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureFiltering {
    /// As a GPU does, once per sample with the footprint of a whole pixel: trilinear, along up to
    /// `max_anisotropy` (1 to 16) places of the longer axis.
    Mips {
        /// 1 is plain trilinear filtering.
        max_anisotropy: u32,
    },
    /// Bilinear from level 0, the pixel's many samples being the filter: ground truth.
    Level0,
    /// For every sample one place, read from level 0 as [`TextureFiltering::Level0`] reads it and chosen as often as it counts
    /// in [`TextureFiltering::Mips`]: texels are shaded one by one, and averaged after that by the sampler's own kernel. The
    /// mean of many samples is what mips would show that lost nothing. Textures of one size and place choose the same place.
    Texels {
        /// As in [`TextureFiltering::Mips`].
        max_anisotropy: u32,
        /// Normals and roughness alone; textures of colours and masks are read as [`TextureFiltering::Mips`] says. Alpha of the
        /// normals then says how much a texel counts besides.
        lobes_only: bool,
        /// Which of a pixel's samples, and the pixel's seed; [`render`](super::render) sets them.
        sample: [u32; 2],
    },
}

impl TextureFiltering {
    /// The most places along a slanted footprint; none where no mips are read.
    pub(crate) fn max_anisotropy(self) -> Option<u32> {
        match self {
            TextureFiltering::Mips { max_anisotropy } | TextureFiltering::Texels { max_anisotropy, .. } => {
                Some(max_anisotropy)
            }
            TextureFiltering::Level0 => None,
        }
    }

    /// The same for one sample of a pixel.
    pub(crate) fn of_sample(self, index: u32, seed: u32) -> Self {
        match self {
            TextureFiltering::Texels { max_anisotropy, lobes_only, .. } => {
                TextureFiltering::Texels { max_anisotropy, lobes_only, sample: [index, seed] }
            }
            filtering => filtering,
        }
    }
}

/// The pairs of the sample sequence by which texels are chosen.
const TEXEL: [u32; 3] = [5, 6, 7];

/// One level of a [`MipTexture`].
#[derive(Clone, Debug, PartialEq)]
pub struct MipLevel {
    /// Texels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// `width * height` linear RGBA texels, row by row from the top.
    pub texels: Vec<[f32; 4]>,
}

/// A mip chain that has been decoded to linear floats.
#[derive(Clone, Debug, PartialEq)]
pub struct MipTexture {
    /// Level 0 first, at least one.
    pub levels: Vec<MipLevel>,
    /// Repetition along u and v.
    pub wrap: [Wrap; 2],
    /// The runtime texture whose levels these are, for a GPU that can read it as it is.
    pub encoded: Option<Arc<Texture>>,
}

impl MipTexture {
    /// A texture that is `texel` everywhere.
    pub fn constant(texel: [f32; 4]) -> Self {
        let level = MipLevel { width: 1, height: 1, texels: vec![texel] };
        MipTexture { levels: vec![level], wrap: [Wrap::Repeat; 2], encoded: None }
    }

    /// An authored image with box-filtered mips: every level is the area average of the one above. sRGB
    /// colour is decoded before it is averaged; alpha and images of linear colour are linear already. One channel is
    /// grey, two are grey and alpha; a missing alpha is 1.
    pub fn from_image(image: &Image, transfer: Transfer, wrap: [Wrap; 2]) -> Self {
        let mut texels = Vec::with_capacity(image.width as usize * image.height as usize);
        let mut row = Vec::new();
        for y in 0..image.height {
            image.row_rgba_f32(y, &mut row);
            texels.extend_from_slice(&row);
        }
        if transfer == Transfer::Srgb && image.transfer != Transfer::Linear {
            linearize(&mut texels);
        }

        let mut levels = vec![MipLevel { width: image.width, height: image.height, texels }];
        while let Some(top) = levels.last().filter(|l| l.width > 1 || l.height > 1) {
            levels.push(halve(top));
        }
        MipTexture { levels, wrap, encoded: None }
    }

    /// The decoded levels of a runtime texture as they are, sRGB colour linearised.
    ///
    /// # Errors
    /// Those of [`Texture::check`] and [`Texture::decode_level`].
    pub fn from_texture(texture: &Texture, wrap: [Wrap; 2]) -> Result<Self, kinran_image::Error> {
        texture.check()?;
        let mut levels = Vec::with_capacity(texture.levels.len());
        for (i, level) in texture.levels.iter().enumerate() {
            let mut texels = texture.decode_level(i)?;
            if texture.transfer == Transfer::Srgb {
                linearize(&mut texels);
            }
            levels.push(MipLevel { width: level.width, height: level.height, texels });
        }
        Ok(MipTexture { levels, wrap, encoded: Some(Arc::new(texture.clone())) })
    }

    /// Bilinear sample of one level.
    #[inline]
    pub fn sample_level(&self, uv: Vec2, level: usize) -> Vec4 {
        let MipLevel { width, height, texels } = &self.levels[level];
        debug_assert_eq!(texels.len(), *width as usize * *height as usize, "texels of level {level}");
        if texels.len() == 1 {
            return Vec4::from_array(texels[0]);
        }
        let (x0, x1, fx) = taps(uv.x, *width, self.wrap[0]);
        let (y0, y1, fy) = taps(uv.y, *height, self.wrap[1]);
        let texel = |x: usize, y: usize| Vec4::from_array(texels[y * *width as usize + x]);
        let top = texel(x0, y0).lerp(texel(x1, y0), fx);
        let bottom = texel(x0, y1).lerp(texel(x1, y1), fx);
        top.lerp(bottom, fy)
    }

    /// Trilinear sample at a level of detail, clamped to the levels that exist.
    #[inline]
    pub fn sample_lod(&self, uv: Vec2, lod: f32) -> Vec4 {
        let lod = lod.clamp(0.0, (self.levels.len() - 1) as f32);
        let level = lod as usize;
        let fraction = lod - level as f32;
        let fine = self.sample_level(uv, level);
        if fraction > 0.0 { fine.lerp(self.sample_level(uv, level + 1), fraction) } else { fine }
    }

    /// The level of detail of isotropic filtering: log2 of the longer of the two axes of a pixel's footprint in
    /// texels of level 0. `uv_dx` and `uv_dy` are the changes of uv from one pixel to the next. Unclamped.
    pub fn lod(&self, uv_dx: Vec2, uv_dy: Vec2) -> f32 {
        let size = self.size();
        libm::log2f((uv_dx * size).length().max((uv_dy * size).length()))
    }

    /// What a GPU's sampler returns for a pixel whose uv changes by `uv_dx` and `uv_dy` to the next: trilinear
    /// for `max_anisotropy` 1, otherwise up to that many trilinear samples along the footprint's longer axis.
    #[inline]
    pub fn sample_grad(&self, uv: Vec2, uv_dx: Vec2, uv_dy: Vec2, max_anisotropy: u32) -> Vec4 {
        if self.levels.len() == 1 {
            return self.sample_level(uv, 0);
        }
        let footprint = self.footprint(uv_dx, uv_dy, max_anisotropy);
        let count = footprint.count;
        if count == 1 {
            return self.sample_lod(uv, footprint.lod);
        }
        let sum: Vec4 = (0..count).map(|i| self.sample_lod(uv + footprint.offset(i), footprint.lod)).sum();
        sum / count as f32
    }

    /// Where [`MipTexture::sample_grad`] reads.
    #[inline]
    fn footprint(&self, uv_dx: Vec2, uv_dy: Vec2, max_anisotropy: u32) -> Footprint {
        let size = self.size();
        let (rho_x, rho_y) = ((uv_dx * size).length(), (uv_dy * size).length());
        let (rho_max, rho_min) = (rho_x.max(rho_y), rho_x.min(rho_y));
        if max_anisotropy <= 1 || rho_max <= 1.0 {
            return Footprint { lod: libm::log2f(rho_max), axis: Vec2::ZERO, count: 1 };
        }
        // eta of the specification; a degenerate footprint takes the whole ratio.
        let eta = (rho_max / rho_min.max(f32::MIN_POSITIVE)).min(max_anisotropy as f32);
        let axis = if rho_x > rho_y { uv_dx } else { uv_dy };
        Footprint { lod: libm::log2f(rho_max / eta), axis, count: eta.ceil() as u32 }
    }

    /// A place in what [`MipTexture::sample_grad`] averages, chosen as often as it counts there. Only the size of level 0 matters: mips are averages over areas, whether they are there or not.
    pub(crate) fn texel(
        &self,
        uv: Vec2,
        (uv_dx, uv_dy): (Vec2, Vec2),
        max_anisotropy: u32,
        [index, seed]: [u32; 2],
    ) -> Vec2 {
        let [place, tap, inside] = TEXEL.map(|pair| sample_2d(index, pair, seed));
        let footprint = self.footprint(uv_dx, uv_dy, max_anisotropy);
        let uv = uv + footprint.offset((place.x * footprint.count as f32) as u32);
        let MipLevel { width, height, .. } = self.levels[0];
        let lod = footprint.lod.clamp(0.0, (full_level_count(width, height) - 1) as f32);
        let level = lod as usize + usize::from(place.y < lod.fract());
        if level == 0 {
            return uv;
        }
        let axis = |i: usize, side: u32| {
            let size = level_size(side, level) as f32;
            let x = uv[i] * size - 0.5;
            let first = x.floor();
            let texel = first + f32::from(u8::from(tap[i] < x - first));
            let texel = if self.wrap[i] == Wrap::Clamp { texel.clamp(0.0, size - 1.0) } else { texel };
            (texel + inside[i]) / size
        };
        vec2(axis(0, width), axis(1, height))
    }

    fn size(&self) -> Vec2 {
        vec2(self.levels[0].width as f32, self.levels[0].height as f32)
    }
}

/// A pixel's footprint as a sampler reads it.
struct Footprint {
    /// Unclamped.
    lod: f32,
    /// Along it lie the places where it is read.
    axis: Vec2,
    count: u32,
}

impl Footprint {
    /// From the middle to one of the places.
    #[inline]
    fn offset(&self, i: u32) -> Vec2 {
        self.axis * ((i + 1) as f32 / (self.count as f32 + 1.0) - 0.5)
    }
}

/// Decodes sRGB-encoded colour in place; alpha stays.
fn linearize(texels: &mut [[f32; 4]]) {
    let table = linear_of_codes();
    for texel in texels {
        for c in &mut texel[..3] {
            *c = table[(*c * 65535.0 + 0.5) as u16 as usize];
        }
    }
}

/// The two texels between whose centres the coordinate lies, and its place between them.
#[inline]
fn taps(coordinate: f32, size: u32, wrap: Wrap) -> (usize, usize, f32) {
    // Tiles are folded first, so that far coordinates keep their precision.
    let period = match wrap {
        Wrap::Repeat => coordinate - coordinate.floor(),
        Wrap::Mirror => coordinate - 2.0 * (coordinate * 0.5).floor(),
        Wrap::Clamp => coordinate.clamp(-1.0, 2.0),
    };
    let x = period * size as f32 - 0.5;
    let floor = x.floor();
    let place = |i: i32| -> usize {
        let n = size as i32;
        let i = match wrap {
            Wrap::Repeat if i < 0 => i + n,
            Wrap::Repeat if i >= n => i - n,
            Wrap::Mirror if i < 0 => -1 - i,
            Wrap::Mirror if i >= 2 * n => i - 2 * n,
            Wrap::Mirror if i >= n => 2 * n - 1 - i,
            _ => i,
        };
        i.clamp(0, n - 1) as usize
    };
    let first = floor as i32;
    (place(first), place(first + 1), x - floor)
}

/// The area average of a level over half its size, rounded down.
fn halve(level: &MipLevel) -> MipLevel {
    let (width, height) = ((level.width / 2).max(1), (level.height / 2).max(1));
    let (columns, rows) = (area_weights(level.width, width), area_weights(level.height, height));
    let mut texels = Vec::with_capacity(width as usize * height as usize);
    for row in &rows {
        for column in &columns {
            let mut sum = Vec4::ZERO;
            for &(y, wy) in row {
                for &(x, wx) in column {
                    sum += wx * wy * Vec4::from_array(level.texels[y * level.width as usize + x]);
                }
            }
            texels.push(sum.to_array());
        }
    }
    MipLevel { width, height, texels }
}

/// For each of `to` texels, which of the `from` it covers and by what share of itself.
fn area_weights(from: u32, to: u32) -> Vec<Vec<(usize, f32)>> {
    let scale = f64::from(from) / f64::from(to);
    (0..to)
        .map(|i| {
            let (start, end) = (f64::from(i) * scale, f64::from(i + 1) * scale);
            let covered = start.floor() as u32..(end.ceil() as u32).min(from);
            covered
                .map(|j| {
                    let overlap = end.min(f64::from(j + 1)) - start.max(f64::from(j));
                    (j as usize, (overlap / scale) as f32)
                })
                .filter(|&(_, weight)| weight > 0.0)
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinran_image::{Channels, Pixels};

    fn ramp(wrap: Wrap) -> MipTexture {
        let texels = (0..4).map(|x| [x as f32, 0.0, 0.0, 1.0]).collect();
        MipTexture { levels: vec![MipLevel { width: 4, height: 1, texels }], wrap: [wrap; 2], encoded: None }
    }

    #[test]
    fn borders_by_hand() {
        // Texel centres of a four-texel row lie at 1/8, 3/8, 5/8, 7/8.
        let cases = [
            (Wrap::Repeat, 0.0, 1.5),
            (Wrap::Repeat, 0.375, 1.0),
            (Wrap::Repeat, -0.125, 3.0),
            (Wrap::Repeat, 5.375, 1.0),
            (Wrap::Clamp, -0.4, 0.0),
            (Wrap::Clamp, 0.25, 0.5),
            (Wrap::Clamp, 900.0, 3.0),
            (Wrap::Mirror, -0.125, 0.0),
            (Wrap::Mirror, -0.375, 1.0),
            (Wrap::Mirror, 1.0, 3.0),
            (Wrap::Mirror, 1.375, 2.0),
            (Wrap::Mirror, 2.0, 0.0),
            (Wrap::Mirror, 6.125, 0.0),
        ];
        for (wrap, u, wanted) in cases {
            let got = ramp(wrap).sample_level(vec2(u, 0.3), 0).x;
            assert!((got - wanted).abs() < 1e-5, "{wrap:?} at {u}: wanted {wanted}, got {got}");
        }
    }

    #[test]
    fn hostile_coordinates_do_not_panic() {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            for u in
                [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -f32::MAX, 1e20, -1e-30, 0.999_999_94]
            {
                let texture = ramp(wrap);
                let _ = texture.sample_grad(vec2(u, u), vec2(u, 0.0), vec2(0.0, u), 16);
                let _ = texture.sample_lod(vec2(u, u), u);
            }
        }
    }

    #[test]
    fn srgb_is_averaged_in_linear_light_and_alpha_is_not_decoded() {
        let image = Image::new(2, 1, Channels::Rg, Pixels::U8(vec![0, 0, 255, 128])).unwrap();
        let texture = MipTexture::from_image(&image, Transfer::Srgb, [Wrap::Repeat; 2]);
        assert_eq!(texture.levels.len(), 2);
        let [r, _, _, a] = texture.levels[1].texels[0];
        assert!((r - 0.5).abs() < 1e-6, "black and white average to {r}");
        assert!((a - 64.0 / 255.0).abs() < 1e-6, "alpha {a}");

        // Code 188 is the encoding of half the light, rounded: ((188 / 255 + 0.055) / 1.055)^2.4.
        let image = Image::new(1, 1, Channels::R, Pixels::U8(vec![188])).unwrap();
        let got = MipTexture::from_image(&image, Transfer::Srgb, [Wrap::Repeat; 2]).levels[0].texels[0][0];
        assert!((got - 0.502_886_5).abs() < 1e-6, "code 188 is {got}");
    }

    #[test]
    fn odd_sizes_keep_the_mean_on_every_level() {
        let samples: Vec<f32> = (0..13 * 7).map(|i| ((i * 37) % 101) as f32 / 100.0).collect();
        let image = Image::new(13, 7, Channels::R, Pixels::F32(samples)).unwrap();
        let texture = MipTexture::from_image(&image, Transfer::Linear, [Wrap::Repeat; 2]);
        let sizes: Vec<_> = texture.levels.iter().map(|l| (l.width, l.height)).collect();
        assert_eq!(sizes, [(13, 7), (6, 3), (3, 1), (1, 1)]);
        let mean = |l: &MipLevel| l.texels.iter().map(|t| t[0]).sum::<f32>() / l.texels.len() as f32;
        let wanted = mean(&texture.levels[0]);
        for level in &texture.levels {
            let got = mean(level);
            assert!(
                (got - wanted).abs() < 1e-5,
                "{}x{}: wanted {wanted}, got {got}",
                level.width,
                level.height
            );
        }
    }

    #[test]
    fn lod_counts_texels_of_level_0_on_non_square_textures() {
        let level = |width: u32, height: u32| MipLevel {
            width,
            height,
            texels: vec![[0.0; 4]; (width * height) as usize],
        };
        let texture = MipTexture { levels: vec![level(64, 16)], wrap: [Wrap::Repeat; 2], encoded: None };
        // Four texels along u, eight along v.
        let lod = texture.lod(vec2(4.0 / 64.0, 0.0), vec2(0.0, 8.0 / 16.0));
        assert!((lod - 3.0).abs() < 1e-6, "wanted 3, got {lod}");
        let lod = texture.lod(vec2(3.0 / 64.0, 4.0 / 16.0), vec2(0.0, 0.0));
        assert!((lod - 5f32.log2()).abs() < 1e-6, "wanted log2 5, got {lod}");
    }

    #[test]
    fn anisotropic_filtering_reads_finer_levels_along_the_longer_axis() {
        // Level k holds the number k, so that the sample is its own level of detail.
        let levels = (0..7).map(|k| {
            let size = 64u32 >> k;
            MipLevel {
                width: size,
                height: size,
                texels: vec![[k as f32, 0.0, 0.0, 0.0]; (size * size) as usize],
            }
        });
        let texture = MipTexture { levels: levels.collect(), wrap: [Wrap::Repeat; 2], encoded: None };
        let footprint = [vec2(16.0 / 64.0, 0.0), vec2(0.0, 2.0 / 64.0)];
        for (max_anisotropy, wanted) in [(1, 4.0), (2, 3.0), (4, 2.0), (8, 1.0), (16, 1.0)] {
            let got = texture.sample_grad(vec2(0.3, 0.7), footprint[0], footprint[1], max_anisotropy).x;
            assert!((got - wanted).abs() < 1e-5, "{max_anisotropy}x: wanted level {wanted}, got {got}");
        }
    }

    #[test]
    fn trilinear_blends_two_levels() {
        let level = |size: u32, value: f32| MipLevel {
            width: size,
            height: size,
            texels: vec![[value; 4]; (size * size) as usize],
        };
        let texture =
            MipTexture { levels: vec![level(2, 0.0), level(1, 1.0)], wrap: [Wrap::Repeat; 2], encoded: None };
        for (lod, wanted) in [(-3.0, 0.0), (0.0, 0.0), (0.25, 0.25), (1.0, 1.0), (9.0, 1.0)] {
            assert_eq!(texture.sample_lod(vec2(0.1, 0.9), lod).x, wanted, "lod {lod}");
        }
    }
}
