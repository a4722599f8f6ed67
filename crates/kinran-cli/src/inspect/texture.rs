//! What is inside a KTX2 or DDS file.

use std::collections::BTreeMap;
use std::path::Path;

use kinran_image::{Texture, read_texture};
use schemars::JsonSchema;
use serde::Serialize;

use super::statistics::Statistics;
use crate::outputs::bytes_text;
use crate::table::{list, table};
use crate::values::counted;
use crate::view::file_name;
use crate::{Console, Error};
use kinran::content::Content;

#[derive(Serialize, JsonSchema)]
pub(crate) struct Report {
    file: String,
    kind: &'static str,
    format: String,
    transfer: String,
    width: u32,
    height: u32,
    file_bytes: u64,
    texture_bytes: u64,
    role: Content,
    metadata: BTreeMap<String, String>,
    levels: Vec<LevelReport>,
}

#[derive(Serialize, JsonSchema)]
struct LevelReport {
    width: u32,
    height: u32,
    bytes: u64,
    #[serde(flatten)]
    statistics: Statistics,
}

pub(super) fn inspect(path: &Path, role: Option<Content>, console: &Console) -> Result<(), Error> {
    let texture = read_texture(path)?;
    let file_bytes = std::fs::metadata(path).map_err(|e| kinran_image::Error::io(path, e))?.len();
    let role = match role {
        Some(role) => role,
        None => stored_role(path, &texture)?,
    };
    let texels = texels(role, &texture);
    let levels = texture.levels.iter().enumerate().map(|(i, level)| -> Result<LevelReport, Error> {
        let statistics = Statistics::new(texels, &texture.decode_level(i)?)
            .ok_or_else(|| Error::Internal(format!("{}: level {i} has no texels", path.display())))?;
        let bytes = level.data.len() as u64;
        Ok(LevelReport { width: level.width, height: level.height, bytes, statistics })
    });
    let levels: Vec<LevelReport> = levels.collect::<Result<_, _>>()?;
    let report = Report {
        file: file_name(path),
        kind: "texture",
        format: format!("{:?}", texture.format).to_uppercase(),
        transfer: format!("{:?}", texture.transfer).to_lowercase(),
        width: texture.levels[0].width,
        height: texture.levels[0].height,
        file_bytes,
        texture_bytes: levels.iter().map(|level| level.bytes).sum(),
        role,
        metadata: texture.metadata,
        levels,
    };
    let text = text(&report);
    console.result(&super::Report::Texture(report), &text)
}

/// What the texture's own key says it holds, else what its format suggests.
fn stored_role(path: &Path, texture: &Texture) -> Result<Content, Error> {
    let Some(name) = texture.metadata.get(Content::KEY) else { return Ok(Content::suggested(texture)) };
    Content::named(name).ok_or_else(|| {
        let key = Content::KEY;
        let reason = format!("key {key}: \"{name}\" is no map that is known; say --role what it is");
        kinran_image::Error::malformed(path, reason).into()
    })
}

/// As what texels are read: tiles and what lies over them hold what their format suggests.
fn texels(role: Content, texture: &Texture) -> Content {
    match role {
        Content::Synthesized | Content::Detail => Content::suggested(texture),
        other => other,
    }
}

fn text(report: &Report) -> String {
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let mut facts = vec![
        row("file", format!("{}, {}", report.file, bytes_text(report.file_bytes))),
        row(
            "format",
            match report.transfer.as_str() {
                "unsaid" => format!("{}; whether it is sRGB is not said", report.format),
                said => format!("{}, {said}", report.format),
            },
        ),
        row(
            "size",
            format!(
                "{}x{}, {}, {}",
                report.width,
                report.height,
                counted(report.levels.len(), "level", "levels"),
                bytes_text(report.texture_bytes)
            ),
        ),
        row("map", report.role.name().into()),
    ];
    facts.extend(report.metadata.iter().map(|(key, value)| row(key, value.clone())));

    let headings =
        ["level", "size", "bytes"].into_iter().chain(report.levels[0].statistics.headings().iter().copied());
    let mut rows = vec![headings.map(str::to_owned).collect()];
    rows.extend(report.levels.iter().enumerate().map(|(i, level)| {
        let mut cells =
            vec![i.to_string(), format!("{}x{}", level.width, level.height), bytes_text(level.bytes)];
        cells.extend(level.statistics.cells());
        cells
    }));
    format!("{}\n{}{}", list(&facts), table(&rows), report.levels[0].statistics.legend())
}
