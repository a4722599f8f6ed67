//! Textures and samplers on the device.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec3;
use half::f16;
use kinran_image::{Format, Texture, Transfer};
use kinran_scene::Wrap;
use rayon::prelude::*;
use wgpu::util::{DeviceExt, TextureDataOrder};

use super::Gpu;
use crate::reference::{MipTexture, SkinTable, TextureFiltering};

pub(super) fn half_levels(levels: &[Vec<Vec3>]) -> Vec<Vec<u8>> {
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

pub(super) fn float_texture(gpu: &Gpu, size: (u32, u32), levels: &[Vec<u8>]) -> wgpu::TextureView {
    create_texture(gpu, size, wgpu::TextureFormat::Rgba16Float, levels)
}

/// The reference's table of what grazing light reflects.
pub(super) fn albedo_table(gpu: &Gpu) -> wgpu::TextureView {
    use crate::reference::albedo::{GRAZING, SIZE};
    let texels = GRAZING.iter().map(|&x| Vec3::splat(x)).collect();
    float_texture(gpu, (SIZE as u32, SIZE as u32), &half_levels(&[texels]))
}

/// Textures and samplers, each uploaded once however many materials use it.
pub(super) struct Textures<'a> {
    pub(super) gpu: &'a Gpu,
    filtering: TextureFiltering,
    /// By address of the texels, which the scene keeps alive.
    views: HashMap<usize, wgpu::TextureView>,
    samplers: HashMap<[Wrap; 2], wgpu::Sampler>,
}

impl<'a> Textures<'a> {
    pub(super) fn new(gpu: &'a Gpu, filtering: TextureFiltering) -> Self {
        Textures { gpu, filtering, views: HashMap::new(), samplers: HashMap::new() }
    }

    pub(super) fn view(&mut self, texture: &Arc<MipTexture>) -> wgpu::TextureView {
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

    pub(super) fn sampler(&mut self, wrap: [Wrap; 2]) -> wgpu::Sampler {
        let mode = |wrap| match wrap {
            Wrap::Repeat => wgpu::AddressMode::Repeat,
            Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
            Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
        };
        let most = self.filtering.max_anisotropy();
        let (lod_max_clamp, anisotropy_clamp) = most.map_or((0.0, 1), |most| (32.0, most as u16));
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
pub(super) fn skin_table(gpu: &Gpu, table: &SkinTable) -> wgpu::TextureView {
    float_texture(
        gpu,
        (table.width as u32, table.height as u32),
        &half_levels(std::slice::from_ref(&table.texels)),
    )
}
