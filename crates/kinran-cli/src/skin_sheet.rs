//! `kinran skin`: a model as skin, choice by choice, as the talk compares them.

use std::path::PathBuf;
use std::sync::Arc;

use clap::ValueEnum;
use glam::{Mat3, Vec2, Vec3, Vec4, vec2, vec3};
use kinran::bake::{Joined, measured, meshes, pose_scale, triangles_of, unit};
use kinran_bake::aniso::Filter;
use kinran_bake::curvature::{
    BLUR, CurvatureError, Mesh, Method, Options, bake_curvature, estimated_normals, principal,
};
use kinran_bake::skin_lut::{Profile, Table, punctual_table};
use kinran_image::untold;
use kinran_render::reference::{
    PictureCamera, RenderScene, RenderSkin, SkinCurvature, SkinTable, SurfacePoint, TextureFiltering,
};
use kinran_scene::{Light, LightKind, Needs, Primitive, Scene, Skin, VertexCurvature, any_tangent};
use kinran_shading::Sym2;
use kinran_shading::skin::curvature::curvature_decode;
use kinran_shading::skin::lighting::SKIN_NORMAL_BLUR;
use kinran_shading::skin::profile::Gaussian;
use schemars::JsonSchema;
use serde::Serialize;

use crate::bake::curvature::{Blur, METHODS, deviations};
use crate::model::{model_at, read_scene};
use crate::picture::{Color, INK, PAPER, Picture, Row, grid};
use crate::skin::{SIZE, profile, skin_table};
use crate::skin_lut::plot::plot;
use crate::surfaces::{self, Mips, scene_surfaces};
use crate::values::{choice, counted, number, vector};
use crate::view::{EnvironmentChoice, View, ViewArgs, file_name, samples_of};
use crate::{Console, Error, Progress, outputs, sheet_flags};

/// Draws a model as skin, a sheet of pictures for each choice
///
/// Sheets: turn (zero, mean and directional curvature under a light that goes round without shadows, and what direction changes), curvature
/// (in false colour, beside the picture and over the table of punctual light), profiles (the radial profile on the ring,
/// which is wrong, beside the linear one, and their difference enlarged), shadows (hard, filtered, and with light scattering
/// into penumbras), normals (of the map for all channels, blurred by channel, of the mesh), tensors (directions of the larger
/// curvature as short lines).
///
/// Pictures show the part of the model where curvature depends most on direction, such as a face or fingers; --whole,
/// --crop, --camera or --distance show another one. Every material is taken for skin unless the file marks some, and has the
/// colour of skin where the file gives none. Each sheet has its own lights; those of --light take the place of one that stands
/// still, and --env adds light from all around. Curvature is that of the file, or baked in memory where it has none, of smooth
/// normals where it has none of those either.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran skin head.gltf -o head/ --unit-mm 50
  kinran skin hand.obj -o hand/ --unit-mm 1000 --sheet turn,curvature
  kinran skin goat.obj -o goat/ --sheet tensors \\
      --curvature-method fit --curvature-blur none")]
pub struct Args {
    /// The .glb, .gltf or .obj file
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// The folder for the sheets [default: NAME.skin beside the input]
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// Draws these sheets; all by default
    #[arg(long, value_enum, value_delimiter = ',', value_name = "NAMES")]
    pub sheet: Vec<Sheet>,

    /// Linear colour of the skin, in the place of the file's
    #[arg(long, value_name = "R,G,B", value_parser = vector)]
    pub base: Option<Vec3>,

    /// Millimetres in a unit of the file's meshes; the default is a metre times the nodes' scale
    #[arg(long, value_name = "MM", value_parser = |t: &str| number(t, 1e-6..=1e9))]
    pub unit_mm: Option<f32>,

    /// Shows the whole model
    #[arg(long, conflicts_with = "crop")]
    pub whole: bool,

    /// Shows this part of every picture: left, top, width and height, of 0 to 1
    #[arg(long, value_name = "X,Y,W,H", value_parser = part)]
    pub crop: Option<[f32; 4]>,

    /// How tensors are found
    #[arg(long, value_name = "CURVATURE_METHOD", default_value = "normals", value_parser = choice(METHODS))]
    pub curvature_method: Method,

    /// Deviations of the Gaussians that blur curvature, mm, or "none" [default: 8,2.3]
    #[arg(long, value_name = "MM,MM", value_parser = deviations)]
    pub curvature_blur: Option<Blur>,

    /// Samples in a pixel
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub spp: u32,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub view: ViewArgs,
}

