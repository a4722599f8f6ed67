//! The tables that skin is lit with.
//!
//! ```
//! use kinran::skin::{TableOptions, tables};
//! use kinran::{Memory, Task};
//!
//! let (mut how, out) = (TableOptions::default(), Memory::new());
//! how.size = (32, 16);
//! let report = tables(&Memory::new(), &how, None, &out, Task::QUIET)?;
//! assert_eq!(report.profile, "human skin, six Gaussians");
//! assert!(out.get("skin_punctual.ktx2").is_some() && out.get("skin.kinran.json").is_some());
//! # Ok::<(), kinran::Error>(())
//! ```

use std::path::PathBuf;

use kinran_bake::skin_lut::{
    INTERPOLATION_GRID, ambient_table, penumbra_table, punctual_interpolation_error, punctual_table,
};
use kinran_image::Files;
use schemars::JsonSchema;
use serde::Serialize;

use crate::content::Content;
use crate::error::InputFault;
use crate::names::file_name;
use crate::options::Container;
use crate::report::{WrittenFile, kept_files};
use crate::sink::place_in;
use crate::skin_profile;
use crate::textures::put_texture;
use crate::{Error, Sink, Space, Stage, Task};

pub use kinran_bake::skin_lut::{Profile, Table, TableFormat};
pub use kinran_shading::skin::profile::Gaussian;

use kinran_shading::skin::profile::ProfileError;

/// Where a diffusion profile comes from.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum ProfileSource {
    /// Human skin, as a sum of six Gaussians.
    #[default]
    HumanSkin,
    /// Burley's normalised diffusion: d of red, green and blue, mm.
    Burley([f64; 3]),
    /// Burley's normalised diffusion by mean free path.
    MeanFreePath {
        /// Mean free path of red, green and blue, mm.
        path: [f64; 3],
        /// Their diffuse albedo, 0 to 1.
        albedo: [f64; 3],
    },
    /// A file: a `.csv` of rows of distance in mm and density for red, green and blue, or a `.json` of Gaussians.
    File(PathBuf),
    /// A profile, and what reports call it.
    Given(Profile, String),
}

impl ProfileSource {
    /// The profile, and what it is called.
    ///
    /// # Errors
    /// Where a file is none of a profile, or the numbers are none.
    pub fn read(&self, files: &dyn Files) -> Result<(Profile, String), Error> {
        let list = |d: &[f64; 3]| format!("{}, {}, {}", d[0], d[1], d[2]);
        let (profile, described) = match self {
            ProfileSource::HumanSkin => (Profile::default(), "human skin, six Gaussians".to_owned()),
            ProfileSource::Burley(d) => (Profile::Burley(*d), format!("Burley, d = {} mm", list(d))),
            ProfileSource::MeanFreePath { path, albedo } => (
                Profile::MeanFreePath { path: *path, albedo: *albedo },
                format!("Burley, mean free path {} mm, albedo {}", list(path), list(albedo)),
            ),
            ProfileSource::File(file) => (skin_profile::read(files, file)?, file_name(file)),
            ProfileSource::Given(profile, name) => (profile.clone(), name.clone()),
        };
        match profile.radial() {
            Err(error) => Err(self.refused(error)),
            Ok(_) => Ok((profile, described)),
        }
    }

    /// What is wrong with a profile, of who gave it.
    fn refused(&self, error: ProfileError) -> Error {
        let option = match self {
            ProfileSource::File(file) => {
                return Error::Input { path: file.clone(), fault: InputFault::Profile(error) };
            }
            ProfileSource::Given(..) => return Error::Profile(error),
            ProfileSource::Burley(_) => "burley",
            ProfileSource::MeanFreePath { .. } => "mean-free-path",
            ProfileSource::HumanSkin => "scale",
        };
        Error::Option { option, given: String::new(), file: None, reason: error.to_string() }
    }
}

/// Which tables are made.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TableOptions {
    /// The profile; human skin by default.
    pub profile: ProfileSource,
    /// What the files' names begin with; "skin" by default.
    pub name: String,
    /// Texels of the punctual table, 2 to 4096 along a side; 512 by default.
    pub size: (u32, u32),
    /// Largest curvature, 1/mm, 0.001 to 100, that of the meshes' codes; 0.5 by default.
    pub range: f32,
    /// Multiplies all lengths of the profile, 0.001 to 1000; 1 by default.
    pub scale: f32,
    /// Texels and their encoding; half floats by default.
    pub format: TableFormat,
    /// File format.
    pub container: Container,
    /// Whether light that scatters into penumbras gets a table too.
    pub penumbra: bool,
}

impl Default for TableOptions {
    fn default() -> Self {
        TableOptions {
            profile: ProfileSource::default(),
            name: "skin".into(),
            size: (512, 512),
            range: 0.5,
            scale: 1.0,
            format: TableFormat::default(),
            container: Container::default(),
            penumbra: false,
        }
    }
}

