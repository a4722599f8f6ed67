//! A glTF document as JSON and bytes, for tools that replace its textures and keep everything else.

mod mesh;

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use kinran_image::{Disk, Files, untold, write_atomically};
use percent_encoding::{AsciiSet, CONTROLS, percent_encode};
use serde_json::{Map, Value, json};

use crate::Error;
use crate::compressed::{decompress, is_compressed};
use crate::container::{Purpose, Refusal, Target, beside, fetch, folder_of, join, locate, parse_uri, split};
use crate::load::WEBP;

pub use mesh::Attribute;

/// A JSON object.
pub type Object = Map<String, Value>;

/// A place for a texture in a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Slot {
    /// `pbrMetallicRoughness.baseColorTexture`.
    BaseColor,
    /// `pbrMetallicRoughness.metallicRoughnessTexture`.
    MetallicRoughness,
    /// `normalTexture`.
    Normal,
    /// `occlusionTexture`.
    Occlusion,
    /// `emissiveTexture`.
    Emissive,
    /// `anisotropyTexture` of `KHR_materials_anisotropy`.
    Anisotropy,
    /// `specularColorTexture` of `KHR_materials_specular`.
    SpecularColor,
    /// `clearcoatNormalTexture` of `KHR_materials_clearcoat`.
    ClearcoatNormal,
    /// `anisoTexture` of `KINRAN_materials_aniso`.
    Aniso,
}

impl Slot {
    /// The objects on the way from the material, and the texture's own name.
    fn keys(self) -> (&'static [&'static str], &'static str) {
        match self {
            Slot::BaseColor => (&["pbrMetallicRoughness"], "baseColorTexture"),
            Slot::MetallicRoughness => (&["pbrMetallicRoughness"], "metallicRoughnessTexture"),
            Slot::Normal => (&[], "normalTexture"),
            Slot::Occlusion => (&[], "occlusionTexture"),
            Slot::Emissive => (&[], "emissiveTexture"),
            Slot::Anisotropy => (&["extensions", "KHR_materials_anisotropy"], "anisotropyTexture"),
            Slot::SpecularColor => (&["extensions", "KHR_materials_specular"], "specularColorTexture"),
            Slot::ClearcoatNormal => (&["extensions", "KHR_materials_clearcoat"], "clearcoatNormalTexture"),
            Slot::Aniso => (&["extensions", "KINRAN_materials_aniso"], "anisoTexture"),
        }
    }
}

/// A way to say that a texture has another image than PNG or JPEG.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum TextureExtension {
    /// `KHR_texture_basisu` with a KTX2 image.
    Ktx2,
    /// `MSFT_texture_dds` with a DDS image.
    Dds,
}

impl TextureExtension {
    /// The extension's name.
    pub fn name(self) -> &'static str {
        match self {
            TextureExtension::Ktx2 => "KHR_texture_basisu",
            TextureExtension::Dds => "MSFT_texture_dds",
        }
    }
}

/// Extensions that are known not to refer to images, textures or buffer views other than where this
/// module looks; with any other one present, nothing is renumbered. `KHR_materials_*` and `KINRAN_*` are known too.
const KNOWN_EXTENSIONS: [&str; 19] = [
    "EXT_mesh_gpu_instancing",
    "EXT_mesh_manifold",
    "EXT_meshopt_compression",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "MSFT_texture_dds",
    "MSFT_lod",
];

/// What a URI must percent-encode in a path segment (RFC 3986 section 3.3), `/` left as it is.
const PATH: &AsciiSet = &CONTROLS
    .add(b' ')
    .add(b'"')
    .add(b'#')
    .add(b'%')
    .add(b'<')
    .add(b'>')
    .add(b'?')
    .add(b':')
    .add(b'[')
    .add(b'\\')
    .add(b']')
    .add(b'^')
    .add(b'`')
    .add(b'{')
    .add(b'|')
    .add(b'}');

/// A glTF document: its JSON in the order of the file, and where its bytes are.
///
/// Nothing is lost: members that glTF does not know, extensions and `extras` stay as they are. Indices
/// stay valid until [`Document::write`], which renumbers the copy that it writes.
#[derive(Clone, Debug)]
pub struct Document {
    path: PathBuf,
    /// Where it and what it names are read from.
    source: Arc<dyn Files>,
    /// Folders whose files it may name besides those of its own.
    allowed: Vec<PathBuf>,
    json: Object,
    /// The GLB's binary chunk.
    bin: Option<Vec<u8>>,
    /// The GLB's chunks that glTF does not know, with their types.
    chunks: Vec<([u8; 4], Vec<u8>)>,
    /// Textures and images that the original refers to; only these are dropped once nothing does.
    original_textures: BTreeSet<usize>,
    original_images: BTreeSet<usize>,
    /// Extensions that stood somewhere in the original; only these are no longer listed once they stand nowhere.
    original_extensions: BTreeSet<String>,
    /// Images that [`Document::add_image_file`] has added: the caller writes their files.
    added_images: BTreeSet<usize>,
    /// Buffer, first byte and length of what nothing refers to any more.
    freed: Vec<(usize, usize, usize)>,
    /// Index and bytes of a buffer that [`Document::set_attribute`] or [`Document::decompress`] has added.
    added_buffer: Option<(usize, Vec<u8>)>,
}

impl Document {
    /// Reads a `.gltf` or `.glb`; files that it refers to are read only when they are needed.
    ///
    /// # Errors
    /// One that names the file: missing, truncated, no glTF 2.0, or not shaped as glTF where textures and
    /// buffers are concerned.
    pub fn open(path: impl AsRef<Path>) -> Result<Document, Error> {
        Document::open_allowing(path, &[])
    }

    /// As [`Document::open`]; the document may also name files of these folders.
    ///
    /// # Errors
    /// As [`Document::open`].
    pub fn open_allowing(path: impl AsRef<Path>, allowed: &[PathBuf]) -> Result<Document, Error> {
        Document::open_in(&Disk, path, allowed)
    }

