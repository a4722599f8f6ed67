//! The triangles of a scene in world space, and what is interpolated across them.

use super::{Bvh, CameraRay, Hit};
use crate::Error;
use glam::{Mat3, Vec2, Vec3, Vec4};
use kinran_scene::{Primitive, Scene};

/// The most triangles a scene may have once its instances are placed: 2^26, about 10 GB.
pub const MAX_TRIANGLES: usize = 1 << 26;

/// All instances of a scene as world-space triangles.
pub struct Geometry {
    bvh: Bvh,
    pub(crate) positions: Vec<Vec3>,
    pub(crate) normals: Vec<Vec3>,
    pub(crate) tangents: Vec<Vec4>,
    pub(crate) uvs: Vec<[Vec2; 2]>,
    pub(crate) colors: Vec<Vec4>,
    /// Codes of curvature tensors, flat where there are none; empty where no primitive has any.
    pub(crate) curvature: Vec<Vec4>,
    /// Curvature of the code one, 1/mm.
    pub(crate) curvature_range: f32,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) materials: Vec<u32>,
    min: Vec3,
    max: Vec3,
}

/// A point on a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// World space.
    pub position: Vec3,
    /// Unit normal of the triangle, on the side from which its vertices turn counter-clockwise; zero where single
    /// precision cannot tell (edges under 1e-10 metres or above 1e9).
    pub geometric_normal: Vec3,
    /// Columns tangent, bitangent and normal of MikkTSpace: interpolated from unit vectors at the vertices and
    /// not normalised, `b = w * cross(n, t)`. They take a tangent-space normal to world space, up to its length.
    pub tangent_frame: Mat3,
    /// Both UV sets.
    pub uv: [Vec2; 2],
    /// Change of `uv` to the next pixel to the right.
    pub uv_dx: [Vec2; 2],
    /// Change of `uv` to the next pixel below.
    pub uv_dy: [Vec2; 2],
    /// Linear RGBA of the vertices, white where they have none.
    pub color: Vec4,
    /// Code of the curvature tensor (`_CURVATURE`), of the geometry's range; flat where there is none.
    pub curvature: Vec4,
    /// Index of the material.
    pub material: usize,
}

/// Smallest cosine between shading normal and view; chosen by eye, below it grazing lobes only alias.
pub(crate) const N_V_MIN: f32 = 1e-3;

/// The code of no curvature.
pub const FLAT: Vec4 = Vec4::new(0.0, 128.0 / 255.0, 0.0, 0.0);

impl Geometry {
    /// Places every instance of `scene`.
    ///
    /// # Errors
    /// [`Error::Scene`] where there are more than [`MAX_TRIANGLES`].
    pub fn new(scene: &Scene) -> Result<Self, Error> {
        let primitives = || scene.instances.iter().map(|i| (i, &scene.primitives[i.primitive]));
        let count: usize = primitives().map(|(_, p)| p.triangles.len()).sum();
        let vertices: usize = primitives().map(|(_, p)| p.positions.len()).sum();
        if count > MAX_TRIANGLES || vertices > u32::MAX as usize {
            return Err(Error::Scene(format!(
                "the scene has {count} triangles once its instances are placed; the reference renderer takes at \
                 most {MAX_TRIANGLES}, render fewer instances"
            )));
        }

        let mut geometry = Geometry {
            bvh: Bvh::new(&[]),
            positions: Vec::with_capacity(vertices),
            normals: Vec::with_capacity(vertices),
            tangents: Vec::with_capacity(vertices),
            uvs: Vec::with_capacity(vertices),
            colors: Vec::with_capacity(vertices),
            curvature: Vec::new(),
            curvature_range: 1.0,
            triangles: Vec::with_capacity(count),
            materials: Vec::with_capacity(count),
            min: Vec3::INFINITY,
            max: Vec3::NEG_INFINITY,
        };
        // One range for all: the code of a smaller range is scaled, for codes are roots.
        let range = |(_, p): (_, &Primitive)| p.curvature.as_ref().map_or(0.0, |c| c.range);
        let largest = primitives().map(range).fold(0.0, f32::max);
        if largest > 0.0 {
            geometry.curvature_range = largest;
            geometry.curvature.reserve_exact(vertices);
        }
        for (instance, primitive) in primitives() {
            let first = geometry.positions.len() as u32;
            let linear = Mat3::from(instance.transform.matrix3);
            let to_normal = linear.inverse().transpose();
            let mirror = linear.determinant().signum();

            let position = |&p: &Vec3| instance.transform.transform_point3(p);
            geometry.positions.extend(primitive.positions.iter().map(position));
            geometry.normals.extend(primitive.normals.iter().map(|&n| (to_normal * n).normalize_or(n)));
            // A mirroring instance turns the cross product of normal and tangent around.
            geometry.tangents.extend(
                primitive
                    .tangents
                    .iter()
                    .map(|&t| (linear * t.truncate()).normalize_or(t.truncate()).extend(t.w * mirror)),
            );
            let uv = |set: usize, i: usize| primitive.uvs[set].get(i).copied().unwrap_or_default();
            geometry.uvs.extend((0..primitive.positions.len()).map(|i| [uv(0, i), uv(1, i)]));
            let color = |i| primitive.colors.get(i).copied().unwrap_or(Vec4::ONE);
            geometry.colors.extend((0..primitive.positions.len()).map(color));
            if largest > 0.0 {
                match &primitive.curvature {
                    Some(curvature) => {
                        let scale = (curvature.range / largest).sqrt();
                        let scale = Vec4::new(scale, 1.0, scale, scale);
                        geometry.curvature.extend(curvature.codes.iter().map(|&code| code * scale));
                    }
                    None => geometry.curvature.resize(geometry.positions.len(), FLAT),
                }
            }

            // Front faces stay counter-clockwise under a mirroring instance.
            let turn = |&[a, b, c]: &[u32; 3]| if mirror < 0.0 { [a, c, b] } else { [a, b, c] };
            geometry.triangles.extend(primitive.triangles.iter().map(turn).map(|t| t.map(|i| first + i)));
            geometry.materials.resize(geometry.triangles.len(), primitive.material as u32);
        }

        let corners: Vec<[Vec3; 3]> =
            geometry.triangles.iter().map(|t| t.map(|i| geometry.positions[i as usize])).collect();
        for &p in corners.as_flattened() {
            geometry.min = geometry.min.min(p);
            geometry.max = geometry.max.max(p);
        }
        if !corners.as_flattened().iter().all(|p| p.is_finite()) {
            return Err(Error::Scene(
                "an instance's transform moves vertices to infinity; its matrix needs smaller numbers".into(),
            ));
        }
        geometry.bvh = Bvh::new(&corners);
        Ok(geometry)
    }

