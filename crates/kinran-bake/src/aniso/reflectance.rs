//! What the texels of a surface reflect, by the maps of its colour.
//!
//! A highlight's light comes from microfacets that reflect: in a texel of a footprint where gold lies on dark cloth it is
//! gold's, however much of the footprint is cloth. Reflectance at normal incidence, F0, is that share: Schlick's Fresnel term
//! has it in all of its directions but the last ones before grazing, where everything reflects alike.

use std::sync::Arc;

use glam::Vec3;
use kinran_image::srgb::linear_of_codes;
use kinran_image::{Image, Transfer};
use kinran_scene::Wrap;
use kinran_shading::DIELECTRIC_F0;
use rayon::prelude::*;

use super::footprint::{Taps, area_taps};
use super::maps::{ScalarMap, read_scalar};
use super::weights::Weights;
use crate::channels::{Place, read_channels};

/// A colour map: linear, an image times a factor, or the factor alone.
#[derive(Clone, Debug)]
pub struct ColorMap {
    /// The image, encoded as it says itself ([`Image::transfer`]); sRGB where it does not say.
    pub image: Option<Arc<Image>>,
    /// Multiplied with red, green and blue; the colour itself where there is no image.
    pub factor: Vec3,
}

/// Reflectance of what is not metal, at normal incidence: `strength · min(color · f0, 1)`, as `KHR_materials_specular` and
/// `KHR_materials_ior` have it.
#[derive(Clone, Debug)]
pub struct Dielectric {
    /// `((ior - 1) / (ior + 1))²`, 0.04 for glTF's 1.5.
    pub f0: f32,
    /// `specularFactor` times the alpha of `specularTexture`.
    pub strength: ScalarMap,
    /// `specularColorFactor` times `specularColorTexture`.
    pub color: ColorMap,
}

impl Default for Dielectric {
    /// glTF's, where no extension says otherwise.
    fn default() -> Self {
        Dielectric {
            f0: DIELECTRIC_F0,
            strength: ScalarMap::constant(1.0),
            color: ColorMap { image: None, factor: Vec3::ONE },
        }
    }
}

impl Dielectric {
    /// F0 where it is the same everywhere.
    pub(crate) fn constant(&self) -> Option<Vec3> {
        let varies = self.strength.image.is_some() || self.color.image.is_some();
        (!varies).then(|| dielectric_f0(self.f0, self.strength.factor, self.color.factor))
    }
}

#[inline(always)]
fn dielectric_f0(f0: f32, strength: f32, color: Vec3) -> Vec3 {
    (color * f0).min(Vec3::ONE) * strength
}

/// How a surface's reflectance is painted.
#[derive(Clone, Debug)]
pub enum ReflectanceMaps {
    /// F0 of a dielectric, mixed with the base colour by metalness.
    Metallic {
        /// Colour of what scatters and of what is metal.
        base: ColorMap,
        /// 0 is a dielectric, 1 is metal.
        metallic: ScalarMap,
        /// F0 of the former.
        dielectric: Dielectric,
    },
    /// F0 itself (specular/glossiness).
    Specular(ColorMap),
}

/// What the texels of a surface reflect.
#[derive(Clone, Debug)]
pub struct Reflectance {
    /// The maps. They lie on the mesh as those of the surface do.
    pub maps: ReflectanceMaps,
    /// What lies beyond the borders along u and v.
    pub wrap: [Wrap; 2],
}

impl Reflectance {
    /// Size of the largest map along each axis, 1×1 where all are constants.
    pub fn size(&self) -> (u32, u32) {
        let images = match &self.maps {
            ReflectanceMaps::Metallic { base, metallic, dielectric } => [
                base.image.as_ref(),
                metallic.image.as_ref().map(|(image, _)| image),
                dielectric.strength.image.as_ref().map(|(image, _)| image),
                dielectric.color.image.as_ref(),
            ],
            ReflectanceMaps::Specular(color) => [color.image.as_ref(), None, None, None],
        };
        images.into_iter().flatten().fold((1, 1), |(w, h), image| (w.max(image.width), h.max(image.height)))
    }

