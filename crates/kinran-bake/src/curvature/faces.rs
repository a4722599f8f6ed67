//! Curvature by the change of normals along the edges of triangles.
//!
//! - Rusinkiewicz. Estimating Curvatures and Their Derivatives on Triangle Meshes. 3DPVT 2004.
//! - Meyer, Desbrun, Schröder, Barr. Discrete Differential-Geometry Operators for Triangulated 2-Manifolds. 2002.
//!
//! The talk's slides say the same (Skin Shading | Curvature). In each triangle the tensor that best explains, by least
//! squares, how the normals change along the three edges; at each point the mean of the tensors around it by
//! Voronoi area, each turned by the shortest arc from the triangle's normal to the point's.

use super::surface::Welded;
use glam::{DVec3, Vec3};
use kinran_shading::Sym2;

/// Twice the area of a triangle over its longest edge squared, below which it has no direction worth knowing: single
/// precision places a corner to about 1e-7 of the model.
const DEGENERATE: f64 = 1e-6;

/// Tensors of points, in the frame [`frame`] of their normals, 1 over the mesh's unit; zero where there is no
/// triangle. Also the area of each point, and how many triangles were skipped as degenerate.
pub(crate) struct PointTensors {
    pub(crate) tensors: Vec<Sym2>,
    pub(crate) degenerate: usize,
}

/// A tangent and a bitangent for a unit normal, right-handed.
pub(crate) fn frame(normal: Vec3) -> (Vec3, Vec3) {
    normal.any_orthonormal_pair()
}

/// The least-squares tensor of each triangle, gathered at the points.
pub(crate) fn face_tensors(surface: &Welded, normals: &[Vec3]) -> PointTensors {
    let p = &surface.positions;
    // xx, xy, yy and the weight.
    let mut sums = vec![[0.0f32; 4]; p.len()];
    let mut degenerate = 0;
    for triangle in &surface.triangles {
        let corner = triangle.map(|i| p[i as usize].as_dvec3());
        let normal = triangle.map(|i| normals[i as usize].as_dvec3());
        // Edge i lies opposite to corner i.
        let edge = [corner[2] - corner[1], corner[0] - corner[2], corner[1] - corner[0]];
        let squared = edge.map(DVec3::length_squared);
        let cross = edge[0].cross(edge[1]);
        let double_area = cross.length();
        // Not "less than": what is not a number is degenerate too.
        let solid = double_area > DEGENERATE * squared[0].max(squared[1]).max(squared[2]);
        if !solid {
            degenerate += 1;
            continue;
        }

        // The frame of the triangle, and edges in units of the first.
        let n = cross / double_area;
        let inverse = squared[0].sqrt().recip();
        let t = edge[0] * inverse;
        let b = n.cross(t);
        let e = edge.map(|e| (e.dot(t) * inverse, e.dot(b) * inverse));
        let change = [normal[2] - normal[1], normal[0] - normal[2], normal[1] - normal[0]];
        let d = change.map(|c| (c.dot(t), c.dot(b)));

        // Normal equations of II e = d for (xx, xy, yy), by cofactors.
        let (uu, uv, vv) =
            e.iter().fold((0.0, 0.0, 0.0), |(a, b, c), (u, v)| (a + u * u, b + u * v, c + v * v));
        let mut right = [0.0; 3];
        for ((u, v), (p, q)) in e.iter().zip(d) {
            right[0] += u * p;
            right[1] += v * p + u * q;
            right[2] += v * q;
        }
        let trace = uu + vv;
        let scale = inverse / (trace * (uu * vv - uv * uv));
        let [r0, r1, r2] = right;
        let xx = scale * ((trace * vv - uv * uv) * r0 - uv * vv * r1 + uv * uv * r2);
        let xy = scale * (-uv * vv * r0 + uu * vv * r1 - uu * uv * r2);
        let yy = scale * (uv * uv * r0 - uu * uv * r1 + (uu * trace - uv * uv) * r2);

        let areas = corner_areas(&edge, &squared, double_area);
        let [n, t, b] = [n, t, b].map(|v| v.as_vec3());
        for i in 0..3 {
            let point = triangle[i] as usize;
            let (cos, sin) = turn(normals[point], n, t, b);
            let (cos, sin) = (f64::from(cos), f64::from(sin));
            // The triangle's tensor along the point's tangent and bitangent, both turned into the triangle.
            let (cc, ss, cs) = (cos * cos, sin * sin, cos * sin);
            let w = areas[i];
            let sum = &mut sums[point];
            sum[0] += (w * (cc * xx + 2.0 * cs * xy + ss * yy)) as f32;
            sum[1] += (w * (cs * (yy - xx) + (cc - ss) * xy)) as f32;
            sum[2] += (w * (ss * xx - 2.0 * cs * xy + cc * yy)) as f32;
            sum[3] += w as f32;
        }
    }
    let tensors = sums.iter().map(|&[xx, xy, yy, w]| {
        let scale = if w > 0.0 { w.recip() } else { 0.0 };
        Sym2 { xx, xy, yy } * scale
    });
    PointTensors { tensors: tensors.collect(), degenerate }
}

