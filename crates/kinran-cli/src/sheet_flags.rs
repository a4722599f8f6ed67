//! Flags of commands that draw sheets of pictures. One that none of the sheets drawn obeys is refused by its name, and
//! never swallowed.

use clap::ValueEnum;

use crate::Error;
use crate::skin::SkinCurvatureName;
use crate::view::{Curve, DetailName, ViewArgs};

/// Refuses the first of the flags given that none of the sheets drawn obeys.
///
/// # Errors
/// [`Error::Flag`] with the sheets that do obey it.
pub(crate) fn refuse_idle<S: ValueEnum + Copy>(
    given: &[&str],
    drawn: &[S],
    obeys: impl Fn(&str, S) -> bool,
) -> Result<(), Error> {
    let Some(flag) = given.iter().find(|flag| !drawn.iter().any(|&sheet| obeys(flag, sheet))) else {
        return Ok(());
    };
    let names = |sheets: &[S]| {
        let names = sheets.iter().filter_map(|sheet| Some(sheet.to_possible_value()?.get_name().to_owned()));
        names.collect::<Vec<_>>().join(", ")
    };
    let able: Vec<S> = S::value_variants().iter().copied().filter(|&sheet| obeys(flag, sheet)).collect();
    let reason = match able.is_empty() {
        true => "shows on no sheet in the light of the other flags; leave it out".to_owned(),
        false => {
            format!("shows nothing on {}; leave it out, or draw one of {}", names(drawn), names(&able))
        }
    };
    Err(Error::flag_error(format!("--{flag}"), reason))
}

/// Of the flags of [`ViewArgs`] those given that some sheets have no use for. The others frame the picture, which every
/// sheet has.
pub(crate) fn given(view: &ViewArgs) -> Vec<&'static str> {
    let flags = [
        ("env", view.env.is_some()),
        ("env-rotation", view.env_rotation != 0.0),
        ("exr-layer", view.exr_layer.is_some()),
        ("env-samples", view.env_samples != 1),
        ("light", !view.light.is_empty()),
        ("shadows", view.shadows),
        ("no-shadows", view.no_shadows),
        ("background", view.background.is_some()),
        ("exposure", view.exposure != 0.0),
        ("tonemap", view.tonemap != Curve::Aces),
        ("detail", view.detail != DetailName::default()),
        ("skin-curvature", view.skin.skin_curvature != SkinCurvatureName::default()),
        ("skin-penumbra", view.skin.skin_penumbra.is_some()),
        ("skin-normals", view.skin.skin_normals.is_some()),
    ];
    flags.into_iter().filter(|(_, given)| *given).map(|(name, _)| name).collect()
}
