//! Filters whose whole knowledge of a footprint is nine averages: `linear`, `lean` and `naive`.
//!
//! The averages of a level are averages of the level before, so every level is a filter of level 0 alone and
//! nothing is ever fitted twice.

use glam::{Vec3, vec2, vec3};
use kinran_shading::{
    LeanMoments, Sym2, Sym3, aniso_decode_matrix, aniso_encode, sggx_from_slopes, sggx_principal_axis,
    slopes_from_sggx,
};

use crate::mips::TILE;

/// Averages kept for a texel.
pub(crate) const MOMENTS: usize = 9;

/// Averages of the texels of a tile, one array each.
pub(crate) type Averages<'a> = [&'a [f32; TILE]; MOMENTS];

/// Normals and squared roughness `[nx, ny, nz, axx, axy, ayy]` of the texels of a tile.
pub(crate) type TexelTile = [[f32; TILE]; 6];

/// A filter by averages.
pub(crate) trait MomentFilter: Sync {
    /// What is averaged.
    fn moments(n: Vec3, a: Sym2) -> [f32; MOMENTS];
    /// The surfaces that the averages stand for; eigenvalues may exceed one.
    fn surfaces(averages: Averages, texels: &mut TexelTile);
}

/// Surfaces of filtered SGGX matrices and mean normals, see [`sggx_normals`] and [`sggx_roughness`].
#[inline(always)]
fn sggx_surfaces(matrices: [&[f32; TILE]; 6], mean: [&[f32; TILE]; 3], texels: &mut TexelTile) {
    let [nx, ny, nz, axx, axy, ayy] = texels;
    sggx_normals(matrices, mean, [nx, ny, nz]);
    sggx_roughness(matrices, [nx, ny, nz], [axx, axy, ayy]);
}

/// Smallest z of a mean normal. Opposite normals on the horizon leave nothing but rounding, which is z here.
const MIN_MEAN_Z: f32 = 1e-6;

/// First half of [`ggx_from_sggx_unclamped`](kinran_shading::ggx_from_sggx_unclamped) for many matrices
/// `[xx, xy, xz, yy, yz, zz]`: the filtered normals, from mean normals of any length.
///
/// The halves are loops of their own, because both are long chains of divisions and roots: a processor that
/// looks a few hundred instructions ahead works on the next texels only if a texel takes no more of them.
#[inline(always)]
pub(crate) fn sggx_normals<const N: usize>(
    [xx, xy, xz, yy, yz, zz]: [&[f32; N]; 6],
    [mean_x, mean_y, mean_z]: [&[f32; N]; 3],
    [nx, ny, nz]: [&mut [f32; N]; 3],
) {
    let matrix = |i: usize| Sym3 { xx: xx[i], xy: xy[i], xz: xz[i], yy: yy[i], yz: yz[i], zz: zz[i] };
    let mean = |i: usize| vec3(mean_x[i], mean_y[i], mean_z[i].max(MIN_MEAN_Z));
    let mut sure = [0_u32; N];
    let mut all_sure = 1;
    for i in 0..N {
        let (n, is_sure) = nearby_axis(matrix(i), mean(i));
        let n = n * 1.0_f32.copysign(n.z);
        (nx[i], ny[i], nz[i]) = (n.x, n.y, n.z);
        sure[i] = u32::from(is_sure);
        all_sure &= sure[i];
    }
    if all_sure != 0 {
        return;
    }
    for i in (0..N).filter(|i| sure[*i] == 0) {
        let n = sggx_principal_axis(matrix(i), mean(i).normalize());
        (nx[i], ny[i], nz[i]) = (n * 1.0_f32.copysign(n.z)).into();
    }
}

