//! Authored maps as rows of normals and squared roughness matrices.

use std::ops::Range;
use std::sync::Arc;

use glam::{Vec2, Vec3, vec2, vec3};
use kinran_image::{Channels, Image, Pixels};
use kinran_scene::Wrap;
use kinran_shading::{
    ALPHA_MIN, Sym2, alpha_from_roughness, alphas_from_khr_anisotropy, aniso_decode_matrix,
    aniso_from_alphas, axis_from_direction, normal_from_xy,
};

use super::weights::Weights;
use crate::channels::{Place, read_channel, read_channels};
use crate::simd::dispatch;

/// A scalar map: one channel of an image times a factor, or the factor alone.
#[derive(Clone, Debug)]
pub struct ScalarMap {
    /// The image and which of its channels, 0 to 3.
    pub image: Option<(Arc<Image>, usize)>,
    /// Multiplied with the channel; the value itself where there is no image.
    pub factor: f32,
}

impl ScalarMap {
    /// The same value everywhere.
    pub fn constant(value: f32) -> Self {
        ScalarMap { image: None, factor: value }
    }

    /// One channel of an image, as it is.
    pub fn channel(image: Arc<Image>, channel: usize) -> Self {
        ScalarMap { image: Some((image, channel)), factor: 1.0 }
    }
}

/// How a direction is painted.
#[derive(Clone, Debug)]
pub enum DirectionMap {
    /// Grey: the angle from the tangent, counter-clockwise, as a fraction of `span`. A span of a full turn
    /// (2π) is what Substance's anisotropy angle uses, half a turn (π) is enough for a direction without sign.
    Angle {
        /// 0 to 1.
        map: ScalarMap,
        /// Radians that 1 stands for.
        span: f32,
    },
    /// Red and green, mapped from [0, 1] to [−1, 1]: the vector in (tangent, bitangent), as in glTF.
    Vector(Arc<Image>),
}

/// The roughness part of a surface.
#[derive(Clone, Debug)]
pub enum RoughnessMaps {
    /// Perceptual roughness, the same in all directions.
    Isotropic(ScalarMap),
    /// Gloss along `direction`, gloss across it; `alpha = (1 - gloss)²`.
    Gloss {
        /// Along the direction.
        u: ScalarMap,
        /// Across it.
        v: ScalarMap,
        /// Where u points; along the tangent when absent.
        direction: Option<DirectionMap>,
    },
    /// `KHR_materials_anisotropy`.
    Khr {
        /// Perceptual roughness across the direction.
        roughness: ScalarMap,
        /// Multiplied with the texture's blue channel.
        strength: f32,
        /// Radians, counter-clockwise, added to the texture's direction.
        rotation: f32,
        /// RG direction, B strength.
        texture: Option<Arc<Image>>,
    },
    /// An aniso map as Kinran writes it: RGB `[sqrt(Sxx), rho/2 + 1/2, sqrt(Syy)]`.
    Encoded(Arc<Image>),
}

/// Where z of a normal map's vectors comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NormalZ {
    /// From red and green and unit length, as shaders rebuild it.
    #[default]
    Rebuilt,
    /// From blue, and red, green and blue are brought to unit length together, as glTF 2.0 section 3.9.3 has it. A vector that
    /// points into the surface is laid on it. An image without blue has z rebuilt.
    Blue,
}

/// A tangent-space normal map.
#[derive(Clone, Debug)]
pub struct NormalMap {
    /// RG, or RGB whose blue counts as `z` says. Absent: flat.
    pub image: Option<Arc<Image>>,
    /// Where z comes from.
    pub z: NormalZ,
    /// Green grows downwards (DirectX) instead of upwards (glTF, OpenGL).
    pub y_down: bool,
    /// Samples are components in [−1, 1] (float images that hold negative numbers), not mapped to [0, 1].
    pub signed: bool,
    /// Multiplies x and y, after z was found and before the vector is made unit length again (glTF
    /// `normalTexture.scale`).
    pub scale: f32,
}

impl NormalMap {
    /// No map: (0, 0, 1) everywhere.
    pub fn flat() -> Self {
        NormalMap { image: None, z: NormalZ::Rebuilt, y_down: false, signed: false, scale: 1.0 }
    }

