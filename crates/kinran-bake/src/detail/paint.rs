//! Targets painted over tiled materials, as an artist would: wear, grime, edges, large-scale colour.
//!
//! What a library of scanned tiles can be tried with where there are no hand-painted targets. All amounts and colours
//! here are chosen by eye.

use glam::{Vec3, vec3};
use kinran_image::srgb::byte_from_linear;
use kinran_image::{Channels, Error, Image, Pixels};
use kinran_shading::detail::rnm;

use super::layer::{DetailRows, Layer, RowRoom, Seen, Tile, check_layers};
use super::map::{MapKind, Planes, for_each_row};
use crate::mips::unorm8;

/// What the paint goes by: data maps of the tiled material itself. Where one is missing there is less to go by.
#[derive(Clone, Copy, Debug, Default)]
pub struct PaintGuides<'a> {
    /// Heights: cavities and edges.
    pub height: Option<&'a Tile>,
    /// Occlusion: where grime settles.
    pub occlusion: Option<&'a Tile>,
}

/// How much of each paint there is, 0 to 1, over the whole target.
#[derive(Clone, Debug)]
pub struct Paint {
    /// Dirt in cavities and where little light comes.
    pub grime: Vec<f32>,
    /// Bare, polished edges.
    pub edge: Vec<f32>,
    /// Slow drift of colour, −1 to 1.
    pub drift: Vec<f32>,
    size: (u32, u32),
    seed: u32,
}

/// Colour of the grime, linear.
const DIRT: Vec3 = vec3(0.055, 0.042, 0.03);

/// Tile levels that a cavity is looked for in: lower than the mean of 2^3 texels around.
const CAVITY_LEVELS: f32 = 8.0;

impl Paint {
    /// Paint for a target of `size` texels over the tiles of `guides` as `layer` lays them; another `seed` is another
    /// hand.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where a guide is not a data map.
    pub fn new(guides: PaintGuides, layer: &Layer, size: (u32, u32), seed: u32) -> Result<Self, Error> {
        let len = size.0 as usize * size.1 as usize;
        let relief = match guides.height {
            Some(height) => relief(height, layer, size)?,
            None => vec![0.0; len],
        };
        let occlusion = match guides.occlusion {
            Some(map) => channel(map, layer, size)?,
            None => vec![1.0; len],
        };
        let mut planes = Planes::zeros(size.0, size.1);
        for_each_row(&mut planes, |y, [grime, edge, drift, _]| {
            let v = (y as f32 + 0.5) / size.1 as f32;
            for x in 0..size.0 as usize {
                let u = (x as f32 + 0.5) / size.0 as f32;
                let i = y * size.0 as usize + x;
                let patches = smoothstep(0.42, 0.62, fractal(seed, u * 3.0, v * 3.0));
                let cavity = (-relief[i]).max(0.0) + 0.7 * (1.0 - occlusion[i]);
                // Dirt runs down from the upper border.
                let run = smoothstep(0.75, 0.1, v + 0.3 * fractal(seed + 1, u * 9.0, v * 1.5));
                grime[x] = (patches * (0.25 + 1.5 * cavity) + 0.35 * run).clamp(0.0, 0.9);
                let rubbed = smoothstep(0.5, 0.6, fractal(seed + 2, u * 2.0, v * 2.0));
                edge[x] = (rubbed * relief[i].max(0.0) * 1.6).clamp(0.0, 0.8);
                drift[x] = 2.0 * fractal(seed + 3, u * 1.7, v * 1.7) - 1.0;
            }
        });
        Ok(Paint {
            grime: planes.plane(0).to_vec(),
            edge: planes.plane(1).to_vec(),
            drift: planes.plane(2).to_vec(),
            size,
            seed,
        })
    }

