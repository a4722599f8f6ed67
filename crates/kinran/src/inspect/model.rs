//! What is inside a glTF file.

use std::path::{Path, PathBuf};

use kinran_bake::aniso::RoughnessMaps;
use kinran_bake::{NoSurface, material_surface};
use kinran_image::{Files, Pixels, full_level_count};
use kinran_scene::{AlphaMode, Document, LightKind, Material, Needs, Scene, TextureRef};
use schemars::JsonSchema;
use serde::Serialize;

use super::{counted, file_name};
use crate::bake::texel_remarks;
use crate::{Error, Stage, Task};

/// What is in a model.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ModelReport {
    /// The file's name.
    pub file: String,
    /// `model`.
    pub kind: &'static str,
    /// Triangles of all instances.
    pub triangles: usize,
    /// How often primitives are drawn.
    pub instances: usize,
    /// Its primitives.
    pub primitives: Vec<PrimitiveReport>,
    /// Its materials.
    pub materials: Vec<MaterialReport>,
    /// Its cameras.
    pub cameras: Vec<CameraReport>,
    /// Its lights: `directional`, `point` or `spot`.
    pub lights: Vec<&'static str>,
    /// Extensions that it says it uses.
    pub extensions_used: Vec<String>,
    /// Those without which it cannot be read.
    pub extensions_required: Vec<String>,
    /// What is doubtful about it, a sentence each.
    pub warnings: Vec<String>,
}

/// A primitive of a mesh.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PrimitiveReport {
    /// Its triangles.
    pub triangles: usize,
    /// Its vertices.
    pub vertices: usize,
    /// How often it is drawn.
    pub instances: usize,
    /// Its sets of texture coordinates.
    pub uv_sets: usize,
    /// Its material's name.
    pub material: String,
}

/// A material.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct MaterialReport {
    /// Its name.
    pub name: String,
    /// What its maps are multiplied with, or what it is without them.
    pub factors: Factors,
    /// `opaque`, `mask` or `blend`.
    pub alpha: &'static str,
    /// Below it a texel is a hole, where `alpha` is `mask`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha_cutoff: Option<f32>,
    /// Whether its back is drawn too.
    pub double_sided: bool,
    /// Its textures.
    pub maps: Vec<MapReport>,
    /// What `kinran bake` does with it.
    pub bake: String,
    /// Extensions that neither change the bake nor the picture.
    pub ignored_extensions: Vec<String>,
}

/// Factors of a material, as glTF has them.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct Factors {
    /// Base colour, linear, and alpha.
    pub base_color: [f32; 4],
    /// Metalness.
    pub metallic: f32,
    /// Perceptual roughness.
    pub roughness: f32,
    /// Of the normal map's x and y.
    pub normal_scale: f32,
    /// Emission, linear.
    pub emissive: [f32; 3],
}

/// A texture of a material.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct MapReport {
    /// What it stands for, as glTF calls it without "Texture".
    pub slot: &'static str,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Its channels.
    pub channels: usize,
    /// Bits of a sample.
    pub bits: u32,
    /// Which texture coordinates it is laid by.
    pub uv_set: usize,
    /// The KTX2 or DDS file with its mips.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub runtime: Option<RuntimeReport>,
}

/// The mips of a texture of a material.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RuntimeReport {
    /// The image's URI; an image in a buffer has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Its texel format.
    pub format: String,
    /// How many levels it has.
    pub levels: usize,
    /// The filter that kinran made the mips with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filter: Option<String>,
}

/// A camera.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct CameraReport {
    /// Where it stands, metres.
    pub position: [f32; 3],
    /// From the lower edge of its picture to the upper one.
    pub yfov_degrees: f32,
}

