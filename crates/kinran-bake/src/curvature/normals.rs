//! Normals of points.

use super::quadric::quadric_normals;
use super::surface::{Fans, Welded};
use glam::Vec3;
use kinran_image::{Cancelled, Tick};

/// Normals of a mesh that has none: of the surfaces that [`quadric_normals`] fits over [`max_normals`]. Zero where no
/// triangle says anything. `tick` is told of so many `units`.
pub(crate) fn estimated_normals(
    surface: &Welded,
    fans: &Fans,
    units: u64,
    tick: &Tick<'_>,
) -> Result<Vec<Vec3>, Cancelled> {
    quadric_normals(surface, fans, &max_normals(surface), units, tick)
}

/// Normals from the triangles around each point (Max. Weights for Computing Vertex Normals from Facet Normals. Journal of
/// Graphics Tools 4(2), 1999): cross products of the edges at a corner over both squared lengths. Exact where the
/// points lie on a sphere, and several times better than area or angle weights on irregular meshes, but on these their
/// error only halves with the distance between points, and curvature's then stays the same. Zero where no triangle says
/// anything.
fn max_normals(surface: &Welded) -> Vec<Vec3> {
    let p = &surface.positions;
    let mut normals = vec![Vec3::ZERO; p.len()];
    for &[a, b, c] in &surface.triangles {
        let [pa, pb, pc] = [a, b, c].map(|i| p[i as usize].as_dvec3());
        let (ab, bc, ca) = (pb - pa, pc - pb, pa - pc);
        let cross = ab.cross(-ca);
        let (l_ab, l_bc, l_ca) = (ab.length_squared(), bc.length_squared(), ca.length_squared());
        if cross.length_squared() == 0.0 || l_ab == 0.0 || l_bc == 0.0 || l_ca == 0.0 {
            continue;
        }
        for (point, first, second) in [(a, l_ab, l_ca), (b, l_bc, l_ab), (c, l_ca, l_bc)] {
            normals[point as usize] += (cross / (first * second)).as_vec3();
        }
    }
    for normal in &mut normals {
        *normal = normal.as_dvec3().normalize_or_zero().as_vec3();
    }
    normals
}

/// The artist's normals of all vertices of a point, averaged; from the triangles where they cancel out. Also the number of
/// points whose vertices' normals are more than a degree apart.
pub(crate) fn authored_normals(surface: &Welded, normals: &[Vec3]) -> (Vec<Vec3>, usize) {
    let mut sums = vec![Vec3::ZERO; surface.positions.len()];
    let mut counts = vec![0u32; surface.positions.len()];
    for (&point, &normal) in surface.point_of.iter().zip(normals) {
        sums[point as usize] += normal;
        counts[point as usize] += 1;
    }
    // Two unit vectors a degree apart have a mean of length cos 0.5°.
    let hard = (sums.iter().zip(&counts))
        .filter(|(sum, count)| **count > 1 && sum.length() < 0.999_962 * **count as f32)
        .count();
    let mut fallback = None;
    let means: Vec<Vec3> = (sums.iter().enumerate())
        .map(|(i, sum)| {
            if sum.length_squared() > 1e-6 {
                return sum.normalize();
            }
            fallback.get_or_insert_with(|| max_normals(surface))[i]
        })
        .collect();
    (means, hard)
}
