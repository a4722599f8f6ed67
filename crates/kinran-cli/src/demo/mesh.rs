//! Meshes of the demo's scenes.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Mat3, Vec2, Vec3, Vec4, vec2, vec3};
use kinran_image::{Channels, Image, Pixels};
use kinran_shading::m_n;
use rayon::prelude::*;

use crate::Error;

/// Triangles with everything that a shader asks for. Arrays have the same length.
#[derive(Clone, Debug, Default)]
pub(super) struct Mesh {
    /// Metres.
    pub(super) positions: Vec<Vec3>,
    /// Unit length.
    pub(super) normals: Vec<Vec3>,
    /// Unit length along u, w = 1.
    pub(super) tangents: Vec<Vec4>,
    /// The material's tiles, v growing down.
    pub(super) uvs: Vec<Vec2>,
    /// The whole mesh once, for the occlusion map.
    pub(super) unique_uvs: Vec<Vec2>,
    /// Counter-clockwise seen from outside.
    pub(super) triangles: Vec<[u32; 3]>,
}

/// A cloth with folds.
///
/// Along its width a fold follows a curve whose angle against the ground is a sum of sines of arc length
/// (a meander; Langbein, Leopold. River meanders: theory of minimum variance. 1966), so that the pattern is
/// bent but never stretched across a fold.
pub(super) struct Drape {
    /// Metres across the folds, measured along the cloth.
    pub(super) width: f32,
    /// Metres along the folds.
    pub(super) length: f32,
    /// Metres of a tile of the material.
    pub(super) tile: f32,
    /// Vertices across and along.
    pub(super) grid: [usize; 2],
    /// Where the cloth lies: columns are across, along and up.
    pub(super) basis: Mat3,
}

/// Points of a cloth and how much sky they see.
pub(super) struct Draped {
    /// The cloth.
    pub(super) mesh: Mesh,
    /// Occlusion over [`Mesh::unique_uvs`].
    pub(super) occlusion: Image,
}

impl Drape {
    /// Folds the cloth; `angle(s, t)` is its angle in radians against the ground at `s` metres across from the
    /// middle and `t` metres along.
    ///
    /// # Errors
    /// [`Error::Image`] for a grid that no image can have.
    pub(super) fn fold(&self, angle: impl Fn(f32, f32) -> f32 + Sync) -> Result<Draped, Error> {
        let [columns, rows] = self.grid;
        let step = self.width / (columns - 1) as f32;
        let place = |i: usize, count: usize, size: f32| size * (i as f32 / (count - 1) as f32 - 0.5);
        let row = |j: usize| {
            let t = place(j, rows, self.length);
            let angle = |i: usize| angle(place(i, columns, self.width), t);
            profile(columns, step, angle)
        };
        let profiles: Vec<Vec<Vec2>> = (0..rows).into_par_iter().map(row).collect();
        let at = |i: usize, j: usize| profiles[j][i].extend(place(j, rows, self.length));
        let local = |i: usize, j: usize| {
            let p = at(i, j);
            vec3(p.x, p.z, p.y)
        };

        let mut mesh = Mesh::default();
        for j in 0..rows {
            for i in 0..columns {
                let across = local((i + 1).min(columns - 1), j) - local(i.saturating_sub(1), j);
                let along = local(i, (j + 1).min(rows - 1)) - local(i, j.saturating_sub(1));
                let normal = across.cross(along).normalize();
                let tangent = (across - normal * normal.dot(across)).normalize();
                let (s, t) = (place(i, columns, self.width), place(j, rows, self.length));
                mesh.positions.push(self.basis * local(i, j));
                mesh.normals.push(self.basis * normal);
                mesh.tangents.push((self.basis * tangent).extend(1.0));
                mesh.uvs.push(vec2(s, -t) / self.tile);
                mesh.unique_uvs
                    .push(vec2(i as f32 / (columns - 1) as f32, 1.0 - j as f32 / (rows - 1) as f32));
                if i > 0 && j > 0 {
                    let corner = |di: usize, dj: usize| ((j - dj) * columns + i - di) as u32;
                    mesh.triangles.push([corner(1, 1), corner(0, 1), corner(0, 0)]);
                    mesh.triangles.push([corner(1, 1), corner(0, 0), corner(1, 0)]);
                }
            }
        }

        // Every fourth vertex is enough for what changes as slowly as occlusion does.
        let coarse = |count: usize| (0..count).step_by(4);
        let top_down: Vec<usize> = coarse(rows).map(|j| rows - 1 - j).collect();
        let sky = top_down.par_iter().flat_map_iter(|&j| coarse(columns).map(move |i| (i, j)));
        let sky = sky.map(|(i, j)| (sky_seen(&profiles[j], i) * 255.0 + 0.5) as u8).collect();
        let size = [columns, rows].map(|count| coarse(count).count() as u32);
        let occlusion = Image::new(size[0], size[1], Channels::R, Pixels::U8(sky))?;
        Ok(Draped { mesh, occlusion })
    }
}

