//! What is inside an image.

use std::path::Path;

use glam::{Vec3, Vec4};
use kinran_image::{Channels, Files, Image, Pixels, decode_layer};
use schemars::JsonSchema;
use serde::Serialize;

use super::statistics::Range;
use super::{file_name, read};
use crate::Error;

/// A normal's length may be off by this much: three steps of 8 bits.
pub const LENGTH_TOLERANCE: f32 = 3.0 * 2.0 / 255.0;

/// What is in an image.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ImageReport {
    /// The file's name.
    pub file: String,
    /// `image`.
    pub kind: &'static str,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bits of a sample.
    pub bits: u32,
    /// Whether samples are floats.
    pub float: bool,
    /// How red, green and blue are encoded if they are colour: `linear`, `srgb`, or `unsaid`, which is sRGB for colour.
    pub transfer: String,
    /// What was chosen or left out when it was read.
    pub notes: Vec<String>,
    /// Its channels.
    pub channels: Vec<ChannelReport>,
    /// Of images that look like a normal map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal_map: Option<NormalReport>,
}

/// A channel of an image.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ChannelReport {
    /// `grey`, `red`, `green`, `blue` or `alpha`.
    pub name: &'static str,
    /// Its samples, integers from 0 to 1.
    #[serde(flatten)]
    pub range: Range,
}

/// What looks like a normal map.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct NormalReport {
    /// Share of texels whose length is not 1.
    pub not_unit_share: f32,
    /// Share of texels that point below the surface.
    pub below_share: f32,
}

pub(super) fn inspect(files: &dyn Files, path: &Path, layer: Option<&str>) -> Result<ImageReport, Error> {
    let image = decode_layer(path, &read(files, path)?, layer)?;
    let (bits, float) = match image.pixels {
        Pixels::U8(_) => (8, false),
        Pixels::U16(_) => (16, false),
        Pixels::F32(_) => (32, true),
    };
    let names: &[(usize, &str)] = match image.channels {
        Channels::R => &[(0, "grey")],
        Channels::Rg => &[(0, "grey"), (3, "alpha")],
        Channels::Rgb => &[(0, "red"), (1, "green"), (2, "blue")],
        Channels::Rgba => &[(0, "red"), (1, "green"), (2, "blue"), (3, "alpha")],
    };
    let channel = |&(i, name): &(usize, &'static str)| {
        let range = Range::of(texels(&image).map(|t| t[i]))?;
        Some(ChannelReport { name, range })
    };
    Ok(ImageReport {
        file: file_name(path),
        kind: "image",
        width: image.width,
        height: image.height,
        bits,
        float,
        transfer: format!("{:?}", image.transfer).to_lowercase(),
        notes: image.notes.clone(),
        channels: names.iter().filter_map(channel).collect(),
        normal_map: normal_report(&image),
    })
}

fn texels(image: &Image) -> impl Iterator<Item = Vec4> {
    (0..image.height).flat_map(|y| {
        let mut row = Vec::new();
        image.row_rgba_f32(y, &mut row);
        row.into_iter().map(Vec4::from)
    })
}

/// An image looks like a normal map when it has colour and at least half of its texels are unit vectors
/// within a tenth that point upwards.
fn normal_report(image: &Image) -> Option<NormalReport> {
    if image.channels.count() < 3 {
        return None;
    }
    let signed = matches!(&image.pixels, Pixels::F32(samples) if samples.iter().any(|v| *v < 0.0));
    let normals = || texels(image).map(|t| if signed { t.truncate() } else { t.truncate() * 2.0 - 1.0 });
    let count = f64::from(image.width) * f64::from(image.height);
    let share =
        |holds: &dyn Fn(Vec3) -> bool| (normals().filter(|n| holds(*n)).count() as f64 / count) as f32;
    let alike = share(&|n| n.z > 0.0 && (n.length() - 1.0).abs() < 0.1);
    (alike >= 0.5).then(|| NormalReport {
        not_unit_share: share(&|n| (n.length() - 1.0).abs() > LENGTH_TOLERANCE),
        below_share: share(&|n| n.z < -LENGTH_TOLERANCE),
    })
}
