//! Base colour and metalness of a level, chosen together.
//!
//! A texel of glTF says two colours by one colour b and one number m: what scatters, `b (1 - m)`, and what reflects at
//! normal incidence, `φ (1 - m) + b m`, φ being F0 of what is not metal (0.04). Averages of b and of m are neither of them: half
//! gold, half black cloth would become half-metallic brown, which scatters where nothing does and reflects half of what gold
//! there reflects. What a footprint shows is the mean d of what scatters and the mean f of what reflects, in linear light, and
//! the pair is chosen that is nearest to both,
//!
//! ```text
//! min  Σ (b (1-m) - d)² + (b m + φ (1-m) - f)²,   0 ≤ b, m ≤ what factors allow, sums over red, green and blue.
//! ```
//!
//! For a given m, with `s = 1 - m` and `g = f - φ s`, b is the projection of (d, g) on (s, m): `b = (s d + m g) / (s² + m²)`.
//! What is left is a function of m alone. It may have two minima (dark colours: φ is neither scattered nor b's), so it is looked
//! at all over and then more and more closely (`together`).

use kinran_image::srgb::byte_from_linear;
use kinran_image::{Cancelled, Image, Tick, Transfer, full_level_count};

use crate::aniso::maps::read_scalar;
use crate::aniso::reflectance::read_color;
use crate::aniso::{ColorMap, Kernel, Reflectance, ReflectanceMaps, ScalarMap, Taps};
use crate::channels::{Place, read_channel};
use crate::mips::{PlaneBand, PlaneRows, Rgba8Level, TILE, finest_level, reduce_levels, unorm8};

/// Levels of base colour and of metalness, finest first, without their factors.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BaseAndMetal {
    /// sRGB, of the size of the base colour's image; alpha is averaged as it is.
    pub color: Vec<Rgba8Level>,
    /// A byte for each texel, of the size of the surface.
    pub metallic: Vec<Vec<u8>>,
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

