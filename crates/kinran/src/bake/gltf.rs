//! A glTF file: its materials' textures are replaced by baked ones, everything else stays.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use kinran_bake::aniso::{Reflectance, RoughnessMaps, Sheet, SheetRequest, bake_surface_and_metal};
use kinran_bake::folder::{
    Green, GreenGuess, below_surface, guess_green, not_normals, odd_lengths, outside_unit,
};
use kinran_bake::metal::{apart, specular_size, specular_white};
use kinran_bake::{
    MaterialSurface, NoSurface, bake_cutout, bake_plain, material_reflectance, material_surface,
};
use kinran_image::srgb::byte_from_linear;
use kinran_image::{
    Channels, Encoder, Encoding, Files, Format, Image, Memory, Pixels, Preset, Role, Texture, Transfer,
    decode_image, encode_png, image_size_of,
};
use kinran_scene::{
    Dielectric, Document, FUZZ_EXTENSION, Maps, Material, Needs, Scene, Slot, TextureExtension, TextureRef,
};
use kinran_shading::DIELECTRIC_F0;
use serde_json::Value;

use super::gltf_options::{GltfOptions, Target};
use super::together::{color_texture, together, why_apart};
use super::{curvature, file_name, file_stem, mip_texels, put_texture};
use crate::content::Content;
use crate::options::TextureOptions;
use crate::outgoing::pack;
use crate::report::{Input, Output, Report, SurfaceReport, WrittenFile};
use crate::sink::place_in;
use crate::{Error, Sink, Space, Stage, Task};

/// A model, and what of it can be baked.
#[derive(Debug)]
#[non_exhaustive]
pub struct Understood {
    /// What it shows, its skin marked and its normals estimated where that was asked for.
    pub scene: Scene,
    /// The document, changed in the same way.
    pub document: Document,
    /// Each surface that will be filtered.
    pub surfaces: Vec<Surface>,
    /// What was left out or assumed, a sentence each.
    pub warnings: Vec<String>,
}

/// The normals and the lobe of materials that share them.
#[derive(Debug)]
#[non_exhaustive]
pub struct Surface {
    /// The materials, by their numbers in the document.
    pub materials: Vec<usize>,
    /// Their maps.
    pub maps: MaterialSurface,
    /// What they reflect, where that differs from texel to texel and their base colours are baked too.
    pub reflectance: Option<Reflectance>,
    /// Size of the specular colour that is chosen for them, where one is.
    specular: Option<(u32, u32)>,
    key: Key,
}

impl Surface {
    /// Whether levels of its base colour and metalness are chosen together.
    fn is_chosen_together(&self) -> bool {
        let size = self.maps.maps.size();
        self.reflectance.as_ref().is_some_and(|reflectance| apart(reflectance, size).is_none())
    }
}

impl Understood {
    /// The maps that a surface is made of.
    ///
    /// # Errors
    /// Where an image cannot be read.
    pub fn inputs(&self, surface: &Surface) -> Result<Vec<Input>, Error> {
        inputs(&self.scene, &self.document, surface.materials[0])
    }
}

/// Reads a model and finds out what of it can be baked.
///
/// # Errors
/// Those of [`Scene::load`]; a material of [`GltfOptions::skin`] that is not there.
pub fn understand_gltf(
    files: &dyn Files,
    input: &Path,
    how: &GltfOptions,
    task: Task<'_>,
) -> Result<Understood, Error> {
    let how = &how.settled()?;
    let mut document = Document::open_in(files, input, &how.allow_outside)?;
    let (smoothed, mut files) = (Memory::new(), files);
    let mut idle = None;
    if how.estimate_normals {
        if curvature::add_normals(&mut document, files, how, task)? {
            for (path, bytes) in document.pack_in_memory(input)?.files {
                smoothed.insert(path, bytes);
            }
            files = &smoothed;
            document = Document::open_in(files, input, &[])?;
        } else {
            idle = Some("--estimate-normals has nothing to act on: every mesh has normals".to_owned());
        }
    }
    let needs = Needs {
        geometry: how.asks(&document),
        rest_pose: true,
        maps: if how.all_textures { Maps::Plain } else { Maps::Surface },
        reflectance: how.textures.is_correlated(),
        ..Needs::NONE
    };
    let reading = task.begin(Stage::Reading, file_name(input), 0)?;
    let expect = |units| reading.expect(units);
    let mut scene =
        Scene::load_in(files, input, &how.allow_outside, &needs, &expect, &|units| reading.tick(units))?;
    drop(reading);
    if needs.geometry && document.decompress()? {
        scene.warnings.push(
            "its meshes were compressed by Draco or meshopt; they are written plain, since curvature is added to them"
                .into(),
        );
    }
    curvature::mark_skin(&how.skin, &mut scene, &mut document)?;
    let (surfaces, mut warnings) = surfaces(input, how, &scene, &document);
    if !needs.geometry {
        warnings.extend(without_uvs(&document, &scene));
    }
    warnings.extend(idle);
    Ok(Understood { scene, document, surfaces, warnings })
}

