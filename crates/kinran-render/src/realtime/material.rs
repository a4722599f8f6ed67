//! A material on the device: the uniform that surface.wgsl declares, and its textures.

use std::sync::Arc;

use encase::ShaderType;
use glam::{Vec3, Vec4};
use kinran_scene::AlphaMode;
use kinran_shading::DIELECTRIC_F0;
use wgpu::BindingResource::{Sampler, TextureView};
use wgpu::util::{BufferInitDescriptor, DeviceExt};

use super::layouts::{Layouts, SKIN_TABLES, SLOTS, bind};
use super::textures::{Textures, skin_table};
use super::uniform::{Vec2f, Vec2u, Vec4f, transforms, uniform_bytes};
use super::{Gpu, detail, fuzz};
use crate::reference::{AnisoEncoding, BoundTexture, RenderMaterial, SkinCurvature};

/// Which pass draws a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Path {
    Deferred,
    Forward,
    Blended,
}

/// A material on the device.
pub(super) struct LoadedMaterial {
    uniform: wgpu::Buffer,
    fuzz: wgpu::Buffer,
    fuzz_table: wgpu::Texture,
    pub(super) bind_group: wgpu::BindGroup,
    pub(super) detail: Option<Detail>,
    pub(super) path: Path,
    pub(super) double_sided: bool,
    /// Fibres or skin; see `LAYERED` in surface.wgsl.
    pub(super) layered: bool,
    /// Alpha below a cutoff is a hole.
    pub(super) cutout: bool,
}

/// Maps blended from tiles.
pub(super) struct Detail {
    uniform: wgpu::Buffer,
    pub(super) bind_group: wgpu::BindGroup,
}

/// What a person may turn of a material whose roughness and normals are baked, without baking again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adjustment {
    /// Multiplies both alphas.
    pub roughness: f32,
    /// Exponent of the ratio of the two alphas; their product stays. 0 is round, 1 as baked.
    pub anisotropy: f32,
    /// Turns the direction of the larger alpha, radians, counter-clockwise about the normal.
    pub rotation: f32,
    /// Multiplies x and y of the normal map.
    pub normal_scale: f32,
}

impl Default for Adjustment {
    /// As baked.
    fn default() -> Self {
        Self { roughness: 1.0, anisotropy: 1.0, rotation: 0.0, normal_scale: 1.0 }
    }
}

#[derive(ShaderType)]
pub(super) struct Material {
    base_color: Vec4f,
    emissive: Vec4f,
    factors: Vec4f,
    flags: Vec2u,
    khr: Vec2f,
    adjustment: Vec4f,
    translucency: Vec4f,
    dielectric: Vec4f,
    transforms: [Vec4f; 2 * SLOTS],
    skin: Vec4f,
    skin_gloss: Vec4f,
    skin_shadow: Vec4f,
}

/// Textures of a material, `white` where it has none.
fn slots<'a>(m: &'a RenderMaterial, white: &'a BoundTexture) -> [&'a BoundTexture; SLOTS] {
    let (translucency, dielectric) = (m.translucency.as_ref(), m.drawn_dielectric());
    [
        m.surface.as_ref().map_or(white, |s| &s.normal),
        m.surface.as_ref().map_or(white, |s| &s.aniso),
        m.drawn_base_color().unwrap_or(white),
        m.drawn_metallic_roughness().unwrap_or(white),
        m.occlusion.as_ref().unwrap_or(white),
        m.emissive.as_ref().unwrap_or(white),
        translucency.and_then(|t| t.map.as_ref()).unwrap_or(white),
        translucency.and_then(|t| t.color.as_ref()).unwrap_or(white),
        dielectric.and_then(|d| d.map.as_ref()).unwrap_or(white),
    ]
}

fn uniform(m: &RenderMaterial, adjustment: Adjustment, curvature_range: f32) -> Material {
    let (mode, cutoff) = match m.alpha_mode {
        AlphaMode::Opaque => (0, 0.0),
        AlphaMode::Mask { cutoff } => (1, cutoff),
        AlphaMode::Blend => (2, 0.0),
    };
    let (surface, khr) = match m.surface.as_ref().map(|surface| surface.encoding) {
        None => (0, [0.0; 2]),
        Some(AnisoEncoding::Texel) => (1, [0.0; 2]),
        Some(AnisoEncoding::Khr { strength, rotation }) => (2, [strength, rotation]),
    };
    let Adjustment { roughness, anisotropy, rotation, normal_scale } = adjustment;
    let [skin, skin_gloss, skin_shadow] = skin(m, curvature_range);
    let default = Vec3::splat(DIELECTRIC_F0).extend(1.0);
    let dielectric = m.drawn_dielectric().map_or(default, |d| d.f0.extend(d.strength));
    Material {
        base_color: m.base_color_factor.into(),
        emissive: m.emissive_factor.extend(m.occlusion_strength).into(),
        factors: [m.metallic_factor, m.roughness_factor, cutoff, m.transmission].into(),
        flags: [surface, mode].into(),
        khr: khr.into(),
        adjustment: [roughness, anisotropy, rotation, normal_scale].into(),
        translucency: m.translucency.as_ref().map_or(Vec4::ZERO, |t| t.color_factor.extend(t.factor)).into(),
        dielectric: dielectric.into(),
        transforms: transforms(&slots(m, &BoundTexture::constant([1.0; 4]))),
        skin,
        skin_gloss,
        skin_shadow,
    }
}