/// Base colour and metalness of every level, for a surface of size `surface`. Level 0 is as authored. Where the sizes of base
/// colour and surface are apart by a power of two, each level stands for the same texels of the larger one; `tick` is told of
/// the texels of all its levels.
///
/// # Errors
/// [`Apart`] where they are not chosen together; nothing was told then, or `tick` stopped the work.
pub fn base_and_metal(
    reflectance: &Reflectance,
    surface: (u32, u32),
    kernel: Kernel,
    tick: &Tick<'_>,
) -> Result<BaseAndMetal, Apart> {
    let Plan { base, image, metallic, dielectric, of_color, of_surface } = plan(reflectance, surface)?;
    let own = (image.width, image.height);
    let size = (own.0.max(surface.0), own.1.max(surface.1));
    let wrap = reflectance.wrap;
    let source = Rows { base, metallic, size, reflectance };
    let limits = Limits { base: base.factor.to_array(), metallic: metallic.factor };
    let bands = reduce_levels(&source, size, kernel, wrap, |band, (): &mut ()| {
        let wanted = (band.level > of_color, band.level > of_surface);
        let chosen = choose_band(&band, dielectric, limits, wanted);
        tick(band.width as u64 * band.rows as u64)?;
        Ok::<_, Cancelled>(chosen)
    })?;

    let mut color = vec![finest_level(image, own, Transfer::Srgb, wrap, &|_| tick(0))?];
    let mut metal = vec![finest_metal(metallic, surface, reflectance)];
    tick(u64::from(size.0) * u64::from(size.1))?;
    for (level, bands) in (1..full_level_count(size.0, size.1)).zip(bands) {
        let (rgba8, metallic): (Vec<_>, Vec<_>) = bands.into_iter().unzip();
        if level > of_color {
            let (width, height) = ((size.0 >> level).max(1), (size.1 >> level).max(1));
            color.push(Rgba8Level { width, height, rgba8: rgba8.concat() });
        }
        if level > of_surface {
            metal.push(metallic.concat());
        }
    }
    Ok(BaseAndMetal { color, metallic: metal })
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

/// The most that textures can say: their factors.
#[derive(Clone, Copy)]
struct Limits {
    base: [f32; 3],
    metallic: f32,
}

/// RGBA and metalness of a band's texels, where they are wanted.
fn choose_band(
    band: &PlaneBand,
    dielectric: [f32; 3],
    limits: Limits,
    (color_wanted, metal_wanted): (bool, bool),
) -> (Vec<u8>, Vec<u8>) {
    let texels = band.width * band.rows;
    let mut rgba8 = Vec::with_capacity(if color_wanted { 4 * texels } else { 0 });
    let mut metal = Vec::with_capacity(if metal_wanted { texels } else { 0 });
    let scale = |v: f32, most: f32| if most > 0.0 { v / most } else { 0.0 };
    for row in band.samples.chunks_exact(PLANES * band.width) {
        for x in 0..band.width {
            let plane = |plane: usize| row[plane * band.width + x];
            let means = Means {
                scattered: [plane(0), plane(1), plane(2)],
                of_metal: [plane(3), plane(4), plane(5)],
                metallic: plane(6),
            };
            let (base, metallic) = together(&means, dielectric, limits);
            if color_wanted {
                for (v, most) in base.into_iter().zip(limits.base) {
                    rgba8.push(byte_from_linear(scale(v, most)));
                }
                rgba8.push(unorm8(plane(7)));
            }
            if metal_wanted {
                metal.push(unorm8(scale(metallic, limits.metallic)));
            }
        }
    }
    (rgba8, metal)
}

/// Averages over a footprint.
struct Means {
    /// `b (1 - m)`.
    scattered: [f32; 3],
    /// `b m`.
    of_metal: [f32; 3],
    /// m.
    metallic: f32,
}

/// Sum of squared errors of both colours below which the averages of b and m stay: each within a twentieth of the step of an
/// 8-bit code at its darkest.
const EXACT: f32 = 1e-9;

/// Metalness is looked at in steps of an eighth first.
const STEPS: usize = 8;

/// Then in smaller ones, down to 1/1024, a quarter of a step of 8 bits.
const FINEST: f32 = 1.0 / 1024.0;

/// Base colour and metalness that together are nearest to what a footprint scatters and reflects. `dielectric` is F0 of what is
/// not metal.
fn together(means: &Means, dielectric: [f32; 3], limits: Limits) -> ([f32; 3], f32) {
    let d = means.scattered;
    let f: [f32; 3] = std::array::from_fn(|c| means.of_metal[c] + dielectric[c] * (1.0 - means.metallic));
    // The base colour for a metalness, and their error.
    let best = |m: f32| {
        let s = 1.0 - m;
        let inv = 1.0 / (s * s + m * m);
        let (mut base, mut error) = ([0.0; 3], 0.0);
        for c in 0..3 {
            let g = f[c] - dielectric[c] * s;
            let b = ((s * d[c] + m * g) * inv).clamp(0.0, limits.base[c]);
            let (e_d, e_g) = (b * s - d[c], b * m - g);
            error += e_d * e_d + e_g * e_g;
            base[c] = b;
        }
        (base, error)
    };

    let averages: [f32; 3] = std::array::from_fn(|c| d[c] + means.of_metal[c]);
    let cross = |c: usize| means.of_metal[c] - averages[c] * means.metallic;
    if 2.0 * (0..3).map(|c| cross(c) * cross(c)).sum::<f32>() < EXACT {
        return (averages, means.metallic);
    }
    let mut m = means.metallic.min(limits.metallic);
    let (mut base, mut error) = best(m);
    let mut look = |m: &mut f32, at: f32| {
        let (b, e) = best(at);
        if e < error {
            (*m, base, error) = (at, b, e);
        }
    };
    for i in 0..=STEPS {
        look(&mut m, limits.metallic * i as f32 / STEPS as f32);
    }
    let mut step = limits.metallic / (2 * STEPS) as f32;
    while step >= FINEST {
        let middle = m;
        look(&mut m, (middle - step).max(0.0));
        look(&mut m, (middle + step).min(limits.metallic));
        step *= 0.5;
    }
    (base, m)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform in [0, 1).
    fn uniform(state: &mut u32) -> f64 {
        *state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        f64::from(*state >> 8) / 16_777_216.0
    }

    /// Footprints of two to four materials, gold on cloth and dark ones among them, against every 1/2000 of metalness, in double
    /// precision.
    #[test]
    fn another_pair_is_nearer_to_what_a_footprint_shows() {
        let mut state = 5;
        let (mut plain, mut mended) = (0.0, 0.0);
        for i in 0..3000 {
            let f0 = [0.04, 0.04, if i % 7 == 0 { 0.02 } else { 0.04 }];
            let limits = match i % 5 {
                0 => Limits { base: [0.9, 1.0, 0.7], metallic: 0.8 },
                _ => Limits { base: [1.0; 3], metallic: 1.0 },
            };
            let (mut d, mut metal, mut m_mean) = ([0.0; 3], [0.0; 3], 0.0);
            let count = 2 + i % 3;
            for _ in 0..count {
                let dark = if uniform(&mut state) < 0.4 { 0.05 } else { 1.0 };
                let m = match uniform(&mut state) {
                    v if v < 0.4 => 0.0,
                    v if v < 0.8 => f64::from(limits.metallic),
                    _ => uniform(&mut state) * f64::from(limits.metallic),
                };
                m_mean += m / count as f64;
                for c in 0..3 {
                    let b = dark * uniform(&mut state) * f64::from(limits.base[c]);
                    d[c] += b * (1.0 - m) / count as f64;
                    metal[c] += b * m / count as f64;
                }
            }
            let f: [f64; 3] = std::array::from_fn(|c| metal[c] + f64::from(f0[c]) * (1.0 - m_mean));
            let error = |b: [f64; 3], m: f64| -> f64 {
                let term = |c: usize| {
                    let reflected = b[c] * m + f64::from(f0[c]) * (1.0 - m);
                    (b[c] * (1.0 - m) - d[c]).powi(2) + (reflected - f[c]).powi(2)
                };
                (0..3).map(term).sum()
            };
            // The best of a line of base colours, by thirds: no formula of the module.
            let mut wanted = f64::INFINITY;
            for step in 0..=2000 {
                let m = f64::from(limits.metallic) * f64::from(step) / 2000.0;
                let b = std::array::from_fn(|c| {
                    let (mut lo, mut hi) = (0.0, f64::from(limits.base[c]));
                    for _ in 0..40 {
                        let (p, q) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
                        let at = |v: f64| {
                            let reflected = v * m + f64::from(f0[c]) * (1.0 - m);
                            (v * (1.0 - m) - d[c]).powi(2) + (reflected - f[c]).powi(2)
                        };
                        if at(p) < at(q) { hi = q } else { lo = p }
                    }
                    0.5 * (lo + hi)
                });
                wanted = wanted.min(error(b, m));
            }
            let means = Means {
                scattered: d.map(|v| v as f32),
                of_metal: metal.map(|v| v as f32),
                metallic: m_mean as f32,
            };
            let (b, m) = together(&means, f0, limits);
            let got = error(b.map(f64::from), f64::from(m));
            assert!(got <= wanted + 2e-5, "footprint {i}: wanted {wanted:e}, got {got:e} by {b:?}, {m}");
            assert!(m <= limits.metallic && (0..3).all(|c| b[c] <= limits.base[c] + 1e-6), "{b:?}, {m}");
            let averages: [f64; 3] = std::array::from_fn(|c| d[c] + metal[c]);
            plain += error(averages, m_mean);
            mended += got;
        }
        assert!(mended < 0.5 * plain, "sum of squared errors: {mended}, of plain averages {plain}");
    }

    /// One texel's pair is that texel's.
    #[test]
    fn a_footprint_of_one_material_becomes_another() {
        let mut state = 11;
        for i in 0..2000 {
            let m = [0.0, 1.0, uniform(&mut state) as f32][i % 3];
            let b: [f32; 3] = std::array::from_fn(|_| uniform(&mut state) as f32);
            let means = Means { scattered: b.map(|b| b - b * m), of_metal: b.map(|b| b * m), metallic: m };
            let (got, got_m) = together(&means, [0.04; 3], Limits { base: [1.0; 3], metallic: 1.0 });
            let off = (0..3).map(|c| (got[c] - b[c]).abs()).fold((got_m - m).abs(), f32::max);
            assert!(off < 1e-6, "wanted {b:?}, {m}, got {got:?}, {got_m}");
        }
    }
}
