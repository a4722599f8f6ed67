//! Painted material maps, as files and as glTF textures.

use std::path::Path;

use glam::{Vec2, Vec3, vec2};
use kinran_bake::srgb_from_linear;
use kinran_image::{Channels, Image, Pixels, write_png};
use kinran_shading::{khr_anisotropy_from_alphas, normal_from_slope};
use rayon::prelude::*;

use crate::Error;

/// A material at one point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Texel {
    /// Base colour, linear.
    pub(super) color: Vec3,
    /// 0 to 1.
    pub(super) metallic: f32,
    /// GGX roughness along `direction`; not above `alpha_across`.
    pub(super) alpha_along: f32,
    /// GGX roughness across `direction`.
    pub(super) alpha_across: f32,
    /// Unit vector along a groove or a thread, x to the right, y up.
    pub(super) direction: Vec2,
    /// In texels.
    pub(super) height: f32,
    /// Added to the slope of `height`.
    pub(super) slope: Vec2,
}

/// Maps of one material, all of the same size, 8 bits a channel.
#[derive(Clone, Debug)]
pub(super) struct Maps {
    /// sRGB.
    pub(super) base_color: Image,
    /// Tangent space, +Y up.
    pub(super) normal: Image,
    gloss_u: Image,
    gloss_v: Image,
    direction: Image,
    metallic: Image,
    /// As glTF packs it: G perceptual roughness, B metallic.
    pub(super) metallic_roughness: Image,
    /// `KHR_materials_anisotropy`: RG direction of the larger roughness, B strength.
    pub(super) anisotropy: Image,
}

/// Paints `size` by `size` texels. `material` is asked for the point in the middle of each texel, in texels
/// from the lower left corner; heights continue beyond the borders as tiles do.
///
/// # Errors
/// [`Error::Image`] for a size that no image can have.
pub(super) fn paint(size: u32, material: impl Fn(Vec2) -> Texel + Sync) -> Result<Maps, Error> {
    let row = |y: u32| {
        (0..size).map(move |x| (x, y)).map(|(x, y)| {
            let up = (size - 1 - y) as f32;
            material(vec2(x as f32 + 0.5, up + 0.5))
        })
    };
    let texels: Vec<Texel> = (0..size).into_par_iter().flat_map_iter(row).collect();
    let height = |x: u32, y: u32| texels[(y % size * size + x % size) as usize].height;
    let normal = |i: usize| {
        let (x, y) = (i as u32 % size + size, i as u32 / size + size);
        let right = height(x + 1, y) - height(x - 1, y);
        let up = height(x, y - 1) - height(x, y + 1);
        // A slope of one more in x leans the normal towards -x.
        let lean = -(0.5 * vec2(right, up) + texels[i].slope);
        normal_from_slope(lean) * 0.5 + 0.5
    };
    let image = |channels: Channels, values: &(dyn Fn(usize) -> Vec3 + Sync)| {
        let bytes = (0..texels.len()).into_par_iter().flat_map_iter(|i| {
            let texel = values(i).to_array().map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8);
            texel.into_iter().take(channels.count())
        });
        Image::new(size, size, channels, Pixels::U8(bytes.collect()))
    };
    let khr = |i: usize| khr_anisotropy_from_alphas(texels[i].alpha_across, texels[i].alpha_along);
    let gloss = |alpha: f32| Vec3::splat(1.0 - alpha.sqrt());
    Ok(Maps {
        base_color: image(Channels::Rgb, &|i| {
            Vec3::from(texels[i].color.to_array().map(|c| srgb_from_linear(c.clamp(0.0, 1.0))))
        })?,
        normal: image(Channels::Rgb, &normal)?,
        gloss_u: image(Channels::R, &|i| gloss(texels[i].alpha_along))?,
        gloss_v: image(Channels::R, &|i| gloss(texels[i].alpha_across))?,
        direction: image(Channels::Rgb, &|i| (texels[i].direction * 0.5 + 0.5).extend(0.0))?,
        metallic: image(Channels::R, &|i| Vec3::splat(texels[i].metallic))?,
        metallic_roughness: image(Channels::Rgb, &|i| Vec3::new(1.0, khr(i).0, texels[i].metallic))?,
        anisotropy: image(Channels::Rgb, &|i| (texels[i].direction.perp() * 0.5 + 0.5).extend(khr(i).1))?,
    })
}

