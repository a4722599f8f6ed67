//! Writes a small scene as a self-contained `.glb` (glTF 2.0, section 4.4).

use std::path::Path;

use glam::{Mat3, Vec2, Vec3};
use kinran_image::{Image, encode_png, write_atomically};
use kinran_render::reference::look_at;
use serde_json::{Value, json};

use super::maps::Maps;
use super::mesh::Mesh;
use crate::Error;

/// What covers a mesh.
pub(super) enum Cover<'a> {
    /// A painted material and, where the mesh shades itself, its occlusion.
    Maps(&'a Maps, Option<&'a Image>),
    /// The same colour (linear) and perceptual roughness everywhere.
    Plain(Vec3, f32),
}

/// A part of a scene.
pub(super) struct Part<'a> {
    /// Name of mesh and material.
    pub(super) name: &'a str,
    /// In world space.
    pub(super) mesh: &'a Mesh,
    /// Its material.
    pub(super) cover: Cover<'a>,
}

/// A point light.
#[derive(Clone, Copy)]
pub(super) struct PointLight {
    /// Metres.
    pub(super) position: Vec3,
    /// Linear, at most 1.
    pub(super) color: Vec3,
    /// Candela.
    pub(super) intensity: f32,
}

/// Where a picture is taken from.
#[derive(Clone, Copy)]
pub(super) struct Viewpoint {
    /// Metres.
    pub(super) eye: Vec3,
    /// Metres.
    pub(super) target: Vec3,
    /// Vertical field of view in radians.
    pub(super) yfov: f32,
}

/// The binary chunk and what points into it.
#[derive(Default)]
struct Data {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    images: Vec<Value>,
}

impl Data {
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.bytes.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    /// Vertex data of `N` floats each.
    fn vertices<const N: usize>(&mut self, values: impl Iterator<Item = [f32; N]>) -> usize {
        const ARRAY_BUFFER: u32 = 34962;
        const FLOAT: u32 = 5126;
        let bytes: Vec<u8> = values.flatten().flat_map(f32::to_le_bytes).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let count = bytes.len() / (4 * N);
        self.accessors
            .push(json!({ "bufferView": view, "componentType": FLOAT, "count": count, "type": kind }));
        self.accessors.len() - 1
    }

    fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        const ELEMENT_ARRAY_BUFFER: u32 = 34963;
        const UNSIGNED_INT: u32 = 5125;
        let bytes: Vec<u8> = triangles.as_flattened().iter().flat_map(|i| i.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        let count = triangles.len() * 3;
        self.accessors.push(
            json!({ "bufferView": view, "componentType": UNSIGNED_INT, "count": count, "type": "SCALAR" }),
        );
        self.accessors.len() - 1
    }

    fn image(&mut self, name: &str, image: &Image) -> Result<usize, Error> {
        let view = self.view(&encode_png(image)?, None);
        self.images.push(json!({ "name": name, "bufferView": view, "mimeType": "image/png" }));
        Ok(self.images.len() - 1)
    }

    fn primitive(&mut self, mesh: &Mesh, material: usize) -> Value {
        let position = self.vertices(mesh.positions.iter().map(Vec3::to_array));
        let (min, max) = mesh.bounds();
        self.accessors[position]["min"] = json!(min.to_array());
        self.accessors[position]["max"] = json!(max.to_array());
        let attributes = json!({
            "POSITION": position,
            "NORMAL": self.vertices(mesh.normals.iter().map(Vec3::to_array)),
            "TANGENT": self.vertices(mesh.tangents.iter().map(glam::Vec4::to_array)),
            "TEXCOORD_0": self.vertices(mesh.uvs.iter().map(Vec2::to_array)),
            "TEXCOORD_1": self.vertices(mesh.unique_uvs.iter().map(Vec2::to_array)),
        });
        json!({ "attributes": attributes, "indices": self.indices(&mesh.triangles), "material": material })
    }

