//! A 2/2 twill of shot silk: teal warp, copper weft.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Vec2, Vec3, vec2};

use super::maps::Texel;
use super::noise::{noise, signed};

/// Texels from one yarn to the next.
const PITCH: u32 = 16;

/// One system of yarns. All chosen by eye; the alphas lie between the talk's satin (.04 by .29) and its
/// coarse fabric (.3 by .6).
struct Yarn {
    color: Vec3,
    metallic: f32,
    alpha_along: f32,
    alpha_across: f32,
    /// Slope of the twisted filaments against the yarn's axis; a multiple of 1/16, so that 16 yarns repeat.
    twist: f32,
    seed: u32,
}

const WARP: Yarn = Yarn {
    color: Vec3::new(0.012, 0.190, 0.235),
    metallic: 0.65,
    alpha_along: 0.11,
    alpha_across: 0.34,
    twist: 0.25,
    seed: 11,
};
const WEFT: Yarn = Yarn {
    color: Vec3::new(0.62, 0.135, 0.045),
    metallic: 0.65,
    alpha_along: 0.16,
    alpha_across: 0.42,
    twist: -0.3125,
    seed: 12,
};

/// How far a yarn swings up and down between crossings, and its thickness, in texels.
const SWING: f32 = 2.1;
const THICKNESS: f32 = 2.6;

/// Filaments side by side in a yarn.
const FILAMENTS: i32 = 7;

/// The share of the pitch that a yarn covers.
const COVER: f32 = 0.97;

/// A tile of `size` texels, a multiple of four yarns.
pub(super) fn twill(size: u32) -> impl Fn(Vec2) -> Texel {
    let yarns = (size / PITCH) as i32;
    move |p| {
        let q = p / PITCH as f32;
        let (i, j) = (q.x.floor(), q.y.floor());
        let (dx, dy) = (q.x - i - 0.5, q.y - j - 0.5);
        // Warp i runs over weft j where i + j is 0 or 1 modulo 4; both follow the same wave.
        let warp_height = SWING * libm::cosf(FRAC_PI_2 * (q.y + i - 1.0));
        let weft_height = -SWING * libm::cosf(FRAC_PI_2 * (q.x + j - 1.0));
        let warp = yarn(&WARP, i as i32, vec2(q.y, dx), warp_height, yarns);
        let weft = yarn(&WEFT, j as i32, vec2(q.x, dy), weft_height, yarns);
        match (warp, weft) {
            (Some(warp), weft) if weft.is_none_or(|w| warp.height >= w.height) => {
                // Along is +y, across is +x.
                Texel { direction: vec2(warp.direction.y, warp.direction.x), ..warp }
            }
            (_, Some(weft)) => weft,
            (_, None) => Texel {
                color: 0.05 * WARP.color,
                metallic: 0.0,
                alpha_along: 0.5,
                alpha_across: 0.5,
                direction: Vec2::X,
                height: -SWING - THICKNESS,
                slope: Vec2::ZERO,
            },
        }
    }
}

/// Yarn number `index` at `at`: along it in pitches, across it from its axis in shares of the pitch. The
/// direction comes out as (along, across). `None` beside the yarn.
fn yarn(yarn: &Yarn, index: i32, at: Vec2, height: f32, yarns: i32) -> Option<Texel> {
    let index = index.rem_euclid(yarns);
    let across = 2.0 * at.y / COVER;
    let round = 1.0 - across * across;
    if across.abs() >= 1.0 {
        return None;
    }
    // Filaments: lines along the yarn that its twist leans over.
    let lean = at.y - yarn.twist * at.x;
    let filament = (lean * FILAMENTS as f32).floor();
    let ridge = libm::sinf(lean * FILAMENTS as f32 * TAU);
    let uneven = noise(vec2(at.x * 0.5, index as f32), [yarns / 2, yarns], yarn.seed);
    let strand = signed(index, (filament as i32).rem_euclid(FILAMENTS), yarn.seed + 2);
    let depth = height / SWING;
    // Light hardly reaches where a yarn dives under the next or turns away to its side.
    let cavity = (0.75 + 0.25 * depth) * (0.65 + 0.35 * round);
    let shade = cavity * (1.0 + 0.14 * signed(index, 0, yarn.seed + 1) + 0.10 * uneven + 0.06 * strand);
    Some(Texel {
        color: yarn.color * shade,
        metallic: yarn.metallic,
        alpha_along: yarn.alpha_along * (1.0 + 0.25 * uneven),
        alpha_across: yarn.alpha_across * (1.0 + 0.15 * uneven),
        direction: vec2(1.0, yarn.twist).normalize(),
        height: height + THICKNESS * round + 0.16 * ridge * round,
        slope: Vec2::ZERO,
    })
}
