//! A scene on the GPU.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Mat3, Vec3, Vec4};
use half::f16;
use kinran_image::{Format, Texture, Transfer};
use kinran_scene::{AlphaMode, Light, Wrap};
use rayon::prelude::*;
use wgpu::util::{BufferInitDescriptor, DeviceExt, TextureDataOrder};

use super::{Gpu, Layouts, detail, fuzz, probe};
use crate::reference::{
    AnisoEncoding, BoundTexture, FLAT, MipTexture, RenderMaterial, RenderScene, SkinCurvature, SkinTable,
    Surroundings, TextureFiltering,
};

/// Floats of a vertex: position, normal, tangent, both UV sets, colour, code of curvature.
pub(super) const VERTEX_FLOATS: usize = 3 + 3 + 4 + 4 + 4 + 4;

/// Which pass draws a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Path {
    Deferred,
    Forward,
    Blended,
}

/// Triangles of one material that lie one after the other.
pub(super) struct Draw {
    pub(super) material: usize,
    pub(super) indices: std::ops::Range<u32>,
    /// Middle, for sorting.
    pub(super) middle: Vec3,
}

pub(super) struct Material {
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

/// All that is drawn.
pub struct GpuScene {
    pub(super) vertices: wgpu::Buffer,
    pub(super) indices: wgpu::Buffer,
    pub(super) draws: Vec<Draw>,
    pub(super) materials: Vec<Material>,
    pub(super) light: GpuLight,
    pub(super) scene: RenderScene,
}

/// Little-endian bytes.
pub(super) fn bytes(floats: &[f32]) -> Vec<u8> {
    floats.iter().flat_map(|f| f.to_le_bytes()).collect()
}

impl GpuScene {
    /// What is drawn, as it was given.
    pub fn scene(&self) -> &RenderScene {
        &self.scene
    }

    /// Other lights from the next frame on.
    pub fn set_lights(&mut self, lights: Vec<Light>) {
        self.scene.lights = lights;
    }

    /// Other factors, another fuzz and other detail for a material from the next frame on; its textures stay.
    pub fn set_material(
        &mut self,
        gpu: &Gpu,
        index: usize,
        material: &RenderMaterial,
        adjustment: Adjustment,
    ) {
        let floats = material_floats(material, adjustment, self.scene.geometry.curvature_range());
        gpu.queue.write_buffer(&self.materials[index].uniform, 0, &bytes(&floats));
        gpu.queue.write_buffer(&self.materials[index].fuzz, 0, &bytes(&fuzz::floats(material)));
        fuzz::write_table(gpu, &self.materials[index].fuzz_table, material);
        if let (Some(there), Some(detail)) = (&self.materials[index].detail, &material.detail) {
            gpu.queue.write_buffer(&there.uniform, 0, &bytes(&detail::floats(detail)));
        }
        self.materials[index].path = path(material);
        self.materials[index].layered = is_layered(material);
    }

