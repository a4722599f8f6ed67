//! A camera that turns about a point.

use glam::{Mat3, Vec3};
use kinran_render::reference::look_at;
use kinran_scene::Camera;
use serde::{Deserialize, Serialize};

/// Where the camera is, seen from what it looks at.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Orbit {
    /// What is looked at, metres.
    pub(super) target: [f32; 3],
    /// Radians about +y, 0 in front (+z).
    pub(super) yaw: f32,
    /// Radians above the horizon.
    pub(super) pitch: f32,
    /// Metres.
    pub(super) distance: f32,
    /// Vertical field of view, radians.
    pub(super) yfov: f32,
}

/// As near to straight up as the camera gets: there its right and up are still told apart.
const PITCH_MAX: f32 = 1.55;

impl Orbit {
    /// The orbit on which `camera` lies, about `target`.
    pub(super) fn new(camera: &Camera, target: Vec3) -> Self {
        let away = Vec3::from(camera.transform.translation) - target;
        let distance = away.length().max(1e-6);
        Self {
            target: target.to_array(),
            yaw: away.x.atan2(away.z),
            pitch: (away.y / distance).clamp(-1.0, 1.0).asin().clamp(-PITCH_MAX, PITCH_MAX),
            distance,
            yfov: camera.yfov,
        }
    }

    /// The camera.
    pub(super) fn camera(&self) -> Camera {
        let (sin_pitch, cos_pitch) = self.pitch.sin_cos();
        let away = Vec3::new(self.yaw.sin() * cos_pitch, sin_pitch, self.yaw.cos() * cos_pitch);
        let target = Vec3::from(self.target);
        look_at(target + self.distance * away, target, Vec3::Y, self.yfov)
    }

    /// Turns by a drag of so many points.
    pub(super) fn turn(&mut self, x: f32, y: f32) {
        // Half a degree a point, chosen by hand.
        self.yaw -= x * 0.0087;
        self.pitch = (self.pitch + y * 0.0087).clamp(-PITCH_MAX, PITCH_MAX);
    }

    /// Moves the target with the pointer, which moved by a share of the picture's height.
    pub(super) fn pan(&mut self, x: f32, y: f32) {
        let basis = Mat3::from(self.camera().transform.matrix3);
        let height = 2.0 * self.distance * (0.5 * self.yfov).tan();
        let target = Vec3::from(self.target) + height * (y * basis.y_axis - x * basis.x_axis);
        self.target = target.to_array();
    }

    /// Comes nearer by notches of a wheel; negative ones go away.
    pub(super) fn approach(&mut self, notches: f32) {
        self.distance = (self.distance * 0.9_f32.powf(notches)).clamp(1e-4, 1e6);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_comes_back_from_its_orbit() {
        let target = Vec3::new(0.3, -0.2, 0.1);
        for eye in [Vec3::new(1.0, 0.5, 2.0), Vec3::new(-3.0, -0.4, 0.2), Vec3::new(0.3, 0.0, -2.0)] {
            let camera = look_at(eye, target, Vec3::Y, 0.6);
            let back = Orbit::new(&camera, target).camera();
            let (want, got) = (camera.transform, back.transform);
            assert!(want.abs_diff_eq(got, 1e-5), "from {eye}: wanted {want}, got {got}");
        }
    }

    #[test]
    fn what_is_dragged_stays_under_the_pointer() {
        let mut orbit = Orbit::new(&look_at(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, Vec3::Y, 0.8), Vec3::ZERO);
        orbit.pan(0.25, 0.0);
        // A quarter of the picture's height at the target's distance, to the left.
        let want = -0.25 * 2.0 * 4.0 * 0.4_f32.tan();
        assert!((orbit.target[0] - want).abs() < 1e-5, "wanted {want}, got {}", orbit.target[0]);
    }

    #[test]
    fn turning_over_the_pole_stops_before_it() {
        let mut orbit = Orbit::new(&look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 0.8), Vec3::ZERO);
        orbit.turn(0.0, 1e4);
        assert!(
            orbit.camera().transform.is_finite() && orbit.pitch < std::f32::consts::FRAC_PI_2,
            "pitch {}",
            orbit.pitch
        );
    }
}
