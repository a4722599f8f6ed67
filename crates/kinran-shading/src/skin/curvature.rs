//! The curvature tensor of a vertex: four bytes, and the curvature towards a light.
//!
//! ```
//! use glam::vec2;
//! use kinran_shading::Sym2;
//! use kinran_shading::skin::curvature::{curvature_decode, curvature_encode, curvature_from_light};
//!
//! // A finger: round across, straight along. Light across it sees the curvature, light along it none.
//! let finger = Sym2 { xx: 0.12, xy: 0.0, yy: 0.0 };
//! let (tensor, mean) = curvature_decode(curvature_encode(finger, 0.06, 0.5), 0.5);
//! assert!((mean - 0.06).abs() < 1e-3);
//! assert!(curvature_from_light(tensor, vec2(1.0, 0.0)) > curvature_from_light(tensor, vec2(0.0, 1.0)));
//! ```

use crate::{Sym2, sqrt::sqrt};
use glam::{Vec2, Vec4, vec4};

/// The largest curvature that four bytes hold where nothing else is said, 1/mm: a radius of 2 mm.
pub const CURVATURE_RANGE: f32 = 0.5;

/// Four numbers from 0 to 1 for a positive semi-definite curvature tensor (1/mm, in the frame of tangent and
/// bitangent) and a mean curvature, both up to `range`: `sqrt(xx), rho, sqrt(yy), sqrt(mean)`, where
/// `rho = xy / sqrt(xx yy)`. What is larger is clamped.
///
/// Square roots give a small curvature, where the light's table is steepest, most of the codes, and any weighted mean
/// of codes decodes to a positive semi-definite tensor. `rho` is stored as `(127 rho + 128) / 255`, so that a byte
/// holds zero exactly, unlike the talk's aniso texel.
pub fn curvature_encode(tensor: Sym2, mean: f32, range: f32) -> Vec4 {
    let inverse = range.recip();
    let (xx, yy) = (tensor.xx.max(0.0), tensor.yy.max(0.0));
    let product = sqrt(xx * yy);
    let rho = if product > 0.0 { (tensor.xy / product).clamp(-1.0, 1.0) } else { 0.0 };
    let root = |x: f32| sqrt((x * inverse).clamp(0.0, 1.0));
    vec4(root(xx), (127.0 * rho + 128.0) / 255.0, root(yy), root(mean))
}

/// Tensor and mean curvature, 1/mm, from [`curvature_encode`]'s four numbers.
pub fn curvature_decode(texel: Vec4, range: f32) -> (Sym2, f32) {
    let rho = texel.y * (255.0 / 127.0) - 128.0 / 127.0;
    let (a, b) = (range * texel.x, texel.z);
    (Sym2 { xx: a * texel.x, xy: a * b * rho, yy: range * b * b }, range * texel.w * texel.w)
}

/// The curvature towards a light, 1/mm (slide: Skin Shading | Implementation, `CurvatureFromLight`): the tensor along the
/// light's tangent and bitangent components `u_tb`, not normalised. It is the directional curvature times the
/// squared sine between normal and light: right at the terminator, less towards the light, where the table hardly
/// varies with it.
pub fn curvature_from_light(tensor: Sym2, u_tb: Vec2) -> f32 {
    tensor.quadratic(u_tb)
}

/// The curvature in the direction of the light's projection on the tangent plane, 1/mm: [`curvature_from_light`] over
/// the squared length of `u_tb`. Where the light stands in the normal there is no direction, and within some 1e-3 rad of
/// it the result goes over to the mean.
pub fn curvature_from_light_normalized(tensor: Sym2, u_tb: Vec2) -> f32 {
    (tensor.quadratic(u_tb) + 5e-7 * tensor.trace()) / (u_tb.length_squared() + 1e-6)
}
