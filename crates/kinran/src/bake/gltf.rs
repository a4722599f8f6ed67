//! A glTF file: its materials' textures are replaced by baked ones, everything else stays.

use std::path::Path;

use kinran_bake::aniso::{RoughnessMaps, Sheet, SheetRequest, bake_surface};
use kinran_bake::{MaterialSurface, NoSurface, bake_plain, material_surface};
use kinran_image::{
    Channels, Encoder, Encoding, Format, Image, Pixels, Preset, Role, Texture, Transfer, full_level_count,
    level_size, write_png,
};
use kinran_scene::{Document, FUZZ_EXTENSION, Scene, Slot, TextureExtension, TextureRef};
use serde_json::Value;

use super::{
    Args, Form, Input, Output, Report, SurfaceReport, curvature, file_name, file_stem, write_texture,
};
use crate::{Console, Error};

/// Bakes a glTF file and tells what came of it.
pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let report = bake_gltf(args, console)?;
    for warning in &report.warnings {
        console.warn(warning);
    }
    let model = args.output().join(file_name(&args.input));
    console.result(&report, &format!("{}{}\n", report.text(args.output()), model.display()))
}

/// Bakes every material of a glTF file that has a normal or an anisotropy map.
///
/// Each baked texture keeps a PNG or JPEG of level 0 as the fallback that glTF wants: the original image, or,
/// where a factor was baked in, a new one.
///
/// # Errors
/// See [`run`](super::run).
pub fn bake_gltf(args: &Args, console: &Console) -> Result<Report, Error> {
    let output = args.output().join(file_name(&args.input));
    let same = |a: &Path, b: &Path| a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b));
    if same(&output, &args.input) {
        return Err(Error::Usage(format!(
            "{}: the baked model would overwrite it; name another folder with --output",
            args.input.display()
        )));
    }
    let (_files, scene, mut document) = read(args)?;
    let mut report = Report::new(args);
    let surfaces = surfaces(args, &scene, &document, &mut report);
    std::fs::create_dir_all(args.output()).map_err(|e| kinran_image::Error::io(args.output(), e))?;

    let stem = args.input.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let mut names = Names::default();
    for (_, materials, surface) in &surfaces {
        let name = names.unique(&format!("{stem}_{}", file_stem(&scene.materials[materials[0]].name)));
        let mut baker = SurfaceBaker { args, console, scene: &scene, document: &mut document, name };
        report.surfaces.push(baker.bake(materials, surface)?);
    }
    if args.all_textures {
        bake_colors(args, &scene, &mut document, &mut names, &stem, &mut report)?;
    }
    report.curvature = curvature::bake(args, console, &scene, &mut document, &mut report.warnings)?;

    for (i, material) in scene.materials.iter().enumerate().take(document.material_count()) {
        let extensions = document.material(i).get("extensions");
        let has = |name| extensions.is_some_and(|e| e.get(name).is_some());
        if let (Some(fuzz), true, false) = (&material.fuzz, has(FUZZ_EXTENSION), has("KHR_materials_sheen")) {
            // What viewers show that know nothing of fuzz.
            fuzz.write(document.material_mut(i));
            document.use_extension("KHR_materials_sheen", false);
        }
    }
    report.warnings.extend(document.write(&output)?);
    report.write(&args.output().join(format!("{stem}.kinran.json")))?;
    Ok(report)
}

/// The model as it is baked: its skin marked, its normals estimated where that was asked for. The document reads the
/// files of the folder that comes with it when it needs them.
fn read(args: &Args) -> Result<(Option<tempfile::TempDir>, Scene, Document), Error> {
    let smoothed = curvature::with_normals(&args.input, &args.curvature)?;
    let input =
        smoothed.as_ref().map_or_else(|| args.input.clone(), |f| f.path().join(file_name(&args.input)));
    let mut scene = Scene::load(&input)?;
    let mut document = Document::open(&input)?;
    curvature::mark_skin(&args.curvature, &mut scene, &mut document)?;
    Ok((smoothed, scene, document))
}

