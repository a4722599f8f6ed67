//! Curvature by fitting a surface to the points around each point.
//!
//! - Cazals, Pouget. Estimating Differential Quantities Using Polynomial Fitting of Osculating Jets. SGP 2003.
//! - Panozzo, Puppo, Rocca. Efficient Multi-scale Curvature and Crease Estimation. 2010.
//!
//! Over the tangent plane, `z = d x + e y - (a x² + 2 b x y + c y²) / 2 + cubic terms`, by least squares over two rings of
//! neighbours. The normals serve as directions of projection only, so their errors, which on irregular meshes are
//! most of the error of [`faces`](super::faces), hardly matter; cubic terms take up what an uneven ring would leave
//! in the quadratic ones. With too few neighbours for them the fit is quadratic.

use super::faces::frame;
use super::surface::{Fans, Welded, others};
use glam::Vec3;
use kinran_shading::Sym2;
use rayon::prelude::*;

/// Coefficients with and without cubic terms.
const CUBIC: usize = 9;
const QUADRATIC: usize = 5;

/// Neighbours that a cubic fit wants: half as many again as coefficients.
const ENOUGH: usize = 14;

/// Rings that are searched for enough neighbours.
const RINGS_MAX: usize = 4;

/// Neighbours that are looked at.
const NEIGHBOURS_MAX: usize = 64;

/// Points of one piece of work.
const BAND: usize = 4096;

/// Tensors of points as [`face_tensors`](super::faces::face_tensors) gives them, and which points could not be fitted and
/// keep the given ones.
pub(crate) fn quadric_tensors(
    surface: &Welded,
    fans: &Fans,
    normals: &[Vec3],
    tensors: &mut [Sym2],
) -> usize {
    (tensors.par_chunks_mut(BAND).enumerate())
        .map(|(band, tensors)| {
            let mut ring = Ring { points: Vec::with_capacity(NEIGHBOURS_MAX) };
            let mut unfitted = 0;
            for (i, tensor) in tensors.iter_mut().enumerate() {
                match ring.fit(surface, fans, normals, band * BAND + i) {
                    Some(fitted) => *tensor = fitted,
                    None => unfitted += 1,
                }
            }
            unfitted
        })
        .sum()
}

/// A point's neighbours.
struct Ring {
    points: Vec<u32>,
}

impl Ring {
    /// Collects rings until there are enough neighbours; the point itself comes first.
    fn collect(&mut self, surface: &Welded, fans: &Fans, point: usize) {
        self.points.clear();
        self.points.push(point as u32);
        let mut from = 0;
        for ring in 0..RINGS_MAX {
            let to = self.points.len();
            for i in from..to {
                let center = self.points[i];
                for &triangle in fans.around(center as usize) {
                    let (a, b) = others(surface.triangles[triangle as usize], center);
                    for other in [a, b] {
                        if !self.points.contains(&other) && self.points.len() < NEIGHBOURS_MAX {
                            self.points.push(other);
                        }
                    }
                }
            }
            if self.points.len() == to || (ring >= 1 && self.points.len() > ENOUGH) {
                break;
            }
            from = to;
        }
    }

