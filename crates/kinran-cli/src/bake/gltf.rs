//! `kinran bake` of a glTF file.

use kinran::report::{Report, SurfaceReport};
use kinran::{Disk, bake};
use kinran_bake::aniso::RoughnessMaps;

use super::Args;
use super::report::{BakeReport, text};
use crate::outputs::{Output, file_name};
use crate::progress::Bars;
use crate::{Console, Error};

/// Bakes a glTF file and tells what came of it.
pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let mut report = bake_gltf(args, console)?;
    let measured = !report.curvature.is_empty();
    report.warnings.extend(args.idle_on_model(measured));
    for warning in &report.warnings {
        console.warn(warning);
    }
    let model = args.output().join(file_name(&args.input));
    let text = format!("{}{}\n", text(&report, args.output()), model.display());
    console.result(&BakeReport::new(args, Vec::new(), vec![report]), &text)
}

/// Bakes every material of a glTF file that has a normal, a roughness or an anisotropy map.
fn bake_gltf(args: &Args, console: &Console) -> Result<Report, Error> {
    args.model.allowed()?;
    let (how, bars) = (args.gltf_options(), Bars::new(console.progress()));
    let out = Output::new(args.output(), &args.input, args.force, console);
    Ok(bake::gltf(&Disk, &args.input, &how, &out, bars.task())?)
}

/// Says which materials would be baked from what.
pub(super) fn dry_run(args: &Args, console: &Console) -> Result<(), Error> {
    args.model.allowed()?;
    let (how, bars) = (args.gltf_options(), Bars::new(console.progress()));
    let understood = bake::understand_gltf(&Disk, &args.input, &how, bars.task())?;
    let mut report = Report::new(&how.textures);
    report.warnings.clone_from(&understood.warnings);
    let (scene, mut text) = (&understood.scene, String::new());
    for surface in &understood.surfaces {
        let directed = matches!(surface.maps.maps.roughness, RoughnessMaps::Khr { .. });
        let kind = if directed { "anisotropic" } else { "isotropic" };
        let names: Vec<&str> = surface.materials.iter().map(|&i| scene.materials[i].name.as_str()).collect();
        let (width, height) = surface.maps.maps.size();
        text += &format!("{width}x{height} {kind}: {}\n", names.join(", "));
        let inputs = understood.inputs(surface)?;
        report.surfaces.push(SurfaceReport { inputs, ..SurfaceReport::new(names[0].to_owned()) });
    }
    let measured = scene.primitives.iter().any(|p| how.wants(scene, p));
    report.warnings.extend(args.idle_on_model(measured));
    for warning in &report.warnings {
        console.warn(warning);
    }
    console.result(&BakeReport::new(args, Vec::new(), vec![report]), &text)
}