/// The surfaces of a document's materials; materials that share one share its textures.
fn surfaces(
    args: &Args,
    scene: &Scene,
    document: &Document,
    report: &mut Report,
) -> Vec<(Key, Vec<usize>, MaterialSurface)> {
    report.warnings.clone_from(&scene.warnings);
    let mut surfaces: Vec<(Key, Vec<usize>, MaterialSurface)> = Vec::new();
    // A document without materials has one in the scene that it cannot name.
    for material in 0..document.material_count().min(scene.materials.len()) {
        match material_surface(scene, material) {
            Ok(surface) => {
                let key = Key::new(scene, material);
                match surfaces.iter_mut().find(|(known, ..)| *known == key) {
                    Some((_, materials, _)) => materials.push(material),
                    None => surfaces.push((key, vec![material], surface)),
                }
            }
            Err(NoSurface::Plain) => {}
            Err(NoSurface::Apart(reason)) => report.warnings.push(reason),
        }
    }
    let skin = scene.primitives.iter().any(|p| args.curvature.wants(scene, p));
    if surfaces.is_empty() && !args.all_textures && !skin {
        report.warnings.push(format!(
            "{}: no material has a normal or an anisotropy map; nothing but --all-textures would bake anything",
            file_name(&args.input)
        ));
    }
    surfaces
}

/// What makes two materials' surfaces the same.
#[derive(Debug, PartialEq)]
struct Key {
    places: [Option<TextureRef>; 3],
    normal_scale: f32,
    roughness: f32,
    anisotropy: Option<(f32, f32)>,
    occlusion_packed: bool,
}

impl Key {
    fn new(scene: &Scene, material: usize) -> Self {
        let m = &scene.materials[material];
        let anisotropy = m.anisotropy.as_ref().filter(|a| a.strength > 0.0);
        Key {
            places: [
                m.normal.clone(),
                m.metallic_roughness.clone(),
                anisotropy.and_then(|a| a.texture.clone()),
            ],
            normal_scale: m.normal_scale,
            roughness: m.roughness_factor,
            anisotropy: anisotropy.map(|a| (a.strength, a.rotation)),
            occlusion_packed: occlusion_is_packed(scene, material),
        }
    }
}

/// Whether occlusion is read from the metallic-roughness texture.
fn occlusion_is_packed(scene: &Scene, material: usize) -> bool {
    let m = &scene.materials[material];
    m.occlusion.is_some() && m.occlusion == m.metallic_roughness
}

/// File names given so far.
#[derive(Default)]
struct Names(Vec<String>);

impl Names {
    fn unique(&mut self, name: &str) -> String {
        let candidates = std::iter::once(name.to_owned()).chain((2..).map(|i| format!("{name}_{i}")));
        let free = |candidate: &String| !self.0.iter().any(|known| known.eq_ignore_ascii_case(candidate));
        let unique = candidates.into_iter().find(free).unwrap_or_default();
        self.0.push(unique.clone());
        unique
    }
}

struct SurfaceBaker<'a> {
    args: &'a Args,
    console: &'a Console,
    scene: &'a Scene,
    document: &'a mut Document,
    name: String,
}

/// A sheet, the slot it goes to, and whether the slot's image no longer shows level 0.
struct Planned {
    sheet: Sheet,
    slot: Slot,
    changed: bool,
}

