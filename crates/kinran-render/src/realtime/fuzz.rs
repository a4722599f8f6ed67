//! The uniform and textures of a material's fuzz.

use encase::ShaderType;
use glam::Vec3;
use half::f16;
use kinran_scene::{Fuzz, FuzzAttenuation, FuzzPhase};
use kinran_shading::fuzz::{FUZZ_TABLE_SIZE, fibre_direction, fuzz_alpha};

use super::Gpu;
use super::layouts::FUZZ_SLOTS;
use super::uniform::{Vec4f, Vec4u, transforms};
use crate::reference::{BoundTexture, FUZZ_TILTS, RenderFuzz, RenderMaterial};

#[derive(ShaderType)]
pub(super) struct FuzzMaterial {
    flags: Vec4u,
    factors: Vec4f,
    color: Vec4f,
    direction: Vec4f,
    coefficients: [Vec4f; 5 * FUZZ_TILTS],
    transforms: [Vec4f; 2 * FUZZ_SLOTS],
}

/// Direction, colour and amount, `white` where there is none.
pub(super) fn slots<'a>(m: &'a RenderMaterial, white: &'a BoundTexture) -> [&'a BoundTexture; FUZZ_SLOTS] {
    let Some(fuzz) = &m.fuzz else { return [white; FUZZ_SLOTS] };
    [&fuzz.direction, &fuzz.color, &fuzz.amount].map(|slot| slot.as_ref().unwrap_or(white))
}

/// Whether the G-buffer cannot hold it.
pub(super) fn is_forward(m: &RenderMaterial) -> bool {
    matches!(m.fuzz, Some(RenderFuzz { fuzz: Fuzz::Layer(_), .. }))
}

/// The uniform that fuzz_surface.wgsl declares.
///
/// # Panics
/// Where a layer has no coefficients.
pub(super) fn uniform(m: &RenderMaterial) -> FuzzMaterial {
    let none = FuzzMaterial {
        flags: [0; 4].into(),
        factors: Vec4f::default(),
        color: Vec4f::default(),
        direction: Vec4f::default(),
        coefficients: [Vec4f::default(); 5 * FUZZ_TILTS],
        transforms: transforms(&slots(m, &BoundTexture::constant([1.0; 4]))),
    };
    let Some(fuzz) = &m.fuzz else { return none };
    let layer = match &fuzz.fuzz {
        Fuzz::Layer(layer) => layer,
        Fuzz::Simple { fuzziness, .. } => {
            return FuzzMaterial {
                flags: [2, 0, 0, 0].into(),
                factors: [*fuzziness, 1.0, 0.0, 0.0].into(),
                color: Vec3::ONE.extend(0.0).into(),
                direction: Vec3::Z.extend(0.0).into(),
                ..none
            };
        }
    };
    let phase = match layer.phase {
        FuzzPhase::Fibre => 0,
        FuzzPhase::Velvet => 1,
    };
    let attenuation = match layer.attenuation {
        FuzzAttenuation::Full => 0,
        FuzzAttenuation::Unscattered => 1,
        FuzzAttenuation::Albedo => 2,
        FuzzAttenuation::None => 3,
    };
    let mapped = f32::from(u8::from(fuzz.direction.is_some()));
    let fits = fuzz.fits.as_ref().expect("fit_fuzz comes before the GPU");
    let coefficients = fits.tilts.iter().flat_map(|c| {
        let [p0, p1, p2, p3, p4, p5] = c.p_s;
        let [a0, a1, a2, a3, a4, a5, a6, a7] = c.ambient;
        [[p0, p1, p2, p3], [p4, p5, c.r, 0.0], [a0, a1, a2, a3], [a4, a5, a6, a7], c.direction]
    });
    let mut uniform = FuzzMaterial {
        flags: [1, phase, attenuation, u32::from(fuzz.talk_ambient)].into(),
        factors: [layer.density, fuzz_alpha(layer.spread), layer.normal_smoothness, mapped].into(),
        color: layer.color.extend(0.0).into(),
        direction: fibre_direction(layer.tilt, layer.azimuth).extend(0.0).into(),
        ..none
    };
    for (held, coefficients) in uniform.coefficients.iter_mut().zip(coefficients) {
        *held = coefficients.into();
    }
    uniform
}

/// A texture for the table of combed fibres, one for each material, that its fuzz may be another one later.
pub(super) fn table_texture(gpu: &Gpu) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("fuzz table"),
        size: TABLE,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format: wgpu::TextureFormat::Rg16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

const TABLE: wgpu::Extent3d = wgpu::Extent3d {
    width: FUZZ_TABLE_SIZE,
    height: FUZZ_TABLE_SIZE,
    depth_or_array_layers: FUZZ_TILTS as u32,
};

/// Writes the table of a material that has one; others do not read it.
pub(super) fn write_table(gpu: &Gpu, texture: &wgpu::Texture, m: &RenderMaterial) {
    let fits = m.fuzz.as_ref().and_then(|fuzz| fuzz.fits.as_ref());
    let Some(table) = fits.and_then(|fits| fits.table.as_ref()) else { return };
    let texels: Vec<u8> = table.iter().flatten().flat_map(|&x| f16::from_f32(x).to_le_bytes()).collect();
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(4 * FUZZ_TABLE_SIZE),
        rows_per_image: Some(FUZZ_TABLE_SIZE),
    };
    gpu.queue.write_texture(texture.as_image_copy(), &texels, layout, TABLE);
}