/// Bakes every material of a glTF file that has a normal, a roughness or an anisotropy map, and writes the model beside its
/// textures.
///
/// Each baked texture keeps a PNG or JPEG of level 0 as the fallback that glTF wants: the original image, or,
/// where a factor was baked in or its size or its normals changed, a new one.
///
/// # Errors
/// Whatever is wrong with the model, the options or the destination. Files that were written before are whole and stay.
pub fn gltf(
    files: &dyn Files,
    input: &Path,
    how: &GltfOptions,
    out: &dyn Sink,
    task: Task<'_>,
) -> Result<Report, Error> {
    let how = &how.settled()?;
    how.curvature.check()?;
    let model = file_name(input);
    let own = files.place(input);
    if own.is_some() && own == place_in(out, &model) {
        return Err(Error::OverInput { input: input.into() });
    }
    let Understood { scene, mut document, surfaces, mut warnings } =
        understand_gltf(files, input, how, task)?;
    let stem = input.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let mut plan = Plan::new(how, &scene, &document, &surfaces, &stem);
    warnings.append(&mut plan.notes);
    let mut report = Report { warnings, source: how.source.clone(), ..Report::new(&how.textures) };
    check(input, how, &scene, &document, &surfaces, &plan, out)?;

    let mut written = Vec::new();
    for (i, (surface, (name, planned))) in surfaces.iter().zip(&plan.surfaces).enumerate() {
        let (scene, document, name, written) = (&scene, &mut document, name.clone(), &mut written);
        let mut baker = SurfaceBaker { how, scene, document, name, written, out, task };
        let (of_surface, chosen) = baker.bake(surface, planned)?;
        report.surfaces.push(of_surface);
        if let Some(color) = plan.colors.iter_mut().find(|color| color.surface == Some(i)) {
            color.chosen = chosen;
        }
    }
    for turned in &plan.turned {
        turn_green(input, &mut document, turned, &mut written, out)?;
    }
    written.extend(bake_colors(how, &scene, &mut document, plan.colors, &mut report, out, task)?);
    let dumps = curvature::bake(input, how, &scene, &mut document, &mut report, out, task)?;

    for (i, material) in scene.materials.iter().enumerate().take(document.material_count()) {
        let extensions = document.material(i).get("extensions");
        let has = |name| extensions.is_some_and(|e| e.get(name).is_some());
        if let (Some(fuzz), true, false) = (&material.fuzz, has(FUZZ_EXTENSION), has("KHR_materials_sheen")) {
            // What viewers show that know nothing of fuzz.
            fuzz.write(document.material_mut(i));
            document.use_extension("KHR_materials_sheen", false);
        }
    }
    let _writing = task.begin(Stage::Writing, &model, 0)?;
    let outgoing = pack(&document, &model, out)?;
    report.warnings.extend(outgoing.warnings);
    written.extend(dumps);
    for (name, bytes) in outgoing.files {
        out.put(&name, &bytes)?;
        written.push(WrittenFile::new(name, &bytes));
    }
    report.write(out, &format!("{stem}.kinran.json"), written)?;
    Ok(report)
}

/// The textures that will be baked, before any is.
struct Plan {
    /// What the files of each surface are called, and which they are.
    surfaces: Vec<(String, Vec<Planned>)>,
    colors: Vec<Colored>,
    turned: Vec<Turned>,
    /// What should be told, a sentence each.
    notes: Vec<String>,
}

/// A normal map that is not filtered, and whose green is turned over.
struct Turned {
    /// The new file.
    file: String,
    texture: usize,
    image: usize,
    /// The materials that use it, and where.
    slots: Vec<(usize, Slot)>,
}

/// An image that needs no filter of its own.
struct Colored {
    /// What its files are called.
    name: String,
    place: TextureRef,
    transfer: Transfer,
    /// Of its alpha, where it is cut out.
    cutoff: Option<f32>,
    /// Whether it is KTX2 or DDS alone, so that it gets a PNG.
    has_no_source: bool,
    /// The surface whose metalness it is chosen together with.
    surface: Option<usize>,
    /// What came of that.
    chosen: Option<Texture>,
    /// The materials that use it, and where.
    slots: Vec<(usize, Slot)>,
}

impl Colored {
    fn content(&self) -> Content {
        match self.transfer {
            Transfer::Srgb => Content::Color,
            Transfer::Linear | Transfer::Unsaid => Content::Data,
        }
    }

    fn encoding(&self, how: &TextureOptions) -> Encoding {
        let role = if self.transfer == Transfer::Srgb { Role::Color } else { Role::Data };
        how.encoding(role, how.color_format)
    }
}