    /// As [`Document::open_allowing`], of files that may be elsewhere than on a disk.
    ///
    /// # Errors
    /// As [`Document::open`].
    pub fn open_in(
        files: &dyn Files,
        path: impl AsRef<Path>,
        allowed: &[PathBuf],
    ) -> Result<Document, Error> {
        let path = path.as_ref();
        let bytes = files.read(path).map_err(|error| Error::io(path, error))?;
        Ok(Document {
            source: files.share(),
            allowed: allowed.to_vec(),
            ..Document::from_bytes(path, &bytes)?
        })
    }

    /// As [`Document::open`], from the bytes of the file `path`, which need not exist as long as nothing
    /// beside it is needed.
    ///
    /// # Errors
    /// As [`Document::open`].
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Document, Error> {
        let container = split(path, bytes)?;
        let mut json: Object = serde_json::from_slice(container.json)
            .map_err(|error| Error::malformed(path, format!("the JSON is damaged: {error}")))?;
        check_shape(path, &json)?;
        let original_textures = used_textures(&mut json);
        let original_images = used_images(&mut json);
        let original_extensions = used_extensions(&json);
        Ok(Document {
            path: path.to_path_buf(),
            source: Arc::new(Disk),
            allowed: Vec::new(),
            json,
            bin: container.bin.map(<[u8]>::to_vec),
            chunks: container.others.iter().map(|(kind, bytes)| (*kind, bytes.to_vec())).collect(),
            original_textures,
            original_images,
            original_extensions,
            added_images: BTreeSet::new(),
            freed: Vec::new(),
            added_buffer: None,
        })
    }

    /// Replaces geometry that is compressed by Draco or meshopt by plain buffer views, so that attributes can be added to it;
    /// whether there was any.
    ///
    /// # Errors
    /// Where a buffer cannot be read or what is compressed is damaged.
    ///
    /// # Panics
    /// After [`Document::set_attribute`].
    pub fn decompress(&mut self) -> Result<bool, Error> {
        assert!(self.added_buffer.is_none(), "geometry is decompressed before attributes are added");
        if !is_compressed(array(&self.json, "extensionsUsed").iter().filter_map(Value::as_str)) {
            return Ok(false);
        }
        let mut json = self.json.clone();
        let plain = decompress(&self.path, &mut json, &|buffer| self.buffer(buffer), &untold)?;
        self.added_buffer = Some((array(&json, "buffers").len() - 1, plain.bytes));
        self.freed = plain.freed;
        self.json = json;
        Ok(true)
    }

    /// The file it was read from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The files that buffers and images are in, each once, as paths that begin with the document's folder; also those
    /// that it may not name, and none that is a device, a pipe or a folder.
    pub fn files(&self) -> Vec<PathBuf> {
        let files: BTreeSet<PathBuf> = self.own_files().into_iter().collect();
        files
            .into_iter()
            .filter(|file| self.source.is_file(file) || self.source.canonical(file).is_err())
            .collect()
    }

    /// Refuses a document that names a file outside of its own folder and of those that are allowed; none is read.
    ///
    /// # Errors
    /// [`Error::Outside`].
    pub fn check_files(&self) -> Result<(), Error> {
        for (list, what) in [("buffers", "buffer"), ("images", "image")] {
            for (i, entry) in array(&self.json, list).iter().enumerate() {
                let uri = entry.get("uri").and_then(Value::as_str).unwrap_or("");
                let Ok(Target::File(file)) = parse_uri(uri) else { continue };
                let located = locate(&*self.source, &folder_of(&self.path), &self.allowed, &file);
                if let Err(Refusal::Outside { folder }) = located {
                    let (path, what) = (self.path.clone(), format!("{what} {i}"));
                    return Err(Error::Outside { path, what, file: file.into_owned(), folder });
                }
            }
        }
        Ok(())
    }

    /// The whole document's JSON.
    pub fn json(&self) -> &Object {
        &self.json
    }

    /// How many materials there are.
    pub fn material_count(&self) -> usize {
        array(&self.json, "materials").len()
    }

    /// A material's JSON.
    ///
    /// # Panics
    /// When there is no such material.
    pub fn material(&self, material: usize) -> &Object {
        array(&self.json, "materials")[material].as_object().expect("check_shape() has seen an object")
    }

    /// A material's JSON, to set its factors.
    ///
    /// # Panics
    /// When there is no such material.
    pub fn material_mut(&mut self, material: usize) -> &mut Object {
        array_mut(&mut self.json, "materials")[material]
            .as_object_mut()
            .expect("check_shape() has seen an object")
    }

    /// The texture in a material's slot.
    ///
    /// # Panics
    /// When there is no such material.
    pub fn texture(&self, material: usize, slot: Slot) -> Option<usize> {
        let (path, key) = slot.keys();
        let mut object = self.material(material);
        for step in path {
            object = object.get(*step)?.as_object()?;
        }
        index(object.get(key)?.get("index")?)
    }

    /// A texture's PNG or JPEG image; where it has none, that of `EXT_texture_webp` or of an extension in
    /// [`TextureExtension`].
    pub fn texture_image(&self, texture: usize) -> Option<usize> {
        self.texture_source(texture).or_else(|| {
            let extensions = array(&self.json, "textures").get(texture)?.get("extensions")?;
            let names = [TextureExtension::Ktx2.name(), TextureExtension::Dds.name()];
            names.iter().find_map(|name| index(extensions.get(name)?.get("source")?))
        })
    }

    /// A texture's PNG or JPEG image; where it has none, that of `EXT_texture_webp`.
    pub fn texture_source(&self, texture: usize) -> Option<usize> {
        let texture = array(&self.json, "textures").get(texture)?;
        let webp = || index(texture.get("extensions")?.get(WEBP)?.get("source")?);
        texture.get("source").and_then(index).or_else(webp)
    }

