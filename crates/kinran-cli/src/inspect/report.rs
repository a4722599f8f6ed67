//! What is inside a JSON file that Kinran wrote.

use std::path::Path;

use kinran::report::WrittenFile;
use kinran_bake::cache::relative;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use crate::outputs::{bytes_text, written_file};
use crate::table::list;
use crate::values::counted;
use crate::view::file_name;
use crate::{Console, Error};

/// Which command writes a JSON file, what it is, and members by which it is told from all others.
const KINDS: [(&str, &str, &[&str]); 7] = [
    ("kinran bake", "report of a bake", &["surfaces", "filter", "kernel"]),
    ("kinran skin-lut", "report of skin tables", &["tables", "profile", "range"]),
    ("kinran detail solve", "report of a detail map", &["target", "target_size", "levels"]),
    ("kinran detail report", "report of a library of detail maps", &["means", "rows"]),
    ("kinran compare", "comparison with ground truth", &["methods", "truth_samples_per_pixel"]),
    ("kinran bake --curvature-dump", "curvature of a mesh", &["unit", "mesh", "primitives", "vertices"]),
    ("kinran fit fuzz --json", "coefficients of fuzz", &["tilt", "spread", "p_s", "ambient"]),
];

#[derive(Serialize, JsonSchema)]
pub(crate) struct Report {
    file: String,
    kind: &'static str,
    written_by: &'static str,
    /// Numbers and texts of the file's own, and how many entries its lists have.
    members: Vec<Member>,
    /// The files that it names.
    written: Vec<Checked>,
    /// Those of earlier runs that it keeps in mind.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    kept: Vec<Checked>,
    warnings: Vec<String>,
}

#[derive(Serialize, JsonSchema)]
struct Member {
    name: String,
    value: String,
}

/// A file that a report names, as it is now.
#[derive(Serialize, JsonSchema)]
struct Checked {
    file: String,
    bytes: usize,
    state: State,
}

#[derive(Clone, Copy, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum State {
    AsWritten,
    Changed,
    Missing,
}

impl State {
    fn name(self) -> &'static str {
        match self {
            State::AsWritten => "as written",
            State::Changed => "changed since",
            State::Missing => "missing",
        }
    }
}

pub(super) fn inspect(path: &Path, console: &Console) -> Result<(), Error> {
    let bytes = std::fs::read(path).map_err(|e| kinran_image::Error::io(path, e))?;
    let json: Value = serde_json::from_slice(&bytes)
        .map_err(|e| Error::file_error(path, format!("is no JSON: {e}; make it again")))?;
    let has = |members: &[&str]| members.iter().all(|member| json.get(member).is_some());
    let Some(&(written_by, kind, _)) = KINDS.iter().find(|(.., members)| has(members)) else {
        let reason = "is no JSON that kinran writes; give a report such as NAME.kinran.json";
        return Err(Error::file_error(path, reason));
    };
    let files = |member: &str| -> Vec<WrittenFile> {
        json.get(member).and_then(|list| serde_json::from_value(list.clone()).ok()).unwrap_or_default()
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    let texts = json.get("warnings").and_then(Value::as_array).into_iter().flatten();
    let report = Report {
        file: file_name(path),
        kind,
        written_by,
        members: members(&json),
        written: files("written").into_iter().map(|file| check(folder, file)).collect(),
        kept: files("kept").into_iter().map(|file| check(folder, file)).collect(),
        warnings: texts.filter_map(|text| Some(text.as_str()?.to_owned())).collect(),
    };
    let text = text(&report);
    console.result(&super::Report::Written(report), &text)
}

fn check(folder: &Path, file: WrittenFile) -> Checked {
    // A name that leads elsewhere is none of a file that was written beside the report.
    let inside = relative(&file.file).is_some();
    let state = match written_file(folder, file.file.as_str()) {
        Ok(now) if inside && now == file => State::AsWritten,
        Ok(_) if inside => State::Changed,
        _ => State::Missing,
    };
    Checked { file: file.file, bytes: file.bytes, state }
}

fn members(json: &Value) -> Vec<Member> {
    let members = json.as_object().into_iter().flatten();
    let shown = members.filter(|(name, _)| !["written", "kept", "warnings"].contains(&name.as_str()));
    let value = |value: &Value| match value {
        Value::String(text) => Some(text.clone()),
        Value::Number(_) | Value::Bool(_) => Some(value.to_string()),
        Value::Array(list) if list.iter().all(Value::is_number) && list.len() <= 4 => {
            Some(list.iter().map(Value::to_string).collect::<Vec<_>>().join(" x "))
        }
        Value::Array(list) => Some(counted(list.len(), "entry", "entries")),
        Value::Object(_) | Value::Null => None,
    };
    shown.filter_map(|(name, v)| Some(Member { name: name.clone(), value: value(v)? })).collect()
}

fn text(report: &Report) -> String {
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let mut facts = vec![
        row("file", report.file.clone()),
        row("kind", format!("{}, by `{}`", report.kind, report.written_by)),
    ];
    facts.extend(report.members.iter().map(|m| row(&m.name.replace('_', " "), m.value.clone())));
    facts.extend(report.warnings.iter().map(|warning| row("warning", warning.clone())));
    let mut text = list(&facts);
    if !report.written.is_empty() {
        let row = |f: &Checked, of: &str| {
            vec![f.file.clone(), bytes_text(f.bytes as u64), format!("{}{of}", f.state.name())]
        };
        let written = report.written.iter().map(|f| row(f, ""));
        let kept = report.kept.iter().map(|f| row(f, ", by an earlier run with other flags"));
        text += &format!("\n{}", list(&written.chain(kept).collect::<Vec<_>>()));
    }
    text
}