impl Maps {
    /// Writes the maps to `folder`, which is made if it does not exist, as `name_baseColor.png`,
    /// `name_normal.png`, `name_glossU.png`, `name_glossV.png`, `name_direction.png` and
    /// `name_metallic.png`.
    ///
    /// # Errors
    /// [`Error::Image`] where the folder or a file cannot be written.
    pub(super) fn write(&self, folder: &Path, name: &str) -> Result<(), Error> {
        kinran_image::make_folder(folder)?;
        let maps = [
            ("baseColor", &self.base_color),
            ("normal", &self.normal),
            ("glossU", &self.gloss_u),
            ("glossV", &self.gloss_v),
            ("direction", &self.direction),
            ("metallic", &self.metallic),
        ];
        for (role, image) in maps {
            write_png(&folder.join(format!("{name}_{role}.png")), image)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hill of half a turn along x, whose slope is known: the normal leans against it, and green is up.
    #[test]
    fn normals_lean_away_from_where_the_height_rises() {
        let hill = |along: fn(Vec2) -> f32| {
            move |p: Vec2| Texel {
                color: Vec3::ONE,
                metallic: 0.0,
                alpha_along: 0.1,
                alpha_across: 0.3,
                direction: Vec2::X,
                height: libm::sinf(along(p) * std::f32::consts::TAU / 64.0),
                slope: Vec2::ZERO,
            }
        };
        let tan = std::f32::consts::TAU / 64.0;
        let lean = 0.5 - 0.5 * tan / (1.0 + tan * tan).sqrt();
        // Texel (0, 63) is the lower left one, where the sine rises at its steepest.
        for (channel, maps) in [(0, paint(64, hill(|p| p.x))), (1, paint(64, hill(|p| p.y)))] {
            let got = maps.unwrap().normal.texel(0, 63);
            // Half a code of eight bits, and what the central difference loses.
            assert!(
                (got[channel] - lean).abs() < 0.5 / 255.0 + 1e-3,
                "wanted {lean} in {channel}, got {got:?}"
            );
            assert!((got[1 - channel] - 0.5).abs() < 1.0 / 255.0, "{got:?}");
        }
    }

    #[test]
    fn gloss_maps_and_gltf_maps_say_the_same() {
        let texel = Texel {
            color: Vec3::ONE,
            metallic: 1.0,
            alpha_along: 0.09,
            alpha_across: 0.36,
            direction: vec2(0.6, 0.8),
            height: 0.0,
            slope: Vec2::ZERO,
        };
        let maps = paint(2, |_| texel).unwrap();
        let [u, v] = [&maps.gloss_u, &maps.gloss_v].map(|m| (1.0 - m.texel(0, 0)[0]).powi(2));
        let roughness = maps.metallic_roughness.texel(0, 0)[1];
        let [x, y, strength, _] = maps.anisotropy.texel(0, 0);
        let (t, b) = kinran_shading::alphas_from_khr_anisotropy(roughness, strength);
        assert!((u - 0.09).abs() < 0.003 && (b - 0.09).abs() < 0.003, "along: {u} and {b}");
        assert!((v - 0.36).abs() < 0.005 && (t - 0.36).abs() < 0.005, "across: {v} and {t}");
        let along = vec2(2.0 * x - 1.0, 2.0 * y - 1.0).dot(texel.direction);
        assert!(along.abs() < 0.01, "glTF's direction is that of the larger roughness; cosine {along}");
    }
}