    /// How a person would call an image: its file's name without folder and extension, or its `name`, or
    /// `image N`.
    pub fn image_name(&self, image: usize) -> String {
        let entry = array(&self.json, "images").get(image);
        let text = |key: &str| entry.and_then(|entry| entry.get(key)).and_then(Value::as_str);
        let stem = text("uri").and_then(|uri| match parse_uri(uri) {
            Ok(Target::File(path)) => Path::new(&*path).file_stem()?.to_str().map(str::to_owned),
            _ => None,
        });
        stem.or_else(|| text("name").filter(|name| !name.is_empty()).map(str::to_owned))
            .unwrap_or_else(|| format!("image {image}"))
    }

    /// An image file's bytes, from the document or from the file that it names.
    ///
    /// # Errors
    /// When there is no such image, when its buffer view points nowhere, or when its file cannot be read.
    pub fn image_bytes(&self, image: usize) -> Result<Cow<'_, [u8]>, Error> {
        let what = format!("image {image}");
        let entry = array(&self.json, "images")
            .get(image)
            .ok_or_else(|| Error::malformed(&self.path, format!("{what} does not exist")))?;
        if let Some(uri) = entry.get("uri").and_then(Value::as_str) {
            return self.fetch(uri, &what, Purpose::Image).map(Cow::Owned);
        }
        let view = entry
            .get("bufferView")
            .and_then(index)
            .and_then(|view| View::read(array(&self.json, "bufferViews").get(view)?))
            .ok_or_else(|| {
                Error::malformed(&self.path, format!("{what} has neither a uri nor a valid bufferView"))
            })?;
        let bytes = self.buffer(view.buffer)?;
        let range = view.offset..view.offset.saturating_add(view.length);
        let missing = || {
            Error::malformed(
                &self.path,
                format!(
                    "{what} claims bytes {range:?} of buffer {}, which has {} bytes",
                    view.buffer,
                    bytes.len()
                ),
            )
        };
        match &bytes {
            Cow::Borrowed(bytes) => bytes.get(range.clone()).map(Cow::Borrowed).ok_or_else(missing),
            Cow::Owned(bytes) => bytes.get(range.clone()).map(|b| Cow::Owned(b.to_vec())).ok_or_else(missing),
        }
    }

    /// Adds an image in a file that the caller writes beside the output; `path` is relative to it,
    /// `/`-separated and not yet percent-encoded. The same path is added once. Its media type is left to the
    /// file's name, as in the extensions' own examples.
    pub fn add_image_file(&mut self, path: &str) -> usize {
        let uri = percent_encode(path.as_bytes(), PATH).to_string();
        let images = array_mut(&mut self.json, "images");
        let known = images.iter().position(|image| image.get("uri").is_some_and(|known| *known == uri));
        if let Some(image) = known.filter(|image| self.added_images.contains(image)) {
            return image;
        }
        images.push(json!({ "uri": uri }));
        self.added_images.insert(images.len() - 1);
        images.len() - 1
    }

    /// Adds a texture with the PNG or JPEG image `source`, alternatives by extension, and the sampler, the
    /// name and the `extras` of the texture `like`.
    ///
    /// Without a `source` the extensions are required of every reader.
    ///
    /// # Panics
    /// When neither `source` nor `alternatives` has an image, or an image does not exist.
    pub fn add_texture(
        &mut self,
        like: Option<usize>,
        source: Option<usize>,
        alternatives: &[(TextureExtension, usize)],
    ) -> usize {
        if source.is_none() {
            alternatives.iter().for_each(|(extension, _)| self.use_extension(extension.name(), true));
        }
        self.push_texture(like, source, alternatives)
    }

    /// Adds a texture as [`Self::add_texture`] does that has no PNG or JPEG and that only a material's extension is going to
    /// refer to, so that readers which do not know that one need not read it.
    ///
    /// # Panics
    /// As [`Self::add_texture`].
    pub fn add_optional_texture(
        &mut self,
        like: Option<usize>,
        alternatives: &[(TextureExtension, usize)],
    ) -> usize {
        self.push_texture(like, None, alternatives)
    }

    fn push_texture(
        &mut self,
        like: Option<usize>,
        source: Option<usize>,
        alternatives: &[(TextureExtension, usize)],
    ) -> usize {
        let images = array(&self.json, "images").len();
        assert!(source.is_some() || !alternatives.is_empty(), "a texture needs an image");
        assert!(
            source.iter().chain(alternatives.iter().map(|(_, image)| image)).all(|&image| image < images),
            "a texture's image does not exist"
        );
        let old =
            like.and_then(|texture| array(&self.json, "textures").get(texture)).and_then(Value::as_object);
        let mut texture = Object::new();
        for key in ["name", "sampler", "extras"] {
            if let Some(value) = old.and_then(|old| old.get(key)) {
                texture.insert(key.into(), value.clone());
            }
        }
        let mut extensions = Object::new();
        if let Some(source) = source {
            // A WebP stands in its extension's place.
            let webp = old.and_then(|old| old.get("extensions")?.get(WEBP));
            match webp.filter(|webp| webp.get("source").and_then(index) == Some(source)) {
                Some(webp) => extensions.insert(WEBP.into(), webp.clone()),
                None => texture.insert("source".into(), source.into()),
            };
        }
        for (extension, image) in alternatives {
            extensions.insert(extension.name().into(), json!({ "source": image }));
            self.use_extension(extension.name(), false);
        }
        if !extensions.is_empty() {
            texture.insert("extensions".into(), extensions.into());
        }
        let textures = array_mut(&mut self.json, "textures");
        textures.push(texture.into());
        textures.len() - 1
    }

    /// Puts a texture into a material's slot; `texCoord`, `KHR_texture_transform`, `scale` and `strength`
    /// of the texture that was there stay.
    ///
    /// # Panics
    /// When the material or the texture does not exist.
    pub fn set_texture(&mut self, material: usize, slot: Slot, texture: usize) {
        assert!(texture < array(&self.json, "textures").len(), "texture {texture} does not exist");
        let (path, key) = slot.keys();
        if let ["extensions", extension] = path {
            self.use_extension(extension, false);
        }
        let mut object = self.material_mut(material);
        for step in path {
            object = object_mut(object, step);
        }
        object_mut(object, key).insert("index".into(), texture.into());
    }

    /// Lists an extension in `extensionsUsed`, and in `extensionsRequired` when asked to.
    pub fn use_extension(&mut self, name: &str, required: bool) {
        let lists =
            if required { &["extensionsUsed", "extensionsRequired"][..] } else { &["extensionsUsed"] };
        for list in lists {
            let list = array_mut(&mut self.json, list);
            if !list.iter().any(|known| known == name) {
                list.push(name.into());
            }
        }
    }

    /// Writes the document as `.glb` (or `.vrm`, which is one) or `.gltf`, told by the extension of `path`.
    ///
    /// Textures and images that the original referred to and nothing refers to any more are dropped,
    /// with their bytes. In a `.glb` all buffers become the binary chunk; a `.gltf` that was a GLB, or that
    /// has lost images from its buffers, gets `<name>.bin` beside it. Images stay where they are: in a
    /// buffer, or in files, which are copied beside the output when that is in another folder. Every file
    /// appears whole or not at all, the document last.
    ///
    /// The returned sentences say what could not be cleaned up, which is so when an extension may hold
    /// indices that this function does not know of, and which image files could not be copied.
    ///
    /// # Errors
    /// When a file cannot be read or written, when `path` has another extension, or when it or a copy would
    /// overwrite a file that the document was read from.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<Vec<String>, Error> {
        let packed = self.pack(path)?;
        packed.write()?;
        Ok(packed.warnings)
    }

    /// What [`Document::write`] writes; nothing is written yet.
    ///
    /// # Errors
    /// As [`Document::write`], but for what cannot be written.
    pub fn pack(&self, path: impl AsRef<Path>) -> Result<Packed, Error> {
        self.pack_to(path.as_ref(), true)
    }

    /// As [`Document::pack`], for files that go to no disk: `path` is a name, and nothing can be in their way.
    ///
    /// # Errors
    /// As [`Document::pack`].
    pub fn pack_in_memory(&self, path: impl AsRef<Path>) -> Result<Packed, Error> {
        self.pack_to(path.as_ref(), false)
    }

    fn pack_to(&self, path: &Path, on_disk: bool) -> Result<Packed, Error> {
        let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        let glb = match extension.as_deref() {
            Some("glb" | "vrm") => true,
            Some("gltf") => false,
            _ => {
                let reason = "the output's name must end in .glb, .vrm or .gltf, which decides its format";
                return Err(Error::unsupported(path, reason));
            }
        };
        if on_disk && self.is_at(&self.path, path) {
            return Err(Error::unsupported(
                path,
                "is the document that was read; write to another name, so that the original stays",
            ));
        }

        let (json, files) = (self.json.clone(), BTreeMap::new());
        let mut output = Output { json, on_disk, files, warnings: Vec::new() };
        if !glb && !self.chunks.is_empty() {
            let kinds = self.chunks.iter().map(|(kind, _)| String::from_utf8_lossy(kind).into_owned());
            output.warnings.push(format!(
                "chunks of the GLB that a .gltf has no place for were left out: {}",
                kinds.collect::<Vec<_>>().join(", ")
            ));
        }
        let mut dropped_views = self.drop_unused(&mut output);
        for &(buffer, start, length) in &self.freed {
            dropped_views.entry(buffer).or_default().push((start, start.saturating_add(length)));
        }
        self.drop_extensions(&mut output.json);
        let bin = self.place_buffers(path, glb, &dropped_views, &mut output)?;
        self.place_images(path, &mut output)?;

        let encoded =
            if glb { serde_json::to_vec(&output.json) } else { serde_json::to_vec_pretty(&output.json) };
        let encoded = encoded
            .map_err(|error| Error::malformed(path, format!("the JSON cannot be written: {error}")))?;
        let bytes = if glb { join(path, &encoded, &bin, &self.chunks)? } else { encoded };
        let mut files: Vec<(PathBuf, Vec<u8>)> = output.files.into_iter().collect();
        files.push((path.to_path_buf(), bytes));
        Ok(Packed { files, warnings: output.warnings })
    }

    /// Drops what nothing refers to any more; gives the byte ranges, by buffer, that only dropped images
    /// used.
    fn drop_unused(&self, output: &mut Output) -> BTreeMap<usize, Vec<(usize, usize)>> {
        let none = BTreeMap::new();
        let used = used_textures(&mut output.json);
        let textures: BTreeSet<usize> = self.original_textures.difference(&used).copied().collect();
        let unknown: Vec<&str> = array(&output.json, "extensionsUsed")
            .iter()
            .filter_map(Value::as_str)
            .filter(|name| !KNOWN_EXTENSIONS.contains(name))
            .filter(|name| !name.starts_with("KHR_materials_") && !name.starts_with("KINRAN_"))
            .collect();
        if !unknown.is_empty() {
            if !textures.is_empty() {
                output.warnings.push(format!(
                    "replaced images stay in the document, because extensions that may refer to them are not known: {}",
                    unknown.join(", ")
                ));
            }
            return none;
        }

        let renumbered = remove(&mut output.json, "textures", &textures);
        for_each_texture_info(&mut output.json, &mut |info| renumber(info, "index", &renumbered));

        let used = used_images(&mut output.json);
        let images: BTreeSet<usize> = self.original_images.difference(&used).copied().collect();
        let views: BTreeSet<usize> = images
            .iter()
            .filter_map(|&image| index(array(&output.json, "images").get(image)?.get("bufferView")?))
            .collect();
        let renumbered = remove(&mut output.json, "images", &images);
        for_each_image_index(&mut output.json, &mut |holder| renumber(holder, "source", &renumbered));

        let used = used_views(&mut output.json);
        let views: BTreeSet<usize> = views.difference(&used).copied().collect();
        let has_extensions =
            |list: &str| array(&output.json, list).iter().any(|e| e.get("extensions").is_some());
        if !views.is_empty() && (has_extensions("bufferViews") || has_extensions("buffers")) {
            output.warnings.push(
                "the bytes of replaced images stay in the buffers, because buffer views carry extensions"
                    .into(),
            );
            return none;
        }
        let mut ranges = none;
        for &view in &views {
            if let Some(view) = array(&output.json, "bufferViews").get(view).and_then(View::read) {
                ranges
                    .entry(view.buffer)
                    .or_insert_with(Vec::new)
                    .push((view.offset, view.offset.saturating_add(view.length)));
            }
        }
        let renumbered = remove(&mut output.json, "bufferViews", &views);
        for_each_view_index(&mut output.json, &mut |holder| renumber(holder, "bufferView", &renumbered));
        ranges
    }

    /// Takes extensions that stood in the original and stand nowhere now from the lists of what is used and required, and,
    /// where images were added, those of textures that all have a PNG or JPEG from the latter.
    fn drop_extensions(&self, json: &mut Object) {
        let used = used_extensions(json);
        let optional: Vec<&str> = [WEBP, TextureExtension::Ktx2.name(), TextureExtension::Dds.name()]
            .into_iter()
            .filter(|name| {
                let is_there =
                    |texture: &Value| texture.get("extensions").is_some_and(|e| e.get(name).is_some());
                let textures = array(json, "textures").iter().filter(|texture| is_there(texture));
                !self.added_images.is_empty()
                    && textures.clone().all(|texture| texture.get("source").is_some())
            })
            .collect();
        let is_gone = |name: &Value, list: &str| {
            name.as_str().is_some_and(|name| {
                self.original_extensions.contains(name) && !used.contains(name)
                    || list == "extensionsRequired" && used.contains(name) && optional.contains(&name)
            })
        };
        for list in ["extensionsUsed", "extensionsRequired"] {
            let gone = |name: &Value| is_gone(name, list);
            if !array(json, list).iter().any(gone) {
                continue;
            }
            array_mut(json, list).retain(|name| !gone(name));
            if array(json, list).is_empty() {
                json.shift_remove(list);
            }
        }
    }

    /// Cuts dropped bytes out of the buffers and decides where each buffer goes; gives the binary chunk.
    fn place_buffers(
        &self,
        path: &Path,
        glb: bool,
        dropped: &BTreeMap<usize, Vec<(usize, usize)>>,
        output: &mut Output,
    ) -> Result<Vec<u8>, Error> {
        let has_extensions =
            |list: &str| array(&output.json, list).iter().any(|e| e.get("extensions").is_some());
        let may_move = !has_extensions("bufferViews") && !has_extensions("buffers");
        let count = array(&output.json, "buffers").len();
        let mut bin = Vec::new();
        for buffer in 0..count {
            let uri =
                array(&output.json, "buffers")[buffer].get("uri").and_then(Value::as_str).map(str::to_owned);
            let added = self.added_buffer.as_ref().is_some_and(|(added, _)| *added == buffer);
            let in_bin = added || uri.is_none() && buffer == 0 && self.bin.is_some();
            // Without a uri it is an extension's placeholder.
            if uri.is_none() && !in_bin {
                continue;
            }
            let cuts = self.cuts(buffer, dropped.get(&buffer), &output.json)?;
            let into_chunk = glb && (buffer == 0 || may_move);
            let data_uri = uri.as_ref().is_some_and(|uri| uri.starts_with("data:"));
            if cuts.is_empty() && !into_chunk && !in_bin {
                if let (Some(uri), false) = (&uri, data_uri) {
                    let copied =
                        self.copy(uri, &format!("buffer {buffer}"), Purpose::Buffer, path, output)?;
                    entry_mut(&mut output.json, "buffers", buffer).insert("uri".into(), copied.into());
                }
                continue;
            }

            let kept = cut(&self.buffer(buffer)?, &cuts);
            let base = if into_chunk { bin.len().next_multiple_of(4) } else { 0 };
            for view in array_mut(&mut output.json, "bufferViews") {
                let Some((view, place)) = view.as_object_mut().and_then(|v| Some((View::of(v)?, v))) else {
                    continue;
                };
                if view.buffer != buffer {
                    continue;
                }
                let removed: usize =
                    cuts.iter().filter(|cut| cut.1 <= view.offset).map(|cut| cut.1 - cut.0).sum();
                let offset = (view.offset - removed).saturating_add(base);
                if offset != view.offset {
                    place.insert("byteOffset".into(), offset.into());
                }
                if into_chunk && buffer != 0 {
                    place.insert("buffer".into(), 0.into());
                }
            }
            if into_chunk {
                bin.resize(base, 0);
                bin.extend_from_slice(&kept);
                if buffer == 0 {
                    entry_mut(&mut output.json, "buffers", 0).shift_remove("uri");
                }
                entry_mut(&mut output.json, "buffers", 0).insert("byteLength".into(), bin.len().into());
            } else {
                let name = bin_name(path, buffer);
                let place = entry_mut(&mut output.json, "buffers", buffer);
                place.insert("byteLength".into(), kept.len().into());
                place.insert("uri".into(), percent_encode(name.as_bytes(), PATH).to_string().into());
                self.emit(path.with_file_name(&name), kept, output)?;
            }
        }
        if glb && may_move && count > 1 {
            array_mut(&mut output.json, "buffers").truncate(1);
        }
        Ok(bin)
    }

    /// The parts of a buffer that only dropped views used, as whole groups of four bytes, so that
    /// everything behind them keeps its alignment.
    fn cuts(
        &self,
        buffer: usize,
        dropped: Option<&Vec<(usize, usize)>>,
        json: &Object,
    ) -> Result<Vec<(usize, usize)>, Error> {
        let Some(dropped) = dropped else { return Ok(Vec::new()) };
        let length = self.buffer(buffer)?.len();
        let mut kept: Vec<(usize, usize)> = array(json, "bufferViews")
            .iter()
            .filter_map(View::read)
            .filter(|view| view.buffer == buffer)
            .map(|view| (view.offset, view.offset.saturating_add(view.length)))
            .collect();
        kept.sort_unstable();
        let mut dropped = dropped.clone();
        dropped.sort_unstable();

        let (mut cuts, mut kept, mut at) = (Vec::new(), kept.into_iter().peekable(), 0);
        for (start, end) in dropped {
            let mut start = start.max(at);
            let end = end.min(length);
            while start < end {
                while kept.next_if(|&(_, kept_end)| kept_end <= start).is_some() {}
                let (kept_start, kept_end) = kept.peek().copied().unwrap_or((usize::MAX, usize::MAX));
                let free = (start.next_multiple_of(4), end.min(kept_start) / 4 * 4);
                if free.0 < free.1 {
                    cuts.push(free);
                }
                start = if kept_start < end { kept_end.max(start + 1) } else { end };
            }
            at = at.max(end);
        }
        Ok(cuts)
    }

    /// Copies the image files that the document still uses beside the output.
    fn place_images(&self, path: &Path, output: &mut Output) -> Result<(), Error> {
        let added: BTreeSet<String> = self
            .added_images
            .iter()
            .filter_map(|&image| array(&self.json, "images")[image].get("uri")?.as_str().map(str::to_owned))
            .collect();
        let uris = |image: &Value| image.get("uri").and_then(Value::as_str).map(str::to_owned);
        let mut left: Vec<String> = array(&output.json, "images").iter().filter_map(uris).collect();
        left.sort_unstable();
        if let Some(twice) = left.windows(2).find(|pair| pair[0] == pair[1] && added.contains(&pair[0])) {
            return Err(Error::unsupported(
                path,
                format!("the new image \"{}\" has the name of one that the document still uses", twice[0]),
            ));
        }
        for image in 0..array(&output.json, "images").len() {
            let uri =
                array(&output.json, "images")[image].get("uri").and_then(Value::as_str).map(str::to_owned);
            let Some(uri) = uri.filter(|uri| !uri.starts_with("data:") && !added.contains(uri)) else {
                continue;
            };
            match self.copy(&uri, &format!("image {image}"), Purpose::Image, path, output) {
                Ok(copied) => {
                    drop(entry_mut(&mut output.json, "images", image).insert("uri".into(), copied.into()))
                }
                // What is not there was not needed, or there would be an error by now.
                Err(error @ (Error::Malformed { .. } | Error::Unreadable { .. })) => {
                    output.warnings.push(format!("{}; the document still refers to it", error.reason()));
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Plans the copy of a file that the document names; gives its new URI. Paths that leave the document's
    /// folder lose their folders, and get a number where another file has their name.
    fn copy(
        &self,
        uri: &str,
        what: &str,
        purpose: Purpose,
        path: &Path,
        output: &mut Output,
    ) -> Result<String, Error> {
        let relative = match parse_uri(uri) {
            Ok(Target::File(relative)) => relative.into_owned(),
            // Without the file there is nothing to copy; the reference stays as it is.
            Ok(Target::Data(_)) | Err(_) => return Ok(uri.to_owned()),
        };
        let inside =
            Path::new(&relative).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        let folder = path.parent().unwrap_or(Path::new(""));
        if output.on_disk && self.is_at(&self.folder().join("."), &folder.join(".")) {
            return Ok(uri.to_owned());
        }
        let bytes = self.fetch(&uri_of(&relative), what, purpose)?;
        let (target, uri) = if inside {
            let backslash = uri.contains('\\') || uri.to_ascii_lowercase().contains("%5c");
            (folder.join(&relative), if backslash { uri_of(&relative) } else { uri.to_owned() })
        } else {
            let file = Path::new(&relative);
            let name = file.file_name().and_then(|name| name.to_str()).ok_or_else(|| {
                Error::malformed(&self.path, format!("{what}: the URI \"{uri}\" does not name a file"))
            })?;
            let stem = file.file_stem().and_then(|stem| stem.to_str()).unwrap_or(name);
            let end = name.strip_prefix(stem).unwrap_or_default();
            let taken = self.names();
            let numbered = (2..).map(|number| format!("{stem}_{number}{end}"));
            let free = |name: &String| {
                let planned = output.files.get(&folder.join(name));
                planned.map_or(!taken.contains(&name.to_ascii_lowercase()), |planned| *planned == bytes)
            };
            let name = std::iter::once(name.to_owned()).chain(numbered).find(free).unwrap_or_default();
            (folder.join(&name), percent_encode(name.as_bytes(), PATH).to_string())
        };
        self.emit(target, bytes, output)?;
        Ok(uri)
    }

    /// The names in the document's own folder that its images and buffers have, those that were added too, in lower case.
    fn names(&self) -> BTreeSet<String> {
        let uris = ["buffers", "images"].iter().flat_map(|list| array(&self.json, list));
        let files = uris.filter_map(|entry| match parse_uri(entry.get("uri")?.as_str()?) {
            Ok(Target::File(path)) if !path.contains('/') => Some(path.to_ascii_lowercase()),
            _ => None,
        });
        files.collect()
    }

    /// Plans a file; two different contents for one name are refused, and so is a file of the original.
    fn emit(&self, file: PathBuf, bytes: Vec<u8>, output: &mut Output) -> Result<(), Error> {
        let clash = output.files.get(&file).is_some_and(|planned| *planned != bytes);
        let differs = || std::fs::read(&file).is_ok_and(|existing| existing != bytes);
        let original = output.on_disk && differs() && self.names_file(&file);
        if clash || original {
            return Err(Error::unsupported(
                file,
                "would be overwritten with other content while the document needs it; choose another output name or folder",
            ));
        }
        output.files.insert(file, bytes);
        Ok(())
    }

    /// The files that the original document names.
    fn own_files(&self) -> Vec<PathBuf> {
        ["buffers", "images"]
            .iter()
            .flat_map(|list| array(&self.json, list))
            .filter_map(|entry| match parse_uri(entry.get("uri")?.as_str()?) {
                Ok(Target::File(path)) => Some(self.folder().join(&*path)),
                _ => None,
            })
            .collect()
    }

    /// Whether the file at a [`Files::place`] is one that the document names.
    pub fn names_file(&self, there: &Path) -> bool {
        self.own_files().iter().any(|own| self.is_at(own, there))
    }

    /// Whether what the document calls `own` is the file or folder at a place.
    fn is_at(&self, own: &Path, there: &Path) -> bool {
        let there = there.canonicalize().unwrap_or_else(|_| there.to_path_buf());
        self.source.place(own).is_some_and(|place| place == there)
    }

    fn folder(&self) -> PathBuf {
        self.path.parent().map_or_else(PathBuf::new, Path::to_path_buf)
    }

    /// A buffer's bytes, `byteLength` of them.
    fn buffer(&self, buffer: usize) -> Result<Cow<'_, [u8]>, Error> {
        let what = format!("buffer {buffer}");
        let entry = array(&self.json, "buffers")
            .get(buffer)
            .ok_or_else(|| Error::malformed(&self.path, format!("{what} does not exist")))?;
        let length = entry.get("byteLength").and_then(index).unwrap_or(0);
        if let Some((_, bytes)) = self.added_buffer.as_ref().filter(|(added, _)| *added == buffer) {
            return Ok(Cow::Borrowed(bytes));
        }
        let bytes = match (entry.get("uri").and_then(Value::as_str), &self.bin) {
            (Some(uri), _) => Cow::Owned(self.fetch(uri, &what, Purpose::Buffer)?),
            (None, Some(bin)) if buffer == 0 => Cow::Borrowed(bin.as_slice()),
            _ => {
                return Err(Error::malformed(
                    &self.path,
                    format!("{what} has no uri and no GLB chunk to be"),
                ));
            }
        };
        if bytes.len() < length {
            return Err(Error::malformed(
                &self.path,
                format!("{what} claims {length} bytes and there are {}: it is truncated", bytes.len()),
            ));
        }
        Ok(match bytes {
            Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[..length]),
            Cow::Owned(mut bytes) => {
                bytes.truncate(length);
                Cow::Owned(bytes)
            }
        })
    }

    fn fetch(&self, uri: &str, what: &str, purpose: Purpose) -> Result<Vec<u8>, Error> {
        fetch(&self.path, what, purpose, uri, &beside(&*self.source, &self.path, &self.allowed))
    }
}

/// A document and the files beside it, as they are about to be written.
#[derive(Clone, Debug)]
pub struct Packed {
    /// Paths and contents, the document last.
    pub files: Vec<(PathBuf, Vec<u8>)>,
    /// What could not be cleaned up.
    pub warnings: Vec<String>,
}

impl Packed {
    /// Writes the files, each whole or not at all.
    ///
    /// # Errors
    /// When one cannot be written; those before it are.
    pub fn write(&self) -> Result<(), Error> {
        for (i, (file, bytes)) in self.files.iter().enumerate() {
            // The document's own folder is the caller's to make.
            if i + 1 < self.files.len()
                && let Some(folder) = file.parent()
            {
                std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
            }
            write_atomically(file, bytes)?;
        }
        Ok(())
    }
}

/// A document on its way out.
struct Output {
    json: Object,
    /// Whether its files replace what lies on a disk.
    on_disk: bool,
    /// Files beside the document and their content.
    files: BTreeMap<PathBuf, Vec<u8>>,
    warnings: Vec<String>,
}

/// A buffer view's range.
struct View {
    buffer: usize,
    offset: usize,
    length: usize,
}

impl View {
    fn read(value: &Value) -> Option<View> {
        View::of(value.as_object()?)
    }

    fn of(object: &Object) -> Option<View> {
        Some(View {
            buffer: index(object.get("buffer")?)?,
            offset: object.get("byteOffset").map_or(Some(0), index)?,
            length: index(object.get("byteLength")?)?,
        })
    }
}

/// Refuses documents whose lists are not lists of objects, so that nothing after this has to ask.
fn check_shape(path: &Path, json: &Object) -> Result<(), Error> {
    let version = json.get("asset").and_then(|asset| asset.get("version")).and_then(Value::as_str);
    if !version.is_some_and(|version| version.starts_with("2.")) {
        return Err(Error::unsupported(
            path,
            format!("its asset.version is {}; export it as glTF 2.0", version.unwrap_or("missing")),
        ));
    }
    for list in ["materials", "textures", "images", "buffers", "bufferViews", "accessors", "meshes"] {
        let Some(value) = json.get(list) else { continue };
        if !value.as_array().is_some_and(|list| list.iter().all(Value::is_object)) {
            return Err(Error::malformed(path, format!("\"{list}\" is not a list of objects")));
        }
    }
    for list in ["extensionsUsed", "extensionsRequired"] {
        let Some(value) = json.get(list) else { continue };
        if !value.as_array().is_some_and(|list| list.iter().all(Value::is_string)) {
            return Err(Error::malformed(path, format!("\"{list}\" is not a list of names")));
        }
    }
    Ok(())
}

/// A number that can be an index or a size.
fn index(value: &Value) -> Option<usize> {
    usize::try_from(value.as_u64()?).ok()
}

/// A list of the document's root; empty when it is absent.
fn array<'a>(json: &'a Object, list: &str) -> &'a [Value] {
    json.get(list).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn array_mut<'a>(json: &'a mut Object, list: &str) -> &'a mut Vec<Value> {
    let value = json.entry(list).or_insert_with(|| Value::Array(Vec::new()));
    value.as_array_mut().expect("check_shape() has seen an array")
}

