//! Curvature by the change of normals along the edges of triangles.
//!
//! - Rusinkiewicz. Estimating Curvatures and Their Derivatives on Triangle Meshes. 3DPVT 2004.
//! - Meyer, Desbrun, Schröder, Barr. Discrete Differential-Geometry Operators for Triangulated 2-Manifolds. 2002.
//!
//! The talk's slides say the same (Skin Shading | Curvature). In each triangle the tensor that best explains, by least
//! squares, how the normals change along the three edges; at each point the mean of the tensors around it by
//! Voronoi area, each turned by the shortest arc from the triangle's normal to the point's.
//!
//! Eight triangles at a time, in single precision: positions are first scaled by a power of two, which is exact, so that
//! the model is about one unit large, and the differences of normals, whose own rounding is 3e-8, are what
//! limits the result.

use super::surface::Welded;
use crate::aniso::lanes::{F8, LANES, V8};
use crate::simd::dispatch;
use glam::Vec3;
use kinran_shading::Sym2;

/// Twice the area of a triangle over its longest edge squared, below which it has no direction worth knowing: single
/// precision places a corner to about 1e-7 of the model.
const DEGENERATE: f32 = 1e-6;

/// Tensors of points, in the frame [`frame`] of their normals, 1 over the mesh's unit; zero where there is no
/// triangle. Also how many triangles were skipped as degenerate.
pub(crate) struct PointTensors {
    pub(crate) tensors: Vec<Sym2>,
    pub(crate) degenerate: usize,
}

/// A tangent and a bitangent for a unit normal, right-handed.
pub(crate) fn frame(normal: Vec3) -> (Vec3, Vec3) {
    normal.any_orthonormal_pair()
}

/// [`frame`]'s tangents of eight normals (Duff 2017).
#[inline(always)]
pub(crate) fn frame_tangents(n: V8) -> V8 {
    let sign = n.z.map(|z| 1f32.copysign(z));
    let a = -(sign + n.z).recip();
    V8 { x: F8::splat(1.0) + sign * n.x * n.x * a, y: sign * (n.x * n.y * a), z: -(sign * n.x) }
}

/// The least-squares tensor of each triangle, gathered at the points.
pub(crate) fn face_tensors(surface: &Welded, normals: &[Vec3]) -> PointTensors {
    // xx, xy, yy and the weight.
    let mut sums = vec![[0.0f32; 4]; surface.positions.len()];
    let scale = surface.unit_scale();
    let degenerate = dispatch(Faces { surface, normals, scale, sums: &mut sums });
    let tensors = sums.iter().map(|&[xx, xy, yy, w]| {
        let inverse = if w > 0.0 { scale / w } else { 0.0 };
        Sym2 { xx, xy, yy } * inverse
    });
    PointTensors { tensors: tensors.collect(), degenerate }
}

struct Faces<'a> {
    surface: &'a Welded,
    normals: &'a [Vec3],
    scale: f32,
    sums: &'a mut [[f32; 4]],
}

impl pulp::WithSimd for Faces<'_> {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> usize {
        let mut degenerate = 0;
        for triangles in self.surface.triangles.chunks(LANES) {
            let corners = Corners::gather(&self.surface.positions, triangles, self.scale);
            let normals = gather_corners(self.normals, triangles);
            let weighted = weighted_tensors(&corners, &normals);
            for (l, triangle) in triangles.iter().enumerate() {
                if !corners.is_solid(l) {
                    degenerate += 1;
                    continue;
                }
                for (&point, tensor) in triangle.iter().zip(&weighted) {
                    let sum = &mut self.sums[point as usize];
                    for (sum, part) in sum.iter_mut().zip(tensor) {
                        *sum += part.0[l];
                    }
                }
            }
        }
        degenerate
    }
}