impl Args {
    /// Flags that some sheets have no use for.
    fn given(&self) -> Vec<&'static str> {
        let own = [("base", self.base.is_some()), ("spp", self.spp != 16)];
        let own = own.into_iter().filter(|(_, given)| *given).map(|(name, _)| name);
        own.chain(sheet_flags::given(&self.view)).collect()
    }

    /// Whether a flag of [`Args::given`] shows on a sheet.
    fn obeys(&self, flag: &str, sheet: Sheet) -> bool {
        match (flag, sheet) {
            // It is drawn in grey, without light.
            (_, Sheet::Tensors) => false,
            ("light", Sheet::Turn | Sheet::Profiles)
            | ("no-shadows", Sheet::Turn | Sheet::Shadows)
            | ("skin-curvature", Sheet::Turn)
            | ("skin-normals", Sheet::Normals) => false,
            ("skin-penumbra", Sheet::Turn) => self.view.shadows,
            _ => true,
        }
    }
}

fn part(text: &str) -> Result<[f32; 4], String> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(|n| n.trim().parse::<f32>()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, w, h]) if x >= 0.0 && y >= 0.0 && w > 0.0 && h > 0.0 && x + w <= 1.0 && y + h <= 1.0 => {
            Ok([x, y, w, h])
        }
        _ => Err("write left, top, width and height of a part inside of the picture, such as 0.25,0,0.5,0.5"
            .into()),
    }
}

/// What a sheet shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Sheet {
    Turn,
    Curvature,
    Profiles,
    Shadows,
    Normals,
    Tensors,
}

/// Linear colour of skin of which the file says nothing; chosen by eye.
const SKIN_COLOR: Vec3 = vec3(0.75, 0.48, 0.38);

/// How many times as bright as the lights of flags the sheets' own are, since most of what they show is at grazing light;
/// chosen by eye.
const BRIGHTNESS: f32 = 2.0;

/// Roughness of such skin; chosen by eye.
const SKIN_ROUGHNESS: f32 = 0.5;

/// Where the light of the turn sheet stands, degrees round the camera's view to the right: low enough on both sides that
/// shadows end on what the camera sees; chosen by eye.
const TURN: [(&str, f32); 4] = [
    ("light behind left", -110.0),
    ("light from the left", -70.0),
    ("light from the right", 70.0),
    ("light behind right", 110.0),
];

/// Pixels between the tensors' lines.
const SPACING: u32 = 9;

#[derive(Serialize, JsonSchema)]
pub(crate) struct Summary {
    files: Vec<String>,
    warnings: Vec<String>,
}

/// The command.
///
/// # Errors
/// One that names the flag or the file.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let output = args.output.clone().unwrap_or_else(|| outputs::named_after(&args.file, ".skin"));
    outputs::check_folder(&output)?;
    let sheets = if args.sheet.is_empty() { Sheet::value_variants() } else { &args.sheet };
    sheet_flags::refuse_idle(&args.given(), sheets, |flag, sheet| args.obeys(flag, sheet))?;
    let pictures = sheets.iter().map(|&sheet| output.join(sheet_file(sheet)));
    args.view.refuse_inputs(&args.file, pictures)?;
    if let Some(c) = args.base.filter(|c| c.min_element() < 0.0 || c.max_element() > 1.0) {
        let given = format!("--base {},{},{}", c.x, c.y, c.z);
        return Err(Error::flag_error(given, "each must lie in 0 to 1"));
    }
    let progress = console.progress();
    let file = model_at(&args.file)?;
    let mut scene = read_scene(&file, &args.view.model, &Needs::ALL, &progress)?;
    let mut warnings = scene.warnings.clone();
    if scene.materials.iter().all(|m| m.skin.is_none()) {
        scene.materials.iter_mut().for_each(|m| m.skin = Some(Skin::default()));
    }
    bake(args, &mut scene, &progress, &mut warnings)?;

    // Punctual light shows what skin does, and light from all around only where it is asked for.
    let shown =
        ViewArgs { env: Some(args.view.env.clone().unwrap_or(EnvironmentChoice::None)), ..args.view.clone() };
    shown.refuse_idle(&scene, &file.to_string_lossy())?;
    let mut view = View::new(&scene, &file.to_string_lossy(), &shown)?;
    // Skin is no metal, and may be given another colour.
    let mips = Mips::Filtered(surfaces::Method::new(Filter::Linear, false));
    let (surfaces, apart) = scene_surfaces(&scene, mips, &progress)?;
    warnings.extend(view.environment_notes().cloned().chain(apart));
    warnings.iter().for_each(|w| console.warn(w));
    let mut prepared = view.scene(&scene, surfaces, &progress)?;
    // An .obj has no colours, and white is what a glTF that says nothing gives.
    let colorless = outputs::has_extension(&file, "obj");
    for material in &mut prepared.materials {
        let white = material.base_color.is_none() && material.base_color_factor.truncate() == Vec3::ONE;
        let unsaid = colorless || white;
        if let Some(base) = args.base.or_else(|| unsaid.then_some(SKIN_COLOR)) {
            material.base_color_factor = base.extend(material.base_color_factor.w);
            material.base_color = None;
            if unsaid {
                (material.metallic_factor, material.roughness_factor) = (0.0, SKIN_ROUGHNESS);
            }
        }
    }
    if !args.whole && args.crop.is_none() && args.view.camera.is_none() && args.view.distance == 1.0 {
        approach(&mut view, &prepared);
    }
    if let Some(remark) = too_flat(&prepared) {
        console.warn(&remark);
        warnings.push(remark);
    }
    let pictures = sheets.iter().map(|&sheet| count(sheet)).sum::<u64>();
    let all = progress.stage("sheets", pictures * samples_of(args.view.size, args.spp));
    let progress = progress.overall(&all);
    let studio = Studio { args, scene: &scene, prepared, view, progress: &progress };

    kinran_image::make_folder(&output)?;
    let mut files = Vec::new();
    for &sheet in sheets {
        let name = sheet_file(sheet);
        studio.sheet(sheet)?.write(&output.join(&name))?;
        files.push(name);
    }
    drop(all);
    let sheets = counted(files.len(), "sheet of", "sheets of");
    let text = format!("{sheets} {}: in {}", file_name(&args.file), output.display());
    console.result(&Summary { files, warnings }, &text)?;
    outputs::tell_place(console, args.output.as_deref(), &output);
    Ok(())
}