impl Plan {
    fn new(how: &GltfOptions, scene: &Scene, document: &Document, all: &[Surface], stem: &str) -> Self {
        let mut names = Names::default();
        let surfaces = all.iter().map(|surface| {
            let material = &scene.materials[surface.materials[0]];
            let name = names.unique(&format!("{stem}_{}", file_stem(&material.name)));
            (name, planned(scene, document, surface.materials[0], &surface.maps))
        });
        let surfaces: Vec<(String, Vec<Planned>)> = surfaces.collect();
        let (mut colors, mut notes) = (Vec::<Colored>::new(), Vec::new());
        for (surface, (_, planned)) in all.iter().zip(&surfaces) {
            let (name, size) = (&scene.materials[surface.materials[0]].name, surface.maps.maps.size());
            let loses =
                |planned: &Planned| !how.keeps_levels(how.textures.of_sheet(planned.sheet).format, size);
            if how.target() != Target::Plain && planned.iter().any(loses) {
                notes.push(broken_blocks(&format!("the maps of material \"{name}\""), size));
            }
        }
        let materials = document.material_count().min(scene.materials.len());
        for material in (0..materials).filter(|_| how.all_textures) {
            let m = &scene.materials[material];
            let is_chosen =
                |surface: &Surface| surface.materials.contains(&material) && surface.is_chosen_together();
            let of_surface = all.iter().position(is_chosen);
            let occlusion = m.occlusion.as_ref().filter(|_| !occlusion_is_packed(scene, material));
            for (slot, place, transfer) in [
                (Slot::BaseColor, m.base_color.as_ref(), Transfer::Srgb),
                (Slot::Emissive, m.emissive.as_ref(), Transfer::Srgb),
                (Slot::Occlusion, occlusion, Transfer::Linear),
            ] {
                let surface = of_surface.filter(|_| slot == Slot::BaseColor);
                let Some(place) = place else { continue };
                let Some(image) = &scene.images[place.image] else { continue };
                let role = if transfer == Transfer::Srgb { Role::Color } else { Role::Data };
                let format = how.textures.encoding(role, how.textures.color_format).format;
                let size = (image.width, image.height);
                if !how.keeps_levels(format, size) {
                    let name = format!("image \"{}\"", document.image_name(place.image));
                    let note = broken_blocks(&name, size);
                    notes.extend((!notes.contains(&note)).then_some(note));
                    continue;
                }
                let cutoff = how.textures.alpha_coverage.of_material(m).filter(|_| slot == Slot::BaseColor);
                let texture = document.texture(material, slot);
                let source = texture.and_then(|texture| document.texture_source(texture));
                let is_it = |c: &&mut Colored| c.place == *place && c.transfer == transfer;
                let known =
                    colors.iter_mut().filter(is_it).find(|c| (c.surface, c.cutoff) == (surface, cutoff));
                match known {
                    Some(known) => known.slots.push((material, slot)),
                    None => {
                        let mut color = Colored {
                            name: String::new(),
                            place: place.clone(),
                            transfer,
                            cutoff,
                            has_no_source: source.is_none() && !matches!(image.pixels, Pixels::F32(_)),
                            surface,
                            chosen: None,
                            slots: vec![(material, slot)],
                        };
                        let image = file_stem(&document.image_name(place.image));
                        if let Some(other) = colors.iter_mut().find(is_it) {
                            let what = if other.surface == surface { "cutoff" } else { "metalness" };
                            let other = &scene.materials[other.slots[0].0].name;
                            notes.push(format!(
                                "the base colour of \"{other}\" and \"{}\" becomes two textures, since their {what} differs",
                                m.name
                            ));
                        }
                        color.name = names.unique(&format!("{stem}_{image}_{}", color.content().name()));
                        colors.push(color);
                    }
                }
            }
        }
        let baked: Vec<usize> = all.iter().flat_map(|surface| surface.materials.clone()).collect();
        let mut turned: Vec<Turned> = Vec::new();
        for material in (0..materials).filter(|_| how.green == Some(Green::Down)) {
            // The maps of a surface are turned while they are filtered.
            let slots = [Slot::Normal, Slot::ClearcoatNormal].into_iter();
            for slot in slots.filter(|slot| *slot != Slot::Normal || !baked.contains(&material)) {
                let Some(texture) = document.texture(material, slot) else { continue };
                let Some(image) = document.texture_image(texture) else { continue };
                if let Some(known) = turned.iter_mut().find(|known| known.texture == texture) {
                    known.slots.push((material, slot));
                    continue;
                }
                let name = names.unique(&format!("{stem}_{}_up", file_stem(&document.image_name(image))));
                turned.push(Turned {
                    file: format!("{name}.png"),
                    texture,
                    image,
                    slots: vec![(material, slot)],
                });
            }
        }
        Plan { surfaces, colors, turned, notes }
    }
}

/// Writes a normal map with its green turned over and puts it into its slots.
fn turn_green(
    input: &Path,
    document: &mut Document,
    turned: &Turned,
    written: &mut Vec<WrittenFile>,
    out: &dyn Sink,
) -> Result<(), Error> {
    let name = document.image_name(turned.image);
    let bytes = document.image_bytes(turned.image)?.into_owned();
    let mut image = decode_image(Path::new(&name), &bytes)
        .map_err(|error| Error::Unturned { input: input.into(), error })?;
    let count = image.channels.count();
    fn turn<T: Copy>(samples: &mut [T], count: usize, over: impl Fn(T) -> T) {
        samples.iter_mut().skip(1).step_by(count).for_each(|green| *green = over(*green));
    }
    match &mut image.pixels {
        _ if image.channels < Channels::Rgb => {}
        Pixels::U8(samples) => turn(samples, count, |g| 255 - g),
        Pixels::U16(samples) => turn(samples, count, |g| 65535 - g),
        Pixels::F32(samples) => turn(samples, count, |g| 1.0 - g),
    }
    let bytes = encode_png(&image)?;
    out.put(&turned.file, &bytes)?;
    written.push(WrittenFile::new(&turned.file, &bytes));
    let source = document.add_image_file(&turned.file);
    let texture = document.add_texture(Some(turned.texture), Some(source), &[]);
    for &(material, slot) in &turned.slots {
        document.set_texture(material, slot, texture);
    }
    Ok(())
}

/// What to say of maps without whole blocks.
fn broken_blocks(what: &str, (width, height): (u32, u32)) -> String {
    let whole = |side: u32| side.next_multiple_of(4);
    format!(
        "{what}: {width}x{height} texels are no whole blocks, which KTX2 in glTF wants, so that they get no levels but the \
         viewer's; scale them to {}x{}, or bake with --target engine",
        whole(width),
        whole(height)
    )
}

/// The sheets of a material's surface.
fn planned(scene: &Scene, document: &Document, material: usize, surface: &MaterialSurface) -> Vec<Planned> {
    let (m, size) = (&scene.materials[material], surface.maps.size());
    let directed = matches!(surface.maps.roughness, RoughnessMaps::Khr { .. });
    // Factors are baked into the textures; what does not show level 0 without them is replaced, and so is what was KTX2 or
    // DDS alone.
    let shows = |slot: Slot, place: Option<&TextureRef>| {
        let source = document.texture(material, slot).and_then(|texture| document.texture_source(texture));
        let image = place.and_then(|place| scene.images[place.image].as_ref());
        source.is_some() && image.is_some_and(|image| (image.width, image.height) == size)
    };
    let mut planned = Vec::new();
    if let Some(place) = &m.normal {
        let laid = scene.images[place.image].as_deref().is_some_and(|image| below_surface(image).is_some());
        let factors = m.normal_scale != 1.0 || surface.maps.normal.y_down;
        let changed = factors || laid || !shows(Slot::Normal, Some(place));
        planned.push(Planned { sheet: Sheet::Normal, slot: Slot::Normal, changed });
    }
    let roughness = m.metallic_roughness.as_ref();
    planned.push(Planned {
        sheet: if directed { Sheet::Roughness } else { Sheet::IsotropicRoughness },
        slot: Slot::MetallicRoughness,
        changed: m.roughness_factor != 1.0 || !shows(Slot::MetallicRoughness, roughness),
    });
    if let Some(a) = m.anisotropy.as_ref().filter(|_| directed) {
        let factors = a.strength != 1.0 || a.rotation != 0.0;
        let changed = factors || !shows(Slot::Anisotropy, a.texture.as_ref());
        planned.push(Planned { sheet: Sheet::KhrAnisotropy, slot: Slot::Anisotropy, changed });
    }
    planned
}

