//! Kinran, brocade of gold: seigaiha waves couched in gold thread on deep blue silk satin.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3, vec2};

use super::maps::Texel;
use super::noise::{random, signed};

/// Texels from one warp of the satin ground to the next, and how many warps it takes to repeat.
const WARP: f32 = 4.0;
const HARNESS: i32 = 8;

/// Texels of a wave's radius; a tile of 1024 texels has three waves side by side.
const RADIUS: f32 = 1024.0 / 6.0;

/// The wave's bands of gold, from and to in shares of its radius, and the threads in each. Chosen by eye, so
/// that a thread is about six texels wide.
const BANDS: [(f32, f32, f32); 3] = [(0.865, 1.0, 4.0), (0.625, 0.745, 3.0), (0.40, 0.475, 2.0)];

/// Half a chrysanthemum rises within this share of the radius, from one share to another.
const HEART: f32 = 0.40;
const PETAL: (f32, f32) = (0.085, 0.335);
const PETALS: f32 = 16.0;

/// Linear colours, chosen by eye: gold leaf, midnight blue, and safflower red for the waves' hearts.
const GOLD: Vec3 = Vec3::new(0.93, 0.60, 0.19);
const BLUE: Vec3 = Vec3::new(0.012, 0.029, 0.120);
const RED: Vec3 = Vec3::new(0.60, 0.034, 0.028);

/// Dyed silk shines in its own colour as a metal does. Being nearly one makes textures forgiving: where gold and
/// silk share a texel, glTF's base colour and metalness are averaged apart, and gold's colour times silk's lack
/// of metalness would become a diffuse ochre that neither has.
const SILK_METALLIC: f32 = 0.9;

/// Texels that gold lies above the satin.
const RAISED: f32 = 1.3;

/// Where a point lies in the wave that is in front there.
struct Wave {
    /// Number of the wave, for randomness.
    id: [i32; 2],
    /// From its middle, in texels.
    offset: Vec2,
    /// To the edge of the nearest wave in front of it, in texels.
    front: f32,
}

/// A tile of `size` texels. Below 1024 it holds one wave, drawn as much smaller as it needs to be.
pub(super) fn brocade(size: u32) -> impl Fn(Vec2) -> Texel {
    let side = size as f32;
    let across = (side / (2.0 * RADIUS)).round().max(1.0);
    let radius = side / (2.0 * across);
    let waves = across as i32;
    move |p| {
        let wave = wave(p, radius, waves);
        let rho = wave.offset.length() / radius;
        let ground = satin(p, if rho < HEART { RED } else { BLUE }, (side / WARP) as i32);
        let gold = band(&wave, rho, radius).or_else(|| petal(&wave, rho, radius));
        let texel = gold.unwrap_or_else(|| in_the_shadow_of_gold(ground, rho, radius));
        // The wave in front is stuffed a little and keeps light from the one behind it.
        let shade = 1.0 - 0.55 * libm::expf(-wave.front / (0.022 * radius));
        Texel { color: texel.color * shade, ..texel }
    }
}

/// Waves stand half a radius above each other, every other row shifted by one; the lowest that reaches a
/// point is in front.
fn wave(p: Vec2, radius: f32, waves: i32) -> Wave {
    let step = 0.5 * radius;
    let mut front = f32::INFINITY;
    let lowest = ((p.y - radius) / step).floor() as i32;
    for row in lowest.. {
        let shift = if row.rem_euclid(2) == 0 { 0.0 } else { radius };
        let column = ((p.x - shift) / (2.0 * radius)).round();
        let middle = vec2(column * 2.0 * radius + shift, row as f32 * step);
        let offset = p - middle;
        let outside = offset.length() - radius;
        if outside <= 0.0 {
            let id = [(column as i32).rem_euclid(waves), row.rem_euclid(4 * waves)];
            return Wave { id, offset, front };
        }
        front = front.min(outside);
    }
    unreachable!("every point lies in a wave of a row at most two radii above `lowest`")
}

/// Gold threads side by side along an arc.
fn band(wave: &Wave, rho: f32, radius: f32) -> Option<Texel> {
    let number = BANDS.iter().position(|&(from, to, _)| (from..to).contains(&rho))?;
    let (from, to, threads) = BANDS[number];
    let place = (rho - from) / (to - from) * threads;
    let out = wave.offset.normalize();
    // An angle that is zero at the top, so that its seam lies where other waves cover it.
    let angle = libm::atan2f(-wave.offset.x, wave.offset.y);
    let thread = place.floor() as i32 + 8 * number as i32;
    let along = angle * rho * radius;
    let across = 2.0 * (place - place.floor()) - 1.0;
    // The band swells towards its middle.
    let swell = 1.0 - (2.0 * place / threads - 1.0).powi(2);
    let seed = wave.id[0] * 64 + wave.id[1];
    Some(gold_thread(along, across, out.perp(), RAISED + 1.2 * swell, [thread, seed]))
}

