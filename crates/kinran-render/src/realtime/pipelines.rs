//! The pipeline of each pass.

use super::layouts::Layouts;
use super::material::LoadedMaterial;
use super::shaders::ShaderSource;
use super::target::{DEPTH, G_BUFFER, HDR, SUM};
use super::upload::VERTEX_FLOATS;
use crate::Error;

/// Pipelines of every pass; those of meshes for single-sided and double-sided materials, the forward ones also without and
/// with fibres and skin.
pub(super) struct Pipelines {
    pub(super) shadow: wgpu::RenderPipeline,
    pub(super) light: wgpu::RenderPipeline,
    pub(super) sky: wgpu::RenderPipeline,
    /// Of materials with their own maps, and of those with maps blended from tiles.
    pub(super) on_mesh: [MeshPipelines; 2],
    pub(super) accumulate: wgpu::RenderPipeline,
    pub(super) show: wgpu::RenderPipeline,
}

/// Pipelines of passes that know a material.
pub(super) struct MeshPipelines {
    pub(super) cutout: wgpu::RenderPipeline,
    pub(super) fill: [wgpu::RenderPipeline; 2],
    /// Without and with fibres and skin.
    pub(super) opaque: [[wgpu::RenderPipeline; 2]; 2],
    pub(super) transmittance: [wgpu::RenderPipeline; 2],
    pub(super) blended: [wgpu::RenderPipeline; 2],
}

impl Pipelines {
    /// Those that draw a material.
    pub(super) fn of(&self, material: &LoadedMaterial) -> &MeshPipelines {
        &self.on_mesh[usize::from(material.detail.is_some())]
    }
}

/// What distinguishes a pipeline from the others.
struct Pass<'a> {
    files: &'a [&'a str],
    groups: &'a [&'a wgpu::BindGroupLayout],
    vertex: &'a str,
    /// Attributes of the vertex buffer that are read, from the first; none for passes over the whole picture.
    attributes: usize,
    fragment: Option<&'a str>,
    targets: &'a [wgpu::TextureFormat],
    blend: Option<wgpu::BlendState>,
    /// Comparison with the depth buffer, and whether it is written.
    depth: Option<(wgpu::CompareFunction, bool)>,
    cull: bool,
    /// Values of the fragment shader's `override` constants that are not as written.
    constants: &'a [(&'a str, f64)],
}

impl Pipelines {
    pub(super) fn new(
        device: &wgpu::Device,
        layouts: &Layouts,
        source: &ShaderSource,
        shown: wgpu::TextureFormat,
    ) -> Result<Self, Error> {
        use wgpu::CompareFunction::{Less, LessEqual};
        source.check()?;
        let light_files = ["frame.wgsl", "fuzz.wgsl", "lighting.wgsl", "octahedral.wgsl", "deferred.wgsl"];
        let everywhere = Pass {
            files: &[],
            groups: &[],
            vertex: "everywhere",
            attributes: 0,
            fragment: None,
            targets: &[],
            blend: None,
            depth: None,
            cull: false,
            constants: &[],
        };
        Ok(Self {
            on_mesh: [
                MeshPipelines::new(device, layouts, source, false)?,
                MeshPipelines::new(device, layouts, source, true)?,
            ],
            shadow: pipeline(
                device,
                source,
                &Pass {
                    files: &["frame.wgsl", "shadow.wgsl"],
                    groups: &[&layouts.shadow],
                    vertex: "depth",
                    attributes: 1,
                    depth: Some((Less, true)),
                    ..everywhere
                },
            )?,
            light: pipeline(
                device,
                source,
                &Pass {
                    files: &light_files,
                    groups: &[&layouts.frame, &layouts.g_buffer],
                    fragment: Some("light"),
                    targets: &[HDR],
                    blend: Some(added()),
                    ..everywhere
                },
            )?,
            sky: pipeline(
                device,
                source,
                &Pass {
                    files: &["frame.wgsl", "background.wgsl"],
                    groups: &[&layouts.frame],
                    vertex: "far",
                    fragment: Some("sky"),
                    targets: &[HDR],
                    depth: Some((LessEqual, false)),
                    ..everywhere
                },
            )?,
            accumulate: pipeline(
                device,
                source,
                &Pass {
                    files: &["frame.wgsl", "accumulate.wgsl"],
                    groups: &[&layouts.frame, &layouts.accumulate],
                    fragment: Some("add"),
                    targets: &[SUM],
                    ..everywhere
                },
            )?,
            show: pipeline(
                device,
                source,
                &Pass {
                    files: &["frame.wgsl", "tonemap.wgsl"],
                    groups: &[&layouts.frame, &layouts.show],
                    fragment: Some("display"),
                    targets: &[shown],
                    ..everywhere
                },
            )?,
        })
    }
}

