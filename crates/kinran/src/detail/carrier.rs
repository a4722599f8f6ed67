//! A model that carries solved detail maps: `KINRAN_materials_detail` on a board, or on a material that a person names.

use std::path::Path;

use kinran_bake::detail::Target;
use kinran_image::{Files, encode_png};
use kinran_scene::{
    DETAIL_EXTENSION, Detail, DetailLayer, DetailMap, DetailMask, Document, Object, Slot, TextureExtension,
    TextureRef, Wrap, glb,
};
use serde_json::{Value, json};

use super::{Carrier, MapKind, SolveOptions, TiledLayer, has_extension};
use crate::error::InputFault;
use crate::names::file_name;
use crate::outgoing::{Outgoing, pack};
use crate::report::WrittenFile;
use crate::sink::place_in;
use crate::{Error, Sink};

/// What is carried, and by what.
pub(super) struct Job<'a> {
    pub(super) how: &'a SolveOptions,
    pub(super) carrier: &'a Carrier,
    pub(super) kind: MapKind,
    /// What its files' names begin with.
    pub(super) stem: &'a str,
}

impl Job<'_> {
    /// The name of the carrier's file.
    pub(super) fn file(&self) -> String {
        match self.carrier {
            Carrier::Board => format!("{}.glb", self.stem),
            Carrier::Model { path, .. } => file_name(path),
        }
    }

    /// The name of the target as those see it who do not blend.
    pub(super) fn authored(&self) -> String {
        format!("{}_authored.png", self.stem)
    }

    /// Refuses models that cannot be written, before anything is solved; gives what a model takes along that changes what is
    /// there, and the model itself.
    pub(super) fn check(&self, files: &dyn Files, out: &dyn Sink) -> Result<Vec<String>, Error> {
        let Carrier::Model { path, allow_outside, .. } = self.carrier else { return Ok(vec![self.file()]) };
        let own = files.place(path);
        if own.is_some() && own == place_in(out, &self.file()) {
            return Err(Error::Option {
                option: "model",
                given: String::new(),
                file: Some(path.clone()),
                reason: "would be overwritten; name another folder with --output".into(),
            });
        }
        let document = Document::open_in(files, path, allow_outside)?;
        self.find_material(&document)?;
        let packed = pack(&document, &self.file(), out)?.files;
        let last = packed.len().saturating_sub(1);
        let changes = |name: &str, bytes: &[u8]| out.get(name).is_some_and(|there| there != bytes);
        let changed =
            packed.into_iter().enumerate().filter(|(i, (name, bytes))| *i == last || changes(name, bytes));
        Ok(changed.map(|(_, (name, _))| name).collect())
    }

    fn find_material(&self, document: &Document) -> Result<usize, Error> {
        let Carrier::Model { path, material, .. } = self.carrier else { return Ok(0) };
        let count = document.material_count();
        let names: Vec<String> = (0..count)
            .map(|i| match document.material(i).get("name").and_then(Value::as_str) {
                Some(name) => name.into(),
                None => format!("material {i}"),
            })
            .collect();
        let refused = |given: &str, reason: String| {
            Err(Error::Option { option: "material", given: given.into(), file: Some(path.clone()), reason })
        };
        match material {
            Some(wanted) => match names.iter().position(|name| name == wanted) {
                Some(at) => Ok(at),
                None if names.is_empty() => {
                    refused(wanted, "there is none of that name; its materials: none".into())
                }
                None => refused(
                    wanted,
                    format!("there is none of that name; its materials: {}", names.join(", ")),
                ),
            },
            None if count == 1 => Ok(0),
            None if count == 0 => Err(Error::Input { path: path.clone(), fault: InputFault::NoMaterial }),
            None => refused("", format!("it has several materials; say which with it: {}", names.join(", "))),
        }
    }

    /// Writes the board or the model, and the target as the map that others show.
    pub(super) fn write(
        &self,
        files: &dyn Files,
        target: &Target,
        textures: &Textures<'_>,
        out: &dyn Sink,
    ) -> Result<Vec<WrittenFile>, Error> {
        let mut document = match self.carrier {
            Carrier::Model { path, allow_outside, .. } => Document::open_in(files, path, allow_outside)?,
            Carrier::Board => {
                let size = (target.levels[0].width, target.levels[0].height);
                Document::from_bytes(Path::new("board.glb"), &board(self.stem, self.kind, size)?)?
            }
        };
        let material = self.find_material(&document)?;
        let mut written = Vec::new();
        let (map, slots) = self.place(target);
        if !slots.is_empty() {
            let (file, bytes) = (self.authored(), encode_png(&target.image()?)?);
            out.put(&file, &bytes)?;
            let image = document.add_image_file(&file);
            for &slot in &slots {
                let like = document.texture(material, slot);
                let texture = document.add_texture(like, Some(image), &[]);
                document.set_texture(material, slot, texture);
            }
            written.push(WrittenFile::new(file, &bytes));
        }
        let info = slots.first().map(|slot| place_of(document.material(material), *slot)).unwrap_or_default();
        let detail = detail(self.how, target, map, textures, &mut document);
        detail.write(document.material_mut(material), |texture| texture);
        document.use_extension(DETAIL_EXTENSION, false);
        // The synthesized map lies where the map lies that it takes the place of.
        let property = &mut document.material_mut(material)["extensions"][DETAIL_EXTENSION][map.property()];
        if let Some(property) = property.as_object_mut() {
            property.extend(info);
        }
        let Outgoing { files, .. } = pack(&document, &self.file(), out)?;
        for (name, bytes) in files {
            out.put(&name, &bytes)?;
            written.push(WrittenFile::new(name, &bytes));
        }
        Ok(written)
    }

    /// The map that is blended, and the slots that hold the target for those who do not blend.
    fn place(&self, target: &Target) -> (DetailMap, Vec<Slot>) {
        match self.kind {
            MapKind::Color => (DetailMap::BaseColor, vec![Slot::BaseColor]),
            MapKind::Normal => (DetailMap::Normal, vec![Slot::Normal]),
            MapKind::Aniso => (DetailMap::Aniso, Vec::new()),
            MapKind::Data => {
                let channels = channels(self.how, target);
                let mut slots = Vec::new();
                // glTF has roughness in green and metallic in blue.
                if channels[1].is_none_or(|c| c == 1)
                    && channels[2].is_none_or(|c| c == 2)
                    && channels[1].is_some()
                {
                    slots.push(Slot::MetallicRoughness);
                }
                if channels[0] == Some(0) {
                    slots.push(Slot::Occlusion);
                }
                (DetailMap::Data, slots)
            }
        }
    }
}

