//! A folder of authored maps, understood by the names that exporters give them.
//!
//! `docs/folders.md` has the rules and every name. Names are read together: a word that every file of a set has behind its
//! role, such as Poliigon's `METALNESS`, is no role; words behind a role that two files of different roles share name a
//! variant of the material; the number of a UDIM tile (`Head_Normal.1001`) makes a material of each tile. Two files for
//! one map are compared when they are read, and normal maps with green up and down told apart by their slopes ([`Twin`]).
//!
//! Nothing is guessed in silence. What can be read in two ways is a [`FolderError`] that names the files and
//! the flag that settles it; what is assumed stands in the table ([`Folder::table`]), and every file has a row there.

mod evidence;
mod load;
mod names;
mod sets;
mod twins;

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::f32::consts::TAU;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use kinran_image::{Disk, Entry, Files, IMAGE_EXTENSIONS, Transfer, has_image_extension};
use kinran_scene::Wrap;
use schemars::JsonSchema;
use serde::Serialize;

use crate::aniso::NormalZ;

pub use evidence::{
    GREEN_CONFIDENCE, GreenGuess, below_surface, colored, green_correlation, guess_green, not_normals,
    odd_lengths, outside_unit,
};
pub use load::{LoadedMap, LoadedMaterial};
pub use names::{Green, Role};
pub use twins::Twin;

/// Extensions of other pictures.
const PICTURES: [&str; 23] = [
    "avif", "basis", "dpx", "gif", "heic", "heif", "iff", "j2k", "jp2", "jxl", "kra", "ktx", "ora", "pbm",
    "pgm", "pic", "ppm", "psb", "psd", "sgi", "svg", "tx", "xcf",
];

/// A folder of maps in an archive beside other files.
const INNER: [&str; 3] = ["textures", "texture", "maps"];

/// Roughness of a surface for which nothing gives any: the middle of the range, chosen by eye.
pub const ASSUMED_ROUGHNESS: f32 = 0.5;

/// What a person said by flags.
#[derive(Clone, Debug)]
pub struct Hints {
    /// `--y-up`, `--y-down`: overrides names and texels.
    pub green: Option<Green>,
    /// `--direction-span`: radians that 1 stands for in a grey direction map (on the command line degrees,
    /// 360 or 180).
    pub direction_span: Option<f32>,
    /// `--map ROLE=FILE`: a file by its name in the folder, or by a path; it wins over others of its role.
    pub maps: Vec<(Role, PathBuf)>,
    /// `--ignore FILE`: leave a file out, by its name in the folder.
    pub ignore: Vec<PathBuf>,
    /// `--roughness-is-gloss`: what is named roughness holds gloss.
    pub roughness_is_gloss: bool,
    /// `--roughness`: perceptual roughness where no map gives any, 0 to 1.
    pub roughness: Option<f32>,
    /// `--anisotropy`: strength as in `KHR_materials_anisotropy` where no map gives any, 0 to 1.
    pub anisotropy: Option<f32>,
    /// `--force-normal`: believe that a normal map is one, whatever its texels look like.
    pub force_normal: bool,
    /// `--normal-blue`: z of normals is blue, not rebuilt.
    pub normal_blue: bool,
    /// `--color-space`: how colour maps are encoded, whatever their files say.
    pub color_space: Option<Transfer>,
    /// `--exr-layer FILE=LAYER`: the layer of an EXR file that holds the map; the file by its name in the folder, or by a
    /// path.
    pub layers: Vec<(PathBuf, String)>,
    /// What lies beyond the maps' borders.
    pub wrap: [Wrap; 2],
}

impl Default for Hints {
    fn default() -> Self {
        Hints {
            green: None,
            direction_span: None,
            maps: Vec::new(),
            ignore: Vec::new(),
            roughness_is_gloss: false,
            roughness: None,
            anisotropy: None,
            force_normal: false,
            normal_blue: false,
            color_space: None,
            layers: Vec::new(),
            wrap: [Wrap::Repeat; 2],
        }
    }
}

/// Why a folder could not be understood.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// A file or the folder could not be read.
    #[error(transparent)]
    Image(#[from] kinran_image::Error),
    /// A file where a folder should be.
    #[error("{}: this is not a folder; name the folder that holds the maps", .0.display())]
    NotAFolder(PathBuf),
    /// The folder has no map that the baker uses.
    #[error(
        "{}: no maps found; looked for {} files called …_normal, …_roughness, …_gloss, …_color, …_ARM and \
         the like, saw {}; rename them, or name each with --map ROLE=FILE",
        folder.display(), IMAGE_EXTENSIONS.join("/"), listed(seen)
    )]
    NoMaps {
        /// The folder.
        folder: PathBuf,
        /// Names of the files that are there.
        seen: Vec<String>,
    },
    /// Maps that can be read in more than one way.
    #[error("material \"{material}\": {question}: {}; {fix}", listed(files))]
    Ambiguous {
        /// The material.
        material: String,
        /// What cannot be told.
        question: String,
        /// Names of the files in question.
        files: Vec<String>,
        /// The flags that settle it.
        fix: String,
    },
    /// A file does not hold what its name says.
    #[error("{}: {reason}; {fix}", path.display())]
    Unfit {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
        /// What can be done.
        fix: String,
    },
    /// A flag that cannot be.
    #[error("{flag}: {reason}")]
    Flag {
        /// The flag and its value.
        flag: String,
        /// What is wrong, and what would be right.
        reason: String,
    },
}

impl FolderError {
    /// What kind of error it is, in the words of [`kinran_image::Error::code`]; `input` for what is no folder, `option`, and
    /// `maps` for maps that cannot be understood.
    pub fn code(&self) -> &'static str {
        match self {
            FolderError::Image(error) => error.code(),
            FolderError::NotAFolder(_) => "input",
            FolderError::Flag { .. } => "option",
            FolderError::NoMaps { .. } | FolderError::Ambiguous { .. } | FolderError::Unfit { .. } => "maps",
        }
    }

    /// The file or folder that it is about.
    pub fn file(&self) -> Option<&Path> {
        match self {
            FolderError::Image(error) => error.file(),
            FolderError::NotAFolder(path)
            | FolderError::NoMaps { folder: path, .. }
            | FolderError::Unfit { path, .. } => Some(path),
            FolderError::Ambiguous { .. } | FolderError::Flag { .. } => None,
        }
    }
}

