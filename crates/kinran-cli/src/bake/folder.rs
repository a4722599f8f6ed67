//! A folder of authored maps.

use kinran_bake::aniso::{Sheet, SheetRequest, bake_surface};
use kinran_bake::folder::{ASSUMED_ROUGHNESS, LoadedMaterial, MaterialMaps, Role as MapRole, Row, scan};
use kinran_bake::{bake_plain, pack_channels};
use kinran_image::{Encoding, Image, Role, Texture, Transfer, image_size};
use rayon::prelude::*;

use super::report::{BakeReport, hash_file};
use super::{
    Args, Form, Input, Output, Report, SurfaceReport, file_name, file_stem, mip_texels, role_of,
    sheet_format, texture_files, texture_space, write_texture,
};
use crate::content::Content;
use crate::outputs::{Space, check_space, refuse_foreign, refuse_other_source, replaced_bytes};
use crate::{Console, Error};

/// Bakes a folder and tells what came of it.
pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let mut folder = scan(&args.input, &args.hints())?;
    let idle = idle(args, &folder.rows);
    let mut reports = bake_folder(args, console)?;
    idle.iter().for_each(|warning| console.warn(warning));
    if let Some(first) = reports.first_mut() {
        first.warnings.extend(idle);
    }
    for surface in reports.iter().flat_map(|report| &report.surfaces) {
        for input in &surface.inputs {
            add_remarks(&mut folder.rows, &surface.name, &input.file, &input.notes);
        }
    }
    let files: String = reports.iter().map(|report| report.text(args.output())).collect();
    let text = format!("{}\n{files}", folder.table());
    console.result(&BakeReport::new(args, folder.rows, reports), &text)
}

/// A sentence for each flag that had nothing to act on.
fn idle(args: &Args, rows: &[Row]) -> Vec<String> {
    use MapRole::{Color, Direction, DirectionAngle, Normal, Roughness};
    let is_used = |row: &&Row| row.channels != "-";
    let has = |roles: &[MapRole]| {
        rows.iter().filter(is_used).any(|row| row.role.is_some_and(|role| roles.contains(&role)))
    };
    let has_packed = rows.iter().filter(is_used).any(|row| row.role.is_some_and(MapRole::is_packed));
    let has_note = |words: &str| rows.iter().any(|row| row.note.contains(words));
    let missing = |what: &str| format!("there is no {what} map");
    let flags = [
        ("y-up", args.y_up && !has(&[Normal]), missing("normal")),
        ("y-down", args.y_down && !has(&[Normal]), missing("normal")),
        ("normal-blue", args.normal_blue && !has(&[Normal]), missing("normal")),
        ("force-normal", args.force_normal && !has(&[Normal]), missing("normal")),
        (
            "direction-span",
            args.direction_span.is_some() && !has(&[Direction, DirectionAngle]),
            missing("direction"),
        ),
        (
            "roughness",
            args.roughness.is_some() && !has_note("by --roughness"),
            "maps give the roughness; leave these out with --ignore FILE".into(),
        ),
        (
            "roughness-is-gloss",
            args.roughness_is_gloss && !has_packed && !has(&[Roughness]),
            missing("roughness"),
        ),
        ("color-space", args.color_space.is_some() && !has(&[Color]), missing("colour")),
    ];
    let given = flags.into_iter().filter(|(_, is_idle, _)| *is_idle);
    given.map(|(flag, _, why)| format!("--{flag} has nothing to act on: {why}")).collect()
}

/// Adds what was chosen when a file was read to its row.
fn add_remarks(rows: &mut [Row], material: &str, file: &str, remarks: &[String]) {
    let is_it = |row: &&mut Row| row.material == material && row.file.rsplit('/').next() == Some(file);
    if let Some(row) = rows.iter_mut().find(is_it) {
        let notes = std::iter::once(row.note.as_str()).chain(remarks.iter().map(String::as_str));
        row.note = notes.filter(|note| !note.is_empty()).collect::<Vec<_>>().join("; ");
    }
}

/// Tells what a bake would make of a folder: its maps are read and judged, nothing is filtered or written.
pub(super) fn dry_run(args: &Args, console: &Console) -> Result<(), Error> {
    let mut folder = scan(&args.input, &args.hints())?;
    let mut report = Report::new(args);
    let stage = console.progress().stage("reading", folder.materials.len() as u64);
    for material in &folder.materials {
        let loaded = material.load()?;
        for map in &loaded.images {
            add_remarks(&mut folder.rows, &loaded.name, &file_name(&map.path), &map.remarks);
        }
        report.surfaces.push(SurfaceReport::new(loaded.name));
        report.warnings.extend(loaded.notes);
        stage.add(1);
    }
    drop(stage);
    check_output(args, console, &folder.materials)?;
    report.warnings.extend(idle(args, &folder.rows));
    report.warnings.iter().for_each(|warning| console.warn(warning));
    console.result(&BakeReport::new(args, folder.rows.clone(), vec![report]), &folder.table())
}

