//! A surface's material at one point, and how it reflects.
//!
//! The model is glTF's metallic-roughness: a GGX lobe with height-correlated Smith masking, Schlick's Fresnel
//! and multiscatter compensation; under it, for the part that is not metal, a Lambert lobe of what the
//! specular lobe leaves for the view direction. `KHR_materials_specular` and `KHR_materials_ior` say how much of it that
//! part reflects; `KHR_materials_diffuse_transmission` turns a share of what is scattered to the other side of the surface.

use super::{
    albedo::specular_albedo,
    bound::{sample, sample_lobe},
    diffuse::diffuse_lobe,
    fuzz::FuzzAt,
    geometry::{N_V_MIN, SurfacePoint},
    scene::{AnisoEncoding, RenderMaterial},
    skin::SkinPoint,
    texture::TextureFiltering,
};
use glam::{Mat3, Vec2, Vec3, Vec3Swizzles, Vec4, Vec4Swizzles};
use kinran_scene::{AlphaMode, DetailMap};
use kinran_shading::{
    DIELECTRIC_F0, alpha_from_roughness, alphas_from_khr_anisotropy, aniso_decode, aniso_encode,
    aniso_from_alphas, axis_from_direction, ggx_aniso_d, ggx_d, m_n, multiscatter_compensation,
    normal_from_xy, schlick_f, smith_aniso_v, smith_v,
};

/// A material evaluated for one point and one view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shading {
    /// Columns: the direction of `alpha_t`, that of `alpha_b`, the shading normal; orthonormal, world space.
    pub(crate) frame: Mat3,
    /// The view in `frame`.
    pub(crate) v: Vec3,
    pub(crate) alpha_t: f32,
    pub(crate) alpha_b: f32,
    /// Reflectance at normal incidence over `weight`.
    f0: Vec3,
    /// Share of the specular lobe, that at grazing.
    weight: f32,
    compensation: Vec3,
    /// Albedo of the Lambert lobe.
    pub(crate) diffuse: Vec3,
    /// Albedo of the Lambert lobe for light from behind.
    pub(crate) translucent: Vec3,
    /// Share of the light behind the surface that comes through.
    pub(crate) transmitted: Vec3,
    /// 0 to 1, for ambient light only.
    pub(crate) occlusion: f32,
    pub(crate) emitted: Vec3,
    /// 0 is a hole, 1 is opaque.
    pub(crate) opacity: f32,
    /// Where the material is skin, seen from its front.
    pub(crate) skin: Option<SkinPoint>,
    /// Fibres over all that.
    pub(crate) fuzz: Option<FuzzAt>,
}

/// Base colour and alpha.
fn base_color(material: &RenderMaterial, point: &SurfacePoint, filtering: TextureFiltering) -> Vec4 {
    let map = material.detail.as_ref().and_then(|detail| detail.at(DetailMap::BaseColor, point, filtering));
    let map = map.unwrap_or_else(|| sample(material.drawn_base_color(), point, filtering));
    material.base_color_factor * point.color * map
}

/// Reflectance at normal incidence of what is not metal, and the share that there is of it.
fn dielectric(material: &RenderMaterial, point: &SurfacePoint, filtering: TextureFiltering) -> (Vec3, f32) {
    let Some(dielectric) = material.drawn_dielectric() else { return (Vec3::splat(DIELECTRIC_F0), 1.0) };
    let map = sample(dielectric.map.as_ref(), point, filtering);
    let (f0, strength) = (dielectric.f0 * map.xyz(), dielectric.strength * map.w);
    (f0.clamp(Vec3::ZERO, Vec3::ONE), strength.clamp(0.0, 1.0))
}

/// How much a surface hides, 0 to 1.
pub(crate) fn opacity(material: &RenderMaterial, base_color: Vec4) -> f32 {
    match material.alpha_mode {
        AlphaMode::Opaque => 1.0,
        AlphaMode::Mask { cutoff } => f32::from(u8::from(base_color.w >= cutoff)),
        AlphaMode::Blend => base_color.w.clamp(0.0, 1.0),
    }
}

/// The share of light that passes straight through a surface on its way to another one.
pub(crate) fn shadow_transmittance(
    material: &RenderMaterial,
    point: &SurfacePoint,
    filtering: TextureFiltering,
) -> Vec3 {
    let base = base_color(material, point, filtering);
    let opacity = opacity(material, base);
    let (f0, strength) = dielectric(material, point, filtering);
    let through = base.xyz() * ((1.0 - strength * f0.max_element()) * material.transmission);
    Vec3::splat(1.0 - opacity) + opacity * through
}

