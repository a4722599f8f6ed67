//! A model that carries solved detail maps: `KINRAN_materials_detail` on a board, or on a material that a person names.

use std::path::{Path, PathBuf};

use glam::vec3;
use kinran_bake::detail::{MapKind, Target};
use kinran_image::{encode_png, write_atomically};
use kinran_scene::{
    DETAIL_EXTENSION, Detail, DetailLayer, DetailMap, DetailMask, Document, LayerTransform, Object, Packed,
    Slot, TextureExtension, TextureRef, Wrap,
};
use serde_json::{Value, json};

use super::{LayerFlag, SolveArgs};
use crate::demo::glb::container;
use crate::outputs::{has_extension, relative};
use crate::{Error, values};

/// What each channel of a data target is, from `--channels`.
pub(crate) fn channels_flag(text: &str) -> Result<String, String> {
    let known = |c: char| "orm-".contains(c);
    let twice = ['o', 'r', 'm'].iter().any(|c| text.matches(*c).count() > 1);
    if (1..=3).contains(&text.len()) && text.chars().all(known) && !twice && text.contains(['o', 'r', 'm']) {
        return Ok(text.into());
    }
    Err("write a letter for each channel: o occlusion, r roughness, m metallic, - none; such as orm, -rm or r".into())
}

/// Refuses models that cannot be written, before anything is solved; gives what it takes along.
pub(super) fn check(args: &SolveArgs) -> Result<Option<Packed>, Error> {
    let Some(model) = &args.model else { return Ok(None) };
    let same = |a: &Path, b: &Path| a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b));
    if same(&output(args, model), model) {
        return Err(Error::flag_error_of(
            model,
            "--model",
            "would be overwritten; name another folder with --output",
        ));
    }
    let document = Document::open_allowing(model, args.trust.allowed()?)?;
    find_material(&document, args)?;
    Ok(Some(document.pack(output(args, model))?))
}

/// Textures that were written, each by the names of its files.
pub(super) struct Written<'a> {
    /// Of the synthesized map.
    pub(super) synthesized: &'a [String],
    /// Of the tile of a layer.
    pub(super) tile: &'a dyn Fn(&LayerFlag) -> Vec<String>,
    /// Of the mask of a layer.
    pub(super) mask: &'a dyn Fn(&LayerFlag) -> Option<Vec<String>>,
    /// Factor on the opacity of all layers.
    pub(super) opacity: f32,
}

/// Writes the board or the model, and the target as the map that others show; tells the files' names.
pub(super) fn write(
    args: &SolveArgs,
    stem: &str,
    target: &Target,
    written: &Written,
) -> Result<Vec<String>, Error> {
    let (mut document, path) = match &args.model {
        Some(model) => (Document::open_allowing(model, args.trust.allowed()?)?, output(args, model)),
        None => {
            let size = (target.levels[0].width, target.levels[0].height);
            let board = board(stem, args.kind(), size);
            (Document::from_bytes(Path::new("board.glb"), &board)?, args.output().join(format!("{stem}.glb")))
        }
    };
    let material = find_material(&document, args)?;
    let mut files = Vec::new();
    let (map, slots) = place(args, target);
    if !slots.is_empty() {
        let file = format!("{stem}_authored.png");
        write_atomically(&args.output().join(&file), &encode_png(&target.image()?)?)?;
        let image = document.add_image_file(&file);
        for &slot in &slots {
            let like = document.texture(material, slot);
            let texture = document.add_texture(like, Some(image), &[]);
            document.set_texture(material, slot, texture);
        }
        files.push(file);
    }
    let info = slots.first().map(|slot| place_of(document.material(material), *slot)).unwrap_or_default();
    let detail = detail(args, target, map, written, &mut document);
    detail.write(document.material_mut(material), |texture| texture);
    document.use_extension(DETAIL_EXTENSION, false);
    // The synthesized map lies where the map lies that it takes the place of.
    let property = &mut document.material_mut(material)["extensions"][DETAIL_EXTENSION][map.property()];
    if let Some(property) = property.as_object_mut() {
        property.extend(info);
    }
    let packed = document.pack(&path)?;
    packed.write()?;
    files.extend(packed.files.iter().map(|(path, _)| relative(&args.output(), path)));
    Ok(files)
}