fn entry_mut<'a>(json: &'a mut Object, list: &str, index: usize) -> &'a mut Object {
    array_mut(json, list)[index].as_object_mut().expect("check_shape() has seen an object")
}

/// The object under `key`, made where there is none.
fn object_mut<'a>(object: &'a mut Object, key: &str) -> &'a mut Object {
    let value = object.entry(key).or_insert_with(|| Object::new().into());
    if !value.is_object() {
        *value = Object::new().into();
    }
    value.as_object_mut().expect("made an object above")
}

/// Visits every `textureInfo`: an object in a material, at any depth, whose key ends in `Texture`.
fn for_each_texture_info(json: &mut Object, visit: &mut dyn FnMut(&mut Object)) {
    fn walk(value: &mut Value, visit: &mut dyn FnMut(&mut Object)) {
        match value {
            Value::Object(object) => {
                for (key, value) in object {
                    match value {
                        Value::Object(info) if key.ends_with("Texture") => visit(info),
                        _ => walk(value, visit),
                    }
                }
            }
            Value::Array(values) => values.iter_mut().for_each(|value| walk(value, visit)),
            _ => {}
        }
    }
    if let Some(materials) = json.get_mut("materials") {
        walk(materials, visit);
    }
}

/// Visits every object that refers to an image as `source`: textures and their extensions.
fn for_each_image_index(json: &mut Object, visit: &mut dyn FnMut(&mut Object)) {
    for texture in json.get_mut("textures").and_then(Value::as_array_mut).into_iter().flatten() {
        let Some(texture) = texture.as_object_mut() else { continue };
        visit(texture);
        let extensions = texture.get_mut("extensions").and_then(Value::as_object_mut);
        for (_, extension) in extensions.into_iter().flatten() {
            if let Some(extension) = extension.as_object_mut() {
                visit(extension);
            }
        }
    }
}

