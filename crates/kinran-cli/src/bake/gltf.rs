//! A glTF file: its materials' textures are replaced by baked ones, everything else stays.

use std::collections::BTreeSet;
use std::path::Path;

use kinran_bake::aniso::{RoughnessMaps, Sheet, SheetRequest, bake_surface};
use kinran_bake::folder::{Green, GreenGuess, below_surface, guess_green, odd_lengths, outside_unit};
use kinran_bake::{MaterialSurface, NoSurface, bake_plain, material_surface};
use kinran_image::{
    Channels, Encoder, Encoding, Format, Image, Pixels, Preset, Role, Texture, Transfer, decode_image,
    image_size_of, write_png,
};
use kinran_scene::{
    Document, FUZZ_EXTENSION, Maps, Material, Needs, Scene, Slot, TextureExtension, TextureRef,
};
use serde_json::Value;

use super::report::BakeReport;
use super::{
    Args, Form, Input, Output, Report, SurfaceReport, curvature, file_name, file_stem, mip_texels, role_of,
    sheet_format, texture_files, texture_space, write_texture,
};
use crate::content::Content;
use crate::model::read_scene;
use crate::outputs::{
    Space, WrittenFile, changed_files, check_space, refuse_foreign, refuse_other_source, relative,
    replaced_bytes,
};
use crate::{Console, Error};

/// Bakes a glTF file and tells what came of it.
pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let mut report = bake_gltf(args, console)?;
    report.warnings.extend(args.idle_curvature().filter(|_| report.curvature.is_empty()));
    for warning in &report.warnings {
        console.warn(warning);
    }
    let model = args.output().join(file_name(&args.input));
    let text = format!("{}{}\n", report.text(args.output()), model.display());
    console.result(&BakeReport::new(args, Vec::new(), vec![report]), &text)
}

/// Bakes every material of a glTF file that has a normal, a roughness or an anisotropy map.
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
        let reason = "the baked model would overwrite it; name another folder with --output";
        return Err(Error::file_error(&args.input, reason));
    }
    let (_files, scene, mut document) = read(args, console)?;
    let mut report = Report::new(args);
    let surfaces = surfaces(args, &scene, &document, &mut report);
    let stem = args.input.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let plan = Plan::new(args, &scene, &document, &surfaces, &stem);
    let dumps = check(args, console, &scene, &document, &surfaces, &plan, &stem)?;
    std::fs::create_dir_all(args.output()).map_err(|e| kinran_image::Error::io(args.output(), e))?;

    let mut written = Vec::new();
    for ((_, materials, surface), (name, planned)) in surfaces.iter().zip(&plan.surfaces) {
        let (document, name, written) = (&mut document, name.clone(), &mut written);
        let mut baker = SurfaceBaker { args, console, scene: &scene, document, name, written };
        report.surfaces.push(baker.bake(materials, surface, planned)?);
    }
    for turned in &plan.turned {
        turn_green(args, &mut document, turned, &mut written)?;
    }
    bake_colors(args, console, &scene, &mut document, &plan.colors, &mut report)?;
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
    let _busy = console.progress().busy(format!("writing {}", file_name(&output)));
    let packed = document.pack(&output)?;
    packed.write()?;
    report.warnings.extend(packed.warnings);
    for dump in dumps {
        written.push(WrittenFile::of(args.output(), dump)?);
    }
    let files = packed.files.iter();
    written.extend(files.map(|(path, bytes)| WrittenFile::new(relative(args.output(), path), bytes)));
    report.write(args, &format!("{stem}.kinran.json"), written)?;
    Ok(report)
}

/// The textures that will be baked, before any is.
struct Plan {
    /// What the files of each surface are called, and which they are.
    surfaces: Vec<(String, Vec<Planned>)>,
    colors: Vec<Colored>,
    turned: Vec<Turned>,
}

/// A normal map that is not filtered, and whose green `--y-down` turns over.
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

    fn encoding(&self, args: &Args) -> Encoding {
        let role = if self.transfer == Transfer::Srgb { Role::Color } else { Role::Data };
        args.encoding(role, args.color_format)
    }
}

