//! Reads a glTF document into a [`Scene`].

mod detail;
mod pose;

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, DVec4, Mat3, Quat, Vec2, Vec3, Vec4};
use kinran_image::{Cancelled, Disk, Files, Image, Pixels, Texture, Tick, Transfer, untold};
use rayon::prelude::*;
use serde::Deserialize;

use self::pose::Poses;
use crate::accessor::Accessors;
use crate::compressed::{decompress, is_compressed};
use crate::container::{GivenResolver, Purpose, Resolver, beside, fetch, given, split};
use crate::obj::{glb_from_obj, names_materials};
use crate::{
    AlphaMode, Anisotropy, Camera, Dielectric, DiffuseTransmission, Error, FUZZ_EXTENSION, Fuzz,
    FuzzAttenuation, FuzzDirection, FuzzLayer, FuzzPhase, Instance, Light, LightKind, Material, Primitive,
    Scene, Skin, SkinProfile, Source, TextureRef, VertexCurvature, Wrap, json, tangent,
};

/// Extensions that may stand in `extensionsRequired`: those this module reads, and those that change how
/// a surface looks but leave the rest of the document as it is; the latter are listed in
/// [`Material::ignored_extensions`] or in [`Scene::warnings`].
/// What images are in textures of `EXT_texture_avif` matters only to who needs them.
const ADMITTED_EXTENSIONS: [&str; 32] = [
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "KHR_draco_mesh_compression",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
    "KINRAN_materials_aniso",
    "KINRAN_materials_detail",
    "KINRAN_materials_fuzz",
    "KINRAN_materials_skin",
    "KINRAN_mesh_curvature",
    "MSFT_texture_dds",
    "KHR_animation_pointer",
];

/// Material extensions that [`Material`] represents.
const READ_MATERIAL_EXTENSIONS: [&str; 11] = [
    "KHR_materials_anisotropy",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KINRAN_materials_aniso",
    "KINRAN_materials_detail",
    "KINRAN_materials_fuzz",
    "KINRAN_materials_skin",
];

/// Texture extensions that name a KTX2 or DDS file.
const TEXTURE_EXTENSIONS: [&str; 2] = ["KHR_texture_basisu", "MSFT_texture_dds"];

/// The texture extension that names a WebP file, beside a PNG or JPEG or without.
pub(crate) const WEBP: &str = "EXT_texture_webp";

/// Texels that all images of a scene may have together: four of 16384 by 16384, 4 GiB as RGBA8.
const TEXELS_MAX: u64 = 1 << 30;

/// Instances that one scene may have; at 80 bytes each, 1.3 GB.
const INSTANCES_MAX: usize = 1 << 24;

/// Triangles that take as long to read, with tangents made for them, as an image: one of 2048 by 2048. Chosen by eye, for
/// bars.
const IMAGE: u64 = 100_000;

/// The maps of materials that a task asks for, each group with those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Maps {
    /// None.
    None,
    /// Of normals, roughness and anisotropy, which are filtered together.
    Surface,
    /// Of base colour, occlusion and emission too.
    Plain,
    /// All, and engine textures beside them.
    All,
}

/// What of a document a task asks for. What is left out is neither read nor judged: a file that is damaged there is as good
/// as another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Needs {
    /// Meshes, their places, lights and cameras.
    pub geometry: bool,
    /// Skinned meshes stand in the rest pose; without it, as their accessors have them.
    pub rest_pose: bool,
    /// Which images are read. A texture of another map that has no image is left out of its material with a warning.
    pub maps: Maps,
    /// Images that say what surfaces reflect are read too ([`Material::reflecting`]); where that fails, it is a warning.
    pub reflectance: bool,
    /// An image that is missing or damaged is a warning, and left out: to look at a model as it is. Files that a model may not
    /// name are refused all the same.
    pub forgiving: bool,
}

impl Needs {
    /// Nothing but materials.
    pub const NONE: Needs =
        Needs { geometry: false, rest_pose: false, maps: Maps::None, reflectance: false, forgiving: false };

    /// All there is.
    pub const ALL: Needs =
        Needs { geometry: true, rest_pose: true, maps: Maps::All, reflectance: true, forgiving: false };
}

impl Scene {
    /// Reads a `.gltf` (with its buffers and images beside it, or in `data:` URIs) or a `.glb`; of an `.obj` the mesh, one
    /// unit of which is taken for a metre.
    ///
    /// The document's default scene is taken, in its rest pose, with the default material variant. Points
    /// and lines are left out. Missing normals become flat ones and missing tangents MikkTSpace ones of
    /// the UV set that the normal map uses (glTF 2.0 section 3.7.2.1). A texture's PNG or JPEG is preferred
    /// to its KTX2 or DDS alternative. What was left out or mended stands in [`Scene::warnings`].
    ///
    /// # Errors
    /// One that names the file and the place in it: files that are missing, truncated or no glTF, indices
    /// and ranges that point nowhere, numbers that are not finite, required extensions that are not
    /// implemented, and [`Error::Outside`] for a file outside of the document's folder. Memory stays in proportion to
    /// the files' sizes.
    pub fn load(path: impl AsRef<Path>) -> Result<Scene, Error> {
        Scene::load_allowing(path, &[])
    }

    /// As [`Scene::load`]; the document may also name files of these folders.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn load_allowing(path: impl AsRef<Path>, allowed: &[PathBuf]) -> Result<Scene, Error> {
        Scene::load_part(path, allowed, &Needs::ALL)
    }

    /// As [`Scene::load_allowing`], of a document as much as `needs` says.
    ///
    /// # Errors
    /// As [`Scene::load`], about what is needed.
    pub fn load_part(path: impl AsRef<Path>, allowed: &[PathBuf], needs: &Needs) -> Result<Scene, Error> {
        Scene::load_watched(path, allowed, needs, &|_| {}, &untold)
    }

    /// As [`Scene::load_part`]; `expect` is told of how many units of work there are, once that is known, and `tick` of those
    /// that are done. A unit is about what a triangle takes.
    ///
    /// # Errors
    /// As [`Scene::load_part`], and [`Error::Cancelled`] where `tick` stops the work.
    pub fn load_watched(
        path: impl AsRef<Path>,
        allowed: &[PathBuf],
        needs: &Needs,
        expect: &dyn Fn(u64),
        tick: &Tick<'_>,
    ) -> Result<Scene, Error> {
        Scene::load_in(&Disk, path, allowed, needs, expect, tick)
    }

    /// As [`Scene::load_watched`], of files that may be elsewhere than on a disk.
    ///
    /// # Errors
    /// As [`Scene::load_watched`].
    pub fn load_in(
        files: &dyn Files,
        path: impl AsRef<Path>,
        allowed: &[PathBuf],
        needs: &Needs,
        expect: &dyn Fn(u64),
        tick: &Tick<'_>,
    ) -> Result<Scene, Error> {
        let path = path.as_ref();
        let mut bytes = files.read(path).map_err(|error| Error::io(path, error))?;
        let mut without_materials = false;
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")) {
            without_materials = names_materials(&bytes);
            bytes = glb_from_obj(path, &bytes)?;
        }
        let mut scene = Scene::read(path, &bytes, &beside(files, path, allowed), needs, expect, tick)?;
        if without_materials {
            let name = path.display();
            scene.warnings.push(format!(
                "{name}: materials of .mtl files are not read, and it is grey; a .glb of it keeps them"
            ));
        }
        Ok(scene)
    }

    /// Reads a document from memory. `name` stands for it in messages; `resolve` gives the bytes of a
    /// relative, percent-decoded path that the document names, and is asked for no path that leaves the document's folder.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn from_bytes(name: &Path, bytes: &[u8], resolve: &GivenResolver<'_>) -> Result<Scene, Error> {
        Scene::read(name, bytes, &given(resolve), &Needs::ALL, &|_| {}, &untold)
    }

    fn read(
        name: &Path,
        bytes: &[u8],
        resolve: &Resolver<'_>,
        needs: &Needs,
        expect: &dyn Fn(u64),
        tick: &Tick<'_>,
    ) -> Result<Scene, Error> {
        let container = split(name, bytes)?;
        let no_gltf = |error: serde_json::Error| {
            Error::malformed(name, format!("the JSON does not describe glTF: {error}"))
        };
        let mut root: json::Root = serde_json::from_slice(container.json).map_err(no_gltf)?;
        admit(name, &root)?;
        let mut buffers = load_buffers(name, &root, container.bin, resolve)?;
        if needs.geometry && root.is_compressed() {
            let mut document = serde_json::from_slice(container.json).map_err(no_gltf)?;
            let buffer = |i: usize| {
                let bytes = buffers.get(i).map(|bytes| Cow::Borrowed(bytes.as_slice()));
                bytes.ok_or_else(|| Error::malformed(name, format!("buffer {i} does not exist")))
            };
            let plain = decompress(name, &mut document, &buffer, tick)?;
            buffers.push(plain.bytes);
            root = serde_json::from_value(document.into()).map_err(no_gltf)?;
        }
        let mut loader = Loader {
            name,
            root: &root,
            accessors: Accessors::new(name, &root, &buffers),
            first_use: Vec::new(),
            worlds: Vec::new(),
            needs: *needs,
            tick,
            scene: Scene { warnings: container.warnings, ..Scene::default() },
        };
        loader.first_use = loader.first_uses();
        loader.materials()?;
        expect(loader.extent());
        if needs.geometry {
            let meshes = loader.meshes()?;
            loader.nodes(&meshes)?;
        }
        loader.images(resolve)?;
        Ok(loader.scene)
    }
}