/// Visits every object that refers to a buffer view as `bufferView`: accessors, their sparse parts,
/// images and the primitives of `KHR_draco_mesh_compression`.
fn for_each_view_index(json: &mut Object, visit: &mut dyn FnMut(&mut Object)) {
    for accessor in json.get_mut("accessors").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(sparse) = accessor.get_mut("sparse") {
            for part in ["indices", "values"] {
                if let Some(part) = sparse.get_mut(part).and_then(Value::as_object_mut) {
                    visit(part);
                }
            }
        }
        if let Some(accessor) = accessor.as_object_mut() {
            visit(accessor);
        }
    }
    for image in json.get_mut("images").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(image) = image.as_object_mut() {
            visit(image);
        }
    }
    for mesh in json.get_mut("meshes").and_then(Value::as_array_mut).into_iter().flatten() {
        let primitives = mesh.get_mut("primitives").and_then(Value::as_array_mut);
        for primitive in primitives.into_iter().flatten() {
            let draco = primitive
                .get_mut("extensions")
                .and_then(|extensions| extensions.get_mut("KHR_draco_mesh_compression"))
                .and_then(Value::as_object_mut);
            if let Some(draco) = draco {
                visit(draco);
            }
        }
    }
}

/// A function that visits some kind of object all over a document.
type VisitAll = fn(&mut Object, &mut dyn FnMut(&mut Object));

