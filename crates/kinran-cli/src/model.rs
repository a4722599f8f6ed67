//! What a path shows: a glTF file, a folder that holds one, or a folder of baked textures.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use glam::{Affine3A, Mat3, Vec2, Vec3, Vec4};
use kinran_image::{Channels, Image, Pixels, read_texture};
use kinran_scene::{
    Anisotropy, Instance, Material, Needs, Primitive, Scene, Source, TextureRef, Wrap, is_gltf,
};
use serde::Deserialize;

use crate::view::file_name;
use crate::{Error, Progress, outputs};
use kinran::content::Content;

/// The flag about files that a model names.
#[derive(Clone, Debug, Default, PartialEq, Eq, clap::Args)]
pub struct ModelArgs {
    /// Lets the model name files of this folder too, such as textures that several models share; may be given again.
    /// A model that names files outside of its own folder is refused otherwise
    #[arg(long, value_name = "DIR")]
    pub allow_outside: Vec<PathBuf>,
}

impl ModelArgs {
    /// The folders that are allowed.
    ///
    /// # Errors
    /// [`Error::Flag`] where one does not exist.
    pub fn allowed(&self) -> Result<&[PathBuf], Error> {
        match self.allow_outside.iter().find(|folder| !folder.is_dir()) {
            Some(folder) => {
                let given = format!("--allow-outside {}", folder.display());
                Err(Error::flag_error(given, "there is no such folder; name one that exists"))
            }
            None => Ok(&self.allow_outside),
        }
    }
}

/// A model and where it comes from.
#[derive(Clone, Debug)]
pub struct Model {
    /// The glTF file, or the folder of textures.
    pub path: PathBuf,
    /// What it shows.
    pub scene: Scene,
    /// There are no maps to bake again: the textures are all there is.
    pub only_baked: bool,
}

/// The sidecar of a bake, as far as it says which file is what.
#[derive(Deserialize)]
struct Sidecar {
    /// None where the report is one of skin tables.
    #[serde(default)]
    surfaces: Vec<Surface>,
}

#[derive(Deserialize)]
struct Surface {
    name: String,
    outputs: Vec<Output>,
}

#[derive(Deserialize)]
struct Output {
    file: String,
    map: String,
}

/// Metres along a board's side, and between two of them; chosen by eye.
const BOARD: f32 = 1.0;
const GAP: f32 = 0.1;

/// Where a model lies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A glTF file.
    File(PathBuf),
    /// A folder of textures, and their sidecars.
    Textures(PathBuf, Vec<PathBuf>),
}

impl Place {
    /// The glTF file `path`, the only one in the folder `path`, or the textures that `kinran bake` wrote there. Nothing is
    /// read yet.
    ///
    /// # Errors
    /// [`Error::File`] for a path that does not exist and a folder with nothing to show, or with several models.
    pub fn of(path: &Path) -> Result<Self, Error> {
        let complain = |e: &dyn std::fmt::Display| Error::file_error(path, e.to_string());
        if !path.exists() {
            return Err(complain(&"there is no such file or folder"));
        }
        if !path.is_dir() {
            return Ok(Place::File(path.into()));
        }
        let mut files = Vec::new();
        let io = |e| kinran_image::Error::io(path, e);
        for entry in std::fs::read_dir(path).map_err(io)? {
            files.push(entry.map_err(io)?.path());
        }
        files.sort();
        let ends = |file: &Path, ending: &str| file.to_string_lossy().to_ascii_lowercase().ends_with(ending);
        let sidecars: Vec<PathBuf> =
            files.iter().filter(|file| ends(file, ".kinran.json")).cloned().collect();
        let is_model = |file: &&PathBuf| is_gltf(file) || ends(file, ".obj");
        let models: Vec<PathBuf> = files.iter().filter(is_model).cloned().collect();
        match models.as_slice() {
            [model] => Ok(Place::File(model.clone())),
            [] if sidecars.is_empty() => Err(complain(&format!(
                "no .glb, .gltf or .obj file in this folder, and no textures that `kinran bake` wrote with their \
                 .kinran.json; name a model, or bake one; maps become textures by `kinran bake {}`",
                path.display()
            ))),
            [] => Ok(Place::Textures(path.into(), sidecars)),
            models @ [first, ..] => Err(complain(&format!(
                "{} models in this folder; name one, such as {}",
                models.len(),
                first.display()
            ))),
        }
    }
}