/// Colour that is multiplied and added so; alpha goes over.
fn blended(src_factor: wgpu::BlendFactor, dst_factor: wgpu::BlendFactor) -> wgpu::BlendState {
    let color = wgpu::BlendComponent { src_factor, dst_factor, operation: wgpu::BlendOperation::Add };
    wgpu::BlendState { color, alpha: wgpu::BlendComponent::OVER }
}

/// On top of what is there.
fn added() -> wgpu::BlendState {
    blended(wgpu::BlendFactor::One, wgpu::BlendFactor::One)
}

impl MeshPipelines {
    /// For materials whose maps are blended from tiles, or their own.
    fn new(
        device: &wgpu::Device,
        layouts: &Layouts,
        source: &ShaderSource,
        detail: bool,
    ) -> Result<Self, Error> {
        use wgpu::CompareFunction::Less;
        let maps = if detail { "detail.wgsl" } else { "no_detail.wgsl" };
        let surface = ["frame.wgsl", "fuzz.wgsl", "lighting.wgsl", "surface.wgsl", maps, "fuzz_surface.wgsl"];
        let lit = [&surface[..], &["channels.wgsl", "skin.wgsl", "forward.wgsl"]].concat();
        let fill = [&surface[..], &["octahedral.wgsl", "gbuffer.wgsl"]].concat();
        let cutout = [&surface[..], &["cutout.wgsl"]].concat();
        let groups = |first| {
            let mut groups = vec![first, &layouts.material];
            groups.extend(detail.then_some(&layouts.detail));
            groups
        };
        let material = groups(&layouts.frame);
        let on_mesh =
            |files: &[&str], fragment, targets: &[wgpu::TextureFormat], blend, write, constants: &[_]| {
                let pass = |cull| {
                    let pass = Pass {
                        files,
                        groups: &material,
                        vertex: "vertex",
                        attributes: 6,
                        fragment: Some(fragment),
                        targets,
                        blend,
                        depth: Some((Less, write)),
                        cull,
                        constants,
                    };
                    pipeline(device, source, &pass)
                };
                Ok::<_, Error>([pass(true)?, pass(false)?])
            };
        let multiplied = blended(wgpu::BlendFactor::Zero, wgpu::BlendFactor::Src);
        let [base, normal, factors] = G_BUFFER;
        Ok(Self {
            cutout: pipeline(
                device,
                source,
                &Pass {
                    files: &cutout,
                    groups: &groups(&layouts.shadow),
                    vertex: "cutout_depth",
                    attributes: 6,
                    fragment: Some("cutout"),
                    targets: &[],
                    blend: None,
                    depth: Some((Less, true)),
                    cull: false,
                    constants: &[],
                },
            )?,
            fill: on_mesh(&fill, "fill", &[base, normal, factors, HDR], None, true, &[])?,
            opaque: [
                on_mesh(&lit, "opaque", &[HDR], None, true, &[("LAYERED", 0.0)])?,
                on_mesh(&lit, "opaque", &[HDR], None, true, &[])?,
            ],
            transmittance: on_mesh(&lit, "transmittance", &[HDR], Some(multiplied), false, &[])?,
            blended: on_mesh(&lit, "blended", &[HDR], Some(added()), false, &[])?,
        })
    }
}

fn pipeline(
    device: &wgpu::Device,
    source: &ShaderSource,
    pass: &Pass,
) -> Result<wgpu::RenderPipeline, Error> {
    let text = source.pass(pass.files)?;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let groups: Vec<_> = pass.groups.iter().map(|group| Some(*group)).collect();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &groups,
        immediate_size: 0,
    });
    let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x4, 3 => Float32x4, 4 => Float32x4, 5 => Float32x4];
    let buffers = [Some(wgpu::VertexBufferLayout {
        array_stride: VERTEX_FLOATS as u64 * 4,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &attributes[..pass.attributes],
    })];
    let targets: Vec<_> = (pass.targets.iter())
        .map(|&format| {
            Some(wgpu::ColorTargetState { format, blend: pass.blend, write_mask: wgpu::ColorWrites::ALL })
        })
        .collect();
    Ok(device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: pass.fragment,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(pass.vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &buffers[..usize::from(pass.attributes > 0)],
        },
        primitive: wgpu::PrimitiveState {
            cull_mode: pass.cull.then_some(wgpu::Face::Back),
            ..Default::default()
        },
        depth_stencil: pass.depth.map(|(compare, write)| wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(write),
            depth_compare: Some(compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: pass.fragment.map(|entry| wgpu::FragmentState {
            module: &module,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: pass.constants,
                ..Default::default()
            },
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    }))
}
