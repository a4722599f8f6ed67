//! A real-time renderer on wgpu, as in the talk: deferred for Lambert with isotropic GGX, forward for anisotropic GGX.
//!
//! [`Realtime`] is made once for a device, [`GpuScene`] once for a scene; [`Realtime::draw`] adds one jittered frame to a
//! [`Target`], which shows the mean of all frames since it was cleared. The material model is the
//! [`reference`](mod@crate::reference)'s; what differs is light from all around (spherical harmonics and a filtered
//! probe instead of samples of the environment) and shadows (a map of one directional light instead of rays).

mod detail;
mod device;
mod fuzz;
mod probe;
mod shaders;
mod target;
mod timer;
mod upload;

use glam::camera::rh;
use glam::{Mat4, Vec2, Vec3, Vec4};
use kinran_scene::{Camera, LightKind};

use crate::Error;
use crate::reference::sampler::sample_2d;
use crate::reference::{Background, Film, RenderScene, TextureFiltering};
use crate::tonemap::Tonemap;

pub use device::{Gpu, wanted_features};
pub use shaders::ShaderSource;
pub use target::Target;
pub use timer::PassTime;
use timer::Timer;
pub use upload::{Adjustment, GpuLight, GpuScene};
use upload::{Path, VERTEX_FLOATS};

/// Lights that a frame may have.
pub const MAX_LIGHTS: usize = 16;

/// Texels along a side of the shadow map.
const SHADOW_SIZE: u32 = 2048;

const HDR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
const SUM: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Base colour, normal, factors.
const G_BUFFER: [wgpu::TextureFormat; 3] =
    [wgpu::TextureFormat::Rgba8UnormSrgb, wgpu::TextureFormat::R32Uint, wgpu::TextureFormat::Rgba8Unorm];

/// What is shown of surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Channel {
    /// The lit picture.
    #[default]
    Lit,
    /// World-space normal, from [-1, 1] to [0, 1].
    Normal,
    /// The larger roughness.
    AlphaT,
    /// The smaller roughness.
    AlphaB,
    /// Direction of the larger roughness as hue, anisotropy as brightness.
    Direction,
    /// Level of detail of the normal map over ten.
    Mip,
    /// Base colour.
    BaseColor,
    /// Mean curvature of skin in false colour, black to white.
    Curvature,
}

/// How to draw a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The first directional light casts shadows.
    pub shadows: bool,
    /// The environment is reflected; otherwise it only lights what scatters.
    pub reflections: bool,
    /// Behind everything. The environment is shown sharp: `blur` is not followed.
    pub background: Background,
    /// What is shown.
    pub channel: Channel,
    /// Stops, for [`Realtime::show`].
    pub exposure: f32,
    /// Tone curve, for [`Realtime::show`].
    pub tonemap: Tonemap,
    /// Every opaque material takes the deferred path, its roughness made round.
    pub all_deferred: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            shadows: true,
            reflections: true,
            background: Background::Environment { blur: 0.0 },
            channel: Channel::Lit,
            exposure: 0.0,
            tonemap: Tonemap::Aces,
            all_deferred: false,
        }
    }
}

/// What resources a shader sees: group 0 in every pass, group 1 by the pass.
pub(crate) struct Layouts {
    frame: wgpu::BindGroupLayout,
    shadow: wgpu::BindGroupLayout,
    material: wgpu::BindGroupLayout,
    detail: wgpu::BindGroupLayout,
    g_buffer: wgpu::BindGroupLayout,
    accumulate: wgpu::BindGroupLayout,
    show: wgpu::BindGroupLayout,
}

/// Pipelines of every pass; those of meshes for single-sided and double-sided materials, the forward ones also without and
/// with fibres and skin.
struct Pipelines {
    shadow: wgpu::RenderPipeline,
    light: wgpu::RenderPipeline,
    sky: wgpu::RenderPipeline,
    /// Of materials with their own maps, and of those with maps blended from tiles.
    on_mesh: [MeshPipelines; 2],
    accumulate: wgpu::RenderPipeline,
    show: wgpu::RenderPipeline,
}

