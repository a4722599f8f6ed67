//! A folder of authored maps.

use std::path::Path;

use kinran_bake::aniso::{Sheet, SheetRequest, bake_surface_and_metal};
use kinran_bake::folder::{
    ASSUMED_ROUGHNESS, Folder, Hints, LoadedMap, LoadedMaterial, MaterialMaps, Role as MapRole, scan_in,
};
use kinran_bake::metal::BaseAndMetal;
use kinran_bake::{bake_cutout, bake_plain, pack_channels};
use kinran_image::{Encoding, Files, Image, Role, Transfer};
use rayon::prelude::*;

use super::together::{color_texture, together, why_apart};
use super::{file_name, file_stem, mip_texels, put_texture};
use crate::content::Content;
use crate::options::{Form, TextureOptions};
use crate::report::{Input, Output, Report, SurfaceReport};
use crate::sink::place_in;
use crate::{Error, Sink, Space, Stage, Task};

/// How a folder of maps is baked.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FolderOptions {
    /// How textures are filtered, compressed and stored.
    pub textures: TextureOptions,
    /// Which maps hold the lobe; [`Form::Aniso`] by default.
    pub form: Form,
    /// What is known of the maps beside their names and texels.
    pub hints: Hints,
    /// What reports name as their source: the way from the output to the folder, `/`-separated.
    pub source: Option<String>,
}

impl Default for FolderOptions {
    fn default() -> Self {
        FolderOptions {
            textures: TextureOptions::default(),
            form: Form::Aniso,
            hints: Hints::default(),
            source: None,
        }
    }
}

/// What there is to bake in a folder: its maps by material, and a row for each file. No map is read.
///
/// # Errors
/// [`Error::Folder`]: the folder cannot be read or has no maps, or what they hold can be read in more than one way.
pub fn understand(files: &dyn Files, folder: &Path, how: &FolderOptions) -> Result<Folder, Error> {
    Ok(scan_in(files, folder, &how.hints)?)
}

/// Bakes every material of the folder `input` that [`understand`] has understood, by the same options: NAME_normal and NAME_aniso, NAME_color and
/// NAME_orm where there are such maps, and NAME.kinran.json. Gives a report for each material.
///
/// # Errors
/// Whatever is wrong with maps, options or destination. Textures that were written before are whole and stay.
pub fn folder(
    files: &dyn Files,
    input: &Path,
    understood: &Folder,
    how: &FolderOptions,
    out: &dyn Sink,
    task: Task<'_>,
) -> Result<Vec<Report>, Error> {
    how.textures.check()?;
    let (names, space) = folder_plan(files, input, understood, how)?;
    let materials = &understood.materials;
    let maps: Vec<_> =
        materials.iter().flat_map(|maps| &maps.files).map(|(_, map)| files.place(map)).collect();
    let is_map = |name: &&String| place_in(out, name).is_some_and(|place| maps.contains(&Some(place)));
    if let Some(name) = names.iter().find(is_map) {
        let file = out.place(name).filter(|_| out.is_on_disk()).unwrap_or_else(|| name.into());
        return Err(Error::OverMap { file });
    }
    out.expect(&names, space)?;
    // A map that is none would be found out after hours of baking the materials before it.
    if let [_, _, ..] = materials.as_slice() {
        let reading = task.begin(Stage::Reading, "", materials.len() as u64)?;
        for maps in materials {
            maps.load_in(files)?;
            reading.tick(1)?;
        }
    }
    let mut reports = Vec::new();
    for maps in materials {
        let reading = task.begin(Stage::Reading, &maps.name, 0)?;
        let loaded = maps.load_in(files)?;
        drop(reading);
        let mut report = Report::new(&how.textures);
        report.warnings.clone_from(&loaded.notes);
        report.source.clone_from(&how.source);
        report.surfaces.push(bake_material(&loaded, how, &mut report.warnings, out, task)?);
        report.write(out, &report_file(&loaded.name), Vec::new())?;
        reports.push(report);
    }
    Ok(reports)
}

