//! `kinran render`: a picture of a glTF file.

use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use kinran_bake::aniso::Filter;
use kinran_image::{Channels, Image, Pixels, encode_png, write_atomically, write_exr};
use kinran_render::reference::TextureFiltering;
use kinran_scene::Scene;
use schemars::JsonSchema;
use serde::Serialize;

pub use crate::backend::Backend;
use crate::model::Model;
use crate::skin::missing_curvature;
use crate::surfaces::{Method, Mips, scene_surfaces};
use crate::values::{SWITCH, choice, counted};
use crate::view::{Curve, View, ViewArgs, file_name};
use crate::{Console, Error, outputs};

/// Renders a glTF file, or a folder of baked textures
///
/// A model that `kinran bake` wrote, or any other with KTX2 or DDS files that hold mips, is drawn with these. Of others,
/// every material with a normal map or with anisotropy is baked in memory first, with the filter that --filter names and the
/// block compression that `kinran bake` uses, and drawn with the mips that result, as a GPU would sample them. The textures
/// of a baked folder are laid on boards. The same input gives the same picture, bit by bit, on any number of threads.
///
/// --backend gpu draws as a game does: deferred and forward, light from all around by spherical harmonics and
/// a filtered probe, shadows of one directional light by a map.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran render lamp.glb
  kinran render lamp.glb -o lamp.exr --size 1920x1080 --spp 256 \\
      --env studio.hdr --env-rotation 90
  kinran render lamp.glb -o far.png --distance 8 --filter naive
  kinran render lamp.glb -o truth.png --filter none --spp 1024
  kinran render lamp.glb -o sun.png --env none \\
      --light 1,2,1 --background 0.2,0.3,0.5
  kinran render baked/brocade/ -o brocade.png
  kinran render lamp.glb -o game.png --backend gpu")]
pub struct Args {
    /// The .glb, .gltf or .obj file, or a folder that holds one, or the textures that `kinran bake` wrote
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// The picture: .png for displays, .exr for linear radiance [default: NAME.render.png beside the input]
    #[arg(long, short, value_name = "PICTURE")]
    pub output: Option<PathBuf>,

    /// What draws: the reference renderer on the CPU, or a GPU by Vulkan
    #[arg(long, value_enum, default_value_t = Backend::Cpu)]
    pub backend: Backend,

    /// With --backend gpu: a folder whose .wgsl files take the place of the built-in ones of the same name
    #[arg(long, value_name = "DIR")]
    pub shaders: Option<PathBuf>,

    /// Samples in a pixel
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub spp: u32,

    /// The filter by which mips are baked before rendering; none samples level 0 alone, uncompressed, which with many
    /// samples in a pixel is ground truth; baked takes the mips of the model's own KTX2 or DDS files. The default is baked where
    /// there are such files, else ml
    #[arg(long, value_name = "NAME", value_parser = mips())]
    pub filter: Option<Mips>,

    /// Filters colour, metalness and lobe together, so that what reflects and what scatters stays from afar; off averages each
    /// by itself
    #[arg(long, value_name = "WHETHER", action = clap::ArgAction::Set, default_value = "on", value_parser = choice(SWITCH))]
    pub correlated: bool,

    /// The most places along a slanted pixel's footprint at which a texture is read; 1 is trilinear
    #[arg(long, value_name = "N", default_value_t = MAX_ANISOTROPY, value_parser = clap::value_parser!(u32).range(1..=16))]
    pub max_anisotropy: u32,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub view: ViewArgs,
}

fn mips() -> impl TypedValueParser<Value = Mips> {
    let filtered = |filter| Mips::Filtered(Method::new(filter, true));
    let all = move || Filter::ALL.map(filtered).into_iter().chain([Mips::Level0, Mips::Baked]);
    PossibleValuesParser::new(all().map(mips_name))
        .map(move |name| all().find(|mips| mips_name(*mips) == name).expect("only names pass"))
}

/// What GPUs allow.
pub(crate) const MAX_ANISOTROPY: u32 = 16;

/// What `--filter` calls mips.
fn mips_name(mips: Mips) -> &'static str {
    if mips == Mips::Level0 { "none" } else { mips.name() }
}

#[derive(Serialize, JsonSchema)]
pub(crate) struct Summary {
    output: String,
    width: u32,
    height: u32,
    samples_per_pixel: u32,
    filter: &'static str,
    triangles: usize,
    warnings: Vec<String>,
}