/// Bytes that a model's files will take, by the headers of its images alone: a library asks for thousands.
///
/// # Errors
/// Where the document cannot be read.
pub fn gltf_space(files: &dyn Files, input: &Path, how: &GltfOptions) -> Result<Space, Error> {
    let how = &how.settled()?;
    let document = Document::open_in(files, input, &how.allow_outside)?;
    let image = |material: usize, slot: Slot| document.texture_image(document.texture(material, slot)?);
    let size = |image: &usize| image_size_of(&document.image_bytes(*image).ok()?);
    let options = &how.textures;
    let texture = |format: Format, size: (u32, u32)| match how.keeps_levels(format, size) {
        true => options.space(format, size),
        false => Space::default(),
    };
    let mut space = Space::default();
    // Materials that share their maps share their textures.
    let (mut surfaces, mut plain) = (BTreeSet::new(), BTreeSet::new());
    for material in 0..document.material_count() {
        let maps = SURFACE_SLOTS.map(|slot| image(material, slot));
        let extensions = document.material(material).get("extensions");
        let directed = extensions.is_some_and(|e| e.get("KHR_materials_anisotropy").is_some());
        let is_baked = maps[0].is_some() || (directed && maps.iter().any(Option::is_some));
        if is_baked
            && surfaces.insert(maps)
            && let Some(size) =
                maps.iter().flatten().filter_map(size).reduce(|a, b| (a.0.max(b.0), a.1.max(b.1)))
        {
            let sheets = [
                (maps[0].is_some(), Sheet::Normal),
                (true, Sheet::Roughness),
                (directed, Sheet::KhrAnisotropy),
                (how.form.aniso(), Sheet::Aniso),
            ];
            let wanted = sheets.into_iter().filter(|(wanted, _)| *wanted);
            wanted.for_each(|(_, sheet)| {
                space.add(texture(options.of_sheet(sheet).format, size));
                // A PNG of level 0 beside it, where a factor is baked in.
                let fallback =
                    if sheet == Sheet::Aniso { 0 } else { 3 * u64::from(size.0) * u64::from(size.1) };
                space.most += fallback;
            });
        }
        for slot in
            [Slot::BaseColor, Slot::Emissive, Slot::Occlusion].into_iter().filter(|_| how.all_textures)
        {
            // Occlusion beside roughness is packed with it.
            let image = image(material, slot).filter(|image| maps[2] != Some(*image));
            if let Some(size) = image.filter(|&image| plain.insert(image)).as_ref().and_then(size) {
                let role = if slot == Slot::Occlusion { Role::Data } else { Role::Color };
                let texture = texture(options.encoding(role, options.color_format).format, size);
                space.add(texture);
                if slot == Slot::BaseColor && how.separate_specular {
                    space.most += texture.most;
                }
            }
        }
    }
    // The model takes along what it had.
    let along = document.files().into_iter().chain([input.to_path_buf()]);
    space.most += along.filter_map(|file| files.size(&file)).sum::<u64>();
    Ok(space)
}

/// Refuses what cannot be baked or written, before the first texture is.
fn check(
    input: &Path,
    how: &GltfOptions,
    scene: &Scene,
    document: &Document,
    surfaces: &[Surface],
    plan: &Plan,
    out: &dyn Sink,
) -> Result<(), Error> {
    let options = &how.textures;
    let (mut names, mut space) = (curvature::check(input, how, scene, document)?, Space::default());
    for ((name, planned), surface) in plan.surfaces.iter().zip(surfaces) {
        let size = surface.maps.maps.size();
        let mut add = |sheet: Sheet| {
            let name = format!("{name}_{}", Content::from(sheet).name());
            let format = options.of_sheet(sheet).format;
            if how.keeps_levels(format, size) {
                names.extend(options.files(&name));
                space.add(options.space(format, size));
            }
            name
        };
        let replaced: Vec<String> =
            planned.iter().filter_map(|p| Some(add(p.sheet)).filter(|_| p.changed)).collect();
        if how.form.aniso() {
            add(Sheet::Aniso);
        }
        space.most += replaced.len() as u64 * 3 * u64::from(size.0) * u64::from(size.1);
        names.extend(replaced.into_iter().map(|name| format!("{name}.png")));
        if let Some(size) = surface.specular {
            let name = format!("{name}_{}", Content::SpecularColor.name());
            names.extend(options.files(&name));
            names.push(format!("{name}.png"));
            space.add(options.space(options.encoding(Role::Color, options.color_format).format, size));
        }
    }
    for color in &plan.colors {
        names.extend(options.files(&color.name));
        names.extend(color.has_no_source.then(|| format!("{}.png", color.name)));
        if let Some(image) = &scene.images[color.place.image] {
            space.add(options.space(color.encoding(options).format, (image.width, image.height)));
        }
    }
    names.extend(plan.turned.iter().map(|turned| turned.file.clone()));
    let is_map = |name: &&String| out.place(name).is_some_and(|file| document.names_file(&file));
    if let Some(name) = names.iter().find(is_map) {
        let file = out.place(name).filter(|_| out.is_on_disk()).unwrap_or_else(|| name.into());
        return Err(Error::OverMap { file });
    }

    // The model and what it takes along; what is there already is no loss.
    let model = file_name(input);
    let outgoing = pack(document, &model, out)?.files;
    space.most += outgoing.iter().map(|(_, bytes)| bytes.len() as u64).sum::<u64>();
    let is_new = |(name, bytes): &(String, Vec<u8>)| {
        *name == model || out.get(name).is_some_and(|there| there != *bytes)
    };
    names.extend(outgoing.into_iter().filter(is_new).map(|(name, _)| name));
    let stem = input.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    names.push(format!("{stem}.kinran.json"));
    out.expect(&names, space)
}

