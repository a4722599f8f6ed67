//! Light from all around, as an equirectangular image.

use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::path::Path;

use glam::{DVec3, Vec2, Vec3};
use kinran_image::{Channels, Pixels};
use kinran_shading::sh::{Sh9, sh_basis};
use rayon::prelude::*;

use crate::Error;

/// Radiance from every direction, and a distribution to sample it by.
///
/// +y is up and is the image's top row. The image's centre is -z, where a glTF camera looks that has no
/// transform, and +x lies to the right of it: `u = 1/2 + atan2(x, -z) / 2 pi`, `v = acos(y) / pi`.
#[derive(Clone, Debug)]
pub struct Environment {
    width: usize,
    height: usize,
    /// Linear Rec. 709, row by row from the top.
    radiance: Vec<Vec3>,
    /// Probability of all rows above each row; `height + 1` numbers from 0 to 1.
    rows: Vec<f32>,
    /// For each row, probability of all texels left of each texel; `width + 1` numbers from 0 to 1.
    columns: Vec<f32>,
    /// What was chosen when the image was read, or what its file says that is not heeded, a sentence each that names the
    /// file.
    pub notes: Vec<String>,
}

impl Environment {
    /// Reads an equirectangular HDR or EXR image. Negative radiance counts as none.
    ///
    /// # Errors
    /// The image's own, and for images that are not twice as wide as high or that hold no floats.
    pub fn load(path: impl AsRef<Path>) -> Result<Environment, Error> {
        Environment::load_layer(path, None)
    }

    /// Reads an environment, of an EXR the layer that is called so.
    ///
    /// # Errors
    /// As [`Environment::load`]; and where `layer` is given, that the file has no such layer or is of a format without layers.
    pub fn load_layer(path: impl AsRef<Path>, layer: Option<&str>) -> Result<Environment, Error> {
        let path = path.as_ref();
        let image = kinran_image::read_layer(path, layer)?;
        let (width, height) = (image.width as usize, image.height as usize);
        if width != 2 * height {
            return Err(Error::malformed(
                path,
                format!("{width} by {height} is not equirectangular; the width must be twice the height"),
            ));
        }
        let Pixels::F32(samples) = &image.pixels else {
            return Err(Error::malformed(
                path,
                "an environment must be HDR or EXR: integers have no room for the brightness of lights",
            ));
        };
        let radiance = match image.channels {
            Channels::R => samples.iter().map(|&grey| Vec3::splat(grey)).collect(),
            Channels::Rg => samples.chunks_exact(2).map(|t| Vec3::splat(t[0])).collect(),
            Channels::Rgb => samples.chunks_exact(3).map(Vec3::from_slice).collect(),
            Channels::Rgba => samples.chunks_exact(4).map(Vec3::from_slice).collect(),
        };
        let notes = image.notes.iter().map(|note| format!("{}: {note}", path.display())).collect();
        Ok(Environment { notes, ..Environment::new(width, radiance) })
    }

    /// An environment of `radiance(direction)` at the centre of every texel, `2 height` by `height`.
    ///
    /// # Panics
    /// When `height` is zero.
    pub fn from_fn(height: usize, radiance: impl Fn(Vec3) -> Vec3 + Sync) -> Environment {
        assert!(height > 0, "an environment needs a row");
        let width = 2 * height;
        let texels = (0..width * height)
            .into_par_iter()
            .map(|i| {
                let uv = Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
                radiance(direction(uv / Vec2::new(width as f32, height as f32)))
            })
            .collect();
        Environment::new(width, texels)
    }

    fn new(width: usize, mut radiance: Vec<Vec3>) -> Environment {
        let height = radiance.len() / width;
        radiance.par_iter_mut().for_each(|texel| *texel = texel.max(Vec3::ZERO));

        // The mean of the bilinear lookup over a texel weighs its neighbours (1/8, 3/4, 1/8) in each
        // direction: what is dark itself but lit by interpolation keeps a probability.
        let luminance = |x: usize, y: usize| f64::from(luminance(radiance[y * width + x]));
        let mean_of_row = |x: usize, y: usize| {
            let (left, right) = ((x + width - 1) % width, (x + 1) % width);
            0.125 * luminance(left, y) + 0.75 * luminance(x, y) + 0.125 * luminance(right, y)
        };
        let mean = |x: usize, y: usize| {
            let (above, below) = (y.saturating_sub(1), (y + 1).min(height - 1));
            0.125 * mean_of_row(x, above) + 0.75 * mean_of_row(x, y) + 0.125 * mean_of_row(x, below)
        };
        let (cumulated, sums): (Vec<Vec<f32>>, Vec<f64>) =
            (0..height).into_par_iter().map(|y| cumulate((0..width).map(|x| mean(x, y)))).unzip();
        let solid_angles = (0..height).map(|y| row_solid_angle(y, height));
        let (rows, _) = cumulate(sums.iter().zip(solid_angles).map(|(sum, angle)| sum * angle));
        let rows = match sums.iter().all(|&sum| sum == 0.0) {
            true => cumulate((0..height).map(|y| row_solid_angle(y, height))).0,
            false => rows,
        };
        Environment { width, height, radiance, rows, columns: cumulated.concat(), notes: Vec::new() }
    }

    /// Texels in a row, twice [`Environment::height`].
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Radiance of texel (`x`, `y`), linear Rec. 709; row 0 is the top.
    pub fn texel(&self, x: usize, y: usize) -> Vec3 {
        self.radiance[y * self.width + x]
    }

