//! Base colour and metalness of a level, chosen together.
//!
//! A texel of glTF says two colours by one colour b and one number m: what scatters, `b (1 - m)`, and what reflects at
//! normal incidence, `φ (1 - m) + b m`, φ being F0 of what is not metal (0.04). Averages of b and of m are neither of them: half
//! gold, half black cloth would become half-metallic brown, which scatters where nothing does and reflects half of what gold
//! there reflects. What a footprint shows is the mean of what scatters and the mean of what reflects, in linear light, and
//! the texel is chosen that is nearest to both: by base colour and metalness (`pair.rs`), or by those and φ (`separate.rs`).

mod pair;
mod separate;

use kinran_image::srgb::{byte_from_linear, linear_from_byte};
use kinran_image::{Cancelled, Image, Tick, Transfer, full_level_count, level_size};
use kinran_shading::DIELECTRIC_F0;

use crate::aniso::maps::read_scalar;
use crate::aniso::reflectance::read_color;
use crate::aniso::{ColorMap, Kernel, Reflectance, ReflectanceMaps, ScalarMap, Taps};
use crate::channels::{Place, read_channel};
use crate::mips::{PlaneBand, PlaneRows, Rgba8Level, TILE, finest_level, reduce_levels, unorm8};

use self::pair::{Limits, Means, pair};
use self::separate::{Separate, separate};

/// Levels of base colour and of metalness, finest first, without their factors.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BaseAndMetal {
    /// sRGB, of the size of the base colour's image; alpha is averaged as it is.
    pub color: Vec<Rgba8Level>,
    /// A byte for each texel, of the size of the surface.
    pub metallic: Vec<Vec<u8>>,
    /// F0 of what is not metal relative to [`specular_white`], sRGB and opaque, of the smaller of both sizes; none unless that
    /// was asked for.
    pub specular: Vec<Rgba8Level>,
}

/// F0 that a white texel of [`BaseAndMetal::specular`] stands for, 1.011: glTF's 0.04 is a code (56) and mirrors are another.
pub fn specular_white() -> f32 {
    DIELECTRIC_F0 / linear_from_byte(byte_from_linear(DIELECTRIC_F0))
}

/// Why base colour and metalness are averaged one by one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Apart {
    /// One of them has no map, or metalness is the same everywhere: their averages are right.
    #[error("metalness or base colour is the same everywhere")]
    Alike,
    /// Diffuse and specular colour are maps of their own, whose averages are right.
    #[error("diffuse and specular colour are maps of their own")]
    Specular,
    /// F0 of what is not metal is a map, which one metalness cannot be chosen for.
    #[error("the reflectance of what is not metal is a map")]
    Dielectric,
    /// Levels of one are no levels of the other.
    #[error("the base colour is of another size ({0}x{1}) than the surface ({2}x{3}), not by a power of two")]
    Sizes(u32, u32, u32, u32),
    /// The work was stopped.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Base colour and metalness of every level, for a surface of size `surface`; where `separate` says so, with F0 of what is not
/// metal, which glTF takes from `KHR_materials_specular`. Level 0 is as authored. Where the sizes of base colour and surface are
/// apart by a power of two, each level stands for the same texels of the larger one; `tick` is told of the texels of all its
/// levels.
///
/// # Errors
/// [`Apart`] where they are not chosen together; nothing was told then, or `tick` stopped the work.
pub fn base_and_metal(
    reflectance: &Reflectance,
    surface: (u32, u32),
    kernel: Kernel,
    separate: bool,
    tick: &Tick<'_>,
) -> Result<BaseAndMetal, Apart> {
    let Plan { base, image, metallic, dielectric, of_color, of_surface } = plan(reflectance, surface)?;
    let own = (image.width, image.height);
    let size = (own.0.max(surface.0), own.1.max(surface.1));
    let wrap = reflectance.wrap;
    let source = Rows { base, metallic, size, reflectance };
    let limits = Limits { base: base.factor.to_array(), metallic: metallic.factor };
    let bands = reduce_levels(&source, size, kernel, wrap, |band, (): &mut ()| {
        let (color, metal) = (band.level > of_color, band.level > of_surface);
        let chosen = choose_band(
            &band,
            dielectric,
            limits,
            Wanted { color, metal, specular: separate && color && metal },
        );
        tick(band.width as u64 * band.rows as u64)?;
        Ok::<_, Cancelled>(chosen)
    })?;

    let mut color = vec![finest_level(image, own, Transfer::Srgb, wrap, &|_| tick(0))?];
    let mut metal = vec![finest_metal(metallic, surface, reflectance)];
    let mut specular = Vec::new();
    if separate {
        let (width, height) = (own.0.min(surface.0), own.1.min(surface.1));
        let texel = specular_texel(dielectric, specular_white());
        specular.push(Rgba8Level { width, height, rgba8: texel.repeat(width as usize * height as usize) });
    }
    tick(u64::from(size.0) * u64::from(size.1))?;
    for (level, bands) in (1..full_level_count(size.0, size.1)).zip(bands) {
        let (width, height) = (level_size(size.0, level), level_size(size.1, level));
        let joined = |of: fn(&Chosen) -> &[u8]| bands.iter().map(of).collect::<Vec<_>>().concat();
        if level > of_color {
            color.push(Rgba8Level { width, height, rgba8: joined(|chosen| &chosen.color) });
        }
        if level > of_surface {
            metal.push(joined(|chosen| &chosen.metal));
        }
        if separate && level > of_color.max(of_surface) {
            specular.push(Rgba8Level { width, height, rgba8: joined(|chosen| &chosen.specular) });
        }
    }
    Ok(BaseAndMetal { color, metallic: metal, specular })
}