/// The corners of up to eight triangles; lanes beyond them are zero.
#[inline(always)]
fn gather_corners(of: &[Vec3], triangles: &[[u32; 3]]) -> [V8; 3] {
    let mut corners = [V8::default(); 3];
    for (l, triangle) in triangles.iter().enumerate().take(LANES) {
        for (v, &point) in corners.iter_mut().zip(triangle) {
            let Vec3 { x, y, z } = of[point as usize];
            (v.x.0[l], v.y.0[l], v.z.0[l]) = (x, y, z);
        }
    }
    corners
}

/// Edges of up to eight triangles; edge i lies opposite to corner i.
pub(crate) struct Corners {
    edge: [V8; 3],
    squared: [F8; 3],
    cross: V8,
    double_area: F8,
    /// Products of the two edges that leave a corner; over the double area they are cotangents.
    dots: [F8; 3],
}

impl Corners {
    /// Positions are multiplied with `scale`.
    #[inline(always)]
    pub(crate) fn gather(positions: &[Vec3], triangles: &[[u32; 3]], scale: f32) -> Self {
        let [a, b, c] = gather_corners(positions, triangles);
        let scale = F8::splat(scale);
        let edge = [(c - b) * scale, (a - c) * scale, (b - a) * scale];
        let cross = edge[0].cross(edge[1]);
        Corners {
            squared: [edge[0].dot(edge[0]), edge[1].dot(edge[1]), edge[2].dot(edge[2])],
            cross,
            double_area: cross.dot(cross).sqrt(),
            dots: [-edge[1].dot(edge[2]), -edge[2].dot(edge[0]), -edge[0].dot(edge[1])],
            edge,
        }
    }

    /// Whether a lane's triangle has a direction.
    #[inline(always)]
    pub(crate) fn is_solid(&self, l: usize) -> bool {
        let longest = self.squared[0].0[l].max(self.squared[1].0[l]).max(self.squared[2].0[l]);
        self.double_area.0[l] > DEGENERATE * longest
    }

    /// Whether a lane's triangle has any area.
    #[inline(always)]
    pub(crate) fn has_area(&self, l: usize) -> bool {
        self.double_area.0[l] > 0.0
    }

    /// Half the cotangents at the corners.
    #[inline(always)]
    pub(crate) fn half_cotangents(&self) -> [F8; 3] {
        let half = (self.double_area + self.double_area).recip();
        [self.dots[0] * half, self.dots[1] * half, self.dots[2] * half]
    }

    /// The part of a triangle's area that belongs to each corner (Meyer 2002, figure 4): Voronoi where no angle is
    /// obtuse, else a half at the obtuse one and a quarter at the others. Sums to the area.
    #[inline(always)]
    pub(crate) fn areas(&self) -> [F8; 3] {
        let (dots, squared) = (self.dots, self.squared);
        let part = |share: f32| self.double_area * F8::splat(0.5 * share);
        let (half, quarter) = (part(0.5), part(0.25));
        let scale = F8::splat(0.125) / self.double_area;
        let mut areas = [F8::default(); 3];
        for (i, area) in areas.iter_mut().enumerate() {
            let (next, last) = ((i + 1) % 3, (i + 2) % 3);
            let voronoi = scale * (squared[next] * dots[next] + squared[last] * dots[last]);
            let elsewhere = dots[next].where_negative(quarter, dots[last].where_negative(quarter, voronoi));
            *area = dots[i].where_negative(half, elsewhere);
        }
        areas
    }
}