/// The files that [`folder`] will write, and the bytes that they will take, by the headers of the maps alone.
///
/// # Errors
/// [`Error::SameName`] where two materials would be written to one file.
pub fn folder_plan(
    files: &dyn Files,
    input: &Path,
    understood: &Folder,
    how: &FolderOptions,
) -> Result<(Vec<String>, Space), Error> {
    let (mut names, mut space) = (Vec::new(), Space::default());
    for maps in &understood.materials {
        let color = maps.color.as_deref().and_then(|path| files.image_size(path));
        let sizes = maps.files.iter().filter(|(role, _)| *role != MapRole::Color);
        let sizes = sizes.filter_map(|(_, path)| files.image_size(path));
        let size = sizes.reduce(|a, b| (a.0.max(b.0), a.1.max(b.1)));
        for (sheet, content) in contents(how.form, maps) {
            names.extend(how.textures.files(&format!("{}_{}", file_stem(&maps.name), content.name())));
            let encoding = match sheet {
                Some(sheet) => how.textures.of_sheet(sheet),
                None if content == Content::Color => color_encoding(how),
                None => orm_encoding(how),
            };
            let size = if content == Content::Color { color } else { size };
            if let Some(size) = size {
                space.add(how.textures.space(encoding.format, size));
            }
        }
        names.push(report_file(&maps.name));
    }
    let mut sorted: Vec<String> = names.iter().map(|name| name.to_lowercase()).collect();
    sorted.sort_unstable();
    if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Error::SameName {
            input: input.into(),
            what: "materials",
            name: pair[0].clone(),
            fix: "rename the files of one",
        });
    }
    Ok((names, space))
}

fn color_encoding(how: &FolderOptions) -> Encoding {
    how.textures.encoding(Role::Color, how.textures.color_format)
}

fn orm_encoding(how: &FolderOptions) -> Encoding {
    how.textures.encoding(Role::Data, how.textures.aniso_format)
}

/// What is written of a material, and of which sheet of its surface.
fn contents(form: Form, maps: &MaterialMaps) -> Vec<(Option<Sheet>, Content)> {
    let packed = maps.occlusion.is_some() || maps.metallic.is_some();
    let mut contents: Vec<(Option<Sheet>, Content)> = match (&maps.roughness, packed) {
        (Some(_), _) => sheets(form, packed).into_iter().map(|(s, c)| (Some(s), c)).collect(),
        (None, true) => vec![(None, Content::Orm)],
        (None, false) => Vec::new(),
    };
    contents.extend(maps.color.as_ref().map(|_| (None, Content::Color)));
    contents
}

