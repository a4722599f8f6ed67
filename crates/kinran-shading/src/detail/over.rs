//! Alpha blending, for aniso texels.

use glam::Vec3;

/// The texel `detail` over the texel `s` with opacity `alpha` in [0, 1]: `s + (detail - s) alpha` (slide: Detail Maps,
/// "aniso maps blended with regular alpha blending"). Every mixture of aniso texels decodes to a positive semi-definite
/// matrix.
#[inline(always)]
pub fn detail_over(s: Vec3, detail: Vec3, alpha: f32) -> Vec3 {
    s + (detail - s) * alpha
}

/// The texel in [0, 1]³ that comes nearest to `detail_over(s, detail, alpha) = target`: exact where
/// `alpha detail ≤ target ≤ 1 - alpha (1 - detail)` in each channel, else the nearer end; `target` itself at alpha 1,
/// where nothing of `s` is seen.
#[inline(always)]
pub fn detail_over_inverse(target: Vec3, detail: Vec3, alpha: f32) -> Vec3 {
    if alpha >= 1.0 {
        return target;
    }
    (detail + (target - detail) / (1.0 - alpha)).clamp(Vec3::ZERO, Vec3::ONE)
}
