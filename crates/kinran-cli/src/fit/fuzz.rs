//! `kinran fit fuzz`.

use std::fmt::Write;
use std::path::PathBuf;

use clap::ValueEnum;
use kinran_bake::fuzz_fit::{AmbientTable, Fitted, FuzzFit, Phase, TABLE_SIZE, ambient_table, fuzz_fit};
use kinran_image::{Channels, Image, Pixels, write_atomically, write_exr};
use schemars::JsonSchema;
use serde::Serialize;

use super::fuzz_plots::phase_plots;
use crate::table::table;
use crate::{Console, Error, outputs, values};

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
    #[arg(long, value_enum, default_value = "fibre")]
    pub phase: PhaseName,

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

/// Names of phase functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PhaseName {
    /// SGGX fibres
    Fibre,
    /// Schlick's phase about the fibre
    Velvet,
}

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

/// What was fitted.
#[derive(Debug, Serialize, JsonSchema)]
pub struct FuzzReport {
    /// The coefficients.
    #[serde(flatten)]
    fit: FuzzFit,
    /// The table's smallest and largest value over the exact one.
    #[serde(skip_serializing_if = "Option::is_none")]
    table: Option<[f32; 2]>,
    /// [`FuzzFit::returned`].
    returned: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    warning: Option<String>,
}

/// The error of ambient light above which the polynomial is warned of, as the help of `--table` has it.
const AMBIENT_OFF: f32 = 0.15;

/// The command.
pub(super) fn run(args: &FuzzArgs, console: &Console) -> Result<(), Error> {
    for (path, extension) in [(&args.table, "exr"), (&args.plots, "svg")] {
        if let Some(path) = path {
            outputs::check_file(path, &[extension])?;
        }
    }
    let phase = match args.phase {
        PhaseName::Fibre => Phase::Fibre,
        PhaseName::Velvet => Phase::Velvet,
    };
    let (tilt, spread) = (f64::from(args.tilt).to_radians(), f64::from(args.spread));
    let busy = console.progress().busy("fitting");
    // As typed, not as radians make it.
    let fit = FuzzFit { tilt: args.tilt, ..fuzz_fit(phase, tilt, spread) };
    let tabulated = match &args.table {
        Some(path) => {
            let tabulated = ambient_table(phase, tilt, spread);
            outputs::make_place(path)?;
            write_exr(path, &table_image(&tabulated)?)?;
            Some(tabulated.ratio)
        }
        None => None,
    };
    if let Some(path) = &args.plots {
        outputs::make_place(path)?;
        write_atomically(path, phase_plots(&fit).as_bytes())?;
    }
    drop(busy);
    let returned = fit.returned();
    let mut warnings = Vec::new();
    if returned > 1.0 {
        let instead = match phase {
            Phase::Fibre => "; take fibre_p_s in their place",
            Phase::Velvet => "",
        };
        warnings.push(format!(
            "the coefficients of p_s make energy: white fibres over white send back up to {returned:.3} of a light{instead}"
        ));
    }
    let [low, high] = fit.ambient.ratio;
    if tabulated.is_none() && (low < 1.0 - AMBIENT_OFF || high > 1.0 + AMBIENT_OFF) {
        warnings.push(format!(
            "the coefficients of ambient are {low:.2} to {high:.2} times what they stand for: fibres as combed as these need --table"
        ));
    }
    let warning = (!warnings.is_empty()).then(|| warnings.join("; "));
    let report = FuzzReport { fit, table: tabulated, returned, warning };
    match args.lang {
        // Constants are what was asked for, not a summary of it.
        Some(language) => Console { quiet: false, ..console.clone() }
            .result(&report, &constants(&fit, report.warning.as_deref(), language)),
        None => {
            let files = [("the table is in", &args.table), ("plots are in", &args.plots)];
            let files = files.into_iter().filter_map(|(what, path)| Some((what, path.as_ref()?)));
            let files: String = files.map(|(what, path)| format!("\n{what} {}", path.display())).collect();
            console.result(&report, &(text(&fit, tabulated, report.warning.as_deref()) + &files))
        }
    }
}

fn table_image(table: &AmbientTable) -> Result<Image, Error> {
    let texels = table.texels.iter().flat_map(|&[thin, dense]| [thin, dense, 0.0]).collect();
    Image::new(TABLE_SIZE as u32, TABLE_SIZE as u32, Channels::Rgb, Pixels::F32(texels))
        .map_err(|e| Error::Internal(e.to_string()))
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

fn text(fit: &FuzzFit, tabulated: Option<[f32; 2]>, warning: Option<&str>) -> String {
    let header = ["", "error", "rms", "low", "high", "coefficients"].map(str::to_owned).to_vec();
    let mut cells = vec![header];
    for (name, coefficients, [max, rms, low, high]) in rows(fit) {
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
    let mut text = format!("{}\n\n{}", title(fit), table(&cells));
    if let Some([low, high]) = tabulated {
        writeln!(text, "\ntable of the ambient factor: {low:.3} to {high:.3} of the exact value")
            .expect("strings grow");
    }
    if let Some(warning) = warning {
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