/// Size of [`BaseAndMetal::specular`]; `None` where [`base_and_metal`] would not choose them together.
pub fn specular_size(reflectance: &Reflectance, surface: (u32, u32)) -> Option<(u32, u32)> {
    let image = plan(reflectance, surface).ok()?.image;
    Some((image.width.min(surface.0), image.height.min(surface.1)))
}

/// Why [`base_and_metal`] would not choose them together, if it would not.
pub fn apart(reflectance: &Reflectance, surface: (u32, u32)) -> Option<Apart> {
    plan(reflectance, surface).err()
}

/// What is chosen for.
struct Plan<'a> {
    base: &'a ColorMap,
    image: &'a Image,
    metallic: &'a ScalarMap,
    /// F0 of what is not metal.
    dielectric: [f32; 3],
    /// How often the base colour's image and the surface are halves of the larger one.
    of_color: usize,
    of_surface: usize,
}

fn plan(reflectance: &Reflectance, surface: (u32, u32)) -> Result<Plan<'_>, Apart> {
    let ReflectanceMaps::Metallic { base, metallic, dielectric } = &reflectance.maps else {
        return Err(Apart::Specular);
    };
    let dielectric = dielectric.constant().ok_or(Apart::Dielectric)?.to_array();
    let Some(image) = base.image.as_deref().filter(|_| varies(metallic)) else { return Err(Apart::Alike) };
    let own = (image.width, image.height);
    let size = (own.0.max(surface.0), own.1.max(surface.1));
    match (halvings(size, own), halvings(size, surface)) {
        (Some(of_color), Some(of_surface)) => {
            Ok(Plan { base, image, metallic, dielectric, of_color, of_surface })
        }
        _ => Err(Apart::Sizes(own.0, own.1, surface.0, surface.1)),
    }
}

/// Whether a map has two values.
fn varies(map: &ScalarMap) -> bool {
    let Some((image, channel)) = map.image.as_ref().filter(|_| map.factor > 0.0) else { return false };
    let mut row = vec![0.0; image.width as usize];
    let size = (image.width, image.height);
    let mut first = None;
    (0..image.height).any(|y| {
        let at = Place { size, y, x0: 0, wrap: [kinran_scene::Wrap::Clamp; 2] };
        read_channel(image, *channel, at, &mut row);
        let first = *first.get_or_insert(row[0]);
        row.iter().any(|v| *v != first)
    })
}

/// How often `of` is half of `size`.
fn halvings(size: (u32, u32), of: (u32, u32)) -> Option<usize> {
    (0..16).find(|&by| of.0 << by == size.0 && of.1 << by == size.1)
}

fn finest_metal(map: &ScalarMap, size: (u32, u32), reflectance: &Reflectance) -> Vec<u8> {
    let Some((image, channel)) = &map.image else { return Vec::new() };
    let mut row = vec![0.0; size.0 as usize];
    let mut bytes = Vec::with_capacity(row.len() * size.1 as usize);
    for y in 0..size.1 {
        read_channel(image, *channel, Place { size, y, x0: 0, wrap: reflectance.wrap }, &mut row);
        bytes.extend(row.iter().map(|v| unorm8(*v)));
    }
    bytes
}