    /// Weights of the texels of a surface of size `size`: F0, averaged over red, green and blue and over the texel. Maps are
    /// enlarged bilinearly to the largest of them and of the surface, and there F0 is averaged over the surface's texels. `None`
    /// where F0 is the same everywhere.
    pub fn weights(&self, size: (u32, u32)) -> Option<Weights> {
        let own = self.size();
        if own == (1, 1) {
            return None;
        }
        let fine = (own.0.max(size.0), own.1.max(size.1));
        let columns = (fine.0 != size.0).then(|| area_taps(fine.0, size.0));
        let rows = area_taps(fine.1, size.1);
        let mut of = vec![0; size.0 as usize * size.1 as usize];
        of.par_chunks_mut(size.0 as usize).zip(&rows).for_each_init(
            || (F0Rows::default(), Vec::new()),
            |(f0, sum), (out, rows)| {
                sum.clear();
                sum.resize(fine.0 as usize, 0.0);
                for &(y, weight) in rows {
                    self.f0_row(Place { size: fine, y, x0: 0, wrap: self.wrap }, f0);
                    for (sum, f0) in sum.iter_mut().zip(&f0.mean) {
                        *sum += f0 * weight;
                    }
                }
                let average = |taps: &Taps| taps.iter().map(|&(x, weight)| sum[x as usize] * weight).sum();
                let code = |f0: f32| (f0.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16;
                match &columns {
                    Some(columns) => {
                        out.iter_mut().zip(columns).for_each(|(out, taps)| *out = code(average(taps)));
                    }
                    None => out.iter_mut().zip(&*sum).for_each(|(out, sum)| *out = code(*sum)),
                }
            },
        );
        Weights::new(size, of)
    }

    /// Mean F0 of the texels of a row.
    fn f0_row(&self, at: Place, rows: &mut F0Rows) {
        let width = at.size.0 as usize;
        let F0Rows { mean, color, metallic, strength } = rows;
        mean.resize(width, 0.0);
        color.iter_mut().chain([&mut *metallic, &mut *strength]).for_each(|row| row.resize(width, 0.0));
        let third = 1.0 / 3.0;
        match &self.maps {
            ReflectanceMaps::Specular(specular) => {
                read_color(specular, at, color);
                let [r, g, b] = &*color;
                for (i, mean) in mean.iter_mut().enumerate() {
                    *mean = (r[i] + g[i] + b[i]) * third;
                }
            }
            ReflectanceMaps::Metallic { base, metallic: map, dielectric } => {
                read_scalar(map, at, metallic);
                match dielectric.constant() {
                    Some(f0) => mean.fill(f0.element_sum() * third),
                    None => {
                        read_scalar(&dielectric.strength, at, strength);
                        // Colours above one are at most one of what they reflect.
                        let factor = dielectric.color.factor * dielectric.f0;
                        let reflected = ColorMap { image: dielectric.color.image.clone(), factor };
                        read_color(&reflected, at, color);
                        let [r, g, b] = &*color;
                        for (i, mean) in mean.iter_mut().enumerate() {
                            *mean = (r[i] + g[i] + b[i]) * third * strength[i];
                        }
                    }
                }
                // Rows of cloth and stone are spared their colour.
                if metallic.iter().all(|metallic| *metallic == 0.0) {
                    return;
                }
                read_color(base, at, color);
                let [r, g, b] = &*color;
                for (i, mean) in mean.iter_mut().enumerate() {
                    let base = (r[i] + g[i] + b[i]) * third;
                    *mean += (base - *mean) * metallic[i];
                }
            }
        }
    }
}

/// A row of F0 and what it is made of.
#[derive(Default)]
struct F0Rows {
    mean: Vec<f32>,
    color: [Vec<f32>; 3],
    metallic: Vec<f32>,
    strength: Vec<f32>,
}

/// Red, green and blue of a row, linear, in [0, 1].
pub(crate) fn read_color(map: &ColorMap, at: Place, planes: &mut [Vec<f32>; 3]) {
    let factor = map.factor.to_array();
    let Some(image) = &map.image else {
        planes.iter_mut().zip(factor).for_each(|(plane, factor)| plane.fill(factor.clamp(0.0, 1.0)));
        return;
    };
    let [r, g, b] = planes;
    read_channels(image, [0, 1, 2], at, [r, g, b]);
    let table = linear_of_codes();
    for (plane, factor) in planes.iter_mut().zip(factor) {
        if image.transfer == Transfer::Linear {
            plane.iter_mut().for_each(|v| *v = (*v * factor).clamp(0.0, 1.0));
        } else {
            // Exact for images of 8 and 16 bits.
            let linear = |v: f32| table[(v.clamp(0.0, 1.0) * 65535.0 + 0.5) as usize];
            plane.iter_mut().for_each(|v| *v = (linear(*v) * factor).clamp(0.0, 1.0));
        }
    }
}
