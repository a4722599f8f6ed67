//! Tables of pre-integrated skin: punctual light, ambient light, shadows' penumbras.
//!
//! ```
//! use kinran_bake::skin_lut::{Profile, TableFormat, punctual_table};
//!
//! let burley = Profile::Burley([1.2, 0.5, 0.3]);
//! let table = punctual_table(burley.radial()?, 32, 8, 0.5, &kinran_image::untold)?;
//! let texture = table.texture(TableFormat::Rgba16F)?;
//! assert!(table.texture_error(&texture)? < 1e-3);
//! // At the terminator, bent as a nose is: red light has come around.
//! let [red, _, blue] = table.sample(0.5, 0.5);
//! assert!(red > blue);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use kinran_image::{Cancelled, Error, Format, Level, Texture, Tick, Transfer, encode_half};
use kinran_shading::skin::profile::{Gaussian, LinearProfile, ProfileError, RadialProfile};
use kinran_shading::skin::sampled::Sample;
use rayon::prelude::*;

use crate::pieces::Pieces;
use crate::srgb_from_linear;

/// A diffusion profile that owns its numbers.
#[derive(Clone, Debug, PartialEq)]
pub enum Profile {
    /// A sum of Gaussians.
    Gaussians(Vec<Gaussian>),
    /// Burley's, by the length d of each channel in millimetres.
    Burley([f64; 3]),
    /// Burley's, by mean free path in millimetres and albedo of each channel.
    MeanFreePath {
        /// Millimetres.
        path: [f64; 3],
        /// 0 to 1.
        albedo: [f64; 3],
    },
    /// Distances in millimetres and densities.
    Table(Vec<(f64, [f64; 3])>),
}

impl Default for Profile {
    /// The six Gaussians of human skin.
    fn default() -> Self {
        Profile::Gaussians(kinran_shading::skin::profile::SKIN.to_vec())
    }
}

impl Profile {
    /// The profile's radial form.
    ///
    /// # Errors
    /// [`ProfileError`] where the numbers are no profile.
    pub fn radial(&self) -> Result<RadialProfile<'_>, ProfileError> {
        match self {
            Profile::Gaussians(sum) => RadialProfile::gaussians(sum),
            Profile::Burley(d) => RadialProfile::burley(*d),
            Profile::MeanFreePath { path, albedo } => RadialProfile::from_mean_free_path(*path, *albedo),
            Profile::Table(rows) => RadialProfile::table(rows),
        }
    }
}

/// A profile along a line whose densities are quick to ask for.
fn sampled<'a>(profile: RadialProfile<'a>, samples: &'a mut Vec<Sample>) -> LinearProfile<'a> {
    let linear = profile.to_linear();
    samples.resize(linear.rows() + 4096, Sample::default());
    linear.sampled(samples)
}

/// A table of RGB, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Entries in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` entries.
    pub entries: Vec<[f32; 3]>,
}

/// What part of a punctual light's irradiance at normal incidence leaves skin: columns are n·u from -1 to 1, rows
/// are curvature from 0 to `range` (1/mm), both at the middles of texels. Clamped, linear sampling reads it right. `tick` is told
/// of texels of the table.
///
/// # Errors
/// Where `tick` stops the work.
pub fn punctual_table(
    profile: RadialProfile<'_>,
    width: usize,
    height: usize,
    range: f64,
    tick: &Tick<'_>,
) -> Result<Table, Cancelled> {
    if let Some(lengths) = profile.burley_lengths() {
        return burley_table(lengths, width, height, range, tick);
    }
    let mut samples = Vec::new();
    let linear = sampled(profile, &mut samples);
    let mut entries = vec![[0.0f32; 3]; width * height];
    entries.par_chunks_mut(width).enumerate().try_for_each(|(row, entries)| {
        let mut exact = vec![[0.0; 3]; width];
        linear.ring_row((row as f64 + 0.5) / height as f64 * range, &mut exact);
        for (entry, exact) in entries.iter_mut().zip(exact) {
            *entry = exact.map(|x| x as f32);
        }
        tick(width as u64)
    })?;
    Ok(Table { width, height, entries })
}

/// Steps of ln(d curvature) between the rows that [`burley_table`] computes. Interpolation through six of them is within
/// 0.005 STEP⁶ of the sixth derivative, which is below ten: 3e-6.
const STEP: f64 = 0.2;

