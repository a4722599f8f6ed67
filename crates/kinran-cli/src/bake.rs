//! `kinran bake`: engine-ready textures from a folder of maps or a glTF file.

pub(crate) mod curvature;
mod flags;
mod folder;
mod gltf;
mod library;
pub(crate) mod report;
mod settings;

use std::path::{Path, PathBuf};

use kinran::bake::{FolderOptions, GltfOptions, Target};
use kinran::options::{AlphaCoverage, Container, Form, TextureOptions};
use kinran_bake::aniso::{Filter, Kernel};
use kinran_bake::folder::{FolderError, Green, Hints, Role as MapRole};
use kinran_image::{Encoder, Format, Preset, Transfer};
use kinran_scene::{Wrap, is_gltf};

use self::flags::{Flag, On};
use crate::init::{MANIFEST, Survey};
use crate::model::ModelArgs;
use crate::outputs::{beside, check_folder, has_extension, way};
use crate::values::{CONTAINERS, Choices, FORMATS, PRESETS, SWITCH, choice, exr_layer, filter, number};
use crate::{Console, Error};

pub use curvature::CurvatureArgs;
pub use library::{LibraryArgs, LibraryReport, bake_library, cache_folder, library_report};
pub use settings::options_of;

/// Bakes a folder of authored maps, a glTF file or a whole library into textures with right mips
///
/// A folder: maps are found by the names that Substance, ambientCG, Poly Haven, Quixel and glTF exporters give them
/// (docs/folders.md lists them); what was understood is printed as a table, and what is ambiguous is an error that
/// names the flag which settles it. Each material becomes NAME_normal and NAME_aniso (and NAME_color, NAME_orm
/// where there are such maps), and NAME.kinran.json, which says how they were made and what was lost on each level.
///
/// A .glb or .gltf: every material with a normal, roughness or anisotropy map gets normal, roughness and anisotropy
/// textures whose every level is right, in glTF's own terms; the model is written beside them.
///
/// A kinran.toml: everything that it lists, in parallel; what has not changed is not baked again. See
/// docs/manifest.md.
#[derive(Clone, Debug, PartialEq, clap::Args)]
#[command(after_help = "Examples:
  kinran bake materials/brocade -o baked/
  kinran bake lamp.glb -o baked/
  kinran bake materials/brocade -o baked/ \\
      --form both --container dds --filter linear
  kinran bake scans/ -o baked/ --y-down --map direction=flow.png
  kinran bake materials/brocade -o baked/ --dry-run
  kinran bake kinran.toml --watch