/// Names for an error message: the first twelve, and how many more there are.
fn listed(names: &[String]) -> String {
    if names.is_empty() {
        return "no files".into();
    }
    let shown = names[..names.len().min(12)].join(", ");
    if names.len() > 12 { format!("{shown} and {} more", names.len() - 12) } else { shown }
}

/// A row of the table: a file and what was understood of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Row {
    /// The material; empty where the file belongs to none.
    pub material: String,
    /// The file's name; "-" for a constant.
    pub file: String,
    /// What it holds, where that was understood.
    pub role: Option<Role>,
    /// Which channels hold what; "-" where the file is not used.
    pub channels: String,
    /// What was assumed, chosen or left out, and why.
    pub note: String,
}

impl Row {
    /// Whether the file is a picture, or the row is about what no file gives.
    pub fn is_picture(&self) -> bool {
        self.note != NO_PICTURE && self.note != NOT_LOOKED_INTO
    }
}

/// The note of colour maps that are not opaque.
pub const CUT_OUT: &str = "with alpha";

/// The note of files that are none.
const NO_PICTURE: &str = "no picture, not used";

/// The note of folders beside maps.
const NOT_LOOKED_INTO: &str = "a folder, not looked into; bake it by itself, or all of them by `kinran init`";

/// A folder understood. Serializes as its rows, without paths.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Folder {
    /// Every file, material by material, and what is assumed where there is none.
    pub rows: Vec<Row>,
    /// The materials, by name.
    #[serde(skip)]
    pub materials: Vec<MaterialMaps>,
}

/// One channel of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MapChannel {
    /// The file.
    pub file: PathBuf,
    /// 0 to 3.
    pub channel: usize,
}

/// How it is known which way green points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GreenSource {
    /// The file's name says it.
    Name,
    /// A flag says it.
    Flag,
    /// The slopes of a pair of maps, of which one has it the other way round, say it.
    Texels,
    /// Nothing does; +Y as in glTF.
    Assumed,
}

/// A normal map.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NormalSource {
    /// The file.
    pub file: PathBuf,
    /// Which way green points.
    pub green: Green,
    /// How that is known.
    pub green_source: GreenSource,
    /// Do not ask the texels whether this is a normal map.
    pub force: bool,
    /// Where z comes from.
    pub z: NormalZ,
}

/// Roughness without a direction.
#[derive(Clone, Debug, PartialEq)]
pub enum BaseRoughness {
    /// The same everywhere.
    Constant(f32),
    /// A map of perceptual roughness.
    Roughness(MapChannel),
    /// A map of gloss.
    Gloss(MapChannel),
}

/// A direction map.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectionSource {
    /// The file.
    pub file: PathBuf,
    /// Radians that 1 stands for, where the map is an angle.
    pub span: Option<f32>,
    /// The name promises an angle; a coloured image is refused.
    pub angle: bool,
}

/// How much a surface is stretched.
#[derive(Clone, Debug, PartialEq)]
pub enum LevelSource {
    /// Strength as in `KHR_materials_anisotropy`, the same everywhere.
    Strength(f32),
    /// A map with the level of the Adobe Standard Material.
    Adobe(PathBuf),
}

/// Where the roughness comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum RoughnessSource {
    /// The same in all directions.
    Isotropic(BaseRoughness),
    /// Gloss along and across a direction.
    GlossUv {
        /// Along.
        u: PathBuf,
        /// Across.
        v: PathBuf,
        /// Along the tangent when absent.
        direction: Option<DirectionSource>,
    },
    /// Roughness, how much it is stretched, and in which direction.
    Level {
        /// Across the direction.
        base: BaseRoughness,
        /// How much.
        level: LevelSource,
        /// Along the tangent when absent.
        direction: Option<DirectionSource>,
    },
    /// Roughness and a texture of `KHR_materials_anisotropy`.
    Khr {
        /// Across the direction.
        base: BaseRoughness,
        /// Red and green direction, blue strength.
        texture: PathBuf,
    },
    /// An aniso map.
    Encoded(PathBuf),
}

/// The maps of one material.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialMaps {
    /// What its files have in common, or the folder's name.
    pub name: String,
    /// Normals.
    pub normal: Option<NormalSource>,
    /// Roughness; absent where neither it nor normals have a map.
    pub roughness: Option<RoughnessSource>,
    /// Base colour.
    pub color: Option<PathBuf>,
    /// How it is encoded, where a flag says it; else its file does ([`Image::transfer`](kinran_image::Image::transfer)).
    pub color_space: Option<Transfer>,
    /// Of EXR files, the layers that flags name.
    pub layers: Vec<(PathBuf, String)>,
    /// Ambient occlusion.
    pub occlusion: Option<MapChannel>,
    /// Metalness.
    pub metallic: Option<MapChannel>,
    /// The files that are used and their roles, by role.
    pub files: Vec<(Role, PathBuf)>,
    /// What lies beyond the borders.
    pub wrap: [Wrap; 2],
    /// Files that should say what one of `files` says, which is used if they do.
    pub twins: Vec<Twin>,
    /// What was assumed that matters and that a flag settles, a sentence each.
    pub warnings: Vec<String>,
}

impl Folder {
    /// The rows as aligned plain text with a heading, for people; ends with a newline.
    pub fn table(&self) -> String {
        let heading = ["material", "file", "role", "channels", "notes"].map(String::from);
        let rows = self.rows.iter().map(|row| {
            let role = row.role.map_or("-", Role::name).to_owned();
            // A file name may hold anything, also what moves a terminal's cursor.
            [row.material.clone(), row.file.clone(), role, row.channels.clone(), row.note.clone()]
                .map(|cell| cell.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect())
        });
        let rows: Vec<[String; 5]> = std::iter::once(heading).chain(rows).collect();
        let width = |column: usize| rows.iter().map(|r| r[column].chars().count()).max().unwrap_or(0);
        let widths = [width(0), width(1), width(2), width(3)];

        let mut text = String::new();
        for row in &rows {
            let mut line = String::new();
            for (cell, width) in row.iter().zip(widths) {
                line.push_str(&format!("{cell:width$}  "));
            }
            line.push_str(&row[4]);
            text.push_str(line.trim_end());
            text.push('\n');
        }
        text
    }
}