impl Plan {
    fn new(
        args: &Args,
        scene: &Scene,
        document: &Document,
        all: &[(Key, Vec<usize>, MaterialSurface)],
        stem: &str,
    ) -> Self {
        let mut names = Names::default();
        let surfaces = all.iter().map(|(_, materials, surface)| {
            let material = &scene.materials[materials[0]];
            (
                names.unique(&format!("{stem}_{}", file_stem(&material.name))),
                planned(scene, material, surface),
            )
        });
        let surfaces = surfaces.collect();
        let mut colors: Vec<Colored> = Vec::new();
        let materials = document.material_count().min(scene.materials.len());
        for material in (0..materials).filter(|_| args.all_textures) {
            let m = &scene.materials[material];
            let occlusion = m.occlusion.as_ref().filter(|_| !occlusion_is_packed(scene, material));
            for (slot, place, transfer) in [
                (Slot::BaseColor, m.base_color.as_ref(), Transfer::Srgb),
                (Slot::Emissive, m.emissive.as_ref(), Transfer::Srgb),
                (Slot::Occlusion, occlusion, Transfer::Linear),
            ] {
                let Some(place) = place.filter(|place| scene.images[place.image].is_some()) else { continue };
                let known = colors.iter_mut().find(|c| c.place == *place && c.transfer == transfer);
                match known {
                    Some(known) => known.slots.push((material, slot)),
                    None => {
                        let mut color = Colored {
                            name: String::new(),
                            place: place.clone(),
                            transfer,
                            slots: vec![(material, slot)],
                        };
                        let image = file_stem(&document.image_name(place.image));
                        color.name = names.unique(&format!("{stem}_{image}_{}", color.content().name()));
                        colors.push(color);
                    }
                }
            }
        }
        let baked: Vec<usize> = all.iter().flat_map(|(_, materials, _)| materials.clone()).collect();
        let mut turned: Vec<Turned> = Vec::new();
        for material in (0..materials).filter(|_| args.y_down) {
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
        Plan { surfaces, colors, turned }
    }
}

/// Writes a normal map with its green turned over and puts it into its slots.
fn turn_green(
    args: &Args,
    document: &mut Document,
    turned: &Turned,
    written: &mut Vec<WrittenFile>,
) -> Result<(), Error> {
    let name = document.image_name(turned.image);
    let bytes = document.image_bytes(turned.image)?.into_owned();
    let mut image = decode_image(Path::new(&name), &bytes).map_err(|e| {
        Error::file_error(&args.input, format!("its normal map cannot be turned as --y-down says: {e}"))
    })?;
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
    write_png(&args.output().join(&turned.file), &image)?;
    written.push(WrittenFile::of(args.output(), &turned.file)?);
    let source = document.add_image_file(&turned.file);
    let texture = document.add_texture(Some(turned.texture), Some(source), &[]);
    for &(material, slot) in &turned.slots {
        document.set_texture(material, slot, texture);
    }
    Ok(())
}

/// The sheets of a material's surface.
fn planned(scene: &Scene, m: &Material, surface: &MaterialSurface) -> Vec<Planned> {
    let has_image = m.metallic_roughness.as_ref().is_some_and(|place| scene.images[place.image].is_some());
    let directed = matches!(surface.maps.roughness, RoughnessMaps::Khr { .. });
    // Factors are baked into the textures; an image that showed level 0 without them is replaced.
    let mut planned = Vec::new();
    if m.normal.is_some() {
        let changed = m.normal_scale != 1.0 || surface.maps.normal.y_down;
        planned.push(Planned { sheet: Sheet::Normal, slot: Slot::Normal, changed });
    }
    planned.push(Planned {
        sheet: if directed { Sheet::Roughness } else { Sheet::IsotropicRoughness },
        slot: Slot::MetallicRoughness,
        changed: m.roughness_factor != 1.0 || !has_image,
    });
    if let Some(a) = m.anisotropy.as_ref().filter(|_| directed) {
        planned.push(Planned {
            sheet: Sheet::KhrAnisotropy,
            slot: Slot::Anisotropy,
            changed: a.strength != 1.0 || a.rotation != 0.0 || a.texture.is_none(),
        });
    }
    planned
}

/// Bytes that a model's files will take, by the headers of its images alone: a library asks for thousands.
pub(super) fn space(args: &Args) -> Result<Space, Error> {
    let document = Document::open_allowing(&args.input, args.model.allowed()?)?;
    let image = |material: usize, slot: Slot| document.texture_image(document.texture(material, slot)?);
    let size = |image: &usize| image_size_of(&document.image_bytes(*image).ok()?);
    let texture = |sheet: Sheet, size: (u32, u32)| {
        texture_space(args, args.encoding(role_of(sheet), sheet_format(args, sheet)).format, size)
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
                (args.form.is_some_and(Form::aniso), Sheet::Aniso),
            ];
            let wanted = sheets.into_iter().filter(|(wanted, _)| *wanted);
            wanted.for_each(|(_, sheet)| {
                space.add(texture(sheet, size));
                // A PNG of level 0 beside it, where a factor is baked in.
                let fallback =
                    if sheet == Sheet::Aniso { 0 } else { 3 * u64::from(size.0) * u64::from(size.1) };
                space.most += fallback;
            });
        }
        for slot in
            [Slot::BaseColor, Slot::Emissive, Slot::Occlusion].into_iter().filter(|_| args.all_textures)
        {
            // Occlusion beside roughness is packed with it.
            let image = image(material, slot).filter(|image| maps[2] != Some(*image));
            if let Some(size) = image.filter(|&image| plain.insert(image)).as_ref().and_then(size) {
                let role = if slot == Slot::Occlusion { Role::Data } else { Role::Color };
                space.add(texture_space(args, args.encoding(role, args.color_format).format, size));
            }
        }
    }
    // The model takes along what it had.
    let files = document.files().into_iter().chain([args.input.clone()]);
    space.most += files.filter_map(|file| Some(std::fs::metadata(file).ok()?.len())).sum::<u64>();
    Ok(space)
}