/// Refuses documents that cannot be read faithfully.
fn admit(name: &Path, root: &json::Root) -> Result<(), Error> {
    if !root.asset.version.starts_with("2.") {
        return Err(Error::unsupported(
            name,
            format!("glTF version {:?}; export it as glTF 2.0", root.asset.version),
        ));
    }
    let Some(extension) =
        (root.extensions_required).iter().find(|name| !ADMITTED_EXTENSIONS.contains(&name.as_str()))
    else {
        return Ok(());
    };
    Err(Error::unsupported(
        name,
        format!(
            "requires the extension {extension}, which is not read; export it without this extension, or with it as \
             optional"
        ),
    ))
}

/// All buffers, each as long as its `byteLength` claims or longer.
fn load_buffers(
    name: &Path,
    root: &json::Root,
    bin: Option<&[u8]>,
    resolve: &Resolver<'_>,
) -> Result<Vec<Vec<u8>>, Error> {
    (root.buffers.iter().enumerate())
        .map(|(i, buffer)| {
            let what = format!("buffer {i}");
            let bytes = match (&buffer.uri, bin) {
                (Some(uri), _) => fetch(name, &what, Purpose::Buffer, uri, resolve)?,
                (None, Some(bin)) if i == 0 => bin.to_vec(),
                // A placeholder for what is compressed elsewhere.
                (None, _) if root.is_compressed() => return Ok(Vec::new()),
                _ => return Err(Error::malformed(name, format!("{what} has no uri and no GLB chunk to be"))),
            };
            if (bytes.len() as u64) < buffer.byte_length {
                let (claimed, got) = (buffer.byte_length, bytes.len());
                return Err(Error::malformed(
                    name,
                    format!(
                        "{what} claims {claimed} bytes and there are {got}: it is truncated, export it again"
                    ),
                ));
            }
            Ok(bytes)
        })
        .collect()
}

impl json::Root {
    fn is_compressed(&self) -> bool {
        is_compressed(self.extensions_used.iter().map(String::as_str))
    }
}

struct Loader<'a> {
    name: &'a Path,
    root: &'a json::Root,
    accessors: Accessors<'a>,
    /// For each image the first one with the same source.
    first_use: Vec<usize>,
    /// Of all nodes, once a skin has asked for them.
    worlds: Vec<Option<DAffine3>>,
    needs: Needs,
    /// Told of the units of [`Loader::extent`].
    tick: &'a Tick<'a>,
    scene: Scene,
}

/// Whether an image is read.
#[derive(Clone, Copy, PartialEq)]
enum Drawn {
    Not,
    /// If it can be.
    Wished,
    Needed,
}

impl Material {
    /// The textures that say what reflects, where the reflectance of its surface may differ from place to place: of what is
    /// not metal, and the base colour where there may be metal; none where all of the surface is the same.
    pub fn reflecting(&self) -> impl Iterator<Item = &TextureRef> {
        let is_surface =
            self.normal.is_some() || self.metallic_roughness.is_some() || self.anisotropy.is_some();
        let dielectric = self.dielectric.as_ref();
        [
            self.base_color.as_ref().filter(|_| self.metallic_factor > 0.0),
            dielectric.and_then(|dielectric| dielectric.strength_texture.as_ref()),
            dielectric.and_then(|dielectric| dielectric.color.as_ref()),
        ]
        .into_iter()
        .filter(move |_| is_surface)
        .flatten()
    }

    /// The textures of the maps that are asked for.
    fn needed(&self, maps: Maps) -> Vec<&TextureRef> {
        let anisotropy = self.anisotropy.as_ref().filter(|a| a.strength > 0.0);
        let surface = [
            &self.normal,
            &self.metallic_roughness,
            anisotropy.map_or(&None, |anisotropy| &anisotropy.texture),
        ];
        let dielectric = self.dielectric.as_ref();
        let plain = [
            &self.base_color,
            &self.occlusion,
            &self.emissive,
            dielectric.map_or(&None, |dielectric| &dielectric.strength_texture),
            dielectric.map_or(&None, |dielectric| &dielectric.color),
        ];
        match maps {
            Maps::None => Vec::new(),
            Maps::Surface => surface.into_iter().flatten().collect(),
            Maps::Plain => surface.into_iter().chain(plain).flatten().collect(),
            Maps::All => self.textures().collect(),
        }
    }
}