    /// A map of scale 1, of which z is rebuilt; signed if it is a float image with a negative sample.
    pub fn new(image: Arc<Image>, y_down: bool) -> Self {
        let signed = matches!(&image.pixels, Pixels::F32(data) if data.iter().any(|v| *v < 0.0));
        NormalMap { image: Some(image), z: NormalZ::Rebuilt, y_down, signed, scale: 1.0 }
    }

    /// A glTF `normalTexture` with its `scale`.
    pub fn gltf(image: Arc<Image>, scale: f32) -> Self {
        NormalMap { z: NormalZ::Blue, scale, ..NormalMap::new(image, false) }
    }
}

/// Everything authored about one surface's normals and specular.
#[derive(Clone, Debug)]
pub struct SurfaceMaps {
    /// Normals.
    pub normal: NormalMap,
    /// Roughness.
    pub roughness: RoughnessMaps,
    /// What lies beyond the borders along u and v, where a filter reaches there.
    pub wrap: [Wrap; 2],
    /// How much each texel of level 0 counts in a footprint, of the size of level 0; all the same where there are none. What a
    /// texel reflects, see [`Reflectance::weights`](super::Reflectance::weights), is what a filter of highlights should know.
    pub weights: Option<Arc<Weights>>,
}

/// Texels of part of a row of level 0, one array a component.
#[derive(Clone, Debug, Default)]
pub struct TexelSpan {
    /// Unit normal, x.
    pub nx: Vec<f32>,
    /// Unit normal, y.
    pub ny: Vec<f32>,
    /// Unit normal, z ≥ 0.
    pub nz: Vec<f32>,
    /// Squared roughness in the frame `M_n`, row x, column x.
    pub axx: Vec<f32>,
    /// Row x, column y.
    pub axy: Vec<f32>,
    /// Row y, column y.
    pub ayy: Vec<f32>,
    scratch: [Vec<f32>; 3],
}

impl TexelSpan {
    /// Texels in the span.
    pub fn len(&self) -> usize {
        self.nx.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.nx.is_empty()
    }

    /// Takes all texels out and keeps their room.
    pub(crate) fn clear(&mut self) {
        let TexelSpan { nx, ny, nz, axx, axy, ayy, .. } = self;
        [nx, ny, nz, axx, axy, ayy].into_iter().for_each(Vec::clear);
    }

    /// Appends texels `[nx, ny, nz, axx, axy, ayy]`.
    #[inline(always)]
    pub(crate) fn extend(&mut self, texels: [&[f32]; 6]) {
        let TexelSpan { nx, ny, nz, axx, axy, ayy, .. } = self;
        for (v, more) in [nx, ny, nz, axx, axy, ayy].into_iter().zip(texels) {
            v.extend_from_slice(more);
        }
    }

    /// The normal of texel `i` and its squared roughness.
    #[inline(always)]
    pub fn texel(&self, i: usize) -> (Vec3, Sym2) {
        (vec3(self.nx[i], self.ny[i], self.nz[i]), Sym2 { xx: self.axx[i], xy: self.axy[i], yy: self.ayy[i] })
    }

    /// Replaces texel `i`.
    #[inline(always)]
    pub fn set(&mut self, i: usize, n: Vec3, a: Sym2) {
        (self.nx[i], self.ny[i], self.nz[i]) = (n.x, n.y, n.z);
        (self.axx[i], self.axy[i], self.ayy[i]) = (a.xx, a.xy, a.yy);
    }

    /// Makes room for `len` texels; their values are unspecified.
    pub fn resize(&mut self, len: usize) {
        for v in [&mut self.nx, &mut self.ny, &mut self.nz, &mut self.axx, &mut self.axy, &mut self.ayy] {
            v.resize(len, 0.0);
        }
    }
}

impl SurfaceMaps {
    /// Size of level 0: the largest width and the largest height among the maps, 1×1 where all are constants.
    pub fn size(&self) -> (u32, u32) {
        self.images().iter().fold((1, 1), |(w, h), image| (w.max(image.width), h.max(image.height)))
    }

    /// The images, each as often as it is used.
    pub fn images(&self) -> Vec<&Arc<Image>> {
        fn of(map: &ScalarMap) -> Option<&Arc<Image>> {
            map.image.as_ref().map(|(image, _)| image)
        }
        let normal = self.normal.image.as_ref();
        let roughness = match &self.roughness {
            RoughnessMaps::Isotropic(r) => [of(r), None, None],
            RoughnessMaps::Gloss { u, v, direction } => {
                let direction = direction.as_ref().and_then(|d| match d {
                    DirectionMap::Angle { map, .. } => of(map),
                    DirectionMap::Vector(image) => Some(image),
                });
                [of(u), of(v), direction]
            }
            RoughnessMaps::Khr { roughness, texture, .. } => [of(roughness), texture.as_ref(), None],
            RoughnessMaps::Encoded(image) => [Some(image), None, None],
        };
        normal.into_iter().chain(roughness.into_iter().flatten()).collect()
    }