/// Refuses what cannot be baked or written, before the first texture is; gives the files of curvature's dumps.
fn check(
    args: &Args,
    console: &Console,
    scene: &Scene,
    document: &Document,
    surfaces: &[(Key, Vec<usize>, MaterialSurface)],
    plan: &Plan,
    stem: &str,
) -> Result<Vec<String>, Error> {
    let dumps = curvature::check(args, scene, document)?;
    let (mut files, mut space) = (dumps.clone(), Space::default());
    for ((name, planned), (.., surface)) in plan.surfaces.iter().zip(surfaces) {
        let size = surface.maps.size();
        let mut add = |sheet: Sheet| {
            let name = format!("{name}_{}", Content::from(sheet).name());
            files.extend(texture_files(args, &name));
            let format = args.encoding(role_of(sheet), sheet_format(args, sheet)).format;
            space.add(texture_space(args, format, size));
            name
        };
        let replaced: Vec<String> =
            planned.iter().filter_map(|p| Some(add(p.sheet)).filter(|_| p.changed)).collect();
        if args.form.is_some_and(Form::aniso) {
            add(Sheet::Aniso);
        }
        space.most += replaced.len() as u64 * 3 * u64::from(size.0) * u64::from(size.1);
        files.extend(replaced.into_iter().map(|name| format!("{name}.png")));
    }
    for color in &plan.colors {
        files.extend(texture_files(args, &color.name));
        if let Some(image) = &scene.images[color.place.image] {
            space.add(texture_space(args, color.encoding(args).format, (image.width, image.height)));
        }
    }
    files.extend(plan.turned.iter().map(|turned| turned.file.clone()));
    for file in &files {
        refuse_authored(document, &args.output().join(file))?;
    }

    // The model and what it takes along; what is there already is no loss.
    let packed = document.pack(args.output().join(file_name(&args.input)))?;
    space.most += packed.files.iter().map(|(_, bytes)| bytes.len() as u64).sum::<u64>();
    files.extend(changed_files(args.output(), &packed));
    files.push(format!("{stem}.kinran.json"));
    refuse_other_source(args.output(), &files, &args.input, args.force)?;
    refuse_foreign(args.output(), &files, args.force)?;
    let needed = space.beyond(replaced_bytes(args.output(), &files));
    if let Some(warning) = check_space(args.output(), needed)? {
        console.warn(warning);
    }
    Ok(dumps)
}

