//! Spun metal: grooves around the middle.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3, vec2};

use super::maps::Texel;
use super::noise::noise;

/// A square of `size` texels with the disc's middle in its own.
///
/// Numbers are chosen by eye: alphas of polished steel, most of whose width across comes from grooves five
/// texels wide that are broken a few dozen times in a turn, and that are shallow in the middle, where a lathe
/// hardly cuts.
pub(super) fn brushed_disc(size: u32) -> impl Fn(Vec2) -> Texel {
    const STEEL: Vec3 = Vec3::new(0.60, 0.575, 0.545);
    move |p| {
        let offset = p - 0.5 * size as f32;
        let radius = offset.length();
        let turn = libm::atan2f(offset.y, offset.x) / TAU + 0.5;
        // Noise over (radius, angle) that closes after a turn; rings never meet each other again.
        let rings = |width: f32, breaks: i32, seed| {
            noise(vec2(radius / width, turn * breaks as f32), [1 << 20, breaks], seed)
        };
        let (fine, broad, slow) = (rings(2.6, 40, 1), rings(8.0, 22, 2), rings(38.0, 6, 3));
        let scratch = (rings(2.2, 64, 4) - 0.72).max(0.0);
        let depth = (radius / (0.12 * size as f32)).min(1.0);
        Texel {
            color: STEEL * (1.0 + 0.05 * broad + 0.04 * slow),
            metallic: 1.0,
            alpha_along: 0.06 + 0.018 * broad + 0.012 * slow,
            alpha_across: 0.13 + 0.02 * slow,
            direction: offset.perp().normalize_or(Vec2::X),
            height: depth * (0.36 * fine + 0.24 * broad - 0.7 * scratch),
            slope: Vec2::ZERO,
        }
    }
}
