//! Three scenes, each with one material: shape, light and viewpoint, all chosen by eye.

use std::f32::consts::TAU;
use std::path::Path;

use glam::{Mat3, Vec3, vec3};

use super::glb::{Cover, Part, PointLight, Viewpoint, write_glb};
use super::maps::{Maps, paint};
use super::mesh::{Drape, floor, turned_disc};
use super::{brocade, brushed_disc, twill};
use crate::Error;

/// One of the demo's materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Subject {
    BrushedDisc,
    Twill,
    Brocade,
}

/// A point light at a place in metres, of a colour and an intensity in candela.
fn light(position: [f32; 3], color: [f32; 3], intensity: f32) -> PointLight {
    PointLight { position: position.into(), color: color.into(), intensity }
}

impl Subject {
    pub(super) const ALL: [Subject; 3] = [Subject::Brocade, Subject::Twill, Subject::BrushedDisc];

    /// As files are called.
    pub(super) fn name(self) -> &'static str {
        match self {
            Subject::BrushedDisc => "brushed_disc",
            Subject::Twill => "twill",
            Subject::Brocade => "brocade",
        }
    }

    /// As people call it.
    pub(super) fn title(self) -> &'static str {
        match self {
            Subject::BrushedDisc => "Spun steel",
            Subject::Twill => "Shot silk twill",
            Subject::Brocade => "Kinran brocade",
        }
    }

    /// What there is to see.
    pub(super) fn description(self) -> &'static str {
        match self {
            Subject::BrushedDisc => {
                "A turned disc. Every groove runs around the middle, so that each lamp becomes a ray of light \
                 that points at it."
            }
            Subject::Twill => {
                "Two over, two under: a teal warp and a copper weft. Each shines across its own thread, so the \
                 colour of the cloth turns with its folds."
            }
            Subject::Brocade => {
                "Seigaiha waves in gold thread on blue satin. The gold follows the waves, the satin its warp; \
                 from afar they must still glitter as they do nearby."
            }
        }
    }

    /// The material's maps.
    ///
    /// # Errors
    /// [`Error::Image`] for a size that no image can have.
    pub(super) fn maps(self, size: u32) -> Result<Maps, Error> {
        match self {
            Subject::BrushedDisc => paint(size, brushed_disc::brushed_disc(size)),
            Subject::Twill => paint(size, twill::twill(size)),
            Subject::Brocade => paint(size, brocade::brocade(size)),
        }
    }

    /// Writes the scene as a `.glb`; `detail` scales the number of vertices along each side of a cloth.
    ///
    /// # Errors
    /// [`Error::Image`] where the file cannot be written.
    pub(super) fn write(self, path: &Path, maps: &Maps, detail: f32) -> Result<(), Error> {
        let grid = |columns: f32, rows: f32| [columns, rows].map(|n| (n * detail) as usize);
        match self {
            Subject::BrushedDisc => {
                let (disc, floor) = (turned_disc(0.1), floor(3.0));
                let parts = [
                    Part { name: self.name(), mesh: &disc, cover: Cover::Maps(maps, None) },
                    Part { name: "floor", mesh: &floor, cover: Cover::Plain(Vec3::splat(0.012), 0.75) },
                ];
                let lights = [
                    light([-0.22, 0.42, -0.20], [1.0, 0.93, 0.84], 0.80),
                    light([0.40, 0.25, 0.15], [0.75, 0.87, 1.0], 0.28),
                    light([0.12, 0.28, -0.42], [1.0, 0.97, 0.92], 0.30),
                ];
                let middle = vec3(0.0, 0.5 * disc.bounds().1.y, 0.0);
                let eye = middle + vec3(0.02, 0.235, 0.30);
                write_glb(path, &parts, &lights, Viewpoint { eye, target: middle, yfov: 0.42 })
            }
            Subject::Twill => {
                let drape = Drape {
                    width: 0.62,
                    length: 0.40,
                    tile: 0.085,
                    grid: grid(480.0, 160.0),
                    basis: Mat3::IDENTITY,
                };
                let draped = drape.fold(|s, t| {
                    let open = 0.88 + 0.9 * t;
                    let a = libm::sinf(TAU * (s / 0.085 + 0.10 * libm::sinf(TAU * t / 0.5)));
                    let b = libm::sinf(TAU * (s / 0.137 + 0.9 * t + 0.3));
                    let c = libm::sinf(TAU * (s / 0.047 - 1.3 * t + 0.6));
                    open * (0.95 * a + 0.45 * b + 0.22 * c)
                })?;
                let cover = Cover::Maps(maps, Some(&draped.occlusion));
                let parts = [Part { name: self.name(), mesh: &draped.mesh, cover }];
                let lights = [
                    light([-0.35, 0.30, 0.40], [1.0, 0.95, 0.88], 1.5),
                    light([0.45, -0.05, 0.25], [0.8, 0.9, 1.0], 0.36),
                    light([0.10, 0.50, 0.15], [1.0, 0.96, 0.92], 0.25),
                ];
                let (min, max) = draped.mesh.bounds();
                let middle = 0.5 * (min + max);
                let eye = middle + vec3(0.10, 0.08, 0.42);
                write_glb(path, &parts, &lights, Viewpoint { eye, target: middle, yfov: 0.45 })
            }
            Subject::Brocade => {
                let drape = Drape {
                    width: 0.66,
                    length: 0.60,
                    tile: 0.135,
                    grid: grid(480.0, 240.0),
                    basis: Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y),
                };
                let draped = drape.fold(|s, t| {
                    // Folds run to the upper right and grow out of a nearly flat corner.
                    let across = s - 0.55 * t;
                    let grown = 0.5 + 0.5 * libm::tanhf((across + 0.25 * t + 0.02) / 0.07);
                    let a = libm::sinf(TAU * (across / 0.105 + 0.08 * libm::sinf(TAU * t / 0.35)));
                    let b = libm::sinf(TAU * (across / 0.171 + 0.6 * t + 0.2));
                    (0.62 + 0.38 * grown) * (0.70 * a + 0.34 * b)
                })?;
                let cover = Cover::Maps(maps, Some(&draped.occlusion));
                let parts = [Part { name: self.name(), mesh: &draped.mesh, cover }];
                let lights = [
                    light([-0.45, 0.48, -0.33], [1.0, 0.92, 0.80], 2.1),
                    light([0.30, 0.30, -0.30], [0.86, 0.92, 1.0], 0.26),
                    light([0.08, 0.45, 0.35], [1.0, 0.95, 0.88], 0.24),
                ];
                let (min, max) = draped.mesh.bounds();
                let middle = 0.5 * (min + max);
                let eye = middle + vec3(0.0, 0.165, 0.165);
                write_glb(path, &parts, &lights, Viewpoint { eye, target: middle, yfov: 0.46 })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::maps::Texel;
    use glam::{Vec2, vec2};

    /// The share of texels of a tile of `size` that look different one tile further on.
    fn seam(size: u32, material: impl Fn(Vec2) -> Texel) -> f32 {
        let side = size as f32;
        let places =
            (0..size).flat_map(|y| (0..size).step_by(7).map(move |x| vec2(x as f32, y as f32) + 0.5));
        let (mut different, mut all) = (0, 0);
        for p in places {
            let here = material(p);
            for shift in [vec2(side, 0.0), vec2(0.0, -side)] {
                let there = material(p + shift);
                let same = (here.height - there.height).abs() < 0.05
                    && (here.color - there.color).abs().max_element() < 0.02
                    && here.direction.perp_dot(there.direction).abs() < 0.05;
                different += u32::from(!same);
                all += 1;
            }
        }
        different as f32 / all as f32
    }

    /// Where a thread ends, rounding may decide differently: one texel in two hundred.
    #[test]
    fn cloths_tile_without_a_seam() {
        for size in [256, 1024] {
            for (name, seam) in
                [("twill", seam(size, twill::twill(size))), ("brocade", seam(size, brocade::brocade(size)))]
            {
                assert!(seam < 0.005, "{name} of {size} texels: {seam} of its texels do not repeat");
            }
        }
    }
}