    fn fit(&mut self, surface: &Welded, fans: &Fans, normals: &[Vec3], point: usize) -> Option<Sym2> {
        let normal = normals[point];
        if normal == Vec3::ZERO {
            return None;
        }
        self.collect(surface, fans, point);
        let (t, b) = frame(normal);
        let (n, t, b) = (normal.as_dvec3(), t.as_dvec3(), b.as_dvec3());
        let origin = surface.positions[point].as_dvec3();

        // Neighbours in the frame, in units of the farthest; those that face away belong to another side.
        let mut local = [[0.0f64; 3]; NEIGHBOURS_MAX];
        let (mut count, mut farthest) = (0, 0.0f64);
        for &other in &self.points[1..] {
            if normals[other as usize].dot(normal) <= 0.0 {
                continue;
            }
            let d = surface.positions[other as usize].as_dvec3() - origin;
            local[count] = [d.dot(t), d.dot(b), d.dot(n)];
            farthest = farthest.max(d.length_squared());
            count += 1;
        }
        if farthest <= 0.0 {
            return None;
        }
        let inverse = farthest.sqrt().recip();
        let local = &mut local[..count];
        for p in local.iter_mut() {
            *p = p.map(|x| x * inverse);
        }

        let cubic = if count >= ENOUGH {
            solve::<CUBIC>(local).map(|c| [c[0], c[1], c[2], c[3], c[4]])
        } else {
            None
        };
        let [d, e, xx, xy, yy] = match cubic {
            Some(coefficients) => coefficients,
            None if count >= QUADRATIC => solve::<QUADRATIC>(local)?,
            None => return None,
        };
        Some(weingarten(d, e, xx, xy, yy, inverse))
    }
}

/// The shape operator of the graph at the origin, in the frame of the given normal: the one of the fitted tangent plane,
/// turned back by the shortest arc.
fn weingarten(d: f64, e: f64, xx: f64, xy: f64, yy: f64, inverse: f64) -> Sym2 {
    // Second form over the length of the normal, convex positive.
    let squared = 1.0 + d * d + e * e;
    let scale = -inverse / squared.sqrt();
    let second = [scale * xx, scale * xy, scale * yy];

    // Tangent vectors u whose pictures under the arc are x and y: with n = (-d, -e, 1) / |n| the arc from z to n takes x
    // to a vector whose plane coordinates are these.
    let length = squared.sqrt();
    let (nx, ny, nz) = (-d / length, -e / length, 1.0 / length);
    let k = 1.0 / (1.0 + nz);
    let u = [1.0 - nx * nx * k, -nx * ny * k];
    let v = [-nx * ny * k, 1.0 - ny * ny * k];
    let form = |p: [f64; 2], q: [f64; 2]| {
        second[0] * p[0] * q[0] + second[1] * (p[0] * q[1] + p[1] * q[0]) + second[2] * p[1] * q[1]
    };
    Sym2 { xx: form(u, u) as f32, xy: form(u, v) as f32, yy: form(v, v) as f32 }
}

/// Least squares of `z` on `x, y, x²/2, xy, y²/2` and, with nine coefficients, the cubic monomials: normal equations by
/// Cholesky. `None` where the points do not determine them.
fn solve<const N: usize>(points: &[[f64; 3]]) -> Option<[f64; N]> {
    let mut matrix = [[0.0f64; N]; N];
    let mut right = [0.0f64; N];
    for &[x, y, z] in points {
        let all = [x, y, 0.5 * x * x, x * y, 0.5 * y * y, x * x * x, x * x * y, x * y * y, y * y * y];
        for i in 0..N {
            right[i] += all[i] * z;
            // Row i from the diagonal on.
            for j in i..N {
                matrix[i][j] += all[i] * all[j];
            }
        }
    }
    for i in 0..N {
        let before = matrix[i][i];
        for k in 0..i {
            matrix[i][i] -= matrix[k][i] * matrix[k][i];
        }
        // Below, the column is a combination of those before it to all digits that count.
        if matrix[i][i] <= 1e-9 * before || before <= 0.0 {
            return None;
        }
        let inverse = matrix[i][i].sqrt().recip();
        matrix[i][i] = inverse;
        for j in i + 1..N {
            for k in 0..i {
                matrix[i][j] -= matrix[k][i] * matrix[k][j];
            }
            matrix[i][j] *= inverse;
        }
    }
    for i in 0..N {
        for k in 0..i {
            right[i] -= matrix[k][i] * right[k];
        }
        right[i] *= matrix[i][i];
    }
    for i in (0..N).rev() {
        for k in i + 1..N {
            right[i] -= matrix[i][k] * right[k];
        }
        right[i] *= matrix[i][i];
    }
    Some(right)
}