/// The model that a path names: the file, or the only model in a folder.
///
/// # Errors
/// Those of [`Place::of`], and [`Error::File`] for a folder of textures alone.
pub(crate) fn model_at(path: &Path) -> Result<PathBuf, Error> {
    if !path.is_dir() {
        return Ok(path.into());
    }
    match Place::of(path)? {
        Place::File(path) => Ok(path),
        Place::Textures(path, _) => {
            let reason = "holds baked textures and no model; name the model, or draw the textures with `kinran render`";
            Err(Error::file_error(&path, reason))
        }
    }
}

impl Model {
    /// Reads what lies at `path`, see [`Place::of`]; textures alone are laid on boards a metre wide, one for each material.
    ///
    /// # Errors
    /// Those of [`Place::of`] and of the files.
    pub fn open(path: &Path, args: &ModelArgs, progress: &Progress) -> Result<Self, Error> {
        match Place::of(path)? {
            Place::File(path) => {
                let mut scene = read_scene(&path, args, &Needs::ALL, progress)?;
                let not_drawn = not_drawn(&scene);
                scene.warnings.extend(not_drawn);
                let lacks = scene.primitives.iter().any(|p| p.source.lacks_normals);
                if lacks && outputs::has_extension(&path, "obj") {
                    let faceted = "has no normals and is drawn with facets; export it with normals for a smooth surface";
                    scene.warnings.push(format!("{}: {faceted}", path.display()));
                }
                Ok(Model { path, scene, only_baked: false })
            }
            Place::Textures(path, sidecars) => {
                let scene = boards(&path, &sidecars)?;
                Ok(Model { path, scene, only_baked: true })
            }
        }
    }
}

/// What materials have and no picture shows, a sentence for each extension.
fn not_drawn(scene: &Scene) -> Vec<String> {
    let mut materials: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for material in &scene.materials {
        for extension in &material.ignored_extensions {
            materials.entry(extension).or_default().push(&material.name);
        }
    }
    let sentence = |(extension, names): (&str, Vec<&str>)| match names[..] {
        [name] => format!("material \"{name}\": {extension} is not drawn"),
        [name, ..] => format!("material \"{name}\" and {} more: {extension} is not drawn", names.len() - 1),
        [] => String::new(),
    };
    materials.into_iter().map(sentence).collect()
}

/// Reads a model with a bar.
///
/// # Errors
/// Those of [`Scene::load`], and of the flag.
pub(crate) fn read_scene(
    path: &Path,
    args: &ModelArgs,
    needs: &Needs,
    progress: &Progress,
) -> Result<Scene, Error> {
    let reading = progress.busy(format!("reading {}", file_name(path)));
    let expect = |units| reading.expect(units);
    Ok(Scene::load_watched(path, args.allowed()?, needs, &expect, &|units| reading.tick(units))?)
}

/// A board for each material of the sidecars, side by side along x, facing +z.
fn boards(folder: &Path, sidecars: &[PathBuf]) -> Result<Scene, Error> {
    let mut scene = Scene::default();
    for sidecar in sidecars {
        let text = std::fs::read_to_string(sidecar).map_err(|e| kinran_image::Error::io(sidecar, e))?;
        let read: Sidecar = serde_json::from_str(&text).map_err(|e| {
            Error::file_error(sidecar, format!("not what `kinran bake` writes: {e}; bake again"))
        })?;
        for surface in read.surfaces {
            let material = material(folder, surface, &mut scene)?;
            scene.materials.push(material);
        }
    }
    let count = scene.materials.len();
    for i in 0..count {
        scene.primitives.push(board(i));
        let x = (i as f32 - 0.5 * (count - 1) as f32) * (BOARD + GAP);
        let transform = Affine3A::from_translation(Vec3::new(x, 0.0, 0.0));
        scene.instances.push(Instance { primitive: i, transform });
    }
    Ok(scene)
}