    pub(super) fn new(
        gpu: &Gpu,
        layouts: &Layouts,
        scene: &RenderScene,
        light: &GpuLight,
        filtering: TextureFiltering,
    ) -> Self {
        let buffer = |contents: &[u8], usage| {
            gpu.device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
        };

        // Geometry, one draw for each run of triangles of the same material.
        let geometry = &scene.geometry;
        let mut vertices = Vec::with_capacity(geometry.positions.len() * VERTEX_FLOATS);
        for i in 0..geometry.positions.len() {
            vertices.extend(geometry.positions[i].to_array());
            vertices.extend(geometry.normals[i].to_array());
            vertices.extend(geometry.tangents[i].to_array());
            vertices.extend(geometry.uvs[i].iter().flat_map(|uv| uv.to_array()));
            vertices.extend(geometry.colors[i].to_array());
            vertices.extend(geometry.curvature.get(i).copied().unwrap_or(FLAT).to_array());
        }
        let indices: Vec<u8> = geometry.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
        let mut draws: Vec<Draw> = Vec::new();
        for run in (0..geometry.triangles.len())
            .collect::<Vec<_>>()
            .chunk_by(|&a, &b| geometry.materials[a] == geometry.materials[b])
        {
            let corners = run.iter().flat_map(|&t| geometry.triangles[t]);
            let sum: Vec3 = corners.map(|i| geometry.positions[i as usize]).sum();
            draws.push(Draw {
                material: geometry.materials[run[0]] as usize,
                indices: 3 * run[0] as u32..3 * (run[run.len() - 1] + 1) as u32,
                middle: sum / (3 * run.len()) as f32,
            });
        }

        let mut textures = Textures { gpu, filtering, views: HashMap::new(), samplers: HashMap::new() };
        let materials = {
            let range = geometry.curvature_range();
            scene.materials.iter().map(|m| material(&mut textures, layouts, m, range)).collect()
        };
        Self {
            vertices: buffer(&bytes(&vertices), wgpu::BufferUsages::VERTEX),
            indices: buffer(&indices, wgpu::BufferUsages::INDEX),
            draws,
            materials,
            light: light.clone(),
            scene: scene.clone(),
        }
    }
}

/// Light from all around on the GPU; cloning shares it.
#[derive(Clone)]
pub struct GpuLight {
    /// With all mips.
    pub(super) environment: wgpu::TextureView,
}

impl GpuLight {
    pub(super) fn new(gpu: &Gpu, surroundings: Option<&Surroundings>) -> Self {
        let Some(surroundings) = surroundings else {
            let environment = float_texture(gpu, (1, 1), &half_levels(&[vec![Vec3::ZERO]]));
            return Self { environment };
        };
        let environment = &surroundings.environment;
        let size = (environment.width() as u32, environment.height() as u32);
        Self { environment: float_texture(gpu, size, &half_levels(&probe::levels(environment))) }
    }
}

fn half_levels(levels: &[Vec<Vec3>]) -> Vec<Vec<u8>> {
    let opaque = |level: &Vec<Vec3>| level.iter().map(|c| c.extend(1.0).to_array()).collect::<Vec<_>>();
    levels.iter().map(|level| half_bytes(&opaque(level))).collect()
}

fn half_bytes(texels: &[[f32; 4]]) -> Vec<u8> {
    let mut bytes = vec![0; texels.len() * 8];
    bytes.par_chunks_exact_mut(8).with_min_len(1 << 14).zip(texels).for_each(|(bytes, texel)| {
        for (bytes, x) in bytes.chunks_exact_mut(2).zip(texel) {
            bytes.copy_from_slice(&half(*x));
        }
    });
    bytes
}

/// Bytes of a half float; what is larger than it holds becomes its largest number.
fn half(x: f32) -> [u8; 2] {
    f16::from_f32(x.clamp(-65504.0, 65504.0)).to_le_bytes()
}

fn create_texture(
    gpu: &Gpu,
    (width, height): (u32, u32),
    format: wgpu::TextureFormat,
    levels: &[impl AsRef<[u8]>],
) -> wgpu::TextureView {
    let descriptor = wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: levels.len() as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let data: Vec<u8> = levels.iter().flat_map(|level| level.as_ref()).copied().collect();
    let texture =
        gpu.device.create_texture_with_data(&gpu.queue, &descriptor, TextureDataOrder::MipMajor, &data);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn float_texture(gpu: &Gpu, size: (u32, u32), levels: &[Vec<u8>]) -> wgpu::TextureView {
    create_texture(gpu, size, wgpu::TextureFormat::Rgba16Float, levels)
}

/// The reference's table of what grazing light reflects.
pub(super) fn albedo_table(gpu: &Gpu) -> wgpu::TextureView {
    use crate::reference::albedo::{GRAZING, SIZE};
    let texels = GRAZING.iter().map(|&x| Vec3::splat(x)).collect();
    float_texture(gpu, (SIZE as u32, SIZE as u32), &half_levels(&[texels]))
}

/// Textures and samplers, each uploaded once however many materials use it.
struct Textures<'a> {
    gpu: &'a Gpu,
    filtering: TextureFiltering,
    /// By address of the texels, which the scene keeps alive.
    views: HashMap<usize, wgpu::TextureView>,
    samplers: HashMap<[Wrap; 2], wgpu::Sampler>,
}

impl Textures<'_> {
    fn view(&mut self, texture: &Arc<MipTexture>) -> wgpu::TextureView {
        let gpu = self.gpu;
        let upload = || {
            encoded(gpu, texture).unwrap_or_else(|| {
                let levels: Vec<Vec<u8>> =
                    texture.levels.iter().map(|level| half_bytes(&level.texels)).collect();
                float_texture(gpu, (texture.levels[0].width, texture.levels[0].height), &levels)
            })
        };
        self.views.entry(Arc::as_ptr(texture) as usize).or_insert_with(upload).clone()
    }

