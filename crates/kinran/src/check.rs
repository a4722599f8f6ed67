//! Whether a file that Kinran wrote keeps its own rules, so that others can test what they made with it, and what they made
//! in its place.

use std::path::Path;

use kinran_bake::aniso::Filter;
use kinran_bake::cache::relative;
use kinran_image::{
    Files, Format, Texture, Transfer, decode_texture, full_level_count, image_size_of, untold,
};
use kinran_scene::{Document, Needs, Object, Scene, Slot, TextureExtension, is_gltf};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use crate::Error;
use crate::content::Content;
use crate::report::{KnownFiles, WrittenFile};

/// A rule that is broken.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Finding {
    /// Where: the file, or the part of it, such as "lamp_brass_normal.ktx2, level 3" or "material 2, normalTexture".
    pub place: String,
    /// What is wrong, and what would be right.
    pub problem: String,
}

/// What was looked at in a file, and what of it breaks the rules.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Checked {
    /// How many of the things that have rules are in it: textures with mips, extensions of Kinran's, meshes with curvature,
    /// files that a report names. A model that was never baked has none.
    pub looked_at: usize,
    /// What is wrong; nothing where all is well.
    pub findings: Vec<Finding>,
}

/// What a file breaks of the rules for what Kinran writes.
///
/// - `.ktx2`, `.dds`: levels down to 1×1, of skin tables one; what it holds is said by a known key and its format has the
///   channels for it; colour is sRGB and all else linear; no half float is infinite or none; normals are no longer than one.
/// - `.gltf`, `.glb`: the document can be read whole; extensions of its parts are listed, and no `KINRAN_*` is required;
///   textures with mips are there, keep the rules above, hold what their slot wants, and have the size of the image that
///   others see in their place; `_CURVATURE` is a normalised unsigned byte vector beside tangents, with the extension that
///   gives its range.
/// - `NAME.kinran.json`: the files that it names are as they were written, and its textures are what it says of them.
///
/// # Errors
/// [`Error::Image`] where the file cannot be read, or is none of these. What is damaged is a finding.
pub fn check(files: &dyn Files, path: &Path) -> Result<Checked, Error> {
    let is = |extension: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(extension));
    let bytes = files.read(path).map_err(|e| kinran_image::Error::io(path, e))?;
    let mut findings = Findings(Checked { looked_at: 0, findings: Vec::new() });
    if is("ktx2") || is("dds") {
        findings.texture_file(&name_of(path), path, &bytes, None);
    } else if is_gltf(path) {
        findings.model(files, path)?;
    } else if name_of(path).to_ascii_lowercase().ends_with(".kinran.json") {
        findings.report(files, path, &bytes);
    } else {
        let reason = "is nothing that is checked; give a .ktx2, .dds, .gltf, .glb or a report (.kinran.json)";
        return Err(kinran_image::Error::malformed(path, reason).into());
    }
    Ok(findings.0)
}

/// Of a vector of length one the square of what normal maps keep may be so much above one, as blocks and rounding leave it;
/// chosen by eye: BC5 of sharp maps ends at 1.04.
const LONG: f32 = 1.1;

struct Findings(Checked);

impl Findings {
    fn add(&mut self, place: &str, problem: impl Into<String>) {
        self.0.findings.push(Finding { place: place.into(), problem: problem.into() });
    }