pub(super) fn inspect(
    files: &dyn Files,
    path: &Path,
    allowed: &[PathBuf],
    task: Task<'_>,
) -> Result<ModelReport, Error> {
    let reading = task.begin(Stage::Reading, file_name(path), 0)?;
    let expect = |units| reading.expect(units);
    let needs = Needs { forgiving: true, ..Needs::ALL };
    let scene = Scene::load_in(files, path, allowed, &needs, &expect, &|units| reading.tick(units))?;
    drop(reading);
    // An OBJ has no document, and no extensions.
    let is_obj = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj"));
    let document = (!is_obj).then(|| Document::open_in(files, path, allowed)).transpose()?;
    let strings = |key: &str| -> Vec<String> {
        let values = document.as_ref().and_then(|d| d.json().get(key)?.as_array());
        values.into_iter().flatten().filter_map(|v| v.as_str().map(str::to_owned)).collect()
    };
    let primitives = scene.primitives.iter().enumerate().map(|(i, p)| PrimitiveReport {
        triangles: p.triangles.len(),
        vertices: p.positions.len(),
        instances: scene.instances.iter().filter(|instance| instance.primitive == i).count(),
        uv_sets: p.uvs.iter().filter(|uvs| !uvs.is_empty()).count(),
        material: scene.materials[p.material].name.clone(),
    });
    let materials = scene.materials.iter().enumerate().map(|(i, m)| MaterialReport {
        name: m.name.clone(),
        factors: Factors {
            base_color: m.base_color_factor.to_array(),
            metallic: m.metallic_factor,
            roughness: m.roughness_factor,
            normal_scale: m.normal_scale,
            emissive: m.emissive_factor.to_array(),
        },
        alpha: match m.alpha_mode {
            AlphaMode::Opaque => "opaque",
            AlphaMode::Mask { .. } => "mask",
            AlphaMode::Blend => "blend",
        },
        alpha_cutoff: match m.alpha_mode {
            AlphaMode::Mask { cutoff } => Some(cutoff),
            AlphaMode::Opaque | AlphaMode::Blend => None,
        },
        double_sided: m.double_sided,
        maps: maps(&scene, document.as_ref(), m),
        bake: bake(&scene, i),
        ignored_extensions: m.ignored_extensions.clone(),
    });
    let image = |i: usize| document.as_ref().map_or_else(|| i.to_string(), |document| document.image_name(i));
    let remarks = (0..scene.materials.len()).flat_map(|i| texel_remarks(&scene, i, &image, None));
    let cameras = scene.cameras.iter().map(|camera| CameraReport {
        position: camera.transform.translation.to_array(),
        yfov_degrees: camera.yfov.to_degrees(),
    });
    let lights = scene.lights.iter().map(|light| match light.kind {
        LightKind::Directional => "directional",
        LightKind::Point => "point",
        LightKind::Spot { .. } => "spot",
    });
    Ok(ModelReport {
        file: file_name(path),
        kind: "model",
        triangles: scene.instances.iter().map(|i| scene.primitives[i.primitive].triangles.len()).sum(),
        instances: scene.instances.len(),
        primitives: primitives.collect(),
        materials: materials.collect(),
        cameras: cameras.collect(),
        lights: lights.collect(),
        extensions_used: strings("extensionsUsed"),
        extensions_required: strings("extensionsRequired"),
        warnings: scene.warnings.iter().cloned().chain(remarks).collect(),
    })
}

fn maps(scene: &Scene, document: Option<&Document>, m: &Material) -> Vec<MapReport> {
    let anisotropy = m.anisotropy.as_ref().and_then(|a| a.texture.as_ref());
    let diffuse_transmission = m.diffuse_transmission.as_ref();
    let dielectric = m.dielectric.as_ref();
    let slots: [(&str, Option<&TextureRef>); 11] = [
        ("baseColor", m.base_color.as_ref()),
        ("metallicRoughness", m.metallic_roughness.as_ref()),
        ("normal", m.normal.as_ref()),
        ("anisotropy", anisotropy),
        ("aniso", m.aniso.as_ref()),
        ("occlusion", m.occlusion.as_ref()),
        ("emissive", m.emissive.as_ref()),
        ("diffuseTransmission", diffuse_transmission.and_then(|d| d.texture.as_ref())),
        ("diffuseTransmissionColor", diffuse_transmission.and_then(|d| d.color.as_ref())),
        ("specular", dielectric.and_then(|d| d.strength_texture.as_ref())),
        ("specularColor", dielectric.and_then(|d| d.color.as_ref())),
    ];
    let runtime = |image: usize| -> Option<RuntimeReport> {
        let texture = scene.textures.get(image)?.as_ref()?;
        let uri = document.and_then(|d| d.json().get("images")?.get(image)?.get("uri")?.as_str());
        Some(RuntimeReport {
            file: uri.map(|uri| if uri.starts_with("data:") { "data:".into() } else { uri.to_owned() }),
            format: texture.format.name().into(),
            levels: texture.levels.len(),
            filter: texture.metadata.get("KinranFilter").cloned(),
        })
    };
    let report = |(slot, place): (&'static str, Option<&TextureRef>)| {
        let place = place?;
        let image = scene.images.get(place.image)?.as_ref()?;
        Some(MapReport {
            slot,
            width: image.width,
            height: image.height,
            channels: image.channels.count(),
            bits: match image.pixels {
                Pixels::U8(_) => 8,
                Pixels::U16(_) => 16,
                Pixels::F32(_) => 32,
            },
            uv_set: place.uv_set,
            runtime: place.runtime.and_then(runtime),
        })
    };
    slots.into_iter().filter_map(report).collect()
}

/// What `kinran bake` does with a material, in words.
fn bake(scene: &Scene, material: usize) -> String {
    let m = &scene.materials[material];
    let anisotropy = m.anisotropy.as_ref().and_then(|a| a.texture.as_ref());
    let maps = [m.normal.as_ref(), anisotropy, m.metallic_roughness.as_ref()];
    if maps.into_iter().flatten().any(|map| scene.images.get(map.image).is_none_or(Option::is_none)) {
        return "nothing: one of its images cannot be read".into();
    }
    match material_surface(scene, material) {
        Ok(surface) if surface.place.is_none() => "nothing: its anisotropy is in factors alone".into(),
        Ok(surface) => {
            let (width, height) = surface.maps.size();
            let what = match (&surface.maps.normal.image, &surface.maps.roughness) {
                (None, RoughnessMaps::Isotropic(_)) => "roughness",
                (Some(_), RoughnessMaps::Isotropic(_)) => "normal and roughness",
                (None, _) => "roughness and anisotropy",
                (Some(_), _) => "normal and anisotropy",
            };
            format!(
                "{what}, {width}x{height}, {}",
                counted(full_level_count(width, height), "level", "levels")
            )
        }
        Err(NoSurface::Plain) => "nothing: it has no normal or roughness map and is isotropic".into(),
        Err(NoSurface::Apart(reason)) => format!("nothing: {reason}"),
    }
}