impl Loader<'_> {
    fn error(&self, reason: impl Into<String>) -> Error {
        Error::malformed(self.name, reason)
    }

    fn warn(&mut self, warning: String) {
        self.scene.warnings.push(warning);
    }

    fn finite<const N: usize>(&self, values: [f32; N], what: &str) -> Result<[f32; N], Error> {
        if values.iter().all(|x| x.is_finite()) {
            return Ok(values);
        }
        Err(self.error(format!("{what} is {values:?}; every component must be a finite number")))
    }

    /// A factor that the specification keeps within [0, 1].
    fn unit(&mut self, value: f32, what: &str) -> Result<f32, Error> {
        let [value] = self.finite([value], what)?;
        if !(0.0..=1.0).contains(&value) {
            self.warn(format!("{what} is {value}, outside 0 to 1; it was clamped"));
        }
        Ok(value.clamp(0.0, 1.0))
    }

    fn first_uses(&self) -> Vec<usize> {
        let source = |i: usize| (&self.root.images[i].uri, self.root.images[i].buffer_view);
        let mut first = std::collections::HashMap::new();
        (0..self.root.images.len()).map(|i| *first.entry(source(i)).or_insert(i)).collect()
    }

    fn materials(&mut self) -> Result<(), Error> {
        let root = self.root;
        for (i, material) in root.materials.iter().enumerate() {
            let material = self.material(material, i)?;
            self.scene.materials.push(material);
        }
        let default_used = root
            .meshes
            .iter()
            .flat_map(|mesh| &mesh.primitives)
            .any(|primitive| primitive.material.is_none());
        if default_used || root.materials.is_empty() {
            let mut material = self.material(&json::Material::default(), root.materials.len())?;
            material.name = "default".into();
            self.scene.materials.push(material);
        }
        Ok(())
    }

    fn material(&mut self, material: &json::Material, index: usize) -> Result<Material, Error> {
        let name = material.name.clone().unwrap_or_else(|| format!("material {index}"));
        let what = match &material.name {
            Some(name) => format!("material {index} \"{name}\""),
            None => format!("material {index}"),
        };
        let pbr = &material.pbr_metallic_roughness;

        let anisotropy: Option<json::Anisotropy> =
            self.extension(&material.extensions, "KHR_materials_anisotropy", &what)?;
        let anisotropy = match anisotropy {
            Some(anisotropy) => Some(Anisotropy {
                strength: self
                    .unit(anisotropy.anisotropy_strength, &format!("{what}: anisotropyStrength"))?,
                rotation: {
                    let what = format!("{what}: anisotropyRotation");
                    self.finite([anisotropy.anisotropy_rotation], &what)?[0]
                },
                texture: self.map(
                    Maps::Surface,
                    &anisotropy.anisotropy_texture,
                    &format!("{what}: anisotropyTexture"),
                )?,
            }),
            None => None,
        };
        let aniso: Option<json::Aniso> =
            self.extension(&material.extensions, "KINRAN_materials_aniso", &what)?;
        let aniso = match aniso {
            Some(aniso) => self.texture(&Some(aniso.aniso_texture), &format!("{what}: anisoTexture"))?,
            None => None,
        };
        let diffuse_transmission: Option<json::DiffuseTransmission> =
            self.extension(&material.extensions, "KHR_materials_diffuse_transmission", &what)?;
        let diffuse_transmission = match diffuse_transmission {
            Some(d) => {
                let what = |field| format!("{what}: {field}");
                let color = d.diffuse_transmission_color_factor;
                Some(DiffuseTransmission {
                    factor: self.unit(d.diffuse_transmission_factor, &what("diffuseTransmissionFactor"))?,
                    texture: self
                        .texture(&d.diffuse_transmission_texture, &what("diffuseTransmissionTexture"))?,
                    color_factor: self.finite(color, &what("diffuseTransmissionColorFactor"))?.into(),
                    color: self.texture(
                        &d.diffuse_transmission_color_texture,
                        &what("diffuseTransmissionColorTexture"),
                    )?,
                })
            }
            None => None,
        };
        let strength: Option<json::EmissiveStrength> =
            self.extension(&material.extensions, "KHR_materials_emissive_strength", &what)?;
        let strength = strength.map_or(1.0, |extension| extension.emissive_strength);
        let emissive = Vec3::from(material.emissive_factor) * strength;

        if material.extensions.contains_key("KHR_materials_pbrSpecularGlossiness") {
            self.warn(format!(
                "{what} is specular-glossiness; its metallic-roughness fallback is taken, convert it for the right look"
            ));
        }
        Ok(Material {
            name,
            base_color_factor: self
                .finite(pbr.base_color_factor, &format!("{what}: baseColorFactor"))?
                .into(),
            base_color: self.map(
                Maps::Plain,
                &pbr.base_color_texture,
                &format!("{what}: baseColorTexture"),
            )?,
            metallic_factor: self.unit(pbr.metallic_factor, &format!("{what}: metallicFactor"))?,
            roughness_factor: self.unit(pbr.roughness_factor, &format!("{what}: roughnessFactor"))?,
            metallic_roughness: self.map(
                Maps::Surface,
                &pbr.metallic_roughness_texture,
                &format!("{what}: metallicRoughnessTexture"),
            )?,
            normal: self.map(Maps::Surface, &material.normal_texture, &format!("{what}: normalTexture"))?,
            normal_scale: {
                let scale = material.normal_texture.as_ref().map_or(1.0, |info| info.scale);
                self.finite([scale], &format!("{what}: normalTexture.scale"))?[0]
            },
            occlusion: self.map(
                Maps::Plain,
                &material.occlusion_texture,
                &format!("{what}: occlusionTexture"),
            )?,
            occlusion_strength: {
                let strength = material.occlusion_texture.as_ref().map_or(1.0, |info| info.strength);
                self.unit(strength, &format!("{what}: occlusionTexture.strength"))?
            },
            emissive_factor: self.finite(emissive.to_array(), &format!("{what}: emissiveFactor"))?.into(),
            emissive: self.map(
                Maps::Plain,
                &material.emissive_texture,
                &format!("{what}: emissiveTexture"),
            )?,
            anisotropy,
            aniso,
            skin: self.skin(&material.extensions, &what)?,
            fuzz: self.fuzz(material, &what)?,
            detail: self.detail(&material.extensions, &what)?,
            diffuse_transmission,
            transmission: self.transmission(&material.extensions, &what)?,
            dielectric: self.dielectric(&material.extensions, &what)?,
            alpha_mode: match material.alpha_mode {
                json::AlphaMode::Opaque => AlphaMode::Opaque,
                json::AlphaMode::Mask => AlphaMode::Mask {
                    cutoff: self.finite([material.alpha_cutoff], &format!("{what}: alphaCutoff"))?[0],
                },
                json::AlphaMode::Blend => AlphaMode::Blend,
            },
            double_sided: material.double_sided,
            ignored_extensions: (material.extensions.keys())
                .filter(|name| !READ_MATERIAL_EXTENSIONS.contains(&name.as_str()))
                .cloned()
                .collect(),
        })
    }

    /// The factor of `KHR_materials_transmission`.
    fn transmission(&mut self, extensions: &json::Extensions, what: &str) -> Result<f32, Error> {
        let transmission: Option<json::Transmission> =
            self.extension(extensions, "KHR_materials_transmission", what)?;
        let Some(transmission) = transmission else { return Ok(0.0) };
        if transmission.transmission_texture.is_some() {
            self.warn(format!("{what}: transmissionTexture is left out; its factor is taken everywhere"));
        }
        self.unit(transmission.transmission_factor, &format!("{what}: transmissionFactor"))
    }

    /// `KHR_materials_specular` and `KHR_materials_ior`.
    fn dielectric(&mut self, extensions: &json::Extensions, what: &str) -> Result<Option<Dielectric>, Error> {
        let ior: Option<json::Ior> = self.extension(extensions, "KHR_materials_ior", what)?;
        let specular: Option<json::Specular> = self.extension(extensions, "KHR_materials_specular", what)?;
        if ior.is_none() && specular.is_none() {
            return Ok(None);
        }
        let mut dielectric = Dielectric::default();
        if let Some(json::Ior { ior }) = ior {
            let [ior] = self.finite([ior], &format!("{what}: ior"))?;
            if ior == 0.0 || ior >= 1.0 {
                dielectric.ior = ior;
            } else {
                self.warn(format!("{what}: ior is {ior}, neither 0 nor at least 1; 1.5 was taken"));
            }
        }
        if let Some(specular) = specular {
            let what = |field| format!("{what}: {field}");
            dielectric.strength = self.unit(specular.specular_factor, &what("specularFactor"))?;
            dielectric.strength_texture =
                self.map(Maps::Plain, &specular.specular_texture, &what("specularTexture"))?;
            let color = self.finite(specular.specular_color_factor, &what("specularColorFactor"))?;
            if color.iter().any(|channel| *channel < 0.0) {
                let what = what("specularColorFactor");
                self.warn(format!("{what} is {color:?}; what is below 0 was taken as 0"));
            }
            dielectric.color_factor = Vec3::from(color).max(Vec3::ZERO);
            dielectric.color =
                self.map(Maps::Plain, &specular.specular_color_texture, &what("specularColorTexture"))?;
            if let (Some(strength), Some(color)) = (&dielectric.strength_texture, &dielectric.color)
                && !strength.lies_as(color)
            {
                let what = what("specularTexture");
                self.warn(format!(
                    "{what} lies on the mesh in another way than specularColorTexture; it was left out"
                ));
                dielectric.strength_texture = None;
            }
        }
        Ok(Some(dielectric))
    }

    /// `KINRAN_materials_skin`.
    fn skin(&mut self, extensions: &json::Extensions, what: &str) -> Result<Option<Skin>, Error> {
        let Some(skin) = self.extension::<json::Skin>(extensions, "KINRAN_materials_skin", what)? else {
            return Ok(None);
        };
        let what = format!("{what}: KINRAN_materials_skin");
        let positive = |value: f64, name: &str| {
            if value > 0.0 && value.is_finite() {
                return Ok(());
            }
            Err(self.error(format!("{what}: {name} is {value}; it must be above zero")))
        };
        positive(f64::from(skin.scatter_scale), "scatterScale")?;
        let profile = match (skin.profile.gaussians, skin.profile.burley) {
            (Some(_), Some(_)) => {
                return Err(self.error(format!("{what}: profile has both gaussians and burley; keep one")));
            }
            (Some(sum), None) => {
                for g in &sum {
                    positive(g.variance, "a variance of the profile")?;
                    if !g.weight.iter().all(|w| w.is_finite() && *w >= 0.0) {
                        let weight = g.weight;
                        return Err(self.error(format!(
                            "{what}: a weight of the profile is {weight:?}; weights are not below zero"
                        )));
                    }
                }
                if !(0..3).all(|c| sum.iter().any(|g| g.weight[c] > 0.0)) {
                    return Err(self.error(format!(
                        "{what}: profile.gaussians leaves a channel without weight; each needs one above zero"
                    )));
                }
                SkinProfile::Gaussians(sum.iter().map(|g| (g.variance, g.weight)).collect())
            }
            (None, Some(d)) => {
                d.iter().try_for_each(|&d| positive(d, "a length of profile.burley"))?;
                SkinProfile::Burley(d)
            }
            (None, None) => SkinProfile::Human,
        };
        let [r, g, b] = skin.normal_blur;
        let blur = format!("{what}: normalBlur");
        let [penumbra] = self.finite([skin.penumbra], &format!("{what}: penumbra"))?;
        Ok(Some(Skin {
            profile,
            scatter_scale: skin.scatter_scale,
            second_roughness: self
                .unit(skin.second_lobe.roughness, &format!("{what}: secondLobe.roughness"))?,
            second_share: self.unit(skin.second_lobe.share, &format!("{what}: secondLobe.share"))?,
            normal_blur: Vec3::new(self.unit(r, &blur)?, self.unit(g, &blur)?, self.unit(b, &blur)?),
            penumbra: penumbra.max(0.0),
        }))
    }

    /// Our own extension, else sheen.
    fn fuzz(&mut self, material: &json::Material, what: &str) -> Result<Option<Fuzz>, Error> {
        let Some(fuzz) = self.extension::<json::Fuzz>(&material.extensions, FUZZ_EXTENSION, what)? else {
            return self.sheen(material, what);
        };
        let what = format!("{what}: {FUZZ_EXTENSION}");
        if let Some(fuzziness) = fuzz.fuzziness {
            let fuzziness = self.within(fuzziness, 0.0..=1.0, &what, "fuzziness")?;
            let texture = self.texture(&fuzz.fuzziness_texture, &format!("{what}: fuzzinessTexture"))?;
            return Ok(Some(Fuzz::Simple { fuzziness, texture }));
        }
        let default = FuzzLayer::default();
        let right_angle = std::f32::consts::FRAC_PI_2;
        let color = fuzz.fiber_color_factor.unwrap_or(default.color.to_array());
        for component in color {
            self.within(component, 0.0..=1.0, &what, "fiberColorFactor")?;
        }
        Ok(Some(Fuzz::Layer(FuzzLayer {
            phase: self.named(&fuzz.phase, &FuzzPhase::NAMES, &what, "phase")?,
            density: self.within(fuzz.density.unwrap_or(default.density), 0.0..=2.0, &what, "density")?,
            density_texture: self.texture(&fuzz.density_texture, &format!("{what}: densityTexture"))?,
            spread: self.within(fuzz.spread.unwrap_or(default.spread), 0.0..=1.0, &what, "spread")?,
            color: color.into(),
            color_texture: self.texture(&fuzz.fiber_color_texture, &format!("{what}: fiberColorTexture"))?,
            // A right angle as decimals may round to a little more.
            tilt: self
                .within(fuzz.tilt.unwrap_or(default.tilt), 0.0..=right_angle + 1e-5, &what, "tilt")?
                .min(right_angle),
            azimuth: self.finite([fuzz.azimuth.unwrap_or(default.azimuth)], &format!("{what}: azimuth"))?[0],
            direction_texture: self.texture(&fuzz.direction_texture, &format!("{what}: directionTexture"))?,
            direction_encoding: self.named(
                &fuzz.direction_encoding,
                &FuzzDirection::NAMES,
                &what,
                "directionEncoding",
            )?,
            normal_smoothness: {
                let smoothness = fuzz.normal_smoothness.unwrap_or(default.normal_smoothness);
                self.within(smoothness, 0.0..=1.0, &what, "normalSmoothness")?
            },
            attenuation: self.named(&fuzz.attenuation, &FuzzAttenuation::NAMES, &what, "attenuation")?,
        })))
    }

    /// `KHR_materials_sheen` as upright fibres; one without colour is none.
    fn sheen(&mut self, material: &json::Material, what: &str) -> Result<Option<Fuzz>, Error> {
        let Some(sheen) = self.extension::<json::Sheen>(&material.extensions, "KHR_materials_sheen", what)?
        else {
            return Ok(None);
        };
        let color = Vec3::from(self.finite(sheen.sheen_color_factor, &format!("{what}: sheenColorFactor"))?);
        if color.max_element() <= 0.0 {
            return Ok(None);
        }
        let roughness = self.unit(sheen.sheen_roughness_factor, &format!("{what}: sheenRoughnessFactor"))?;
        if sheen.sheen_roughness_texture.is_some() {
            self.warn(format!("{what}: sheenRoughnessTexture is left out; its factor is taken everywhere"));
        }
        let color_texture =
            self.texture(&sheen.sheen_color_texture, &format!("{what}: sheenColorTexture"))?;
        let layer = FuzzLayer::from_sheen(color.clamp(Vec3::ZERO, Vec3::ONE), roughness);
        Ok(Some(Fuzz::Layer(FuzzLayer { color_texture, ..layer })))
    }

    /// A number of ours, which is refused where it is out of range: there is no telling what was meant.
    fn within(
        &self,
        value: f32,
        range: std::ops::RangeInclusive<f32>,
        what: &str,
        field: &str,
    ) -> Result<f32, Error> {
        if range.contains(&value) {
            return Ok(value);
        }
        let (low, high) = (range.start(), range.end());
        Err(self.error(format!("{what}: {field} is {value}; it must be {low} to {high}")))
    }

    /// What a name in a file stands for, the first where there is none.
    fn named<T: Copy>(
        &self,
        name: &Option<String>,
        names: &[(&'static str, T)],
        what: &str,
        field: &str,
    ) -> Result<T, Error> {
        let Some(name) = name else { return Ok(names[0].1) };
        names.iter().find(|(known, _)| known == name).map(|(_, value)| *value).ok_or_else(|| {
            let known: Vec<&str> = names.iter().map(|(known, _)| *known).collect();
            self.error(format!("{what}: {field} is {name:?}; it must be one of {}", known.join(", ")))
        })
    }

    fn extension<'de, T: Deserialize<'de>>(
        &self,
        extensions: &'de json::Extensions,
        extension: &str,
        what: &str,
    ) -> Result<Option<T>, Error> {
        let Some(value) = extensions.get(extension) else { return Ok(None) };
        T::deserialize(value)
            .map(Some)
            .map_err(|error: serde_json::Error| self.error(format!("{what}: {extension}: {error}")))
    }

    fn texture(&mut self, info: &Option<json::TextureInfo>, what: &str) -> Result<Option<TextureRef>, Error> {
        self.map(Maps::All, info, what)
    }

    /// A texture of a group of maps.
    fn map(
        &mut self,
        group: Maps,
        info: &Option<json::TextureInfo>,
        what: &str,
    ) -> Result<Option<TextureRef>, Error> {
        match self.texture_ref(info, what) {
            Err(error) if group > self.needs.maps => {
                self.warn(format!("{}; it is left as it is", error.reason()));
                Ok(None)
            }
            result => result,
        }
    }

    fn texture_ref(
        &mut self,
        info: &Option<json::TextureInfo>,
        what: &str,
    ) -> Result<Option<TextureRef>, Error> {
        let Some(info) = info else { return Ok(None) };
        let root = self.root;
        let texture = (root.textures.get(info.index))
            .ok_or_else(|| self.error(format!("{what}: texture {} does not exist", info.index)))?;

        let runtime = TEXTURE_EXTENSIONS
            .iter()
            .find_map(|name| texture.extensions.get(*name)?.get("source")?.as_u64())
            .and_then(|source| usize::try_from(source).ok());
        let webp = texture.extensions.get(WEBP).and_then(|webp| webp.get("source")?.as_u64());
        let webp = webp.and_then(|source| usize::try_from(source).ok());
        let Some(image) = texture.source.or(webp).or(runtime) else {
            let names: Vec<&str> = texture.extensions.keys().map(String::as_str).collect();
            return Err(Error::unsupported(
                self.name,
                format!(
                    "{what}: texture {} has no image that can be read (extensions: {}); give it a PNG, JPEG or WebP source",
                    info.index,
                    if names.is_empty() { "none".into() } else { names.join(", ") }
                ),
            ));
        };
        let existing = |image: usize| {
            let first = self.first_use.get(image).copied();
            first.ok_or_else(|| self.error(format!("{what}: image {image} does not exist")))
        };
        let image = existing(image)?;
        let runtime = runtime.map(existing).transpose()?;

        let (mut uv_set, mut transform) = (info.tex_coord, Mat3::IDENTITY);
        if let Some(extension) = &info.extensions.transform {
            uv_set = extension.tex_coord.unwrap_or(uv_set);
            transform = texture_transform(extension);
            let what = format!("{what}: KHR_texture_transform");
            self.finite(transform.to_cols_array(), &what)?;
        }
        if uv_set > 1 {
            self.warn(format!(
                "{what} uses TEXCOORD_{uv_set}; only sets 0 and 1 are read, so it was left out"
            ));
            return Ok(None);
        }

        let wrap = match texture.sampler {
            None => [Wrap::Repeat; 2],
            Some(sampler) => {
                let sampler = (root.samplers.get(sampler))
                    .ok_or_else(|| self.error(format!("{what}: sampler {sampler} does not exist")))?;
                [self.wrap(sampler.wrap_s, what)?, self.wrap(sampler.wrap_t, what)?]
            }
        };
        Ok(Some(TextureRef { image, runtime, uv_set, transform, wrap }))
    }

    fn wrap(&self, mode: u32, what: &str) -> Result<Wrap, Error> {
        match mode {
            10497 => Ok(Wrap::Repeat),
            33071 => Ok(Wrap::Clamp),
            33648 => Ok(Wrap::Mirror),
            _ => Err(self.error(format!("{what}: wrap mode {mode}; 10497, 33071 or 33648 are allowed"))),
        }
    }

    /// Reads every mesh; gives the scene's primitives of each.
    fn meshes(&mut self) -> Result<Vec<Poses>, Error> {
        let root = self.root;
        let mut meshes = self.skins_of_meshes();
        for (m, (mesh, poses)) in root.meshes.iter().zip(&mut meshes).enumerate() {
            let what = |p: usize| match &mesh.name {
                Some(name) => format!("mesh {m} \"{name}\", primitive {p}"),
                None => format!("mesh {m}, primitive {p}"),
            };
            let mut primitives = Vec::new();
            for (p, primitive) in mesh.primitives.iter().enumerate() {
                let extent = self.claimed_triangles(primitive);
                if let Some(mut primitive) = self.primitive(primitive, &what(p))? {
                    (primitive.source.mesh, primitive.source.primitive) = (m, p);
                    primitives.push(primitive);
                }
                (self.tick)(extent)?;
            }
            for (skin, range) in poses {
                let first = self.scene.primitives.len();
                let joints = skin.map(|skin| self.joints(skin)).transpose()?;
                for primitive in &primitives {
                    let p = primitive.source.primitive;
                    let posed = match (skin, &joints) {
                        (Some(skin), Some(joints)) => {
                            let attributes = &mesh.primitives[p].attributes;
                            self.posed(primitive, attributes, (*skin, joints), &what(p))?
                        }
                        _ => None,
                    };
                    self.scene.primitives.push(posed.unwrap_or_else(|| primitive.clone()));
                }
                Loader::share_scale(&mut self.scene.primitives[first..]);
                *range = first..self.scene.primitives.len();
            }
        }
        Ok(meshes)
    }

    fn primitive(&mut self, primitive: &json::Primitive, what: &str) -> Result<Option<Primitive>, Error> {
        if primitive.mode < 4 {
            self.warn(format!("{what} consists of points or lines; it was left out"));
            return Ok(None);
        }
        let attributes = &primitive.attributes;
        let Some(position) = attributes.position else {
            self.warn(format!("{what} has no POSITION; it was left out"));
            return Ok(None);
        };
        let material = primitive.material.unwrap_or(self.root.materials.len());
        if material >= self.scene.materials.len() {
            return Err(self.error(format!("{what}: material {material} does not exist")));
        }
        if !primitive.targets.is_empty() {
            self.warn(format!("{what} has morph targets; it is shown without them"));
        }

        let positions = self.accessors.floats::<3>(position, &format!("{what}: POSITION"))?;
        let positions: Vec<Vec3> = positions.into_iter().map(Vec3::from).collect();
        let mut uvs = [Vec::new(), Vec::new()];
        for (set, accessor) in [attributes.texcoord_0, attributes.texcoord_1].into_iter().enumerate() {
            if let Some(accessor) = accessor {
                let read = self.accessors.floats::<2>(accessor, &format!("{what}: TEXCOORD_{set}"))?;
                uvs[set] = read.into_iter().map(Vec2::from).collect();
            }
        }
        let colors = match attributes.color_0 {
            Some(accessor) => self.accessors.colors(accessor, &format!("{what}: COLOR_0"))?,
            None => Vec::new(),
        };
        let normals = match attributes.normal {
            Some(accessor) => self.accessors.floats::<3>(accessor, &format!("{what}: NORMAL"))?,
            None => Vec::new(),
        };
        let tangents = match attributes.tangent {
            Some(accessor) => self.accessors.floats::<4>(accessor, &format!("{what}: TANGENT"))?,
            None => Vec::new(),
        };
        let codes = match attributes.curvature {
            Some(accessor) => self.accessors.floats::<4>(accessor, &format!("{what}: _CURVATURE"))?,
            None => Vec::new(),
        };
        let counts = [
            ("_CURVATURE", codes.len(), attributes.curvature.is_some()),
            ("NORMAL", normals.len(), attributes.normal.is_some()),
            ("TANGENT", tangents.len(), attributes.tangent.is_some()),
            ("TEXCOORD_0", uvs[0].len(), attributes.texcoord_0.is_some()),
            ("TEXCOORD_1", uvs[1].len(), attributes.texcoord_1.is_some()),
            ("COLOR_0", colors.len(), attributes.color_0.is_some()),
        ];
        for (attribute, count, present) in counts {
            if present && count != positions.len() {
                return Err(self.error(format!(
                    "{what}: {attribute} has {count} elements and POSITION {}; they must be as many",
                    positions.len()
                )));
            }
        }

        let curvature = match attributes.curvature {
            Some(_) => Some(self.curvature(primitive, &codes, what)?),
            None => None,
        };

        let triangles = self.triangles(primitive, positions.len(), what)?;
        if triangles.is_empty() {
            self.warn(format!("{what} has no triangles; it was left out"));
            return Ok(None);
        }
        let mut primitive = Primitive {
            positions,
            normals: normals.into_iter().map(Vec3::from).collect(),
            tangents: tangents.into_iter().map(Vec4::from).collect(),
            uvs,
            colors: colors.into_iter().map(Vec4::from).collect(),
            curvature,
            triangles,
            material,
            source: Source {
                lacks_normals: attributes.normal.is_none(),
                lacks_tangents: attributes.tangent.is_none(),
                ..Source::default()
            },
        };
        self.complete(&mut primitive, what);
        Ok(Some(primitive))
    }

    /// `_CURVATURE` with the range that `KINRAN_mesh_curvature` gives.
    fn curvature(
        &mut self,
        primitive: &json::Primitive,
        codes: &[[f32; 4]],
        what: &str,
    ) -> Result<VertexCurvature, Error> {
        let extension: Option<json::MeshCurvature> =
            self.extension(&primitive.extensions, "KINRAN_mesh_curvature", what)?;
        let (range, millimetres) = extension.map_or((0.5, 1000.0), |e| (e.range, e.millimetres));
        for (name, value) in [("range", range), ("millimetres", millimetres)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(self.error(format!(
                    "{what}: KINRAN_mesh_curvature: {name} is {value}; it must be above zero"
                )));
            }
        }
        if let Some(at) = codes.iter().position(|code| code.iter().any(|x| !(0.0..=1.0).contains(x))) {
            return Err(self.error(format!(
                "{what}: element {at} of _CURVATURE is {:?}; its accessor must be normalised unsigned bytes",
                codes[at]
            )));
        }
        if primitive.attributes.tangent.is_none() {
            self.warn(format!(
                "{what} has _CURVATURE but no TANGENT, so its directions may be wrong; bake it anew"
            ));
        }
        Ok(VertexCurvature { codes: codes.iter().copied().map(Vec4::from).collect(), range, millimetres })
    }

    /// The vertex indices of each triangle (glTF 2.0 section 3.7.2.1, primitive topologies).
    fn triangles(
        &mut self,
        primitive: &json::Primitive,
        vertex_count: usize,
        what: &str,
    ) -> Result<Vec<[u32; 3]>, Error> {
        let count = match primitive.indices {
            Some(accessor) => self.root.accessors.get(accessor).map_or(0, |accessor| accessor.count),
            None => vertex_count as u64,
        };
        // Flat normals number the corners of all triangles: a strip's are nearly three times its indices.
        if count > u64::from(u32::MAX) / 3 || vertex_count as u64 > u64::from(u32::MAX) {
            return Err(self.error(format!("{what} has {count} indices; split it into smaller primitives")));
        }
        let indices = match primitive.indices {
            Some(accessor) => self.accessors.indices(accessor, &format!("{what}: indices"))?,
            None => (0..vertex_count as u32).collect(),
        };
        if let Some(at) = indices.iter().position(|&i| i as usize >= vertex_count) {
            return Err(self.error(format!(
                "{what}: index number {at} is {}, and there are {vertex_count} vertices",
                indices[at]
            )));
        }
        Ok(match primitive.mode {
            4 => {
                if !indices.len().is_multiple_of(3) {
                    self.warn(format!(
                        "{what} has {} indices, which is no multiple of three; the last ones were left out",
                        indices.len()
                    ));
                }
                indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect()
            }
            5 => (indices.windows(3).enumerate())
                .map(|(i, t)| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] })
                .collect(),
            6 => indices.windows(2).skip(1).map(|t| [t[0], t[1], indices[0]]).collect(),
            mode => return Err(self.error(format!("{what} has mode {mode}; 0 to 6 are allowed"))),
        })
    }

    /// Brings normals and tangents to unit length and supplies the missing ones.
    fn complete(&mut self, primitive: &mut Primitive, what: &str) {
        if primitive.normals.is_empty() {
            primitive.tangents = Vec::new();
            tangent::flatten(primitive);
        }
        let mut mended = 0;
        for normal in &mut primitive.normals {
            *normal = normal.as_dvec3().try_normalize().map_or_else(
                || {
                    mended += 1;
                    Vec3::Z
                },
                |unit| unit.as_vec3(),
            );
        }
        if mended > 0 {
            self.warn(format!("{what}: {mended} normals have no length; they were set to +z"));
        }

        let material = &self.scene.materials[primitive.material];
        let uses: Vec<&TextureRef> = material.textures().collect();
        let tangents_matter = material.needs_tangents();
        let tangent_set = material.tangent_uv_set();
        let missing: Vec<usize> = [0, 1]
            .into_iter()
            .filter(|&set| primitive.uvs[set].is_empty() && uses.iter().any(|texture| texture.uv_set == set))
            .collect();
        let name = material.name.clone();
        for set in missing {
            self.warn(format!(
                "{what} has no TEXCOORD_{set}, which its material \"{name}\" uses; (0, 0) is taken everywhere"
            ));
        }

        if !primitive.tangents.is_empty() {
            let mut mended = 0;
            for (tangent, &normal) in primitive.tangents.iter_mut().zip(&primitive.normals) {
                let sign = if tangent.w < 0.0 { -1.0 } else { 1.0 };
                *tangent = match tangent.truncate().as_dvec3().try_normalize() {
                    Some(unit) if unit.as_vec3().cross(normal) != Vec3::ZERO => unit.as_vec3().extend(sign),
                    _ => {
                        mended += 1;
                        tangent::arbitrary(normal)
                    }
                };
            }
            if mended > 0 {
                self.warn(format!(
                    "{what}: {mended} tangents have no length or point along the normal; any direction was taken"
                ));
            }
            return;
        }
        if primitive.uvs[tangent_set].is_empty() && tangents_matter {
            self.warn(format!(
                "{what} has neither TANGENT nor TEXCOORD_{tangent_set}, and its material \"{name}\" needs \
                 tangents; any direction was taken"
            ));
        }
        match [tangent_set, 1 - tangent_set].into_iter().find(|&set| !primitive.uvs[set].is_empty()) {
            Some(set) => tangent::generate(primitive, set),
            None => primitive.tangents = primitive.normals.iter().map(|&n| tangent::arbitrary(n)).collect(),
        }
    }

    /// Walks the scene's tree and places meshes, lights and cameras.
    fn nodes(&mut self, meshes: &[Poses]) -> Result<(), Error> {
        let root = self.root;
        let mut stack: Vec<(usize, DAffine3)> =
            self.roots()?.into_iter().rev().map(|node| (node, DAffine3::IDENTITY)).collect();
        let mut seen = vec![false; root.nodes.len()];
        while let Some((n, parent)) = stack.pop() {
            let node = root.nodes.get(n).ok_or_else(|| self.error(format!("node {n} does not exist")))?;
            let what = match &node.name {
                Some(name) => format!("node {n} \"{name}\""),
                None => format!("node {n}"),
            };
            if std::mem::replace(&mut seen[n], true) {
                return Err(self.error(format!("{what} is reached twice; nodes must form trees")));
            }
            let transform = parent * self.local_transform(node, &what)?;
            if !transform.is_finite() || !transform.as_affine3a().is_finite() {
                return Err(self.error(format!("{what}: its place in the world is too large for a float")));
            }
            // Last in, first out: reversed, children come in the document's order.
            stack.extend(node.children.iter().rev().map(|&child| (child, transform)));

            if let Some(mesh) = node.mesh {
                let poses = (meshes.get(mesh))
                    .ok_or_else(|| self.error(format!("{what}: mesh {mesh} does not exist")))?;
                let skin = node.skin.filter(|_| self.needs.rest_pose);
                if node.skin.is_some() {
                    self.warn(format!("{what} is skinned; it is shown in its rest pose"));
                }
                let instances = self.instances(node, &what)?;
                let primitives = poses[&skin].clone();
                for (i, local) in instances.into_iter().enumerate() {
                    for primitive in primitives.clone() {
                        match &self.scene.primitives[primitive].source.pose {
                            None => self.place(primitive, transform * local, &what)?,
                            // The joints say where it is; glTF ignores the node's own place.
                            Some(pose) if i == 0 => {
                                let size = DVec3::splat(f64::from(pose.scale > 0.0));
                                let place = DAffine3::from_scale_rotation_translation(
                                    size,
                                    DQuat::IDENTITY,
                                    pose.origin.as_dvec3(),
                                );
                                self.place(primitive, place, &what)?;
                            }
                            Some(_) => {}
                        }
                    }
                }
            }
            if let Some(light) = &node.extensions.light {
                self.light(light.light, transform, &what)?;
            }
            if let Some(camera) = node.camera {
                self.camera(camera, transform, &what)?;
            }
        }
        Ok(())
    }

    /// The default scene's root nodes; without scenes, the nodes that are nobody's children.
    fn roots(&mut self) -> Result<Vec<usize>, Error> {
        let root = self.root;
        if root.scenes.is_empty() {
            let mut is_child = vec![false; root.nodes.len()];
            for &child in root.nodes.iter().flat_map(|node| &node.children) {
                if let Some(flag) = is_child.get_mut(child) {
                    *flag = true;
                }
            }
            return Ok((0..root.nodes.len()).filter(|&n| !is_child[n]).collect());
        }
        let index = root.scene.unwrap_or(0);
        let scene =
            root.scenes.get(index).ok_or_else(|| self.error(format!("scene {index} does not exist")))?;
        if root.scenes.len() > 1 {
            self.warn(format!("the document has {} scenes; number {index} is read", root.scenes.len()));
        }
        Ok(scene.nodes.clone())
    }

    fn local_transform(&self, node: &json::Node, what: &str) -> Result<DAffine3, Error> {
        if let Some(matrix) = &node.matrix {
            let matrix = DMat4::from_cols_array(matrix);
            if matrix.row(3) != DVec4::W {
                return Err(self.error(format!("{what}: the last row of its matrix is not 0 0 0 1")));
            }
            return Ok(DAffine3::from_mat4(matrix));
        }
        let rotation = DQuat::from_array(node.rotation);
        if rotation.length_squared() == 0.0 {
            return Err(self.error(format!("{what}: its rotation is the quaternion 0 0 0 0")));
        }
        Ok(DAffine3::from_scale_rotation_translation(
            DVec3::from(node.scale),
            rotation.normalize(),
            DVec3::from(node.translation),
        ))
    }

    /// The places of a node's mesh in the node's space: one, or those of `EXT_mesh_gpu_instancing`.
    fn instances(&mut self, node: &json::Node, what: &str) -> Result<Vec<DAffine3>, Error> {
        let Some(instancing) = &node.extensions.instancing else { return Ok(vec![DAffine3::IDENTITY]) };
        let attributes = &instancing.attributes;
        let what = format!("{what}: EXT_mesh_gpu_instancing");
        let translations = match attributes.translation {
            Some(accessor) => Some(self.accessors.floats::<3>(accessor, &format!("{what}: TRANSLATION"))?),
            None => None,
        };
        let rotations = match attributes.rotation {
            Some(accessor) => Some(self.accessors.floats::<4>(accessor, &format!("{what}: ROTATION"))?),
            None => None,
        };
        let scales = match attributes.scale {
            Some(accessor) => Some(self.accessors.floats::<3>(accessor, &format!("{what}: SCALE"))?),
            None => None,
        };
        let counts: Vec<usize> = [
            translations.as_ref().map(Vec::len),
            rotations.as_ref().map(Vec::len),
            scales.as_ref().map(Vec::len),
        ]
        .into_iter()
        .flatten()
        .collect();
        let count = counts.first().copied().unwrap_or(0);
        if counts.iter().any(|&other| other != count) {
            return Err(
                self.error(format!("{what}: its attributes have {counts:?} elements; they must be as many"))
            );
        }
        (0..count)
            .map(|i| {
                let rotation =
                    rotations.as_ref().map_or(DQuat::IDENTITY, |all| Quat::from_array(all[i]).as_dquat());
                if rotation.length_squared() == 0.0 {
                    return Err(self.error(format!("{what}: the rotation of instance {i} is 0 0 0 0")));
                }
                Ok(DAffine3::from_scale_rotation_translation(
                    scales.as_ref().map_or(DVec3::ONE, |all| Vec3::from(all[i]).as_dvec3()),
                    rotation.normalize(),
                    translations.as_ref().map_or(DVec3::ZERO, |all| Vec3::from(all[i]).as_dvec3()),
                ))
            })
            .collect()
    }

    fn place(&mut self, primitive: usize, transform: DAffine3, what: &str) -> Result<(), Error> {
        let transform = transform.as_affine3a();
        if !transform.is_finite() || !transform.inverse().is_finite() {
            self.warn(format!("{what} is scaled to nothing along an axis; its mesh was left out"));
            return Ok(());
        }
        if self.scene.instances.len() >= INSTANCES_MAX {
            return Err(self.error(format!("{what}: the scene has more than {INSTANCES_MAX} instances")));
        }
        self.scene.instances.push(Instance { primitive, transform });
        Ok(())
    }

    /// `KHR_lights_punctual`: a light shines along its node's -z, and scale does not matter to it.
    fn light(&mut self, index: usize, transform: DAffine3, what: &str) -> Result<(), Error> {
        let root = self.root;
        let light = (root.extensions.lights.as_ref())
            .and_then(|extension| extension.lights.get(index))
            .ok_or_else(|| self.error(format!("{what}: light {index} does not exist")))?;
        let what = format!("light {index}");
        let kind = match light.kind.as_str() {
            "directional" => LightKind::Directional,
            "point" => LightKind::Point,
            "spot" => {
                let json::Spot { inner_cone_angle, outer_cone_angle } = light.spot;
                // The negation also catches NaN.
                if !(0.0 <= inner_cone_angle
                    && inner_cone_angle < outer_cone_angle
                    && outer_cone_angle <= std::f32::consts::FRAC_PI_2)
                {
                    return Err(self.error(format!(
                        "{what}: its cone angles are {inner_cone_angle} and {outer_cone_angle}; \
                         0 <= inner < outer <= pi/2 is required"
                    )));
                }
                LightKind::Spot { inner_cone_angle, outer_cone_angle }
            }
            other => {
                return Err(
                    self.error(format!("{what}: type \"{other}\"; directional, point or spot are allowed"))
                );
            }
        };
        let color = Vec3::from(self.finite(light.color, &format!("{what}: color"))?)
            * self.finite([light.intensity], &format!("{what}: intensity"))?[0];
        self.finite(color.to_array(), &format!("{what}: color times intensity"))?;
        if light.range.is_some_and(|range| range.is_nan() || range <= 0.0) {
            return Err(self.error(format!("{what}: its range is {:?}; it must be positive", light.range)));
        }
        let Some(direction) = (-transform.matrix3.z_axis).try_normalize() else {
            self.warn(format!("{what} stands in a node that is scaled to nothing; it was left out"));
            return Ok(());
        };
        if !transform.translation.as_vec3().is_finite() {
            self.warn(format!("{what} stands farther away than a float can say; it was left out"));
            return Ok(());
        }
        self.scene.lights.push(Light {
            kind,
            color,
            position: transform.translation.as_vec3(),
            direction: direction.as_vec3(),
            range: light.range.unwrap_or(f32::INFINITY),
        });
        Ok(())
    }

    fn camera(&mut self, index: usize, transform: DAffine3, what: &str) -> Result<(), Error> {
        let root = self.root;
        let camera = (root.cameras.get(index))
            .ok_or_else(|| self.error(format!("{what}: camera {index} does not exist")))?;
        let what = match &camera.name {
            Some(name) => format!("camera {index} \"{name}\""),
            None => format!("camera {index}"),
        };
        let Some(perspective) = &camera.perspective else {
            self.warn(format!("{what} is orthographic; it was left out"));
            return Ok(());
        };
        let yfov = perspective.yfov;
        if !(0.0 < yfov && yfov < std::f32::consts::PI) {
            return Err(self.error(format!("{what}: its yfov is {yfov}; it must lie between 0 and pi")));
        }
        let z = transform.matrix3.z_axis.try_normalize();
        let x = z.and_then(|z| transform.matrix3.y_axis.cross(z).try_normalize());
        let (Some(x), Some(z)) = (x, z) else {
            self.warn(format!("{what} stands in a node that is scaled to nothing; it was left out"));
            return Ok(());
        };
        let rigid =
            DAffine3::from_mat3_translation(DMat3::from_cols(x, z.cross(x), z), transform.translation);
        let transform = rigid.as_affine3a();
        if !transform.is_finite() {
            self.warn(format!("{what} stands farther away than a float can say; it was left out"));
            return Ok(());
        }
        self.scene.cameras.push(Camera { transform, yfov });
        Ok(())
    }

    /// Which images are drawn, and which are engine textures beside them.
    fn needed_images(&self) -> (Vec<Drawn>, Vec<bool>) {
        let count = self.root.images.len();
        let (mut drawn, mut runtime) = (vec![Drawn::Not; count], vec![false; count]);
        let maps = self.needs.maps;
        let materials = self.scene.materials.iter().filter(|_| self.needs.reflectance);
        for texture in materials.flat_map(Material::reflecting) {
            drawn[texture.image] = Drawn::Wished;
        }
        for texture in self.scene.materials.iter().flat_map(|material| material.needed(maps)) {
            drawn[texture.image] = Drawn::Needed;
            if let Some(image) = texture.runtime.filter(|_| maps == Maps::All) {
                runtime[image] = true;
            }
        }
        (drawn, runtime)
    }

    /// Triangles of a primitive, as the document claims.
    fn claimed_triangles(&self, primitive: &json::Primitive) -> u64 {
        let accessor = primitive.indices.or(primitive.attributes.position);
        accessor.and_then(|accessor| self.root.accessors.get(accessor)).map_or(0, |a| a.count / 3)
    }

    /// All that is to be read, in triangles.
    fn extent(&self) -> u64 {
        let (drawn, runtime) = self.needed_images();
        let drawn = drawn.into_iter().map(|drawn| drawn != Drawn::Not);
        let images = drawn.chain(runtime).filter(|&needed| needed).count() as u64;
        let primitives = self.root.meshes.iter().flat_map(|mesh| &mesh.primitives);
        let triangles = primitives.filter(|_| self.needs.geometry).map(|p| self.claimed_triangles(p));
        triangles.fold(images * IMAGE, u64::saturating_add)
    }

    /// Decodes the images that materials use, and reads the runtime textures.
    fn images(&mut self, resolve: &Resolver<'_>) -> Result<(), Error> {
        let (drawn, runtime) = self.needed_images();
        let texels = AtomicU64::new(0);
        let images: Vec<Result<_, Error>> = (drawn.par_iter().enumerate())
            .map(|(i, &used)| {
                if used == Drawn::Not {
                    return Ok(None);
                }
                let image = self.image(i, &texels, resolve);
                (self.tick)(IMAGE)?;
                image.map(|image| Some(Arc::new(image)))
            })
            .collect();
        let mut fault: Option<Error> = None;
        for (image, used) in images.into_iter().zip(&drawn) {
            let image = match image {
                Ok(image) => image,
                Err(Error::Cancelled(cancelled)) => return Err(cancelled.into()),
                Err(error) => {
                    if *used == Drawn::Wished {
                        self.warn(format!("{error}; what it reflects is not known"));
                    } else if self.needs.forgiving
                        && matches!(error, Error::Unreadable { .. } | Error::Image(_))
                    {
                        self.warn(error.to_string());
                    } else {
                        match (&mut fault, error) {
                            (Some(Error::Unreadable { others, .. }), Error::Unreadable { file, .. }) => {
                                others.push(file);
                            }
                            (Some(_), _) => {}
                            (fault, error) => *fault = Some(error),
                        }
                    }
                    None
                }
            };
            self.scene.images.push(image);
        }
        if let Some(fault) = fault {
            return Err(fault);
        }
        let textures = (runtime.into_par_iter().enumerate())
            .map(|(i, used)| {
                if !used {
                    return Ok(Ok(None));
                }
                let texture = self.runtime_texture(i, resolve);
                (self.tick)(IMAGE)?;
                Ok(texture.map(Some))
            })
            .collect::<Result<Vec<Result<_, Error>>, Cancelled>>()?;
        for (texture, drawn) in textures.into_iter().zip(drawn) {
            let texture = match texture {
                Ok(texture) => texture.map(Arc::new),
                // Without another image it is drawn itself, and an error was returned already.
                Err(error) if drawn == Drawn::Not => {
                    self.warn(format!("{error}; the PNG or JPEG beside it is taken"));
                    None
                }
                // It was told of the image already.
                Err(_) if self.needs.forgiving => None,
                Err(error) => return Err(error),
            };
            self.scene.textures.push(texture);
        }
        Ok(())
    }

    fn runtime_texture(&self, index: usize, resolve: &Resolver<'_>) -> Result<Texture, Error> {
        let mut fetched = Vec::new();
        let (name, bytes) = self.image_bytes(index, &mut fetched, resolve)?;
        let texture = kinran_image::decode_texture(&name, bytes)?;
        texture.check()?;
        Ok(texture)
    }

    /// What errors call an image, and its file's bytes, which `fetched` keeps where they are not in a buffer.
    fn image_bytes<'a>(
        &'a self,
        index: usize,
        fetched: &'a mut Vec<u8>,
        resolve: &Resolver<'_>,
    ) -> Result<(PathBuf, &'a [u8]), Error> {
        let what = format!("image {index}");
        let image = &self.root.images[index];
        let (name, bytes) = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => {
                *fetched = fetch(self.name, &what, Purpose::Image, uri, resolve)?;
                let name = if uri.starts_with("data:") { what } else { format!("{what} \"{uri}\"") };
                (name, fetched.as_slice())
            }
            (None, Some(view)) => (what.clone(), self.accessors.view(view, &what)?),
            (None, None) => return Err(self.error(format!("{what} has neither uri nor bufferView"))),
        };
        Ok((PathBuf::from(format!("{}: {name}", self.name.display())), bytes))
    }

    fn image(&self, index: usize, texels: &AtomicU64, resolve: &Resolver<'_>) -> Result<Image, Error> {
        let mut fetched = Vec::new();
        let (name, bytes) = self.image_bytes(index, &mut fetched, resolve)?;
        let mut decoded = kinran_image::decode_image(&name, bytes)?;
        if !matches!(decoded.pixels, Pixels::F32(_)) {
            // glTF says by the slot what is colour, and that it is sRGB.
            decoded.transfer = Transfer::Unsaid;
        }
        let size = u64::from(decoded.width) * u64::from(decoded.height);
        if texels.fetch_add(size, Ordering::Relaxed) + size > TEXELS_MAX {
            return Err(Error::unsupported(
                self.name,
                format!("its images have more than {TEXELS_MAX} texels together; scale them down"),
            ));
        }
        Ok(decoded)
    }
}

/// The matrix of `KHR_texture_transform`, translation times rotation times scale.
///
/// The rotation is the one that the extension's text and its examples mean and that viewers implement,
/// counter-clockwise as seen with v downwards: `u' = u cos + v sin`, `v' = v cos - u sin`.
fn texture_transform(extension: &json::TextureTransform) -> Mat3 {
    let (sin, cos) = libm::sincosf(extension.rotation);
    let [x, y] = extension.scale;
    Mat3::from_cols(
        Vec3::new(cos * x, -sin * x, 0.0),
        Vec3::new(sin * y, cos * y, 0.0),
        Vec2::from(extension.offset).extend(1.0),
    )
}