/// A file on its way to being understood.
#[derive(Clone)]
struct Found {
    path: PathBuf,
    /// Its name in the folder.
    file: String,
    name: names::Name,
    /// What its name may mean too.
    readings: Vec<names::Name>,
    role: Option<Role>,
    /// A picture in a format that is not read.
    unread: bool,
    /// A flag gave the role.
    forced: bool,
    /// Why the file is not used, if it is not.
    dropped: Option<String>,
    /// The materials that it is a map of, where there are several.
    shared_by: Vec<String>,
    note: String,
}

impl Found {
    fn is(&self, role: Role) -> bool {
        self.role == Some(role) && self.dropped.is_none()
    }
}

/// Finds the materials in a folder by the names of its image files, or where it has none in a folder called textures in it.
/// Does not look into other folders, nor at hidden files; no image is read yet, but for the headers of several that are one
/// map.
///
/// # Errors
/// [`FolderError`]: the folder cannot be read or has no maps, a flag makes no sense, or maps can be read in
/// more than one way.
pub fn scan(folder: &Path, hints: &Hints) -> Result<Folder, FolderError> {
    scan_in(&Disk, folder, hints)
}

/// As [`scan`], of a folder that may be elsewhere than on a disk.
///
/// # Errors
/// As [`scan`].
pub fn scan_in(files: &dyn Files, folder: &Path, hints: &Hints) -> Result<Folder, FolderError> {
    check_flags(hints)?;
    let Listing { mut found, others, folders } = list(files, folder)?;
    apply_flags(files, folder, hints, &mut found)?;
    judge_letters(&mut found);
    sets::share(&mut found);

    let (known, strangers): (Vec<Found>, Vec<Found>) = found.into_iter().partition(|f| f.role.is_some());
    let mut groups: BTreeMap<String, Vec<Found>> = BTreeMap::new();
    for file in known {
        let own = [file.name.stem.clone()];
        for stem in if file.shared_by.is_empty() { &own[..] } else { &file.shared_by[..] } {
            let mut of_one = file.clone();
            of_one.name.stem.clone_from(stem);
            groups.entry(stem.to_lowercase()).or_default().push(of_one);
        }
    }

    let mut result = Folder { rows: Vec::new(), materials: Vec::new() };
    for mut group in groups.into_values() {
        let name = match group[0].name.stem.as_str() {
            "" => folder_name(files, folder),
            stem => stem.to_owned(),
        };
        let mut material = understand(files, &name, &mut group, hints)?;
        let constants = material.as_ref().map(|material| constant_rows(material, hints)).unwrap_or_default();
        if let Some(material) = material.as_mut() {
            material.warnings = assumptions(material, &group, hints, &strangers);
        }
        result.rows.extend(group.into_iter().map(|file| row_of(&name, file)));
        result.rows.extend(constants);
        result.materials.extend(material);
    }
    let unknown: Vec<String> = (strangers.iter())
        .filter(|file| file.dropped.is_none() && !sets::is_picture_of(&file.path))
        .map(|file| file.file.clone())
        .collect();
    result.rows.extend(strangers.into_iter().map(|file| row_of("", file)));
    let unused = |file, note: &str| Row {
        material: String::new(),
        file,
        role: None,
        channels: "-".into(),
        note: note.into(),
    };
    result.rows.extend(others.into_iter().map(|file| unused(file, NO_PICTURE)));

    if result.materials.is_empty() {
        let mut seen: Vec<String> = result.rows.into_iter().map(|row| row.file).chain(folders).collect();
        seen.sort();
        return Err(FolderError::NoMaps { folder: folder.into(), seen });
    }
    result.rows.extend(folders.iter().map(|folder| unused(format!("{folder}/"), NOT_LOOKED_INTO)));
    warn_of_tiles(&mut result.materials);
    warn_of_strangers(&mut result.materials, &unknown);
    name_layers(folder, hints, &mut result.materials)?;
    Ok(result)
}

/// Warns of materials that are another one's tiles by their names: files with the number of a tile beside files without.
fn warn_of_tiles(materials: &mut [MaterialMaps]) {
    let files = |material: &MaterialMaps| material.files.iter().map(|(_, file)| file_name(file)).collect();
    let tiles: Vec<(String, String, Vec<String>)> = (materials.iter())
        .filter_map(|material| {
            let (stem, tile) = sets::without_tile(&material.name)?;
            Some((stem.to_lowercase(), tile.to_owned(), files(material)))
        })
        .collect();
    for material in materials {
        let name = material.name.to_lowercase();
        let Some((_, tile, of_tile)) = tiles.iter().find(|(stem, ..)| *stem == name) else { continue };
        let warning = format!(
            "{}: {} without the number of a tile, beside {} of tile {tile} (UDIM); each tile is a material of its own, \
             and so is what has none; give every file of it a number, or none",
            material.name,
            listed(&files(material)),
            listed(of_tile)
        );
        material.warnings.push(warning);
    }
}

/// Warns of pictures that are called after a material and are none of its maps by their names, such as a map of a role that
/// is spelled in another way.
fn warn_of_strangers(materials: &mut [MaterialMaps], unknown: &[String]) {
    for file in unknown {
        let lower = file_name(Path::new(file)).to_lowercase();
        let is_called_after = |material: &&mut MaterialMaps| {
            let rest = lower.strip_prefix(&material.name.to_lowercase());
            rest.is_some_and(|rest| rest.starts_with(['_', '-', ' ']))
        };
        let longest = materials.iter_mut().filter(is_called_after).max_by_key(|material| material.name.len());
        let Some(material) = longest.filter(|m| !m.warnings.iter().any(|told| told.contains(file.as_str())))
        else {
            continue;
        };
        material.warnings.push(format!(
            "{}: {file} is called after it and is none of its maps by its name; say --map ROLE={file} if it is one, or \
             --ignore {file}",
            material.name
        ));
    }
}