impl SurfaceBaker<'_> {
    fn bake(&mut self, materials: &[usize], surface: &MaterialSurface) -> Result<SurfaceReport, Error> {
        let args = self.args;
        let m = &self.scene.materials[materials[0]];
        let maps = &surface.maps;
        let size = maps.size();
        let mr = m.metallic_roughness.as_ref().and_then(|place| self.scene.images[place.image].clone());
        let directed = matches!(maps.roughness, RoughnessMaps::Khr { .. });

        // Factors are baked into the textures; an image that showed level 0 without them is replaced.
        let mut planned = Vec::new();
        if m.normal.is_some() {
            planned.push(Planned {
                sheet: Sheet::Normal,
                slot: Slot::Normal,
                changed: m.normal_scale != 1.0,
            });
        }
        planned.push(Planned {
            sheet: if directed { Sheet::Roughness } else { Sheet::IsotropicRoughness },
            slot: Slot::MetallicRoughness,
            changed: m.roughness_factor != 1.0 || mr.is_none(),
        });
        if let Some(a) = m.anisotropy.as_ref().filter(|_| directed) {
            planned.push(Planned {
                sheet: Sheet::KhrAnisotropy,
                slot: Slot::Anisotropy,
                changed: a.strength != 1.0 || a.rotation != 0.0 || a.texture.is_none(),
            });
        }

        let mut requests: Vec<SheetRequest> = planned
            .iter()
            .map(|planned| {
                let (role, format) = match planned.sheet {
                    Sheet::Normal => (Role::Normal, args.normal_format),
                    Sheet::Roughness | Sheet::IsotropicRoughness => (Role::Data, args.aniso_format),
                    Sheet::Aniso | Sheet::KhrAnisotropy => (Role::Aniso, args.aniso_format),
                };
                let is_roughness = planned.slot == Slot::MetallicRoughness;
                SheetRequest {
                    sheet: planned.sheet,
                    encoding: args.encoding(role, format),
                    packed_with: mr.as_deref().filter(|_| is_roughness),
                }
            })
            .collect();
        let plain = Encoding { format: Format::Rgba8, encoder: Encoder::Portable, preset: Preset::Fast };
        let fallbacks: Vec<SheetRequest> = planned
            .iter()
            .zip(&requests)
            .filter(|(planned, _)| planned.changed)
            .map(|(_, request)| SheetRequest { encoding: plain, ..request.clone() })
            .collect();
        requests.extend(fallbacks);
        if args.form.is_some_and(Form::aniso) {
            requests.push(SheetRequest {
                sheet: Sheet::Aniso,
                encoding: args.encoding(Role::Aniso, args.aniso_format),
                packed_with: None,
            });
        }

        let texels = (0..full_level_count(size.0, size.1))
            .map(|level| u64::from(level_size(size.0, level)) * u64::from(level_size(size.1, level)))
            .sum();
        let stage = self.console.progress().stage(format!("{} {}", args.filter.name(), m.name), texels);
        let baked = bake_surface(maps, args.options(), &requests, &|texels| stage.add(texels))?;

        let mut report = SurfaceReport {
            name: m.name.clone(),
            inputs: self.inputs(materials[0])?,
            outputs: Vec::new(),
            levels: baked.levels,
        };
        let mut textures = baked.textures;
        let aniso = args.form.is_some_and(Form::aniso).then(|| textures.pop()).flatten();
        let mut fallback = textures.split_off(planned.len()).into_iter();
        for (planned, texture) in planned.iter().zip(textures) {
            let image = if planned.changed { fallback.next() } else { None };
            report.outputs.extend(self.place(planned, texture, image, materials, &surface.place)?);
        }
        if let Some(aniso) = aniso {
            let outputs = write_texture(args, &format!("{}_aniso", self.name), "aniso", aniso)?;
            self.place_aniso(&outputs, materials);
            report.outputs.extend(outputs);
        }
        Ok(report)
    }

    /// Writes a texture and puts it into its slot of every material.
    fn place(
        &mut self,
        planned: &Planned,
        texture: Texture,
        fallback: Option<Texture>,
        materials: &[usize],
        place: &TextureRef,
    ) -> Result<Vec<Output>, Error> {
        let map = planned.sheet.name();
        let name = format!("{}_{map}", self.name);
        let outputs = write_texture(self.args, &name, map, texture)?;

        let old = self.document.texture(materials[0], planned.slot);
        let source = match fallback {
            Some(level_0) => {
                let file = format!("{name}.png");
                let path = self.args.output().join(&file);
                refuse_authored(self.document, &path)?;
                write_png(&path, &image_of(&level_0)?)?;
                Some(self.document.add_image_file(&file))
            }
            None => old.and_then(|texture| self.document.texture_image(texture)),
        };
        let alternatives = alternatives(self.document, &outputs);
        let other = |slot| self.document.texture(materials[0], slot);
        let like = old.or_else(|| other(Slot::Normal)).or_else(|| other(Slot::Anisotropy));
        let new = self.document.add_texture(like, source, &alternatives);
        for &material in materials {
            let had = self.document.texture(material, planned.slot).is_some();
            let occlusion =
                planned.slot == Slot::MetallicRoughness && occlusion_is_packed(self.scene, material);
            self.document.set_texture(material, planned.slot, new);
            if occlusion {
                self.document.set_texture(material, Slot::Occlusion, new);
            }
            reset_factors(self.document.material_mut(material), planned.slot, (!had).then_some(place));
        }
        Ok(outputs)
    }

    /// Refers to an aniso texture, which lies as the normal map does, or as the anisotropy map where there is none.
    fn place_aniso(&mut self, outputs: &[Output], materials: &[usize]) {
        let alternatives = alternatives(self.document, outputs);
        let slots = [Slot::Normal, Slot::Anisotropy];
        let like = slots.iter().find_map(|&slot| self.document.texture(materials[0], slot));
        let new = self.document.add_optional_texture(like, &alternatives);
        for &material in materials {
            self.document.set_texture(material, Slot::Aniso, new);
            let material = self.document.material_mut(material);
            let info = like_surface(material);
            let texture = material.get_mut("extensions").and_then(|e| e.get_mut("KINRAN_materials_aniso"));
            if let Some(texture) =
                texture.and_then(|e| e.get_mut("anisoTexture")).and_then(Value::as_object_mut)
            {
                texture.extend(info);
            }
        }
    }

    fn inputs(&self, material: usize) -> Result<Vec<Input>, Error> {
        let m = &self.scene.materials[material];
        let anisotropy = m.anisotropy.as_ref().and_then(|a| a.texture.as_ref());
        let roughness = m.metallic_roughness.as_ref();
        [("normal", m.normal.as_ref()), ("metallicRoughness", roughness), ("anisotropy", anisotropy)]
            .into_iter()
            .filter_map(|(role, place)| Some((role, place?)))
            .filter_map(|(role, place)| Some((role, place, self.scene.images[place.image].as_ref()?)))
            .map(|(role, place, image)| input(self.document, place.image, role, image))
            .collect()
    }
}

