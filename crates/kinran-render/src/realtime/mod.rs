//! A real-time renderer on wgpu, as in the talk: deferred for Lambert with isotropic GGX, forward for anisotropic GGX.
//!
//! [`Realtime`] is made once for a device, [`GpuScene`] once for a scene; [`Realtime::draw`] adds one jittered frame to a
//! [`Target`], which shows the mean of all frames since it was cleared. The material model is the
//! [`reference`](mod@crate::reference)'s; what differs is light from all around (spherical harmonics and a filtered
//! probe instead of samples of the environment) and shadows (a map of one directional light instead of rays).
//!
//! ```no_run
//! use kinran_render::realtime::{Gpu, Realtime, Settings, ShaderSource};
//! use kinran_render::reference::{RenderScene, TextureFiltering, frame_box};
//! # fn picture(scene: &RenderScene) -> Result<(), kinran_render::Error> {
//! let renderer = Realtime::new(&Gpu::open()?, &ShaderSource::default(), wgpu::TextureFormat::Rgba8Unorm)?;
//! let filtering = TextureFiltering::Mips { max_anisotropy: 16 };
//! let loaded = renderer.load(scene, &renderer.light_of(scene), filtering);
//! let (min, max) = scene.geometry.bounds().expect("there are triangles");
//! let camera = frame_box(min, max, glam::Vec3::Z, 0.6, 1.0);
//! let film = renderer.film(&loaded, &camera, &Settings::default(), (512, 512), 16, &kinran_image::untold)?;
//! # Ok(())
//! # }
//! ```

mod detail;
mod device;
mod frame;
mod fuzz;
mod layouts;
mod material;
mod passes;
mod pipelines;
mod probe;
mod renderer;
mod settings;
mod shaders;
mod target;
mod textures;
mod timer;
mod uniform;
mod upload;

pub use device::{Gpu, wanted_features};
pub use material::Adjustment;
pub use renderer::Realtime;
pub use settings::{Channel, MAX_LIGHTS, Settings, left_out};
pub use shaders::ShaderSource;
pub use target::Target;
pub use timer::PassTime;
pub use upload::{GpuLight, GpuScene};