/// A sentence for each material whose maps lie on texture coordinates that a primitive lacks. Geometry that is read tells it
/// itself.
fn without_uvs(document: &Document, scene: &Scene) -> Vec<String> {
    let list = |value: &Value, member: &str| value.get(member).and_then(Value::as_array).cloned();
    let mut warnings = Vec::new();
    for (index, material) in scene.materials.iter().enumerate() {
        let Some(set) =
            material.normal.as_ref().or(material.metallic_roughness.as_ref()).map(|map| map.uv_set)
        else {
            continue;
        };
        let meshes = document.json().get("meshes").and_then(Value::as_array).into_iter().flatten();
        let lacking = meshes.enumerate().find_map(|(m, mesh)| {
            let primitives = list(mesh, "primitives").unwrap_or_default();
            let lacks = |primitive: &Value| {
                let attribute = |name: &str| primitive.get("attributes").and_then(|a| a.get(name));
                primitive.get("material").and_then(Value::as_u64) == Some(index as u64)
                    && attribute("POSITION").is_some()
                    && attribute(&format!("TEXCOORD_{set}")).is_none()
            };
            primitives.iter().position(lacks).map(|p| (m, p))
        });
        warnings.extend(lacking.map(|(m, p)| {
            format!(
                "mesh {m}, primitive {p} has no TEXCOORD_{set}, which its material \"{}\" uses: its maps show one texel \
                 everywhere; unwrap it",
                material.name
            )
        }));
    }
    warnings
}

/// The surfaces of a document's materials; materials that share one share its textures.
fn surfaces(
    input: &Path,
    how: &GltfOptions,
    scene: &Scene,
    document: &Document,
) -> (Vec<Surface>, Vec<String>) {
    let (mut surfaces, mut warnings) = (Vec::<Surface>::new(), scene.warnings.clone());
    let mut apart = false;
    // A document without materials has one in the scene that it cannot name.
    for material in 0..document.material_count().min(scene.materials.len()) {
        let surface = material_surface(scene, material);
        if !matches!(surface, Err(NoSurface::Apart(_))) {
            let name = |image| document.image_name(image);
            warnings.extend(texel_remarks(scene, material, &name, how.green));
        }
        match surface {
            // Factors alone need no texture.
            Ok(surface) if surface.place.is_none() => {}
            Ok(mut maps) => {
                let mut key = Key::new(scene, material);
                maps.maps.normal.y_down = how.green == Some(Green::Down);
                let correlated = how.textures.is_correlated();
                let mut reflectance = match material_reflectance(scene, material, &maps) {
                    Ok(of) => of.filter(|_| correlated),
                    Err(reason) => {
                        warnings.extend(correlated.then_some(reason));
                        None
                    }
                };
                let size = maps.maps.size();
                maps.maps.weights = reflectance.as_ref().and_then(|of| of.weights(size)).map(Arc::new);
                // Where all reflects the same, materials of other colours share their surface.
                if maps.maps.weights.is_some() {
                    key.color = Some(Key::of_color(&scene.materials[material], &how.textures));
                }
                // A base colour that stays as it is gets its levels from the viewer.
                let color = how.textures.encoding(Role::Color, how.textures.color_format).format;
                let is_baked = how.all_textures && how.keeps_levels(color, size);
                reflectance = reflectance.filter(|_| is_baked && maps.maps.weights.is_some());
                let mut specular = None;
                if let Some(reflectance) = &reflectance {
                    let m = &scene.materials[material];
                    let name = format!("material \"{}\"", m.name);
                    warnings.extend(why_apart(&name, reflectance, &maps.maps));
                    specular = specular_size(reflectance, size)
                        .filter(|&size| how.separate_specular && how.keeps_levels(color, size));
                    if specular.is_some() && m.dielectric.is_some() {
                        warnings.push(format!(
                            "{name}: no specular colour is chosen for it, since KHR_materials_specular or KHR_materials_ior says what reflects"
                        ));
                        specular = None;
                    }
                }
                match surfaces.iter_mut().find(|known| known.key == key) {
                    Some(known) => known.materials.push(material),
                    None => {
                        surfaces.push(Surface {
                            materials: vec![material],
                            maps,
                            reflectance,
                            specular,
                            key,
                        });
                    }
                }
            }
            Err(NoSurface::Plain) => {}
            Err(NoSurface::Apart(reason)) => {
                warnings.push(reason);
                apart = true;
            }
        }
    }
    if how.separate_specular && surfaces.iter().all(|surface| surface.specular.is_none()) {
        let why = if !how.all_textures {
            "no colour is baked; --all-textures asks for it"
        } else if !how.textures.is_correlated() {
            "base colour and metalness are averaged one by one"
        } else {
            "no material has base colour and metalness that are chosen together"
        };
        warnings.push(format!("--separate-specular has nothing to act on: {why}"));
    }
    let skin = scene.primitives.iter().any(|p| how.wants(scene, p));
    if !apart && surfaces.is_empty() && !how.all_textures && !skin {
        let has_others = scene
            .materials
            .iter()
            .any(|m| [&m.base_color, &m.emissive, &m.occlusion].into_iter().any(Option::is_some));
        let others = match has_others {
            true => "; --all-textures bakes its other maps",
            false => ", nor any other: there is nothing to bake",
        };
        warnings.push(format!(
            "{}: no material has a normal, a roughness or an anisotropy map{others}",
            file_name(input)
        ));
    }
    (surfaces, warnings)
}