fn input(document: &Document, index: usize, role: &str, image: &Image) -> Result<Input, Error> {
    Ok(Input {
        file: document.image_name(index),
        role: role.into(),
        width: image.width,
        height: image.height,
        blake3: blake3::hash(&document.image_bytes(index)?).to_hex().to_string(),
    })
}

/// The files of a texture as a document refers to them.
fn alternatives(document: &mut Document, outputs: &[Output]) -> Vec<(TextureExtension, usize)> {
    outputs
        .iter()
        .map(|output| {
            let dds = Path::new(&output.file).extension().is_some_and(|e| e == "dds");
            let extension = if dds { TextureExtension::Dds } else { TextureExtension::Ktx2 };
            (extension, document.add_image_file(&output.file))
        })
        .collect()
}

/// Where a material's normal map lies on the mesh, or its anisotropy map where there is none.
fn like_surface(material: &kinran_scene::Object) -> kinran_scene::Object {
    let anisotropy = (material.get("extensions"))
        .and_then(|e| e.get("KHR_materials_anisotropy")?.get("anisotropyTexture"));
    let texture = material.get("normalTexture").or(anisotropy).and_then(Value::as_object);
    let mut like = texture.cloned().unwrap_or_default();
    like.retain(|key, _| key == "texCoord" || key == "extensions");
    like
}

/// Sets the factors that are in the texture now to one, and lays a texture that is new on the mesh as `place`
/// says.
fn reset_factors(material: &mut kinran_scene::Object, slot: Slot, place: Option<&TextureRef>) {
    let like = like_surface(material);
    let lay = |texture: Option<&mut Value>| {
        if let (Some(texture), Some(_)) = (texture.and_then(Value::as_object_mut), place) {
            texture.extend(like.clone());
        }
    };
    match slot {
        Slot::Normal => {
            if let Some(texture) = material.get_mut("normalTexture").and_then(Value::as_object_mut) {
                texture.shift_remove("scale");
            }
        }
        Slot::MetallicRoughness => {
            if let Some(pbr) = material.get_mut("pbrMetallicRoughness").and_then(Value::as_object_mut) {
                pbr.shift_remove("roughnessFactor");
                lay(pbr.get_mut("metallicRoughnessTexture"));
            }
        }
        Slot::Anisotropy => {
            let extension = material
                .get_mut("extensions")
                .and_then(|e| e.get_mut("KHR_materials_anisotropy"))
                .and_then(Value::as_object_mut);
            if let Some(extension) = extension {
                extension.insert("anisotropyStrength".into(), 1.0.into());
                extension.shift_remove("anisotropyRotation");
                lay(extension.get_mut("anisotropyTexture"));
            }
        }
        _ => {}
    }
}