/// [`sggx_principal_axis`] where the axis is near the mean normal, as it is in all but steep grooves, and whether this
/// is such a case: two steps of Rayleigh quotient iteration, which cubes the error each time, with a third of its
/// divisions and roots. Steps are of any length; the sign is that of `mean`.
#[inline(always)]
fn nearby_axis(s: Sym3, mean: Vec3) -> (Vec3, bool) {
    /// Squared sine between both steps, above which the second one may be off by more than the cube of 3e-3.
    const MOVED: f32 = 1e-5;
    /// Product of the distances to the other eigenvalues, as a share of their squared sum, below which two eigenvalues
    /// are one to [`sggx_principal_axis`].
    const COINCIDENT: f32 = 1e-3;
    /// The same as a share of the squared trace, below which rounding moves the axis of a round lobe by more than 3e-5:
    /// from alpha 0.995 on.
    const ROUND: f32 = 1e-5;

    let step = |n: Vec3| {
        let mu = n.dot(s.mul_vec3(n)) / n.length_squared();
        (Sym3 { xx: s.xx - mu, yy: s.yy - mu, zz: s.zz - mu, ..s }.adjugate().mul_vec3(n), mu)
    };
    let (first, _) = step(s.mul_vec3(mean));
    let (second, mu) = step(first);
    let (length_1, length_2) = (first.length_squared(), second.length_squared());
    let n = second * length_2.sqrt().recip();
    let (overlap, agreement) = (n.dot(mean), n.dot(first));
    let (trace, distances) = (s.trace(), 3.0 * mu - s.trace());
    let least = (COINCIDENT * distances * distances).max(ROUND * trace * trace);
    // More than half of the mean normal's square: no other axis can have as much.
    let is_sure = (overlap * overlap > 0.5 * mean.length_squared())
        & (agreement * agreement > (1.0 - MOVED) * length_1)
        & (length_2 > least * least * length_1);
    (n * 1.0_f32.copysign(overlap), is_sure)
}

/// Second half: squared roughness `[xx, xy, yy]` of matrices with known normals `n`, z ≥ 0; eigenvalues may exceed
/// one.
#[inline(always)]
pub(crate) fn sggx_roughness<const N: usize>(
    [xx, xy, xz, yy, yz, zz]: [&[f32; N]; 6],
    [nx, ny, nz]: [&[f32; N]; 3],
    [axx, axy, ayy]: [&mut [f32; N]; 3],
) {
    // M_n^T S M_n with M_n as in `sggx_of_texel`: with S = [B b; b^T c] it is B - p r^T - r p^T + e p p^T.
    for i in 0..N {
        let (px, py, z) = (nx[i], ny[i], nz[i]);
        let k = (1.0 + z).recip();
        let (qx, qy) = (xx[i] * px + xy[i] * py, xy[i] * px + yy[i] * py);
        let (g, p_b) = (px * qx + py * qy, px * xz[i] + py * yz[i]);
        let (rx, ry) = (k * qx + xz[i], k * qy + yz[i]);
        let e = k * (k * g + (p_b + p_b)) + zz[i];
        let (ex, ey) = (e * px - rx, e * py - ry);
        let area = g + z * ((p_b + p_b) + z * zz[i]);
        let inv = area.max(f32::MIN_POSITIVE).recip();
        axx[i] = (xx[i] + px * (ex - rx)) * inv;
        axy[i] = (xy[i] + (px * ey - py * rx)) * inv;
        ayy[i] = (yy[i] + py * (ey - ry)) * inv;
    }
}

/// [`sggx_from_ggx`](kinran_shading::sggx_from_ggx) for normals with z ≥ 0, in two thirds of the operations: with
/// `p = n.xy` and `k = 1 / (1 + n.z)`, the first two columns of [`m_n`](kinran_shading::m_n) are `I - k p p^T` over
/// `-p^T`.
#[inline(always)]
fn sggx_of_texel(n: Vec3, a: Sym2) -> Sym3 {
    let k = (1.0 + n.z).recip();
    let (vx, vy) = (a.xx * n.x + a.xy * n.y, a.xy * n.x + a.yy * n.y);
    let g = n.x * vx + n.y * vy;
    let (qx, qy, h) = (k * vx, k * vy, k * g);
    let c = 1.0 + k * h;
    let (cx, cy) = (c * n.x - qx, c * n.y - qy);
    Sym3 {
        xx: a.xx + n.x * (cx - qx),
        xy: a.xy + (n.x * cy - n.y * qx),
        xz: n.x * (h + n.z) - vx,
        yy: a.yy + n.y * (cy - qy),
        yz: n.y * (h + n.z) - vy,
        zz: g + n.z * n.z,
    }
}

/// The talk's filter: SGGX matrices are averaged (slide: Our Algorithm, step 2).
pub(crate) struct LinearFilter;