/// Gold threads that rise in the petals of half a chrysanthemum.
fn petal(wave: &Wave, rho: f32, radius: f32) -> Option<Texel> {
    let turn = libm::atan2f(-wave.offset.x, wave.offset.y) / TAU * PETALS;
    let number = turn.round();
    let across = turn - number;
    let (from, to) = PETAL;
    // Petals widen outwards and end round.
    let round = to - 0.035 * (2.2 * across).powi(2);
    if !(from..round).contains(&rho) || across.abs() > 0.40 {
        return None;
    }
    const THREADS: f32 = 3.0;
    let place = (across / 0.80 + 0.5) * THREADS;
    let angle = number / PETALS * TAU;
    let axis = vec2(-libm::sinf(angle), libm::cosf(angle));
    let bulge = 1.0 - (across / 0.4).powi(2);
    let seed = wave.id[0] * 64 + wave.id[1];
    let id = [64 + 8 * number as i32 + place.floor() as i32, seed];
    Some(gold_thread(rho * radius, 2.0 * (place - place.floor()) - 1.0, axis, RAISED + 1.5 * bulge, id))
}

/// A silk core wound with gilt strip, held down by a stitch every few turns. `along` in texels, `across` from
/// -1 to 1, `axis` where `along` grows, `id` the thread.
fn gold_thread(along: f32, across: f32, axis: Vec2, lift: f32, id: [i32; 2]) -> Texel {
    // Stitches stand in brick bond; each float between two of them hangs a little differently.
    const FLOAT: f32 = 30.0;
    const STRIP: f32 = 5.0;
    let at = along / FLOAT + 0.5 * (id[0] & 1) as f32 + 0.12 * signed(id[0], id[1], 21);
    let float = at.floor();
    let within = 2.0 * (at - float) - 1.0;
    let sag = within.powi(6);
    let round = 1.0 - across * across;
    let turn = along / STRIP + 0.35 * across;
    let strip = turn.floor() as i32;
    let chance = |seed| signed(id[0] * 4096 + float as i32, id[1], seed);
    let glint = |seed| signed(id[0] * 4096 + strip, id[1], seed);
    let side = axis.perp();
    let polished = random(id[0] * 4096 + strip, id[1], 28);
    let tone = 1.0 + 0.10 * chance(22) + 0.07 * glint(23);
    let cavity = (0.80 + 0.20 * round) * (1.0 - 0.35 * sag);
    Texel {
        color: (GOLD * tone * cavity).min(Vec3::ONE),
        metallic: 1.0,
        alpha_along: 0.07 + 0.06 * polished,
        alpha_across: 0.22 + 0.10 * polished,
        direction: (axis + side * 0.10 * chance(24)).normalize(),
        height: lift + 0.85 * round - 0.7 * sag + 0.08 * libm::sinf(turn * TAU),
        slope: axis * (0.07 * chance(25) + 0.05 * glint(26)) + side * 0.07 * glint(27),
    }
}

/// Warp-faced eight-harness satin: every warp floats over seven wefts and dives under the eighth, three
/// further on in each next warp. The tile has `wefts` wefts and as many warps.
fn satin(p: Vec2, color: Vec3, wefts: i32) -> Texel {
    let q = p / WARP;
    let (i, j) = (q.x.floor() as i32, q.y.floor() as i32);
    let (dx, dy) = (q.x - q.x.floor() - 0.5, q.y - q.y.floor() - 0.5);
    let under = (j - 3 * i).rem_euclid(HARNESS);
    if under == 0 {
        // The weft that shows.
        let round = 1.0 - 4.0 * dy * dy;
        return Texel {
            color: color * (0.6 + 0.2 * round),
            metallic: SILK_METALLIC,
            alpha_along: 0.20,
            alpha_across: 0.40,
            direction: Vec2::X,
            height: 0.3 + 0.3 * round,
            slope: Vec2::ZERO,
        };
    }
    let from_dive = (under as f32 + dy).min(HARNESS as f32 - under as f32 - dy) - 0.5;
    let rise = (from_dive / 1.2).clamp(0.0, 1.0);
    let round = 1.0 - 4.0 * dx * dx;
    let tone = 1.0 + 0.16 * signed(i.rem_euclid(wefts), (j - 3 * i).rem_euclid(wefts) / HARNESS, 31);
    Texel {
        color: color * tone * (0.7 + 0.3 * rise) * (0.85 + 0.15 * round),
        metallic: SILK_METALLIC,
        alpha_along: 0.10,
        alpha_across: 0.30,
        direction: Vec2::Y,
        height: 0.3 + 0.5 * rise + 0.45 * round,
        slope: Vec2::ZERO,
    }
}

/// Satin beside raised gold gets less light.
fn in_the_shadow_of_gold(ground: Texel, rho: f32, radius: f32) -> Texel {
    let distance = |&(from, to, _): &(f32, f32, f32)| (rho - to).max(from - rho).max(0.0);
    let nearest = BANDS.iter().map(distance).fold(1.0, f32::min);
    let shade = 1.0 - 0.5 * libm::expf(-nearest * radius / 3.5);
    Texel { color: ground.color * shade, ..ground }
}