/// Texels along the sides of the table of penumbras, at most; chosen by eye.
const PENUMBRA: u32 = 64;

impl TableOptions {
    /// The name of a table's files without their extension: `skin_punctual`.
    fn stem(&self, content: Content) -> String {
        format!("{}_{}", self.name, content.name().trim_start_matches("skin-"))
    }

    /// The name of the plot.
    pub fn plot(&self) -> String {
        format!("{}.png", self.name)
    }

    /// The name of the report.
    pub fn report(&self) -> String {
        format!("{}.kinran.json", self.name)
    }

    /// Refuses what no table can have.
    ///
    /// # Errors
    /// [`Error::Option`] that names the option and what it may be.
    pub fn check(&self) -> Result<(), Error> {
        let refused = |option, given: String, reason: &str| {
            Err(Error::Option { option, given, file: None, reason: reason.into() })
        };
        if self.name.is_empty() || self.name.contains(['/', '\\']) {
            return refused("name", self.name.clone(), "must be the beginning of a file's name");
        }
        let (width, height) = self.size;
        if !(2..=4096).contains(&width) || !(2..=4096).contains(&height) {
            let reason = "a table has 2 to 4096 texels along a side";
            return refused("size", format!("{width}x{height}"), reason);
        }
        for (option, value, range) in
            [("range", self.range, 0.001..=100.0), ("scale", self.scale, 0.001..=1000.0)]
        {
            if !range.contains(&value) {
                let reason = format!("give {} to {}", range.start(), range.end());
                return refused(option, value.to_string(), &reason);
            }
        }
        Ok(())
    }

    /// The files that [`tables`] will write, without the report, and the bytes that they will take.
    pub fn plan(&self) -> (Vec<String>, Space) {
        let penumbra = self.penumbra.then_some(Content::SkinPenumbra);
        let contents = [Content::SkinPunctual, Content::SkinAmbient].into_iter().chain(penumbra);
        let extensions = self.container.extensions();
        let files = contents
            .flat_map(|content| extensions.iter().map(move |e| format!("{}.{e}", self.stem(content))));
        let texel = if self.format == TableFormat::Rgba16F { 8 } else { 4 };
        let (width, height) = self.size;
        let penumbra =
            if self.penumbra { u64::from(width.min(PENUMBRA)) * u64::from(height.min(PENUMBRA)) } else { 0 };
        let texels = u64::from(width) * u64::from(height) + 2 * u64::from(width) + penumbra;
        (files.collect(), Space::exact(texels * texel * extensions.len() as u64))
    }
}

/// Draws a plot of tables, as the bytes of a PNG.
pub type Plot<'a> = &'a (dyn Fn(&Tables) -> Result<Vec<u8>, Error> + Sync);

/// Tables before their compression.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Tables {
    /// What their files' names begin with.
    pub name: String,
    /// What their profile is called.
    pub profile: String,
    /// What part of a punctual light leaves skin: across, n·u from -1 to 1; down, curvature from 0 to the range.
    pub punctual: Table,
    /// What remains of bands 1 and 2 of ambient light's harmonics: across, mean curvature from 0 to the range.
    pub ambient: Table,
    /// Their largest curvature, 1/mm.
    pub range: f32,
}

/// What was made.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[schemars(rename = "Report")]
pub struct TablesReport {
    /// Kinran's version.
    pub kinran: &'static str,
    /// What the profile is called.
    pub profile: String,
    /// What multiplied all its lengths.
    pub scale: f32,
    /// 1/mm at the lower edge of the punctual table and the right edge of the ambient one.
    pub range: f32,
    /// The tables.
    pub tables: Vec<TableReport>,
    /// Every file that was written beside this report.
    pub written: Vec<WrittenFile>,
    /// What earlier runs wrote beside it, under other flags, and is there as they left it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub kept: Vec<WrittenFile>,
}

/// A table.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TableReport {
    /// Its files.
    pub files: Vec<String>,
    /// Texels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Texels and their encoding.
    pub format: &'static str,
    /// What changes along a row.
    pub across: &'static str,
    /// What changes from row to row.
    pub down: &'static str,
    /// Largest error of a texel after encoding.
    pub encoding_error: f32,
    /// Largest error between texels, before encoding.
    pub interpolation_error: Option<f32>,
}

