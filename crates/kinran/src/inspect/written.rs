//! What is inside a JSON file that Kinran wrote.

use std::path::Path;

use kinran_bake::cache::relative;
use kinran_image::Files;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Number, Value};

use super::{counted, file_name, read};
use crate::Error;
use crate::error::InputFault;
use crate::report::WrittenFile;

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

/// What a JSON file says that Kinran wrote.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct WrittenReport {
    /// The file's name.
    pub file: String,
    /// What it is: "report of a bake".
    pub kind: &'static str,
    /// The command that writes such files.
    pub written_by: &'static str,
    /// Numbers and texts of the file's own, and how many entries its lists have.
    pub members: Vec<Member>,
    /// The files that it names.
    pub written: Vec<NamedFile>,
    /// Those of earlier runs that it keeps in mind.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub kept: Vec<NamedFile>,
    /// What was left out or assumed when it was made.
    pub warnings: Vec<String>,
}

/// A member of a JSON file, in words.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Member {
    /// Its name.
    pub name: String,
    /// Its value, or of how many entries it is.
    pub value: String,
}

/// A file that a report names, as it is now.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct NamedFile {
    /// Its path from the report's folder.
    pub file: String,
    /// Its size as it was written.
    pub bytes: usize,
    /// What became of it.
    pub state: State,
}

/// What became of a file that a report names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// It is as it was written.
    AsWritten,
    /// It was changed.
    Changed,
    /// It is not there.
    Missing,
}

pub(super) fn inspect(files: &dyn Files, path: &Path) -> Result<WrittenReport, Error> {
    let fault = |fault| Error::Input { path: path.into(), fault };
    let json: Value =
        serde_json::from_slice(&read(files, path)?).map_err(|e| fault(InputFault::NoJson(e.to_string())))?;
    let has = |members: &[&str]| members.iter().all(|member| json.get(member).is_some());
    let Some(&(written_by, kind, _)) = KINDS.iter().find(|(.., members)| has(members)) else {
        return Err(fault(InputFault::ForeignJson));
    };
    let named = |member: &str| -> Vec<NamedFile> {
        let list: Option<Vec<WrittenFile>> =
            json.get(member).and_then(|list| serde_json::from_value(list.clone()).ok());
        list.unwrap_or_default().into_iter().map(|file| named_file(files, path, file)).collect()
    };
    let texts = json.get("warnings").and_then(Value::as_array).into_iter().flatten();
    Ok(WrittenReport {
        file: file_name(path),
        kind,
        written_by,
        members: members(&json),
        written: named("written"),
        kept: named("kept"),
        warnings: texts.filter_map(|text| Some(text.as_str()?.to_owned())).collect(),
    })
}

/// A file that `report` names, as it is now.
fn named_file(files: &dyn Files, report: &Path, file: WrittenFile) -> NamedFile {
    // A name that leads elsewhere is none of a file that was written beside the report.
    let now = relative(&file.file).and_then(|name| files.read(&report.with_file_name(name)).ok());
    let state = match now.map(|bytes| WrittenFile::new(&*file.file, &bytes) == file) {
        Some(true) => State::AsWritten,
        Some(false) => State::Changed,
        None => State::Missing,
    };
    NamedFile { file: file.file, bytes: file.bytes, state }
}

/// A number as people read it: of a fraction four digits.
fn short(number: &Number) -> String {
    let (Some(value), false) = (number.as_f64(), number.is_i64() || number.is_u64()) else {
        return number.to_string();
    };
    let digits = 3 - value.abs().log10().floor().clamp(-9.0, 3.0) as i32;
    let text = format!("{value:.*}", digits as usize);
    match text.split_once('.') {
        Some(_) => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        None => text,
    }
}

fn members(json: &Value) -> Vec<Member> {
    let members = json.as_object().into_iter().flatten();
    let shown = members.filter(|(name, _)| !["written", "kept", "warnings"].contains(&name.as_str()));
    let value = |value: &Value| match value {
        Value::String(text) => Some(text.clone()),
        Value::Bool(_) => Some(value.to_string()),
        Value::Number(number) => Some(short(number)),
        Value::Array(list) if list.iter().all(Value::is_number) && list.len() <= 4 => {
            Some(list.iter().filter_map(Value::as_number).map(short).collect::<Vec<_>>().join(" x "))
        }
        Value::Array(list) => Some(counted(list.len(), "entry", "entries")),
        Value::Object(_) | Value::Null => None,
    };
    shown.filter_map(|(name, v)| Some(Member { name: name.clone(), value: value(v)? })).collect()
}