/// The sheets of a surface, and what their textures are called; roughness may be packed with occlusion and metalness.
fn sheets(form: Form, packed: bool) -> Vec<(Sheet, Content)> {
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

fn bake_material(
    material: &LoadedMaterial,
    how: &FolderOptions,
    warnings: &mut Vec<String>,
    out: &dyn Sink,
    task: Task<'_>,
) -> Result<SurfaceReport, Error> {
    let name = file_stem(&material.name);
    let mut report = SurfaceReport {
        name: material.name.clone(),
        inputs: inputs(material),
        outputs: vec![],
        levels: vec![],
    };
    let image = |at: Option<(usize, usize)>| at.map(|(i, channel)| (&*material.images[i].image, channel));
    let (occlusion, metallic) = (image(material.occlusion), image(material.metallic));
    let mut chosen = None;

    if let Some(maps) = &material.surface {
        let reflectance = material.reflectance().filter(|_| how.textures.is_correlated());
        let apart = reflectance.as_ref().and_then(|reflectance| why_apart(&material.name, reflectance, maps));
        warnings.extend(apart);
        let cutoff = how.textures.alpha_coverage.of_folder();
        let kernel = how.textures.kernel;
        let together = together(maps, reflectance.as_ref(), cutoff, false, &name, kernel, task)?;
        let pair = together.pair.as_ref();
        let color =
            |pair: &BaseAndMetal| color_texture(&pair.color, Content::Color, &name, &how.textures, task);
        chosen = pair.map(color).transpose()?;
        let (maps, metallic_levels) = (&together.maps, pair.map_or(&[][..], |pair| &pair.metallic));
        let size = maps.size();
        // One image that holds occlusion and metalness where glTF wants them is packed as it is.
        let packed = match (occlusion, metallic) {
            (None, None) => None,
            _ => {
                let channels = [occlusion, None, metallic, None];
                Some(pack_channels(channels, packed_without(&how.hints), size, maps.wrap)?)
            }
        };
        let sheets = sheets(how.form, packed.is_some());
        let requests: Vec<SheetRequest> = sheets
            .iter()
            .map(|&(sheet, _)| SheetRequest {
                sheet,
                encoding: how.textures.of_sheet(sheet),
                packed_with: packed.as_ref().filter(|_| sheet == Sheet::Roughness),
            })
            .collect();

        let filtering = task.begin(Stage::Filtering(how.textures.filter), &name, mip_texels(size))?;
        let baked =
            bake_surface_and_metal(maps, how.textures.surface(), &requests, metallic_levels, &|texels| {
                filtering.tick(texels)
            })?;
        drop(filtering);
        let writing = task.begin(Stage::Writing, &name, sheets.len() as u64)?;
        report.levels = baked.levels;
        let written: Vec<Vec<Output>> = (sheets.par_iter().zip(baked.textures))
            .map(|(&(_, map), texture)| {
                let file = format!("{name}_{}", map.name());
                let outputs = put_texture(&how.textures, &file, map, texture, out);
                writing.tick(1)?;
                outputs
            })
            .collect::<Result<_, Error>>()?;
        report.outputs.extend(written.into_iter().flatten());
    } else if occlusion.is_some() || metallic.is_some() {
        let size = |image: Option<(&Image, usize)>| image.map_or((1, 1), |(i, _)| (i.width, i.height));
        let (o, m) = (size(occlusion), size(metallic));
        let channels = [occlusion, None, metallic, None];
        let size = (o.0.max(m.0), o.1.max(m.1));
        let packed = pack_channels(channels, packed_without(&how.hints), size, how.hints.wrap)?;
        report.outputs.extend(bake_map(&name, Content::Orm, &packed, how, out, task)?);
    }

    if let Some(color) = material.images.iter().find(|map| map.role == MapRole::Color) {
        report.outputs.extend(match chosen {
            Some(texture) => {
                let file = format!("{name}_{}", Content::Color.name());
                put_texture(&how.textures, &file, Content::Color, texture, out)?
            }
            None => bake_map(&name, Content::Color, &color.image, how, out, task)?,
        });
    }
    Ok(report)
}

/// A map that needs no filter of its own: colour, or occlusion and metalness.
fn bake_map(
    name: &str,
    content: Content,
    image: &Image,
    how: &FolderOptions,
    out: &dyn Sink,
    task: Task<'_>,
) -> Result<Vec<Output>, Error> {
    let (transfer, encoding) = match content {
        Content::Color => (Transfer::Srgb, color_encoding(how)),
        _ => (Transfer::Linear, orm_encoding(how)),
    };
    let averaging = task.begin(Stage::Averaging(content), name, mip_texels((image.width, image.height)))?;
    let (kernel, wrap) = (how.textures.kernel, how.hints.wrap);
    let tick = |texels| averaging.tick(texels);
    let cutoff = how.textures.alpha_coverage.of_folder().filter(|_| content == Content::Color);
    let texture = match cutoff {
        Some(cutoff) => bake_cutout(image, cutoff, encoding, kernel, wrap, &tick)?,
        None => bake_plain(image, transfer, encoding, kernel, wrap, &tick)?,
    };
    drop(averaging);
    put_texture(&how.textures, &format!("{name}_{}", content.name()), content, texture, out)
}

/// Occlusion, roughness, metalness and alpha of a packed map where there is no map of them: open, as the flag says or is
/// assumed, no metal, opaque.
fn packed_without(hints: &Hints) -> [u8; 4] {
    let roughness = hints.roughness.unwrap_or(ASSUMED_ROUGHNESS);
    [255, (roughness * 255.0).round() as u8, 0, 255]
}

fn inputs(material: &LoadedMaterial) -> Vec<Input> {
    let input = |map: &LoadedMap| Input {
        file: file_name(&map.path),
        role: map.role.name().into(),
        width: map.image.width,
        height: map.image.height,
        blake3: map.blake3.clone(),
        notes: map.remarks.clone(),
    };
    material.images.iter().map(input).collect()
}