impl AnisoEncoding {
    /// The aniso texel of what a texture holds, where the surface has a roughness and a normal.
    pub(crate) fn texel(self, held: Vec3, roughness: f32, n: Vec3) -> Vec3 {
        let AnisoEncoding::Khr { strength, rotation } = self else { return held };
        let (alpha_t, alpha_b) = alphas_from_khr_anisotropy(roughness, strength * held.z);
        let direction = Vec2::from_angle(rotation).rotate(held.xy() * 2.0 - 1.0);
        aniso_encode(aniso_from_alphas(alpha_t, alpha_b, axis_from_direction(direction, n)))
    }
}

impl Shading {
    /// Evaluates `material` at `point`, seen along `view`, the unit direction towards the viewer.
    ///
    /// Back faces are the same relief seen from behind: normal, tangent and bitangent all turn around.
    /// Where the shading normal faces away from the viewer, it is tilted towards the viewer until
    /// n·v = [`N_V_MIN`]: the relief's far sides are hidden in truth and seen as grazing here.
    pub(crate) fn new(
        material: &RenderMaterial,
        point: &SurfacePoint,
        view: Vec3,
        filtering: TextureFiltering,
        curvature_range: f32,
    ) -> Self {
        debug_assert!(view.is_normalized(), "a view of length {}", view.length());
        let base = base_color(material, point, filtering);
        let own = sample(material.drawn_metallic_roughness(), point, filtering);
        let own_occlusion = sample(material.occlusion.as_ref(), point, filtering).x;
        let detail = |map| material.detail.as_ref()?.at(map, point, filtering);
        let data = detail(DetailMap::Data);
        let channels = material.detail.as_ref().map_or([None; 3], |detail| detail.detail.channels);
        let of_data = |channel: Option<usize>, own: f32| channel.zip(data).map_or(own, |(c, data)| data[c]);
        let occlusion = of_data(channels[0], own_occlusion);
        let metallic = (material.metallic_factor * of_data(channels[2], own.z)).clamp(0.0, 1.0);

        // Normal and roughness, in the tangent frame of the mesh.
        let roughness = (material.roughness_factor * of_data(channels[1], own.y)).clamp(0.0, 1.0);
        let blended = detail(DetailMap::Normal).map(|n| n.xyz());
        let (n, texel) = match &material.surface {
            Some(surface) => {
                let [normal, texel] = sample_lobe([&surface.normal, &surface.aniso], point, filtering);
                let xy = normal.xy() * 2.0 - 1.0;
                let n = blended.unwrap_or_else(|| normal_from_xy(xy.x, xy.y));
                (n, surface.encoding.texel(texel.xyz(), roughness, n))
            }
            None => {
                let alpha = alpha_from_roughness(roughness);
                (blended.unwrap_or(Vec3::Z), Vec3::new(alpha, 0.5, alpha))
            }
        };
        let texel = detail(DetailMap::Aniso).map_or(texel, |texel| texel.xyz());

        // To world space. The mesh's frame may be skewed by interpolation; what comes out is orthonormal.
        let front = if point.geometric_normal.dot(view) < 0.0 { -1.0 } else { 1.0 };
        let to_world = point.tangent_frame * front;
        let mut normal = (to_world * n).normalize_or(front * point.geometric_normal);
        if normal.dot(view) < N_V_MIN {
            normal = (normal + (N_V_MIN - normal.dot(view)) * view).normalize();
        }
        let basis = m_n(n);
        let (tangent, bitangent) = orthonormalize(to_world * basis.x_axis, to_world * basis.y_axis, normal);
        let aniso = aniso_decode(texel, tangent, bitangent);
        let (alpha_t, alpha_b) = (aniso.alpha_t, aniso.alpha_b);
        let frame = Mat3::from_cols(aniso.tangent, aniso.bitangent, normal);
        let v = frame.transpose() * view;
        debug_assert!(v.z > 0.0 && (frame.determinant().abs() - 1.0).abs() < 1e-3, "{frame}, v {v}");

        let (f0, strength) = dielectric(material, point, filtering);
        let inside = 1.0 - strength * specular_albedo(f0.max_element(), v, alpha_t, alpha_b);
        // Without a reflectance there is no lobe, whatever its colour.
        let weight = strength + (1.0 - strength) * metallic;
        let f0 = if weight > 0.0 { (strength * f0).lerp(base.xyz(), metallic) / weight } else { Vec3::ZERO };
        let passed = base.xyz() * (1.0 - metallic) * inside;
        let (scattered, translucent) = match &material.translucency {
            Some(t) => {
                let share = (t.factor * sample(t.map.as_ref(), point, filtering).w).clamp(0.0, 1.0);
                let color = t.color_factor * sample(t.color.as_ref(), point, filtering).xyz();
                (passed * (1.0 - share), color * share * (1.0 - metallic) * inside)
            }
            None => (passed, Vec3::ZERO),
        };
        let opaque = 1.0 - material.transmission;
        let diffuse = scattered * opaque;
        let fuzz = (material.fuzz.as_ref())
            .and_then(|fuzz| FuzzAt::new(fuzz, point, filtering, to_world, frame, v, diffuse));
        Shading {
            frame,
            v,
            alpha_t,
            alpha_b,
            f0,
            weight,
            compensation: multiscatter_compensation(f0, v, alpha_t, alpha_b),
            diffuse,
            translucent: translucent * opaque,
            transmitted: passed * (1.0 - opaque),
            occlusion: 1.0 + material.occlusion_strength * (occlusion - 1.0),
            emitted: material.emissive_factor * sample(material.emissive.as_ref(), point, filtering).xyz(),
            opacity: opacity(material, base),
            skin: material
                .skin
                .as_ref()
                .filter(|_| front > 0.0)
                .map(|skin| skin.at(point, normal, curvature_range)),
            fuzz,
        }
    }