/// Integrates tables of a profile and writes them: NAME_punctual, NAME_ambient and, where it is asked for, NAME_penumbra; the
/// plot, if there is who draws one, as NAME.png; and NAME.kinran.json, which says how they were made.
///
/// # Errors
/// [`Error::Option`] where an option is out of its range; whatever is wrong with the profile, or the destination has against
/// the files.
pub fn tables(
    files: &dyn Files,
    how: &TableOptions,
    plot: Option<Plot<'_>>,
    out: &dyn Sink,
    task: Task<'_>,
) -> Result<TablesReport, Error> {
    how.check()?;
    let (profile, described) = how.profile.read(files)?;
    let profile = scaled(&profile, f64::from(how.scale));
    let radial = profile.radial().map_err(|error| how.profile.refused(error))?;
    let (mut names, space) = how.plan();
    names.extend(plot.map(|_| how.plot()));
    names.push(how.report());
    if let ProfileSource::File(file) = &how.profile {
        let place = files.place(file);
        let is_it = |name: &&String| place.is_some() && place_in(out, name) == place;
        if let Some(name) = names.iter().find(is_it) {
            let file = out.place(name).filter(|_| out.is_on_disk()).unwrap_or_else(|| name.into());
            return Err(Error::OverMap { file });
        }
    }
    out.expect(&names, space)?;
    let (width, height) = (how.size.0 as usize, how.size.1 as usize);
    let range = f64::from(how.range);
    let points = width * height * (1 + INTERPOLATION_GRID * INTERPOLATION_GRID);
    let integrating = task.begin(Stage::Tables, "", points as u64)?;
    let tick = |points| integrating.tick(points);
    let punctual = punctual_table(radial, width, height, range, &tick)?;
    let ambient = ambient_table(radial, width, range);
    let error = punctual_interpolation_error(radial, &punctual, range, &tick)?;

    let mut report = TablesReport {
        kinran: env!("CARGO_PKG_VERSION"),
        profile: described.clone(),
        scale: how.scale,
        range: how.range,
        tables: Vec::new(),
        written: Vec::new(),
        kept: Vec::new(),
    };
    let mut add = |content, table: &Table, [across, down]: [&'static str; 2], error| -> Result<(), Error> {
        let TablesReport { tables, written, .. } = &mut report;
        tables.push(put_table(content, table, [across, down], error, how, written, out)?);
        Ok(())
    };
    let axes = ["n·u from -1 to 1", "curvature from 0 to range"];
    add(Content::SkinPunctual, &punctual, axes, Some(error))?;
    add(Content::SkinAmbient, &ambient, ["mean curvature from 0 to range", "band 1, band 2"], None)?;
    if how.penumbra {
        let side = PENUMBRA as usize;
        let table = penumbra_table(radial, width.min(side), height.min(side), 1.0);
        let axes = ["filtered shadow from 0 to 1", "one over the penumbra's width from 0 to 1/mm"];
        add(Content::SkinPenumbra, &table, axes, None)?;
    }
    if let Some(plot) = plot {
        let bytes = plot(&Tables {
            name: how.name.clone(),
            profile: described,
            punctual,
            ambient,
            range: how.range,
        })?;
        out.put(&how.plot(), &bytes)?;
        report.written.push(WrittenFile::new(how.plot(), &bytes));
    }
    report.kept = kept_files(out, &how.report(), &report.written);
    let mut text = serde_json::to_string_pretty(&report).map_err(|e| Error::Internal(e.to_string()))?;
    text.push('\n');
    out.put(&how.report(), text.as_bytes())?;
    out.finish()?;
    Ok(report)
}

/// A profile with other lengths. Densities are normalised later: only lengths matter.
fn scaled(profile: &Profile, k: f64) -> Profile {
    match profile {
        Profile::Gaussians(sum) => {
            let scaled = |g: &Gaussian| Gaussian { variance: g.variance * k * k, ..*g };
            Profile::Gaussians(sum.iter().map(scaled).collect())
        }
        Profile::Burley(d) => Profile::Burley(d.map(|d| d * k)),
        Profile::MeanFreePath { path, albedo } => {
            Profile::MeanFreePath { path: path.map(|d| d * k), albedo: *albedo }
        }
        Profile::Table(rows) => Profile::Table(rows.iter().map(|&(r, d)| (r * k, d)).collect()),
    }
}

fn put_table(
    content: Content,
    table: &Table,
    [across, down]: [&'static str; 2],
    interpolation_error: Option<f32>,
    how: &TableOptions,
    written: &mut Vec<WrittenFile>,
    out: &dyn Sink,
) -> Result<TableReport, Error> {
    let label = match how.format {
        TableFormat::Rgba16F => "rgba16f",
        TableFormat::Srgb8 => "srgb8",
        TableFormat::Linear8 => "rgba8",
    };
    let mut texture = table.texture(how.format)?;
    texture.metadata.insert("KinranRange".into(), how.range.to_string());
    let encoding_error = table.texture_error(&texture)?;
    let put = put_texture(how.container, 0, &how.stem(content), content, texture, out)?;
    let files = put.iter().map(|output| output.file.clone()).collect();
    written.extend(put.into_iter().map(WrittenFile::from));
    Ok(TableReport {
        files,
        width: table.width,
        height: table.height,
        format: label,
        across,
        down,
        encoding_error,
        interpolation_error,
    })
}