fn skin(m: &RenderMaterial, curvature_range: f32) -> [Vec4f; 3] {
    let Some(skin) = &m.skin else { return [Vec4f::default(); 3] };
    let kind = match skin.curvature {
        SkinCurvature::Zero => 1.0,
        SkinCurvature::Mean => 2.0,
        SkinCurvature::Directional => 3.0,
        SkinCurvature::Normalized => 4.0,
    };
    let narrow = if skin.penumbra > 0.0 { skin.penumbra.recip() } else { 0.0 };
    [
        [kind, skin.tables.range.recip(), curvature_range, skin.second_alpha].into(),
        skin.normal_blur.extend(skin.second_share).into(),
        [skin.penumbra / skin.millimetres, narrow, 0.0, 0.0].into(),
    ]
}

impl LoadedMaterial {
    /// Brings a material to the device.
    pub(super) fn new(
        textures: &mut Textures,
        layouts: &Layouts,
        m: &RenderMaterial,
        curvature_range: f32,
    ) -> Self {
        let gpu = textures.gpu;
        let buffer = |contents: &[u8]| {
            let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
            gpu.device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
        };
        let white = BoundTexture::constant([1.0; 4]);
        let uniform = buffer(&uniform_bytes(&uniform(m, Adjustment::default(), curvature_range)));
        let fuzz = buffer(&uniform_bytes(&fuzz::uniform(m)));
        let fuzz_table = fuzz::table_texture(gpu);
        fuzz::write_table(gpu, &fuzz_table, m);
        let fuzz_table_view = fuzz_table.create_view(&wgpu::TextureViewDescriptor::default());

        let slots = slots(m, &white);
        let (views, samplers) = bound(textures, &slots);
        let (fuzz_views, fuzz_samplers) = bound(textures, &fuzz::slots(m, &white));
        let tables: Vec<_> = match m.skin.as_ref().map(|skin| &skin.tables) {
            Some(t) => [&t.punctual, &t.ambient, &t.penumbra].map(|table| skin_table(gpu, table)).into(),
            None => vec![views[0].clone(); SKIN_TABLES],
        };
        let resources = std::iter::once(uniform.as_entire_binding())
            .chain(views.iter().map(TextureView))
            .chain(samplers.iter().map(Sampler))
            .chain([fuzz.as_entire_binding()])
            .chain(fuzz_views.iter().map(TextureView))
            .chain(fuzz_samplers.iter().map(Sampler))
            .chain(tables.iter().map(TextureView))
            .chain([TextureView(&fuzz_table_view)]);
        let bind_group = bind(gpu, &layouts.material, resources);

        let detail = m.detail.as_ref().map(|detail| {
            let uniform = buffer(&uniform_bytes(&detail::uniform(detail)));
            let views = detail::textures(detail, &white.texture).map(|texture| textures.view(texture));
            let samplers = detail::wraps(detail).map(|wrap| textures.sampler([wrap; 2]));
            let resources = std::iter::once(uniform.as_entire_binding())
                .chain(views.iter().map(TextureView))
                .chain(samplers.iter().map(Sampler));
            let bind_group = bind(gpu, &layouts.detail, resources);
            Detail { uniform, bind_group }
        });
        LoadedMaterial {
            uniform,
            fuzz,
            fuzz_table,
            bind_group,
            detail,
            path: path(m),
            double_sided: m.double_sided,
            layered: is_layered(m),
            cutout: matches!(m.alpha_mode, AlphaMode::Mask { .. }),
        }
    }

    /// Other factors, another fuzz and other detail from the next frame on; the textures stay.
    pub(super) fn set(
        &mut self,
        gpu: &Gpu,
        m: &RenderMaterial,
        adjustment: Adjustment,
        curvature_range: f32,
    ) {
        let write = |buffer, bytes: Vec<u8>| gpu.queue.write_buffer(buffer, 0, &bytes);
        write(&self.uniform, uniform_bytes(&uniform(m, adjustment, curvature_range)));
        write(&self.fuzz, uniform_bytes(&fuzz::uniform(m)));
        fuzz::write_table(gpu, &self.fuzz_table, m);
        if let (Some(there), Some(detail)) = (&self.detail, &m.detail) {
            write(&there.uniform, uniform_bytes(&detail::uniform(detail)));
        }
        self.path = path(m);
        self.layered = is_layered(m);
    }
}

fn bound(textures: &mut Textures, slots: &[&BoundTexture]) -> (Vec<wgpu::TextureView>, Vec<wgpu::Sampler>) {
    let views = slots.iter().map(|slot| textures.view(&slot.texture)).collect();
    let samplers = slots.iter().map(|slot| textures.sampler(slot.texture.wrap)).collect();
    (views, samplers)
}

fn is_layered(m: &RenderMaterial) -> bool {
    m.fuzz.is_some() || m.skin.is_some()
}

/// The pass that draws a material.
fn path(m: &RenderMaterial) -> Path {
    // In the G-buffer light comes through in the base colour.
    let own_color = m.translucency.as_ref().is_some_and(|t| {
        let same = |a: &BoundTexture, b: &BoundTexture| {
            Arc::ptr_eq(&a.texture, &b.texture) && (a.uv_set, a.transform) == (b.uv_set, b.transform)
        };
        let same_map = match (&t.color, &m.base_color) {
            (Some(a), Some(b)) => same(a, b),
            (a, b) => a.is_none() && b.is_none(),
        };
        t.factor > 0.0 && !(same_map && t.color_factor == m.base_color_factor.truncate())
    });
    if m.alpha_mode == AlphaMode::Blend || m.transmission > 0.0 {
        Path::Blended
    } else if m.surface.is_some()
        || own_color
        || m.dielectric.is_some()
        || m.skin.is_some()
        || fuzz::is_forward(m)
        || detail::is_forward(&m.detail)
    {
        Path::Forward
    } else {
        Path::Deferred
    }
}
