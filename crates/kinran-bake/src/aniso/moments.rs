//! Filters whose whole knowledge of a footprint is nine averages: `linear`, `lean` and `naive`.
//!
//! The averages of a level are averages of the level before, so every level is a filter of level 0 alone and
//! nothing is ever fitted twice.

use glam::{Vec3, vec2, vec3};
use kinran_shading::{
    LeanMoments, Sym2, Sym3, aniso_decode_matrix, aniso_encode, m_n, sggx_from_ggx, sggx_from_slopes,
    sggx_principal_axis, slopes_from_sggx,
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
    for i in 0..TILE {
        let n = unit(mean[0][i], mean[1][i], mean[2][i]);
        (nx[i], ny[i], nz[i]) = (n.x, n.y, n.z);
    }
    sggx_normals(matrices, [nx, ny, nz]);
    sggx_roughness(matrices, [nx, ny, nz], [axx, axy, ayy]);
}

/// First half of [`ggx_from_sggx_unclamped`](kinran_shading::ggx_from_sggx_unclamped) for many matrices
/// `[xx, xy, xz, yy, yz, zz]`: replaces the unit mean normals `n` by the filtered ones.
///
/// The halves are loops of their own, because both are long chains of divisions and roots: a processor that
/// looks a few hundred instructions ahead works on the next texels only if a texel takes no more of them.
#[inline(always)]
pub(crate) fn sggx_normals<const N: usize>(
    [xx, xy, xz, yy, yz, zz]: [&[f32; N]; 6],
    [nx, ny, nz]: [&mut [f32; N]; 3],
) {
    for i in 0..N {
        let s = Sym3 { xx: xx[i], xy: xy[i], xz: xz[i], yy: yy[i], yz: yz[i], zz: zz[i] };
        let n = sggx_principal_axis(s, vec3(nx[i], ny[i], nz[i]));
        let n = if n.z < 0.0 { -n } else { n };
        (nx[i], ny[i], nz[i]) = (n.x, n.y, n.z);
    }
}

/// Second half: squared roughness `[xx, xy, yy]` of matrices with known normals `n`; eigenvalues may exceed one.
#[inline(always)]
pub(crate) fn sggx_roughness<const N: usize>(
    [xx, xy, xz, yy, yz, zz]: [&[f32; N]; 6],
    [nx, ny, nz]: [&[f32; N]; 3],
    [axx, axy, ayy]: [&mut [f32; N]; 3],
) {
    for i in 0..N {
        let s = Sym3 { xx: xx[i], xy: xy[i], xz: xz[i], yy: yy[i], yz: yz[i], zz: zz[i] };
        let s = s.in_frame(m_n(vec3(nx[i], ny[i], nz[i])));
        let inv = s.zz.max(f32::MIN_POSITIVE).recip();
        (axx[i], axy[i], ayy[i]) = (s.xx * inv, s.xy * inv, s.yy * inv);
    }
}

/// The talk's filter: SGGX matrices are averaged (slide: Our Algorithm, step 2).
pub(crate) struct LinearFilter;

impl MomentFilter for LinearFilter {
    #[inline(always)]
    fn moments(n: Vec3, a: Sym2) -> [f32; MOMENTS] {
        let s = sggx_from_ggx(n, a);
        [s.xx, s.xy, s.xz, s.yy, s.yz, s.zz, n.x, n.y, n.z]
    }

    #[inline(always)]
    fn surfaces([xx, xy, xz, yy, yz, zz, x, y, z]: Averages, texels: &mut TexelTile) {
        sggx_surfaces([xx, xy, xz, yy, yz, zz], [x, y, z], texels);
    }
}

/// The direction of a mean normal. Opposite normals on the horizon leave nothing but rounding, which is z here.
#[inline(always)]
fn unit(x: f32, y: f32, z: f32) -> Vec3 {
    let z = z.max(1e-6);
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
        let mut s = sggx_from_ggx(n, a);
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
