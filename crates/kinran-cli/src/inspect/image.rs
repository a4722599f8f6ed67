//! What is inside an image.

use std::path::Path;

use glam::{Vec3, Vec4};
use kinran_image::{Channels, Image, Pixels, read_layer};
use schemars::JsonSchema;
use serde::Serialize;

use super::statistics::Range;
use crate::table::{list, table};
use crate::values::counted;
use crate::view::file_name;
use crate::{Console, Error};

/// A normal's length may be off by this much: three steps of 8 bits.
const LENGTH_TOLERANCE: f32 = 3.0 * 2.0 / 255.0;

#[derive(Serialize, JsonSchema)]
pub(crate) struct Report {
    file: String,
    kind: &'static str,
    width: u32,
    height: u32,
    bits: u32,
    float: bool,
    /// How red, green and blue are encoded if they are colour: `linear`, `srgb`, or `unsaid`, which is sRGB for colour.
    transfer: String,
    /// What was chosen or left out when it was read.
    notes: Vec<String>,
    channels: Vec<ChannelReport>,
    /// Of images that look like a normal map.
    #[serde(skip_serializing_if = "Option::is_none")]
    normal_map: Option<NormalReport>,
}

#[derive(Serialize, JsonSchema)]
struct ChannelReport {
    name: &'static str,
    #[serde(flatten)]
    range: Range,
}

#[derive(Serialize, JsonSchema)]
struct NormalReport {
    /// Share of texels whose length is not 1.
    not_unit_share: f32,
    /// Share of texels that point below the surface.
    below_share: f32,
}

pub(super) fn inspect(path: &Path, layer: Option<&str>, console: &Console) -> Result<(), Error> {
    let image = read_layer(path, layer)?;
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
    let report = Report {
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
    };
    let text = text(&report);
    console.result(&super::Report::Image(report), &text)
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

fn text(report: &Report) -> String {
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let kind = if report.float { "floats" } else { "integers" };
    let mut facts = vec![
        row("file", report.file.clone()),
        row("size", format!("{}x{}", report.width, report.height)),
        row(
            "samples",
            format!(
                "{} of {}-bit {kind}",
                counted(report.channels.len(), "channel", "channels"),
                report.bits
            ),
        ),
    ];
    let color = match report.transfer.as_str() {
        "unsaid" => "sRGB, if it is colour",
        "srgb" => "sRGB, as the file says",
        _ => "linear",
    };
    facts.push(row("colour", color.into()));
    facts.extend(report.notes.iter().map(|note| row("note", note.clone())));
    if let Some(normals) = &report.normal_map {
        let percent = |share: f32| format!("{:.2} %", share * 100.0);
        facts.push(row(
            "normals",
            format!(
                "{} of texels are more than {LENGTH_TOLERANCE} off unit length, {} point below the surface",
                percent(normals.not_unit_share),
                percent(normals.below_share)
            ),
        ));
    }
    let mut rows = vec![["channel", "min", "mean", "max"].map(str::to_owned).to_vec()];
    rows.extend(report.channels.iter().map(|channel| {
        let [min, mean, max] = channel.range.cells();
        vec![channel.name.to_owned(), min, mean, max]
    }));
    format!("{}\n{}", list(&facts), table(&rows))
}