/// Refuses to write over one of the document's own images.
fn refuse_authored(document: &Document, path: &Path) -> Result<(), Error> {
    let Ok(existing) = path.canonicalize() else { return Ok(()) };
    let folder = document.path().parent().unwrap_or(Path::new(""));
    let images = document.json().get("images").and_then(Value::as_array).into_iter().flatten();
    let authored = images.filter_map(|image| folder.join(image.get("uri")?.as_str()?).canonicalize().ok());
    if authored.into_iter().any(|image| image == existing) {
        return Err(Error::Usage(format!(
            "{}: is a map of the model that is baked and would be overwritten; name another folder with --output",
            path.display()
        )));
    }
    Ok(())
}

/// Level 0 of an RGBA8 texture as an RGB image.
fn image_of(texture: &Texture) -> Result<Image, Error> {
    let level = &texture.levels[0];
    let rgb = level.data.chunks_exact(4).flat_map(|t| [t[0], t[1], t[2]]).collect();
    Ok(Image::new(level.width, level.height, Channels::Rgb, Pixels::U8(rgb))?)
}

/// Bakes the textures that need no filter of their own: base colour, emission, occlusion.
fn bake_colors(
    args: &Args,
    scene: &Scene,
    document: &mut Document,
    names: &mut Names,
    stem: &str,
    report: &mut Report,
) -> Result<(), Error> {
    let mut baked: Vec<(TextureRef, Transfer, usize)> = Vec::new();
    for material in 0..document.material_count().min(scene.materials.len()) {
        let m = &scene.materials[material];
        let occlusion = m.occlusion.as_ref().filter(|_| !occlusion_is_packed(scene, material));
        for (slot, place, transfer) in [
            (Slot::BaseColor, m.base_color.as_ref(), Transfer::Srgb),
            (Slot::Emissive, m.emissive.as_ref(), Transfer::Srgb),
            (Slot::Occlusion, occlusion, Transfer::Linear),
        ] {
            let Some(place) = place else { continue };
            let known = baked.iter().find(|(p, t, _)| p == place && *t == transfer);
            let texture = match known {
                Some((.., texture)) => *texture,
                None => {
                    let Some(image) = &scene.images[place.image] else { continue };
                    let (role, map) = match transfer {
                        Transfer::Srgb => (Role::Color, "color"),
                        Transfer::Linear => (Role::Data, "data"),
                    };
                    let name = names
                        .unique(&format!("{stem}_{}_{map}", file_stem(&document.image_name(place.image))));
                    let encoding = args.encoding(role, args.color_format);
                    let texture = bake_plain(image, transfer, encoding, args.options().kernel, place.wrap)?;
                    let outputs = write_texture(args, &name, map, texture)?;
                    let old = document.texture(material, slot);
                    let source = old.and_then(|texture| document.texture_image(texture));
                    let alternatives = alternatives(document, &outputs);
                    let texture = document.add_texture(old, source, &alternatives);
                    report.surfaces.push(SurfaceReport {
                        name,
                        inputs: vec![input(document, place.image, map, image)?],
                        outputs,
                        levels: Vec::new(),
                    });
                    baked.push((place.clone(), transfer, texture));
                    texture
                }
            };
            document.set_texture(material, slot, texture);
        }
    }
    Ok(())
}

/// Says which materials would be baked from what.
pub(super) fn dry_run(args: &Args, console: &Console) -> Result<(), Error> {
    #[derive(serde::Serialize)]
    struct Row<'a> {
        materials: Vec<&'a str>,
        width: u32,
        height: u32,
        anisotropic: bool,
    }
    let (_files, scene, document) = read(args)?;
    let mut report = Report::new(args);
    let surfaces = surfaces(args, &scene, &document, &mut report);
    let rows: Vec<Row> = surfaces
        .iter()
        .map(|(_, materials, surface)| Row {
            materials: materials.iter().map(|&i| scene.materials[i].name.as_str()).collect(),
            width: surface.maps.size().0,
            height: surface.maps.size().1,
            anisotropic: matches!(surface.maps.roughness, RoughnessMaps::Khr { .. }),
        })
        .collect();
    let mut text = String::new();
    for row in &rows {
        let kind = if row.anisotropic { "anisotropic" } else { "isotropic" };
        text += &format!("{}x{} {kind}: {}\n", row.width, row.height, row.materials.join(", "));
    }
    for warning in &report.warnings {
        console.warn(warning);
    }
    console.result(&rows, &text)
}
