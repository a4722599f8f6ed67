//! What a renderer draws into.

use encase::ShaderSize;

use super::device::{Gpu, read_back};
use super::frame::Frame;
use super::timer::Timer;
use crate::Error;
use crate::reference::Film;

pub(super) const HDR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
pub(super) const SUM: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Base colour, normal, factors.
pub(super) const G_BUFFER: [wgpu::TextureFormat; 3] =
    [wgpu::TextureFormat::Rgba8UnormSrgb, wgpu::TextureFormat::R32Uint, wgpu::TextureFormat::Rgba8Unorm];

/// Texels along a side of the shadow map; chosen by eye.
const SHADOW_SIZE: u32 = 2048;

/// The buffers of a picture of one size, and the sum of the frames drawn so far. What a frame is drawn with, its shadow map and
/// its settings, belongs to its picture: a renderer may draw several in turn.
pub struct Target {
    /// Pixels in a row, rows.
    pub size: (u32, u32),
    /// Frames in the sum.
    pub frames: u32,
    hdr: wgpu::TextureView,
    depth: wgpu::TextureView,
    g_buffer: [wgpu::TextureView; 3],
    /// Written in turn.
    sums: [wgpu::TextureView; 2],
    /// Drawn with the first frame.
    shadow_map: wgpu::TextureView,
    /// Of the last frame.
    frame: wgpu::Buffer,
}

/// A texture that is drawn into and read.
fn texture(
    device: &wgpu::Device,
    (width, height): (u32, u32),
    format: wgpu::TextureFormat,
) -> wgpu::TextureView {
    let mut usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
    if format == SUM {
        usage |= wgpu::TextureUsages::COPY_SRC;
    }
    let descriptor = wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    };
    device.create_texture(&descriptor).create_view(&wgpu::TextureViewDescriptor::default())
}

impl Target {
    /// An empty picture.
    pub(super) fn on(gpu: &Gpu, size: (u32, u32)) -> Self {
        let device = &gpu.device;
        let texture = |format| texture(device, size, format);
        Self {
            size,
            frames: 0,
            hdr: texture(HDR),
            depth: texture(DEPTH),
            g_buffer: G_BUFFER.map(texture),
            sums: [texture(SUM), texture(SUM)],
            shadow_map: self::texture(device, (SHADOW_SIZE, SHADOW_SIZE), DEPTH),
            frame: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("frame"),
                size: Frame::SHADER_SIZE.get(),
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
        }
    }

    /// Forgets all frames.
    pub(super) fn empty(&mut self, gpu: &Gpu) {
        if self.frames > 0 {
            self.frames = 0;
            self.sums = [(); 2].map(|()| texture(&gpu.device, self.size, SUM));
        }
    }

    pub(super) fn hdr(&self) -> &wgpu::TextureView {
        &self.hdr
    }

    pub(super) fn shadow_map(&self) -> &wgpu::TextureView {
        &self.shadow_map
    }

    /// The uniform of the last frame.
    pub(super) fn frame(&self) -> &wgpu::Buffer {
        &self.frame
    }

    pub(super) fn depth(&self) -> &wgpu::TextureView {
        &self.depth
    }

    pub(super) fn g_buffer(&self) -> [&wgpu::TextureView; 3] {
        self.g_buffer.each_ref()
    }

    /// The sum so far, and where the next one goes.
    pub(super) fn sums(&self) -> [&wgpu::TextureView; 2] {
        let [even, odd] = &self.sums;
        if self.frames.is_multiple_of(2) { [even, odd] } else { [odd, even] }
    }

    /// Clears everything and draws into the G-buffer.
    pub(super) fn fill_pass<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        timer: Option<&Timer>,
    ) -> wgpu::RenderPass<'a> {
        let clear = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
        let [base, normal, factors] = self.g_buffer();
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("fill"),
            color_attachments: &[base, normal, factors, &self.hdr].map(|view| color_attachment(view, clear)),
            depth_stencil_attachment: Some(depth_attachment(&self.depth, wgpu::LoadOp::Clear(1.0))),
            timestamp_writes: timer.map(|timer| timer.pass("fill")),
            ..Default::default()
        })
    }

    /// Draws over what the deferred path left, or over nothing.
    pub(super) fn hdr_pass<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        deferred: bool,
        timer: Option<&Timer>,
    ) -> wgpu::RenderPass<'a> {
        let (color, depth) = if deferred {
            (wgpu::LoadOp::Load, wgpu::LoadOp::Load)
        } else {
            (wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), wgpu::LoadOp::Clear(1.0))
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("forward"),
            color_attachments: &[color_attachment(&self.hdr, color)],
            depth_stencil_attachment: Some(depth_attachment(&self.depth, depth)),
            timestamp_writes: timer.map(|timer| timer.pass("forward")),
            ..Default::default()
        })
    }

    /// The mean of all frames as linear radiance.
    ///
    /// # Errors
    /// [`Error::Gpu`] when the device does not give it back.
    pub fn film(&self, gpu: &Gpu) -> Result<Film, Error> {
        let (width, height) = self.size;
        // Rows are padded to 256 bytes.
        let row = (16 * width).next_multiple_of(256);
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let texture = self.sums()[0].texture();
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        gpu.queue.submit([encoder.finish()]);

        let bytes = read_back(gpu, &buffer)?;
        let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        let pixel = |p: &[u8]| {
            let [r, g, b, frames] = [0, 4, 8, 12].map(|at| number(&p[at..]));
            [r, g, b].map(|c| c / frames)
        };
        let rows = bytes.chunks_exact(row as usize);
        let pixels = rows.flat_map(|row| row[..16 * width as usize].chunks_exact(16).map(pixel)).collect();
        Ok(Film { width, height, pixels })
    }
}

pub(super) fn depth_attachment(
    view: &wgpu::TextureView,
    load: wgpu::LoadOp<f32>,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    }
}

fn color_attachment(
    view: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
    Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
}

pub(super) fn color_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    view: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
    timestamp_writes: Option<wgpu::RenderPassTimestampWrites>,
) -> wgpu::RenderPass<'a> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[color_attachment(view, load)],
        timestamp_writes,
        ..Default::default()
    })
}
