//! The flags of the command line as options: one definition for both.

use clap::{ArgAction, Command};
use pyo3::prelude::*;
use serde_json::{Value, json};

/// The flags of a command, such as `["bake"]` or `["detail", "solve"]`, as JSON: a list of objects with `name`, `help`,
/// `heading`, `default` and `values` (strings, where there are any), `switch` and `many`.
#[pyfunction]
pub(crate) fn options(words: Vec<String>) -> String {
    let mut command = kinran_cli::cli::command();
    command.build();
    let found = words.iter().try_fold(&command, |command, word| command.find_subcommand(word));
    Value::from(found.map(list).unwrap_or_default()).to_string()
}

fn list(command: &Command) -> Vec<Value> {
    let flags = command.get_arguments().filter(|flag| !flag.is_global_set() && !flag.is_hide_set());
    let told = flags.filter_map(|flag| {
        let name = flag.get_long().filter(|name| !["help", "version", "output"].contains(name))?;
        let default = flag.get_default_values().first().and_then(|value| value.to_str());
        let values: Vec<String> =
            flag.get_possible_values().iter().map(|value| value.get_name().to_owned()).collect();
        Some(json!({
            "name": name,
            "help": flag.get_help().map(ToString::to_string).unwrap_or_default(),
            "heading": flag.get_help_heading(),
            "default": default,
            "values": if matches!(flag.get_action(), ArgAction::SetTrue) { Vec::new() } else { values },
            "switch": matches!(flag.get_action(), ArgAction::SetTrue),
            "many": matches!(flag.get_action(), ArgAction::Append),
        }))
    });
    told.collect()
}