/// A file that a sidecar names, which must lie beside it.
fn beside(folder: &Path, file: &str) -> Result<PathBuf, Error> {
    let mut parts = Path::new(file).components();
    match (parts.next(), parts.next()) {
        (Some(Component::Normal(_)), None) if !file.contains('\\') => Ok(folder.join(file)),
        _ => {
            let reason = format!("a sidecar names \"{file}\", which does not lie beside it; bake again");
            Err(Error::file_error(folder, reason))
        }
    }
}

/// A surface's textures as a material.
fn material(folder: &Path, surface: Surface, scene: &mut Scene) -> Result<Material, Error> {
    let mut material = Material {
        name: surface.name,
        base_color_factor: Vec3::splat(0.8).extend(1.0),
        metallic_factor: 0.0,
        double_sided: true,
        ..Material::default()
    };
    for output in surface.outputs {
        let place = texture(&beside(folder, &output.file)?, scene)?;
        match Content::named(&output.map) {
            // With KTX2 and DDS of the same map, either will do.
            Some(Content::Normal) => material.normal = Some(place),
            Some(Content::Aniso) => material.aniso = Some(place),
            Some(Content::Anisotropy) => {
                material.anisotropy = Some(Anisotropy { strength: 1.0, rotation: 0.0, texture: Some(place) });
            }
            Some(Content::Roughness) => material.metallic_roughness = Some(place),
            Some(Content::Orm) => {
                material.metallic_factor = 1.0;
                material.occlusion = Some(place.clone());
                material.metallic_roughness = Some(place);
            }
            Some(Content::Color) => {
                material.base_color_factor = Vec4::ONE;
                material.base_color = Some(place);
            }
            _ => {
                scene.warnings.push(format!("{}: a map \"{}\" is not drawn", output.file, output.map));
            }
        }
    }
    Ok(material)
}

/// A baked texture in a scene. Its image is never looked at: white stands for it.
fn texture(path: &Path, scene: &mut Scene) -> Result<TextureRef, Error> {
    scene.textures.push(Some(Arc::new(read_texture(path)?)));
    scene.images.push(Some(Arc::new(Image::new(1, 1, Channels::R, Pixels::U8(vec![255]))?)));
    let index = scene.images.len() - 1;
    Ok(TextureRef {
        image: index,
        runtime: Some(index),
        uv_set: 0,
        transform: Mat3::IDENTITY,
        wrap: [Wrap::Repeat; 2],
    })
}

/// A square about the origin, u right and v down.
fn board(material: usize) -> Primitive {
    let corners = [Vec2::new(0.0, 0.0), Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0)];
    Primitive {
        positions: corners.map(|uv| BOARD * Vec3::new(uv.x - 0.5, 0.5 - uv.y, 0.0)).to_vec(),
        normals: vec![Vec3::Z; 4],
        tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4],
        uvs: [corners.to_vec(), Vec::new()],
        colors: Vec::new(),
        curvature: None,
        triangles: vec![[0, 2, 1], [1, 2, 3]],
        material,
        source: Source::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_a_model_only_when_it_holds_one() {
        let folder = tempfile::tempdir().unwrap();
        let of = |path: &Path| Place::of(path).map_err(|e| e.to_string());
        assert!(of(folder.path()).unwrap_err().contains("no .glb"));
        std::fs::write(folder.path().join("a.kinran.json"), "").unwrap();
        let sidecars = vec![folder.path().join("a.kinran.json")];
        assert_eq!(of(folder.path()), Ok(Place::Textures(folder.path().into(), sidecars)));
        assert!(
            Model::open(folder.path(), &ModelArgs::default(), &Progress::new(false))
                .unwrap_err()
                .to_string()
                .contains("a.kinran.json")
        );
        std::fs::write(folder.path().join("a.glb"), "").unwrap();
        std::fs::write(folder.path().join("a.png"), "").unwrap();
        assert_eq!(of(folder.path()), Ok(Place::File(folder.path().join("a.glb"))));
        std::fs::write(folder.path().join("b.gltf"), "").unwrap();
        assert!(of(folder.path()).unwrap_err().contains("2 models"));
        assert!(of(&folder.path().join("c")).unwrap_err().contains("no such"));
    }
}
