//! A layer of fibres over a material, at a point.

use std::sync::Arc;

use glam::{Mat3, Vec2, Vec3, Vec4Swizzles};
use kinran_scene::{Fuzz, FuzzAttenuation, FuzzPhase};
use kinran_shading::fuzz::{
    FUZZ_DEFERRED_ALPHA, FUZZ_DEFERRED_DENSITY, FUZZ_TABLE_SIZE, FuzzView, fibre_direction, fibre_p_s,
    fuzz_alpha, fuzz_ambient_factor, fuzz_ambient_place, fuzz_ambient_tabulated, fuzz_attenuation,
    fuzz_deferred, fuzz_deferred_color, fuzz_deferred_escape, fuzz_g, fuzz_layer, fuzz_light,
    fuzz_over_base_shares, fuzz_p_s, fuzz_passage, fuzz_smooth_normal, fuzz_view, velvet_k, velvet_phase,
};

use super::bound::{BoundTexture, sample, sample_bound};
use super::diffuse::diffuse_lobe;
use super::geometry::{N_V_MIN, SurfacePoint};
use super::texture::TextureFiltering;

/// Coefficients for one tilt and spread, as the shader library's functions of these names take them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FuzzCoefficients {
    /// `fuzz_p_s`.
    pub p_s: [f32; 6],
    /// `fuzz_ambient_factor`.
    pub ambient: [f32; 8],
    /// `fuzz_ambient_direction`.
    pub direction: [f32; 4],
    /// `fuzz_ambient_attenuation`.
    pub r: f32,
}

/// Tilts, evenly from upright to lying, that a layer has coefficients for.
pub const FUZZ_TILTS: usize = 17;

/// Coefficients of a layer for all tilts, between which they are interpolated.
#[derive(Clone, Debug, PartialEq)]
pub struct FuzzFits {
    /// For each of the tilts.
    pub tilts: [FuzzCoefficients; FUZZ_TILTS],
    /// For an alpha below [`FUZZ_COMBED_ALPHA`](kinran_shading::fuzz::FUZZ_COMBED_ALPHA), of either phase: for each of
    /// the tilts the rows of a table for `fuzz_ambient_tabulated`.
    pub table: Option<Vec<[f32; 2]>>,
}

impl FuzzFits {
    /// Where a fibre at a cosine to the normal lies between tilts: the lower one and the share of the next.
    fn place(t_n: f32) -> (usize, f32) {
        let place = libm::acosf(t_n.clamp(0.0, 1.0)) / std::f32::consts::FRAC_PI_2 * (FUZZ_TILTS - 1) as f32;
        let low = (place as usize).min(FUZZ_TILTS - 2);
        (low, place - low as f32)
    }

    /// `fuzz_p_s` at a cosine of fibre and normal.
    fn p_s(&self, t_n: f32) -> [f32; 6] {
        let (low, f) = Self::place(t_n);
        let (a, b) = (&self.tilts[low].p_s, &self.tilts[low + 1].p_s);
        std::array::from_fn(|i| a[i] + (b[i] - a[i]) * f)
    }

    /// The layer's ambient light over G, from the table if there is one.
    pub fn ambient_factor(&self, density: f32, n_v: f32, t_v: f32, t_n: f32) -> f32 {
        let (low, f) = Self::place(t_n);
        let Some(table) = &self.table else {
            let (a, b) = (&self.tilts[low].ambient, &self.tilts[low + 1].ambient);
            return fuzz_ambient_factor(std::array::from_fn(|i| a[i] + (b[i] - a[i]) * f), n_v, t_v);
        };
        const SIZE: usize = FUZZ_TABLE_SIZE as usize;
        const LAST: Vec2 = Vec2::splat((SIZE - 1) as f32);
        let place = (fuzz_ambient_place(n_v, t_v, t_n) * SIZE as f32 - 0.5).clamp(Vec2::ZERO, LAST);
        let cell = place.floor().min(LAST - 1.0);
        let within = place - cell;
        let tilt = |tilt: usize| {
            let row = |y: usize| {
                let start = (tilt * SIZE + cell.y as usize + y) * SIZE + cell.x as usize;
                Vec2::from(table[start]).lerp(table[start + 1].into(), within.x)
            };
            row(0).lerp(row(1), within.y)
        };
        fuzz_ambient_tabulated(tilt(low).lerp(tilt(low + 1), f), density, n_v)
    }
}

