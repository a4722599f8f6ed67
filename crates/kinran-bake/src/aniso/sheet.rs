//! What a filtered surface is stored as: texels of the maps that engines load.

use glam::{Vec2, Vec3, vec3};
use kinran_shading::{
    ALPHA_MIN, Sym2, alphas_from_khr_anisotropy, aniso_decode_matrix, aniso_encode, aniso_from_alphas,
    axis_from_direction, direction_from_axis, khr_anisotropy_from_alphas, normal_from_xy,
};

/// Error that averaging SGGX matrices in single precision leaves in alpha² (8e-7, see
/// [`ggx_from_sggx`](kinran_shading::ggx_from_sggx)): a smaller difference between directions is none.
const ROUNDING: f32 = 1e-6;

/// One map made from a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sheet {
    /// Tangent-space normal: RG `n.xy/2 + 1/2`, B the same of z for formats that hold it.
    Normal,
    /// Kinran's aniso map: RGB `[sqrt(Sxx), rho/2 + 1/2, sqrt(Syy)]`, see [`aniso_encode`].
    Aniso,
    /// G perceptual roughness of `KHR_materials_anisotropy` (across the direction); the other channels belong
    /// to whoever packs the map.
    Roughness,
    /// G perceptual roughness for viewers that know no direction: of the mean of both squared alphas, which
    /// keeps the lobe's spread over all directions. The other channels as in [`Sheet::Roughness`].
    IsotropicRoughness,
    /// `KHR_materials_anisotropy`: RG direction `d/2 + 1/2`, B strength.
    KhrAnisotropy,
}

impl Sheet {
    /// The name in file names and reports.
    pub fn name(self) -> &'static str {
        match self {
            Sheet::Normal => "normal",
            Sheet::Aniso => "aniso",
            Sheet::Roughness | Sheet::IsotropicRoughness => "roughness",
            Sheet::KhrAnisotropy => "anisotropy",
        }
    }

    /// RGB of one texel, each in [0, 1].
    #[inline(always)]
    pub fn encode(self, n: Vec3, a: Sym2) -> [f32; 3] {
        match self {
            Sheet::Normal => (n * 0.5 + 0.5).to_array(),
            Sheet::Aniso => {
                // rho = 0 lies halfway between two bytes; rounding errors must not choose among them.
                let [t, rho, b] = aniso_encode(a).to_array();
                let tie = ((rho - 0.5).abs() < 0.1 / 255.0) | (a.xy.abs() < ROUNDING);
                [t, if tie { 0.5 + 0.1 / 255.0 } else { rho }, b]
            }
            Sheet::Roughness => [1.0, khr(a).0, 1.0],
            Sheet::IsotropicRoughness => [1.0, (0.5 * a.trace()).sqrt().clamp(ALPHA_MIN, 1.0).sqrt(), 1.0],
            Sheet::KhrAnisotropy => {
                let (_, strength, axis) = khr(a);
                // A strength that 8 bits round to zero: the axis is noise, and noise does not compress.
                let round = strength < 0.5 / 255.0;
                let direction = if round { Vec2::X } else { direction_from_axis(axis, n) };
                [direction.x * 0.5 + 0.5, direction.y * 0.5 + 0.5, strength]
            }
        }
    }
}

/// Roughness, strength and axis as `KHR_materials_anisotropy` has them.
fn khr(a: Sym2) -> (f32, f32, Vec2) {
    let (t, b, axis) = a.eigen();
    let mean = 0.5 * (t + b);
    let (t, b) = if t - b < 2.0 * ROUNDING { (mean, mean) } else { (t, b) };
    let (roughness, strength) =
        khr_anisotropy_from_alphas(t.sqrt().clamp(ALPHA_MIN, 1.0), b.sqrt().clamp(ALPHA_MIN, 1.0));
    (roughness, strength, axis)
}

/// Surface of a normal texel's RG and an aniso texel: what a shader sees.
pub fn decode_aniso(normal: [f32; 4], aniso: [f32; 4]) -> (Vec3, Sym2) {
    let n = normal_from_xy(normal[0] * 2.0 - 1.0, normal[1] * 2.0 - 1.0);
    (n, aniso_decode_matrix(vec3(aniso[0], aniso[1], aniso[2])))
}

/// Surface of a normal texel's RG, a roughness texel's G and an anisotropy texel: what a viewer of
/// `KHR_materials_anisotropy` sees. Without an anisotropy texel the lobe is isotropic.
pub fn decode_khr(normal: [f32; 4], roughness: f32, anisotropy: Option<[f32; 4]>) -> (Vec3, Sym2) {
    let n = normal_from_xy(normal[0] * 2.0 - 1.0, normal[1] * 2.0 - 1.0);
    let [x, y, strength, _] = anisotropy.unwrap_or([1.0, 0.5, 0.0, 1.0]);
    let (alpha_t, alpha_b) = alphas_from_khr_anisotropy(roughness, strength);
    let direction = Vec2::new(x * 2.0 - 1.0, y * 2.0 - 1.0).normalize_or(Vec2::X);
    (n, aniso_from_alphas(alpha_t, alpha_b, axis_from_direction(direction, n)))
}