    fn sampler(&mut self, wrap: [Wrap; 2]) -> wgpu::Sampler {
        let mode = |wrap| match wrap {
            Wrap::Repeat => wgpu::AddressMode::Repeat,
            Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
            Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
        };
        let (lod_max_clamp, anisotropy_clamp) = match self.filtering {
            TextureFiltering::Mips { max_anisotropy } => (32.0, max_anisotropy as u16),
            TextureFiltering::Level0 => (0.0, 1),
        };
        let create = || {
            self.gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                address_mode_u: mode(wrap[0]),
                address_mode_v: mode(wrap[1]),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                mipmap_filter: wgpu::MipmapFilterMode::Linear,
                lod_max_clamp,
                anisotropy_clamp,
                ..Default::default()
            })
        };
        self.samplers.entry(wrap).or_insert_with(create).clone()
    }
}

/// The blocks as they are, where the device reads them.
fn encoded(gpu: &Gpu, texture: &MipTexture) -> Option<wgpu::TextureView> {
    use wgpu::TextureFormat as F;
    let encoded: &Texture = texture.encoded.as_ref()?;
    let srgb = encoded.transfer == Transfer::Srgb;
    let format = match (encoded.format, srgb) {
        (Format::Bc1, false) => F::Bc1RgbaUnorm,
        (Format::Bc1, true) => F::Bc1RgbaUnormSrgb,
        (Format::Bc4, _) => F::Bc4RUnorm,
        (Format::Bc5, _) => F::Bc5RgUnorm,
        (Format::Bc7, false) => F::Bc7RgbaUnorm,
        (Format::Bc7, true) => F::Bc7RgbaUnormSrgb,
        (Format::Rgba8, false) => F::Rgba8Unorm,
        (Format::Rgba8, true) => F::Rgba8UnormSrgb,
        _ => return None,
    };
    let (width, height) = (encoded.levels[0].width, encoded.levels[0].height);
    // WebGPU wants whole blocks on level 0.
    let (columns, rows) = format.block_dimensions();
    let readable = format.required_features() & !gpu.device.features() == wgpu::Features::empty();
    let whole = width % columns == 0 && height % rows == 0;
    let levels: Vec<&[u8]> = encoded.levels.iter().map(|level| level.data.as_slice()).collect();
    (readable && whole).then(|| create_texture(gpu, (width, height), format, &levels))
}

/// A table of skin.
fn skin_table(gpu: &Gpu, table: &SkinTable) -> wgpu::TextureView {
    float_texture(
        gpu,
        (table.width as u32, table.height as u32),
        &half_levels(std::slice::from_ref(&table.texels)),
    )
}

/// Textures of a material.
pub(super) const SLOTS: usize = 8;

/// They, `white` where it has none.
fn slots<'a>(m: &'a RenderMaterial, white: &'a BoundTexture) -> [&'a BoundTexture; SLOTS] {
    let translucency = m.translucency.as_ref();
    [
        m.surface.as_ref().map_or(white, |s| &s.normal),
        m.surface.as_ref().map_or(white, |s| &s.aniso),
        m.base_color.as_ref().unwrap_or(white),
        m.metallic_roughness.as_ref().unwrap_or(white),
        m.occlusion.as_ref().unwrap_or(white),
        m.emissive.as_ref().unwrap_or(white),
        translucency.and_then(|t| t.map.as_ref()).unwrap_or(white),
        translucency.and_then(|t| t.color.as_ref()).unwrap_or(white),
    ]
}

/// The uniform that surface.wgsl declares.
fn material_floats(m: &RenderMaterial, adjustment: Adjustment, curvature_range: f32) -> Vec<f32> {
    let (mode, cutoff) = match m.alpha_mode {
        AlphaMode::Opaque => (0, 0.0),
        AlphaMode::Mask { cutoff } => (1, cutoff),
        AlphaMode::Blend => (2, 0.0),
    };
    let mut floats = m.base_color_factor.to_array().to_vec();
    floats.extend(m.emissive_factor.extend(m.occlusion_strength).to_array());
    floats.extend([m.metallic_factor, m.roughness_factor, cutoff, m.transmission]);
    let (surface, strength, rotation) = match m.surface.as_ref().map(|surface| surface.encoding) {
        None => (0, 0.0, 0.0),
        Some(AnisoEncoding::Texel) => (1, 0.0, 0.0),
        Some(AnisoEncoding::Khr { strength, rotation }) => (2, strength, rotation),
    };
    floats.extend([f32::from_bits(surface), f32::from_bits(mode), strength, rotation]);
    let Adjustment { roughness, anisotropy, rotation, normal_scale } = adjustment;
    floats.extend([roughness, anisotropy, rotation, normal_scale]);
    let translucency = m.translucency.as_ref().map_or(Vec4::ZERO, |t| t.color_factor.extend(t.factor));
    floats.extend(translucency.to_array());
    for slot in slots(m, &BoundTexture::constant([1.0; 4])) {
        let Mat3 { x_axis, y_axis, z_axis } = slot.transform;
        floats.extend([x_axis.x, y_axis.x, z_axis.x, slot.uv_set as f32]);
        floats.extend([x_axis.y, y_axis.y, z_axis.y, 0.0]);
    }
    let Some(skin) = &m.skin else {
        floats.extend([0.0; 12]);
        return floats;
    };
    let kind = match skin.curvature {
        SkinCurvature::Zero => 1.0,
        SkinCurvature::Mean => 2.0,
        SkinCurvature::Directional => 3.0,
        SkinCurvature::Normalized => 4.0,
    };
    floats.extend([kind, skin.tables.range.recip(), curvature_range, skin.second_alpha]);
    floats.extend(skin.normal_blur.extend(skin.second_share).to_array());
    let narrow = if skin.penumbra > 0.0 { skin.penumbra.recip() } else { 0.0 };
    floats.extend([skin.penumbra / skin.millimetres, narrow, 0.0, 0.0]);
    floats
}