/// What the camera sees at a point of the picture.
fn seen(scene: &RenderScene, camera: &PictureCamera, at: Vec2) -> Option<(SurfacePoint, Vec3)> {
    let ray = camera.ray(at.x, at.y);
    let hit = scene.geometry.bvh().closest_hit(ray.origin, ray.direction, 0.0, f32::INFINITY)?;
    Some((scene.geometry.surface_point(&hit, &ray), -ray.direction))
}

/// Moves the camera to the part of the picture, two fifths of its width and height, where principal curvatures differ most: there mean and
/// directional curvature are seen to differ.
fn approach(view: &mut View, scene: &RenderScene) {
    const SHARE: f32 = 0.4;
    /// Rays along the picture's shorter side, and the step between parts that are tried.
    const RAYS: u32 = 96;
    const STEP: usize = 4;
    /// What is beyond this share of the range counts no more: tips and edges are no reason to look at them.
    const ENOUGH: f32 = 0.2;
    /// A part is worth a look from this share of the range on, in the mean; chosen by eye.
    const ROUND: f32 = 0.02;
    let shorter = view.size.0.min(view.size.1);
    let [columns, rows] = [view.size.0, view.size.1].map(|side| (side * RAYS / shorter).max(8));
    let camera = PictureCamera::new(&view.camera, columns, rows);
    let range = scene.geometry.curvature_range();
    let points: Vec<Option<(f32, Vec3)>> = (0..columns * rows)
        .map(|i| {
            let at = vec2((i % columns) as f32 + 0.5, (i / columns) as f32 + 0.5);
            let (point, _) = seen(scene, &camera, at)?;
            let (larger, smaller, _) = principal(curvature_decode(point.curvature, range).0);
            Some(((larger - smaller).min(ENOUGH * range), point.position))
        })
        .collect();
    let [wide, high] = [columns, rows].map(|side| (SHARE * side as f32) as usize);
    let inside = |left: usize, top: usize| {
        let row = move |y: usize| y * columns as usize + left;
        let points = &points;
        (top..top + high).flat_map(move |y| points[row(y)..row(y) + wide].iter().flatten())
    };
    let places = (0..=rows as usize - high)
        .step_by(STEP)
        .flat_map(|top| (0..=columns as usize - wide).step_by(STEP).map(move |left| (left, top)));
    let weight = |&(left, top): &(usize, usize)| inside(left, top).map(|(weight, _)| weight).sum::<f32>();
    let Some((left, top)) = places.max_by(|a, b| weight(a).total_cmp(&weight(b))) else { return };
    let (sum, count) = inside(left, top).fold((Vec3::ZERO, 0u32), |(sum, n), (_, p)| (sum + p, n + 1));
    // Where curvature is alike in all directions, as on a ball, no part shows more than the whole.
    if weight(&(left, top)) <= ROUND * range * count as f32 {
        return;
    }
    // The new axis goes through the middle of the part, at the mean depth of what is seen in it.
    let camera = &mut view.camera;
    let eye = Vec3::from(camera.transform.translation);
    let (right, up, back) = {
        let m = Mat3::from(camera.transform.matrix3);
        (m.x_axis, m.y_axis, m.z_axis)
    };
    let depth = (eye - sum / count as f32).dot(back);
    let tangent = (0.5 * camera.yfov).tan();
    let aspect = columns as f32 / rows as f32;
    let x = (left + wide / 2) as f32 / columns as f32 * 2.0 - 1.0;
    let y = 1.0 - (top + high / 2) as f32 / rows as f32 * 2.0;
    let middle = eye - depth * back + depth * tangent * (x * aspect * right + y * up);
    camera.transform.translation = (middle + SHARE * depth * back).into();
    view.middle = middle;
}