/// The indices under `key` in the objects that `visit_all` comes by.
fn collect(json: &mut Object, key: &str, visit_all: VisitAll) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    visit_all(json, &mut |holder| found.extend(holder.get(key).and_then(index)));
    found
}

/// The names of what stands in an `extensions` object anywhere.
fn used_extensions(json: &Object) -> BTreeSet<String> {
    fn walk(object: &Object, found: &mut BTreeSet<String>) {
        if let Some(extensions) = object.get("extensions").and_then(Value::as_object) {
            found.extend(extensions.keys().cloned());
        }
        object.values().for_each(|value| walk_value(value, found));
    }
    fn walk_value(value: &Value, found: &mut BTreeSet<String>) {
        match value {
            Value::Object(object) => walk(object, found),
            Value::Array(values) => values.iter().for_each(|value| walk_value(value, found)),
            _ => {}
        }
    }
    let mut found = BTreeSet::new();
    walk(json, &mut found);
    found
}

fn used_textures(json: &mut Object) -> BTreeSet<usize> {
    collect(json, "index", for_each_texture_info)
}

fn used_images(json: &mut Object) -> BTreeSet<usize> {
    collect(json, "source", for_each_image_index)
}

fn used_views(json: &mut Object) -> BTreeSet<usize> {
    collect(json, "bufferView", for_each_view_index)
}

