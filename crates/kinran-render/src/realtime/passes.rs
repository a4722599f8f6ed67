//! The passes of a frame, in their order.

use glam::Vec3;

use super::Gpu;
use super::layouts::{Layouts, bind};
use super::material::{LoadedMaterial, Path};
use super::pipelines::Pipelines;
use super::settings::{Channel, Settings};
use super::target::{Target, color_pass, depth_attachment};
use super::timer::Timer;
use super::upload::{Draw, GpuScene};

/// What the passes of one frame share.
pub(super) struct Passes<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) layouts: &'a Layouts,
    pub(super) pipelines: &'a Pipelines,
    pub(super) scene: &'a GpuScene,
    pub(super) settings: &'a Settings,
    pub(super) target: &'a Target,
    /// Group 0.
    pub(super) frame: &'a wgpu::BindGroup,
    pub(super) timer: Option<&'a Timer>,
}

impl<'a> Passes<'a> {
    /// What takes one of the paths.
    fn draws(&self, wanted: Path) -> impl Iterator<Item = &'a Draw> {
        let (scene, settings) = (self.scene, self.settings);
        let path = move |draw: &&Draw| match scene.materials[draw.material].path {
            Path::Forward if settings.all_deferred && settings.channel == Channel::Lit => Path::Deferred,
            // The G-buffer has no channels to show.
            Path::Deferred if settings.channel != Channel::Lit => Path::Forward,
            path => path,
        };
        scene.draws.iter().filter(move |draw| path(draw) == wanted)
    }

    /// Whether anything is drawn by way of the G-buffer.
    pub(super) fn is_deferred(&self) -> bool {
        self.draws(Path::Deferred).next().is_some()
    }

    fn set_mesh(&self, pass: &mut wgpu::RenderPass) {
        pass.set_vertex_buffer(0, self.scene.vertices.slice(..));
        pass.set_index_buffer(self.scene.indices.slice(..), wgpu::IndexFormat::Uint32);
    }

    /// Depth from the light that casts shadows.
    pub(super) fn shadows(&self, encoder: &mut wgpu::CommandEncoder) {
        let frame = self.target.frame().as_entire_binding();
        let group = bind(self.gpu, &self.layouts.shadow, [frame]);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow"),
            depth_stencil_attachment: Some(depth_attachment(
                self.target.shadow_map(),
                wgpu::LoadOp::Clear(1.0),
            )),
            timestamp_writes: self.timer.map(|timer| timer.pass("shadow")),
            ..Default::default()
        });
        pass.set_bind_group(0, &group, &[]);
        self.set_mesh(&mut pass);
        let materials = &self.scene.materials;
        for draw in self.scene.draws.iter().filter(|draw| materials[draw.material].path != Path::Blended) {
            let material = &materials[draw.material];
            if material.cutout {
                pass.set_pipeline(&self.pipelines.of(material).cutout);
                set_material(&mut pass, material);
            } else {
                pass.set_pipeline(&self.pipelines.shadow);
            }
            pass.draw_indexed(draw.indices.clone(), 0, 0..1);
        }
    }

    /// The G-buffer.
    pub(super) fn fill(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = self.target.fill_pass(encoder, self.timer);
        pass.set_bind_group(0, self.frame, &[]);
        self.set_mesh(&mut pass);
        for draw in self.draws(Path::Deferred) {
            let material = &self.scene.materials[draw.material];
            pass.set_pipeline(&self.pipelines.of(material).fill[usize::from(material.double_sided)]);
            set_material(&mut pass, material);
            pass.draw_indexed(draw.indices.clone(), 0, 0..1);
        }
    }

    /// Light on what the G-buffer holds.
    pub(super) fn light(&self, encoder: &mut wgpu::CommandEncoder) {
        let [base, normal, factors] = self.target.g_buffer();
        let views = [base, normal, factors, self.target.depth()];
        let group = bind(self.gpu, &self.layouts.g_buffer, views.map(wgpu::BindingResource::TextureView));
        let timer = self.timer.map(|timer| timer.pass("light"));
        let mut pass = color_pass(encoder, self.target.hdr(), wgpu::LoadOp::Load, timer);
        pass.set_pipeline(&self.pipelines.light);
        pass.set_bind_group(0, self.frame, &[]);
        pass.set_bind_group(1, &group, &[]);
        pass.draw(0..3, 0..1);
    }

    /// Opaque first, then the sky behind it, then what lets both through, the farthest from `eye` first.
    pub(super) fn forward(&self, encoder: &mut wgpu::CommandEncoder, eye: Vec3) {
        let mut pass = self.target.hdr_pass(encoder, self.is_deferred(), self.timer);
        pass.set_bind_group(0, self.frame, &[]);
        self.set_mesh(&mut pass);
        for draw in self.draws(Path::Forward) {
            let material = &self.scene.materials[draw.material];
            let opaque = &self.pipelines.of(material).opaque[usize::from(material.layered)];
            pass.set_pipeline(&opaque[usize::from(material.double_sided)]);
            set_material(&mut pass, material);
            pass.draw_indexed(draw.indices.clone(), 0, 0..1);
        }
        pass.set_pipeline(&self.pipelines.sky);
        pass.draw(0..3, 0..1);
        let mut blended: Vec<_> = self.draws(Path::Blended).collect();
        blended.sort_by(|a, b| b.middle.distance(eye).total_cmp(&a.middle.distance(eye)));
        for draw in blended {
            let material = &self.scene.materials[draw.material];
            set_material(&mut pass, material);
            let pipelines = self.pipelines.of(material);
            for pipelines in [&pipelines.transmittance, &pipelines.blended] {
                pass.set_pipeline(&pipelines[usize::from(material.double_sided)]);
                pass.draw_indexed(draw.indices.clone(), 0, 0..1);
            }
        }
    }

    /// Into the sum of all frames.
    pub(super) fn accumulate(&self, encoder: &mut wgpu::CommandEncoder) {
        let [before, after] = self.target.sums();
        let views = [before, self.target.hdr()].map(wgpu::BindingResource::TextureView);
        let group = bind(self.gpu, &self.layouts.accumulate, views);
        let timer = self.timer.map(|timer| timer.pass("accumulate"));
        let mut pass = color_pass(encoder, after, wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), timer);
        pass.set_pipeline(&self.pipelines.accumulate);
        pass.set_bind_group(0, self.frame, &[]);
        pass.set_bind_group(1, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// Sets the textures and factors of a material.
fn set_material(pass: &mut wgpu::RenderPass, material: &LoadedMaterial) {
    pass.set_bind_group(1, &material.bind_group, &[]);
    if let Some(detail) = &material.detail {
        pass.set_bind_group(2, &detail.bind_group, &[]);
    }
}