/// [`punctual_table`] for Burley's profile. A row depends on the product of d and curvature alone, smoothly on its logarithm:
/// rows for products in equal steps, three at a time as if they were channels, and every channel of every row of the table
/// between six of them.
fn burley_table(
    lengths: [f64; 3],
    width: usize,
    height: usize,
    range: f64,
    tick: &Tick<'_>,
) -> Result<Table, Cancelled> {
    let curvature = |row: usize| (row as f64 + 0.5) / height as f64 * range;
    let shortest = lengths.iter().copied().fold(f64::INFINITY, f64::min);
    let longest = lengths.iter().copied().fold(0.0, f64::max);
    let first = libm::log(shortest * curvature(0)) - 2.5 * STEP;
    let last = libm::log(longest * curvature(height - 1)) + 2.5 * STEP;
    let triples = ((last - first) / STEP + 1.0).ceil() as usize / 3 + 1;
    let pieces = Pieces::new(tick, (width * height) as u64, triples);
    let exact = (0..triples)
        .into_par_iter()
        .map(|triple| {
            let d = std::array::from_fn(|i| libm::exp(first + STEP * (3 * triple + i) as f64));
            let mut row = vec![[0.0; 3]; width];
            // Lengths in units of the radius.
            if let Ok(profile) = RadialProfile::burley(d) {
                profile.to_linear().ring_row(1.0, &mut row);
            }
            pieces.done()?;
            Ok(row)
        })
        .collect::<Result<Vec<_>, Cancelled>>()?;

    let mut entries = vec![[0.0f32; 3]; width * height];
    entries.par_chunks_mut(width).enumerate().for_each(|(row, entries)| {
        for (c, d) in lengths.into_iter().enumerate() {
            let at = (libm::log(d * curvature(row)) - first) / STEP;
            let from = (at as usize).saturating_sub(2).min(3 * triples - 6);
            let weights: [f64; 6] = std::array::from_fn(|i| lagrange(at - from as f64, i));
            for (column, entry) in entries.iter_mut().enumerate() {
                let of = |i: usize| exact[(from + i) / 3][column][(from + i) % 3];
                let sum: f64 = weights.iter().enumerate().map(|(i, w)| w * of(i)).sum();
                entry[c] = sum.max(0.0) as f32;
            }
        }
    });
    Ok(Table { width, height, entries })
}

/// Lagrange's polynomial of the places 0 to 5 that is one at `place`.
fn lagrange(x: f64, place: usize) -> f64 {
    (0..6)
        .filter(|&other| other != place)
        .map(|other| (x - other as f64) / (place as f64 - other as f64))
        .product()
}

/// What skin leaves of ambient light's harmonics: columns are mean curvature from 0 to `range` (1/mm) at the middles of
/// texels, row 0 is band 1 and row 1 is band 2. Band 0 is left whole.
pub fn ambient_table(profile: RadialProfile<'_>, width: usize, range: f64) -> Table {
    let factors: Vec<_> =
        (0..width).map(|i| profile.band_factors((i as f64 + 0.5) / width as f64 * range)).collect();
    let (one, two) = (factors.iter().map(|f| f.h_one), factors.iter().map(|f| f.h_two));
    Table { width, height: 2, entries: one.chain(two).map(|h| h.map(|x| x as f32)).collect() }
}

/// What part of a light skin in a shadow's penumbra gets: columns are the filtered shadow from 0 to 1, rows are one over
/// the penumbra's width from 0 to `range` (1/mm), both at the middles of texels. Each row is stretched to begin at 0 and
/// to end at 1, which its outermost texels hold: what leaks out of a penumbra that is too narrow for it would else light all
/// of the shadow behind.
pub fn penumbra_table(profile: RadialProfile<'_>, width: usize, height: usize, range: f64) -> Table {
    let mut samples = Vec::new();
    let linear = sampled(profile, &mut samples);
    let mut entries = vec![[0.0f32; 3]; width * height];
    entries.par_chunks_mut(width).enumerate().for_each(|(row, entries)| {
        let penumbra = height as f64 / ((row as f64 + 0.5) * range);
        let [dark, lit] = [0.0, 1.0].map(|shadow| linear.penumbra(shadow, penumbra));
        for (column, entry) in entries.iter_mut().enumerate() {
            let shadow = match column {
                0 => 0.0,
                last if last + 1 == width => 1.0,
                inner => (inner as f64 + 0.5) / width as f64,
            };
            let got = linear.penumbra(shadow, penumbra);
            *entry = std::array::from_fn(|c| ((got[c] - dark[c]) / (lit[c] - dark[c])) as f32);
        }
    });
    Table { width, height, entries }
}

/// How a table's numbers, 0 to 1, become texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TableFormat {
    /// Half floats.
    #[default]
    Rgba16F,
    /// A byte a channel, sRGB: small values get most codes, and the sampler decodes for nothing.
    Srgb8,
    /// A byte a channel, as it is.
    Linear8,
}

impl Table {
    /// Linear interpolation at `u`, `v` from 0 to 1 across and down, clamped at the edges, as a sampler reads it.
    pub fn sample(&self, u: f32, v: f32) -> [f32; 3] {
        let place = |x: f32, n: usize| {
            let x = (x * n as f32 - 0.5).clamp(0.0, (n - 1) as f32);
            let i = (x as usize).min(n.saturating_sub(2));
            (i, (i + 1).min(n - 1), x - i as f32)
        };
        let ((x0, x1, tx), (y0, y1, ty)) = (place(u, self.width), place(v, self.height));
        let at = |x: usize, y: usize| self.entries[y * self.width + x];
        std::array::from_fn(|c| {
            let row = |y| at(x0, y)[c] + tx * (at(x1, y)[c] - at(x0, y)[c]);
            row(y0) + ty * (row(y1) - row(y0))
        })
    }