    /// A texture's file; `slot` says what it should hold where a model uses it. Gives its texture where it can be read.
    fn texture_file(
        &mut self,
        place: &str,
        path: &Path,
        bytes: &[u8],
        slot: Option<&[Content]>,
    ) -> Option<Texture> {
        self.0.looked_at += 1;
        match decode_texture(path, bytes) {
            Ok(texture) => {
                let is_dds = bytes.starts_with(b"DDS ");
                if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("dds")) != is_dds {
                    let [kind, end] = if is_dds { ["DDS", ".dds"] } else { ["KTX2", ".ktx2"] };
                    self.add(place, format!("holds {kind}; its name must end in {end}"));
                }
                self.texture(place, &texture, slot);
                Some(texture)
            }
            Err(kinran_image::Error::Malformed { reason, .. }) => {
                self.add(place, reason);
                None
            }
            Err(error) => {
                self.add(place, error.to_string());
                None
            }
        }
    }

    fn texture(&mut self, place: &str, texture: &Texture, slot: Option<&[Content]>) {
        let content = match texture.metadata.get(Content::KEY).map(|name| (name, Content::named(name))) {
            Some((name, None)) => {
                self.add(place, format!("key {}: \"{name}\" is no map that is known", Content::KEY));
                return;
            }
            Some((_, Some(content))) => content,
            None => slot.and_then(<[Content]>::first).copied().unwrap_or(Content::suggested(texture)),
        };
        if let Some(wanted) = slot.filter(|wanted| !wanted.contains(&content)) {
            let wanted: Vec<&str> = wanted.iter().map(|content| content.name()).collect();
            self.add(place, format!("holds {} and stands for {}", content.name(), wanted.join(" or ")));
        }
        if let Some(filter) = texture.metadata.get("KinranFilter")
            && !Filter::ALL.iter().any(|known| known.name() == filter)
        {
            self.add(place, format!("key KinranFilter: \"{filter}\" is no filter that is known"));
        }

        let (width, height) = (texture.levels[0].width, texture.levels[0].height);
        let is_table =
            matches!(content, Content::SkinPunctual | Content::SkinAmbient | Content::SkinPenumbra);
        let (found, wanted) =
            (texture.levels.len(), if is_table { 1 } else { full_level_count(width, height) });
        // DDS files have no keys: a single level may be a table.
        let may_be_table = slot.is_none() && !texture.metadata.contains_key(Content::KEY) && found == 1;
        if found != wanted && !may_be_table {
            self.add(place, format!("has {found} levels; {width}x{height} texels want {wanted}"));
        }
        if is_table {
            let range = texture.metadata.get("KinranRange").map(|range| (range, range.parse::<f32>()));
            match range {
                Some((_, Ok(range))) if range > 0.0 && range.is_finite() => {}
                Some((range, _)) => self.add(place, format!("key KinranRange: {range} is not above zero")),
                None => self.add(place, "has no key KinranRange, so that no curvature finds its row"),
            }
        }
        let channels = match content {
            Content::Data | Content::Mask | Content::Synthesized | Content::Detail => 1,
            Content::Normal | Content::Roughness => 2,
            _ => 3,
        };
        if texture.format.channels() < channels {
            let (format, content) = (texture.format.name(), content.name());
            self.add(place, format!("{format} has too few channels for {content}, which needs {channels}"));
            return;
        }
        let is_color =
            matches!(content, Content::Color | Content::SpecularColor) && texture.format.has_srgb();
        if texture.transfer == Transfer::Srgb && !is_color && !is_table && !blended(content) {
            self.add(place, format!("{} is marked as sRGB; it is linear", content.name()));
        }
        if is_color && texture.transfer == Transfer::Linear {
            self.add(place, "colour is marked as linear; it is sRGB");
        }
        self.texels(place, texture, content);
    }

    fn texels(&mut self, place: &str, texture: &Texture, content: Content) {
        let looks_at = content == Content::Normal || texture.format == Format::Rgba16F;
        for level in (0..texture.levels.len()).filter(|_| looks_at) {
            let place = format!("{place}, level {level}");
            let texels = match texture.decode_level(level) {
                Ok(texels) => texels,
                Err(error) => return self.add(&place, error.to_string()),
            };
            let odd = texels.iter().filter(|texel| texel.iter().any(|x| !x.is_finite())).count();
            if odd > 0 {
                self.add(&place, format!("{odd} of {} texels are not finite", texels.len()));
            }
            let square = |texel: &&[f32; 4]| {
                let [x, y] = [texel[0], texel[1]].map(|code| 2.0 * code - 1.0);
                x * x + y * y
            };
            if content == Content::Normal {
                let long = texels.iter().filter(|texel| square(texel) > LONG).count();
                if long > 0 {
                    self.add(&place, format!("{long} of {} normals are longer than one", texels.len()));
                }
            }
        }
    }

    fn model(&mut self, files: &dyn Files, path: &Path) -> Result<(), Error> {
        let name = name_of(path);
        let document = match Document::open_in(files, path, &[]) {
            Err(error) => {
                self.add(&name, error.to_string());
                return Ok(());
            }
            Ok(document) => document,
        };
        if let Err(error) = Scene::load_in(files, path, &[], &Needs::ALL, &|_| {}, &untold) {
            self.add(&name, error.to_string());
        }
        self.extensions(&name, document.json());
        let slots: [(Slot, &str, &[Content]); 9] = [
            (Slot::Normal, "normalTexture", &[Content::Normal]),
            (Slot::MetallicRoughness, "metallicRoughnessTexture", &[Content::Roughness, Content::Orm]),
            (Slot::Anisotropy, "anisotropyTexture", &[Content::Anisotropy]),
            (Slot::Aniso, "anisoTexture", &[Content::Aniso]),
            (Slot::BaseColor, "baseColorTexture", &[Content::Color]),
            (Slot::Emissive, "emissiveTexture", &[Content::Color]),
            (Slot::Occlusion, "occlusionTexture", &[Content::Data, Content::Orm, Content::Roughness]),
            (Slot::SpecularColor, "specularColorTexture", &[Content::SpecularColor, Content::Color]),
            (Slot::ClearcoatNormal, "clearcoatNormalTexture", &[Content::Normal]),
        ];
        for material in 0..document.material_count() {
            for (slot, member, wanted) in slots {
                let place = format!("material {material}, {member}");
                self.slot(&document, &place, document.texture(material, slot), wanted);
            }
        }
        let meshes = document.json().get("meshes").and_then(Value::as_array).into_iter().flatten();
        for (m, mesh) in meshes.enumerate() {
            let primitives = mesh.get("primitives").and_then(Value::as_array).into_iter().flatten();
            for (p, primitive) in primitives.enumerate() {
                self.curvature(&document, &format!("mesh {m}, primitive {p}"), primitive);
            }
        }
        Ok(())
    }

    /// Extensions that parts of the document have and the document does not list, and such of ours as it requires.
    fn extensions(&mut self, name: &str, json: &Object) {
        fn walk(value: &Value, found: &mut Vec<String>) {
            match value {
                Value::Object(object) => {
                    let own = object.get("extensions").and_then(Value::as_object);
                    found.extend(own.into_iter().flat_map(|own| own.keys().cloned()));
                    // What tools keep in extras is theirs.
                    object.iter().filter(|(key, _)| *key != "extras").for_each(|(_, v)| walk(v, found));
                }
                Value::Array(list) => list.iter().for_each(|value| walk(value, found)),
                _ => {}
            }
        }
        let listed = |list: &str| -> Vec<&str> {
            let names = json.get(list).and_then(Value::as_array).into_iter().flatten();
            names.filter_map(Value::as_str).collect()
        };
        let mut found = Vec::new();
        walk(&Value::Object(json.clone()), &mut found);
        found.sort();
        found.dedup();
        self.0.looked_at += found.iter().filter(|extension| extension.starts_with("KINRAN_")).count();
        let used = listed("extensionsUsed");
        for extension in found.iter().filter(|extension| !used.contains(&extension.as_str())) {
            self.add(name, format!("{extension} is used, and not listed in extensionsUsed"));
        }
        for extension in listed("extensionsRequired").into_iter().filter(|e| e.starts_with("KINRAN_")) {
            self.add(name, format!("{extension} is required, so that other viewers refuse the whole file"));
        }
    }

    /// The textures with mips that a slot has.
    fn slot(&mut self, document: &Document, place: &str, texture: Option<usize>, wanted: &[Content]) {
        let Some(index) = texture else { return };
        let texture = document.json().get("textures").and_then(|textures| textures.get(index));
        let Some(texture) = texture else {
            return self.add(place, format!("texture {index} does not exist"));
        };
        let plain = texture.get("source").and_then(Value::as_u64);
        let plain = plain.and_then(|image| Some((image, document.image_bytes(image as usize).ok()?)));
        for (extension, end) in [(TextureExtension::Ktx2, "ktx2"), (TextureExtension::Dds, "dds")] {
            let extension = extension.name();
            let source = texture.get("extensions").and_then(|e| e.get(extension)?.get("source")?.as_u64());
            let Some(image) = source.map(|source| source as usize) else { continue };
            let place = format!("{place}, {}", document.image_name(image));
            let bytes = match document.image_bytes(image) {
                Ok(bytes) => bytes,
                Err(error) => {
                    self.add(&place, error.to_string());
                    continue;
                }
            };
            // Names of images are without the end of their file, which an image in a buffer has none of.
            let images = document.json().get("images").and_then(|images| images.get(image));
            let uri =
                images.and_then(|image| image.get("uri")?.as_str()).filter(|uri| !uri.starts_with("data:"));
            let end = uri.and_then(|uri| uri.rsplit_once('.')).map_or(end, |(_, end)| end);
            let path = document.path().with_file_name(format!("{}.{end}", document.image_name(image)));
            let Some(texture) = self.texture_file(&place, &path, &bytes, Some(wanted)) else { continue };
            let size = (texture.levels[0].width, texture.levels[0].height);
            if let Some((fallback, bytes)) = &plain
                // Maps that are filtered together take the largest size of all.
                && let Some(seen) = image_size_of(bytes).filter(|seen| seen.0 > size.0 || seen.1 > size.1)
            {
                let [size, seen] = [size, seen].map(|(width, height)| format!("{width}x{height}"));
                self.add(
                    &place,
                    format!("is {size}, and image {fallback}, which others see, is larger: {seen}"),
                );
            }
        }
    }

    fn curvature(&mut self, document: &Document, place: &str, primitive: &Value) {
        let accessor = |name: &str| {
            let index = primitive.get("attributes")?.get(name)?.as_u64()?;
            document.json().get("accessors")?.get(index as usize)
        };
        let meaning = primitive.get("extensions").and_then(|e| e.get("KINRAN_mesh_curvature"));
        let (Some(codes), Some(meaning)) = (accessor("_CURVATURE"), meaning) else {
            match (accessor("_CURVATURE"), meaning) {
                (Some(_), None) => {
                    self.add(place, "_CURVATURE has no KINRAN_mesh_curvature, which gives its range")
                }
                (None, Some(_)) => self.add(place, "KINRAN_mesh_curvature has no _CURVATURE"),
                _ => {}
            }
            return;
        };
        for (member, wanted) in
            [("componentType", Value::from(5121)), ("type", "VEC4".into()), ("normalized", true.into())]
        {
            let found = codes.get(member).unwrap_or(&Value::Null);
            if *found != wanted {
                self.add(place, format!("_CURVATURE: {member} is {found}; it must be {wanted}"));
            }
        }
        for name in ["range", "millimetres"] {
            let value = meaning.get(name).and_then(Value::as_f64);
            if !value.is_some_and(|value| value > 0.0 && value.is_finite()) {
                self.add(place, format!("KINRAN_mesh_curvature: {name} is not a number above zero"));
            }
        }
        if accessor("TANGENT").is_none() {
            self.add(place, "_CURVATURE has no TANGENT, in whose frame its directions are");
        }
    }

    fn report(&mut self, files: &dyn Files, path: &Path, bytes: &[u8]) {
        let name = name_of(path);
        let json: Value = match serde_json::from_slice(bytes) {
            Ok(json) => json,
            Err(error) => return self.add(&name, format!("is no JSON: {error}")),
        };
        let known: KnownFiles = match serde_json::from_value(json.clone()) {
            Ok(known) => known,
            Err(error) => return self.add(&name, format!("names no files that were written: {error}")),
        };
        for file in known.files() {
            self.0.looked_at += 1;
            if relative(&file.file).is_none() {
                self.add(&name, format!("\"{}\" leads out of its folder", file.file));
                continue;
            }
            match files.read(&path.with_file_name(&file.file)) {
                Err(error) => self.add(&file.file, kinran_image::io_reason(&error)),
                Ok(now) if WrittenFile::new(&*file.file, &now) != file => {
                    self.add(&file.file, "was changed since it was written");
                }
                Ok(_) => {}
            }
        }
        let surfaces = json.get("surfaces").and_then(Value::as_array).into_iter().flatten();
        let outputs = surfaces.filter_map(|surface| surface.get("outputs")?.as_array()).flatten();
        for output in outputs {
            let Some(file) = output.get("file").and_then(Value::as_str) else {
                self.add(&name, "an output of a surface has no file");
                continue;
            };
            if relative(file).is_none() {
                self.add(&name, format!("\"{file}\" leads out of its folder"));
                continue;
            }
            let path = path.with_file_name(file);
            let Ok(bytes) = files.read(&path) else { continue };
            let Some(texture) = self.texture_file(file, &path, &bytes, None) else { continue };
            let level = &texture.levels[0];
            let transfer = if texture.transfer == Transfer::Srgb { "srgb" } else { "linear" };
            let found: [(&str, Value); 5] = [
                ("format", texture.format.name().into()),
                ("transfer", transfer.into()),
                ("width", level.width.into()),
                ("height", level.height.into()),
                ("levels", texture.levels.len().into()),
            ];
            for (member, found) in found {
                let said = output.get(member).unwrap_or(&Value::Null);
                if *said != found {
                    self.add(file, format!("{member}: it has {found}, and {name} says {said}"));
                }
            }
            let held = texture.metadata.get(Content::KEY).map(String::as_str);
            let said = output.get("map").and_then(Value::as_str);
            if held.is_some() && held != said {
                let [held, said] = [held, said].map(|map| map.unwrap_or("nothing"));
                self.add(file, format!("it holds {held}, and {name} says {said}"));
            }
        }
    }
}

/// Whether a map is blended over or under others and may hold anything.
fn blended(content: Content) -> bool {
    matches!(content, Content::Synthesized | Content::Detail)
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