/// What the texels of a material's maps say against them, a sentence each; `name` gives images' names.
pub fn texel_remarks(
    scene: &Scene,
    material: usize,
    name: &dyn Fn(usize) -> String,
    said: Option<Green>,
) -> Vec<String> {
    let m = &scene.materials[material];
    let image = |place: Option<&TextureRef>| -> Option<(String, &Image)> {
        let place = place?;
        Some((name(place.image), scene.images.get(place.image)?.as_deref()?))
    };
    let mut remarks = Vec::new();
    if let Some((name, normal)) = image(m.normal.as_ref()) {
        remarks.extend(normal_remarks(&name, normal, said));
    }
    let anisotropy = m.anisotropy.as_ref().and_then(|a| a.texture.as_ref());
    let numbers: [(&str, Option<&TextureRef>, &[usize]); 6] = [
        ("roughness", m.metallic_roughness.as_ref(), &[1]),
        ("metalness", m.metallic_roughness.as_ref(), &[2]),
        ("anisotropy", anisotropy, &[0, 1, 2]),
        ("occlusion", m.occlusion.as_ref(), &[0]),
        ("base colour", m.base_color.as_ref(), &[0, 1, 2]),
        ("opacity", m.base_color.as_ref(), &[3]),
    ];
    for (what, place, channels) in numbers {
        let outside = image(place).and_then(|(name, image)| Some((name, outside_unit(image, channels)?)));
        remarks.extend(outside.map(|(name, outside)| format!("its {what} in \"{name}\": {outside}")));
    }
    remarks.into_iter().map(|remark| format!("material \"{}\": {remark}", m.name)).collect()
}

/// What the texels of a normal map say against it.
fn normal_remarks(name: &str, image: &Image, said: Option<Green>) -> Vec<String> {
    let unlike = || {
        let why = not_normals(image)?;
        Some(format!("its normal map \"{name}\" does not look like one: {why}; it is taken as it is"))
    };
    if image.channels == Channels::R {
        return unlike().into_iter().collect();
    }
    let guess = guess_green(image);
    let green = match (guess, said) {
        (GreenGuess::Down, None) => Some(
            "the slopes of its normal map say that green points down, as in DirectX, and glTF's points up; if they \
             are right, bake it with --y-down",
        ),
        (GreenGuess::Down, Some(Green::Up)) => {
            Some("its normal map is taken as +Y by --y-up, though its slopes look like -Y")
        }
        (GreenGuess::Up, Some(Green::Down)) => {
            Some("its normal map is taken as -Y by --y-down, though its slopes look like +Y")
        }
        _ => None,
    };
    let lengths = odd_lengths(image).map(|lengths| {
        format!("its normal map: {lengths}; red, green and blue are brought to it together, as in glTF")
    });
    let below = below_surface(image)
        .map(|below| format!("its normal map \"{name}\": {below}; they are laid on the surface"));
    // Of lengths it is told above, and engine textures may hold red and green alone.
    let unlike = if lengths.is_some() || image.channels == Channels::Rg { None } else { unlike() };
    green.map(str::to_owned).into_iter().chain(lengths).chain(below).chain(unlike).collect()
}

/// What makes two materials' surfaces the same.
#[derive(Debug, PartialEq)]
struct Key {
    places: [Option<TextureRef>; 3],
    normal_scale: f32,
    roughness: f32,
    anisotropy: Option<(f32, f32)>,
    occlusion_packed: bool,
    /// Where the surface is filtered with what it reflects.
    color: Option<OfColor>,
}

/// Base colour with its factor, the factor of metalness, what of the rest reflects, and the cutoff.
type OfColor = (Option<TextureRef>, [f32; 3], f32, Option<Dielectric>, Option<f32>);

impl Key {
    fn of_color(m: &Material, how: &TextureOptions) -> OfColor {
        let factor = m.base_color_factor.truncate().to_array();
        let cutoff = how.alpha_coverage.of_material(m);
        (m.base_color.clone(), factor, m.metallic_factor, m.dielectric.clone(), cutoff)
    }

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
            color: None,
        }
    }
}

/// Whether occlusion is read from the metallic-roughness texture.
fn occlusion_is_packed(scene: &Scene, material: usize) -> bool {
    let m = &scene.materials[material];
    match (&m.occlusion, &m.metallic_roughness) {
        (Some(o), Some(r)) => (o.image, o.runtime) == (r.image, r.runtime) && o.lies_as(r),
        _ => false,
    }
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
    how: &'a GltfOptions,
    scene: &'a Scene,
    document: &'a mut Document,
    name: String,
    /// Files besides the textures.
    written: &'a mut Vec<WrittenFile>,
    out: &'a dyn Sink,
    task: Task<'a>,
}

/// Where the maps of a surface are, in the order in which [`material_surface`] takes their place for the surface's.
const SURFACE_SLOTS: [Slot; 3] = [Slot::Normal, Slot::Anisotropy, Slot::MetallicRoughness];

/// A sheet, the slot it goes to, and whether the slot's image no longer shows level 0.
struct Planned {
    sheet: Sheet,
    slot: Slot,
    changed: bool,
}

