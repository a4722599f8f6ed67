//! `kinran view`: a window with every parameter on a slider.

mod app;
mod detail;
mod fuzz;
mod loader;
mod orbit;
mod panel;
mod parameters;

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use eframe::egui;
use kinran_render::realtime::{ShaderSource, wanted_features};
use schemars::JsonSchema;
use serde::Serialize;

use crate::model::Place;
use crate::values::size;
use crate::view::{EnvironmentChoice, ViewArgs, refuse_layer};
use crate::{Console, Error};
use app::{App, Outcome};
use parameters::Parameters;

/// Opens a window on a glTF file
///
/// Drag turns the model, the right button moves it, the wheel brings it nearer; ? lists the keys. The picture is drawn by
/// the GPU and gets smoother while nothing moves. Filters are baked in the background. A file dropped on the window takes
/// the place of the one that is shown.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran view lamp.glb
  kinran view lamp.glb --env studio.hdr --light 1,2,1
  kinran view lamp.glb --parameters lamp.view.json
  kinran view lamp.glb --shaders my_shaders/     edit a shader, see it at once")]
pub struct Args {
    /// The .glb, .gltf or .obj file, or a folder that holds one, or the textures that `kinran bake` wrote; may also be dropped later
    #[arg(value_name = "FILE")]
    pub file: Option<PathBuf>,

    /// What the sliders say, as the window saves it
    #[arg(long, value_name = "JSON")]
    pub parameters: Option<PathBuf>,

    /// A folder of the renderer's shaders: it is made and filled if it is not there, and whatever is saved in it takes
    /// effect at once
    #[arg(long, value_name = "DIR")]
    pub shaders: Option<PathBuf>,

    /// The window's size in points, WIDTHxHEIGHT
    #[arg(long, value_name = "WxH", default_value = "1280x800", value_parser = size)]
    pub window: (u32, u32),

    /// Saves a picture of the window as .png once it is drawn smoothly, then closes it
    #[arg(long, value_name = "PNG")]
    pub screenshot: Option<PathBuf>,

    /// Frames of which a still picture is made; fewer are done sooner, more are smoother
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub spp: u32,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub view: ViewArgs,
}

/// The command; returns when the window is closed.
///
/// # Errors
/// [`Error::Usage`] where no window can be opened; those of the files named.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    if let Some(path) = &args.screenshot {
        crate::outputs::check_file(path, &["png"])?;
        if !args.view.force {
            crate::outputs::refuse_other_picture(path)?;
        }
    }
    // A name that is mistyped is told before a window opens.
    args.file.as_deref().map(Place::of).transpose()?;
    refuse_layer(&args.view.environment(), args.view.exr_layer.as_deref())?;
    if let Some(EnvironmentChoice::File(path)) = &args.view.env {
        std::fs::metadata(path).map_err(|e| kinran_image::Error::io(path, e))?;
    }
    let parameters = match &args.parameters {
        Some(path) => Parameters::load(path)?,
        None => Parameters::from_args(&args.view),
    };
    if let Some(folder) = &args.shaders {
        loader::fill_shader_folder(folder)?;
        ShaderSource { folder: Some(folder.clone()) }.check()?;
    }
    let size = [args.window.0 as f32, args.window.1 as f32];

    let mut options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default().with_inner_size(size).with_title("Kinran"),
        renderer: eframe::Renderer::Wgpu,
        ..Default::default()
    };
    if let eframe::egui_wgpu::WgpuSetup::CreateNew(setup) = &mut options.wgpu_options.wgpu_setup {
        setup.device_descriptor = Arc::new(|adapter| wgpu::DeviceDescriptor {
            label: Some("kinran"),
            required_features: wanted_features(adapter),
            required_limits: adapter.limits(),
            ..Default::default()
        });
    }
    // What goes wrong inside comes out here, since the window's loop returns only its own errors.
    let outcome = Arc::new(Mutex::new(Outcome::default()));
    let inside = outcome.clone();
    let settings = app::Start {
        file: args.file.clone(),
        view: args.view.clone(),
        parameters,
        shaders: args.shaders.clone(),
        screenshot: args.screenshot.clone(),
        spp: args.spp,
    };
    let created = eframe::run_native(
        "kinran",
        options,
        Box::new(move |context| Ok(Box::new(App::new(context, settings, inside)?))),
    );
    let outcome = std::mem::take(&mut *outcome.lock().expect("no thread panics"));
    if let Some(error) = outcome.failure {
        return Err(error);
    }
    created.map_err(|e| {
        let fix = "a window needs a display and a Vulkan driver (in Debian, mesa-vulkan-drivers); without them use \
                   `kinran render`";
        Error::Usage(format!("no window can be opened: {}; {fix}", without_source(&e.to_string())))
    })?;
    let Some(path) = &args.screenshot else { return Ok(()) };
    outcome.warnings.iter().for_each(|warning| console.warn(warning));
    let seconds = outcome.first_picture.unwrap_or_default().as_secs_f64();
    let summary = Summary {
        screenshot: path.to_string_lossy().into_owned(),
        first_picture_seconds: seconds,
        warnings: outcome.warnings,
    };
    console
        .result(&summary, &format!("{}: the first picture came {seconds:.2} s after reading", path.display()))
}

/// An error without the place in a crate's source that winit puts before it, "os error at …/mod.rs:786: ", and without
/// the stop at its end.
fn without_source(message: &str) -> &str {
    let reason = message.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": "));
    reason.map_or(message, |(_, reason)| reason).trim_end_matches('.')
}

/// What `--screenshot` took.
#[derive(Serialize, JsonSchema)]
pub(crate) struct Summary {
    screenshot: String,
    /// From the model's being read to its first picture.
    first_picture_seconds: f64,
    /// What of the model is drawn otherwise than it says.
    warnings: Vec<String>,
}

#[cfg(test)]
mod tests {
    use super::without_source;

    #[test]
    fn an_error_says_nothing_of_a_crate_s_source() {
        let of_winit =
            "winit EventLoopError: os error at /root/.cargo/winit-0.30.13/src/linux/mod.rs:786: no display.";
        assert_eq!(without_source(of_winit), "no display");
        assert_eq!(without_source("no adapter: none"), "no adapter: none");
    }
}