/// How many pictures a sheet has drawn for it, with samples.
fn count(sheet: Sheet) -> u64 {
    match sheet {
        Sheet::Turn => 3 * TURN.len() as u64,
        Sheet::Curvature => 1,
        Sheet::Profiles => 4,
        Sheet::Shadows | Sheet::Normals => 3,
        Sheet::Tensors => 0,
    }
}

/// A sentence where no curvature of the model changes what its skin looks like by as much as one sees.
fn too_flat(prepared: &RenderScene) -> Option<String> {
    let range = prepared.geometry.curvature_range();
    let changes = |table: &SkinTable| {
        let (first, last) = (&table.texels[..table.width], &table.texels[table.texels.len() - table.width..]);
        let apart = first.iter().zip(last).map(|(flat, curved)| (*flat - *curved).abs().max_element());
        apart.fold(0.0, f32::max)
    };
    let tables = || prepared.materials.iter().filter_map(|m| m.skin.as_ref());
    let skin = tables().next()?;
    let most = tables().map(|skin| changes(&skin.tables.punctual)).fold(0.0, f32::max);
    (most < FLAT).then(|| {
        format!(
            "nothing here is curved more than a ball of {:.0} mm, on which light hardly scatters round the edge: the rows will \
             look alike. A unit of the file is taken as {:.0} mm; --unit-mm says otherwise",
            range.recip(),
            skin.millimetres
        )
    })
}

/// Irradiance at grazing light, of 1, from which skin looks unlike plain diffuse; chosen by eye.
const FLAT: f32 = 0.02;

/// The name of a sheet's picture.
fn sheet_file(sheet: Sheet) -> String {
    format!("{}.png", sheet.to_possible_value().expect("no sheet is hidden").get_name())
}

/// Gives meshes without curvature some, as `kinran bake` would write it.
fn bake(
    args: &Args,
    scene: &mut Scene,
    progress: &Progress,
    warnings: &mut Vec<String>,
) -> Result<(), Error> {
    let groups = meshes(scene);
    let stage = progress.stage("curvature", triangles_of(scene, groups.iter().flatten()));
    for group in groups {
        if group.iter().all(|&i| scene.primitives[i].curvature.is_some()) {
            stage.add(triangles_of(scene, group.iter()));
            continue;
        }
        let name = format!("mesh {}", scene.primitives[group[0]].source.mesh);
        if group.iter().any(|&i| scene.primitives[i].source.lacks_normals) {
            let primitives: Vec<&Primitive> = group.iter().map(|&i| &scene.primitives[i]).collect();
            let surface = Joined::new(&primitives);
            let normals = estimated_normals(&surface.positions, &surface.triangles, &untold)?;
            for (&i, &first) in group.iter().zip(&surface.firsts) {
                let primitive = &mut scene.primitives[i];
                if !primitive.source.lacks_normals {
                    continue;
                }
                for (vertex, normal) in primitive.normals.iter_mut().enumerate() {
                    *normal = normals[first + vertex].normalize_or(*normal);
                }
                primitive.tangents = primitive.normals.iter().map(|&n| any_tangent(n)).collect();
            }
            warnings.push(format!("{name} has no normals; smooth ones were estimated"));
        }
        let surface = measured(scene, &group, &name, warnings);
        let millimetres = args.unit_mm.map_or_else(|| unit(scene, &group, &name, warnings), f64::from)
            / pose_scale(&scene.primitives[group[0]]);
        let options = Options {
            method: args.curvature_method,
            millimetres,
            blur: args.curvature_blur.as_ref().map_or_else(|| BLUR.to_vec(), |blur| blur.0.clone()),
            clamp: true,
        };
        let mesh = Mesh {
            positions: &surface.positions,
            normals: Some(&surface.normals),
            tangents: Some(&surface.tangents),
            triangles: &surface.triangles,
        };
        let baked =
            bake_curvature(&mesh, &options, &|triangles| stage.tick(triangles)).map_err(|e| match e {
                CurvatureError::Cancelled(stopped) => stopped.into(),
                e => Error::file_error(&args.file, format!("{name}: {e}")),
            })?;
        let remarks = baked.report.remarks();
        if !remarks.is_empty() {
            warnings.push(format!("{name}: {remarks}"));
        }
        let packed = baked.pack(baked.fitting_range());
        for (&i, &first) in group.iter().zip(&surface.firsts) {
            let primitive = &mut scene.primitives[i];
            let bytes = &packed.bytes[first..first + primitive.positions.len()];
            let code = |bytes: &[u8; 4]| Vec4::from_array(bytes.map(|b| f32::from(b) / 255.0));
            primitive.curvature = Some(VertexCurvature {
                codes: bytes.iter().map(code).collect(),
                range: packed.range,
                millimetres: millimetres as f32,
            });
        }
    }
    Ok(())
}

