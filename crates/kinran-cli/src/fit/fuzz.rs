//! `kinran fit fuzz`.

use std::fmt::Write;
use std::path::PathBuf;

use clap::ValueEnum;
use kinran::fit::{Fitted, FittedFuzz, FuzzFit, FuzzOptions, FuzzReport, Phase, fuzz};
use kinran_image::{write_atomically, write_exr};

use super::fuzz_plots::phase_plots;
use crate::table::table as aligned;
use crate::values::{self, Choices, choice};
use crate::{Console, Error, outputs};

/// Fits the coefficients of fuzz for one tilt and one spread
///
/// P_s: the share of scattered light that goes down to the base. Ambient: what a view gathers of light from all
/// around, over G, with the direction it comes from. R and Q: the base's ambient light under the layer. B, and
/// the talk's forms of G and Q, are there to compare with. Each comes with its largest and root mean squared
/// error, and with the smallest and largest value over the exact one.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran fit fuzz --tilt 30 --spread 0.2
  kinran fit fuzz --tilt 30 --spread 0.2 --lang hlsl > fuzz_constants.hlsl
  kinran fit fuzz --tilt 60 --spread 0.02 --table combed.exr
  kinran fit fuzz --tilt 0 --spread 0.2 --plots phase.svg")]
pub struct FuzzArgs {
    /// Degrees between fibres and normal: 0 upright, 90 lying
    #[arg(long, value_name = "DEGREES", value_parser = |t: &str| values::number(t, 0.0..=90.0))]
    pub tilt: f32,

    /// How far fibres spread about their direction: 0 combed, 1 in all directions
    #[arg(long, value_name = "SPREAD", value_parser = |t: &str| values::number(t, 0.0..=1.0))]
    pub spread: f32,

    /// How fibres scatter
    #[arg(long, default_value = "fibre", value_parser = choice(PHASES))]
    pub phase: Phase,

    /// Prints constants for a shader instead of a table
    #[arg(long, value_enum, value_name = "LANGUAGE")]
    pub lang: Option<FuzzLanguage>,

    /// Writes the ambient factor as a table too, an EXR of 48 × 48 texels for `fuzz_ambient_tabulated`: for
    /// spreads below 0.09, where the polynomial is off by more than 15 %
    #[arg(long, value_name = "FILE")]
    pub table: Option<PathBuf>,

    /// Draws the phase functions as polar plots into an SVG: k and alpha, tilt, view and azimuth varied, this
    /// tilt and spread in the middle
    #[arg(long, value_name = "FILE")]
    pub plots: Option<PathBuf>,
}

/// Phase functions.
const PHASES: &Choices<Phase> =
    &[(Phase::Fibre, "fibre", "SGGX fibres"), (Phase::Velvet, "velvet", "Schlick's phase about the fibre")];

/// Languages that constants come in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FuzzLanguage {
    /// WebGPU
    #[value(alias = "wesl")]
    Wgsl,
    /// Direct3D
    Hlsl,
    /// OpenGL, Vulkan and WebGL
    #[value(aliases = ["glsl-450", "glsl-es-300"])]
    Glsl,
    /// Metal
    Msl,
}

/// The command.
pub(super) fn run(args: &FuzzArgs, console: &Console) -> Result<(), Error> {
    for (path, extension) in [(&args.table, "exr"), (&args.plots, "svg")] {
        if let Some(path) = path {
            outputs::check_file(path, &[extension])?;
        }
    }
    let mut how = FuzzOptions::default();
    (how.tilt, how.spread, how.table) = (args.tilt, args.spread, args.table.is_some());
    how.phase = args.phase;
    let busy = console.progress().busy("fitting");
    let FittedFuzz { report, table, .. } = fuzz(&how)?;
    if let (Some(path), Some(table)) = (&args.table, &table) {
        outputs::make_place(path)?;
        write_exr(path, table)?;
    }
    if let Some(path) = &args.plots {
        outputs::make_place(path)?;
        write_atomically(path, phase_plots(&report.fit).as_bytes())?;
    }
    drop(busy);
    match args.lang {
        // Constants are what was asked for, not a summary of it.
        Some(language) => Console { quiet: false, ..console.clone() }
            .result(&report, &constants(&report.fit, report.warning.as_deref(), language)),
        None => {
            let files = [("the table is in", &args.table), ("plots are in", &args.plots)];
            let files = files.into_iter().filter_map(|(what, path)| Some((what, path.as_ref()?)));
            let files: String = files.map(|(what, path)| format!("\n{what} {}", path.display())).collect();
            console.result(&report, &(text(&report) + &files))
        }
    }
}