    /// The weights, where texels do not all count the same.
    ///
    /// # Panics
    /// When they are not of the size of level 0.
    pub(crate) fn checked_weights(&self) -> Option<&Weights> {
        let weights = self.weights.as_deref()?;
        assert_eq!(weights.size(), self.size(), "weights are of the size of level 0");
        Some(weights)
    }

    /// Decodes the texels `x0 .. x0 + len` of row `y` of level 0, of size `size`, into `span`. Maps smaller
    /// than level 0 are enlarged bilinearly, in the form in which they are stored.
    pub fn decode_span(&self, size: (u32, u32), y: u32, x0: u32, len: usize, span: &mut TexelSpan) {
        span.resize(len);
        self.decode_part(Place { size, y, x0, wrap: self.wrap }, 0..len, span);
    }

    /// Decodes rows `y0 .. y0 + rows` of level 0, of size `size`, into `texels`, row after row.
    pub(crate) fn decode_rows(&self, size: (u32, u32), y0: u32, rows: u32, texels: &mut TexelSpan) {
        let width = size.0 as usize;
        texels.resize(rows as usize * width);
        for row in 0..rows {
            let start = row as usize * width;
            let at = Place { size, y: y0 + row, x0: 0, wrap: self.wrap };
            self.decode_part(at, start..start + width, texels);
        }
    }

    fn decode_part(&self, at: Place, part: Range<usize>, span: &mut TexelSpan) {
        dispatch(DecodeSpan { maps: self, at, part, span });
    }

    #[inline(always)]
    fn decode_normals(&self, at: Place, [nx, ny, nz]: [&mut [f32]; 3]) {
        let Some(image) = &self.normal.image else {
            nx.fill(0.0);
            ny.fill(0.0);
            nz.fill(1.0);
            return;
        };
        let (gain, offset) = if self.normal.signed { (1.0, 0.0) } else { (2.0, -1.0) };
        let (y_gain, y_offset) = if self.normal.y_down { (-gain, -offset) } else { (gain, offset) };
        let scale = self.normal.scale;
        if self.normal.z == NormalZ::Blue && image.channels >= Channels::Rgb {
            read_channels(image, [0, 1, 2], at, [&mut *nx, &mut *ny, &mut *nz]);
            for ((x, y), z) in nx.iter_mut().zip(&mut *ny).zip(&mut *nz) {
                let (vx, vy) = ((*x * gain + offset) * scale, (*y * y_gain + y_offset) * scale);
                let vz = (*z * gain + offset).max(0.0);
                let length = (vx * vx + vy * vy + vz * vz).sqrt();
                // Without a direction the surface is flat.
                let (unit, flat) = if length > 0.0 { (length.recip(), 0.0) } else { (0.0, 1.0) };
                (*x, *y, *z) = (vx * unit, vy * unit, vz * unit + flat);
            }
            return;
        }
        read_channels(image, [0, 1], at, [&mut *nx, &mut *ny]);
        // Vectors longer than one are rare: the loop that looks for them spares the others a root and a division.
        let mut any = 0;
        for ((x, y), z) in nx.iter_mut().zip(&mut *ny).zip(&mut *nz) {
            (*x, *y) = (*x * gain + offset, *y * y_gain + y_offset);
            let xy_squared = *x * *x + *y * *y;
            any |= u32::from(xy_squared > 1.0);
            *z = (1.0 - xy_squared).max(0.0).sqrt();
        }
        if any != 0 {
            for ((x, y), z) in nx.iter_mut().zip(&mut *ny).zip(&mut *nz) {
                let n = normal_from_xy(*x, *y);
                (*x, *y, *z) = (n.x, n.y, n.z);
            }
        }
        if scale != 1.0 {
            for ((x, y), z) in nx.iter_mut().zip(&mut *ny).zip(&mut *nz) {
                // Where a scale of zero leaves nothing of a normal on the horizon, the surface is flat.
                let n = vec3(*x * scale, *y * scale, *z).normalize_or(Vec3::Z);
                (*x, *y, *z) = (n.x, n.y, n.z);
            }
        }
    }