fn output(args: &SolveArgs, model: &Path) -> PathBuf {
    args.output().join(model.file_name().unwrap_or_default())
}

/// The map that is blended, and the slots that hold the target for those who do not blend.
fn place(args: &SolveArgs, target: &Target) -> (DetailMap, Vec<Slot>) {
    match args.kind() {
        MapKind::Color => (DetailMap::BaseColor, vec![Slot::BaseColor]),
        MapKind::Normal => (DetailMap::Normal, vec![Slot::Normal]),
        MapKind::Aniso => (DetailMap::Aniso, Vec::new()),
        MapKind::Data => {
            let channels = channels(args, target);
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

/// Channels of occlusion, roughness and metallic.
fn channels(args: &SolveArgs, target: &Target) -> [Option<usize>; 3] {
    let text = args.channels.as_deref().unwrap_or(if target.grey { "r" } else { "orm" });
    ['o', 'r', 'm'].map(|letter| text.find(letter))
}

fn detail(
    args: &SolveArgs,
    target: &Target,
    map: DetailMap,
    written: &Written,
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
    maps[map as usize] = texture(written.synthesized);
    let layers = args.layer.iter().map(|flag| {
        let mut tiles = [const { None }; 4];
        tiles[map as usize] = texture(&(written.tile)(flag));
        DetailLayer {
            transform: LayerTransform {
                scale: flag.scale,
                rotation: flag.rotation.to_radians(),
                offset: flag.offset,
                mirror: flag.mirror,
            },
            hsv: vec3(flag.hue / 360.0, flag.saturation, flag.value),
            mask: (written.mask)(flag).and_then(|files| texture(&files)).map(|texture| DetailMask {
                texture,
                channel: flag.channel,
                contrast: flag.contrast,
            }),
            opacity: flag.opacity * written.opacity,
            tiles,
        }
    });
    Detail {
        plain_overlay: args.plain_overlay,
        layers: layers.collect(),
        maps,
        channels: channels(args, target),
        aniso_alpha: args.alpha,
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

fn find_material(document: &Document, args: &SolveArgs) -> Result<usize, Error> {
    let count = document.material_count();
    let names: Vec<String> = (0..count)
        .map(|i| match document.material(i).get("name").and_then(Value::as_str) {
            Some(name) => name.into(),
            None => format!("material {i}"),
        })
        .collect();
    let path = document.path();
    let list = values::list(&names);
    match &args.material {
        Some(wanted) => names.iter().position(|name| name == wanted).ok_or_else(|| {
            let reason = format!("there is none of that name; its materials: {list}");
            Error::flag_error_of(path, format!("--material {wanted}"), reason)
        }),
        None if count == 1 => Ok(0),
        None if count == 0 => Err(Error::file_error(
            path,
            "it has no material to put the maps into; give it one, or write a --board",
        )),
        None => {
            let reason = format!("it has several materials; say which with it: {list}");
            Err(Error::flag_error_of(path, "--material", reason))
        }
    }
}

/// A board of one metre's height that faces +z, as a GLB.
fn board(name: &str, kind: MapKind, size: (u32, u32)) -> Vec<u8> {
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
    container(root.to_string().into_bytes(), bytes)
}

#[cfg(test)]
mod tests {
    use super::channels_flag;

    #[test]
    fn channels_that_mean_nothing_are_refused() {
        for good in ["orm", "-rm", "r", "o", "mro", "o-r"] {
            assert_eq!(channels_flag(good).as_deref(), Ok(good));
        }
        for bad in ["", "---", "rgb", "oo", "ormo", "x"] {
            assert!(channels_flag(bad).is_err(), "{bad:?} was taken");
        }
    }
}
