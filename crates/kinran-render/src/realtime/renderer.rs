//! The renderer.

use glam::Vec3;
use kinran_image::Tick;
use kinran_scene::Camera;

use super::Gpu;
use super::frame::Frame;
use super::layouts::{Layouts, bind};
use super::passes::Passes;
use super::pipelines::Pipelines;
use super::settings::{Settings, has_sun};
use super::shaders::ShaderSource;
use super::target::{Target, color_pass};
use super::textures;
use super::timer::{PassTime, Timer};
use super::uniform::uniform_bytes;
use super::upload::{GpuLight, GpuScene};
use crate::Error;
use crate::reference::sampler::sample_2d;
use crate::reference::{Film, RenderScene, TextureFiltering};

/// The renderer.
pub struct Realtime {
    gpu: Gpu,
    layouts: Layouts,
    pipelines: Pipelines,
    albedo: wgpu::TextureView,
    around: wgpu::Sampler,
    clamp: wgpu::Sampler,
    compare: wgpu::Sampler,
    shown: wgpu::TextureFormat,
}

impl Realtime {
    /// A renderer whose [`show`](Realtime::show) draws to targets of format `shown`, one that does not encode sRGB itself.
    ///
    /// # Errors
    /// [`Error::Shader`] when a shader of `source` does not compile.
    pub fn new(gpu: &Gpu, source: &ShaderSource, shown: wgpu::TextureFormat) -> Result<Self, Error> {
        let layouts = Layouts::new(&gpu.device);
        let pipelines = Pipelines::new(&gpu.device, &layouts, source, shown)?;
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
            albedo: textures::albedo_table(gpu),
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
        let frame = Frame::new(&scene.scene, camera, settings, target.size, target.frames, jitter);
        self.gpu.queue.write_buffer(target.frame(), 0, &uniform_bytes(&frame));
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());

        let passes = Passes {
            gpu: &self.gpu,
            layouts: &self.layouts,
            pipelines: &self.pipelines,
            scene,
            settings,
            target,
            frame: &self.frame_group(scene, target),
            timer,
        };
        if target.frames == 0 && has_sun(&scene.scene, settings) {
            passes.shadows(&mut encoder);
        }
        if passes.is_deferred() {
            passes.fill(&mut encoder);
            passes.light(&mut encoder);
        }
        passes.forward(&mut encoder, Vec3::from(camera.transform.translation));
        passes.accumulate(&mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        target.frames += 1;
    }

    /// Shows the mean of `target`'s frames on `view`, tonemapped and encoded.
    pub fn show(&self, target: &Target, view: &wgpu::TextureView, scene: &GpuScene) {
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let sum = wgpu::BindingResource::TextureView(target.sums()[0]);
        let group = bind(&self.gpu, &self.layouts.show, [sum]);
        let mut pass = color_pass(&mut encoder, view, wgpu::LoadOp::Clear(wgpu::Color::BLACK), None);
        pass.set_pipeline(&self.pipelines.show);
        pass.set_bind_group(0, &self.frame_group(scene, target), &[]);
        pass.set_bind_group(1, &group, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
    }

    /// A picture of `samples` frames, as the reference renderer returns it. `tick` is told of each frame.
    ///
    /// # Errors
    /// [`Error::Setting`] for a size that the device does not draw or for no samples, [`Error::Gpu`] when the picture
    /// cannot be read back, [`Error::Cancelled`] where `tick` stops the work.
    pub fn film(
        &self,
        scene: &GpuScene,
        camera: &Camera,
        settings: &Settings,
        size: (u32, u32),
        samples: u32,
        tick: &Tick<'_>,
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
            tick(1)?;
        }
        target.film(&self.gpu)
    }

    /// Group 0.
    fn frame_group(&self, scene: &GpuScene, target: &Target) -> wgpu::BindGroup {
        use wgpu::BindingResource::{Sampler, TextureView};
        let resources = [
            target.frame().as_entire_binding(),
            TextureView(&scene.light.environment),
            TextureView(&self.albedo),
            TextureView(target.shadow_map()),
            Sampler(&self.around),
            Sampler(&self.clamp),
            Sampler(&self.compare),
        ];
        bind(&self.gpu, &self.layouts.frame, resources)
    }
}

impl Target {
    /// An empty picture. `size` must lie within the device's limits and not be zero.
    pub fn new(renderer: &Realtime, size: (u32, u32)) -> Self {
        Target::on(&renderer.gpu, size)
    }

    /// Forgets all frames: the next one replaces them. To be called when what is drawn changes.
    pub fn clear(&mut self, renderer: &Realtime) {
        self.empty(&renderer.gpu);
    }
}