struct Studio<'a> {
    args: &'a Args,
    scene: &'a Scene,
    prepared: RenderScene,
    view: View,
    progress: &'a Progress,
}

impl Studio<'_> {
    fn sheet(&self, sheet: Sheet) -> Result<Picture, Error> {
        match sheet {
            Sheet::Turn => self.turn(),
            Sheet::Curvature => self.curvature(),
            Sheet::Profiles => self.profiles(),
            Sheet::Shadows => self.shadows(),
            Sheet::Normals => self.normals(),
            Sheet::Tensors => {
                Ok(self.row(vec![("directions of the larger curvature".into(), self.tensors())]))
            }
        }
    }

    /// Zero, mean and directional curvature, each under a light from several sides, and what the last two differ by.
    fn turn(&self) -> Result<Picture, Error> {
        let drawn = [SkinCurvature::Zero, SkinCurvature::Mean, SkinCurvature::Directional].map(|curvature| {
            TURN.map(|(_, degrees)| {
                // Shadows hide where light ends by curvature.
                let view = View { shadows: self.args.view.shadows, ..self.view.clone() };
                let mut scene = self.prepared.clone();
                scene
                    .materials
                    .iter_mut()
                    .filter_map(|m| m.skin.as_mut())
                    .for_each(|s| s.curvature = curvature);
                self.draw_in(&view, "turn", &scene, &self.around(degrees))
            })
        });
        let mut pictures: Vec<Vec<Picture>> = Vec::new();
        for row in drawn {
            pictures.push(row.into_iter().collect::<Result<_, Error>>()?);
        }
        let (apart, gain) = enlarged_differences(&pictures[1], &pictures[2]);
        pictures.push(apart);
        let change = match gain {
            None => {
                "what direction changes: nothing that shows at this size; --unit-mm says another".to_owned()
            }
            Some(gain) => format!("what direction changes, {gain} times enlarged"),
        };
        let names = [
            "zero: light does not scatter".to_owned(),
            "mean curvature: light scatters alike in all directions".into(),
            "directional curvature: most across ridges, hardly along them".into(),
            change,
        ];
        let rows = names.into_iter().zip(pictures).enumerate().map(|(i, (name, pictures))| Row {
            name,
            cells: (TURN.iter().zip(pictures))
                .map(|(&(label, _), picture)| {
                    (if i == 0 { label.to_owned() } else { String::new() }, picture)
                })
                .collect(),
        });
        Ok(self.rows(rows.collect()))
    }

    /// The picture, curvatures in false colour, and the table.
    fn curvature(&self) -> Result<Picture, Error> {
        let range = self.prepared.geometry.curvature_range();
        // By the root: most of a body is gently curved.
        let color = |k: f32| false_color((k / range).sqrt());
        let lit = self.args.view.skin.skin_curvature.to_possible_value().expect("no curvature is hidden");
        let row = vec![
            (lit.get_name().to_owned(), self.lit("picture", &self.side(), |_| {})?),
            ("mean curvature".to_owned(), self.colored(|_, mean| color(mean))),
            ("larger principal".to_owned(), self.colored(|t, _| color(principal(t).0))),
            ("smaller principal".to_owned(), self.colored(|t, _| color(principal(t).1.max(0.0)))),
        ];
        let pictures = self.row(row);
        let skin = self.skin()?;
        let table = |t: &SkinTable| Table {
            width: t.width,
            height: t.height,
            entries: t.texels.iter().map(|t| t.to_array()).collect(),
        };
        let title = format!("{}: tables up to its largest curvature", file_name(&self.args.file));
        let below =
            plot(&title, &table(&skin.tables.punctual), &table(&skin.tables.ambient), skin.tables.range);

        // A scale between both.
        const SCALE: u32 = 52;
        let width = pictures.width.max(below.width);
        let mut sheet = Picture::new(width, pictures.height + SCALE + below.height, PAPER);
        sheet.draw(0, 0, &pictures);
        let (left, length) = (220, 420);
        sheet.text((10, pictures.height + 20), 20.0, INK, "curvature, 1/mm");
        for x in 0..length {
            let color = false_color(x as f32 / (length - 1) as f32);
            sheet.draw(left + x, pictures.height + 6, &Picture::new(1, 14, color));
        }
        for i in 0..=4 {
            let label = format!("{:.3}", range * (i as f32 / 4.0).powi(2));
            sheet.text((left + i * (length - 1) / 4 - 20, pictures.height + 42), 17.0, INK, &label);
        }
        sheet.draw(0, pictures.height + SCALE, &below);
        Ok(sheet)
    }

    /// The table from the radial profile as if it were linear, and from the linear one.
    fn profiles(&self) -> Result<Picture, Error> {
        self.skin()?;
        let mut wrong = Vec::new();
        for material in &self.scene.materials {
            let Some(skin) = &material.skin else {
                wrong.push(None);
                continue;
            };
            let Profile::Gaussians(sum) = profile(skin) else {
                let reason = format!(
                    "material \"{}\": Burley's radial profile diverges on a ring, so there is no wrong picture; leave \
                     the sheet out",
                    material.name
                );
                return Err(Error::flag_error_of(&self.args.file, "--sheet profiles", reason));
            };
            // A Gaussian per area over a line is one per length, its weight divided by the root of 2 π times the variance.
            let divide = |g: &Gaussian| Gaussian { weight: g.weight.map(|w| w / g.variance.sqrt()), ..*g };
            wrong.push(Some(Profile::Gaussians(sum.iter().map(divide).collect())));
        }
        let (mut wrongs, mut rights) = (Vec::new(), Vec::new());
        for degrees in [-80.0, 100.0] {
            let light = self.around(degrees);
            let mut swapped = self.prepared.clone();
            for (material, wrong) in swapped.materials.iter_mut().zip(&wrong) {
                let (Some(skin), Some(wrong)) = (&mut material.skin, wrong) else { continue };
                let radial = wrong.radial().map_err(|e| Error::Internal(e.to_string()))?;
                let mut tables = (*skin.tables).clone();
                let range = f64::from(tables.range);
                tables.punctual = skin_table(punctual_table(radial, SIZE.0, SIZE.1, range, &untold)?);
                skin.tables = Arc::new(tables);
            }
            wrongs.push(self.draw("radial", &swapped, &light)?);
            rights.push(self.draw("linear", &self.prepared, &light)?);
        }
        let (apart, gain) = enlarged_differences(&wrongs, &rights);
        let mut apart = apart.into_iter();
        let rows = wrongs.into_iter().zip(rights).map(|(wrong, right)| {
            let mut cells = vec![
                ("radial profile on the ring (wrong)".to_owned(), wrong),
                ("linear profile (right)".to_owned(), right),
            ];
            if let (Some(apart), Some(gain)) = (apart.next(), gain) {
                cells.push((format!("difference, {gain} times enlarged"), apart));
            }
            Row { name: String::new(), cells }
        });
        let mut rows: Vec<Row> = rows.collect();
        if gain.is_none() {
            rows.push(Row { name: "their difference: nothing that shows".into(), cells: Vec::new() });
        }
        Ok(self.rows(rows))
    }

    /// Shadows as rays cast them, filtered, and with light that scatters into them.
    fn shadows(&self) -> Result<Picture, Error> {
        let skin = self.skin()?;
        let width = if skin.penumbra > 0.0 { skin.penumbra } else { 8.0 };
        let ramp: Vec<Vec3> = (0..64).map(|i| Vec3::splat((i as f32 + 0.5) / 64.0)).collect();
        let ramp = SkinTable { width: 64, height: 1, texels: ramp };
        let plain = |skin: &mut RenderSkin| {
            skin.penumbra = width;
            skin.tables = Arc::new(kinran_render::reference::SkinTables {
                penumbra: ramp.clone(),
                ..(*skin.tables).clone()
            });
        };
        let light = self.given_or(vec3(-0.6, 0.9, 0.45));
        Ok(self.row(vec![
            ("hard shadows".into(), self.lit("hard", &light, |skin| skin.penumbra = 0.0)?),
            (format!("filtered over {width} mm"), self.lit("filtered", &light, plain)?),
            ("light scatters in them".into(), self.lit("scattered", &light, |skin| skin.penumbra = width)?),
        ]))
    }

    /// Normals of the map, by channel, and of the mesh.
    fn normals(&self) -> Result<Picture, Error> {
        self.skin()?;
        let light = self.side();
        let shot = |name: &str, blur: Vec3| self.lit(name, &light, |skin| skin.normal_blur = blur);
        Ok(self.row(vec![
            ("normals of the map".into(), shot("map", Vec3::ZERO)?),
            ("blurred by channel".into(), shot("profile", SKIN_NORMAL_BLUR)?),
            ("normals of the mesh".into(), shot("mesh", Vec3::ONE)?),
        ]))
    }

    /// One row of pictures under their labels.
    fn row(&self, cells: Vec<(String, Picture)>) -> Picture {
        self.rows(vec![Row { name: String::new(), cells }])
    }

    /// Pictures under their labels, row by row, cut to what is shown of them.
    fn rows(&self, mut rows: Vec<Row>) -> Picture {
        let [x, y, w, h] = self.args.crop.unwrap_or([0.0, 0.0, 1.0, 1.0]);
        let of = |share: f32, side: u32| (share * side as f32).round() as u32;
        let (full_width, full_height) = self.view.size;
        let (left, top) = (of(x, full_width), of(y, full_height));
        let (width, height) = (of(w, full_width).max(1), of(h, full_height).max(1));
        for (_, picture) in rows.iter_mut().flat_map(|row| &mut row.cells) {
            *picture = picture.part(left, top, width, height);
        }
        grid(&rows)
    }

    /// Skin of the first material that is some.
    fn skin(&self) -> Result<&RenderSkin, Error> {
        let skin = self.prepared.materials.iter().find_map(|m| m.skin.as_ref());
        skin.ok_or_else(|| {
            Error::file_error(&self.args.file, "no material is skin; give its meshes a material")
        })
    }

    /// A light that stands so far round the camera's view, degrees to the right, a little above it.
    fn around(&self, degrees: f32) -> Vec<Light> {
        let a = degrees.to_radians();
        self.towards(vec3(a.sin(), 0.25, a.cos()))
    }

    /// The flags' lights, else one from the side.
    fn side(&self) -> Vec<Light> {
        if self.args.view.light.is_empty() { self.around(-80.0) } else { self.view.lights.clone() }
    }

    /// The flags' lights, else one in the camera's frame: right, up, back.
    fn given_or(&self, direction: Vec3) -> Vec<Light> {
        if self.args.view.light.is_empty() { self.towards(direction) } else { self.view.lights.clone() }
    }

    /// A light in the camera's frame: right, up, back.
    fn towards(&self, direction: Vec3) -> Vec<Light> {
        let to_light = self.view.camera.transform.transform_vector3(direction).normalize();
        vec![Light {
            kind: LightKind::Directional,
            color: Vec3::splat(BRIGHTNESS * std::f32::consts::PI),
            position: Vec3::ZERO,
            direction: -to_light,
            range: f32::INFINITY,
        }]
    }

    /// A picture with skin changed.
    fn lit(&self, name: &str, lights: &[Light], change: impl Fn(&mut RenderSkin)) -> Result<Picture, Error> {
        let mut scene = self.prepared.clone();
        scene.materials.iter_mut().filter_map(|m| m.skin.as_mut()).for_each(change);
        self.draw(name, &scene, lights)
    }

    /// A picture in the light of `lights`, and of the environment where there is one.
    fn draw(&self, name: &str, scene: &RenderScene, lights: &[Light]) -> Result<Picture, Error> {
        self.draw_in(&self.view, name, scene, lights)
    }

    fn draw_in(
        &self,
        view: &View,
        name: &str,
        scene: &RenderScene,
        lights: &[Light],
    ) -> Result<Picture, Error> {
        let mut scene = scene.clone();
        scene.lights = lights.to_vec();
        let filtering = TextureFiltering::Mips { max_anisotropy: 16 };
        let film = view.render(&scene, name, self.args.spp, filtering, self.progress)?;
        Ok(Picture { width: film.width, height: film.height, pixels: view.display(&film) })
    }

    /// Tensor and mean curvature as display colours, four samples a pixel.
    fn colored(&self, color: impl Fn(Sym2, f32) -> Color) -> Picture {
        let (width, height) = self.view.size;
        let camera = PictureCamera::new(&self.view.camera, width, height);
        let range = self.prepared.geometry.curvature_range();
        let mut picture = Picture::new(width, height, BACKDROP);
        for (i, pixel) in picture.pixels.iter_mut().enumerate() {
            let corner = vec2((i as u32 % width) as f32, (i as u32 / width) as f32);
            let samples = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)].map(|(x, y)| {
                match seen(&self.prepared, &camera, corner + vec2(x, y)) {
                    Some((point, _)) => {
                        let (tensor, mean) = curvature_decode(point.curvature, range);
                        color(tensor, mean)
                    }
                    None => BACKDROP,
                }
            });
            let sum = |c: usize| samples.iter().map(|s| u32::from(s[c])).sum::<u32>();
            *pixel = [0, 1, 2].map(|c| ((sum(c) + 2) / 4) as u8);
        }
        picture
    }

    /// The model in grey, and on it the direction of the larger principal curvature, in the colour of its size. Lines are short
    /// where the smaller one is nearly as large.
    fn tensors(&self) -> Picture {
        let (width, height) = self.view.size;
        let camera = PictureCamera::new(&self.view.camera, width, height);
        let range = self.prepared.geometry.curvature_range();
        let mut picture = Picture::new(width, height, BACKDROP);
        for (i, pixel) in picture.pixels.iter_mut().enumerate() {
            let at = vec2((i as u32 % width) as f32 + 0.5, (i as u32 / width) as f32 + 0.5);
            if let Some((point, view)) = seen(&self.prepared, &camera, at) {
                let facing = point.tangent_frame.z_axis.normalize_or_zero().dot(view).max(0.0);
                *pixel = [(38.0 + 60.0 * facing) as u8; 3];
            }
        }
        let to_camera = self.view.camera.transform.inverse();
        let focal = 0.5 * height as f32 / (0.5 * self.view.camera.yfov).tan();
        let project = |p: Vec3| {
            let p = to_camera.transform_point3(p);
            vec2(0.5 * width as f32 + focal * p.x / -p.z, 0.5 * height as f32 - focal * p.y / -p.z)
        };
        for y in (SPACING / 2..height).step_by(SPACING as usize) {
            // Every other row is shifted, so that lines stand in no columns.
            let shift = if (y / SPACING).is_multiple_of(2) { SPACING / 4 } else { 3 * SPACING / 4 };
            for x in (shift..width).step_by(SPACING as usize) {
                let Some((point, view)) = seen(&self.prepared, &camera, vec2(x as f32, y as f32)) else {
                    continue;
                };
                let (larger, smaller, [along, across]) =
                    principal(curvature_decode(point.curvature, range).0);
                if larger < 0.005 * range {
                    continue;
                }
                let frame = point.tangent_frame;
                let direction =
                    along * frame.x_axis.normalize_or_zero() + across * frame.y_axis.normalize_or_zero();
                let apart = larger - smaller.max(0.0);
                // A code's root of curvature has steps of 1/255: within two of them directions are chance.
                let is_round = apart < 4.0 / 255.0 * (larger * range).sqrt();
                let share = if is_round { 0.0 } else { (apart / larger).clamp(0.0, 1.0) };
                // As long as the spacing where it lies across the view, foreshortened elsewhere.
                let distance = point.position.distance(self.view.camera.transform.translation.into());
                let length = if is_round { 0.0 } else { 0.2 + 0.8 * share };
                let half = 0.55 * SPACING as f32 * distance / focal * length;
                let off = 0.02 * distance / focal * SPACING as f32 * view;
                let [a, b] = [-half, half].map(|t| project(point.position + off + t * direction));
                picture.line(a, b, false_color(0.25 + 0.75 * (larger / range).min(1.0).sqrt()));
            }
        }
        picture
    }
}

