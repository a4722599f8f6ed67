//! Flags about skin and the curvature of meshes.

use kinran::bake::{CurvatureOptions, Dump, Which};
use kinran::report::MeshCurvature;
use kinran_bake::curvature::Method;

use crate::values::{Choices, choice, number};

/// Flags about skin and curvature.
#[derive(Clone, Debug, PartialEq, clap::Args)]
#[command(next_help_heading = "Skin (glTF)")]
pub struct CurvatureArgs {
    /// Marks a material as skin by its name, or "all"; may be given again
    #[arg(long, value_name = "MATERIAL")]
    pub skin: Vec<String>,

    /// Which meshes get curvature tensors
    #[arg(long, value_name = "CURVATURE", default_value = "skin", value_parser = choice(WHICH))]
    pub curvature: Which,

    /// How tensors are found
    #[arg(long, value_name = "CURVATURE_METHOD", default_value = "normals", value_parser = choice(METHODS))]
    pub curvature_method: Method,

    /// Curvature of the largest code, 1/mm; the default fits the mesh
    #[arg(long, value_name = "1/MM", value_parser = |t: &str| number(t, 0.0001..=1000.0))]
    pub curvature_range: Option<f32>,

    /// Deviations of the Gaussians that blur curvature, mm, or "none" [default: 8,2.3]
    #[arg(long, value_name = "MM,MM", value_parser = deviations)]
    pub curvature_blur: Option<Blur>,

    /// Millimetres in a unit of the file's meshes; the default is glTF's metre times the nodes' scale
    #[arg(long, value_name = "MM", value_parser = |t: &str| number(t, 1e-6..=1e9))]
    pub unit_mm: Option<f32>,

    /// Gives meshes that have no normals smooth ones
    #[arg(long)]
    pub estimate_normals: bool,

    /// Also writes tensors to files for other tools
    #[arg(long, value_name = "FORMAT", value_parser = choice(DUMPS))]
    pub curvature_dump: Option<Dump>,
}

/// Which meshes get curvature.
const WHICH: &Choices<Which> = &[
    (Which::Skin, "skin", "Those with a material that is skin"),
    (Which::All, "all", "All"),
    (Which::None, "none", "None"),
];

/// How tensors are found.
pub(crate) const METHODS: &Choices<Method> = &[
    (Method::Normals, "normals", "By the change of normals along edges, as in the talk"),
    (Method::Fit, "fit", "By fitting surfaces, for irregular and scanned meshes"),
];

/// File format of a dump.
const DUMPS: &Choices<Dump> = &[
    (
        Dump::Json,
        "json",
        "NAME_curvature.json: tensor, mean, principal curvatures and direction of every vertex",
    ),
    (
        Dump::Exr,
        "exr",
        "NAME_curvature.exr: a pixel for each vertex, row by row: the mean in Y; xx, xy, yy in X, Y, Z of the layer tensor",
    ),
];

/// Deviations in millimetres.
#[derive(Clone, Debug, PartialEq)]
pub struct Blur(pub(crate) Vec<f64>);

pub(crate) fn deviations(text: &str) -> Result<Blur, String> {
    if text == "none" {
        return Ok(Blur(Vec::new()));
    }
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse::<f64>()).collect();
    match numbers {
        Ok(v) if v.len() <= 4 && v.iter().all(|x| *x > 0.0 && *x <= 1e6) => Ok(Blur(v)),
        _ => Err("write one to four positive numbers, such as 8,2.3, or none".into()),
    }
}

impl CurvatureArgs {
    /// What the flags say.
    pub(super) fn options(&self) -> CurvatureOptions {
        let mut how = CurvatureOptions::default();
        (how.of, how.method, how.range) = (self.curvature, self.curvature_method, self.curvature_range);
        (how.millimetres, how.dump) = (self.unit_mm, self.curvature_dump);
        if let Some(Blur(blur)) = &self.curvature_blur {
            how.blur.clone_from(blur);
        }
        how
    }
}

/// A line for people.
pub(super) fn text(curvature: &MeshCurvature) -> String {
    let remarks = curvature.found.remarks();
    format!(
        "{}: curvature of {} vertices up to {:.3}/mm, packed to within {:.4} (RMS {:.5}){}{}\n",
        curvature.mesh,
        curvature.found.vertices,
        curvature.range,
        curvature.largest_error,
        curvature.rms_error,
        match curvature.clamped_vertices {
            0 => String::new(),
            clamped => format!(", {clamped} above"),
        },
        if remarks.is_empty() { remarks } else { format!("; {remarks}") },
    )
}
