//! `kinran bake`: engine-ready textures from a folder of maps or a glTF file.

pub(crate) mod curvature;
mod flags;
mod folder;
mod gltf;
mod library;
pub(crate) mod report;
mod settings;

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use kinran_bake::aniso::{Filter, Kernel, Sheet, SurfaceOptions};
use kinran_bake::folder::{FolderError, Green, Hints, Role as MapRole};
use kinran_image::{
    Encoder, Encoding, Format, Preset, Role, Texture, Transfer, encode_dds, encode_ktx2, full_level_count,
    level_size, write_atomically,
};
use kinran_scene::{Wrap, is_gltf};

use self::flags::{Flag, On};
use crate::content::Content;
use crate::init::{MANIFEST, Survey};
use crate::model::ModelArgs;
use crate::outputs::{Space, beside, check_folder, has_extension};
use crate::values::{exr_layer, filter, number};
use crate::{Console, Error};

pub use curvature::{CurvatureArgs, CurvatureReport};
use curvature::{MethodName, Which};
pub use folder::bake_folder;
pub use gltf::bake_gltf;
pub(crate) use gltf::texel_remarks;
pub use library::{CACHE_LIMIT, LibraryArgs, LibraryReport, bake_library, cache_folder};
pub(crate) use report::format_name;
pub use report::{Input, Output, Report, SurfaceReport};

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
    #[arg(long, value_enum, default_value_t)]
    pub kernel: KernelName,

    /// What lies beyond the borders of a folder's maps; glTF files say it themselves
    #[arg(long, value_enum, default_value_t)]
    pub edges: Edges,

    /// Which maps hold the lobe; the default is aniso for folders and khr for glTF, which khr's maps are always written for
    #[arg(long, value_enum)]
    pub form: Option<Form>,

    /// File format of the textures
    #[arg(long, value_enum, default_value_t)]
    pub container: Container,

    /// Zstandard level of KTX2 files, 0 for none
    #[arg(long, value_name = "LEVEL", default_value_t = 3, value_parser = clap::value_parser!(i32).range(0..=22))]
    pub zstd: i32,

    /// Format of normal maps [default: bc5]
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub normal_format: Option<FormatName>,

    /// Format of aniso, anisotropy, roughness and orm maps [default: bc7]
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub aniso_format: Option<FormatName>,

    /// Format of colour maps [default: bc7]
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub color_format: Option<FormatName>,

    /// Who compresses blocks; portable gives the same bytes on every processor
    #[arg(long, value_enum)]
    pub encoder: Option<EncoderName>,

    /// Time spent on a block; the defaults are measured for each kind of map
    #[arg(long, value_enum)]
    pub preset: Option<PresetName>,

    /// Of a glTF file, bake base colour, emission and occlusion too
    #[arg(long)]
    pub all_textures: bool,

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
    #[arg(long, value_enum, value_name = "SPACE")]
    pub color_space: Option<ColorSpace>,

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

    /// The input is a library's copy, whose place says nothing.
    #[arg(skip)]
    pub is_copy: bool,
}

/// `ROLE=FILE`.
fn map(text: &str) -> Result<(MapRole, PathBuf), String> {
    let roles = || MapRole::all().map(MapRole::name).collect::<Vec<_>>().join(", ");
    let (role, file) =
        text.split_once('=').ok_or_else(|| format!("write ROLE=FILE; roles are {}", roles()))?;
    let role = MapRole::all().find(|r| r.name() == role);
    role.map(|role| (role, PathBuf::from(file))).ok_or_else(|| format!("roles are {}", roles()))
}

/// How colour is encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ColorSpace {
    /// In proportion to light
    Linear,
    /// By the sRGB curve
    Srgb,
}

/// Shape of a footprint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum KernelName {
    /// The texel's own area
    #[default]
    Box,
    /// Twice as wide, smoother over distance
    Tent,
}

/// What lies beyond a map's border.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Edges {
    /// The map again
    #[default]
    Wrap,
    /// Its last texel
    Clamp,
    /// The map mirrored
    Mirror,
}

/// Which maps hold the lobe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Form {
    /// Kinran's aniso map
    Aniso,
    /// Roughness and `KHR_materials_anisotropy`
    Khr,
    /// Both
    Both,
}

impl Form {
    fn aniso(self) -> bool {
        self != Form::Khr
    }

    fn khr(self) -> bool {
        self != Form::Aniso
    }
}

/// File format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Container {
    /// KTX2
    #[default]
    Ktx2,
    /// DDS with a DX10 header
    Dds,
    /// Both
    Both,
}

impl Container {
    /// The file extensions written.
    pub fn extensions(self) -> &'static [&'static str] {
        match self {
            Container::Ktx2 => &["ktx2"],
            Container::Dds => &["dds"],
            Container::Both => &["ktx2", "dds"],
        }
    }
}

/// Texel format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[allow(missing_docs, reason = "the names are the formats'")]
pub enum FormatName {
    Bc1,
    Bc4,
    Bc5,
    Bc7,
    Rgba8,
    Rgba16f,
}

/// Block encoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EncoderName {
    /// Intel's, the fastest
    Ispc,
    /// Rust's, the same on every machine
    Portable,
}

/// Time spent on a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PresetName {
    /// For previews
    Fast,
    /// For every day
    Normal,
    /// For release builds
    Best,
}