impl MomentFilter for LinearFilter {
    #[inline(always)]
    fn moments(n: Vec3, a: Sym2) -> [f32; MOMENTS] {
        let s = sggx_of_texel(n, a);
        [s.xx, s.xy, s.xz, s.yy, s.yz, s.zz, n.x, n.y, n.z]
    }

    #[inline(always)]
    fn surfaces([xx, xy, xz, yy, yz, zz, x, y, z]: Averages, texels: &mut TexelTile) {
        sggx_surfaces([xx, xy, xz, yy, yz, zz], [x, y, z], texels);
    }
}

/// The direction of a mean normal.
#[inline(always)]
fn unit(x: f32, y: f32, z: f32) -> Vec3 {
    let z = z.max(MIN_MEAN_Z);
    vec3(x, y, z) * (x * x + y * y + z * z).sqrt().recip()
}

/// LEAN mapping (Olano and Baker 2010) with `sigma = alpha / sqrt(2)` in and out.
///
/// Olano and Baker add the base roughness to the slopes' second moment as it is; that is biased on tilted
/// texels (relative L2 error of the distribution 0.04 to 0.17 on tilted constant footprints). Here a texel's
/// slope and roughness are those of its ellipsoid seen from the mesh normal, so a constant footprint comes
/// out as it went in. The sixth average is unused.
pub(crate) struct LeanFilter;

/// Smallest S_zz a slope is computed at: a slope of 100, 0.6° from the horizon. Chosen by eye; LEAN has no
/// answer there, and without a limit one texel on the horizon outweighs its whole level.
const LEAN_MIN_ZZ: f32 = 1e-4;

impl MomentFilter for LeanFilter {
    #[inline(always)]
    fn moments(n: Vec3, a: Sym2) -> [f32; MOMENTS] {
        let mut s = sggx_of_texel(n, a);
        s.zz = s.zz.max(LEAN_MIN_ZZ);
        let (mean, a) = slopes_from_sggx(s);
        let m = LeanMoments::from_gaussian(mean, a * 0.5);
        [m.mean.x, m.mean.y, m.second.xx, m.second.xy, m.second.yy, 0.0, n.x, n.y, n.z]
    }

    #[inline(always)]
    fn surfaces([mx, my, xx, xy, yy, _, x, y, z]: Averages, texels: &mut TexelTile) {
        let mut matrices = [[0.0; TILE]; 6];
        for i in 0..TILE {
            let second = Sym2 { xx: xx[i], xy: xy[i], yy: yy[i] };
            let moments = LeanMoments { mean: vec2(mx[i], my[i]), second };
            let s = sggx_from_slopes(moments.mean, moments.covariance() * 2.0);
            for (plane, v) in matrices.iter_mut().zip([s.xx, s.xy, s.xz, s.yy, s.yz, s.zz]) {
                plane[i] = v;
            }
        }
        sggx_surfaces(matrices.each_ref(), [x, y, z], texels);
    }
}

/// What a mip generator makes of the maps: normals averaged and renormalised, perceptual roughness along
/// both axes of the frame and the aniso map's correlation averaged like colours.
pub(crate) struct NaiveFilter;

impl MomentFilter for NaiveFilter {
    #[inline(always)]
    fn moments(n: Vec3, a: Sym2) -> [f32; MOMENTS] {
        let texel = aniso_encode(a);
        [texel.x.sqrt(), texel.y, texel.z.sqrt(), 0.0, 0.0, 0.0, n.x, n.y, n.z]
    }

