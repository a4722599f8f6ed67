//! How a glTF file is baked.

use std::path::PathBuf;

use kinran_bake::curvature::{BLUR, Method};
use kinran_bake::folder::Green;
use kinran_image::{Encoder, Format};

use crate::Error;
use crate::options::{Container, Form, TextureOptions};

/// How a glTF file is baked.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct GltfOptions {
    /// How textures are filtered, compressed and stored.
    pub textures: TextureOptions,
    /// Who is to read the textures; see [`GltfOptions::target`] for what holds where nothing is said.
    pub target: Option<Target>,
    /// Which maps hold the lobe; glTF's own are always written. [`Form::Khr`] by default.
    pub form: Form,
    /// Whether base colour, emission and occlusion are baked too.
    pub all_textures: bool,
    /// Whether a specular colour is chosen together with base colour and metalness, for materials whose `KHR_materials_specular`
    /// and `KHR_materials_ior` say nothing. It takes [`GltfOptions::all_textures`].
    pub separate_specular: bool,
    /// Which way green points in normal maps, where they are not as glTF wants them; they are turned over where it points
    /// down.
    pub green: Option<Green>,
    /// Folders whose files the model may name besides those of its own.
    pub allow_outside: Vec<PathBuf>,
    /// Materials that become skin, by name, or "all".
    pub skin: Vec<String>,
    /// How curvature is measured.
    pub curvature: CurvatureOptions,
    /// Whether meshes that have no normals get smooth ones.
    pub estimate_normals: bool,
    /// What the report names as its source: the way from the output to the model, `/`-separated.
    pub source: Option<String>,
}

impl Default for GltfOptions {
    fn default() -> Self {
        GltfOptions {
            textures: TextureOptions::default(),
            target: None,
            form: Form::Khr,
            all_textures: false,
            separate_specular: false,
            green: None,
            allow_outside: Vec::new(),
            skin: Vec::new(),
            curvature: CurvatureOptions::default(),
            estimate_normals: false,
            source: None,
        }
    }
}

/// Who is to read the textures of a glTF file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Target {
    /// Every viewer: UASTC in KTX2, which is what `KHR_texture_basisu` allows, and a PNG of level 0; normals have three
    /// channels.
    Web,
    /// Viewers that hand the blocks in a KTX2 file to a desktop's GPU, such as three.js from r184 on: BC7, normals in BC5, and
    /// a PNG of level 0. The text of `KHR_texture_basisu` does not allow it.
    #[default]
    Desktop,
    /// Engines: the same blocks in DDS, by `MSFT_texture_dds`, and a PNG of level 0, which viewers show.
    Engine,
    /// Whatever knows glTF and nothing else: a PNG of level 0 where factors are baked in; all other levels are the viewer's.
    Plain,
}

impl Target {
    /// What reports, messages and flags call it.
    pub fn name(self) -> &'static str {
        match self {
            Target::Web => "web",
            Target::Desktop => "desktop",
            Target::Engine => "engine",
            Target::Plain => "plain",
        }
    }
}

impl GltfOptions {
    /// Who is to read the textures, where nothing says it: who reads the container and the formats that are asked for, else
    /// [`Target::default`].
    pub fn target(&self) -> Target {
        let how = &self.textures;
        let formats = [how.normal_format, how.aniso_format, how.color_format];
        let native = formats.iter().flatten().any(|format| *format != Format::Uastc);
        match (self.target, how.container) {
            (Some(target), _) => target,
            (None, Some(Container::Dds)) => Target::Engine,
            (None, Some(Container::Both)) => Target::Desktop,
            _ if native || how.encoder == Some(Encoder::Ispc) => Target::Desktop,
            _ => Target::default(),
        }
    }