    /// A target: the layers as authored, painted over. Bytes, as an authoring tool would export them; one channel where
    /// `grey` says that all are one.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where the layers are not of `kind` or do not fit together.
    pub fn target(&self, layers: &[Layer], kind: MapKind, grey: bool) -> Result<Image, Error> {
        check_layers(layers, kind)?;
        let detail = DetailRows::new(layers, kind, self.size, Seen::Authored);
        let width = self.size.0 as usize;
        let mut painted = Planes::zeros(self.size.0, self.size.1);
        for_each_row(&mut painted, |y, [a, b, c, _]| {
            let (mut room, mut row) = (RowRoom::default(), <[Vec<f32>; 3]>::default());
            detail.row(y, &mut room, &mut row);
            for x in 0..width {
                let texel = vec3(row[0][x], row[1][x], row[2][x]);
                let v = (y as f32 + 0.5) / self.size.1 as f32;
                let u = (x as f32 + 0.5) / self.size.0 as f32;
                (a[x], b[x], c[x]) = self.texel(kind, texel, y * width + x, (u, v)).into();
            }
        });
        let mut bytes = Vec::with_capacity(width * self.size.1 as usize * 3);
        for y in 0..self.size.1 as usize {
            for x in 0..width {
                bytes.extend((0..if grey { 1 } else { 3 }).map(|c| {
                    let v = painted.row(c, y)[x];
                    match kind {
                        MapKind::Color => byte_from_linear(v),
                        MapKind::Normal => unorm8(v * 0.5 + 0.5),
                        MapKind::Data | MapKind::Aniso => unorm8(v.clamp(0.0, 1.0)),
                    }
                }));
            }
        }
        let channels = if grey { Channels::R } else { Channels::Rgb };
        Image::new(self.size.0, self.size.1, channels, Pixels::U8(bytes))
    }

    fn texel(&self, kind: MapKind, texel: Vec3, i: usize, uv: (f32, f32)) -> Vec3 {
        let (grime, edge, drift) = (self.grime[i], self.edge[i], self.drift[i]);
        match kind {
            MapKind::Color => {
                let tint = vec3(1.0 + 0.25 * drift, 1.0 + 0.15 * drift, 1.0 - 0.1 * drift);
                let dirty = (texel * tint).lerp(DIRT, grime);
                (dirty + (Vec3::ONE - dirty) * 0.3 * edge).clamp(Vec3::ZERO, Vec3::ONE)
            }
            // Dirt is rough and dull, edges are polished.
            MapKind::Data => ((texel + 0.08 * drift).lerp(Vec3::splat(0.85), 0.8 * grime)
                * (1.0 - 0.45 * edge))
                .clamp(Vec3::ZERO, Vec3::ONE),
            // Dents as wide as a hand, and dirt fills the relief.
            MapKind::Normal => {
                let at = |du: f32, dv: f32| fractal(self.seed + 4, (uv.0 + du) * 5.0, (uv.1 + dv) * 5.0);
                let h = 1.0 / 256.0;
                let slope = |a: f32, b: f32| 0.06 * (a - b) / (2.0 * h);
                let dent =
                    vec3(-slope(at(h, 0.0), at(-h, 0.0)), slope(at(0.0, h), at(0.0, -h)), 1.0).normalize();
                rnm(dent, texel.lerp(Vec3::Z, 0.7 * grime).normalize())
            }
            // Rubbed edges lose their brushing, dirt its gloss.
            MapKind::Aniso => {
                let round = (texel.x + texel.z) * 0.5;
                texel.lerp(vec3(round, 0.5, round), 0.6 * edge).lerp(vec3(0.8, 0.5, 0.8), 0.5 * grime)
            }
        }
    }
}

/// One channel of a guide at each texel of a target.
fn channel(map: &Tile, layer: &Layer, size: (u32, u32)) -> Result<Vec<f32>, Error> {
    let layer = Layer { tile: map, hsv: vec3(0.0, 1.0, 1.0), mask: None, ..*layer };
    let layers = [layer];
    check_layers(&layers, MapKind::Data)?;
    let rows = DetailRows::new(&layers, MapKind::Data, size, Seen::Authored);
    let (mut room, mut row) = (RowRoom::default(), <[Vec<f32>; 3]>::default());
    let mut all = Vec::with_capacity(size.0 as usize * size.1 as usize);
    for y in 0..size.1 as usize {
        rows.row(y, &mut room, &mut row);
        all.extend_from_slice(&row[0]);
    }
    Ok(all)
}