    /// Smallest and largest coordinates of all triangles; `None` without any.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        (!self.triangles.is_empty()).then_some((self.min, self.max))
    }

    /// Curvature of the code one in [`SurfacePoint::curvature`], 1/mm.
    pub fn curvature_range(&self) -> f32 {
        self.curvature_range
    }

    /// The hierarchy over the triangles.
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// Index of the material of a triangle.
    pub fn material(&self, triangle: u32) -> usize {
        self.materials[triangle as usize] as usize
    }

    /// What lies at a hit of `ray`. The UVs' changes follow Igehy (Tracing Ray Differentials. SIGGRAPH 1999):
    /// the neighbouring pixels' rays meet the plane of the same triangle.
    pub fn surface_point(&self, hit: &Hit, ray: &CameraRay) -> SurfacePoint {
        let corners = self.triangles[hit.triangle as usize].map(|i| i as usize);
        let weights = hit.barycentric;
        let [p0, p1, p2] = corners.map(|i| self.positions[i]);
        let (e1, e2) = (p1 - p0, p2 - p0);
        let area_normal = e1.cross(e2);
        let geometric_normal = area_normal.normalize_or_zero();

        let normal = interpolate(weights, corners.map(|i| self.normals[i]));
        let tangent = interpolate(weights, corners.map(|i| self.tangents[i].truncate()));
        let bitangent = self.tangents[corners[0]].w * normal.cross(tangent);

        // Transfer (eq. 10): the point moves by t dD, then along the ray back to the plane.
        let uv = corners.map(|i| self.uvs[i]);
        let slope = geometric_normal.dot(ray.direction);
        let uv_change = |direction_change: Vec3| -> [Vec2; 2] {
            let offset = hit.distance * direction_change;
            let change = offset - ray.direction * (offset.dot(geometric_normal) / slope);
            let inverse = area_normal.length_squared().recip();
            let w1 = change.cross(e2).dot(area_normal) * inverse;
            let w2 = e1.cross(change).dot(area_normal) * inverse;
            [0, 1].map(|set| {
                let d = w1 * (uv[1][set] - uv[0][set]) + w2 * (uv[2][set] - uv[0][set]);
                if d.is_finite() { d } else { Vec2::ZERO }
            })
        };

        SurfacePoint {
            position: interpolate(weights, [p0, p1, p2]),
            geometric_normal,
            tangent_frame: Mat3::from_cols(tangent, bitangent, normal),
            uv: [0, 1].map(|set| weights.x * uv[0][set] + weights.y * uv[1][set] + weights.z * uv[2][set]),
            uv_dx: uv_change(ray.direction_dx),
            uv_dy: uv_change(ray.direction_dy),
            color: weights.x * self.colors[corners[0]]
                + weights.y * self.colors[corners[1]]
                + weights.z * self.colors[corners[2]],
            curvature: if self.curvature.is_empty() {
                FLAT
            } else {
                weights.x * self.curvature[corners[0]]
                    + weights.y * self.curvature[corners[1]]
                    + weights.z * self.curvature[corners[2]]
            },
            material: self.material(hit.triangle),
        }
    }

    /// The UVs of a hit alone.
    pub fn uv(&self, hit: &Hit) -> [Vec2; 2] {
        let corners = self.triangles[hit.triangle as usize].map(|i| i as usize);
        let w = hit.barycentric;
        [0, 1].map(|set| {
            w.x * self.uvs[corners[0]][set]
                + w.y * self.uvs[corners[1]][set]
                + w.z * self.uvs[corners[2]][set]
        })
    }

    /// Where shadow rays from a hit should start on the side of the unit normal `side`: raised onto the smooth
    /// surface that the vertex normals describe, so that coarse triangles do not shadow their own bright side
    /// (Hanika. Hacking the Shadow Terminator. Ray Tracing Gems II, 2021), and off the triangle by what
    /// rounding may have moved it.
    pub fn shadow_origin(&self, hit: &Hit, side: Vec3) -> Vec3 {
        let corners = self.triangles[hit.triangle as usize].map(|i| i as usize);
        let position = interpolate(hit.barycentric, corners.map(|i| self.positions[i]));
        let raised = corners.map(|i| {
            let normal = if self.normals[i].dot(side) < 0.0 { -self.normals[i] } else { self.normals[i] };
            let below = (position - self.positions[i]).dot(normal).min(0.0);
            position - below * normal
        });
        // A hundred roundings of the largest coordinate, chosen by eye.
        let epsilon = 1e-5 * self.min.abs().max(self.max.abs()).max_element();
        interpolate(hit.barycentric, raised) + epsilon * side
    }
}

fn interpolate(weights: Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    weights.x * a + weights.y * b + weights.z * c
}
