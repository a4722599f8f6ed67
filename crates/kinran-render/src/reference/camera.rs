//! Cameras and the rays they send through pixels.

use glam::{Affine3A, Mat3, Vec3};
use kinran_scene::Camera;

/// A ray through the picture plane, and how it changes from one pixel to the next (Igehy. Tracing Ray
/// Differentials. SIGGRAPH 1999, eq. 8). All rays of a pinhole share their origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// World space.
    pub origin: Vec3,
    /// Unit length.
    pub direction: Vec3,
    /// Change of `direction` to the next pixel to the right.
    pub direction_dx: Vec3,
    /// Change of `direction` to the next pixel below.
    pub direction_dy: Vec3,
}

/// A [`Camera`] looking at a picture plane of a given size in pixels.
#[derive(Clone, Copy, Debug)]
pub struct PictureCamera {
    origin: Vec3,
    corner: Vec3,
    right: Vec3,
    down: Vec3,
}

impl PictureCamera {
    /// The picture plane of `camera` with `width` by `height` square pixels.
    pub fn new(camera: &Camera, width: u32, height: u32) -> Self {
        let basis = Mat3::from(camera.transform.matrix3);
        let pixel = 2.0 * libm::tanf(0.5 * camera.yfov) / height as f32;
        let right = basis.x_axis * pixel;
        let down = -basis.y_axis * pixel;
        let corner = -basis.z_axis - 0.5 * (width as f32 * right + height as f32 * down);
        PictureCamera { origin: camera.transform.translation.into(), corner, right, down }
    }

    /// The ray through a point of the picture, in pixels from its top left corner: a pixel's centre is at 0.5.
    #[inline]
    pub fn ray(&self, x: f32, y: f32) -> CameraRay {
        let d = self.corner + x * self.right + y * self.down;
        let squared = d.length_squared();
        let scale = squared.sqrt().recip();
        let direction = d * scale;
        let derivative = |step: Vec3| (step - direction * direction.dot(step)) * scale;
        CameraRay {
            origin: self.origin,
            direction,
            direction_dx: derivative(self.right),
            direction_dy: derivative(self.down),
        }
    }
}

/// A camera at `eye` that looks at `target`, `up` pointing up in the picture; `yfov` is the vertical field of
/// view in radians. `up` must not be parallel to the view.
pub fn look_at(eye: Vec3, target: Vec3, up: Vec3, yfov: f32) -> Camera {
    let back = (eye - target).normalize();
    let right = up.cross(back).normalize();
    let basis = Mat3::from_cols(right, back.cross(right), back);
    Camera { transform: Affine3A::from_mat3_translation(basis, eye), yfov }
}

/// A camera that sees the whole of the box from `min` to `max` from the direction `from` (pointing from the
/// box to the camera), +y up, in a picture of the given `aspect` (width over height). It stands as near as the
/// box's corners allow.
pub fn frame_box(min: Vec3, max: Vec3, from: Vec3, yfov: f32, aspect: f32) -> Camera {
    let from = from.normalize();
    let up = if from.y.abs() > 0.999 { Vec3::NEG_Z * from.y.signum() } else { Vec3::Y };
    let center = 0.5 * (min + max);
    let mut camera = look_at(center + from, center, up, yfov);

    // A corner at offset p stands inside the frustum when the camera's distance is at least
    // p·back + |p·axis| / tan(half angle), for both axes.
    let basis = Mat3::from(camera.transform.matrix3);
    let tan_y = libm::tanf(0.5 * yfov);
    let tan_x = tan_y * aspect;
    let mut distance = 0.0f32;
    for corner in 0..8 {
        let pick = |bit: usize, lo: f32, hi: f32| if corner >> bit & 1 == 0 { lo } else { hi };
        let p = Vec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z)) - center;
        let p = basis.transpose() * p;
        distance = distance.max(p.z + (p.x.abs() / tan_x).max(p.y.abs() / tan_y));
    }
    // Five percent of air around the box, chosen by eye; a single point is seen from one metre.
    let distance = if distance > 0.0 { 1.05 * distance } else { 1.0 };
    camera.transform.translation = (center + distance * from).into();
    camera
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    #[test]
    fn the_picture_is_neither_mirrored_nor_upside_down() {
        let camera = PictureCamera::new(&look_at(vec3(0.0, 0.0, 5.0), Vec3::ZERO, Vec3::Y, 0.8), 200, 100);
        let centre = camera.ray(100.0, 50.0).direction;
        assert!((centre - Vec3::NEG_Z).length() < 1e-6, "centre looks along {centre}");
        assert!(camera.ray(150.0, 50.0).direction.x > 0.0, "right of the picture is not +x");
        assert!(camera.ray(100.0, 10.0).direction.y > 0.0, "top of the picture is not +y");
        let top = camera.ray(100.0, 0.0).direction;
        let angle = top.angle_between(centre);
        assert!((angle - 0.4).abs() < 1e-5, "half the field of view: wanted 0.4, got {angle}");
    }

    #[test]
    fn differentials_match_finite_differences() {
        let camera =
            PictureCamera::new(&look_at(vec3(1.0, 2.0, 3.0), vec3(0.2, -0.4, 0.0), Vec3::Y, 1.2), 320, 200);
        for (x, y) in [(0.5, 0.5), (160.0, 100.0), (310.0, 20.0)] {
            let ray = camera.ray(x, y);
            const H: f32 = 0.5;
            let dx = (camera.ray(x + H, y).direction - camera.ray(x - H, y).direction) / (2.0 * H);
            let dy = (camera.ray(x, y + H).direction - camera.ray(x, y - H).direction) / (2.0 * H);
            // A pixel is 7e-3 of the unit direction; single precision leaves 1e-7 / 7e-3 of it.
            assert!(
                (ray.direction_dx - dx).length() < 1e-6,
                "({x}, {y}) dx: wanted {dx}, got {}",
                ray.direction_dx
            );
            assert!(
                (ray.direction_dy - dy).length() < 1e-6,
                "({x}, {y}) dy: wanted {dy}, got {}",
                ray.direction_dy
            );
        }
    }

    #[test]
    fn a_framed_box_is_wholly_in_the_picture_and_fills_it() {
        let (min, max) = (vec3(-1.0, 0.0, -0.2), vec3(3.0, 0.5, 0.7));
        for from in [vec3(0.0, 0.0, 1.0), vec3(1.0, 1.0, 1.0), vec3(0.0, 1.0, 0.0), vec3(-1.0, 0.2, 0.0)] {
            let (width, height) = (300, 200);
            let camera = frame_box(min, max, from, 0.7, 1.5);
            let world_to_camera = camera.transform.inverse();
            let mut widest = 0.0f32;
            for corner in 0..8 {
                let pick = |bit: usize, lo: f32, hi: f32| if corner >> bit & 1 == 0 { lo } else { hi };
                let p = vec3(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z));
                let p = world_to_camera.transform_point3(p);
                let scale = (0.5f32 * camera.yfov).tan() * -p.z;
                let ndc = [p.x / (scale * width as f32 / height as f32), p.y / scale];
                assert!(ndc.iter().all(|c| c.abs() <= 1.0), "{from}: corner {corner} at {ndc:?}");
                widest = widest.max(ndc[0].abs()).max(ndc[1].abs());
            }
            assert!(widest > 0.8, "{from}: the box fills only {widest}");
        }
    }
}