/// The model as it is baked: its skin marked, its normals estimated where that was asked for. The document reads the
/// files of the folder that comes with it when it needs them.
fn read(args: &Args, console: &Console) -> Result<(Option<tempfile::TempDir>, Scene, Document), Error> {
    let smoothed = curvature::with_normals(args)?;
    let input =
        smoothed.as_ref().map_or_else(|| args.input.clone(), |f| f.path().join(file_name(&args.input)));
    let allowed = args.model.allowed()?;
    let mut document = Document::open_allowing(&input, allowed)?;
    let needs = Needs {
        geometry: args.curvature.asks(&document),
        rest_pose: true,
        maps: if args.all_textures { Maps::Plain } else { Maps::Surface },
    };
    let mut scene = read_scene(&input, &args.model, &needs, &console.progress())?;
    if needs.geometry && document.decompress()? {
        scene.warnings.push(
            "its meshes were compressed by Draco or meshopt; they are written plain, since curvature is added to them"
                .into(),
        );
    }
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
    let mut apart = false;
    // A document without materials has one in the scene that it cannot name.
    for material in 0..document.material_count().min(scene.materials.len()) {
        let surface = material_surface(scene, material);
        if !matches!(surface, Err(NoSurface::Apart(_))) {
            let name = |image| document.image_name(image);
            report.warnings.extend(texel_remarks(scene, material, &name, args.green()));
        }
        match surface {
            // Factors alone need no texture.
            Ok(surface) if surface.place.is_none() => {}
            Ok(mut surface) => {
                let key = Key::new(scene, material);
                surface.maps.normal.y_down = args.y_down;
                match surfaces.iter_mut().find(|(known, ..)| *known == key) {
                    Some((_, materials, _)) => materials.push(material),
                    None => surfaces.push((key, vec![material], surface)),
                }
            }
            Err(NoSurface::Plain) => {}
            Err(NoSurface::Apart(reason)) => {
                report.warnings.push(reason);
                apart = true;
            }
        }
    }
    let skin = scene.primitives.iter().any(|p| args.curvature.wants(scene, p));
    if !apart && surfaces.is_empty() && !args.all_textures && !skin {
        report.warnings.push(format!(
            "{}: no material has a normal, a roughness or an anisotropy map; nothing but --all-textures would bake anything",
            file_name(&args.input)
        ));
    }
    surfaces
}

