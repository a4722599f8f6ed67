//! How a glTF file is baked.

use std::path::PathBuf;

use kinran_bake::curvature::{BLUR, Method};
use kinran_bake::folder::Green;

use crate::Error;
use crate::options::{Form, TextureOptions};

/// How a glTF file is baked.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct GltfOptions {
    /// How textures are filtered, compressed and stored.
    pub textures: TextureOptions,
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