/// Textures that were written, each by the names of its files.
pub(super) struct Textures<'a> {
    /// Of the synthesized map.
    pub(super) synthesized: &'a [String],
    /// Of the tile of a layer.
    pub(super) tile: &'a dyn Fn(&TiledLayer) -> Vec<String>,
    /// Of the mask of a layer.
    pub(super) mask: &'a dyn Fn(&TiledLayer) -> Option<Vec<String>>,
    /// Factor on the opacity of all layers.
    pub(super) opacity: f32,
}

/// Channels of occlusion, roughness and metallic.
fn channels(how: &SolveOptions, target: &Target) -> [Option<usize>; 3] {
    let text = how.channels.as_deref().unwrap_or(if target.grey { "r" } else { "orm" });
    ['o', 'r', 'm'].map(|letter| text.find(letter))
}

fn detail(
    how: &SolveOptions,
    target: &Target,
    map: DetailMap,
    textures: &Textures<'_>,
    document: &mut Document,
) -> Detail {
    let mut texture = |files: &[String]| -> Option<TextureRef> {
        let file = files.first()?;
        let dds = has_extension(Path::new(file), "dds");
        let extension = if dds { TextureExtension::Dds } else { TextureExtension::Ktx2 };
        let image = document.add_image_file(file);
        let image = document.add_optional_texture(None, &[(extension, image)]);
        Some(TextureRef {
            image,
            runtime: None,
            uv_set: 0,
            transform: glam::Mat3::IDENTITY,
            wrap: [Wrap::Repeat; 2],
        })
    };
    let mut maps = [const { None }; 4];
    maps[map as usize] = texture(textures.synthesized);
    let layers = how.layers.iter().map(|layer| {
        let mut tiles = [const { None }; 4];
        tiles[map as usize] = texture(&(textures.tile)(layer));
        DetailLayer {
            transform: layer.transform(),
            hsv: layer.hsv(),
            mask: (textures.mask)(layer).and_then(|files| texture(&files)).map(|texture| DetailMask {
                texture,
                channel: layer.channel,
                contrast: layer.contrast,
            }),
            opacity: layer.opacity * textures.opacity,
            tiles,
        }
    });
    Detail {
        plain_overlay: how.plain_overlay,
        layers: layers.collect(),
        maps,
        channels: channels(how, target),
        aniso_alpha: how.alpha,
    }
}