/// Level 0: what scatters, what of it is metal's, metalness and alpha.
struct Rows<'a> {
    base: &'a ColorMap,
    metallic: &'a ScalarMap,
    size: (u32, u32),
    reflectance: &'a Reflectance,
}

/// Base colour that scatters and base colour of metal, three planes each, metalness, alpha.
const PLANES: usize = 8;

impl PlaneRows for Rows<'_> {
    const PLANES: usize = PLANES;
    type Scratch = ([Vec<f32>; 3], Vec<f32>, Vec<f32>);

    #[inline(always)]
    fn sum_rows(
        &self,
        rows: &Taps,
        x0: usize,
        len: usize,
        (color, metallic, alpha): &mut Self::Scratch,
        sums: &mut [[f32; TILE]],
    ) {
        color.iter_mut().chain([&mut *metallic, &mut *alpha]).for_each(|row| row.resize(len, 0.0));
        sums.fill([0.0; TILE]);
        for &(y, weight) in rows {
            let at = Place { size: self.size, y, x0: x0 as u32, wrap: self.reflectance.wrap };
            read_color(self.base, at, color);
            read_scalar(self.metallic, at, metallic);
            if let Some(image) = &self.base.image {
                read_channel(image, 3, at, alpha);
            }
            let metallic = &metallic[..len];
            let (colors, others) = sums.split_at_mut(6);
            let (scattered, of_metal) = colors.split_at_mut(3);
            for ((scattered, of_metal), color) in scattered.iter_mut().zip(of_metal).zip(&*color) {
                let (scattered, of_metal, color) =
                    (&mut scattered[..len], &mut of_metal[..len], &color[..len]);
                for i in 0..len {
                    let metal = color[i] * metallic[i];
                    scattered[i] += (color[i] - metal) * weight;
                    of_metal[i] += metal * weight;
                }
            }
            for (sums, plane) in others.iter_mut().zip([metallic, &alpha[..len]]) {
                sums.iter_mut().zip(plane).for_each(|(sum, v)| *sum += v * weight);
            }
        }
    }
}

/// What of a level's texels is wanted.
#[derive(Clone, Copy)]
struct Wanted {
    color: bool,
    metal: bool,
    specular: bool,
}

/// What was chosen for a band's texels; empty where it was not wanted.
struct Chosen {
    /// RGBA.
    color: Vec<u8>,
    metal: Vec<u8>,
    /// RGBA.
    specular: Vec<u8>,
}

/// What is wanted of a band's texels.
fn choose_band(band: &PlaneBand, dielectric: [f32; 3], limits: Limits, wanted: Wanted) -> Chosen {
    let texels = |wanted: bool| if wanted { band.width * band.rows } else { 0 };
    let mut chosen = Chosen {
        color: Vec::with_capacity(4 * texels(wanted.color)),
        metal: Vec::with_capacity(texels(wanted.metal)),
        specular: Vec::with_capacity(4 * texels(wanted.specular)),
    };
    let white = specular_white();
    let scale = |v: f32, most: f32| if most > 0.0 { v / most } else { 0.0 };
    for row in band.samples.chunks_exact(PLANES * band.width) {
        for x in 0..band.width {
            let plane = |plane: usize| row[plane * band.width + x];
            let means = Means {
                scattered: [plane(0), plane(1), plane(2)],
                of_metal: [plane(3), plane(4), plane(5)],
                metallic: plane(6),
            };
            let (base, metallic) = if wanted.specular {
                let Separate { base, specular, metallic } = separate(&means, dielectric, limits);
                chosen.specular.extend(specular_texel(specular, white));
                (base, metallic)
            } else {
                pair(&means, dielectric, limits)
            };
            if wanted.color {
                for (v, most) in base.into_iter().zip(limits.base) {
                    chosen.color.push(byte_from_linear(scale(v, most)));
                }
                chosen.color.push(unorm8(plane(7)));
            }
            if wanted.metal {
                chosen.metal.push(unorm8(scale(metallic, limits.metallic)));
            }
        }
    }
    chosen
}

/// The texel of sRGB that says this F0.
fn specular_texel(f0: [f32; 3], white: f32) -> [u8; 4] {
    let [r, g, b] = f0.map(|f0| byte_from_linear(f0 / white));
    [r, g, b, 255]
}
