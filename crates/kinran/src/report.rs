//! The sidecar: how textures were made and what was lost.

use kinran_bake::aniso::LevelError;
use kinran_image::{Texture, Transfer};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::content::Content;
use crate::options::TextureOptions;
use crate::{Error, Sink};

/// A file that went in.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Input {
    /// Its name.
    pub file: String,
    /// What it holds.
    pub role: String,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// BLAKE3 of the file's bytes.
    pub blake3: String,
    /// What was chosen when it was read: the layer, how colour is encoded.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// A file that came out.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Output {
    /// Its name, beside the report.
    pub file: String,
    /// What it holds.
    pub map: Content,
    /// Its texel format.
    pub format: String,
    /// `linear` or `srgb`.
    pub transfer: &'static str,
    /// Texels in a row of level 0.
    pub width: u32,
    /// Rows of level 0.
    pub height: u32,
    /// Mip levels.
    pub levels: usize,
    /// Size of the file.
    pub bytes: usize,
    /// BLAKE3 of the file's bytes.
    pub blake3: String,
}

impl Output {
    pub(crate) fn new(file: String, map: Content, texture: &Texture, bytes: &[u8]) -> Self {
        Output {
            file,
            map,
            format: texture.format.name().into(),
            transfer: if texture.transfer == Transfer::Srgb { "srgb" } else { "linear" },
            width: texture.levels[0].width,
            height: texture.levels[0].height,
            levels: texture.levels.len(),
            bytes: bytes.len(),
            blake3: blake3::hash(bytes).to_hex().to_string(),
        }
    }
}

/// One surface's textures.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SurfaceReport {
    /// The material, or the first one that uses the surface.
    pub name: String,
    /// What went in.
    pub inputs: Vec<Input>,
    /// What came out.
    pub outputs: Vec<Output>,
    /// Errors of normals and lobe, level by level; empty where the material has neither.
    pub levels: Vec<LevelError>,
}

impl SurfaceReport {
    /// A surface of which nothing is known yet.
    pub fn new(name: String) -> Self {
        SurfaceReport { name, inputs: Vec::new(), outputs: Vec::new(), levels: Vec::new() }
    }
}

/// Curvature of one mesh.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct MeshCurvature {
    /// The mesh.
    pub mesh: String,
    /// Millimetres in its unit.
    pub millimetres: f64,
    /// Curvature of the code 255, 1/mm.
    pub range: f32,
    /// Largest error of packing, 1/mm.
    pub largest_error: f32,
    /// Root of the mean square of packing's error, 1/mm.
    pub rms_error: f32,
    /// Vertices whose curvature is above the range.
    pub clamped_vertices: usize,
    /// What the mesh is made of, and what was skipped.
    #[serde(flatten)]
    pub found: kinran_bake::curvature::Report,
}

/// What one run baked.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Report {
    /// Kinran's version.
    pub kinran: &'static str,
    /// The folder or model that was baked, from the report's folder, `/`-separated; none in a library.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// The filter's name.
    pub filter: &'static str,
    /// The footprint's shape.
    pub kernel: String,
    /// The surfaces.
    pub surfaces: Vec<SurfaceReport>,
    /// Curvature of meshes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub curvature: Vec<MeshCurvature>,
    /// What was left out or assumed, a sentence each.
    pub warnings: Vec<String>,
    /// Every file that was written beside this report: a later run writes these again, and no others, without a question.
    pub written: Vec<WrittenFile>,
    /// What earlier runs wrote beside this report, under other flags, and is there as they left it; nothing refers to it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub kept: Vec<WrittenFile>,
}

impl Report {
    /// A report of nothing yet.
    pub fn new(how: &TextureOptions) -> Self {
        Report {
            kinran: env!("CARGO_PKG_VERSION"),
            source: None,
            filter: how.filter.name(),
            kernel: format!("{:?}", how.kernel).to_lowercase(),
            surfaces: Vec::new(),
            curvature: Vec::new(),
            warnings: Vec::new(),
            written: Vec::new(),
            kept: Vec::new(),
        }
    }

    /// Writes the report as `file`; `others` are the files that were written besides the textures.
    pub(crate) fn write(
        &mut self,
        out: &dyn Sink,
        file: &str,
        others: Vec<WrittenFile>,
    ) -> Result<(), Error> {
        let textures = self.surfaces.iter().flat_map(|s| &s.outputs).cloned();
        self.written = textures.map(WrittenFile::from).chain(others).collect();
        self.kept = kept_files(out, file, &self.written);
        let mut text = serde_json::to_string_pretty(self).map_err(|e| Error::Internal(e.to_string()))?;
        text.push('\n');
        out.put(file, text.as_bytes())?;
        out.finish()
    }
}

/// A file that was written, as the report beside it names it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
pub struct WrittenFile {
    /// Its path from the report's folder, `/`-separated.
    pub file: String,
    /// Its size.
    pub bytes: usize,
    /// BLAKE3 of its bytes.
    pub blake3: String,
}

impl WrittenFile {
    /// What is known of a file by its bytes.
    pub fn new(file: impl Into<String>, bytes: &[u8]) -> Self {
        let blake3 = blake3::hash(bytes).to_hex().to_string();
        WrittenFile { file: file.into(), bytes: bytes.len(), blake3 }
    }
}

impl From<Output> for WrittenFile {
    fn from(output: Output) -> Self {
        WrittenFile { file: output.file, bytes: output.bytes, blake3: output.blake3 }
    }
}

/// A report, as far as it says which files are its own.
#[derive(Debug, Deserialize)]
pub struct KnownFiles {
    /// Those that its run wrote.
    pub written: Vec<WrittenFile>,
    /// Those of runs before.
    #[serde(default)]
    pub kept: Vec<WrittenFile>,
    /// What it was made from, as a way from the report's folder.
    pub source: Option<String>,
}

impl KnownFiles {
    /// All files that it names.
    pub fn files(self) -> impl Iterator<Item = WrittenFile> {
        self.written.into_iter().chain(self.kept)
    }
}

/// What earlier runs wrote beside `report`, this one did not, and nobody has changed since: textures of another
/// container or form. Asked before the report is written anew.
pub fn kept_files(out: &dyn Sink, report: &str, written: &[WrittenFile]) -> Vec<WrittenFile> {
    let read = |bytes: Vec<u8>| serde_json::from_slice::<KnownFiles>(&bytes).ok();
    let Some(earlier) = out.get(report).and_then(read) else { return Vec::new() };
    let is_new = |kept: &WrittenFile| written.iter().all(|w| w.file != kept.file) && kept.file != report;
    let is_there = |kept: &WrittenFile| {
        out.get(&kept.file).is_some_and(|now| WrittenFile::new(&*kept.file, &now) == *kept)
    };
    earlier.files().filter(|kept| is_new(kept) && is_there(kept)).collect()
}