/// Pipelines of passes that know a material.
struct MeshPipelines {
    cutout: wgpu::RenderPipeline,
    fill: [wgpu::RenderPipeline; 2],
    /// Without and with fibres and skin.
    opaque: [[wgpu::RenderPipeline; 2]; 2],
    transmittance: [wgpu::RenderPipeline; 2],
    blended: [wgpu::RenderPipeline; 2],
}

impl Pipelines {
    /// Those that draw a material.
    fn of(&self, material: &upload::Material) -> &MeshPipelines {
        &self.on_mesh[usize::from(material.detail.is_some())]
    }
}

/// Sets the textures and factors of a material.
fn set_material(pass: &mut wgpu::RenderPass, material: &upload::Material) {
    pass.set_bind_group(1, &material.bind_group, &[]);
    if let Some(detail) = &material.detail {
        pass.set_bind_group(2, &detail.bind_group, &[]);
    }
}

/// The renderer.
pub struct Realtime {
    gpu: Gpu,
    layouts: Layouts,
    pipelines: Pipelines,
    frame: wgpu::Buffer,
    albedo: wgpu::TextureView,
    shadow_map: wgpu::TextureView,
    around: wgpu::Sampler,
    clamp: wgpu::Sampler,
    compare: wgpu::Sampler,
    shown: wgpu::TextureFormat,
}

/// Floats of the uniform that frame.wgsl declares.
const FRAME_FLOATS: usize = 3 * 16 + 2 * 4 + 9 * 4 + 2 * 4 + MAX_LIGHTS * 16;