    #[inline(always)]
    fn decode_roughness(
        &self,
        at: Place,
        [nx, ny, nz]: [&[f32]; 3],
        [axx, axy, ayy]: [&mut [f32]; 3],
        scratch: &mut [Vec<f32>; 3],
    ) {
        // Slices of one length let the compiler drop the bounds checks that keep loops from being vectorised.
        let len = nx.len();
        scratch.iter_mut().for_each(|v| v.resize(len, 0.0));
        let [p, q, r] = scratch;
        let (nx, ny, nz) = (&nx[..len], &ny[..len], &nz[..len]);
        let (axx, axy, ayy) = (&mut axx[..len], &mut axy[..len], &mut ayy[..len]);
        let (p, q, r) = (&mut p[..len], &mut q[..len], &mut r[..len]);
        match &self.roughness {
            RoughnessMaps::Isotropic(roughness) => {
                read_scalar(roughness, at, axx);
                for (xx, yy) in axx.iter_mut().zip(ayy.iter_mut()) {
                    let alpha = alpha_from_roughness(*xx);
                    *xx = alpha * alpha;
                    *yy = alpha * alpha;
                }
                axy.fill(0.0);
            }
            RoughnessMaps::Gloss { u, v, direction } => {
                read_scalar(u, at, p);
                read_scalar(v, at, q);
                let mut painted = Vec::new();
                if let Some(direction) = direction {
                    painted = read_direction(direction, at, r);
                }
                for i in 0..len {
                    let n = vec3(nx[i], ny[i], nz[i]);
                    let direction = painted.get(i).copied().unwrap_or(Vec2::X);
                    let axis = axis_from_direction(direction, n);
                    let (alpha_u, alpha_v) =
                        (alpha_from_roughness(1.0 - p[i]), alpha_from_roughness(1.0 - q[i]));
                    let a = aniso_from_alphas(alpha_u, alpha_v, axis);
                    (axx[i], axy[i], ayy[i]) = (a.xx, a.xy, a.yy);
                }
            }
            RoughnessMaps::Khr { roughness, strength, rotation, texture } => {
                read_scalar(roughness, at, p);
                match texture {
                    Some(image) => read_channel(image, 2, at, q),
                    None => q.fill(1.0),
                }
                let painted = match texture {
                    Some(image) => read_vectors(image, at, r),
                    None => vec![Vec2::X; len],
                };
                let turn = vec2(libm::cosf(*rotation), libm::sinf(*rotation));
                for i in 0..len {
                    let n = vec3(nx[i], ny[i], nz[i]);
                    let axis = axis_from_direction(turn.rotate(painted[i]), n);
                    let (alpha_t, alpha_b) =
                        alphas_from_khr_anisotropy(p[i], (q[i] * strength).clamp(0.0, 1.0));
                    let a = aniso_from_alphas(alpha_t, alpha_b, axis);
                    (axx[i], axy[i], ayy[i]) = (a.xx, a.xy, a.yy);
                }
            }
            RoughnessMaps::Encoded(image) => {
                read_channels(image, [0, 1, 2], at, [&mut *p, &mut *q, &mut *r]);
                let mut any = 0;
                for i in 0..len {
                    let texel =
                        vec3(p[i].clamp(ALPHA_MIN, 1.0), q[i].clamp(0.0, 1.0), r[i].clamp(ALPHA_MIN, 1.0));
                    let a = aniso_decode_matrix(texel);
                    (axx[i], axy[i], ayy[i]) = (a.xx, a.xy, a.yy);
                    any |= u32::from((1.0 - a.xx) * (1.0 - a.yy) < a.xy * a.xy);
                }
                // A texel with a correlation may be rougher than alpha = 1.
                if any != 0 {
                    clamp_roughness(axx, axy, ayy);
                }
            }
        }
    }
}

/// Brings squared roughness matrices to eigenvalues of at most one. Rougher ones are rare: the loop that looks
/// for them is free of branches.
#[inline(always)]
pub(crate) fn clamp_roughness(axx: &mut [f32], axy: &mut [f32], ayy: &mut [f32]) {
    let too_rough = |xx: f32, xy: f32, yy: f32| {
        u32::from(xx > 1.0) | u32::from(yy > 1.0) | u32::from((1.0 - xx) * (1.0 - yy) < xy * xy)
    };
    let len = axx.len();
    let (axy, ayy) = (&mut axy[..len], &mut ayy[..len]);
    let mut any = 0;
    for i in 0..len {
        any |= too_rough(axx[i], axy[i], ayy[i]);
    }
    if any == 0 {
        return;
    }
    for i in 0..len {
        if too_rough(axx[i], axy[i], ayy[i]) != 0 {
            let a = Sym2 { xx: axx[i], xy: axy[i], yy: ayy[i] }.clamp_eigen(0.0, 1.0);
            (axx[i], axy[i], ayy[i]) = (a.xx, a.xy, a.yy);
        }
    }
}