/// Removes entries of a list, and the list with its last entry, which must not be empty; gives the new
/// number of each old one.
fn remove(json: &mut Object, list: &str, dropped: &BTreeSet<usize>) -> Vec<usize> {
    if dropped.is_empty() {
        return (0..array(json, list).len()).collect();
    }
    let entries = array_mut(json, list);
    let renumbered = (0..entries.len()).map(|i| i - dropped.range(..i).count()).collect();
    let mut i = 0;
    entries.retain(|_| {
        i += 1;
        !dropped.contains(&(i - 1))
    });
    if entries.is_empty() {
        json.shift_remove(list);
    }
    renumbered
}

fn renumber(holder: &mut Object, key: &str, renumbered: &[usize]) {
    if let Some(value) = holder.get_mut(key)
        && let Some(&new) = index(value).and_then(|old| renumbered.get(old))
    {
        *value = new.into();
    }
}

/// `bytes` without the given ranges, which are sorted and apart.
fn cut(bytes: &[u8], cuts: &[(usize, usize)]) -> Vec<u8> {
    let mut kept = Vec::with_capacity(bytes.len());
    let mut at = 0;
    for &(start, end) in cuts {
        kept.extend_from_slice(&bytes[at..start]);
        at = end;
    }
    kept.extend_from_slice(&bytes[at..]);
    kept
}

/// The name of the file for a buffer of a `.gltf`: the document's, and a number from the second on.
fn bin_name(path: &Path, buffer: usize) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    if buffer == 0 { format!("{stem}.bin") } else { format!("{stem}-{buffer}.bin") }
}

fn uri_of(relative: &str) -> String {
    percent_encode(relative.as_bytes(), PATH).to_string()
}