impl SurfaceBaker<'_> {
    /// Bakes a surface; gives its base colour too, where that is chosen together with its metalness.
    fn bake(
        &mut self,
        surface: &Surface,
        planned: &[Planned],
    ) -> Result<(SurfaceReport, Option<Texture>), Error> {
        let (options, materials) = (&self.how.textures, surface.materials.as_slice());
        let m = &self.scene.materials[materials[0]];
        let reflectance = surface.reflectance.as_ref();
        let cutoff = options.alpha_coverage.of_material(m);
        let kernel = options.kernel;
        let separate = surface.specular.is_some();
        let together =
            together(&surface.maps.maps, reflectance, cutoff, separate, &m.name, kernel, self.task)?;
        let pair = together.pair.as_ref();
        let texture = |levels, content| color_texture(levels, content, &m.name, options, self.task);
        let color = pair.map(|pair| texture(&pair.color, Content::Color)).transpose()?;
        let specular = pair.filter(|_| separate);
        let specular = specular.map(|pair| texture(&pair.specular, Content::SpecularColor)).transpose()?;
        let (maps, metallic) = (&together.maps, pair.map_or(&[][..], |pair| &pair.metallic));
        let size = maps.size();
        let mr = m.metallic_roughness.as_ref().and_then(|place| self.scene.images[place.image].clone());

        let keeps = |sheet: Sheet| self.how.keeps_levels(options.of_sheet(sheet).format, size);
        let request = |encoding: Option<Encoding>| {
            let mr = mr.as_deref();
            move |planned: &Planned| SheetRequest {
                sheet: planned.sheet,
                encoding: encoding.unwrap_or_else(|| options.of_sheet(planned.sheet)),
                packed_with: mr.filter(|_| planned.slot == Slot::MetallicRoughness),
            }
        };
        let plain = Encoding { format: Format::Rgba8, encoder: Encoder::Portable, preset: Preset::Fast };
        let kept = planned.iter().filter(|planned| keeps(planned.sheet)).map(request(None));
        let shown = planned.iter().filter(|planned| planned.changed).map(request(Some(plain)));
        let mut requests: Vec<SheetRequest> = kept.chain(shown).collect();
        let aniso = self.how.form.aniso() && keeps(Sheet::Aniso);
        if aniso {
            requests.push(SheetRequest {
                sheet: Sheet::Aniso,
                encoding: options.of_sheet(Sheet::Aniso),
                packed_with: None,
            });
        }
        let mut report = SurfaceReport {
            name: m.name.clone(),
            inputs: inputs(self.scene, self.document, materials[0])?,
            outputs: Vec::new(),
            levels: Vec::new(),
        };
        if requests.is_empty() {
            return Ok((report, color));
        }

        let filtering = self.task.begin(Stage::Filtering(options.filter), &m.name, mip_texels(size))?;
        let baked = bake_surface_and_metal(maps, options.surface(), &requests, metallic, &|texels| {
            filtering.tick(texels)
        })?;
        drop(filtering);
        let writing = self.task.begin(Stage::Writing, &m.name, baked.textures.len() as u64)?;

        report.levels = baked.levels;
        let mut textures = baked.textures;
        let aniso = aniso.then(|| textures.pop()).flatten();
        let kept: Vec<bool> = planned.iter().map(|planned| keeps(planned.sheet)).collect();
        let mut fallback = textures.split_off(kept.iter().filter(|kept| **kept).count()).into_iter();
        let mut textures = textures.into_iter();
        for (planned, kept) in planned.iter().zip(kept) {
            let texture = if kept { textures.next() } else { None };
            let image = if planned.changed { fallback.next() } else { None };
            let written = u64::from(texture.is_some()) + u64::from(image.is_some());
            if written > 0 {
                report.outputs.extend(self.place(planned, texture, image, materials)?);
                writing.tick(written)?;
            }
        }
        if let Some(aniso) = aniso {
            let name = format!("{}_aniso", self.name);
            let outputs = put_texture(options, &name, Content::Aniso, aniso, self.out)?;
            self.place_aniso(&outputs, materials);
            report.outputs.extend(outputs);
        }
        if let Some(specular) = specular {
            report.outputs.extend(self.place_specular(specular, materials)?);
        }
        Ok((report, color))
    }

    /// Writes a texture, its PNG or both, and puts them into their slot of every material.
    fn place(
        &mut self,
        planned: &Planned,
        texture: Option<Texture>,
        fallback: Option<Texture>,
        materials: &[usize],
    ) -> Result<Vec<Output>, Error> {
        let map = Content::from(planned.sheet);
        let name = format!("{}_{}", self.name, map.name());
        let put = |texture| put_texture(&self.how.textures, &name, map, texture, self.out);
        let outputs = texture.map(put).transpose()?.unwrap_or_default();

        let old = self.document.texture(materials[0], planned.slot);
        let source = match fallback {
            Some(level_0) => {
                let file = format!("{name}.png");
                let bytes = encode_png(&image_of(&level_0)?)?;
                self.out.put(&file, &bytes)?;
                self.written.push(WrittenFile::new(&file, &bytes));
                Some(self.document.add_image_file(&file))
            }
            None => old.and_then(|texture| self.document.texture_source(texture)),
        };
        let alternatives = alternatives(self.document, &outputs);
        let other = |slot: &Slot| self.document.texture(materials[0], *slot);
        let like = old.or_else(|| SURFACE_SLOTS.iter().find_map(other));
        let new = self.document.add_texture(like, source, &alternatives);
        for &material in materials {
            let is_new = self.document.texture(material, planned.slot).is_none();
            let like = is_new.then(|| like_surface(self.document.material(material)));
            let occlusion =
                planned.slot == Slot::MetallicRoughness && occlusion_is_packed(self.scene, material);
            self.document.set_texture(material, planned.slot, new);
            if occlusion {
                self.document.set_texture(material, Slot::Occlusion, new);
            }
            reset_factors(self.document.material_mut(material), planned.slot, like);
        }
        Ok(outputs)
    }

    /// Writes a specular colour, which lies as the surface does, and puts it into every material.
    fn place_specular(&mut self, texture: Texture, materials: &[usize]) -> Result<Vec<Output>, Error> {
        let name = format!("{}_{}", self.name, Content::SpecularColor.name());
        let outputs = put_texture(&self.how.textures, &name, Content::SpecularColor, texture, self.out)?;
        // Level 0 is one colour.
        let file = format!("{name}.png");
        let code = byte_from_linear(DIELECTRIC_F0 / specular_white());
        let bytes = encode_png(&Image::new(1, 1, Channels::Rgb, Pixels::U8(vec![code; 3]))?)?;
        self.out.put(&file, &bytes)?;
        self.written.push(WrittenFile::new(&file, &bytes));
        let source = self.document.add_image_file(&file);
        let alternatives = alternatives(self.document, &outputs);
        let like = SURFACE_SLOTS.iter().find_map(|&slot| self.document.texture(materials[0], slot));
        let new = self.document.add_texture(like, Some(source), &alternatives);
        for &material in materials {
            self.document.set_texture(material, Slot::SpecularColor, new);
            let material = self.document.material_mut(material);
            let info = like_surface(material);
            let extension = material.get_mut("extensions").and_then(|e| e.get_mut("KHR_materials_specular"));
            if let Some(extension) = extension.and_then(Value::as_object_mut) {
                let factor = specular_white() / DIELECTRIC_F0;
                extension.insert("specularColorFactor".into(), vec![factor; 3].into());
                let texture = extension.get_mut("specularColorTexture").and_then(Value::as_object_mut);
                texture.into_iter().for_each(|texture| texture.extend(info.clone()));
            }
        }
        Ok(outputs)
    }

    /// Refers to an aniso texture, which lies as the first map of [`SURFACE_SLOTS`] does.
    fn place_aniso(&mut self, outputs: &[Output], materials: &[usize]) {
        let alternatives = alternatives(self.document, outputs);
        let like = SURFACE_SLOTS.iter().find_map(|&slot| self.document.texture(materials[0], slot));
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
}