    /// Radiance from a unit direction, interpolated bilinearly.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let uv = texture_coordinates(direction);
        let (x, y) = (uv.x * self.width as f32 - 0.5, uv.y * self.height as f32 - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (s, t) = (x - x0, y - y0);
        let column = |x: f32| (x as i64).rem_euclid(self.width as i64) as usize;
        let row = |y: f32| (y.max(0.0) as usize).min(self.height - 1);
        let (left, right) = (column(x0), column(x0 + 1.0));
        let (above, below) = (row(y0), row(y0 + 1.0));
        let top = self.texel(left, above).lerp(self.texel(right, above), s);
        let bottom = self.texel(left, below).lerp(self.texel(right, below), s);
        top.lerp(bottom, t)
    }

    /// Nine coefficients of the radiance, for [`kinran_shading::sh`].
    pub fn spherical_harmonics(&self) -> Sh9 {
        let rows: Vec<[DVec3; 9]> = (0..self.height)
            .into_par_iter()
            .map(|y| {
                let mut sums = [DVec3::ZERO; 9];
                for x in 0..self.width {
                    let uv = Vec2::new(
                        (x as f32 + 0.5) / self.width as f32,
                        (y as f32 + 0.5) / self.height as f32,
                    );
                    let radiance = self.texel(x, y).as_dvec3();
                    for (sum, basis) in sums.iter_mut().zip(sh_basis(direction(uv))) {
                        *sum += radiance * f64::from(basis);
                    }
                }
                sums.map(|sum| sum * row_solid_angle(y, self.height) / self.width as f64)
            })
            .collect();
        let mut sums = [DVec3::ZERO; 9];
        for row in rows {
            for (sum, of_row) in sums.iter_mut().zip(row) {
                *sum += of_row;
            }
        }
        sums.map(|sum| sum.as_vec3())
    }

    /// A unit direction, distributed as luminance, for `u` uniform in the unit square, and its density per
    /// steradian. Within a texel all directions are equally likely.
    pub fn sample(&self, u: Vec2) -> (Vec3, f32) {
        let (y, t) = find(&self.rows, u.y);
        let row = self.row(y);
        let (x, s) = find(row, u.x);

        let (above, below) = self.cosines(y);
        let cos_theta = above + (below - above) * t;
        let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
        let phi = TAU * ((x as f32 + s) / self.width as f32 - 0.5);
        let (sin_phi, cos_phi) = libm::sincosf(phi);
        let direction = Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi);
        (direction, self.texel_density(x, y))
    }

    /// The density per steradian with which [`Environment::sample`] gives a unit direction.
    pub fn pdf(&self, direction: Vec3) -> f32 {
        let uv = texture_coordinates(direction);
        let x = ((uv.x * self.width as f32) as usize).min(self.width - 1);
        let y = ((uv.y * self.height as f32) as usize).min(self.height - 1);
        self.texel_density(x, y)
    }

    fn texel_density(&self, x: usize, y: usize) -> f32 {
        let row = self.row(y);
        let probability = (self.rows[y + 1] - self.rows[y]) * (row[x + 1] - row[x]);
        probability * self.width as f32 / row_solid_angle(y, self.height) as f32
    }

    fn row(&self, y: usize) -> &[f32] {
        &self.columns[y * (self.width + 1)..(y + 1) * (self.width + 1)]
    }

    /// Cosines of the polar angle at the upper and the lower edge of a row.
    fn cosines(&self, y: usize) -> (f32, f32) {
        let at = |y: usize| libm::cosf(PI * y as f32 / self.height as f32);
        (at(y), at(y + 1))
    }
}

/// Rec. 709 luminance.
fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Steradians of a whole row: 2 pi times the difference of the cosines at its edges, written as a product
/// that does not cancel near the poles.
fn row_solid_angle(y: usize, height: usize) -> f64 {
    let step = std::f64::consts::PI / height as f64;
    2.0 * std::f64::consts::TAU * libm::sin(step * (y as f64 + 0.5)) * libm::sin(step / 2.0)
}

/// The unit direction at image coordinates, (0, 0) the upper left corner.
fn direction(uv: Vec2) -> Vec3 {
    let (sin_theta, cos_theta) = libm::sincosf(PI * uv.y);
    let (sin_phi, cos_phi) = libm::sincosf(TAU * (uv.x - 0.5));
    Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi)
}

/// The image coordinates of a unit direction.
fn texture_coordinates(direction: Vec3) -> Vec2 {
    // The arc tangent is exact near the poles, where the arc cosine of y is not.
    let theta = libm::atan2f(libm::hypotf(direction.x, direction.z), direction.y);
    let phi = libm::atan2f(direction.x, -direction.z);
    Vec2::new(0.5 + 0.5 * FRAC_1_PI * phi, FRAC_1_PI * theta)
}

/// Running sums from 0 to 1 of non-negative weights, and the weights' sum; equal steps when all are zero.
fn cumulate(weights: impl ExactSizeIterator<Item = f64> + Clone) -> (Vec<f32>, f64) {
    let (count, total) = (weights.len(), weights.clone().sum::<f64>());
    let mut cumulated = Vec::with_capacity(count + 1);
    cumulated.push(0.0);
    let mut sum = 0.0;
    for (i, weight) in weights.enumerate() {
        sum += weight;
        cumulated.push(if total > 0.0 { (sum / total) as f32 } else { (i + 1) as f32 / count as f32 });
    }
    (cumulated, total)
}

/// The interval of `cumulated` that holds `u`, never an empty one, and where in it, 0 to 1.
fn find(cumulated: &[f32], u: f32) -> (usize, f32) {
    // The last step below one stands for all that rounding puts beyond it.
    let last = cumulated.partition_point(|&sum| sum < 1.0) - 1;
    let i = (cumulated.partition_point(|&sum| sum <= u)).saturating_sub(1).min(last);
    let step = cumulated[i + 1] - cumulated[i];
    (i, ((u - cumulated[i]) / step).clamp(0.0, 1.0))
}
