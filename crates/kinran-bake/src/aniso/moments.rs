//! Filters whose whole knowledge of a footprint is nine averages: `linear`, `lean` and `naive`.
//!
//! The averages of a level are averages of the level before, so every level is a filter of level 0 alone and
//! nothing is ever fitted twice.

use glam::{Vec3, vec2, vec3};
use kinran_shading::{
    LeanMoments, Sym2, Sym3, aniso_decode_matrix, aniso_encode, ggx_from_sggx_unclamped, sggx_from_ggx,
    sggx_from_slopes, slopes_from_sggx,
};

/// Averages kept for a texel.
pub(crate) const MOMENTS: usize = 9;

/// A filter by averages.
pub(crate) trait MomentFilter: Sync {
    /// What is averaged.
    fn moments(n: Vec3, a: Sym2) -> [f32; MOMENTS];
    /// The surface that the averages stand for; eigenvalues may exceed one.
    fn surface(moments: [f32; MOMENTS]) -> (Vec3, Sym2);
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
    fn surface([xx, xy, xz, yy, yz, zz, x, y, z]: [f32; MOMENTS]) -> (Vec3, Sym2) {
        ggx_from_sggx_unclamped(Sym3 { xx, xy, xz, yy, yz, zz }, unit(x, y, z))
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
    fn surface([mx, my, xx, xy, yy, _, x, y, z]: [f32; MOMENTS]) -> (Vec3, Sym2) {
        let moments = LeanMoments { mean: vec2(mx, my), second: Sym2 { xx, xy, yy } };
        ggx_from_sggx_unclamped(sggx_from_slopes(moments.mean, moments.covariance() * 2.0), unit(x, y, z))
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
    fn surface([rx, rho, ry, _, _, _, x, y, z]: [f32; MOMENTS]) -> (Vec3, Sym2) {
        (unit(x, y, z), aniso_decode_matrix(vec3(rx * rx, rho, ry * ry)))
    }
}