/// The maps of a material's surface.
fn inputs(scene: &Scene, document: &Document, material: usize) -> Result<Vec<Input>, Error> {
    let m = &scene.materials[material];
    let anisotropy = m.anisotropy.as_ref().and_then(|a| a.texture.as_ref());
    let roughness = m.metallic_roughness.as_ref();
    [("normal", m.normal.as_ref()), ("metallicRoughness", roughness), ("anisotropy", anisotropy)]
        .into_iter()
        .filter_map(|(role, place)| Some((role, place?)))
        .filter_map(|(role, place)| Some((role, place, scene.images[place.image].as_ref()?)))
        .map(|(role, place, image)| input(document, place.image, role, image))
        .collect()
}

fn input(document: &Document, index: usize, role: &str, image: &Image) -> Result<Input, Error> {
    Ok(Input {
        file: document.image_name(index),
        role: role.into(),
        width: image.width,
        height: image.height,
        blake3: blake3::hash(&document.image_bytes(index)?).to_hex().to_string(),
        notes: image.notes.clone(),
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

/// Where the first map of a material's [`SURFACE_SLOTS`] lies on the mesh.
fn like_surface(material: &kinran_scene::Object) -> kinran_scene::Object {
    let anisotropy = (material.get("extensions"))
        .and_then(|e| e.get("KHR_materials_anisotropy")?.get("anisotropyTexture"));
    let roughness = material.get("pbrMetallicRoughness").and_then(|pbr| pbr.get("metallicRoughnessTexture"));
    let texture = material.get("normalTexture").or(anisotropy).or(roughness).and_then(Value::as_object);
    let mut like = texture.cloned().unwrap_or_default();
    like.retain(|key, _| key == "texCoord" || key == "extensions");
    like
}

/// Sets the factors that are in the texture now to one, and lays a texture that is new on the mesh as `like` says.
fn reset_factors(material: &mut kinran_scene::Object, slot: Slot, like: Option<kinran_scene::Object>) {
    let lay = |texture: Option<&mut Value>| {
        if let (Some(texture), Some(like)) = (texture.and_then(Value::as_object_mut), like) {
            texture.extend(like);
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

/// Level 0 of an RGBA8 texture as an RGB image.
fn image_of(texture: &Texture) -> Result<Image, Error> {
    let level = &texture.levels[0];
    let rgb = level.data.chunks_exact(4).flat_map(|t| [t[0], t[1], t[2]]).collect();
    Ok(Image::new(level.width, level.height, Channels::Rgb, Pixels::U8(rgb))?)
}

/// Bakes the textures that need no filter of their own: base colour, emission, occlusion. Gives the files besides the
/// textures.
fn bake_colors(
    how: &GltfOptions,
    scene: &Scene,
    document: &mut Document,
    colors: Vec<Colored>,
    report: &mut Report,
    out: &dyn Sink,
    task: Task<'_>,
) -> Result<Vec<WrittenFile>, Error> {
    let mut written = Vec::new();
    let image = |color: &Colored| scene.images[color.place.image].as_ref();
    let texels = colors.iter().filter_map(image).map(|image| mip_texels((image.width, image.height)));
    let averaging = task.begin(Stage::Colors, "", texels.sum())?;
    for mut color in colors {
        let chosen = color.chosen.take();
        let (place, content) = (&color.place, color.content());
        let Some(image) = &scene.images[place.image] else { continue };
        let (kernel, encoding) = (how.textures.kernel, color.encoding(&how.textures));
        let texture = match chosen {
            Some(texture) => {
                averaging.tick(mip_texels((image.width, image.height)))?;
                texture
            }
            None => {
                let tick = |texels| averaging.tick(texels);
                match color.cutoff {
                    Some(cutoff) => bake_cutout(image, cutoff, encoding, kernel, place.wrap, &tick)?,
                    None => bake_plain(image, color.transfer, encoding, kernel, place.wrap, &tick)?,
                }
            }
        };
        let outputs = put_texture(&how.textures, &color.name, content, texture, out)?;
        let (material, slot) = color.slots[0];
        let old = document.texture(material, slot);
        let source = match color.has_no_source {
            true => {
                let file = format!("{}.png", color.name);
                let bytes = encode_png(image)?;
                out.put(&file, &bytes)?;
                written.push(WrittenFile::new(&file, &bytes));
                Some(document.add_image_file(&file))
            }
            false => old.and_then(|texture| document.texture_source(texture)),
        };
        let alternatives = alternatives(document, &outputs);
        let texture = document.add_texture(old, source, &alternatives);
        report.surfaces.push(SurfaceReport {
            name: color.name.clone(),
            inputs: vec![input(document, place.image, content.name(), image)?],
            outputs,
            levels: Vec::new(),
        });
        for &(material, slot) in &color.slots {
            document.set_texture(material, slot, texture);
        }
    }
    Ok(written)
}