/// For each corner the triangle's tensor along the tangent and bitangent of the corner's point, both turned into the
/// triangle, times the corner's area, and that area.
#[inline(always)]
fn weighted_tensors(corners: &Corners, normals: &[V8; 3]) -> [[F8; 4]; 3] {
    // The frame of the triangle, and edges in units of the first, along which the frame's tangent runs. The edges sum to
    // zero, so that two numbers, u and v of the second, say them all.
    let inverse = corners.squared[0].sqrt().recip();
    let n = corners.cross * corners.double_area.recip();
    let t = corners.edge[0] * inverse;
    let b = n.cross(t);
    let one = F8::splat(1.0);
    let (u, v) = (corners.edge[1].dot(t) * inverse, corners.edge[1].dot(b) * inverse);
    let third = -(one + u);
    let change = [normals[2] - normals[1], normals[0] - normals[2], normals[1] - normals[0]];
    let p = [change[0].dot(t), change[1].dot(t), change[2].dot(t)];
    let q = [change[0].dot(b), change[1].dot(b), change[2].dot(b)];

    // Normal equations of II e = d for (xx, xy, yy), by cofactors. Their determinant, (uu + vv) (uu vv - uv²), is
    // (uu + vv) 3 v² since the edges sum to zero; differences would cancel in flat triangles.
    let uu = one + u * u + third * third;
    let uv = v * (u - third);
    let vv = v * v + v * v;
    let r0 = p[0] + u * p[1] + third * p[2];
    let r1 = v * (p[1] - p[2]) + q[0] + u * q[1] + third * q[2];
    let r2 = v * (q[1] - q[2]);
    let minor = F8::splat(3.0) * v * v;
    let scale = inverse / ((uu + vv) * minor);
    let xx = scale * ((minor + vv * vv) * r0 - uv * vv * r1 + uv * uv * r2);
    let xy = scale * (uu * vv * r1 - uv * vv * r0 - uu * uv * r2);
    let yy = scale * (uv * uv * r0 - uu * uv * r1 + (uu * uu + minor) * r2);

    let areas = corners.areas();
    let mut weighted = [[F8::default(); 4]; 3];
    for ((weighted, &from), w) in weighted.iter_mut().zip(normals).zip(areas) {
        let (cos, sin) = turn(from, frame_tangents(from), n, t, b);
        let (cc, ss, cs) = (cos * cos, sin * sin, cos * sin);
        let both = cs + cs;
        *weighted = [
            w * (cc * xx + both * xy + ss * yy),
            w * (cs * (yy - xx) + (cc - ss) * xy),
            w * (ss * xx - both * xy + cc * yy),
            w,
        ];
    }
    weighted
}

/// Cosine and sine of the angle, in a plane of normal `n` and frame `t`, `b`, of `tangent` after the shortest arc from the
/// normal `from` to `n`. Opposite normals have no shortest arc; any tangent then.
#[inline(always)]
pub(crate) fn turn(from: V8, tangent: V8, n: V8, t: V8, b: V8) -> (F8, F8) {
    let one_plus = F8::splat(1.0) + from.dot(n);
    let turned = tangent - (from + n) * (n.dot(tangent) / one_plus);
    let opposite = one_plus - F8::splat(1e-6);
    (
        opposite.where_negative(F8::splat(1.0), turned.dot(t)),
        opposite.where_negative(F8::splat(0.0), turned.dot(b)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corner_areas_sum_to_the_area_for_acute_right_obtuse_and_needle_triangles() {
        for third in [[0.4, 0.8], [0.0, 1.0], [-3.0, 0.5], [0.5, 1e-5], [10.0, 0.1]] {
            let positions = [Vec3::ZERO, Vec3::X, Vec3::new(third[0], third[1], 0.0)];
            for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
                let corners = Corners::gather(&positions, &[order], 1.0);
                let areas = corners.areas().map(|a| a.0[0]);
                let sum: f32 = areas.iter().sum();
                let want = 0.5 * third[1];
                assert!((sum - want).abs() < 1e-6, "third corner {third:?}: {areas:?}");
                assert!(areas.iter().all(|&a| a >= 0.0), "third corner {third:?}: {areas:?}");
            }
        }
    }

    #[test]
    fn tangents_in_lanes_are_those_of_single_normals() {
        for n in [Vec3::X, -Vec3::Z, Vec3::Z, Vec3::new(0.1, -0.7, -0.3).normalize()] {
            let mut lanes = V8::default();
            (lanes.x.0[3], lanes.y.0[3], lanes.z.0[3]) = (n.x, n.y, n.z);
            let got = frame_tangents(lanes).lane(3);
            assert!((got - frame(n).0).length() < 1e-6, "{n}: wanted {}, got {got}", frame(n).0);
        }
    }
}