Engines: --form aniso (folders' default) is the compact form, decoded in the shader as docs/aniso.md \
tells; --form khr is glTF's roughness and anisotropy maps, for viewers that know nothing of Kinran.")]
pub struct Args {
    /// A folder of maps, a .glb, a .gltf or a kinran.toml
    #[arg(value_name = "INPUT")]
    pub input: PathBuf,

    /// Where the files go; made if it is not there [default: what a kinran.toml says, else baked beside the input]
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// How a footprint becomes one texel; linear is the talk's
    #[arg(long, value_name = "NAME", default_value = "ml", value_parser = filter())]
    pub filter: Filter,

    /// Shape of the footprint
    #[arg(long, default_value = "box", value_parser = choice(KERNELS))]
    pub kernel: Kernel,

    /// Filters colour, metalness and lobe together, so that what reflects and what scatters stays from afar; off averages each
    /// by itself. For colours of a glTF file it takes --all-textures
    #[arg(long, value_name = "WHETHER", action = clap::ArgAction::Set, default_value = "on", value_parser = choice(SWITCH))]
    pub correlated: bool,

    /// Keeps as much of a colour at or above the cutoff of its alpha from afar as nearby, so that leaves and hair do not thin
    /// out: on is for glTF materials that are cut out, at their own cutoff; a number, 0 to 1, is the cutoff of a folder's
    /// colour, or of whatever in a glTF file is not opaque; off averages alpha. For colours of a glTF file it takes
    /// --all-textures
    #[arg(long, value_name = "CUTOFF", default_value = "on", value_parser = alpha_coverage)]
    pub alpha_coverage: AlphaCoverage,

    /// What lies beyond the borders of a folder's maps; glTF files say it themselves
    #[arg(long, default_value = "wrap", value_parser = choice(EDGES))]
    pub edges: Wrap,

    /// Which maps hold the lobe; the default is aniso for folders and khr for glTF, which khr's maps are always written for
    #[arg(long, value_parser = choice(FORMS))]
    pub form: Option<Form>,

    /// Who is to read the textures of a glTF file; the formats and the container below go by it [default: who reads the formats
    /// and the container that are given, else desktop]
    #[arg(long, value_parser = choice(TARGETS))]
    pub target: Option<Target>,

    /// File format of the textures [default: ktx2; of a glTF file, what its target has]
    #[arg(long, value_parser = choice(CONTAINERS))]
    pub container: Option<Container>,

    /// Zstandard level of KTX2 files, 0 for none
    #[arg(long, value_name = "LEVEL", default_value_t = DEFAULT_ZSTD, value_parser = clap::value_parser!(i32).range(0..=22))]
    pub zstd: i32,

    /// Format of normal maps [default: bc5; of a glTF file, what its target has]
    #[arg(long, value_name = "FORMAT", value_parser = choice(FORMATS))]
    pub normal_format: Option<Format>,

    /// Format of aniso, anisotropy, roughness and orm maps [default: bc7; of a glTF file, what its target has]
    #[arg(long, value_name = "FORMAT", value_parser = choice(FORMATS))]
    pub aniso_format: Option<Format>,

    /// Format of colour maps [default: bc7; of a glTF file, what its target has]
    #[arg(long, value_name = "FORMAT", value_parser = choice(FORMATS))]
    pub color_format: Option<Format>,

    /// Who compresses blocks of BCn; portable gives the same bytes on every processor, as does the encoder of uastc
    #[arg(long, value_parser = choice(ENCODERS))]
    pub encoder: Option<Encoder>,

    /// Time spent on a block; the defaults are measured for each kind of map
    #[arg(long, value_parser = choice(PRESETS))]
    pub preset: Option<Preset>,

    /// Of a glTF file, bake base colour, emission and occlusion too
    #[arg(long)]
    pub all_textures: bool,

    /// Of a glTF file whose textures are all baked, choose a specular colour together with base colour and metalness, so that
    /// metal beside other material keeps both what it scatters and what it reflects: KHR_materials_specular with factors above
    /// one, which some viewers do not know
    #[arg(long)]
    pub separate_specular: bool,

    /// Green grows upwards in normal maps (OpenGL, glTF), whatever their names and slopes say
    #[arg(long, conflicts_with = "y_down")]
    pub y_up: bool,

    /// Green grows downwards in normal maps (DirectX), whatever their names say; a glTF file's are turned round
    #[arg(long)]
    pub y_down: bool,

    /// Degrees that white stands for in a grey direction map: 360 or 180
    #[arg(long, value_name = "DEGREES", value_parser = |t: &str| number(t, 1.0..=360.0))]
    pub direction_span: Option<f32>,

    /// Says what a file holds; may be given again
    #[arg(long, value_name = "ROLE=FILE", value_parser = map)]
    pub map: Vec<(MapRole, PathBuf)>,

    /// Leaves a file of the folder out; may be given again
    #[arg(long, value_name = "FILE")]
    pub ignore: Vec<PathBuf>,

    /// Roughness where no map gives any
    #[arg(long, value_name = "0..1", value_parser = |t: &str| number(t, 0.0..=1.0))]
    pub roughness: Option<f32>,

    /// Anisotropy strength where no map gives any
    #[arg(long, value_name = "0..1", value_parser = |t: &str| number(t, 0.0..=1.0))]
    pub anisotropy: Option<f32>,

    /// What is named roughness holds gloss
    #[arg(long)]
    pub roughness_is_gloss: bool,

    /// Believe that a normal map is one, whatever its texels look like
    #[arg(long)]
    pub force_normal: bool,

    /// Only says what was understood, or of a kinran.toml what would be baked
    #[arg(long)]
    pub dry_run: bool,

    /// Overwrites files that kinran did not write, that were changed since, or that come from another input
    #[arg(long)]
    pub force: bool,
    /// Of a folder's normal maps, take z from blue as glTF does, instead of rebuilding it from red and green
    #[arg(long)]
    pub normal_blue: bool,

    /// How colour maps are encoded, whatever their files say; by default EXR, HDR and float TIFF are linear, others sRGB
    #[arg(long, value_name = "SPACE", value_parser = choice(COLOR_SPACES))]
    pub color_space: Option<Transfer>,

    /// Which layer of an EXR file holds the map; may be given again
    #[arg(long, value_name = "FILE=LAYER", value_parser = exr_layer)]
    pub exr_layer: Vec<(PathBuf, String)>,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub model: ModelArgs,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub curvature: CurvatureArgs,

    /// Flags that only a manifest takes.
    #[command(flatten)]
    pub library: LibraryArgs,
}

/// Zstandard's own default: higher levels gain a few per cent of blocks, at many times the time.
const DEFAULT_ZSTD: i32 = 3;

/// `ROLE=FILE`.
fn map(text: &str) -> Result<(MapRole, PathBuf), String> {
    let roles = || MapRole::all().map(MapRole::name).collect::<Vec<_>>().join(", ");
    let (role, file) =
        text.split_once('=').ok_or_else(|| format!("write ROLE=FILE; roles are {}", roles()))?;
    let role = MapRole::all().find(|r| r.name() == role);
    role.map(|role| (role, PathBuf::from(file))).ok_or_else(|| format!("roles are {}", roles()))
}

/// How colour is encoded.
const COLOR_SPACES: &Choices<Transfer> =
    &[(Transfer::Linear, "linear", "In proportion to light"), (Transfer::Srgb, "srgb", "By the sRGB curve")];

/// Shape of a footprint.
const KERNELS: &Choices<Kernel> = &[
    (Kernel::Box, "box", "The texel's own area"),
    (Kernel::Tent, "tent", "Twice as wide, smoother over distance"),
];

/// What lies beyond a map's border.
const EDGES: &Choices<Wrap> = &[
    (Wrap::Repeat, "wrap", "The map again"),
    (Wrap::Clamp, "clamp", "Its last texel"),
    (Wrap::Mirror, "mirror", "The map mirrored"),
];

/// Which maps hold the lobe.
const FORMS: &Choices<Form> = &[
    (Form::Aniso, "aniso", "Kinran's aniso map"),
    (Form::Khr, "khr", "Roughness and `KHR_materials_anisotropy`"),
    (Form::Both, "both", "Both"),
];

/// Who reads a glTF file's textures.
const TARGETS: &Choices<Target> = &[
    (Target::Web, "web", "Every viewer: UASTC in KTX2, which they turn into what their GPU knows, and PNG"),
    (
        Target::Desktop,
        "desktop",
        "Viewers that hand BC7 and BC5 in KTX2 to a desktop's GPU: three.js r184 and later; and PNG",
    ),
    (Target::Engine, "engine", "Engines that read BC7 and BC5 in DDS; viewers take the PNG beside it"),
    (Target::Plain, "plain", "PNG alone: level 0, with factors baked in; all other levels are the viewer's"),
];

/// Block encoders.
const ENCODERS: &Choices<Encoder> = &[
    (Encoder::Ispc, "ispc", "Intel's, the fastest"),
    (Encoder::Portable, "portable", "Rust's, the same on every machine"),
];

/// A cutoff, or whether there is one.
fn alpha_coverage(text: &str) -> Result<AlphaCoverage, String> {
    match text {
        "on" => Ok(AlphaCoverage::Masked),
        "off" => Ok(AlphaCoverage::Off),
        number => match number.parse() {
            Ok(cutoff) if (0.0..=1.0).contains(&cutoff) => Ok(AlphaCoverage::At(cutoff)),
            _ => Err("give on, off or a cutoff, 0 to 1".into()),
        },
    }
}

impl Args {
    /// Where the files go.
    fn output(&self) -> &Path {
        self.output.as_deref().unwrap_or(Path::new("baked"))
    }

    /// What the flags say about a folder.
    fn hints(&self) -> Hints {
        Hints {
            green: self.green(),
            direction_span: self.direction_span.map(f32::to_radians),
            maps: self.map.clone(),
            ignore: self.ignore.clone(),
            roughness_is_gloss: self.roughness_is_gloss,
            roughness: self.roughness,
            anisotropy: self.anisotropy,
            force_normal: self.force_normal,
            normal_blue: self.normal_blue,
            color_space: self.color_space,
            layers: self.exr_layer.clone(),
            wrap: [self.edges; 2],
        }
    }

    /// How textures are made.
    fn textures(&self) -> TextureOptions {
        let mut how = TextureOptions::default();
        (how.filter, how.kernel, how.container, how.zstd) =
            (self.filter, self.kernel, self.container, self.zstd);
        (how.normal_format, how.aniso_format, how.color_format) =
            (self.normal_format, self.aniso_format, self.color_format);
        (how.encoder, how.preset) = (self.encoder, self.preset);
        (how.correlated, how.alpha_coverage) = (self.correlated, self.alpha_coverage);
        how
    }

    /// Refuses flags about textures that contradict each other.
    fn check_textures(&self) -> Result<(), Error> {
        let target = |target| self.container.is_none() && self.target == Some(target);
        let no_ktx2 =
            self.container == Some(Container::Dds) || target(Target::Engine) || target(Target::Plain);
        if self.zstd != DEFAULT_ZSTD && no_ktx2 {
            let reason = "DDS files are not compressed, and PNG not by it; leave it out, or write KTX2";
            return Err(Error::flag_error(format!("--zstd {}", self.zstd), reason));
        }
        Ok(self.textures().check()?)
    }

    /// How a folder is baked.
    fn folder_options(&self) -> FolderOptions {
        let mut how = FolderOptions::default();
        (how.textures, how.hints, how.source) = (self.textures(), self.hints(), self.source());
        how.form = self.form.unwrap_or(how.form);
        how
    }

    /// How a glTF file is baked.
    fn gltf_options(&self) -> GltfOptions {
        let mut how = GltfOptions::default();
        (how.textures, how.green, how.source) = (self.textures(), self.green(), self.source());
        (how.target, how.form) = (self.target, self.form.unwrap_or(how.form));
        (how.all_textures, how.estimate_normals) = (self.all_textures, self.curvature.estimate_normals);
        how.separate_specular = self.separate_specular;
        how.allow_outside.clone_from(&self.model.allow_outside);
        (how.skin, how.curvature) = (self.curvature.skin.clone(), self.curvature.options());
        how
    }

    /// What reports name as their source.
    fn source(&self) -> Option<String> {
        way(self.output(), &self.input)
    }

    fn green(&self) -> Option<Green> {
        match (self.y_up, self.y_down) {
            (true, _) => Some(Green::Up),
            (_, true) => Some(Green::Down),
            _ => None,
        }
    }
}

/// Runs the command.
///
/// # Errors
/// Whatever is wrong with the input, the flags or the output folder; nothing half-written stays.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    if !args.input.is_dir() && has_extension(&args.input, "toml") {
        if let Some(flag) = Flag::given(args, |on| on == On::One) {
            let reason = format!("{}; leave it out", flag.refusal());
            return Err(Error::flag_error_of(&args.input, format!("--{}", flag.name), reason));
        }
        return bake_library(args, console);
    }
    if let Some(flag) = Flag::given(args, |on| on == On::Library) {
        let reason = format!("{}; name one, or leave it out", flag.refusal());
        return Err(Error::flag_error_of(&args.input, format!("--{}", flag.name), reason));
    }
    args.check_textures()?;
    if is_gltf(&args.input) {
        args.gltf_options().settled()?;
    }
    let gltf = is_gltf(&args.input);
    if args.input.is_file() && !gltf {
        let is = |extensions: &[&str]| extensions.iter().any(|e| has_extension(&args.input, e));
        let reason = if is(&["obj"]) {
            "an OBJ brings no materials with maps; save it as .glb (Blender does) and bake that"
        } else if is(&["zip", "7z", "rar", "tar", "gz", "xz", "zst"]) {
            "is an archive; unpack it and name the folder"
        } else if is(&["sbsar", "sbs", "spp"]) {
            "is a Substance file; export its maps into a folder and name that"
        } else if is(&["fbx", "blend", "usd", "usda", "usdc", "usdz", "max", "ma", "mb", "dae", "stl", "ply"])
        {
            "is a model that is not read; save it as .glb (Blender does) and bake that"
        } else if kinran_image::has_image_extension(&args.input) {
            "is a single image; put the maps of a material into a folder and name that"
        } else {
            "is neither a folder of maps, a .glb or .gltf, nor a kinran.toml; name one of these"
        };
        return Err(Error::file_error(&args.input, reason));
    }
    let nowhere = args.output.is_none() && !args.dry_run;
    let args = &Args {
        output: Some(args.output.clone().unwrap_or_else(|| beside(&args.input, "baked"))),
        ..args.clone()
    };
    if !args.dry_run {
        check_folder(args.output())?;
    }
    let gltf = gltf && !args.input.is_dir();
    if let Some(flag) = args.idle_flag(gltf) {
        let reason = format!("{}; leave the flag out", flag.refusal());
        return Err(Error::flag_error_of(&args.input, format!("--{}", flag.name), reason));
    }
    match (gltf, args.dry_run) {
        (false, false) => folder::run(args, console).map_err(|e| with_a_way(e, console)),
        (false, true) => folder::dry_run(args, console).map_err(|e| with_a_way(e, console)),
        (true, false) => gltf::run(args, console),
        (true, true) => gltf::dry_run(args, console),
    }?;
    if nowhere {
        console.note(format!("no --output was given: the files went to {}", args.output().display()));
    }
    Ok(())
}

