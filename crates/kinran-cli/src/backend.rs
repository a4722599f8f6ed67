//! What draws pictures: the reference renderer, or a GPU.

use std::path::Path;

use kinran_render::reference::{Film, RenderScene, TextureFiltering};
#[cfg(feature = "gpu")]
use kinran_render::{
    Error as RenderError,
    realtime::{Gpu, Realtime, Settings, ShaderSource, left_out},
};

use crate::view::View;
#[cfg(feature = "gpu")]
use crate::view::samples_of;
use crate::{Error, Progress};

/// What draws a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Backend {
    /// The reference renderer
    Cpu,
    /// As a game draws, by Vulkan
    Gpu,
}

/// A backend that is ready to draw.
pub(crate) enum Painter {
    Cpu,
    #[cfg(feature = "gpu")]
    Gpu(Box<Realtime>),
}

impl Backend {
    /// The backend, with shaders of a folder in the place of those that are built in.
    ///
    /// # Errors
    /// Where there is no device, or a shader does not compile.
    #[cfg_attr(not(feature = "gpu"), allow(unused_variables, reason = "only a GPU has shaders"))]
    pub(crate) fn open(self, shaders: Option<&Path>, progress: &Progress) -> Result<Painter, Error> {
        match self {
            Backend::Cpu => Ok(Painter::Cpu),
            #[cfg(feature = "gpu")]
            Backend::Gpu => {
                let source = ShaderSource { folder: shaders.map(Path::to_owned) };
                let _starting = progress.busy("starting the GPU");
                // Nothing is shown on a display, so any format will do.
                let open = || -> Result<_, RenderError> {
                    Realtime::new(&Gpu::open()?, &source, wgpu::TextureFormat::Rgba8Unorm)
                };
                Ok(Painter::Gpu(Box::new(open()?)))
            }
            #[cfg(not(feature = "gpu"))]
            Backend::Gpu => Err(Error::flag_error(
                "--backend gpu",
                "this kinran was built without a GPU renderer; build it with `cargo build --release -p kinran-cli --features \
                 gpu`, or use --backend cpu",
            )),
        }
    }
}

impl Painter {
    /// What of a scene it does not draw.
    #[cfg_attr(not(feature = "gpu"), allow(unused_variables, reason = "the reference draws all"))]
    pub(crate) fn left_out(&self, view: &View, scene: &RenderScene) -> Vec<String> {
        match self {
            Painter::Cpu => Vec::new(),
            #[cfg(feature = "gpu")]
            Painter::Gpu(_) => {
                let left = left_out(scene, &settings(view));
                left.iter().map(|what| format!("--backend gpu: {what}")).collect()
            }
        }
    }

    /// A picture of a scene in a view's light.
    ///
    /// # Errors
    /// Those of the renderer.
    pub(crate) fn film(
        &self,
        view: &View,
        scene: &RenderScene,
        name: &str,
        samples_per_pixel: u32,
        filtering: TextureFiltering,
        progress: &Progress,
    ) -> Result<Film, Error> {
        match self {
            Painter::Cpu => view.render(scene, name, samples_per_pixel, filtering, progress),
            #[cfg(feature = "gpu")]
            Painter::Gpu(renderer) => {
                let loading = progress.busy("bringing the scene to the GPU");
                let scene = renderer.load(scene, &renderer.light_of(scene), filtering);
                drop(loading);
                let stage = progress.stage(name, u64::from(samples_per_pixel));
                let (settings, samples) = (settings(view), samples_per_pixel);
                Ok(renderer.film(&scene, &view.camera, &settings, view.size, samples, &|frames| {
                    progress.drawn(frames * samples_of(view.size, 1));
                    stage.tick(frames)
                })?)
            }
        }
    }
}

#[cfg(feature = "gpu")]
fn settings(view: &View) -> Settings {
    Settings {
        shadows: view.shadows,
        reflections: view.env_samples > 0,
        background: view.background,
        ..Settings::default()
    }
}
