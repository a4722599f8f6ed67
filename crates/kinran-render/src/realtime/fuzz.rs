//! The uniform and textures of a material's fuzz.

use glam::{Mat3, Vec3};
use half::f16;
use kinran_scene::{Fuzz, FuzzAttenuation, FuzzPhase};
use kinran_shading::fuzz::{FUZZ_TABLE_SIZE, fibre_direction, fuzz_alpha};

use super::Gpu;
use crate::reference::{BoundTexture, FUZZ_TILTS, RenderFuzz, RenderMaterial};

/// Floats of the uniform that fuzz_surface.wgsl declares.
const FLOATS: usize = 4 * (4 + 5 * FUZZ_TILTS + 6);

/// Direction, colour and amount, `white` where there is none.
pub(super) fn slots<'a>(m: &'a RenderMaterial, white: &'a BoundTexture) -> [&'a BoundTexture; 3] {
    let Some(fuzz) = &m.fuzz else { return [white; 3] };
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
pub(super) fn floats(m: &RenderMaterial) -> Vec<f32> {
    let mut floats = match &m.fuzz {
        None => vec![0.0; 4 * (4 + 5 * FUZZ_TILTS)],
        Some(fuzz) => of_fuzz(fuzz),
    };
    for slot in slots(m, &BoundTexture::constant([1.0; 4])) {
        let Mat3 { x_axis, y_axis, z_axis } = slot.transform;
        floats.extend([x_axis.x, y_axis.x, z_axis.x, slot.uv_set as f32]);
        floats.extend([x_axis.y, y_axis.y, z_axis.y, 0.0]);
    }
    debug_assert_eq!(floats.len(), FLOATS);
    floats
}

fn of_fuzz(fuzz: &RenderFuzz) -> Vec<f32> {
    let head = |flags: [u32; 4], factors: [f32; 4], color: Vec3, direction: Vec3| {
        let mut floats = flags.map(f32::from_bits).to_vec();
        floats.extend(factors);
        floats.extend(color.extend(0.0).to_array());
        floats.extend(direction.extend(0.0).to_array());
        floats
    };
    let layer = match &fuzz.fuzz {
        Fuzz::Layer(layer) => layer,
        Fuzz::Simple { fuzziness, .. } => {
            let mut floats = head([2, 0, 0, 0], [*fuzziness, 1.0, 0.0, 0.0], Vec3::ONE, Vec3::Z);
            floats.extend([0.0; 20 * FUZZ_TILTS]);
            return floats;
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
    let mut floats = head(
        [1, phase, attenuation, u32::from(fuzz.talk_ambient)],
        [layer.density, fuzz_alpha(layer.spread), layer.normal_smoothness, mapped],
        layer.color,
        fibre_direction(layer.tilt, layer.azimuth),
    );
    let fits = fuzz.fits.as_ref().expect("fit_fuzz comes before the GPU");
    for c in &fits.tilts {
        floats.extend(c.p_s);
        floats.extend([c.r, 0.0]);
        floats.extend(c.ambient);
        floats.extend(c.direction);
    }
    floats
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