/// Differences of pictures in false colour, the largest of each pixel's channels, all enlarged so many times: by the power of
/// two at which the largest ones but a few are not yet white. `None`, and no pictures, where they are but noise and rounding.
fn enlarged_differences(a: &[Picture], b: &[Picture]) -> (Vec<Picture>, Option<u32>) {
    let largest = |a: &Color, b: &Color| (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0);
    let apart = |a: &Picture, b: &Picture| -> Vec<u8> {
        a.pixels.iter().zip(&b.pixels).map(|(a, b)| largest(a, b)).collect()
    };
    let apart: Vec<Vec<u8>> = a.iter().zip(b).map(|(a, b)| apart(a, b)).collect();
    // Most of a sheet is backdrop or flat.
    let mut seen: Vec<u8> = apart.iter().flatten().copied().filter(|&c| c > 0).collect();
    seen.sort_unstable();
    let most = u32::from(seen.get(seen.len() * 99 / 100).copied().unwrap_or(255));
    let gain = [1, 2, 4, 8, 16, 32].into_iter().rev().find(|gain| gain * most <= 255).unwrap_or(1);
    let all: usize = apart.iter().map(Vec::len).sum();
    let shows = seen.iter().filter(|&&c| u32::from(c) >= SEEN).count() as f32 >= SEEN_SHARE * all as f32;
    if !shows {
        return (Vec::new(), None);
    }
    let color = |c: u8| false_color((u32::from(c) * gain) as f32 / 255.0);
    let pictures = a.iter().zip(apart).map(|(a, apart)| Picture {
        width: a.width,
        height: a.height,
        pixels: apart.into_iter().map(color).collect(),
    });
    (pictures.collect(), Some(gain))
}

/// Steps of 8 bits from which a difference shows beside another picture; chosen by eye.
const SEEN: u32 = 2;

/// Share of all pixels that must differ so, or it is noise along edges; chosen by eye.
const SEEN_SHARE: f32 = 0.003;

/// Behind curvature; chosen by eye.
const BACKDROP: Color = [58, 60, 66];

/// From 0 to 1 over black, red, yellow and white, as the window's.
fn false_color(x: f32) -> Color {
    [0.0, 1.0, 2.0].map(|from| ((3.0 * x - from).clamp(0.0, 1.0) * 255.0).round() as u8)
}
