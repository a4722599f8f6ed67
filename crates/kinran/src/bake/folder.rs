//! A folder of authored maps.

use kinran_bake::aniso::{Sheet, SheetRequest, bake_surface};
use kinran_bake::folder::{LoadedMaterial, Role as MapRole, scan};
use kinran_bake::{bake_plain, pack_channels};
use kinran_image::{Image, Role, Transfer, full_level_count, level_size};
use rayon::prelude::*;

use super::report::hash_file;
use super::{Args, Form, Input, Output, Report, SurfaceReport, file_name, file_stem, write_texture};
use crate::{Console, Error};

/// Bakes a folder and tells what came of it.
pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let table = scan(&args.input, &args.hints())?.table();
    let reports = bake_folder(args, console)?;
    let files: String = reports.iter().map(|report| report.text(args.output())).collect();
    console.result(&reports, &format!("{table}\n{files}"))
}

/// Tells what was understood of a folder.
pub(super) fn dry_run(args: &Args, console: &Console) -> Result<(), Error> {
    let folder = scan(&args.input, &args.hints())?;
    console.result(&folder, &folder.table())
}

/// Bakes every material found in a folder.
///
/// # Errors
/// See [`run`](super::run).
pub fn bake_folder(args: &Args, console: &Console) -> Result<Vec<Report>, Error> {
    let mut reports = Vec::new();
    for maps in &scan(&args.input, &args.hints())?.materials {
        let loaded = maps.load()?;
        for note in &loaded.notes {
            console.warn(note);
        }
        let mut report = Report::new(args);
        report.warnings.clone_from(&loaded.notes);
        report.surfaces.push(bake_material(args, console, &loaded)?);
        report.write(&args.output().join(format!("{}.kinran.json", file_stem(&loaded.name))))?;
        reports.push(report);
    }
    Ok(reports)
}

fn bake_material(args: &Args, console: &Console, material: &LoadedMaterial) -> Result<SurfaceReport, Error> {
    let form = args.form.unwrap_or(Form::Aniso);
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
            _ => Some(pack_channels([occlusion, None, metallic, None], size, maps.wrap)?),
        };
        let mut requests = vec![SheetRequest {
            sheet: Sheet::Normal,
            encoding: args.encoding(Role::Normal, args.normal_format),
            packed_with: None,
        }];
        let mut request = |sheet, role, packed_with| {
            requests.push(SheetRequest {
                sheet,
                encoding: args.encoding(role, args.aniso_format),
                packed_with,
            });
        };
        if form.aniso() {
            request(Sheet::Aniso, Role::Aniso, None);
        }
        if form.khr() || packed.is_some() {
            request(Sheet::Roughness, Role::Data, packed.as_ref());
        }
        if form.khr() {
            request(Sheet::KhrAnisotropy, Role::Aniso, None);
        }

        let texels = (0..full_level_count(size.0, size.1))
            .map(|level| u64::from(level_size(size.0, level)) * u64::from(level_size(size.1, level)))
            .sum();
        let stage = console.progress().stage(format!("{} {name}", args.filter.name()), texels);
        let baked = bake_surface(maps, args.options(), &requests, &|texels| stage.add(texels))?;
        report.levels = baked.levels;
        let written: Vec<Vec<Output>> = (requests.par_iter().zip(baked.textures))
            .map(|(request, texture)| {
                let map = if request.packed_with.is_some() { "orm" } else { request.sheet.name() };
                write_texture(args, &format!("{name}_{map}"), map, texture)
            })
            .collect::<Result<_, Error>>()?;
        report.outputs.extend(written.into_iter().flatten());
    } else if occlusion.is_some() || metallic.is_some() {
        let size = |image: Option<(&Image, usize)>| image.map_or((1, 1), |(i, _)| (i.width, i.height));
        let (o, m) = (size(occlusion), size(metallic));
        let packed =
            pack_channels([occlusion, None, metallic, None], (o.0.max(m.0), o.1.max(m.1)), args.wrap())?;
        let encoding = args.encoding(Role::Data, args.aniso_format);
        let texture = bake_plain(&packed, Transfer::Linear, encoding, args.options().kernel, args.wrap())?;
        report.outputs.extend(write_texture(args, &format!("{name}_orm"), "orm", texture)?);
    }

    if let Some(color) = material.images.iter().find(|map| map.role == MapRole::Color) {
        let encoding = args.encoding(Role::Color, args.color_format);
        let texture = bake_plain(&color.image, Transfer::Srgb, encoding, args.options().kernel, args.wrap())?;
        report.outputs.extend(write_texture(args, &format!("{name}_color"), "color", texture)?);
    }
    Ok(report)
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
            })
        })
        .collect()
}