/// The decoding of part of a span, as a unit that is compiled once for each instruction set.
struct DecodeSpan<'a> {
    maps: &'a SurfaceMaps,
    at: Place,
    part: Range<usize>,
    span: &'a mut TexelSpan,
}

impl pulp::WithSimd for DecodeSpan<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { maps, at, part, span } = self;
        let TexelSpan { nx, ny, nz, axx, axy, ayy, scratch } = span;
        let (nx, ny, nz) = (&mut nx[part.clone()], &mut ny[part.clone()], &mut nz[part.clone()]);
        let (axx, axy, ayy) = (&mut axx[part.clone()], &mut axy[part.clone()], &mut ayy[part]);
        maps.decode_normals(at, [&mut *nx, &mut *ny, &mut *nz]);
        maps.decode_roughness(at, [nx, ny, nz], [axx, axy, ayy], scratch);
    }
}

#[inline(always)]
pub(crate) fn read_scalar(map: &ScalarMap, at: Place, out: &mut [f32]) {
    match &map.image {
        None => out.fill(map.factor.clamp(0.0, 1.0)),
        Some((image, channel)) => {
            read_channel(image, *channel, at, out);
            for v in out {
                *v = (*v * map.factor).clamp(0.0, 1.0);
            }
        }
    }
}

fn read_direction(map: &DirectionMap, at: Place, scratch: &mut [f32]) -> Vec<Vec2> {
    match map {
        DirectionMap::Vector(image) => read_vectors(image, at, scratch),
        DirectionMap::Angle { map, span } => {
            read_scalar(map, at, scratch);
            scratch.iter().map(|v| vec2(libm::cosf(v * span), libm::sinf(v * span))).collect()
        }
    }
}

/// Unit vectors from red and green; (1, 0) where a texel holds none.
fn read_vectors(image: &Image, at: Place, scratch: &mut [f32]) -> Vec<Vec2> {
    read_channel(image, 0, at, scratch);
    let mut vectors: Vec<Vec2> = scratch.iter().map(|x| vec2(x * 2.0 - 1.0, 0.0)).collect();
    read_channel(image, 1, at, scratch);
    for (v, y) in vectors.iter_mut().zip(scratch) {
        v.y = *y * 2.0 - 1.0;
        // 8 bits cannot hold zero: what is shorter than two of their steps is a texel without a direction.
        *v = if v.length_squared() > 6e-5 { v.normalize() } else { Vec2::X };
    }
    vectors
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Maps of other sizes than level 0 are enlarged on the way.
        #[test]
        fn texels_depend_on_the_span_they_are_decoded_in(
            own in (1_u32..40, 1_u32..4),
            width in 1_u32..80,
            span in 1_usize..40,
            y in 0_u32..4,
            samples in prop::collection::vec(any::<u8>(), 31),
        ) {
            let size = (width, 4);
            let image = |(width, height): (u32, u32)| {
                let samples = samples.iter().cycle().take((width * height * 3) as usize).copied().collect();
                Arc::new(Image::new(width, height, Channels::Rgb, Pixels::U8(samples)).unwrap())
            };
            let maps = SurfaceMaps {
                normal: NormalMap::new(image(size), false),
                roughness: RoughnessMaps::Isotropic(ScalarMap::channel(image(own), 1)),
                wrap: [Wrap::Repeat, Wrap::Clamp],
                weights: None,
            };
            let decode = |x0: usize, len: usize| {
                let mut texels = TexelSpan::default();
                maps.decode_span(size, y, x0 as u32, len, &mut texels);
                (0..len).map(|i| texels.texel(i)).collect::<Vec<_>>()
            };
            let width = width as usize;
            let starts = (0..width).step_by(span);
            let cut: Vec<_> = starts.flat_map(|x0| decode(x0, span.min(width - x0))).collect();
            prop_assert_eq!(cut, decode(0, width));
        }
    }
}