impl From<PresetName> for Preset {
    fn from(name: PresetName) -> Self {
        match name {
            PresetName::Fast => Preset::Fast,
            PresetName::Normal => Preset::Normal,
            PresetName::Best => Preset::Best,
        }
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
            color_space: self.color_space.map(|space| match space {
                ColorSpace::Linear => Transfer::Linear,
                ColorSpace::Srgb => Transfer::Srgb,
            }),
            layers: self.exr_layer.clone(),
            wrap: self.wrap(),
        }
    }

    /// A map's encoding: the role's measured default, changed by what flags say.
    fn encoding(&self, role: Role, format: Option<FormatName>) -> Encoding {
        let mut encoding = role.encoding();
        if let Some(format) = format {
            encoding.format = match format {
                FormatName::Bc1 => Format::Bc1,
                FormatName::Bc4 => Format::Bc4,
                FormatName::Bc5 => Format::Bc5,
                FormatName::Bc7 => Format::Bc7,
                FormatName::Rgba8 => Format::Rgba8,
                FormatName::Rgba16f => Format::Rgba16F,
            };
        }
        if let Some(encoder) = self.encoder {
            (encoding.encoder, encoding.preset) = match encoder {
                EncoderName::Ispc => (Encoder::Ispc, Preset::Normal),
                EncoderName::Portable => (Encoder::Portable, Preset::Fast),
            };
        }
        if let Some(preset) = self.preset {
            encoding.preset = preset.into();
        }
        encoding
    }

    fn options(&self) -> SurfaceOptions {
        let kernel = match self.kernel {
            KernelName::Box => Kernel::Box,
            KernelName::Tent => Kernel::Tent,
        };
        SurfaceOptions { filter: self.filter, kernel }
    }

    fn wrap(&self) -> [Wrap; 2] {
        [match self.edges {
            Edges::Wrap => Wrap::Repeat,
            Edges::Clamp => Wrap::Clamp,
            Edges::Mirror => Wrap::Mirror,
        }; 2]
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
    check_formats(args)?;
    let gltf = is_gltf(&args.input);
    if args.input.is_file() && !gltf {
        let reason = match has_extension(&args.input, "obj") {
            true => "an OBJ brings no materials with maps; save it as .glb (Blender does) and bake that",
            false => "is neither a folder of maps, a .glb or .gltf, nor a kinran.toml; name one of these",
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
            Error::file_error(folder, format!("holds no maps, but {}; {way}", survey.counts()))
        }
        _ => error,
    }
}

/// Refuses formats that have fewer channels than the map.
fn check_formats(args: &Args) -> Result<(), Error> {
    let wanted = [
        ("--normal-format", args.normal_format, 2, "normal maps need red and green"),
        ("--aniso-format", args.aniso_format, 3, "these maps need red, green and blue"),
        ("--color-format", args.color_format, 3, "colour needs red, green and blue"),
    ];
    if args.color_format == Some(FormatName::Rgba16f) {
        return Err(Error::flag_error(
            "--color-format rgba16f",
            "colour maps hold 8 bits; choose bc7, bc1 or rgba8",
        ));
    }
    for (flag, format, channels, reason) in wanted {
        let (has, name) = match format {
            Some(FormatName::Bc4) => (1, "bc4"),
            Some(FormatName::Bc5) => (2, "bc5"),
            _ => continue,
        };
        if has < channels {
            let reason = format!("{reason}; choose bc7, bc1, rgba8 or rgba16f");
            return Err(Error::flag_error(format!("{flag} {name}"), reason));
        }
    }
    Ok(())
}

/// The role of a sheet's texels.
fn role_of(sheet: Sheet) -> Role {
    match sheet {
        Sheet::Normal => Role::Normal,
        Sheet::Roughness | Sheet::IsotropicRoughness => Role::Data,
        Sheet::Aniso | Sheet::KhrAnisotropy => Role::Aniso,
    }
}

/// The format that flags give a sheet.
fn sheet_format(args: &Args, sheet: Sheet) -> Option<FormatName> {
    if sheet == Sheet::Normal { args.normal_format } else { args.aniso_format }
}

/// The files of a texture.
fn texture_files(args: &Args, name: &str) -> Vec<String> {
    args.container.extensions().iter().map(|extension| format!("{name}.{extension}")).collect()
}

/// Texels of all levels.
fn mip_texels((width, height): (u32, u32)) -> u64 {
    let levels = 0..full_level_count(width, height);
    levels.map(|level| u64::from(level_size(width, level)) * u64::from(level_size(height, level))).sum()
}

/// Bytes of a texture's files.
fn texture_space(args: &Args, format: Format, size: (u32, u32)) -> Space {
    Space::of_texture(args.container, args.zstd, format, size)
}

/// Writes a texture in the containers asked for; gives the reports of the files.
fn write_texture(args: &Args, name: &str, map: Content, mut texture: Texture) -> Result<Vec<Output>, Error> {
    std::fs::create_dir_all(args.output()).map_err(|e| kinran_image::Error::io(args.output(), e))?;
    map.mark(&mut texture);
    texture.metadata.insert("KinranFilter".into(), args.filter.name().into());
    args.container
        .extensions()
        .iter()
        .map(|extension| {
            let file = format!("{name}.{extension}");
            let path = args.output().join(&file);
            let bytes = match *extension {
                "dds" => encode_dds(&texture)?,
                _ => encode_ktx2(&texture, (args.zstd > 0).then_some(args.zstd))?,
            };
            write_atomically(&path, &bytes)?;
            Ok(Output::new(file, map, &texture, &bytes))
        })
        .collect()
}

/// A name that is a file's on every system: what is not a letter, digit, dash, dot or underscore becomes `_`.
fn file_stem(name: &str) -> String {
    let stem: String =
        name.chars().map(|c| if c.is_alphanumeric() || "-._".contains(c) { c } else { '_' }).collect();
    let stem = stem.trim_start_matches('.');
    if stem.is_empty() { "material".into() } else { stem.into() }
}

/// The last component of a path, as text.
fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