/// The curve with `angle` at each vertex, centred: x across, y up.
fn profile(count: usize, step: f32, angle: impl Fn(usize) -> f32) -> Vec<Vec2> {
    let mut p = Vec2::ZERO;
    let mut points = Vec::with_capacity(count);
    for i in 0..count {
        let angle = angle(i);
        let forward = step * vec2(libm::cosf(angle), libm::sinf(angle));
        points.push(p + 0.5 * forward);
        p += forward;
    }
    let middle = points.iter().sum::<Vec2>() / count as f32;
    points.iter().map(|p| p - middle).collect()
}

/// The cosine-weighted share of the sky that point `i` of a fold sees, the fold going on for ever: half the
/// difference of the sines, against the normal, of the horizons on both sides (Hottel's crossed strings).
fn sky_seen(profile: &[Vec2], i: usize) -> f32 {
    let before = profile[i.saturating_sub(1)];
    let after = profile[(i + 1).min(profile.len() - 1)];
    let tangent = (after - before).normalize();
    let sine = |p: &Vec2| {
        let d = (*p - profile[i]).normalize_or_zero();
        // What lies less than half a degree above the tangent plane is the neighbour's own roundness.
        (d.dot(tangent.perp()) > 0.01).then(|| d.dot(tangent))
    };
    let right = profile[i + 1..].iter().filter_map(sine).fold(1.0, f32::min);
    let left = profile[..i].iter().filter_map(sine).fold(-1.0, f32::max);
    (0.5 * (right - left)).clamp(0.0, 1.0)
}

