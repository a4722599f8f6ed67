//! The shapes of what `--json` prints, as JSON schemas.

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::Value;

use crate::bake::{LibraryReport, report::BakeReport};
use crate::{
    cache, compare, completions, console, demo, fuzz_sheet, init, inspect, render, shaders, skin_sheet,
};

/// A schema for each command, by its name; `error` is that of what any of them prints in the place of a result.
pub fn schemas() -> Vec<(&'static str, Value)> {
    vec![
        of::<BakeReport>("bake", "kinran bake FOLDER, kinran bake MODEL.glb"),
        of::<LibraryReport>("bake-manifest", "kinran bake kinran.toml"),
        of::<cache::CacheReport>("cache", "kinran cache"),
        of::<compare::Report>("compare", "kinran compare"),
        of::<completions::Report>("completions", "kinran completions, kinran man"),
        of::<demo::Summary>("demo", "kinran demo"),
        of::<kinran::detail::StudyReport>("detail-report", "kinran detail report"),
        of::<kinran::detail::SolveReport>("detail-solve", "kinran detail solve"),
        of::<console::Failed>("error", "any command that fails"),
        of::<kinran::fit::FuzzReport>("fit-fuzz", "kinran fit fuzz"),
        of::<fuzz_sheet::Summary>("fuzz", "kinran fuzz"),
        of::<init::Report>("init", "kinran init"),
        of::<inspect::Report>("inspect", "kinran inspect"),
        of::<render::Summary>("render", "kinran render"),
        of::<shaders::Report>("shaders", "kinran shaders"),
        of::<skin_sheet::Summary>("skin", "kinran skin"),
        of::<kinran::skin::TablesReport>("skin-lut", "kinran skin-lut"),
        #[cfg(feature = "view")]
        of::<crate::viewer::Summary>("view", "kinran view --screenshot"),
    ]
}

fn of<T: JsonSchema>(name: &'static str, command: &str) -> (&'static str, Value) {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let mut schema = settings.into_generator().into_root_schema_for::<T>();
    schema.insert("title".into(), format!("What {command} prints with --json").into());
    (name, schema.to_value())
}
