//! A photographer's studio, so that a picture needs no environment file.

use glam::Vec3;

use crate::Environment;

/// A rectangular soft box, seen from the middle of the room.
struct SoftBox {
    /// Where its centre stands.
    center: Vec3,
    /// Half its width and half its height, in tangents of angles.
    half_size: [f32; 2],
    /// Radiance at its centre.
    radiance: Vec3,
}

/// All chosen by eye, for a camera that looks along -z, to show the shape of highlights: a large key light
/// from the left with a straight edge, a narrow cool strip on the right whose reflection tells anisotropy
/// at a glance, a warm light above, and a rim light behind that draws silhouettes.
const SOFT_BOXES: [SoftBox; 4] = [
    SoftBox {
        center: Vec3::new(-0.75, 0.45, 0.6),
        half_size: [0.38, 0.55],
        radiance: Vec3::new(9.0, 8.7, 8.2),
    },
    SoftBox {
        center: Vec3::new(0.9, 0.15, 0.45),
        half_size: [0.09, 0.7],
        radiance: Vec3::new(7.0, 7.8, 9.0),
    },
    SoftBox {
        center: Vec3::new(0.1, 1.0, -0.15),
        half_size: [0.6, 0.25],
        radiance: Vec3::new(6.0, 5.4, 4.6),
    },
    SoftBox {
        center: Vec3::new(0.55, 0.35, -0.85),
        half_size: [0.25, 0.4],
        radiance: Vec3::new(5.0, 5.2, 5.6),
    },
];

/// Radiance of the ceiling and of the floor, and the share of light that a box loses from its middle to its
/// edge; chosen by eye.
const CEILING: Vec3 = Vec3::new(0.30, 0.32, 0.35);
const FLOOR: Vec3 = Vec3::new(0.10, 0.095, 0.09);
const VIGNETTE: f32 = 0.35;

/// The width of a box's edge, in tangents; two texels of the image, so that it does not alias.
const EDGE: f32 = 0.025;

impl Environment {
    /// A built-in environment: four soft boxes in a grey room, radiance 0.1 to 9, 512 by 256 texels.
    pub fn studio() -> Environment {
        Environment::from_fn(256, |direction| {
            let height = 0.5 + 0.5 * direction.y;
            let room = FLOOR.lerp(CEILING, smoothstep(0.35, 0.75, height));
            SOFT_BOXES.iter().fold(room, |sum, soft_box| sum + soft_box.seen_from(direction))
        })
    }
}

impl SoftBox {
    fn seen_from(&self, direction: Vec3) -> Vec3 {
        let z = self.center.normalize();
        let x = Vec3::Y.cross(z).normalize();
        let y = z.cross(x);
        let depth = direction.dot(z);
        if depth <= 0.0 {
            return Vec3::ZERO;
        }
        let p = [direction.dot(x) / depth / self.half_size[0], direction.dot(y) / depth / self.half_size[1]];
        let inside = |i: usize| 1.0 - smoothstep(1.0 - EDGE / self.half_size[i], 1.0, p[i].abs());
        let falloff = 1.0 - VIGNETTE * (p[0] * p[0] + p[1] * p[1]).min(2.0) / 2.0;
        self.radiance * (inside(0) * inside(1) * falloff)
    }
}

fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