/// Fuzz with its textures.
#[derive(Clone, Debug)]
pub struct RenderFuzz {
    /// What the material says; its texture references are not looked at.
    pub fuzz: Fuzz,
    /// Direction of fibres in tangent space, mapped from [-1, 1] to [0, 1].
    pub direction: Option<BoundTexture>,
    /// Linear RGB.
    pub color: Option<BoundTexture>,
    /// R: density of a layer, fuzziness of the simple form.
    pub amount: Option<BoundTexture>,
    /// The reference asks for them for velvet and for attenuation by albedo, the GPU always; filled by
    /// [`RenderScene::fit_fuzz`](super::RenderScene::fit_fuzz).
    pub fits: Option<Arc<FuzzFits>>,
    /// The GPU lights the layer from all around as the talk does, not along its lobe.
    pub talk_ambient: bool,
}

impl RenderFuzz {
    /// Whether the reference draws it without coefficients.
    pub(crate) fn is_exact(&self) -> bool {
        match &self.fuzz {
            Fuzz::Layer(layer) => {
                layer.phase == FuzzPhase::Fibre && layer.attenuation != FuzzAttenuation::Albedo
            }
            Fuzz::Simple { .. } => true,
        }
    }
}

/// Fuzz at a point for a view; directions in the frame of the base's shading.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FuzzAt {
    n: Vec3,
    t: Vec3,
    v: Vec3,
    color: Vec3,
    view: FuzzView,
    density: f32,
    alpha: f32,
    kind: Kind,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Layer { phase: FuzzPhase, attenuation: FuzzAttenuation, p_s: [f32; 6], albedo: f32 },
    Simple { fuzziness: f32, diffuse: Vec3 },
}

impl FuzzAt {
    /// `to_world` is the mesh's tangent frame, turned to the viewer; `frame` and `v` are the base's; `diffuse` is its
    /// diffuse albedo. `None` where there is no fuzz.
    pub(crate) fn new(
        fuzz: &RenderFuzz,
        point: &SurfacePoint,
        filtering: TextureFiltering,
        to_world: Mat3,
        frame: Mat3,
        v: Vec3,
        diffuse: Vec3,
    ) -> Option<Self> {
        let amount = sample(fuzz.amount.as_ref(), point, filtering).x;
        let layer = match &fuzz.fuzz {
            Fuzz::Layer(layer) => layer,
            Fuzz::Simple { fuzziness, .. } => {
                let fuzziness = (fuzziness * amount).clamp(0.0, 1.0);
                return (fuzziness > 0.0).then_some(FuzzAt {
                    n: Vec3::Z,
                    t: Vec3::Z,
                    v,
                    color: fuzz_deferred_color(diffuse, v.z),
                    view: FuzzView { escaped: fuzz_deferred_escape(v.z), ..fuzz_view(v.z, v.z, 0.0, 1.0) },
                    density: FUZZ_DEFERRED_DENSITY,
                    alpha: FUZZ_DEFERRED_ALPHA,
                    kind: Kind::Simple { fuzziness, diffuse },
                });
            }
        };
        let density = layer.density * amount;
        if density <= 0.0 {
            return None;
        }
        let to_shading = frame.transpose();
        let vertex = (to_shading * to_world.z_axis).normalize_or(Vec3::Z);
        let n = fuzz_smooth_normal(Vec3::Z, vertex, layer.normal_smoothness);
        let tangent_space = match &fuzz.direction {
            Some(texture) => {
                (sample_bound(texture, point, filtering).xyz() * 2.0 - 1.0).normalize_or(Vec3::Z)
            }
            None => fibre_direction(layer.tilt, layer.azimuth),
        };
        let t = (to_shading * (to_world * tangent_space)).normalize_or(n);
        // Fits are for fibres above the horizon; a fibre has no sign.
        let t = if t.dot(n) < 0.0 { -t } else { t };
        let n_v = n.dot(v).max(N_V_MIN);
        let alpha = fuzz_alpha(layer.spread);
        let color = layer.color * sample(fuzz.color.as_ref(), point, filtering).xyz();
        let (t_n, t_v) = (t.dot(n), t.dot(v));
        let factor = fuzz.fits.as_ref().map_or(0.0, |fits| fits.ambient_factor(density, n_v, t_v, t_n));
        let albedo = fuzz_g(density, n_v) * factor;
        Some(FuzzAt {
            n,
            t,
            v,
            color,
            view: fuzz_view(n_v, t_v, density, alpha),
            density,
            alpha,
            kind: Kind::Layer {
                phase: layer.phase,
                attenuation: layer.attenuation,
                p_s: fuzz.fits.as_ref().map_or([0.0; 6], |fits| fits.p_s(t_n)),
                albedo: (albedo * color.max_element()).min(1.0),
            },
        })
    }