/// What is assumed of a material that matters and that a flag settles, a sentence each.
fn assumptions(material: &MaterialMaps, files: &[Found], hints: &Hints, strangers: &[Found]) -> Vec<String> {
    let name = &material.name;
    let asked = strangers.iter().filter(|file| file.dropped.is_none());
    let seen: Vec<String> = asked.map(|file| file.file.clone()).collect();
    let seen = if seen.is_empty() { String::new() } else { format!("; not recognised: {}", listed(&seen)) };
    let mut warnings = Vec::new();
    if is_flat(material) {
        warnings.push(format!(
            "{name}: no normal map, the surface is taken to be flat; name the map with --map normal=FILE if there is \
             one{seen}"
        ));
    }
    if lacks_roughness(material) && hints.roughness.is_none() {
        warnings.push(format!(
            "{name}: no roughness map, {ASSUMED_ROUGHNESS} is assumed; say --roughness VALUE, or name the map with \
             --map roughness=FILE{seen}"
        ));
    }
    let unclear = files.iter().find(|file| file.is(Role::OcclusionRoughness) && file.name.unclear);
    warnings.extend(unclear.map(|file| {
        format!(
            "{0}: taken to hold occlusion in red and roughness in green, as glTF packs them; say --map roughness={0} if \
             roughness is in red",
            file.file
        )
    }));
    warnings
}

/// Whether a material has a surface, and no normal map on it.
fn is_flat(material: &MaterialMaps) -> bool {
    material.roughness.is_some() && material.normal.is_none()
}

/// Tells the materials which layers `--exr-layer` names.
fn name_layers(folder: &Path, hints: &Hints, materials: &mut [MaterialMaps]) -> Result<(), FolderError> {
    for (path, layer) in &hints.layers {
        let mut used = false;
        for material in &mut *materials {
            let mut files = material.files.iter().map(|(_, file)| file);
            if let Some(file) = files.find(|file| *file == path || **file == folder.join(path)).cloned() {
                material.layers.push((file, layer.clone()));
                used = true;
            }
        }
        if !used {
            let flag = format!("--exr-layer {}={layer}", path.display());
            return Err(FolderError::Flag { flag, reason: "no map that is used is in such a file".into() });
        }
    }
    Ok(())
}

fn check_flags(hints: &Hints) -> Result<(), FolderError> {
    for (flag, value) in [("--roughness", hints.roughness), ("--anisotropy", hints.anisotropy)] {
        if let Some(value) = value.filter(|v| !(0.0..=1.0).contains(v)) {
            return Err(FolderError::Flag { flag: format!("{flag} {value}"), reason: "give 0 to 1".into() });
        }
    }
    if let Some(span) = hints.direction_span.filter(|s| !(*s > 0.0 && *s <= TAU + 1e-3)) {
        let flag = format!("--direction-span {}", span.to_degrees());
        return Err(FolderError::Flag { flag, reason: "give degrees above 0, at most 360".into() });
    }
    Ok(())
}

/// What a person sees in a folder.
struct Listing {
    /// Pictures, by name.
    found: Vec<Found>,
    /// Names of other files.
    others: Vec<String>,
    /// Names of folders.
    folders: Vec<String>,
}

impl Listing {
    fn has_maps(&self) -> bool {
        self.found.iter().any(|file| file.role.is_some() && !file.unread)
    }
}

/// What is in a folder, and in the [`inner_folder`] where there is one.
fn list(files: &dyn Files, folder: &Path) -> Result<Listing, FolderError> {
    let mut listing = list_one(files, folder, "")?;
    if let Some(inner) = inner_folder_of(files, folder, &listing) {
        let more = list_one(files, &inner, &format!("{}/", file_name(&inner)))?;
        listing.found.extend(more.found);
        listing.others.extend(more.others);
        let name = file_name(&inner);
        listing.folders.retain(|folder| *folder != name);
        listing.folders.extend(more.folders.into_iter().map(|folder| format!("{name}/{folder}")));
    }
    Ok(listing)
}

/// The folder in a folder that has its maps, as archives do: the only one called textures or maps, where the folder itself
/// has neither maps nor a glTF file.
pub fn inner_folder(folder: &Path) -> Option<PathBuf> {
    inner_folder_of(&Disk, folder, &list_one(&Disk, folder, "").ok()?)
}

fn inner_folder_of(files: &dyn Files, folder: &Path, listing: &Listing) -> Option<PathBuf> {
    let is_model = |file: &String| kinran_scene::is_gltf(Path::new(file));
    if listing.has_maps() || listing.others.iter().any(is_model) {
        return None;
    }
    let is_inner = |name: &&String| INNER.iter().any(|inner| name.eq_ignore_ascii_case(inner));
    let mut inner = listing.folders.iter().filter(is_inner);
    let (Some(name), None) = (inner.next(), inner.next()) else { return None };
    let inner = folder.join(name);
    list_one(files, &inner, "").is_ok_and(|listing| listing.has_maps()).then_some(inner)
}

/// What is in one folder; files are called by their names behind `prefix`.
fn list_one(files: &dyn Files, folder: &Path, prefix: &str) -> Result<Listing, FolderError> {
    let io = |e| FolderError::Image(kinran_image::Error::io(folder, e));
    let entries = match files.list(folder) {
        Err(e) if e.kind() == ErrorKind::NotADirectory => {
            return Err(FolderError::NotAFolder(folder.into()));
        }
        other => other.map_err(io)?,
    };
    let mut listing = Listing { found: Vec::new(), others: Vec::new(), folders: Vec::new() };
    for Entry { path, is_folder } in entries {
        let file = file_name(&path);
        if file.starts_with('.') {
            continue;
        }
        if is_folder {
            listing.folders.push(file);
        } else if has_image_extension(&path) || is_one_of(&path, &PICTURES) {
            listing.found.push(Found { file: format!("{prefix}{file}"), ..found_file(path) });
        } else {
            listing.others.push(format!("{prefix}{file}"));
        }
    }
    listing.found.sort_by(|a, b| a.path.cmp(&b.path));
    listing.others.sort();
    listing.folders.sort();
    leave_out_baked(&mut listing);
    sets::settle(&mut listing.found);
    Ok(listing)
}

/// Leaves out what was baked into the folder itself: textures beside the report of their material.
fn leave_out_baked(listing: &mut Listing) {
    let reports: Vec<String> = listing
        .others
        .iter()
        .filter_map(|file| Some(file.strip_suffix(".kinran.json")?.to_lowercase()))
        .collect();
    for file in listing.found.iter_mut().filter(|file| is_one_of(&file.path, &["ktx2", "dds"])) {
        let name = file.file.to_lowercase();
        let of =
            |report: &String| name.strip_prefix(report.as_str()).is_some_and(|rest| rest.starts_with('_'));
        if reports.iter().any(of) {
            let nothing = names::Name { role: None, ..file.name.clone() };
            (file.role, file.readings, file.name) = (None, vec![nothing.clone()], nothing);
            file.dropped = Some("baked by kinran".into());
        }
    }
}