    #[inline(always)]
    fn surfaces([rx, rho, ry, _, _, _, x, y, z]: Averages, texels: &mut TexelTile) {
        let [nx, ny, nz, axx, axy, ayy] = texels;
        for i in 0..TILE {
            let n = unit(x[i], y[i], z[i]);
            let a = aniso_decode_matrix(vec3(rx[i] * rx[i], rho[i], ry[i] * ry[i]));
            (nx[i], ny[i], nz[i]) = (n.x, n.y, n.z);
            (axx[i], axy[i], ayy[i]) = (a.xx, a.xy, a.yy);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinran_shading::{aniso_from_alphas, sggx_from_ggx};

    /// Uniform in [0, 1).
    fn uniform(state: &mut u32) -> f32 {
        *state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        (*state >> 8) as f32 / 16_777_216.0
    }

    /// Up to the horizon, and upright, there and back.
    #[test]
    fn the_short_form_of_a_texel_is_another_matrix() {
        let mut state = 3;
        for i in 0..10_000 {
            let (tilt, turn) = (1.6 * uniform(&mut state), 6.3 * uniform(&mut state));
            let n = vec3(tilt.sin() * turn.cos(), tilt.sin() * turn.sin(), tilt.cos().max(0.0)).normalize();
            let n = if i == 0 { Vec3::Z } else { n };
            let axis = 6.3 * uniform(&mut state);
            let a = aniso_from_alphas(uniform(&mut state), 0.01, vec2(axis.cos(), axis.sin()));
            let (got, wanted) = (sggx_of_texel(n, a), sggx_from_ggx(n, a));
            let difference = got + wanted * -1.0;
            let largest =
                [difference.xx, difference.xy, difference.xz, difference.yy, difference.yz, difference.zz]
                    .into_iter()
                    .fold(0.0_f32, |largest, v| largest.max(v.abs()));
            assert!(largest < 5e-7, "{n} {a:?}: wanted {wanted:?}, got {got:?}");

            // And back.
            let [mut xx, mut xy, mut yy] = [[0.0]; 3];
            let matrix = [&[got.xx], &[got.xy], &[got.xz], &[got.yy], &[got.yz], &[got.zz]];
            sggx_roughness(matrix, [&[n.x], &[n.y], &[n.z]], [&mut xx, &mut xy, &mut yy]);
            let off = (xx[0] - a.xx).abs().max((xy[0] - a.xy).abs()).max((yy[0] - a.yy).abs());
            assert!(off < 1e-6, "{n}: wanted {a:?}, got {xx:?}, {xy:?}, {yy:?}");
        }
    }

    /// Two eigenvalues that are one: the plane they share holds the mean normal, which is the answer.
    #[test]
    fn coincident_eigenvalues_are_told_apart() {
        let mean = vec3(0.3, 0.0, 1.0).normalize();
        for xx in [1.0, 1.0 - 1e-6, 1.0 - 1e-4, 1.0 + 3e-4] {
            let s = Sym3 { xx, yy: 0.01, zz: 1.0, ..Sym3::default() };
            let (n, is_sure) = nearby_axis(s, mean);
            assert!(!is_sure, "xx {xx}: wanted no answer, got {n}");
        }
        let (n, is_sure) = nearby_axis(Sym3 { xx: 0.2, yy: 0.01, zz: 1.0, ..Sym3::default() }, mean);
        assert!(is_sure && n.distance(Vec3::Z) < 1e-5, "wanted z, got {n}, {is_sure}");
    }

    /// Footprints of four texels of any roughness and tilt, V grooves among them: wherever the short way is taken, it
    /// ends where the long one does, within the rounding of both, and it is taken by 19 of 20.
    #[test]
    fn the_short_way_leads_to_another_axis() {
        let (mut sure, mut state) = (0, 7);
        for i in 0..20_000 {
            let (tilt, smooth) = (1.5 * uniform(&mut state).powi(2), uniform(&mut state));
            let (mut s, mut mean) = (Sym3::default(), Vec3::ZERO);
            for _ in 0..4 {
                let mut component = || tilt * (2.0 * uniform(&mut state) - 1.0);
                let n = vec3(component(), component(), 1.0).normalize();
                let mut alpha = || (smooth * uniform(&mut state)).max(0.01);
                let (alpha_t, alpha_b) = (alpha(), alpha());
                let a = aniso_from_alphas(alpha_t.max(alpha_b), alpha_t.min(alpha_b), vec2(1.0, 0.0));
                s = s + sggx_from_ggx(n, a) * 0.25;
                mean += n * 0.25;
            }
            let wanted = sggx_principal_axis(s, mean.normalize());
            let (got, is_sure) = nearby_axis(s, mean);
            if is_sure {
                sure += 1;
                assert!(
                    got.distance(wanted) < 1e-4,
                    "footprint {i}: wanted {wanted}, got {got} for {s:?} and {mean}"
                );
            }
        }
        assert!(sure > 19_000, "sure of {sure} of 20000 footprints only");
    }
}