/// What the texels of a material's maps say against them, a sentence each; `name` gives images' names.
pub(crate) fn texel_remarks(
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
    green.map(str::to_owned).into_iter().chain(lengths).chain(below).collect()
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
    args: &'a Args,
    console: &'a Console,
    scene: &'a Scene,
    document: &'a mut Document,
    name: String,
    /// Files besides the textures.
    written: &'a mut Vec<WrittenFile>,
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
    fn bake(
        &mut self,
        materials: &[usize],
        surface: &MaterialSurface,
        planned: &[Planned],
    ) -> Result<SurfaceReport, Error> {
        let args = self.args;
        let m = &self.scene.materials[materials[0]];
        let maps = &surface.maps;
        let size = maps.size();
        let mr = m.metallic_roughness.as_ref().and_then(|place| self.scene.images[place.image].clone());

        let mut requests: Vec<SheetRequest> = planned
            .iter()
            .map(|planned| {
                let is_roughness = planned.slot == Slot::MetallicRoughness;
                SheetRequest {
                    sheet: planned.sheet,
                    encoding: args.encoding(role_of(planned.sheet), sheet_format(args, planned.sheet)),
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

        let texels = mip_texels(size);
        let stage = self.console.progress().stage(format!("{} {}", args.filter.name(), m.name), texels);
        let baked = bake_surface(maps, args.options(), &requests, &|texels| stage.tick(texels))?;
        drop(stage);
        let writing =
            self.console.progress().stage(format!("writing {}", m.name), baked.textures.len() as u64);

        let mut report = SurfaceReport {
            name: m.name.clone(),
            inputs: inputs(self.scene, self.document, materials[0])?,
            outputs: Vec::new(),
            levels: baked.levels,
        };
        let mut textures = baked.textures;
        let aniso = args.form.is_some_and(Form::aniso).then(|| textures.pop()).flatten();
        let mut fallback = textures.split_off(planned.len()).into_iter();
        for (planned, texture) in planned.iter().zip(textures) {
            let image = if planned.changed { fallback.next() } else { None };
            let written = 1 + u64::from(image.is_some());
            report.outputs.extend(self.place(planned, texture, image, materials)?);
            writing.add(written);
        }
        if let Some(aniso) = aniso {
            let outputs = write_texture(args, &format!("{}_aniso", self.name), Content::Aniso, aniso)?;
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
    ) -> Result<Vec<Output>, Error> {
        let map = Content::from(planned.sheet);
        let name = format!("{}_{}", self.name, map.name());
        let outputs = write_texture(self.args, &name, map, texture)?;

        let old = self.document.texture(materials[0], planned.slot);
        let source = match fallback {
            Some(level_0) => {
                let file = format!("{name}.png");
                write_png(&self.args.output().join(&file), &image_of(&level_0)?)?;
                self.written.push(WrittenFile::of(self.args.output(), &file)?);
                Some(self.document.add_image_file(&file))
            }
            None => old.and_then(|texture| self.document.texture_image(texture)),
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

/// Refuses to write over one of the document's own images.
fn refuse_authored(document: &Document, path: &Path) -> Result<(), Error> {
    let Ok(existing) = path.canonicalize() else { return Ok(()) };
    let folder = document.path().parent().unwrap_or(Path::new(""));
    let images = document.json().get("images").and_then(Value::as_array).into_iter().flatten();
    let authored = images.filter_map(|image| folder.join(image.get("uri")?.as_str()?).canonicalize().ok());
    if authored.into_iter().any(|image| image == existing) {
        let reason =
            "is a map of the model that is baked and would be overwritten; name another folder with --output";
        return Err(Error::file_error(path, reason));
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
    console: &Console,
    scene: &Scene,
    document: &mut Document,
    colors: &[Colored],
    report: &mut Report,
) -> Result<(), Error> {
    let image = |color: &Colored| scene.images[color.place.image].as_ref();
    let texels = colors.iter().filter_map(image).map(|image| mip_texels((image.width, image.height)));
    let stage = console.progress().stage("colour, emission, occlusion", texels.sum());
    for color in colors {
        let (place, content) = (&color.place, color.content());
        let Some(image) = &scene.images[place.image] else { continue };
        let kernel = args.options().kernel;
        let texture =
            bake_plain(image, color.transfer, color.encoding(args), kernel, place.wrap, &|texels| {
                stage.tick(texels)
            })?;
        let outputs = write_texture(args, &color.name, content, texture)?;
        let (material, slot) = color.slots[0];
        let old = document.texture(material, slot);
        let source = old.and_then(|texture| document.texture_image(texture));
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
    Ok(())
}

/// Says which materials would be baked from what.
pub(super) fn dry_run(args: &Args, console: &Console) -> Result<(), Error> {
    let (_files, scene, document) = read(args, console)?;
    let mut report = Report::new(args);
    let mut text = String::new();
    for (_, materials, surface) in &surfaces(args, &scene, &document, &mut report) {
        let directed = matches!(surface.maps.roughness, RoughnessMaps::Khr { .. });
        let kind = if directed { "anisotropic" } else { "isotropic" };
        let names: Vec<&str> = materials.iter().map(|&i| scene.materials[i].name.as_str()).collect();
        let (width, height) = surface.maps.size();
        text += &format!("{width}x{height} {kind}: {}\n", names.join(", "));
        let inputs = inputs(&scene, &document, materials[0])?;
        report.surfaces.push(SurfaceReport { inputs, ..SurfaceReport::new(names[0].to_owned()) });
    }
    let measured = scene.primitives.iter().any(|p| args.curvature.wants(&scene, p));
    report.warnings.extend(args.idle_curvature().filter(|_| !measured));
    for warning in &report.warnings {
        console.warn(warning);
    }
    console.result(&BakeReport::new(args, Vec::new(), vec![report]), &text)
}