/// The image files of a folder that a name tells the role of, by name, with the way green points where the name says
/// that too. No question is asked and no file opened; see [`scan`] for materials.
///
/// # Errors
/// [`FolderError::NotAFolder`], or the folder cannot be read.
pub fn named_maps(folder: &Path) -> Result<Vec<(PathBuf, Role, Option<Green>)>, FolderError> {
    named_maps_in(&Disk, folder)
}

/// As [`named_maps`], of a folder that may be elsewhere than on a disk.
///
/// # Errors
/// As [`named_maps`].
pub fn named_maps_in(
    files: &dyn Files,
    folder: &Path,
) -> Result<Vec<(PathBuf, Role, Option<Green>)>, FolderError> {
    let found = list(files, folder)?.found.into_iter().filter(|file| !file.unread);
    Ok(found.filter_map(|file| Some((file.path, file.role?, file.name.green))).collect())
}

/// What a file's name alone tells it to hold, and which way green points where it says that too.
pub fn named_role(path: &Path) -> Option<(Role, Option<Green>)> {
    let found = found_file(path.to_path_buf());
    Some((found.role?, found.name.green))
}

fn is_one_of(path: &Path, extensions: &[&str]) -> bool {
    path.extension().is_some_and(|e| extensions.iter().any(|known| e.eq_ignore_ascii_case(known)))
}