fn title(fit: &FuzzFit) -> String {
    let name = match fit.phase {
        Phase::Fibre => "SGGX fibres",
        Phase::Velvet => "velvet",
    };
    format!(
        "{name} at {}° from the normal, spread {} (alpha {:.4}, k {:.4})",
        fit.tilt, fit.spread, fit.alpha, fit.k
    )
}

/// Each fit under the name of its shader function.
fn rows(fit: &FuzzFit) -> [(&'static str, Vec<f32>, [f32; 4]); 7] {
    fn row<const N: usize>(name: &'static str, f: &Fitted<N>) -> (&'static str, Vec<f32>, [f32; 4]) {
        (name, f.coefficients.to_vec(), [f.max_error, f.rms_error, f.ratio[0], f.ratio[1]])
    }
    [
        row("p_s", &fit.p_s),
        row("ambient", &fit.ambient),
        row("direction", &fit.direction),
        row("r", &fit.r),
        row("b", &fit.b),
        row("g", &fit.g),
        row("q", &fit.q),
    ]
}

fn text(report: &FuzzReport) -> String {
    let header = ["", "error", "rms", "low", "high", "coefficients"].map(str::to_owned).to_vec();
    let mut cells = vec![header];
    for (name, coefficients, [max, rms, low, high]) in rows(&report.fit) {
        let coefficients: Vec<String> = coefficients.iter().map(|c| format!("{c:8.5}")).collect();
        let ratio = |x: f32| if name == "direction" { "-".to_owned() } else { format!("{x:.3}") };
        cells.push(vec![
            name.to_owned(),
            format!("{max:.4}"),
            format!("{rms:.4}"),
            ratio(low),
            ratio(high),
            coefficients.join(" "),
        ]);
    }
    // Coefficients start in one column, whatever their number.
    let longest = cells.iter().map(|row| row[5].chars().count()).max().unwrap_or(0);
    cells.iter_mut().for_each(|row| row[5] = format!("{:<longest$}", row[5]));
    let mut text = format!("{}\n\n{}", title(&report.fit), aligned(&cells));
    if let Some([low, high]) = report.table {
        writeln!(text, "\ntable of the ambient factor: {low:.3} to {high:.3} of the exact value")
            .expect("strings grow");
    }
    if let Some(warning) = &report.warning {
        writeln!(text, "\nwarning: {warning}").expect("strings grow");
    }
    text += "
error and rms: the largest difference from the exact value, and the root of its mean square
low and high: the smallest and largest value over the exact one
ambient holds for densities of 0.05 to 0.5 and n·v from 0.1 on; g, q and b are the talk's forms, to compare with\n";
    text
}

fn constants(fit: &FuzzFit, warning: Option<&str>, language: FuzzLanguage) -> String {
    let number = |x: &f32| format!("{x:?}");
    let mut text = format!("// {}.\n", title(fit));
    let scalar = |name: &str, value: f32| match language {
        FuzzLanguage::Wgsl => format!("const {name}: f32 = {value:?};\n"),
        FuzzLanguage::Hlsl => format!("static const float {name} = {value:?};\n"),
        FuzzLanguage::Glsl => format!("const float {name} = {value:?};\n"),
        FuzzLanguage::Msl => format!("constant float {name} = {value:?};\n"),
    };
    text += &scalar("FUZZ_ALPHA", fit.alpha);
    text += &scalar("FUZZ_K", fit.k);
    for (name, coefficients, [max, rms, low, high]) in rows(fit) {
        let ratio = if name == "direction" {
            String::new()
        } else {
            format!(", {low:.3} to {high:.3} of the exact value")
        };
        writeln!(text, "// {name}: error {max:.4}, RMS {rms:.4}{ratio}.").expect("strings grow");
        if let Some(warning) = warning.filter(|_| name == "p_s") {
            writeln!(text, "// Warning: {warning}.").expect("strings grow");
        }
        let name = format!("FUZZ_{}", name.to_uppercase());
        if let [value] = coefficients[..] {
            text += &scalar(&name, value);
            continue;
        }
        let (n, list) = (coefficients.len(), coefficients.iter().map(number).collect::<Vec<_>>().join(", "));
        text += &match language {
            FuzzLanguage::Wgsl => format!("const {name} = array<f32, {n}>({list});\n"),
            FuzzLanguage::Hlsl => format!("static const float {name}[{n}] = {{ {list} }};\n"),
            FuzzLanguage::Glsl => format!("const float {name}[{n}] = float[{n}]({list});\n"),
            FuzzLanguage::Msl => format!("constant float {name}[{n}] = {{ {list} }};\n"),
        };
    }
    text
}
