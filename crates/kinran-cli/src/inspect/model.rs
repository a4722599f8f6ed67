//! What is inside a glTF file.

use std::path::Path;

use kinran_bake::aniso::RoughnessMaps;
use kinran_bake::{NoSurface, material_surface};
use kinran_image::{Pixels, full_level_count};
use kinran_scene::{Document, LightKind, Material, Needs, Scene, TextureRef};
use schemars::JsonSchema;
use serde::Serialize;

use crate::model::{ModelArgs, read_scene};
use crate::render::triangles;
use crate::table::list;
use crate::values::counted;
use crate::view::file_name;
use crate::{Console, Error, outputs};
use kinran::bake::texel_remarks;

#[derive(Serialize, JsonSchema)]
pub(crate) struct Report {
    file: String,
    kind: &'static str,
    triangles: usize,
    instances: usize,
    primitives: Vec<PrimitiveReport>,
    materials: Vec<MaterialReport>,
    cameras: Vec<CameraReport>,
    lights: Vec<&'static str>,
    extensions_used: Vec<String>,
    extensions_required: Vec<String>,
    warnings: Vec<String>,
}

#[derive(Serialize, JsonSchema)]
struct PrimitiveReport {
    triangles: usize,
    vertices: usize,
    instances: usize,
    uv_sets: usize,
    material: String,
}

#[derive(Serialize, JsonSchema)]
struct MaterialReport {
    name: String,
    maps: Vec<MapReport>,
    /// What `kinran bake` does with it.
    bake: String,
    /// Extensions that neither change the bake nor the picture.
    ignored_extensions: Vec<String>,
}

#[derive(Serialize, JsonSchema)]
struct MapReport {
    slot: &'static str,
    width: u32,
    height: u32,
    channels: usize,
    bits: u32,
    uv_set: usize,
    /// The KTX2 or DDS file with its mips.
    #[serde(skip_serializing_if = "Option::is_none")]
    runtime: Option<RuntimeReport>,
}

#[derive(Serialize, JsonSchema)]
struct RuntimeReport {
    /// The image's URI; an image in a buffer has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    format: String,
    levels: usize,
    /// The filter that kinran made the mips with.
    #[serde(skip_serializing_if = "Option::is_none")]
    filter: Option<String>,
}

#[derive(Serialize, JsonSchema)]
struct CameraReport {
    position: [f32; 3],
    yfov_degrees: f32,
}

pub(super) fn inspect(path: &Path, args: &ModelArgs, console: &Console) -> Result<(), Error> {
    let scene = read_scene(path, args, &Needs::ALL, &console.progress())?;
    // An OBJ has no document, and no extensions.
    let is_obj = outputs::has_extension(path, "obj");
    let allowed = args.allowed()?;
    let document = (!is_obj).then(|| Document::open_allowing(path, allowed)).transpose()?;
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
    let report = Report {
        file: file_name(path),
        kind: "model",
        triangles: triangles(&scene),
        instances: scene.instances.len(),
        primitives: primitives.collect(),
        materials: materials.collect(),
        cameras: cameras.collect(),
        lights: lights.collect(),
        extensions_used: strings("extensionsUsed"),
        extensions_required: strings("extensionsRequired"),
        warnings: scene.warnings.iter().cloned().chain(remarks).collect(),
    };
    let text = text(&report);
    console.result(&super::Report::Model(report), &text)
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

impl RuntimeReport {
    fn text(&self) -> String {
        let file = self.file.as_deref().unwrap_or("the file");
        let filter = self.filter.as_ref().map_or_else(String::new, |filter| format!(", filter {filter}"));
        let levels = counted(self.levels, "level", "levels");
        format!("; mips in {file}: {}, {levels}{filter}", self.format)
    }
}

/// What `kinran bake` does with a material, in words.
fn bake(scene: &Scene, material: usize) -> String {
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

fn text(report: &Report) -> String {
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let or_none = |values: &[String]| if values.is_empty() { "none".into() } else { values.join(", ") };
    let mut facts = vec![
        row("file", report.file.clone()),
        row(
            "triangles",
            format!("{} in {}", report.triangles, counted(report.instances, "instance", "instances")),
        ),
        row("extensions", or_none(&report.extensions_used)),
    ];
    if !report.extensions_required.is_empty() {
        facts.push(row("required", or_none(&report.extensions_required)));
    }
    if !report.lights.is_empty() {
        facts.push(row("lights", report.lights.join(", ")));
    }
    facts.extend(report.cameras.iter().enumerate().map(|(i, camera)| {
        let [x, y, z] = camera.position;
        row(&format!("camera {i}"), format!("at {x:.3}, {y:.3}, {z:.3}, {:.1} degrees", camera.yfov_degrees))
    }));
    facts.extend(report.warnings.iter().map(|warning| row("warning", warning.clone())));

    let headings = ["primitive", "triangles", "vertices", "instances", "UV sets", "material"];
    let mut primitives = vec![headings.map(str::to_owned).to_vec()];
    primitives.extend(report.primitives.iter().enumerate().map(|(i, p)| {
        let numbers = [i, p.triangles, p.vertices, p.instances, p.uv_sets].map(|n| n.to_string());
        [&numbers[..], std::slice::from_ref(&p.material)].concat()
    }));

    let mut text = format!("{}\n{}", list(&facts), list(&primitives));
    for m in &report.materials {
        let mut rows = vec![row("  bake", m.bake.clone())];
        rows.extend(m.maps.iter().map(|map| {
            let MapReport { slot, width, height, channels, bits, uv_set, runtime } = map;
            let mips = runtime.as_ref().map_or_else(String::new, RuntimeReport::text);
            let text = format!("{width}x{height}, {channels} x {bits} bits, UV set {uv_set}{mips}");
            row(&format!("  {slot}"), text)
        }));
        if !m.ignored_extensions.is_empty() {
            rows.push(row("  ignored", m.ignored_extensions.join(", ")));
        }
        text += &format!("\nmaterial {}\n{}", m.name, list(&rows));
    }
    text
}