fn found_file(path: PathBuf) -> Found {
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let readings = names::readings(&stem);
    let name = readings[0].clone();
    Found {
        file: file_name(&path),
        role: name.role,
        name,
        readings,
        unread: !has_image_extension(&path),
        path,
        forced: false,
        dropped: None,
        shared_by: Vec::new(),
        note: String::new(),
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

fn folder_name(files: &dyn Files, folder: &Path) -> String {
    let absolute = || files.canonical(folder).ok();
    let name = match folder.file_name() {
        Some(name) => Some(name.to_os_string()),
        None => absolute().and_then(|path| path.file_name().map(|n| n.to_os_string())),
    };
    name.map_or_else(|| "material".into(), |n| n.to_string_lossy().into_owned())
}

/// Gives files the roles that `--map` says, and takes out those that `--ignore` names.
fn apply_flags(
    files: &dyn Files,
    folder: &Path,
    hints: &Hints,
    found: &mut Vec<Found>,
) -> Result<(), FolderError> {
    let position = |found: &[Found], path: &Path| {
        let named = found.iter().position(|f| f.path == path || f.path == folder.join(path));
        // Wherever it lies below the folder, where its name is the only one.
        let mut by_name = (0..found.len()).filter(|&i| found[i].path.file_name() == Some(path.as_os_str()));
        named.or_else(|| by_name.next().filter(|_| by_name.next().is_none()))
    };
    for path in &hints.ignore {
        let Some(at) = position(found, path) else {
            let flag = format!("--ignore {}", path.display());
            return Err(FolderError::Flag { flag, reason: "the folder has no such image file".into() });
        };
        found[at].role = None;
        found[at].dropped = Some("left out by --ignore".into());
    }
    for (role, path) in &hints.maps {
        let flag = || format!("--map {role}={}", path.display());
        let at = match position(found, path) {
            Some(at) => at,
            None if files.is_file(path) => {
                found.push(found_file(path.clone()));
                found.len() - 1
            }
            None => {
                let reason = "no such file, neither in the folder nor from here".into();
                return Err(FolderError::Flag { flag: flag(), reason });
            }
        };
        if found[at].forced {
            let reason = "another --map names this file already".into();
            return Err(FolderError::Flag { flag: flag(), reason });
        }

        // The material is the file's own or that of all its variants, or the one whose name the file's name begins with, or
        // the only one.
        let mut stems: Vec<String> = Vec::new();
        for other in found.iter().enumerate().filter(|(i, f)| *i != at && f.role.is_some()) {
            let stem = &other.1.name.stem;
            if !stems.iter().any(|s| s.eq_ignore_ascii_case(stem)) {
                stems.push(stem.clone());
            }
        }
        let own = found[at].name.stem.to_lowercase();
        let known = stems.iter().any(|s| s.to_lowercase() == own);
        if !known && !sets::has_variants(found, &own) {
            let prefix = stems.iter().filter(|s| !s.is_empty() && own.starts_with(&s.to_lowercase()));
            let stem = match (prefix.max_by_key(|s| s.len()), stems.as_slice()) {
                (Some(stem), _) | (None, [stem]) => stem.clone(),
                (None, []) => String::new(),
                (None, _) => {
                    let reason = format!(
                        "it cannot be told which of the materials {} it belongs to; begin its name with the \
                         material's",
                        listed(&stems)
                    );
                    return Err(FolderError::Flag { flag: flag(), reason });
                }
            };
            found[at].name.stem = stem;
        }
        let green = found[at].name.green.filter(|_| found[at].role == Some(*role));
        let file = &mut found[at];
        file.name = names::Name { green, letter: false, unclear: false, ..file.name.clone() };
        file.role = Some(*role);
        file.forced = true;
        file.dropped = None;
        file.note = "by --map".into();
    }
    Ok(())
}

/// Takes the role from files of one or two letters that have neither Unreal's prefix nor company: another
/// map of the same material with a whole word, or several letters with a normal map among them.
fn judge_letters(found: &mut [Found]) {
    let lonely: Vec<usize> = (0..found.len())
        .filter(|&i| {
            let file = &found[i];
            if file.role.is_none() || !file.name.letter || file.name.unreal {
                return false;
            }
            let stem = file.name.stem.to_lowercase();
            let siblings: Vec<&Found> =
                found.iter().filter(|f| f.role.is_some() && f.name.stem.to_lowercase() == stem).collect();
            let word = siblings.iter().any(|f| !f.name.letter);
            let normal = siblings.len() > 1 && siblings.iter().any(|f| f.role == Some(Role::Normal));
            !word && !normal
        })
        .collect();
    for i in lonely {
        found[i].role = None;
        found[i].note = "a letter alone is too little; --map ROLE=FILE says what it is".into();
    }
}

fn row_of(material: &str, file: Found) -> Row {
    let used = file.dropped.is_none() && file.role.is_some_and(Role::is_used);
    let channels = if used { file.role.map_or("-", Role::channels) } else { "-" };
    let note = match (&file.dropped, file.role) {
        (Some(why), _) => format!("not used: {why}"),
        (None, None) if file.note.is_empty() => "not recognised, not used".into(),
        (None, None) => format!("not used: {}", file.note),
        (None, Some(role)) if !role.is_used() => "not used".into(),
        (None, Some(_)) => file.note,
    };
    Row { material: material.into(), file: file.file, role: file.role, channels: channels.into(), note }
}

/// Whether a material has a roughness that no file gives.
fn lacks_roughness(material: &MaterialMaps) -> bool {
    match &material.roughness {
        // Its occlusion and metalness are packed with one.
        None => material.occlusion.is_some() || material.metallic.is_some(),
        Some(
            RoughnessSource::Isotropic(base)
            | RoughnessSource::Level { base, .. }
            | RoughnessSource::Khr { base, .. },
        ) => matches!(base, BaseRoughness::Constant(_)),
        Some(RoughnessSource::GlossUv { .. } | RoughnessSource::Encoded(_)) => false,
    }
}

/// Rows of what no file gives.
fn constant_rows(material: &MaterialMaps, hints: &Hints) -> Vec<Row> {
    let row = |role: Role, note: String| Row {
        material: material.name.clone(),
        file: "-".into(),
        role: Some(role),
        channels: "-".into(),
        note,
    };
    let mut rows = Vec::new();
    if is_flat(material) {
        let note = "warning: no map, the surface is flat; --map normal=FILE names one";
        rows.push(row(Role::Normal, note.into()));
    }
    if lacks_roughness(material) {
        rows.push(row(
            Role::Roughness,
            match hints.roughness {
                Some(value) => format!("no map: {value} everywhere, by --roughness"),
                None => format!(
                    "warning: no map, {ASSUMED_ROUGHNESS} is assumed everywhere; --roughness VALUE sets it"
                ),
            },
        ));
    }
    let along_tangent = matches!(
        &material.roughness,
        Some(
            RoughnessSource::GlossUv { direction: None, .. } | RoughnessSource::Level { direction: None, .. }
        )
    );
    if along_tangent {
        rows.push(row(Role::Direction, "no map: along the tangent".into()));
    }
    if material.occlusion.is_some() && material.metallic.is_none() {
        rows.push(row(Role::Metallic, "no map: 0 everywhere, no metal".into()));
    }
    if material.metallic.is_some() && material.occlusion.is_none() {
        rows.push(row(Role::Occlusion, "no map: 1 everywhere".into()));
    }
    rows
}

/// Makes a material of the files of one stem; none if nothing of them is used.
fn understand(
    place: &dyn Files,
    material: &str,
    files: &mut [Found],
    hints: &Hints,
) -> Result<Option<MaterialMaps>, FolderError> {
    use Role::*;

    // Which of the ways to say the same is meant.
    settle_unread(material, files)?;
    // A map called after anisotropy beside one of the direction is the level: it need not tell the direction again.
    let has = |files: &[Found], roles: &[Role]| files.iter().any(|f| roles.iter().any(|&role| f.is(role)));
    if has(files, &[Direction, DirectionAngle]) && !has(files, &[AnisotropyLevel]) {
        let named = files.iter_mut().filter(|f| f.is(Anisotropy) && !f.forced);
        named.for_each(|f| f.role = Some(AnisotropyLevel));
    }
    let mut twins = Vec::new();
    let groups: [(&str, &[&[Role]]); 4] = [
        (
            "several maps say how the highlight is stretched",
            &[&[Aniso], &[GlossU, GlossV], &[Anisotropy], &[AnisotropyLevel]],
        ),
        ("roughness is given twice", &[&[Aniso, GlossU, GlossV], &[Roughness, Gloss]]),
        ("there are two direction maps", &[&[Direction], &[DirectionAngle]]),
        ("the direction is given twice", &[&[Aniso, Anisotropy], &[Direction, DirectionAngle]]),
    ];
    for (question, alternatives) in groups {
        settle(material, files, question, alternatives)?;
    }
    for role in [
        Normal,
        Roughness,
        Gloss,
        GlossU,
        GlossV,
        Direction,
        DirectionAngle,
        AnisotropyLevel,
        Anisotropy,
        Aniso,
        Color,
        Occlusion,
        Metallic,
    ] {
        let question = format!("there are several {role} maps");
        twins.extend(settle_twins(place, material, files, |r| r == role, &question, hints)?);
    }
    let question = "there are several packed maps";
    twins.extend(settle_twins(place, material, files, Role::is_packed, question, hints)?);
    twins.extend(settle_gloss(material, files, hints)?);

    let at = |files: &[Found], role: Role| files.iter().position(|f| f.is(role));
    let path = |files: &[Found], role: Role| at(files, role).map(|i| files[i].path.clone());
    let packed = files.iter().position(|f| f.dropped.is_none() && f.role.is_some_and(Role::is_packed));
    let whole_roughness = at(files, Aniso).is_some() || at(files, GlossU).or(at(files, GlossV)).is_some();

    // Scalars: a file of its own goes before a packed channel.
    let mut unpacked: Vec<Role> = Vec::new();
    let mut scalar = |files: &[Found], role: Role| -> Option<MapChannel> {
        let in_pack = packed.and_then(|i| {
            let channel = files[i].role?.packed_channel(role)?;
            Some(MapChannel { file: files[i].path.clone(), channel })
        });
        match path(files, role) {
            Some(file) => {
                if in_pack.is_some() {
                    unpacked.push(role);
                }
                Some(MapChannel { file, channel: 0 })
            }
            None => in_pack,
        }
    };
    let occlusion = scalar(files, Occlusion);
    let metallic = scalar(files, Metallic);
    let mut roughness = scalar(files, Roughness);
    let mut gloss = scalar(files, Gloss);
    if roughness.is_some() && gloss.is_some() {
        // One of them is packed: two files were settled above.
        if at(files, Roughness).is_some() {
            gloss = None;
            unpacked.push(Gloss);
        } else {
            roughness = None;
            unpacked.push(Roughness);
        }
    }
    if whole_roughness {
        unpacked.extend(roughness.take().map(|_| Roughness));
        unpacked.extend(gloss.take().map(|_| Gloss));
    }
    if let (Some(i), false) = (packed, unpacked.is_empty()) {
        let names: Vec<&str> = unpacked.iter().map(|r| r.name()).collect();
        add_note(&mut files[i].note, &format!("its {} not used, another map has it", names.join(" and ")));
    }

    // Normals.
    let normal = at(files, Normal).map(|i| {
        let (green, green_source) = match (hints.green, files[i].name.green) {
            (Some(green), _) => (green, GreenSource::Flag),
            (None, Some(green)) => (green, GreenSource::Name),
            (None, None) => (Green::Up, GreenSource::Assumed),
        };
        let sign = if green == Green::Up { "+Y" } else { "-Y" };
        let how = match green_source {
            GreenSource::Flag if files[i].name.green.is_some_and(|named| named != green) => {
                format!("{sign} by flag, though its name says otherwise")
            }
            GreenSource::Flag => format!("{sign} by flag"),
            GreenSource::Name => format!("{sign} by name"),
            GreenSource::Assumed | GreenSource::Texels => format!("assumed {sign}"),
        };
        add_note(&mut files[i].note, &how);
        let z = if hints.normal_blue { NormalZ::Blue } else { NormalZ::Rebuilt };
        NormalSource { file: files[i].path.clone(), green, green_source, force: hints.force_normal, z }
    });

    // Direction and level.
    let direction = at(files, Direction).or(at(files, DirectionAngle)).map(|i| {
        let angle = files[i].is(DirectionAngle);
        let span = hints.direction_span.or(angle.then_some(TAU));
        let how = match span {
            Some(span) => format!("as an angle, 0 to 1 is {} degrees", span.to_degrees().round()),
            None => "a vector in red and green; grey would need --direction-span".into(),
        };
        add_note(&mut files[i].note, &how);
        DirectionSource { file: files[i].path.clone(), span, angle }
    });
    if let Some(i) = at(files, AnisotropyLevel) {
        add_note(&mut files[i].note, "Adobe Standard Material: alpha along = alpha + level^4");
    }

    // Roughness.
    let has_maps = normal.is_some()
        || direction.is_some()
        || roughness.is_some()
        || gloss.is_some()
        || whole_roughness
        || at(files, Anisotropy).or(at(files, AnisotropyLevel)).is_some();
    let base = match (roughness, gloss) {
        (Some(map), _) if hints.roughness_is_gloss => {
            if let Some(i) = files.iter().position(|f| f.path == map.file) {
                add_note(&mut files[i].note, "its roughness is gloss, by flag");
            }
            BaseRoughness::Gloss(map)
        }
        (Some(map), _) => BaseRoughness::Roughness(map),
        (None, Some(map)) => BaseRoughness::Gloss(map),
        (None, None) => BaseRoughness::Constant(hints.roughness.unwrap_or(ASSUMED_ROUGHNESS)),
    };
    let unclear = files.iter().find(|f| f.is(Specular) && f.name.unclear);
    if let Some(file) = unclear
        && matches!(base, BaseRoughness::Constant(_))
        && hints.roughness.is_none()
        && has_maps
        && !whole_roughness
    {
        return Err(FolderError::Ambiguous {
            material: material.into(),
            question: "no map is named roughness or gloss, and _spec can mean gloss or the specular color"
                .into(),
            files: vec![file.file.clone()],
            fix: format!(
                "say --map gloss={0} if it is gloss, --ignore {0} or --roughness VALUE if it is not",
                file.file
            ),
        });
    }
    let source = if !has_maps {
        None
    } else if let Some(file) = path(files, Aniso) {
        Some(RoughnessSource::Encoded(file))
    } else if whole_roughness {
        match (path(files, GlossU), path(files, GlossV)) {
            (Some(u), Some(v)) => Some(RoughnessSource::GlossUv { u, v, direction }),
            (u, _) => {
                let (have, lack) = if u.is_some() { (GlossU, GlossV) } else { (GlossV, GlossU) };
                return Err(FolderError::Ambiguous {
                    material: material.into(),
                    question: format!("there is a {have} map but no {lack} map"),
                    files: at(files, have).map(|i| files[i].file.clone()).into_iter().collect(),
                    fix: format!(
                        "name the other with --map {lack}=FILE, or say --map gloss=FILE of this one"
                    ),
                });
            }
        }
    } else if let Some(texture) = path(files, Anisotropy) {
        Some(RoughnessSource::Khr { base, texture })
    } else if let Some(file) = path(files, AnisotropyLevel) {
        Some(RoughnessSource::Level { base, level: LevelSource::Adobe(file), direction })
    } else if let Some(strength) = hints.anisotropy {
        Some(RoughnessSource::Level { base, level: LevelSource::Strength(strength), direction })
    } else if let Some(direction) = direction {
        let file = file_name(&direction.file);
        return Err(FolderError::Ambiguous {
            material: material.into(),
            question: "a direction map, but nothing says how strong the anisotropy is".into(),
            fix: format!(
                "say --anisotropy 0..1, name a map with --map anisotropy-level=FILE, or leave it out with \
                 --ignore {file}"
            ),
            files: vec![file],
        });
    } else {
        Some(RoughnessSource::Isotropic(base))
    };

    let color = path(files, Color);
    if source.is_none() && color.is_none() && packed.is_none() && metallic.is_none() && occlusion.is_none() {
        return Ok(None);
    }
    let mut used: Vec<(Role, PathBuf)> = files
        .iter()
        .filter(|f| f.dropped.is_none())
        .filter_map(|f| f.role.filter(|r| r.is_used()).map(|role| (role, f.path.clone())))
        .collect();
    used.sort();
    Ok(Some(MaterialMaps {
        name: material.into(),
        normal,
        roughness: source,
        color,
        color_space: hints.color_space,
        layers: Vec::new(),
        occlusion,
        metallic,
        files: used,
        wrap: hints.wrap,
        twins,
        warnings: Vec::new(),
    }))
}

fn add_note(note: &mut String, more: &str) {
    if !note.is_empty() {
        note.push_str("; ");
    }
    note.push_str(more);
}

/// Leaves out pictures that are not read where another file is the same map; what a material would be baked without is an
/// error.
fn settle_unread(material: &str, files: &mut [Found]) -> Result<(), FolderError> {
    let is_map = |file: &Found| file.dropped.is_none() && file.role.is_some_and(Role::is_used);
    let readable = files.iter().any(|file| !file.unread && is_map(file));
    for i in (0..files.len()).filter(|&i| files[i].unread && is_map(&files[i])).collect::<Vec<_>>() {
        let same = |file: &&Found| !file.unread && is_map(file) && file.role == files[i].role;
        let extension = files[i].path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        files[i].dropped = Some(match (files.iter().find(same), files[i].role) {
            (Some(other), _) => format!(".{extension} is not read, {} is", other.file),
            (None, Some(role)) if readable || files[i].forced => {
                return Err(FolderError::Unfit {
                    path: files[i].path.clone(),
                    reason: format!(
                        "it is the {role} map of {material} by its name, and .{extension} files are not read"
                    ),
                    fix: format!("save it as PNG or EXR, or leave it out with --ignore {}", files[i].file),
                });
            }
            _ => format!(".{extension} is not read; save it as PNG or EXR"),
        });
    }
    Ok(())
}

/// Of several files of a kind keeps the one forced; where none is and they have one role, the largest or the likeliest,
/// whose twins the others are.
fn settle_twins(
    place: &dyn Files,
    material: &str,
    files: &mut [Found],
    kind: impl Fn(Role) -> bool,
    question: &str,
    hints: &Hints,
) -> Result<Vec<Twin>, FolderError> {
    let at: Vec<usize> = (0..files.len())
        .filter(|&i| files[i].dropped.is_none() && files[i].role.is_some_and(&kind))
        .collect();
    if at.len() < 2 {
        return Ok(Vec::new());
    }
    let forced: Vec<usize> = at.iter().copied().filter(|&i| files[i].forced).collect();
    if let [keep] = forced[..] {
        for i in at.into_iter().filter(|&i| i != keep) {
            files[i].dropped = Some(format!("--map names {}", files[keep].file));
        }
        return Ok(Vec::new());
    }
    let role = files[at[0]].role.filter(|role| at.iter().all(|&i| files[i].role == Some(*role)));
    let (Some(role), true) = (role, forced.is_empty()) else {
        return Err(ambiguous(material, files, question, &at));
    };
    // The largest, the one that points as asked for, one that says how it points, the one of 16 bits, the first.
    let wanted = hints.green.unwrap_or(Green::Up);
    let texels: BTreeMap<usize, u64> = at
        .iter()
        .filter_map(|&i| {
            let (width, height) = place.image_size(&files[i].path)?;
            Some((i, u64::from(width) * u64::from(height)))
        })
        .collect();
    // Headers that do not tell leave the names to decide.
    let texels = |i: usize| if texels.len() == at.len() { texels[&i] } else { 0 };
    let rank = |i: usize| {
        let name = &files[i].name;
        (Reverse(texels(i)), name.green != Some(wanted), name.green.is_none(), !name.deep, i)
    };
    let keep = at.iter().copied().min_by_key(|&i| rank(i)).unwrap_or(at[0]);
    let pair = |i: usize| files[i].name.green.is_some() && files[i].name.green != files[keep].name.green;
    let whys: Vec<(usize, String)> = (at.iter().copied().filter(|&i| i != keep))
        .map(|i| {
            let kept = &files[keep].file;
            let smaller = if texels(i) < texels(keep) { ", and smaller" } else { "" };
            let what = if pair(i) { "the same normals as" } else { "the same as" };
            (i, format!("{what} {kept}{smaller}"))
        })
        .collect();
    Ok(whys.into_iter().map(|(i, why)| twin(files, (role, keep), (role, i), why, false)).collect())
}

/// Of roughness and gloss keeps the one forced, or roughness, whose twin gloss is.
fn settle_gloss(material: &str, files: &mut [Found], hints: &Hints) -> Result<Option<Twin>, FolderError> {
    let at = |role| files.iter().position(|file| file.is(role));
    let (Some(rough), Some(gloss)) = (at(Role::Roughness), at(Role::Gloss)) else { return Ok(None) };
    if files[rough].forced || files[gloss].forced {
        let groups: &[&[Role]] = &[&[Role::Roughness], &[Role::Gloss]];
        settle(material, files, "there are both roughness and gloss", groups)?;
        return Ok(None);
    }
    let opposite = !hints.roughness_is_gloss;
    let why = format!("{} {}", if opposite { "one minus" } else { "the same as" }, files[rough].file);
    Ok(Some(twin(files, (Role::Roughness, rough), (Role::Gloss, gloss), why, opposite)))
}

/// Drops a file as the twin of another.
fn twin(
    files: &mut [Found],
    (role, keep): (Role, usize),
    (other_role, other): (Role, usize),
    why: String,
    is_opposite: bool,
) -> Twin {
    files[other].dropped = Some(why);
    let path = |i: usize| files[i].path.clone();
    Twin { role, used: path(keep), other_role, other: path(other), is_opposite }
}

/// Of groups of roles that exclude each other keeps the one with a forced file; an error if several are
/// there and not exactly one of them is forced.
fn settle(
    material: &str,
    files: &mut [Found],
    question: &str,
    alternatives: &[&[Role]],
) -> Result<(), FolderError> {
    let members = |files: &[Found], roles: &[Role]| -> Vec<usize> {
        (0..files.len()).filter(|&i| roles.iter().any(|r| files[i].is(*r))).collect()
    };
    let groups: Vec<Vec<usize>> =
        alternatives.iter().map(|roles| members(files, roles)).filter(|g| !g.is_empty()).collect();
    if groups.len() < 2 {
        return Ok(());
    }
    let forced: Vec<&Vec<usize>> = groups.iter().filter(|g| g.iter().any(|&i| files[i].forced)).collect();
    let [keep] = forced[..] else {
        return Err(ambiguous(material, files, question, &groups.concat()));
    };
    let why = format!("--map names {}", files[keep[0]].file);
    for i in groups.iter().filter(|g| *g != keep).flatten() {
        files[*i].dropped = Some(why.clone());
    }
    Ok(())
}

fn ambiguous(material: &str, files: &[Found], question: &str, at: &[usize]) -> FolderError {
    let mut flags: Vec<String> =
        at.iter().filter_map(|&i| Some(format!("--map {}={}", files[i].role?, files[i].file))).collect();
    flags.dedup();
    FolderError::Ambiguous {
        material: material.into(),
        question: question.into(),
        files: at.iter().map(|&i| files[i].file.clone()).collect(),
        fix: format!("say {}, or leave one out with --ignore FILE", flags.join(" or ")),
    }
}