/// Cosine and sine of the angle, in a triangle of normal `n` and frame `t`, `b`, of a point's tangent after the shortest
/// arc from the point's normal to the triangle's. Opposite normals have no shortest arc; any tangent then.
fn turn(from: Vec3, n: Vec3, t: Vec3, b: Vec3) -> (f32, f32) {
    let (tangent, _) = frame(from);
    let one_plus = 1.0 + from.dot(n);
    if one_plus < 1e-6 {
        return (1.0, 0.0);
    }
    let turned = tangent - (from + n) * (n.dot(tangent) / one_plus);
    (turned.dot(t), turned.dot(b))
}

/// The part of a triangle's area that belongs to each corner (Meyer 2002, figure 4): Voronoi where no angle is
/// obtuse, else a half at the obtuse one and a quarter at the others. Sums to the area.
fn corner_areas(edge: &[DVec3; 3], squared: &[f64; 3], double_area: f64) -> [f64; 3] {
    // Products of the two edges that leave a corner; over the double area they are cotangents.
    let dots = [-edge[1].dot(edge[2]), -edge[2].dot(edge[0]), -edge[0].dot(edge[1])];
    let area = 0.5 * double_area;
    if let Some(obtuse) = dots.iter().position(|&dot| dot < 0.0) {
        let mut areas = [0.25 * area; 3];
        areas[obtuse] = 0.5 * area;
        return areas;
    }
    let scale = 0.125 / double_area;
    [
        scale * (squared[1] * dots[1] + squared[2] * dots[2]),
        scale * (squared[2] * dots[2] + squared[0] * dots[0]),
        scale * (squared[0] * dots[0] + squared[1] * dots[1]),
    ]
}

/// Voronoi areas of points.
pub(crate) fn point_areas(surface: &Welded) -> Vec<f32> {
    let p = &surface.positions;
    let mut areas = vec![0.0f32; p.len()];
    for triangle in &surface.triangles {
        let corner = triangle.map(|i| p[i as usize].as_dvec3());
        let edge = [corner[2] - corner[1], corner[0] - corner[2], corner[1] - corner[0]];
        let double_area = edge[0].cross(edge[1]).length();
        if double_area > 0.0 {
            let parts = corner_areas(&edge, &edge.map(DVec3::length_squared), double_area);
            for (&point, part) in triangle.iter().zip(parts) {
                areas[point as usize] += part as f32;
            }
        }
    }
    areas
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corner_areas_sum_to_the_area_for_acute_right_obtuse_and_needle_triangles() {
        for third in [[0.4, 0.8], [0.0, 1.0], [-3.0, 0.5], [0.5, 1e-5], [10.0, 0.1]] {
            let corner = [DVec3::ZERO, DVec3::X, DVec3::new(third[0], third[1], 0.0)];
            let edge = [corner[2] - corner[1], corner[0] - corner[2], corner[1] - corner[0]];
            let double_area = edge[0].cross(edge[1]).length();
            let areas = corner_areas(&edge, &edge.map(DVec3::length_squared), double_area);
            let sum: f64 = areas.iter().sum();
            assert!((sum - 0.5 * double_area).abs() < 1e-12, "third corner {third:?}: {areas:?}");
            assert!(areas.iter().all(|&a| a >= 0.0), "third corner {third:?}: {areas:?}");
        }
    }
}