impl Realtime {
    /// A renderer whose [`show`](Realtime::show) draws to targets of format `shown`, one that does not encode sRGB itself.
    ///
    /// # Errors
    /// [`Error::Shader`] when a shader of `source` does not compile.
    pub fn new(gpu: &Gpu, source: &ShaderSource, shown: wgpu::TextureFormat) -> Result<Self, Error> {
        let layouts = Layouts::new(&gpu.device);
        let pipelines = Pipelines::new(&gpu.device, &layouts, source, shown)?;
        let buffer = wgpu::BufferDescriptor {
            label: Some("frame"),
            size: FRAME_FLOATS as u64 * 4,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        };
        let sampler = |address_mode_u, compare| {
            gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                address_mode_u,
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                mipmap_filter: wgpu::MipmapFilterMode::Linear,
                compare,
                ..Default::default()
            })
        };
        use wgpu::AddressMode::{ClampToEdge, Repeat};
        Ok(Self {
            frame: gpu.device.create_buffer(&buffer),
            albedo: upload::albedo_table(gpu),
            shadow_map: target::texture(&gpu.device, (SHADOW_SIZE, SHADOW_SIZE), DEPTH),
            around: sampler(Repeat, None),
            clamp: sampler(ClampToEdge, None),
            compare: sampler(ClampToEdge, Some(wgpu::CompareFunction::LessEqual)),
            gpu: gpu.clone(),
            layouts,
            pipelines,
            shown,
        })
    }

    /// The device that draws.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Compiles the shaders of `source`; when one does not compile, those that were there stay.
    ///
    /// # Errors
    /// [`Error::Shader`] with file, line and the compiler's message.
    pub fn reload_shaders(&mut self, source: &ShaderSource) -> Result<(), Error> {
        self.pipelines = Pipelines::new(&self.gpu.device, &self.layouts, source, self.shown)?;
        Ok(())
    }

    /// Brings light from all around to the device and filters it, which takes a second or so.
    pub fn light_of(&self, scene: &RenderScene) -> GpuLight {
        GpuLight::new(&self.gpu, scene.surroundings.as_deref())
    }

    /// Brings a scene to the device, lit by what [`Realtime::light_of`] made of it or of another with the same
    /// surroundings. Textures are read as `filtering` says, by the device's own samplers.
    pub fn load(&self, scene: &RenderScene, light: &GpuLight, filtering: TextureFiltering) -> GpuScene {
        GpuScene::new(&self.gpu, &self.layouts, scene, light, filtering)
    }

    /// Adds a frame to `target`. Frames differ in where in the pixel they look.
    pub fn draw(&self, scene: &GpuScene, camera: &Camera, settings: &Settings, target: &mut Target) {
        self.draw_timed(scene, camera, settings, target, None);
    }

    /// [`draw`](Realtime::draw)s a frame and says how long each of its passes took, in their order; those that had
    /// nothing to do are missing. Waits for the device.
    ///
    /// # Errors
    /// [`Error::Gpu`] where the device has no clock or does not give the times back.
    pub fn pass_times(
        &self,
        scene: &GpuScene,
        camera: &Camera,
        settings: &Settings,
        target: &mut Target,
    ) -> Result<Vec<PassTime>, Error> {
        let timer = Timer::new(&self.gpu)?;
        self.draw_timed(scene, camera, settings, target, Some(&timer));
        timer.read(&self.gpu)
    }

    fn draw_timed(
        &self,
        scene: &GpuScene,
        camera: &Camera,
        settings: &Settings,
        target: &mut Target,
        timer: Option<&Timer>,
    ) {
        let jitter = sample_2d(target.frames, 0, 0);
        let floats = self.frame_floats(scene, camera, settings, target, jitter);
        self.gpu.queue.write_buffer(&self.frame, 0, &upload::bytes(&floats));
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());

        let frame = self.frame_group(scene);
        if target.frames == 0 && has_sun(&scene.scene, settings) {
            self.draw_shadows(&mut encoder, scene, timer);
        }
        let path = |draw: &&upload::Draw| match scene.materials[draw.material].path {
            Path::Forward if settings.all_deferred && settings.channel == Channel::Lit => Path::Deferred,
            // The G-buffer has no channels to show.
            Path::Deferred if settings.channel != Channel::Lit => Path::Forward,
            path => path,
        };
        let draws = |wanted| scene.draws.iter().filter(move |draw| path(draw) == wanted);
        let deferred = draws(Path::Deferred).next().is_some();
        if deferred {
            self.fill(&mut encoder, &frame, scene, target, draws(Path::Deferred), timer);
            self.light(&mut encoder, &frame, target, timer);
        }

        // Opaque first, then the sky behind it, then what lets both through, the farthest first.
        let mut pass = target.hdr_pass(&mut encoder, deferred, timer);
        pass.set_bind_group(0, &frame, &[]);
        pass.set_vertex_buffer(0, scene.vertices.slice(..));
        pass.set_index_buffer(scene.indices.slice(..), wgpu::IndexFormat::Uint32);
        for draw in draws(Path::Forward) {
            let material = &scene.materials[draw.material];
            let opaque = &self.pipelines.of(material).opaque[usize::from(material.layered)];
            pass.set_pipeline(&opaque[usize::from(material.double_sided)]);
            set_material(&mut pass, material);
            pass.draw_indexed(draw.indices.clone(), 0, 0..1);
        }
        pass.set_pipeline(&self.pipelines.sky);
        pass.draw(0..3, 0..1);
        let mut blended: Vec<_> = draws(Path::Blended).collect();
        let eye = Vec3::from(camera.transform.translation);
        blended.sort_by(|a, b| b.middle.distance(eye).total_cmp(&a.middle.distance(eye)));
        for draw in blended {
            let material = &scene.materials[draw.material];
            set_material(&mut pass, material);
            let pipelines = self.pipelines.of(material);
            for pipelines in [&pipelines.transmittance, &pipelines.blended] {
                pass.set_pipeline(&pipelines[usize::from(material.double_sided)]);
                pass.draw_indexed(draw.indices.clone(), 0, 0..1);
            }
        }
        drop(pass);

        // Into the sum of all frames.
        let [before, after] = target.sums();
        let group = self.group(&self.layouts.accumulate, &[before, target.hdr()]);
        let timer = timer.map(|timer| timer.pass("accumulate"));
        let mut pass = color_pass(&mut encoder, after, wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), timer);
        pass.set_pipeline(&self.pipelines.accumulate);
        pass.set_bind_group(0, &frame, &[]);
        pass.set_bind_group(1, &group, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
        target.frames += 1;
    }

    /// Shows the mean of `target`'s frames on `view`, tonemapped and encoded.
    pub fn show(&self, target: &Target, view: &wgpu::TextureView, scene: &GpuScene) {
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let group = self.group(&self.layouts.show, &[target.sums()[0]]);
        let mut pass = color_pass(&mut encoder, view, wgpu::LoadOp::Clear(wgpu::Color::BLACK), None);
        pass.set_pipeline(&self.pipelines.show);
        pass.set_bind_group(0, &self.frame_group(scene), &[]);
        pass.set_bind_group(1, &group, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
    }

    /// A picture of `samples` frames, as the reference renderer returns it. `progress` is called with the frames done and
    /// of all.
    ///
    /// # Errors
    /// [`Error::Setting`] for a size that the device does not draw or for no samples, [`Error::Gpu`] when the picture
    /// cannot be read back.
    pub fn film(
        &self,
        scene: &GpuScene,
        camera: &Camera,
        settings: &Settings,
        size: (u32, u32),
        samples: u32,
        progress: &dyn Fn(usize, usize),
    ) -> Result<Film, Error> {
        let largest = self.gpu.device.limits().max_texture_dimension_2d;
        let refuse = |name, value: u32, fix| Err(Error::Setting { name, value: value.to_string(), fix });
        for (name, side) in [("width", size.0), ("height", size.1)] {
            if !(1..=largest).contains(&side) {
                return refuse(
                    name,
                    side,
                    "it must be at least 1 and at most what the GPU draws, 8192 or more",
                );
            }
        }
        if samples == 0 {
            return refuse("samples", samples, "it must be at least 1");
        }
        let mut target = Target::new(self, size);
        for frame in 0..samples {
            self.draw(scene, camera, settings, &mut target);
            // The device is kept busy, but not loaded with more than it can hold.
            if frame % 8 == 7 {
                let waited = self.gpu.device.poll(wgpu::PollType::wait_indefinitely());
                waited.map_err(|e| Error::Gpu(format!("the device does not draw any more: {e}")))?;
            }
            progress(frame as usize + 1, samples as usize);
        }
        target.film(&self.gpu)
    }

    fn frame_floats(
        &self,
        scene: &GpuScene,
        camera: &Camera,
        settings: &Settings,
        target: &Target,
        jitter: Vec2,
    ) -> Vec<f32> {
        let (width, height) = (target.size.0 as f32, target.size.1 as f32);
        let scene = &scene.scene;
        let (min, max) = scene.geometry.bounds().unwrap_or((Vec3::NEG_ONE, Vec3::ONE));
        let (middle, radius) = (0.5 * (min + max), (0.5 * (max - min)).length().max(1e-6));

        // Near and far just hold the model.
        let eye = Vec3::from(camera.transform.translation);
        let far = (eye.distance(middle) + radius) * 1.01;
        let near = ((eye.distance(middle) - radius) * 0.99).max(far * 1e-4);
        // The place in the pixel that this frame looks at becomes its centre.
        let shift =
            Vec3::new(1.0 - 2.0 * jitter.x, 2.0 * jitter.y - 1.0, 0.0) / Vec3::new(width, height, 1.0);
        let projection = Mat4::from_translation(shift)
            * rh::proj::directx::perspective(camera.yfov, width / height, near, far);
        let view_projection = projection * Mat4::from(camera.transform).inverse();

        // The shadow map sees the whole model.
        let sun = sun(scene).filter(|_| settings.shadows);
        let light_projection = sun.map_or(Mat4::IDENTITY, |sun| {
            let up = if sun.direction.y.abs() > 0.99 { Vec3::X } else { Vec3::Y };
            let view = rh::view::look_to_mat4(middle - radius * sun.direction, sun.direction, up);
            rh::proj::directx::orthographic(-radius, radius, -radius, radius, 0.0, 2.0 * radius) * view
        });

        let mut floats = Vec::with_capacity(FRAME_FLOATS);
        for matrix in [view_projection, view_projection.inverse(), light_projection] {
            floats.extend(matrix.to_cols_array());
        }
        floats.extend(eye.extend(f32::from(u8::from(settings.reflections))).to_array());
        let background = match settings.background {
            Background::Color(color) => color.extend(0.0),
            Background::Environment { .. } => Vec4::W,
        };
        floats.extend(background.to_array());
        let irradiance = scene.surroundings.as_ref().map(|s| s.irradiance).unwrap_or_default();
        floats.extend(irradiance.iter().flat_map(|c| c.extend(0.0).to_array()));
        let lights = &scene.lights[..scene.lights.len().min(MAX_LIGHTS)];
        let surrounded = u32::from(scene.surroundings.is_some());
        let counts = [lights.len() as u32, surrounded, settings.channel as u32, target.frames];
        floats.extend(counts.map(f32::from_bits));
        let curve = match settings.tonemap {
            Tonemap::None => 0.0,
            Tonemap::Aces => 1.0,
            Tonemap::AgX => 2.0,
        };
        floats.extend([width, height, settings.exposure.exp2(), curve]);
        for light in lights {
            let (kind, inner, outer) = match light.kind {
                LightKind::Directional => (0.0, 0.0, 0.0),
                LightKind::Spot { inner_cone_angle, outer_cone_angle } => {
                    (2.0, inner_cone_angle, outer_cone_angle)
                }
                _ => (1.0, 0.0, 0.0),
            };
            let shadowed = sun.is_some_and(|sun| std::ptr::eq(sun, light));
            floats.extend(light.position.extend(kind).to_array());
            // A range without end, squared, must stay a number.
            floats.extend(light.direction.extend(light.range.min(1e18)).to_array());
            floats.extend(light.color.extend(f32::from(u8::from(shadowed))).to_array());
            floats.extend([libm::cosf(inner), libm::cosf(outer), 0.0, 0.0]);
        }
        floats.resize(FRAME_FLOATS, 0.0);
        floats
    }

    fn group(&self, layout: &wgpu::BindGroupLayout, views: &[&wgpu::TextureView]) -> wgpu::BindGroup {
        let resources = views.iter().map(|view| wgpu::BindingResource::TextureView(view));
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout,
            entries: &entries,
        })
    }

    fn frame_group(&self, scene: &GpuScene) -> wgpu::BindGroup {
        use wgpu::BindingResource::{Sampler, TextureView};
        let resources = [
            self.frame.as_entire_binding(),
            TextureView(&scene.light.environment),
            TextureView(&self.albedo),
            TextureView(&self.shadow_map),
            Sampler(&self.around),
            Sampler(&self.clamp),
            Sampler(&self.compare),
        ];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let layout = &self.layouts.frame;
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout,
            entries: &entries,
        })
    }

    fn draw_shadows(&self, encoder: &mut wgpu::CommandEncoder, scene: &GpuScene, timer: Option<&Timer>) {
        let group = self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layouts.shadow,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: self.frame.as_entire_binding() }],
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow"),
            depth_stencil_attachment: Some(depth_attachment(&self.shadow_map, wgpu::LoadOp::Clear(1.0))),
            timestamp_writes: timer.map(|timer| timer.pass("shadow")),
            ..Default::default()
        });
        pass.set_bind_group(0, &group, &[]);
        pass.set_vertex_buffer(0, scene.vertices.slice(..));
        pass.set_index_buffer(scene.indices.slice(..), wgpu::IndexFormat::Uint32);
        for draw in scene.draws.iter().filter(|draw| scene.materials[draw.material].path != Path::Blended) {
            let material = &scene.materials[draw.material];
            if material.cutout {
                pass.set_pipeline(&self.pipelines.of(material).cutout);
                set_material(&mut pass, material);
            } else {
                pass.set_pipeline(&self.pipelines.shadow);
            }
            pass.draw_indexed(draw.indices.clone(), 0, 0..1);
        }
    }

    fn fill<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &wgpu::BindGroup,
        scene: &GpuScene,
        target: &Target,
        draws: impl Iterator<Item = &'a upload::Draw>,
        timer: Option<&Timer>,
    ) {
        let mut pass = target.fill_pass(encoder, timer);
        pass.set_bind_group(0, frame, &[]);
        pass.set_vertex_buffer(0, scene.vertices.slice(..));
        pass.set_index_buffer(scene.indices.slice(..), wgpu::IndexFormat::Uint32);
        for draw in draws {
            let material = &scene.materials[draw.material];
            pass.set_pipeline(&self.pipelines.of(material).fill[usize::from(material.double_sided)]);
            set_material(&mut pass, material);
            pass.draw_indexed(draw.indices.clone(), 0, 0..1);
        }
    }

    fn light(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &wgpu::BindGroup,
        target: &Target,
        timer: Option<&Timer>,
    ) {
        let [base, normal, factors] = target.g_buffer();
        let group = self.group(&self.layouts.g_buffer, &[base, normal, factors, target.depth()]);
        let timer = timer.map(|timer| timer.pass("light"));
        let mut pass = color_pass(encoder, target.hdr(), wgpu::LoadOp::Load, timer);
        pass.set_pipeline(&self.pipelines.light);
        pass.set_bind_group(0, frame, &[]);
        pass.set_bind_group(1, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// The light whose shadows are drawn.
fn sun(scene: &RenderScene) -> Option<&kinran_scene::Light> {
    scene.lights.iter().take(MAX_LIGHTS).find(|light| light.kind == LightKind::Directional)
}

fn has_sun(scene: &RenderScene, settings: &Settings) -> bool {
    settings.shadows && sun(scene).is_some()
}

/// What this renderer leaves out of a scene that the reference draws, a sentence each.
pub fn left_out(scene: &RenderScene, settings: &Settings) -> Vec<String> {
    let lights = scene.lights.len();
    let mut sentences = Vec::new();
    if lights > MAX_LIGHTS {
        sentences.push(format!("only the first {MAX_LIGHTS} of {lights} lights shine"));
    }
    let shadowless = lights.min(MAX_LIGHTS) - usize::from(sun(scene).is_some());
    if settings.shadows && shadowless > 0 {
        sentences.push(format!(
            "{shadowless} of {lights} lights cast no shadows: the first directional light alone has a shadow map"
        ));
    }
    if matches!(settings.background, Background::Environment { blur } if blur > 0.0) {
        sentences.push("the environment is seen sharp, not blurred".into());
    }
    sentences
}

fn depth_attachment(
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

fn color_pass<'a>(
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

impl Layouts {
    fn new(device: &wgpu::Device) -> Self {
        use wgpu::{BindingType, SamplerBindingType as S, TextureSampleType as T};
        let uniform = BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let texture = |sample_type| BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let volume = BindingType::Texture {
            sample_type: T::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D3,
            multisampled: false,
        };
        let layout = |types: &[BindingType]| {
            let entry = |(i, &ty): (usize, &BindingType)| wgpu::BindGroupLayoutEntry {
                binding: i as u32,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty,
                count: None,
            };
            let entries: Vec<_> = types.iter().enumerate().map(entry).collect();
            device
                .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
        };
        let (filtered, raw) =
            (texture(T::Float { filterable: true }), texture(T::Float { filterable: false }));
        let smooth = BindingType::Sampler(S::Filtering);
        let mut material = vec![uniform];
        material.extend([filtered; upload::SLOTS]);
        material.extend([smooth; upload::SLOTS]);
        material.push(uniform);
        material.extend([filtered; 3]);
        material.extend([smooth; 3]);
        material.extend([filtered; 3]);
        material.push(volume);
        let mut detail = vec![uniform];
        detail.extend([filtered; detail::TEXTURES]);
        detail.extend([smooth; detail::SAMPLERS]);
        Layouts {
            frame: layout(&[
                uniform,
                filtered,
                filtered,
                texture(T::Depth),
                smooth,
                smooth,
                BindingType::Sampler(S::Comparison),
            ]),
            shadow: layout(&[uniform]),
            material: layout(&material),
            detail: layout(&detail),
            g_buffer: layout(&[raw, texture(T::Uint), raw, texture(T::Depth)]),
            accumulate: layout(&[raw, raw]),
            show: layout(&[raw]),
        }
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
    fn new(
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
                Ok([pass(true)?, pass(false)?])
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