/// The error of a folder without maps; where there is something to bake below it, the way to do that.
fn with_a_way(error: Error, console: &Console) -> Error {
    let Error::Folder(FolderError::NoMaps { folder, .. }) = &error else { return error };
    let manifest = folder.join(MANIFEST);
    if manifest.is_file() {
        let reason = format!(
            "holds no maps, but a {MANIFEST}; `kinran bake {}` bakes what it lists",
            manifest.display()
        );
        return Error::file_error(folder, reason);
    }
    match Survey::of(folder, &console.progress()) {
        Ok(survey) if survey.only_model().is_some() => {
            let model = folder.join(survey.only_model().unwrap_or(Path::new("")));
            Error::file_error(
                folder,
                format!("holds no maps, but a model; `kinran bake {}` bakes it", model.display()),
            )
        }
        Ok(survey) if !survey.is_empty() => {
            let way = format!("`kinran init {}` writes a {MANIFEST} for them", folder.display());
            Error::file_error(
                folder,
                format!("holds no maps, but {}{}; {way}", survey.counts(), survey.others()),
            )
        }
        Ok(survey) => match survey.failing() {
            Some(failing) => Error::file_error(
                folder,
                format!("holds no maps, and what is below it cannot be baked: {failing}"),
            ),
            None => error,
        },
        Err(_) => error,
    }
}