/// A turned disc of radius `radius` in the plane y = 0: a hub, a groove around it, a rim with a bevel. All
/// proportions are chosen by eye. The material covers the square around it once.
pub(super) fn turned_disc(radius: f32) -> Mesh {
    const SECTORS: usize = 360;
    const TOP: f32 = 0.085;
    const EDGE: f32 = 0.045;
    let step = |from: f32, to: f32, r: f32| {
        let t = ((r - from) / (to - from)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    let height = |r: f32| {
        let hub = 0.05 * (1.0 - step(0.17, 0.215, r)) + 0.02 * (1.0 - (r / 0.2).powi(2)).max(0.0);
        let groove = -0.022 * step(0.60, 0.622, r) * (1.0 - step(0.648, 0.67, r));
        let rim = 0.030 * step(0.80, 0.845, r);
        TOP + hub + groove + rim
    };
    // The outline: the top, a quarter round, the side.
    let top = (0..=240).map(|i| i as f32 / 240.0 * (1.0 - EDGE)).map(|r| vec2(r, height(r)));
    let round = (1..=12).map(|i| {
        let (sin, cos) = libm::sincosf(i as f32 / 12.0 * FRAC_PI_2);
        vec2(1.0 - EDGE + EDGE * sin, height(1.0) - EDGE + EDGE * cos)
    });
    let outline: Vec<Vec2> = top.chain(round).chain([vec2(1.0, 0.0)]).collect();

    let mut mesh = Mesh::default();
    for (ring, &p) in outline.iter().enumerate() {
        let before = outline[ring.saturating_sub(1)];
        let after = outline[(ring + 1).min(outline.len() - 1)];
        let out = if ring == 0 { Vec2::Y } else { (after - before).perp().normalize() };
        for sector in 0..=SECTORS {
            let (sin, cos) = libm::sincosf(sector as f32 / SECTORS as f32 * TAU);
            let around = |v: Vec2| vec3(v.x * cos, v.x * sin, v.y);
            // Tilting about the groove's own direction keeps it where the map says, however steep the side.
            let normal = around(out).normalize();
            let tangent = m_n(normal).x_axis;
            let uv = 0.5 + 0.5 * vec2(p.x * cos, -p.x * sin);
            mesh.push(around(p) * radius, normal, tangent, uv);
            if ring > 0 && sector > 0 {
                let corner = |dr: usize, ds: usize| ((ring - dr) * (SECTORS + 1) + sector - ds) as u32;
                mesh.triangles.push([corner(1, 1), corner(0, 1), corner(0, 0)]);
                mesh.triangles.push([corner(1, 1), corner(0, 0), corner(1, 0)]);
            }
        }
    }
    mesh
}

/// A square floor of half side `half` in the plane y = 0.
pub(super) fn floor(half: f32) -> Mesh {
    let mut mesh = Mesh::default();
    for corner in [vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(1.0, 1.0), vec2(0.0, 1.0)] {
        let p = (2.0 * corner - 1.0) * half;
        mesh.push(p.extend(0.0), Vec3::Z, Vec3::X, vec2(corner.x, 1.0 - corner.y));
    }
    mesh.triangles = vec![[0, 1, 2], [0, 2, 3]];
    mesh
}

impl Mesh {
    /// A vertex given with z up, stored with y up.
    fn push(&mut self, position: Vec3, normal: Vec3, tangent: Vec3, uv: Vec2) {
        let stood = |v: Vec3| vec3(v.x, v.z, -v.y);
        self.positions.push(stood(position));
        self.normals.push(stood(normal));
        self.tangents.push(stood(tangent).extend(1.0));
        self.uvs.push(uv);
        self.unique_uvs.push(uv);
    }

    /// The corners of the box around it.
    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        let all = self.positions.iter().copied();
        let nothing = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        all.fold(nothing, |(min, max), p| (min.min(p), max.max(p)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(name: &str, mesh: &Mesh) {
        for [a, b, c] in &mesh.triangles {
            let [a, b, c] = [a, b, c].map(|&i| i as usize);
            let face = (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
            // The disc's innermost triangles have no area.
            if face.length() < 1e-12 {
                continue;
            }
            let agree = face.normalize().dot(mesh.normals[a]);
            assert!(agree > 0.5, "{name}: triangle {a} {b} {c} turns the wrong way, cosine {agree}");

            // Moving along the tangent, u grows; along the bitangent, v falls.
            let (e1, e2) = (mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
            let (d1, d2) = (mesh.uvs[b] - mesh.uvs[a], mesh.uvs[c] - mesh.uvs[a]);
            let det = d1.perp_dot(d2);
            if det.abs() < 1e-12 {
                continue;
            }
            let u_axis = (e1 * d2.y - e2 * d1.y) / det;
            let v_axis = (e2 * d1.x - e1 * d2.x) / det;
            let tangent = mesh.tangents[a].truncate();
            let bitangent = mesh.normals[a].cross(tangent);
            assert!(u_axis.dot(tangent) > 0.0, "{name}: tangent {tangent} against u {u_axis}");
            assert!(v_axis.dot(bitangent) < 0.0, "{name}: bitangent {bitangent} along v {v_axis}");
        }
        for (n, t) in mesh.normals.iter().zip(&mesh.tangents) {
            let t = t.truncate();
            let right = (n.length() - 1.0).abs() + (t.length() - 1.0).abs() + n.dot(t).abs();
            assert!(right < 1e-4, "{name}: normal {n} and tangent {t} are no frame");
        }
    }

    #[test]
    fn triangles_face_outwards_and_tangents_follow_the_map() {
        let drape = Drape {
            width: 1.0,
            length: 1.0,
            tile: 0.3,
            grid: [65, 33],
            basis: Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y),
        };
        let folded = drape.fold(|s, t| 0.7 * libm::sinf(9.0 * s + 2.0 * t)).unwrap();
        check("cloth", &folded.mesh);
        check("floor", &floor(2.0));
    }

    #[test]
    fn the_disc_faces_outwards() {
        let disc = turned_disc(0.1);
        for [a, b, c] in &disc.triangles {
            let [a, b, c] = [a, b, c].map(|&i| i as usize);
            let face = (disc.positions[b] - disc.positions[a]).cross(disc.positions[c] - disc.positions[a]);
            assert!(face.dot(disc.normals[b]) >= -1e-12, "triangle {a} {b} {c} looks inwards");
        }
    }

    #[test]
    fn flat_cloth_sees_all_the_sky_and_the_bottom_of_a_half_pipe_seven_tenths() {
        let flat: Vec<Vec2> = (0..101).map(|i| vec2(i as f32, 0.0)).collect();
        assert_eq!(sky_seen(&flat, 50), 1.0);
        // From the bottom of a half circle both horizons stand at 45 degrees: sin 45 = 0.7071.
        let pipe: Vec<Vec2> = (0..=2000)
            .map(|i| libm::sincosf(std::f32::consts::PI * (1.0 + i as f32 / 2000.0)))
            .map(|(sin, cos)| vec2(cos, sin))
            .collect();
        let got = sky_seen(&pipe, 1000);
        assert!((got - std::f32::consts::FRAC_1_SQRT_2).abs() < 0.01, "{got}");
    }
}