fn material(
    textures: &mut Textures,
    layouts: &Layouts,
    m: &RenderMaterial,
    curvature_range: f32,
) -> Material {
    let white = BoundTexture::constant([1.0; 4]);
    let slots = slots(m, &white);
    let buffer = |floats: &[f32]| {
        textures.gpu.device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents: &bytes(floats),
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        })
    };
    let uniform = buffer(&material_floats(m, Adjustment::default(), curvature_range));
    let fuzz = buffer(&fuzz::floats(m));

    let views = slots.map(|slot| textures.view(&slot.texture));
    let samplers = slots.map(|slot| textures.sampler(slot.texture.wrap));
    let mut entries = vec![wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }];
    let resources = (views.iter().map(wgpu::BindingResource::TextureView))
        .chain(samplers.iter().map(wgpu::BindingResource::Sampler));
    for (i, resource) in resources.enumerate() {
        entries.push(wgpu::BindGroupEntry { binding: i as u32 + 1, resource });
    }
    let fuzz_slots = fuzz::slots(m, &white);
    let fuzz_views = fuzz_slots.map(|slot| textures.view(&slot.texture));
    let fuzz_samplers = fuzz_slots.map(|slot| textures.sampler(slot.texture.wrap));
    let resources = std::iter::once(fuzz.as_entire_binding())
        .chain(fuzz_views.iter().map(wgpu::BindingResource::TextureView))
        .chain(fuzz_samplers.iter().map(wgpu::BindingResource::Sampler));
    for resource in resources {
        entries.push(wgpu::BindGroupEntry { binding: entries.len() as u32, resource });
    }
    let tables = m.skin.as_ref().map(|skin| &skin.tables);
    let tables = tables.map(|t| [&t.punctual, &t.ambient, &t.penumbra]);
    let tables: Vec<_> = match tables {
        Some(tables) => tables.map(|table| skin_table(textures.gpu, table)).into(),
        None => vec![views[0].clone(); 3],
    };
    for table in &tables {
        let resource = wgpu::BindingResource::TextureView(table);
        entries.push(wgpu::BindGroupEntry { binding: entries.len() as u32, resource });
    }
    let fuzz_table = fuzz::table_texture(textures.gpu);
    fuzz::write_table(textures.gpu, &fuzz_table, m);
    let view = fuzz_table.create_view(&wgpu::TextureViewDescriptor::default());
    let resource = wgpu::BindingResource::TextureView(&view);
    entries.push(wgpu::BindGroupEntry { binding: entries.len() as u32, resource });
    let bind_group = textures.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &layouts.material,
        entries: &entries,
    });
    let detail = m.detail.as_ref().map(|detail| {
        let uniform = buffer(&detail::floats(detail));
        let views = detail::textures(detail, &white.texture).map(|texture| textures.view(texture));
        let samplers = detail::wraps(detail).map(|wrap| textures.sampler([wrap; 2]));
        let resources = std::iter::once(uniform.as_entire_binding())
            .chain(views.iter().map(wgpu::BindingResource::TextureView))
            .chain(samplers.iter().map(wgpu::BindingResource::Sampler));
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bind_group = textures.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layouts.detail,
            entries: &entries,
        });
        Detail { uniform, bind_group }
    });
    Material {
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
        || m.skin.is_some()
        || fuzz::is_forward(m)
        || detail::is_forward(&m.detail)
    {
        Path::Forward
    } else {
        Path::Deferred
    }
}