    fn material(&mut self, part: &Part) -> Result<Value, Error> {
        let name = part.name;
        let (maps, occlusion) = match &part.cover {
            Cover::Maps(maps, occlusion) => (maps, occlusion),
            Cover::Plain(color, roughness) => {
                let pbr = json!({
                    "baseColorFactor": color.extend(1.0).to_array(),
                    "metallicFactor": 0.0,
                    "roughnessFactor": roughness,
                });
                return Ok(json!({ "name": name, "pbrMetallicRoughness": pbr }));
            }
        };
        let mut image = |role: &str, image| self.image(&format!("{name}_{role}"), image);
        let base_color = image("baseColor", &maps.base_color)?;
        let normal = image("normal", &maps.normal)?;
        let metallic_roughness = image("metallicRoughness", &maps.metallic_roughness)?;
        let anisotropy = image("anisotropy", &maps.anisotropy)?;
        let mut material = json!({
            "name": name,
            "doubleSided": true,
            "pbrMetallicRoughness": {
                "baseColorTexture": { "index": base_color },
                "metallicRoughnessTexture": { "index": metallic_roughness },
            },
            "normalTexture": { "index": normal },
            "extensions": {
                "KHR_materials_anisotropy": {
                    "anisotropyStrength": 1.0,
                    "anisotropyTexture": { "index": anisotropy },
                },
            },
        });
        if let Some(occlusion) = occlusion {
            let index = image("occlusion", occlusion)?;
            material["occlusionTexture"] = json!({ "index": index, "texCoord": 1 });
        }
        Ok(material)
    }
}

/// Writes the scene, whole or not at all. Every image is a texture of the same number.
///
/// # Errors
/// [`Error::Image`] where the file cannot be written.
pub(super) fn write_glb(
    path: &Path,
    parts: &[Part],
    lights: &[PointLight],
    from: Viewpoint,
) -> Result<(), Error> {
    let mut data = Data::default();
    let mut materials = Vec::new();
    let mut meshes = Vec::new();
    let mut nodes = Vec::new();
    for (i, part) in parts.iter().enumerate() {
        materials.push(data.material(part)?);
        meshes.push(json!({ "name": part.name, "primitives": [data.primitive(part.mesh, i)] }));
        nodes.push(json!({ "name": part.name, "mesh": i }));
    }
    let mut punctual = Vec::new();
    for (i, light) in lights.iter().enumerate() {
        punctual.push(json!({
            "type": "point", "color": light.color.to_array(), "intensity": light.intensity,
        }));
        nodes.push(json!({
            "name": format!("light {i}"),
            "translation": light.position.to_array(),
            "extensions": { "KHR_lights_punctual": { "light": i } },
        }));
    }
    let camera = look_at(from.eye, from.target, Vec3::Y, from.yfov);
    let rotation = Mat3::from(camera.transform.matrix3);
    let columns = [rotation.x_axis, rotation.y_axis, rotation.z_axis].map(|c| c.extend(0.0).to_array());
    let mut matrix = columns.as_flattened().to_vec();
    matrix.extend(from.eye.extend(1.0).to_array());
    nodes.push(json!({ "name": "camera", "camera": 0, "matrix": matrix }));

    let distance = from.eye.distance(from.target);
    let textures: Vec<Value> = (0..data.images.len()).map(|i| json!({ "source": i, "sampler": 0 })).collect();
    // Trilinear, repeating.
    let sampler = json!({ "magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497 });
    let root = json!({
        "asset": { "version": "2.0", "generator": "kinran demo" },
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_anisotropy"],
        "extensions": { "KHR_lights_punctual": { "lights": punctual } },
        "scene": 0,
        "scenes": [{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
        "nodes": nodes,
        "cameras": [{
            "type": "perspective",
            "perspective": { "yfov": from.yfov, "znear": 0.01 * distance, "zfar": 100.0 * distance },
        }],
        "meshes": meshes,
        "materials": materials,
        "textures": textures,
        "samplers": [sampler],
        "images": data.images,
        "accessors": data.accessors,
        "bufferViews": data.views,
        "buffers": [{ "byteLength": data.bytes.len() }],
    });
    Ok(write_atomically(path, &container(root.to_string().into_bytes(), data.bytes))?)
}

/// Header, JSON padded with spaces, binary padded with zeros.
pub(crate) fn container(mut json: Vec<u8>, mut binary: Vec<u8>) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend(((12 + 8 + json.len() + 8 + binary.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", binary)] {
        glb.extend((chunk.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(chunk);
    }
    glb
}