/// The command.
///
/// # Errors
/// One that names the file: input that cannot be read, output that cannot be written, flags that do not fit
/// the file.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let output = args.output.clone().unwrap_or_else(|| outputs::named_after(&args.file, ".render.png"));
    outputs::check_file(&output, &["png", "exr"])?;
    args.view.refuse_inputs(&args.file, [output.clone()])?;
    if let Some(folder) = args.shaders.as_ref().filter(|_| args.backend == Backend::Cpu) {
        let reason = "needs --backend gpu, which draws with shaders; add it, or leave the flag out";
        return Err(Error::flag_error(format!("--shaders {}", folder.display()), reason));
    }
    if let Some(folder) = args.shaders.as_ref().filter(|folder| !folder.is_dir()) {
        return Err(Error::file_error(folder, "there is no such folder; name one with .wgsl files"));
    }
    let progress = console.progress();
    let painter = args.backend.open(args.shaders.as_deref(), &progress)?;
    let Model { path, scene, only_baked } = Model::open(&args.file, &args.view.model, &progress)?;
    args.view.refuse_idle(&scene, &path.to_string_lossy())?;
    let view = View::new(&scene, &path.to_string_lossy(), &args.view)?;
    let own = if only_baked { Mips::Baked } else { Mips::of(&scene) };
    let mips = args.filter.unwrap_or(own);
    let refuse =
        |reason: &str| Err(Error::flag_error_of(&path, format!("--filter {}", mips_name(mips)), reason));
    if only_baked && !matches!(mips, Mips::Baked | Mips::Level0) {
        return refuse(
            "a folder of baked textures has no maps to bake; leave --filter out, or name the model",
        );
    }
    if mips == Mips::Baked && own != Mips::Baked {
        return refuse("no material has its maps in KTX2 or DDS files; leave --filter out");
    }
    let is_exr = outputs::has_extension(&output, "exr");
    let sampled = "--filter none samples level 0 alone";
    let own_mips = "the mips of the model's own files are drawn; name a filter to bake others";
    let idle = [
        ("--max-anisotropy", args.max_anisotropy != MAX_ANISOTROPY, mips == Mips::Level0, sampled),
        ("--correlated off", !args.correlated, mips == Mips::Level0, sampled),
        ("--correlated off", !args.correlated, mips == Mips::Baked, own_mips),
    ];
    if let Some((flag, .., why)) = idle.into_iter().find(|(_, given, is_idle, _)| *given && *is_idle) {
        return Err(Error::flag_error_of(&path, flag, format!("{why}; leave the flag out")));
    }
    let has_curve = !matches!(args.view.tonemap, Curve::Aces | Curve::None);
    let of_displays = [("--exposure", args.view.exposure != 0.0), ("--tonemap", has_curve)];
    let unused = of_displays.into_iter().filter(|(_, given)| *given && is_exr);
    let unused = unused
        .map(|(flag, _)| format!("{flag} has nothing to act on: an EXR file is linear and not exposed"));
    let mips = mips.correlated(args.correlated);
    let drawn = if only_baked { Mips::Baked } else { mips };
    let (surfaces, apart) = scene_surfaces(&scene, drawn, &progress)?;
    let told = scene.warnings.iter().chain(view.environment_notes()).cloned();
    let warnings: Vec<String> = told.chain(apart).chain(missing_curvature(&scene)).chain(unused).collect();
    warnings.iter().for_each(|w| console.warn(w));

    let filtering = match mips {
        Mips::Level0 => TextureFiltering::Level0,
        _ => TextureFiltering::Mips { max_anisotropy: args.max_anisotropy },
    };
    let prepared = view.scene(&scene, surfaces, &progress)?;
    painter.left_out(&view, &prepared).iter().for_each(|what| console.warn(what));
    let film = painter.film(&view, &prepared, "render", args.spp, filtering, &progress)?;
    if is_exr {
        outputs::make_place(&output)?;
        let pixels = Pixels::F32(film.pixels.into_flattened());
        write_exr(&output, &Image::new(film.width, film.height, Channels::Rgb, pixels)?)?;
    } else {
        write_rgb8(&output, film.width, film.height, view.display(&film))?;
    }

    let summary = Summary {
        output: file_name(&output),
        width: film.width,
        height: film.height,
        samples_per_pixel: args.spp,
        filter: mips_name(mips),
        triangles: triangles(&scene),
        warnings,
    };
    let text = format!(
        "{}: {}x{}, {} a pixel, {}, filter {}",
        output.display(),
        summary.width,
        summary.height,
        counted(summary.samples_per_pixel as usize, "sample", "samples"),
        counted(summary.triangles, "triangle", "triangles"),
        summary.filter
    );
    console.result(&summary, &text)?;
    outputs::tell_place(console, args.output.as_deref(), &output);
    Ok(())
}

/// Triangles in the world, instances counted each.
pub(crate) fn triangles(scene: &Scene) -> usize {
    scene.instances.iter().map(|i| scene.primitives[i.primitive].triangles.len()).sum()
}

/// Writes an 8-bit PNG, into a folder that need not be there.
pub(crate) fn write_rgb8(path: &Path, width: u32, height: u32, pixels: Vec<[u8; 3]>) -> Result<(), Error> {
    outputs::make_place(path)?;
    let pixels = Pixels::U8(pixels.into_flattened());
    let png = encode_png(&Image::new(width, height, Channels::Rgb, pixels)?)?;
    Ok(write_atomically(path, &outputs::signed_png(png))?)
}
