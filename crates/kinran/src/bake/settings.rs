//! Flags of `kinran bake` as a manifest gives them.

use clap::{ArgAction, CommandFactory, Parser};
use kinran_bake::manifest::{Job, Manifest, ManifestError, Setting, SettingValue};

use super::Args;
use crate::Error;

/// Flags that say what a run does, not how an entry is baked.
const OF_THE_RUN: [&str; 6] = ["output", "watch", "jobs", "cache", "dry-run", "help"];

#[derive(Parser)]
#[command(name = "bake", no_binary_name = true)]
struct Flags {
    #[command(flatten)]
    bake: Args,
}

/// Refuses flags that a manifest sets for its entries.
pub(super) fn refuse_others(args: &Args) -> Result<(), Error> {
    let bare = Flags::try_parse_from(["kinran.toml"]).map_err(|e| Error::Internal(e.to_string()))?.bake;
    let of_the_run = Args {
        input: args.input.clone(),
        output: args.output.clone(),
        library: args.library.clone(),
        dry_run: args.dry_run,
        ..bare
    };
    if *args != of_the_run {
        return Err(Error::Usage(format!(
            "{}: how entries are baked stands in the manifest; move these flags to its [defaults], without \
             their dashes",
            args.input.display()
        )));
    }
    Ok(())
}

/// Refuses settings that no entry can have, entry by entry.
pub(super) fn check(manifest: &Manifest) -> Result<(), ManifestError> {
    manifest.settings().try_for_each(|setting| words(manifest, setting).map(drop))
}

/// The flags of a job; its input and output are not set.
pub(super) fn flags(manifest: &Manifest, job: &Job) -> Result<Args, ManifestError> {
    let mut all = vec!["kinran.toml".to_owned()];
    for setting in &job.settings {
        all.extend(words(manifest, setting)?);
    }
    let mut flags = Flags::try_parse_from(all).map_err(|e| manifest.error(&job.place, reason(&e)))?.bake;
    // Files that are not in the entry's folder are beside the manifest, not where the program was started.
    for path in flags.map.iter_mut().map(|(_, path)| path).chain(&mut flags.ignore) {
        if !job.input.join(&path).exists() {
            *path = manifest.beside(&*path);
        }
    }
    Ok(flags)
}

/// What a person would type for a setting.
fn words(manifest: &Manifest, setting: &Setting) -> Result<Vec<String>, ManifestError> {
    let command = Flags::command();
    let name = &setting.name;
    let argument = command
        .get_arguments()
        .find(|a| a.get_long() == Some(name))
        .filter(|_| !OF_THE_RUN.contains(&name.as_str()))
        .ok_or_else(|| manifest.error(&setting.place, unknown(&command, name)))?;
    let is_switch = matches!(argument.get_action(), ArgAction::SetTrue);
    match &setting.value {
        SettingValue::Switch(true) if is_switch => Ok(vec![format!("--{name}")]),
        SettingValue::Switch(false) if is_switch => Ok(Vec::new()),
        SettingValue::Switch(_) => {
            Err(manifest
                .error(&setting.place, format!("`{name}` takes a value; expected a string or a number")))
        }
        SettingValue::Texts(_) if is_switch => {
            Err(manifest.error(&setting.place, format!("`{name}` is a switch; expected true or false")))
        }
        SettingValue::Texts(values) => {
            if values.len() > 1 && !matches!(argument.get_action(), ArgAction::Append) {
                let place = &values[1].1;
                return Err(manifest.error(place, format!("`{name}` takes one value")));
            }
            let typed = |(value, place): &(String, _)| {
                let word = format!("--{name}={value}");
                match Flags::try_parse_from(["kinran.toml", &word]) {
                    Ok(_) => Ok(word),
                    Err(e) => Err(manifest.error(place, reason(&e))),
                }
            };
            values.iter().map(typed).collect()
        }
    }
}

/// What to say of a name that is no flag.
fn unknown(command: &clap::Command, name: &str) -> String {
    if OF_THE_RUN.contains(&name) {
        return format!("`{name}` says what a run does; give it on the command line as --{name}");
    }
    let mut names: Vec<&str> = command
        .get_arguments()
        .filter_map(clap::Arg::get_long)
        .filter(|long| !OF_THE_RUN.contains(long))
        .collect();
    names.sort_unstable();
    format!(
        "unknown key `{name}`; expected input, exclude, output, or a flag of `kinran bake`: {}",
        names.join(", ")
    )
}

/// A flag error without the words that are about command lines.
fn reason(error: &clap::Error) -> String {
    let text = error.to_string();
    let about = text.split("\n\n").next().unwrap_or("");
    about.trim_start_matches("error: ").split_whitespace().collect::<Vec<_>>().join(" ")
}