/// How far each texel stands out of its surroundings, about −1 to 1: its height over the mean of the surroundings, in
/// units of three standard deviations.
fn relief(height: &Tile, layer: &Layer, size: (u32, u32)) -> Result<Vec<f32>, Error> {
    let fine = channel(height, layer, size)?;
    let coarse_size =
        (((size.0 as f32 / CAVITY_LEVELS) as u32).max(1), ((size.1 as f32 / CAVITY_LEVELS) as u32).max(1));
    let coarse = channel(height, layer, coarse_size)?;
    let mut relief: Vec<f32> = (0..fine.len())
        .map(|i| {
            let (x, y) = (i % size.0 as usize, i / size.0 as usize);
            fine[i]
                - bilinear(
                    &coarse,
                    coarse_size,
                    (x as f32 + 0.5) / size.0 as f32,
                    (y as f32 + 0.5) / size.1 as f32,
                )
        })
        .collect();
    let variance = relief.iter().map(|v| f64::from(v * v)).sum::<f64>() / relief.len() as f64;
    let scale = 1.0 / (3.0 * variance.sqrt() as f32).max(1e-6);
    relief.iter_mut().for_each(|v| *v = (*v * scale).clamp(-1.0, 1.0));
    Ok(relief)
}

fn bilinear(values: &[f32], size: (u32, u32), u: f32, v: f32) -> f32 {
    let at = |x: i64, y: i64| {
        let (x, y) = (x.rem_euclid(i64::from(size.0)), y.rem_euclid(i64::from(size.1)));
        values[(y * i64::from(size.0) + x) as usize]
    };
    let (x, y) = (u * size.0 as f32 - 0.5, v * size.1 as f32 - 0.5);
    let (x0, y0) = (x.floor() as i64, y.floor() as i64);
    let (fx, fy) = (x - x.floor(), y - y.floor());
    let mix = |a: f32, b: f32, by: f32| a + (b - a) * by;
    mix(mix(at(x0, y0), at(x0 + 1, y0), fx), mix(at(x0, y0 + 1), at(x0 + 1, y0 + 1), fx), fy)
}

fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Five octaves of value noise, about 0 to 1 around 1/2.
fn fractal(seed: u32, x: f32, y: f32) -> f32 {
    let (mut sum, mut amplitude, mut frequency) = (0.0, 0.5, 1.0);
    for octave in 0..5 {
        sum +=
            amplitude * value_noise(seed.wrapping_mul(31).wrapping_add(octave), x * frequency, y * frequency);
        amplitude *= 0.5;
        frequency *= 2.0;
    }
    sum / 0.96875
}

fn value_noise(seed: u32, x: f32, y: f32) -> f32 {
    let (x0, y0) = (x.floor(), y.floor());
    let corner = |dx: f32, dy: f32| hash(seed, (x0 + dx) as i32, (y0 + dy) as i32);
    let fade = |t: f32| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (fx, fy) = (fade(x - x0), fade(y - y0));
    let upper = corner(0.0, 0.0) + (corner(1.0, 0.0) - corner(0.0, 0.0)) * fx;
    let lower = corner(0.0, 1.0) + (corner(1.0, 1.0) - corner(0.0, 1.0)) * fx;
    upper + (lower - upper) * fy
}

/// A number from 0 to 1 for each point of a grid (the finaliser of MurmurHash3).
fn hash(seed: u32, x: i32, y: i32) -> f32 {
    let mut h = seed ^ (x as u32).wrapping_mul(0x9e37_79b1) ^ (y as u32).wrapping_mul(0x85eb_ca77);
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^= h >> 16;
    (h >> 8) as f32 / 16_777_216.0
}

#[cfg(test)]
mod tests {
    use kinran_shading::normal_from_xy;

    use super::*;

    #[test]
    fn normals_of_flat_tiles_stay_unit_length() {
        let paint = Paint { grime: vec![0.3], edge: vec![0.0], drift: vec![0.0], size: (1, 1), seed: 3 };
        let n = paint.texel(MapKind::Normal, normal_from_xy(0.1, -0.2), 0, (0.3, 0.6));
        assert!((n.length() - 1.0).abs() < 1e-5, "{n}");
    }
}