    /// The options with the target, and with the formats and the container of the target where nothing was said of them.
    ///
    /// # Errors
    /// [`Error::Option`] that names an option out of its range, or one that the target contradicts.
    pub fn settled(&self) -> Result<GltfOptions, Error> {
        let (target, mut how) = (self.target(), self.clone());
        let textures = &mut how.textures;
        let refused = |option, given: &str, reason: &str| {
            let reason = format!("{reason}, which is not what the target {} is for", target.name());
            Err(Error::Option { option, given: given.into(), file: None, reason })
        };
        let formats = [
            ("normal-format", &mut textures.normal_format),
            ("aniso-format", &mut textures.aniso_format),
            ("color-format", &mut textures.color_format),
        ];
        match target {
            Target::Web => {
                if !Format::Uastc.has_encoder() {
                    let reason = "this build has no encoder for UASTC; build with the feature `uastc`, or choose desktop";
                    let (given, reason) = (target.name().into(), reason.into());
                    return Err(Error::Option { option: "target", given, file: None, reason });
                }
                if let Some(container @ (Container::Dds | Container::Both)) = textures.container {
                    return refused("container", container.name(), "most viewers read no DDS");
                }
                for (option, format) in formats {
                    if *format.get_or_insert(Format::Uastc) != Format::Uastc {
                        let given = format.unwrap_or(Format::Uastc).name();
                        return refused(option, given, "most viewers read nothing in KTX2 but uastc");
                    }
                }
                if textures.encoder == Some(Encoder::Ispc) {
                    return refused("encoder", "ispc", "it has blocks of BCn alone");
                }
                textures.container = Some(Container::Ktx2);
            }
            Target::Desktop => {
                if textures.container == Some(Container::Dds) {
                    return refused("container", "dds", "viewers read no DDS");
                }
                textures.container.get_or_insert(Container::Ktx2);
            }
            Target::Engine => {
                if textures.container == Some(Container::Ktx2) {
                    return refused("container", "ktx2", "its DDS would be missing");
                }
                textures.container.get_or_insert(Container::Dds);
            }
            Target::Plain => {
                if let Some(container) = textures.container {
                    return refused("container", container.name(), "it is about files with levels");
                }
                if let Some((option, format)) = formats.into_iter().find(|(_, format)| format.is_some()) {
                    let given = format.map_or("", Format::name);
                    return refused(option, given, "it is about files with levels");
                }
                if self.form.aniso() {
                    let name = if self.form == Form::Aniso { "aniso" } else { "both" };
                    return refused("form", name, "the aniso map lives by its levels");
                }
                if self.all_textures {
                    return refused("all-textures", "", "it is about levels of colours");
                }
            }
        }
        how.textures.check()?;
        how.target = Some(target);
        Ok(how)
    }

    /// Whether a texture is stored with its levels, or as a PNG alone. `KHR_texture_basisu` and WebGL want whole blocks on
    /// level 0.
    pub(crate) fn keeps_levels(&self, format: Format, (width, height): (u32, u32)) -> bool {
        let side = format.block_side();
        match self.target() {
            Target::Web | Target::Desktop => width.is_multiple_of(side) && height.is_multiple_of(side),
            Target::Engine => true,
            Target::Plain => false,
        }
    }
}

/// How curvature is measured.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CurvatureOptions {
    /// Which meshes get curvature tensors.
    pub of: Which,
    /// How tensors are found.
    pub method: Method,
    /// Curvature of the largest code, 1/mm, 0.0001 to 1000; by default what fits the mesh.
    pub range: Option<f32>,
    /// Deviations of the Gaussians that blur curvature, mm, above 0, at most four; by default [`BLUR`].
    pub blur: Vec<f64>,
    /// Millimetres in a unit of the file's meshes, 1e-6 to 1e9; by default glTF's metre times the nodes' scale.
    pub millimetres: Option<f32>,
    /// Also writes tensors to files for other tools.
    pub dump: Option<Dump>,
}

impl Default for CurvatureOptions {
    fn default() -> Self {
        CurvatureOptions {
            of: Which::Skin,
            method: Method::Normals,
            range: None,
            blur: BLUR.to_vec(),
            millimetres: None,
            dump: None,
        }
    }
}

/// Which meshes get curvature.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Which {
    /// Those with a material that is skin.
    #[default]
    Skin,
    /// All.
    All,
    /// None.
    None,
}

/// File format of a dump.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dump {
    /// NAME_curvature.json: tensor, mean, principal curvatures and direction of every vertex.
    Json,
    /// NAME_curvature.exr: a pixel for each vertex, row by row: the mean in Y; xx, xy, yy in X, Y, Z of
    /// the layer tensor.
    Exr,
}

impl CurvatureOptions {
    /// Refuses numbers out of their ranges.
    ///
    /// # Errors
    /// [`Error::Option`] that names the option and what it may be.
    pub fn check(&self) -> Result<(), Error> {
        let refused = |option, given: String, reason: &str| {
            Err(Error::Option { option, given, file: None, reason: reason.into() })
        };
        if let Some(range) = self.range.filter(|range| !(0.0001..=1000.0).contains(range)) {
            return refused("curvature-range", range.to_string(), "give 0.0001 to 1000, in 1/mm");
        }
        if let Some(unit) = self.millimetres.filter(|unit| !(1e-6..=1e9).contains(unit)) {
            return refused("unit-mm", unit.to_string(), "give 0.000001 to 1000000000, in mm");
        }
        if self.blur.len() > 4 || !self.blur.iter().all(|blur| *blur > 0.0 && *blur <= 1e6) {
            let given = self.blur.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
            return refused("curvature-blur", given, "give at most four numbers above zero, in mm");
        }
        Ok(())
    }
}