/// UV set and transform of a material's texture.
fn place_of(material: &Object, slot: Slot) -> Object {
    let pbr = material.get("pbrMetallicRoughness");
    let info = match slot {
        Slot::BaseColor => pbr.and_then(|pbr| pbr.get("baseColorTexture")),
        Slot::MetallicRoughness => pbr.and_then(|pbr| pbr.get("metallicRoughnessTexture")),
        Slot::Occlusion => material.get("occlusionTexture"),
        _ => material.get("normalTexture"),
    };
    let mut info = info.and_then(Value::as_object).cloned().unwrap_or_default();
    info.retain(|key, _| key == "texCoord" || key == "extensions");
    info
}

/// A board of one metre's height that faces +z, as a GLB.
fn board(name: &str, kind: MapKind, size: (u32, u32)) -> Result<Vec<u8>, kinran_scene::Error> {
    let half = 0.5 * size.0 as f32 / size.1 as f32;
    let corners = [[-half, 0.5], [half, 0.5], [half, -0.5], [-half, -0.5]];
    let mut bytes: Vec<u8> = Vec::new();
    let mut put = |floats: &[f32]| bytes.extend(floats.iter().flat_map(|f| f.to_le_bytes()));
    corners.iter().for_each(|&[x, y]| put(&[x, y, 0.0]));
    corners.iter().for_each(|_| put(&[0.0, 0.0, 1.0]));
    corners.iter().for_each(|_| put(&[1.0, 0.0, 0.0, 1.0]));
    put(&[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0]);
    bytes.extend([0_u16, 2, 1, 0, 3, 2].iter().flat_map(|i| i.to_le_bytes()));
    // What is not in a map: a rough dielectric for colour and normals, glTF's factors for data, metal for lobes.
    let pbr = match kind {
        MapKind::Color => json!({ "metallicFactor": 0.0, "roughnessFactor": 0.7 }),
        MapKind::Normal => {
            json!({ "baseColorFactor": [0.5, 0.5, 0.5, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.5 })
        }
        MapKind::Data => json!({ "baseColorFactor": [0.5, 0.5, 0.5, 1.0] }),
        MapKind::Aniso => json!({ "baseColorFactor": [0.8, 0.8, 0.8, 1.0], "roughnessFactor": 0.4 }),
    };
    let float = |view: usize, kind: &str| json!({ "bufferView": view, "componentType": 5126, "count": 4, "type": kind });
    let mut position = float(0, "VEC3");
    position["min"] = json!([-half, -0.5, 0.0]);
    position["max"] = json!([half, 0.5, 0.0]);
    let view =
        |offset: usize, length: usize| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    let root = json!({
        "asset": { "version": "2.0", "generator": "kinran detail solve" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "name": name, "mesh": 0 }],
        "meshes": [{ "name": name, "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "TANGENT": 2, "TEXCOORD_0": 3 },
            "indices": 4, "material": 0,
        }] }],
        "materials": [{ "name": name, "doubleSided": true, "pbrMetallicRoughness": pbr }],
        "accessors": [
            position, float(1, "VEC3"), float(2, "VEC4"), float(3, "VEC2"),
            { "bufferView": 4, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
        "bufferViews": [view(0, 48), view(48, 48), view(96, 64), view(160, 32), view(192, 12)],
        "buffers": [{ "byteLength": bytes.len() }],
    });
    glb(root.to_string().as_bytes(), &bytes)
}