/// Bakes every material found in a folder.
///
/// # Errors
/// See [`run`](super::run).
pub fn bake_folder(args: &Args, console: &Console) -> Result<Vec<Report>, Error> {
    let materials = scan(&args.input, &args.hints())?.materials;
    check(args, console, &materials)?;
    let mut reports = Vec::new();
    for maps in &materials {
        let reading = console.progress().busy(format!("reading {}", maps.name));
        let loaded = maps.load()?;
        drop(reading);
        for note in &loaded.notes {
            console.warn(note);
        }
        let mut report = Report::new(args);
        report.warnings.clone_from(&loaded.notes);
        report.surfaces.push(bake_material(args, console, &loaded)?);
        report.write(args, &report_file(&loaded.name), Vec::new())?;
        reports.push(report);
    }
    Ok(reports)
}

/// Bytes that the files of a folder will take, by the headers of its maps alone: a library asks for thousands.
pub(super) fn space(args: &Args) -> Result<Space, Error> {
    Ok(planned(args, &scan(&args.input, &args.hints())?.materials).1)
}

/// The files that will be written, and the bytes that they will take.
fn planned(args: &Args, materials: &[MaterialMaps]) -> (Vec<String>, Space) {
    let (mut files, mut space) = (Vec::new(), Space::default());
    for maps in materials {
        let color = maps.color.as_deref().and_then(image_size);
        let sizes = maps.files.iter().filter(|(role, _)| *role != MapRole::Color);
        let sizes = sizes.filter_map(|(_, path)| image_size(path));
        let size = sizes.reduce(|a, b| (a.0.max(b.0), a.1.max(b.1)));
        for (sheet, content) in contents(args, maps) {
            files.extend(texture_files(args, &format!("{}_{}", file_stem(&maps.name), content.name())));
            let (role, format) = match sheet {
                Some(sheet) => (role_of(sheet), sheet_format(args, sheet)),
                None if content == Content::Color => (Role::Color, args.color_format),
                None => (Role::Data, args.aniso_format),
            };
            let size = if content == Content::Color { color } else { size };
            if let Some(size) = size {
                space.add(texture_space(args, args.encoding(role, format).format, size));
            }
        }
        files.push(report_file(&maps.name));
    }
    (files, space)
}

/// Refuses what cannot be baked or written, before the first texture is.
fn check(args: &Args, console: &Console, materials: &[MaterialMaps]) -> Result<(), Error> {
    check_output(args, console, materials)?;
    // A map that is none would be found out after hours of baking the materials before it.
    if let [_, _, ..] = materials {
        let stage = console.progress().stage("reading", materials.len() as u64);
        for maps in materials {
            maps.load()?;
            stage.add(1);
        }
    }
    Ok(())
}

/// Refuses what cannot be written.
fn check_output(args: &Args, console: &Console, materials: &[MaterialMaps]) -> Result<(), Error> {
    let (files, space) = planned(args, materials);
    let mut names: Vec<String> = files.iter().map(|file| file.to_lowercase()).collect();
    names.sort_unstable();
    if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        let reason = format!("two materials would both be written to {}; rename the files of one", pair[0]);
        return Err(Error::file_error(&args.input, reason));
    }
    refuse_other_source(args.output(), &files, &args.input, args.force)?;
    refuse_foreign(args.output(), &files, args.force)?;
    let needed = space.beyond(replaced_bytes(args.output(), &files));
    if let Some(warning) = check_space(args.output(), needed)? {
        console.warn(warning);
    }
    Ok(())
}

/// What is written of a material, and of which sheet of its surface.
fn contents(args: &Args, maps: &MaterialMaps) -> Vec<(Option<Sheet>, Content)> {
    let packed = maps.occlusion.is_some() || maps.metallic.is_some();
    let mut contents: Vec<(Option<Sheet>, Content)> = match (&maps.roughness, packed) {
        (Some(_), _) => sheets(args, packed).into_iter().map(|(s, c)| (Some(s), c)).collect(),
        (None, true) => vec![(None, Content::Orm)],
        (None, false) => Vec::new(),
    };
    contents.extend(maps.color.as_ref().map(|_| (None, Content::Color)));
    contents
}

/// The sheets of a surface, and what their textures are called; roughness may be packed with occlusion and metalness.
fn sheets(args: &Args, packed: bool) -> Vec<(Sheet, Content)> {
    let form = args.form.unwrap_or(Form::Aniso);
    let roughness = if packed { Content::Orm } else { Content::Roughness };
    let sheets = [
        (true, Sheet::Normal, Content::Normal),
        (form.aniso(), Sheet::Aniso, Content::Aniso),
        (form.khr() || packed, Sheet::Roughness, roughness),
        (form.khr(), Sheet::KhrAnisotropy, Content::Anisotropy),
    ];
    sheets.into_iter().filter(|(wanted, ..)| *wanted).map(|(_, sheet, content)| (sheet, content)).collect()
}