    /// The table as a texture of one level, alpha one.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where a number is none, or too large for a half float.
    pub fn texture(&self, format: TableFormat) -> Result<Texture, Error> {
        let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0).round() as u8;
        let texels = self.entries.iter();
        let (layout, transfer, data) = match format {
            TableFormat::Rgba16F => {
                let rgba: Vec<[f32; 4]> = texels.map(|&[r, g, b]| [r, g, b, 1.0]).collect();
                (Format::Rgba16F, Transfer::Linear, encode_half(&rgba)?)
            }
            TableFormat::Srgb8 => {
                let encode = |x: f32| byte(srgb_from_linear(x.clamp(0.0, 1.0)));
                let data = texels.flat_map(|&[r, g, b]| [encode(r), encode(g), encode(b), 255]).collect();
                (Format::Rgba8, Transfer::Srgb, data)
            }
            TableFormat::Linear8 => {
                let data = texels.flat_map(|&[r, g, b]| [byte(r), byte(g), byte(b), 255]).collect();
                (Format::Rgba8, Transfer::Linear, data)
            }
        };
        let level = Level { width: self.width as u32, height: self.height as u32, data };
        Ok(Texture { format: layout, transfer, levels: vec![level], metadata: Default::default() })
    }

    /// The largest difference between the table and a texture of it, as a sampler decodes it.
    ///
    /// # Errors
    /// Where the texture is not of this table's size.
    pub fn texture_error(&self, texture: &Texture) -> Result<f32, Error> {
        let decoded = texture.decode_level(0)?;
        if decoded.len() != self.entries.len() {
            return Err(Error::Unsupported("the texture has another size than the table".into()));
        }
        let decode = |x: f32| match texture.transfer {
            Transfer::Srgb => crate::linear_from_srgb(x),
            Transfer::Linear | Transfer::Unsaid => x,
        };
        let pairs = self.entries.iter().zip(&decoded);
        let differences = pairs.flat_map(|(e, d)| (0..3).map(move |c| (e[c] - decode(d[c])).abs()));
        Ok(differences.fold(0.0, f32::max))
    }
}

/// Points along each side of a texel at which [`punctual_interpolation_error`] looks.
pub const INTERPOLATION_GRID: usize = 4;

/// The largest error of reading a punctual table between its texels, on a grid [`INTERPOLATION_GRID`] times as fine. `tick`
/// is told of points of the grid.
///
/// # Errors
/// Where `tick` stops the work.
pub fn punctual_interpolation_error(
    profile: RadialProfile<'_>,
    table: &Table,
    range: f64,
    tick: &Tick<'_>,
) -> Result<f32, Cancelled> {
    let mut samples = Vec::new();
    let linear = sampled(profile, &mut samples);
    let (columns, rows) = (INTERPOLATION_GRID * table.width, INTERPOLATION_GRID * table.height);
    (0..rows)
        .into_par_iter()
        .map(|row| {
            let v = (row as f64 + 0.5) / rows as f64;
            let mut exact = vec![[0.0; 3]; columns];
            linear.ring_row(v * range, &mut exact);
            let mut worst = 0.0f32;
            for (column, exact) in exact.iter().enumerate() {
                let u = (column as f64 + 0.5) / columns as f64;
                let read = table.sample(u as f32, v as f32);
                (0..3).for_each(|c| worst = worst.max((exact[c] as f32 - read[c]).abs()));
            }
            tick(columns as u64)?;
            Ok(worst)
        })
        .try_reduce(|| 0.0, |a, b| Ok(a.max(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Between the rows that are integrated, from the flattest to the most curved.
    #[test]
    fn burley_s_table_meets_the_integral_at_every_row() {
        for (lengths, range) in [([0.9, 0.4, 0.2], 0.5), ([3.0, 0.05, 0.7], 2.0)] {
            let radial = RadialProfile::burley(lengths).unwrap();
            let (width, height) = (64, 40);
            let table = punctual_table(radial, width, height, range, &kinran_image::untold).unwrap();
            let mut worst = (0.0f64, 0);
            for row in 0..height {
                let mut exact = vec![[0.0; 3]; width];
                radial.to_linear().ring_row((row as f64 + 0.5) / height as f64 * range, &mut exact);
                for (exact, got) in exact.iter().zip(&table.entries[row * width..]) {
                    for c in 0..3 {
                        let error = (exact[c] - f64::from(got[c])).abs();
                        worst = if error > worst.0 { (error, row) } else { worst };
                    }
                }
            }
            assert!(worst.0 < 1e-5, "{lengths:?}: off by {} in row {}", worst.0, worst.1);
        }
    }
}
