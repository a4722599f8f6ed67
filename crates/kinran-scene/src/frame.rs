//! A scene's extent and a camera that shows it.

use glam::{Affine3A, Mat3A, Vec3, Vec3A};

use crate::{Camera, Scene};

/// Where the default camera stands, seen from the scene: 35 degrees round from the front (+z) towards +x
/// and 18 degrees up. Chosen by eye: a three-quarter view shows depth and a little of the top.
const AZIMUTH: f32 = 35.0 * std::f32::consts::PI / 180.0;
const ELEVATION: f32 = 18.0 * std::f32::consts::PI / 180.0;

/// The default camera's vertical field of view; 30 degrees, a portrait lens, chosen by eye.
const YFOV: f32 = 30.0 * std::f32::consts::PI / 180.0;

/// How much of the picture's half-width or half-height the scene may fill. Chosen by eye.
const FILL: f32 = 0.92;

impl Scene {
    /// The smallest and the largest world coordinates of all triangles; `None` when there are none.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        self.corners()
            .map(|p| [p, p])
            .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
            .map(|b| b.map(Vec3::from))
    }

    /// How many triangles the instances show together.
    pub fn triangle_count(&self) -> usize {
        self.instances.iter().map(|instance| self.primitives[instance.primitive].triangles.len()).sum()
    }

    /// A camera that sees all triangles in a picture of `aspect` = width / height: a three-quarter view
    /// from the front, which is +z in glTF. `None` when the scene has no triangles.
    pub fn default_camera(&self, aspect: f32) -> Option<Camera> {
        let (sin_a, cos_a) = libm::sincosf(AZIMUTH);
        let (sin_e, cos_e) = libm::sincosf(ELEVATION);
        let z = Vec3A::new(sin_a * cos_e, sin_e, cos_a * cos_e);
        let x = Vec3A::Y.cross(z).normalize();
        let axes = Mat3A::from_cols(x, z.cross(x), z);
        let tan_y = libm::tanf(YFOV / 2.0) * FILL;
        let tan_x = tan_y * aspect;

        // A point p is inside the pyramid of an eye e when |p.x - e.x| <= tan_x (e.z - p.z), and the same
        // in y: four planes, and the eye stands where the outermost ones meet.
        let to_camera = axes.transpose();
        let mut planes = [f32::NEG_INFINITY; 4];
        let mut nearest = f32::NEG_INFINITY;
        for p in self.corners().map(|p| to_camera * p) {
            let distances = [p.x + tan_x * p.z, -p.x + tan_x * p.z, p.y + tan_y * p.z, -p.y + tan_y * p.z];
            for (plane, distance) in planes.iter_mut().zip(distances) {
                *plane = plane.max(distance);
            }
            nearest = nearest.max(p.z);
        }
        if nearest == f32::NEG_INFINITY {
            return None;
        }
        let distance = ((planes[0] + planes[1]) / (2.0 * tan_x)).max((planes[2] + planes[3]) / (2.0 * tan_y));
        // A single point has no extent to frame: it is seen from one metre.
        let distance = if distance > nearest { distance } else { nearest + 1.0 };
        let eye = Vec3A::new((planes[0] - planes[1]) / 2.0, (planes[2] - planes[3]) / 2.0, distance);
        Some(Camera { transform: Affine3A { matrix3: axes, translation: axes * eye }, yfov: YFOV })
    }

    /// Every triangle corner in the world.
    fn corners(&self) -> impl Iterator<Item = Vec3A> {
        self.instances.iter().flat_map(|instance| {
            let primitive = &self.primitives[instance.primitive];
            (primitive.triangles.iter().flatten())
                .map(|&v| instance.transform.transform_point3a(primitive.positions[v as usize].into()))
        })
    }
}