    /// The layer over what the base reflects for a light along `u`, BRDF times cosine; `n_u` is the base's cosine.
    #[inline]
    pub(crate) fn over(&self, u: Vec3, base: Vec3) -> Vec3 {
        let n_u = self.n.dot(u);
        let phase = match self.kind {
            Kind::Simple { fuzziness, diffuse } => {
                let soft = self.color * fuzz_deferred(u.z, self.view.n_v, u.dot(self.v), self.view.escaped);
                let without = diffuse_lobe(diffuse) * u.z.max(0.0);
                return base + fuzziness * (soft - without);
            }
            Kind::Layer { phase, .. } => phase,
        };
        if n_u <= 1e-4 {
            return Vec3::ZERO;
        }
        let (t_u, u_v) = (self.t.dot(u), u.dot(self.v));
        let (lobe, penetrated) = match phase {
            FuzzPhase::Fibre => {
                let light = fuzz_light(self.view, n_u, t_u, u_v);
                (light.lobe, light.penetrated)
            }
            FuzzPhase::Velvet => {
                let penetrated = fuzz_passage(self.density, n_u);
                let p = velvet_phase(u_v, t_u, self.view.t_v, velvet_k(self.alpha * self.alpha));
                (fuzz_layer(p, penetrated * self.view.escaped, n_u, self.view.n_v), penetrated)
            }
        };
        base * self.left(penetrated, n_u, t_u) + self.color * (lobe * n_u)
    }

    /// What a layer leaves of the base for light that comes in at these cosines with normal and fibre, of which the share
    /// `penetrated` reaches the base.
    #[inline]
    fn left(&self, penetrated: f32, n_u: f32, t_u: f32) -> Vec3 {
        let Kind::Layer { phase, attenuation, p_s, albedo } = self.kind else { return Vec3::ONE };
        match attenuation {
            FuzzAttenuation::None => Vec3::ONE,
            FuzzAttenuation::Albedo => Vec3::splat(1.0 - albedo),
            FuzzAttenuation::Unscattered => fuzz_attenuation(penetrated, self.view.escaped, 0.0, self.color),
            FuzzAttenuation::Full => {
                let downward = match phase {
                    FuzzPhase::Fibre => fibre_p_s(n_u, t_u, self.t.dot(self.n), self.alpha),
                    FuzzPhase::Velvet => fuzz_p_s(p_s, n_u, t_u),
                };
                fuzz_attenuation(penetrated, self.view.escaped, downward, self.color)
            }
        }
    }

    /// The layer over skin, of which `diffuse * cosine` scatters and `gloss` does not; the share `direct` of the light is not in
    /// shadow. Light that scatters came in where the surface faces it more: it was dimmed as light at the mean of
    /// `cosine` over the channels is, so that the terminator keeps its colour.
    pub(crate) fn over_skin(&self, u: Vec3, diffuse: Vec3, cosine: Vec3, gloss: Vec3, direct: Vec3) -> Vec3 {
        let scattered = diffuse * cosine;
        if let Kind::Simple { fuzziness, .. } = self.kind {
            let soft = self.color * fuzz_deferred(u.z, self.view.n_v, u.dot(self.v), self.view.escaped);
            return scattered * (1.0 - fuzziness) + (gloss + fuzziness * soft) * direct;
        }
        let n_u = (cosine.element_sum() / 3.0).clamp(1e-4, 1.0);
        let left = self.left(fuzz_passage(self.density, n_u), n_u, self.t.dot(u));
        scattered * left + self.over(u, gloss) * direct
    }

    /// Direction and roughness of the fibres, for sampling.
    pub(crate) fn fibres(&self) -> (Vec3, f32) {
        (self.t, self.alpha)
    }

    /// Probabilities of sampling the layer, the specular lobe and the diffuse one of the base, whose brightness is given.
    pub(crate) fn shares(&self, specular: f32, diffuse: f32) -> Vec3 {
        let half_up = 0.5 * self.color.max_element() * fuzz_g(self.density, self.view.n_v);
        let left = match self.kind {
            Kind::Simple { fuzziness, .. } => {
                return fuzz_over_base_shares(half_up * fuzziness, specular, diffuse * (1.0 - fuzziness));
            }
            Kind::Layer { attenuation: FuzzAttenuation::Full | FuzzAttenuation::Unscattered, .. } => {
                self.view.escaped
            }
            Kind::Layer { .. } => 1.0,
        };
        fuzz_over_base_shares(half_up, specular * left, diffuse * left)
    }
}
