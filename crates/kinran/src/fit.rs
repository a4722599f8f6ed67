//! Coefficients of fuzz, fitted to exact integrals for one tilt and one spread of fibres.
//!
//! ```
//! use kinran::fit::{FuzzOptions, fuzz};
//!
//! let mut how = FuzzOptions::default();
//! (how.tilt, how.spread) = (30.0, 0.2);
//! let fitted = fuzz(&how)?;
//! assert!(fitted.report.fit.p_s.max_error < 0.05 && fitted.report.warning.is_none());
//! # Ok::<(), kinran::Error>(())
//! ```

use kinran_bake::fuzz_fit::{AmbientTable, TABLE_SIZE, ambient_table, fuzz_fit};
use kinran_image::{Channels, Image, Pixels};
use schemars::JsonSchema;
use serde::Serialize;

use crate::Error;

pub use kinran_bake::fuzz_fit::{Fitted, FuzzFit, Phase};

/// Fibres.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FuzzOptions {
    /// Degrees between fibres and normal: 0 upright, the default, to 90 lying.
    pub tilt: f32,
    /// How far fibres spread about their direction: 0 combed to 1 in all directions, the default.
    pub spread: f32,
    /// How they scatter; as SGGX fibres by default.
    pub phase: Phase,
    /// Whether the ambient factor is tabulated too: for spreads below 0.09, where the polynomial is off by more than 15 %.
    pub table: bool,
}

impl Default for FuzzOptions {
    fn default() -> Self {
        FuzzOptions { tilt: 0.0, spread: 1.0, phase: Phase::Fibre, table: false }
    }
}

/// What was fitted.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[non_exhaustive]
pub struct FuzzReport {
    /// The coefficients.
    #[serde(flatten)]
    pub fit: FuzzFit,
    /// The table's smallest and largest value over the exact one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<[f32; 2]>,
    /// [`FuzzFit::returned`].
    pub returned: f64,
    /// What is doubtful about them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warning: Option<String>,
}

/// Coefficients, and the table where one was asked for.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FittedFuzz {
    /// The coefficients.
    pub report: FuzzReport,
    /// The ambient factor, 48 × 48 floats in red (thin) and green (dense), for `fuzz_ambient_tabulated`.
    pub table: Option<Image>,
}

/// The error of ambient light above which the polynomial is warned of, as [`FuzzOptions::table`] has it.
const AMBIENT_OFF: f32 = 0.15;

/// Fits the coefficients of fuzz.
///
/// # Errors
/// [`Error::Option`] for a tilt or a spread out of its range.
pub fn fuzz(how: &FuzzOptions) -> Result<FittedFuzz, Error> {
    for (option, value, most) in [("tilt", how.tilt, 90.0), ("spread", how.spread, 1.0)] {
        if !(0.0..=most).contains(&value) {
            let reason = format!("give 0 to {most}");
            return Err(Error::Option { option, given: value.to_string(), file: None, reason });
        }
    }
    let (tilt, spread) = (f64::from(how.tilt).to_radians(), f64::from(how.spread));
    // As it was said, not as radians make it.
    let fit = FuzzFit { tilt: how.tilt, ..fuzz_fit(how.phase, tilt, spread) };
    let tabulated = how.table.then(|| ambient_table(how.phase, tilt, spread));
    let returned = fit.returned();
    let mut warnings = Vec::new();
    if returned > 1.0 {
        let instead = match how.phase {
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
    let table = tabulated.as_ref().map(image).transpose()?;
    let report = FuzzReport { fit, table: tabulated.map(|table| table.ratio), returned, warning };
    Ok(FittedFuzz { report, table })
}

fn image(table: &AmbientTable) -> Result<Image, Error> {
    let texels = table.texels.iter().flat_map(|&[thin, dense]| [thin, dense, 0.0]).collect();
    Image::new(TABLE_SIZE as u32, TABLE_SIZE as u32, Channels::Rgb, Pixels::F32(texels))
        .map_err(|e| Error::Internal(e.to_string()))
}
