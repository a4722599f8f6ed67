//! What people type as flags.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use glam::Vec3;
use kinran::content::Content;
use kinran::options::Container;
use kinran_bake::aniso::Filter;
use kinran_image::{Format, MAX_SIDE, Preset};

/// `WIDTHxHEIGHT` in pixels, or one number for a square.
pub(crate) fn size(text: &str) -> Result<(u32, u32), String> {
    let (width, height) = text.split_once(['x', 'X', '×']).unwrap_or((text, text));
    match (width.trim().parse(), height.trim().parse()) {
        (Ok(w), Ok(h)) if (1..=MAX_SIDE).contains(&w) && (1..=MAX_SIDE).contains(&h) => Ok((w, h)),
        _ => Err(format!("write WIDTHxHEIGHT, such as 1280x720, each 1 to {MAX_SIDE}")),
    }
}

/// `X,Y,Z`, finite.
pub(crate) fn vector(text: &str) -> Result<Vec3, String> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(|n| n.trim().parse::<f32>()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if Vec3::new(x, y, z).is_finite() => Ok(Vec3::new(x, y, z)),
        _ => Err("write three numbers, such as 0.5,0.3,1".into()),
    }
}

/// `X,Y,Z`, of some length.
pub(crate) fn direction(text: &str) -> Result<Vec3, String> {
    let v = vector(text)?;
    v.try_normalize().ok_or_else(|| "a direction must not be zero".into())
}

/// A finite number within `range`, described by `what`.
pub(crate) fn number(text: &str, range: std::ops::RangeInclusive<f32>) -> Result<f32, String> {
    match text.trim().parse::<f32>() {
        Ok(x) if range.contains(&x) => Ok(x),
        _ => Err(format!("write a number from {} to {}", range.start(), range.end())),
    }
}

/// `FILE=LAYER`.
pub(crate) fn exr_layer(text: &str) -> Result<(PathBuf, String), String> {
    match text.rsplit_once('=') {
        Some((file, layer)) if !file.is_empty() && !layer.is_empty() => Ok((file.into(), layer.into())),
        _ => Err("write FILE=LAYER, such as render.exr=View.Normal".into()),
    }
}

/// "1 file", "2 files".
pub(crate) fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// A message of `clap` with Rust's ranges in words: "0 is not in 1..=16" is "0 is not from 1 to 16".
pub(crate) fn range_in_words(message: &str) -> String {
    match message.split_once(" is not in ") {
        Some((head, range)) => format!("{head} is not from {}", range.replacen("..=", " to ", 1)),
        None => message.to_owned(),
    }
}

/// What can be chosen: each value with the word for it and what help says of it.
pub(crate) type Choices<T> = [(T, &'static str, &'static str)];

/// Takes one of a few values by the word for it, and tells help and completions which there are.
pub(crate) fn choice<T: Copy + Send + Sync + 'static>(
    all: &'static Choices<T>,
) -> impl TypedValueParser<Value = T> {
    let words = all.iter().map(|(_, word, about)| match about.is_empty() {
        true => PossibleValue::new(word),
        false => PossibleValue::new(word).help(about),
    });
    let named = |name: &str| all.iter().find(|(_, word, _)| *word == name).map(|(value, ..)| *value);
    PossibleValuesParser::new(words).map(move |name| named(&name).expect("only known words pass"))
}

/// Texel formats.
pub(crate) const FORMATS: &Choices<Format> = &[
    (Format::Bc1, "bc1", ""),
    (Format::Bc4, "bc4", ""),
    (Format::Bc5, "bc5", ""),
    (Format::Bc7, "bc7", ""),
    (Format::Uastc, "uastc", ""),
    (Format::Rgba8, "rgba8", ""),
    (Format::Rgba16F, "rgba16f", ""),
];

/// File formats of textures.
pub(crate) const CONTAINERS: &Choices<Container> = &[
    (Container::Ktx2, "ktx2", "KTX2"),
    (Container::Dds, "dds", "DDS with a DX10 header"),
    (Container::Both, "both", "Both"),
];

/// Whether something is done.
pub(crate) const SWITCH: &Choices<bool> = &[(true, "on", ""), (false, "off", "")];

/// Time spent on a block.
pub(crate) const PRESETS: &Choices<Preset> = &[
    (Preset::Fast, "fast", "For previews"),
    (Preset::Normal, "normal", "For every day"),
    (Preset::Best, "best", "For release builds"),
];

/// What a texture holds.
pub(crate) fn content() -> impl TypedValueParser<Value = Content> {
    PossibleValuesParser::new(Content::ALL.map(Content::name))
        .map(|name| Content::named(&name).expect("only names of contents pass"))
}

/// Takes a filter by its name, and tells help and completions which there are.
pub(crate) fn filter() -> impl TypedValueParser<Value = Filter> {
    let named = |name: String| Filter::ALL.into_iter().find(|f| f.name() == name);
    PossibleValuesParser::new(Filter::ALL.map(Filter::name))
        .map(move |name| named(name).expect("only names of filters pass"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_that_no_picture_has_are_refused() {
        assert_eq!(size("1280x720"), Ok((1280, 720)));
        assert_eq!(size("64"), Ok((64, 64)));
        for bad in ["", "0x4", "4x0", "x", "4x", "-1x4", "40000x4", "1e3", "4x4x4", "99999999999999999999"] {
            assert!(size(bad).is_err(), "{bad:?} became {:?}", size(bad));
        }
    }

    #[test]
    fn people_are_told_ranges_as_programs_write_them() {
        assert_eq!(range_in_words("'--spp <N>': 0 is not in 1..=16"), "'--spp <N>': 0 is not from 1 to 16");
        assert_eq!(range_in_words("a folder..=is not"), "a folder..=is not");
    }

    #[test]
    fn vectors_that_point_nowhere_are_refused() {
        assert_eq!(vector("1, -2,0.5"), Ok(Vec3::new(1.0, -2.0, 0.5)));
        for bad in ["", "1,2", "1,2,3,4", "a,b,c", "nan,0,0", "inf,0,0"] {
            assert!(vector(bad).is_err(), "{bad:?} became {:?}", vector(bad));
        }
        assert!(direction("0,0,0").is_err());
        assert_eq!(direction("0,0,-7"), Ok(Vec3::NEG_Z));
    }
}