fn report_file(material: &str) -> String {
    format!("{}.kinran.json", file_stem(material))
}

fn bake_material(args: &Args, console: &Console, material: &LoadedMaterial) -> Result<SurfaceReport, Error> {
    let name = file_stem(&material.name);
    let mut report = SurfaceReport {
        name: material.name.clone(),
        inputs: inputs(material)?,
        outputs: vec![],
        levels: vec![],
    };
    let image = |at: Option<(usize, usize)>| at.map(|(i, channel)| (&*material.images[i].image, channel));
    let (occlusion, metallic) = (image(material.occlusion), image(material.metallic));

    if let Some(maps) = &material.surface {
        let size = maps.size();
        // One image that holds occlusion and metalness where glTF wants them is packed as it is.
        let packed = match (occlusion, metallic) {
            (None, None) => None,
            _ => {
                let channels = [occlusion, None, metallic, None];
                Some(pack_channels(channels, packed_without(args), size, maps.wrap)?)
            }
        };
        let sheets = sheets(args, packed.is_some());
        let requests: Vec<SheetRequest> = sheets
            .iter()
            .map(|&(sheet, _)| SheetRequest {
                sheet,
                encoding: args.encoding(role_of(sheet), sheet_format(args, sheet)),
                packed_with: packed.as_ref().filter(|_| sheet == Sheet::Roughness),
            })
            .collect();

        let stage = console.progress().stage(format!("{} {name}", args.filter.name()), mip_texels(size));
        let baked = bake_surface(maps, args.options(), &requests, &|texels| stage.tick(texels))?;
        drop(stage);
        let writing = console.progress().stage(format!("writing {name}"), sheets.len() as u64);
        report.levels = baked.levels;
        let written: Vec<Vec<Output>> = (sheets.par_iter().zip(baked.textures))
            .map(|(&(_, map), texture)| {
                let outputs = write_texture(args, &format!("{name}_{}", map.name()), map, texture);
                writing.add(1);
                outputs
            })
            .collect::<Result<_, Error>>()?;
        report.outputs.extend(written.into_iter().flatten());
    } else if occlusion.is_some() || metallic.is_some() {
        let size = |image: Option<(&Image, usize)>| image.map_or((1, 1), |(i, _)| (i.width, i.height));
        let (o, m) = (size(occlusion), size(metallic));
        let channels = [occlusion, None, metallic, None];
        let packed =
            pack_channels(channels, packed_without(args), (o.0.max(m.0), o.1.max(m.1)), args.wrap())?;
        let encoding = args.encoding(Role::Data, args.aniso_format);
        let texture = plain(args, console, &format!("orm {name}"), &packed, Transfer::Linear, encoding)?;
        report.outputs.extend(write_texture(args, &format!("{name}_orm"), Content::Orm, texture)?);
    }

    if let Some(color) = material.images.iter().find(|map| map.role == MapRole::Color) {
        let encoding = args.encoding(Role::Color, args.color_format);
        let texture = plain(args, console, &format!("color {name}"), &color.image, Transfer::Srgb, encoding)?;
        report.outputs.extend(write_texture(args, &format!("{name}_color"), Content::Color, texture)?);
    }
    Ok(report)
}

/// An image that needs no filter of its own, with a bar called `what`.
fn plain(
    args: &Args,
    console: &Console,
    what: &str,
    image: &Image,
    transfer: Transfer,
    encoding: Encoding,
) -> Result<Texture, Error> {
    let stage = console.progress().stage(what, mip_texels((image.width, image.height)));
    let kernel = args.options().kernel;
    Ok(bake_plain(image, transfer, encoding, kernel, args.wrap(), &|texels| stage.tick(texels))?)
}

/// Occlusion, roughness, metalness and alpha of a packed map where there is no map of them: open, as the flag says or is
/// assumed, no metal, opaque.
fn packed_without(args: &Args) -> [u8; 4] {
    let roughness = args.roughness.unwrap_or(ASSUMED_ROUGHNESS);
    [255, (roughness * 255.0).round() as u8, 0, 255]
}

fn inputs(material: &LoadedMaterial) -> Result<Vec<Input>, Error> {
    material
        .images
        .iter()
        .map(|map| {
            Ok(Input {
                file: file_name(&map.path),
                role: map.role.name().into(),
                width: map.image.width,
                height: map.image.height,
                blake3: hash_file(&map.path)?,
                notes: map.remarks.clone(),
            })
        })
        .collect()
}