    /// The specular lobe for a light along `u` in the shading frame, per steradian, without the cosine.
    #[inline]
    pub(crate) fn specular(&self, u: Vec3) -> Vec3 {
        debug_assert!(u.is_normalized(), "light along a vector of length {}", u.length());
        if u.z <= 0.0 {
            return Vec3::ZERO;
        }
        let h = (u + self.v).normalize();
        let d = ggx_aniso_d(h, self.alpha_t, self.alpha_b);
        let visibility = smith_aniso_v(u, self.v, self.alpha_t, self.alpha_b);
        let mut lobe = d * visibility;
        if let Some(skin) = self.skin.filter(|skin| skin.second_share > 0.0) {
            let second = ggx_d(h.z, skin.second_alpha) * smith_v(u.z, self.v.z, skin.second_alpha);
            lobe += skin.second_share * (second - lobe);
        }
        lobe * self.weight * schlick_f(self.f0, self.v.dot(h)) * self.compensation
    }

    /// All of the BSDF for a light along `u` in the shading frame, per steradian, times the cosine: what is reflected
    /// of light from the front, what comes through of light from behind.
    #[inline]
    pub(crate) fn scattered(&self, u: Vec3) -> Vec3 {
        self.reflected(u) + diffuse_lobe(self.translucent) * (-u.z).max(0.0)
    }

    /// Of it what is reflected, through the fuzz if there is any.
    #[inline]
    pub(crate) fn reflected(&self, u: Vec3) -> Vec3 {
        let base = (diffuse_lobe(self.diffuse) + self.specular(u)) * u.z.max(0.0);
        self.fuzz.as_ref().map_or(base, |fuzz| fuzz.over(u, base))
    }

    /// What skin reflects of a light along `u`, BRDF times cosine, through the fuzz if there is any: `cosine` is what scatters,
    /// times π, `direct` the share of the light that is not in shadow, `scattered` of it what scatters into shadows.
    pub(crate) fn of_skin(&self, u: Vec3, cosine: Vec3, direct: Vec3, scattered: Vec3) -> Vec3 {
        let diffuse = diffuse_lobe(self.diffuse) * scattered;
        let gloss = self.specular(u) * u.z.max(0.0);
        match &self.fuzz {
            None => diffuse * cosine + gloss * direct,
            Some(fuzz) => fuzz.over_skin(u, diffuse, cosine, gloss, direct),
        }
    }

    /// How bright the specular and the diffuse lobe of the base are, roughly, for sampling.
    pub(crate) fn brightness(&self) -> (f32, f32) {
        let specular = specular_albedo(self.f0.max_element(), self.v, self.alpha_t, self.alpha_b);
        (self.weight * specular, self.diffuse.max_element())
    }
}

/// Unit vectors along `tangent` and `bitangent`, orthogonal to each other and to the unit vector `normal`.
/// Handedness is kept; what is degenerate is replaced.
fn orthonormalize(tangent: Vec3, bitangent: Vec3, normal: Vec3) -> (Vec3, Vec3) {
    let t = (tangent - normal * normal.dot(tangent)).normalize_or(normal.any_orthonormal_vector());
    let b = normal.cross(t);
    (t, if b.dot(bitangent) < 0.0 { -b } else { b })
}
