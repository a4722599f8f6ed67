//! Flags of `kinran bake`, `kinran detail solve` and `kinran skin-lut` as a manifest gives them.

use std::path::{Path, PathBuf};

use clap::error::ContextKind;
use clap::{ArgAction, CommandFactory, Parser};
use kinran::detail::SolveOptions;
use kinran::library::JobOptions;
use kinran_bake::manifest::{Job, Kind, Manifest, ManifestError, Setting, SettingValue, nearest};

use super::Args;
use super::flags::Flag;
use crate::Error;
use crate::detail::SolveArgs;
use crate::skin_lut;
use crate::values::range_in_words;

#[derive(Parser)]
#[command(name = "bake", no_binary_name = true)]
pub(super) struct BakeFlags {
    #[command(flatten)]
    pub(super) args: Args,
}

#[derive(Parser)]
#[command(name = "solve", no_binary_name = true)]
struct DetailFlags {
    #[command(flatten)]
    args: SolveArgs,
}

#[derive(Parser)]
#[command(name = "skin-lut", no_binary_name = true)]
struct SkinFlags {
    #[command(flatten)]
    args: skin_lut::Args,
}

/// Refuses flags that a manifest sets for its entries.
pub(super) fn refuse_others(args: &Args) -> Result<(), Error> {
    let of_entries = super::flags::FLAGS.iter().find(|flag| flag.is_of_entries() && (flag.given)(args));
    match of_entries {
        None => Ok(()),
        Some(flag) => {
            let reason = "says how entries are baked, which stands in the manifest; move these flags to its [defaults], \
                          without their dashes";
            Err(Error::flag_error_of(&args.input, format!("--{}", flag.name), reason))
        }
    }
}

/// What words say of a run over a manifest.
///
/// # Errors
/// [`Error::Flag`] for a flag that is not there, a value that is none, and a flag that says how entries are baked.
pub(super) fn args_of_run(manifest: &Path, words: &[String]) -> Result<Args, Error> {
    let first = [manifest.to_string_lossy().into_owned()];
    let args =
        BakeFlags::try_parse_from(first.iter().chain(words)).map_err(|e| flag_error(manifest, &e))?.args;
    refuse_others(&args).map(|()| args)
}

/// A word that is no flag, or no value of one.
fn flag_error(input: &Path, error: &clap::Error) -> Error {
    let about = error.get(ContextKind::InvalidArg).map(ToString::to_string);
    let flag = about.and_then(|flag| flag.split_whitespace().next().map(str::to_owned));
    Error::Flag { flag: flag.unwrap_or_default(), file: Some(input.into()), message: reason(error) }
}

/// Whether a flag says what a run does, not how an entry is baked.
fn is_of_the_run(name: &str) -> bool {
    Flag::named(name).is_some_and(|flag| !flag.is_of_entries())
}

/// How a job is baked.
pub(super) fn options(manifest: &Manifest, job: &Job) -> Result<JobOptions, ManifestError> {
    let mut all = words_before(job.kind);
    if job.kind == Kind::Skin && !job.input.as_os_str().is_empty() {
        all.push(format!("--profile={}", job.input.display()));
    }
    for setting in &job.settings {
        all.extend(words(manifest, job.kind, setting)?);
    }
    let wrong = |e: clap::Error| manifest.error(&job.place, reason(&e));
    // Files that are not in the entry's folder are beside the manifest, not where the program was started.
    if job.kind == Kind::Detail {
        let mut args = DetailFlags::try_parse_from(all).map_err(wrong)?.args;
        // Its name tells what it holds.
        args.target.clone_from(&job.input);
        for layer in &mut args.layer {
            layer.tile = manifest.beside(&layer.tile);
            layer.mask = layer.mask.as_ref().map(|mask| manifest.beside(mask));
        }
        let images = SolveOptions::new(args.layer.clone());
        let images: Vec<PathBuf> = std::iter::once(&args.target).chain(images.images()).cloned().collect();
        for (path, _) in &mut args.exr_layer {
            let known = images.iter().find(|image| image.file_name() == Some(path.as_os_str()));
            *path = known.cloned().unwrap_or_else(|| manifest.beside(&*path));
        }
        args.model = args.model.as_ref().map(|model| manifest.beside(model));
        args.trust.allow_outside.iter_mut().for_each(|folder| *folder = manifest.beside(&*folder));
        return Ok(JobOptions::Detail(args.options()));
    }
    if job.kind == Kind::Skin {
        let mut args = SkinFlags::try_parse_from(all).map_err(wrong)?.args;
        // An input's path starts where the program was started already.
        if job.input.as_os_str().is_empty() {
            args.profile = args.profile.as_ref().map(|profile| manifest.beside(profile));
        }
        return Ok(JobOptions::Skin(args.options()));
    }
    let mut args = BakeFlags::try_parse_from(all).map_err(wrong)?.args;
    args.check_textures().map_err(|e| manifest.error(&job.place, e.to_string()))?;
    args.model.allow_outside.iter_mut().for_each(|folder| *folder = manifest.beside(&*folder));
    let maps = args.map.iter_mut().map(|(_, path)| path);
    let layers = args.exr_layer.iter_mut().map(|(path, _)| path);
    for path in maps.chain(&mut args.ignore).chain(layers) {
        if !job.input.join(&path).exists() {
            *path = manifest.beside(&*path);
        }
    }
    // Reports of a library do not say where their inputs are, which every machine has elsewhere.
    if job.kind == Kind::Mesh {
        let settled = args.gltf_options().settled();
        let mut how = settled.map_err(|e| manifest.error(&job.place, Error::from(e).to_string()))?;
        how.source = None;
        return Ok(JobOptions::Model(how));
    }
    let mut how = args.folder_options();
    how.source = None;
    Ok(JobOptions::Folder(how))
}

/// How an input is baked, by the words of its flags as the command line has them (`--zstd=9`, `--all-textures`): those of
/// `kinran bake` for folders and models, of `kinran detail solve` for targets, and of `kinran skin-lut`, whose input is among
/// them.
///
/// # Errors
/// [`Error::Flag`] for a flag that is not there, a value that is none, and a flag that cannot act on the input.
pub fn options_of(kind: Kind, input: &Path, words: &[String]) -> Result<JobOptions, Error> {
    let wrong = |error: clap::Error| flag_error(input, &error);
    let first = [input.to_string_lossy().into_owned()];
    let bake = |first: &[String]| -> Vec<String> { first.iter().chain(words).cloned().collect() };
    match kind {
        Kind::Aniso | Kind::Mesh => {
            let args = BakeFlags::try_parse_from(bake(&first)).map_err(wrong)?.args;
            args.check_textures()?;
            if let Some(flag) = args.idle_flag(kind == Kind::Mesh) {
                let why = format!("{}; leave it out", flag.refusal());
                return Err(Error::flag_error_of(input, format!("--{}", flag.name), why));
            }
            Ok(match kind {
                Kind::Mesh => JobOptions::Model(args.gltf_options()),
                _ => JobOptions::Folder(args.folder_options()),
            })
        }
        Kind::Detail => {
            let args = DetailFlags::try_parse_from(bake(&first)).map_err(wrong)?.args;
            Ok(JobOptions::Detail(args.options()))
        }
        Kind::Skin => {
            let output = ["--output=output".to_owned()];
            let args = SkinFlags::try_parse_from(bake(&output)).map_err(wrong)?.args;
            Ok(JobOptions::Skin(args.options()))
        }
    }
}

fn command(kind: Kind) -> clap::Command {
    match kind {
        Kind::Aniso | Kind::Mesh => BakeFlags::command(),
        Kind::Detail => DetailFlags::command(),
        Kind::Skin => SkinFlags::command(),
    }
}

/// What a command cannot be without, and an entry says elsewhere.
fn words_before(kind: Kind) -> Vec<String> {
    let words: &[&str] = match kind {
        Kind::Aniso | Kind::Mesh => &["input"],
        Kind::Detail => &["input", "--output=output"],
        Kind::Skin => &["--output=output"],
    };
    words.iter().map(|&word| word.into()).collect()
}

/// Tries a flag by itself.
fn try_word(kind: Kind, name: &str, word: &str) -> Result<(), clap::Error> {
    let mut all = words_before(kind);
    all.push(word.into());
    match kind {
        Kind::Aniso | Kind::Mesh => BakeFlags::try_parse_from(all).map(drop),
        Kind::Detail => {
            if name != "layer" {
                all.push("--layer=x".into());
            }
            DetailFlags::try_parse_from(all).map(drop)
        }
        Kind::Skin => match SkinFlags::try_parse_from(all) {
            // Some flags come in pairs.
            Err(e) if e.kind() == clap::error::ErrorKind::MissingRequiredArgument => Ok(()),
            result => result.map(drop),
        },
    }
}

/// What a person would type for a setting.
fn words(manifest: &Manifest, kind: Kind, setting: &Setting) -> Result<Vec<String>, ManifestError> {
    let command = command(kind);
    let name = &setting.name;
    let find = |command: &clap::Command| {
        let known = command.get_arguments().find(|a| a.get_long() == Some(name)).cloned();
        known.filter(|_| !is_of_the_run(name))
    };
    let Some(argument) = find(&command) else {
        let others = [Kind::Aniso, Kind::Detail, Kind::Skin].into_iter().filter(|other| *other != kind);
        if setting.is_default && others.map(self::command).any(|other| find(&other).is_some()) {
            return Ok(Vec::new());
        }
        return Err(manifest.error(&setting.place, unknown(&command, name)));
    };
    let idle = match kind {
        Kind::Aniso => Flag::named(name).filter(|flag| !flag.on.acts(false)),
        Kind::Mesh => Flag::named(name).filter(|flag| !flag.on.acts(true)),
        Kind::Detail | Kind::Skin => None,
    };
    if let Some(flag) = idle {
        if setting.is_default {
            return Ok(Vec::new());
        }
        let reason = format!("`{name}` {}; leave it out", flag.refusal());
        return Err(manifest.error(&setting.place, reason));
    }
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
                match try_word(kind, name, &word) {
                    Ok(()) => Ok(word),
                    Err(e) => Err(manifest.error(place, reason(&e))),
                }
            };
            values.iter().map(typed).collect()
        }
    }
}

/// What to say of a name that is no flag.
fn unknown(command: &clap::Command, name: &str) -> String {
    if is_of_the_run(name) {
        return format!("`{name}` says what a run does; give it on the command line as --{name}");
    }
    let mut names: Vec<&str> =
        command.get_arguments().filter_map(clap::Arg::get_long).filter(|long| !is_of_the_run(long)).collect();
    let plain = name.trim_start_matches('-').replace('_', "-").to_lowercase();
    if let Some(meant) = ["input", "exclude", "output"].iter().chain(&names).find(|known| **known == plain) {
        return format!("unknown key `{name}`; did you mean `{meant}`?");
    }
    if is_of_the_run(&plain) {
        return format!("`{name}` says what a run does; give it on the command line as --{plain}");
    }
    names.sort_unstable();
    let known = ["input", "exclude", "output"].into_iter().chain(names.iter().copied());
    let meant = nearest(name, known).map_or_else(String::new, |meant| format!("did you mean `{meant}`? "));
    format!("unknown key `{name}`; {meant}expected input, exclude, output, or a flag: {}", names.join(", "))
}

/// Begins the keys in a message.
const IN_THE_MANIFEST: &str = "(in the manifest: ";

/// A message about an entry: where it names flags, the keys of the manifest that stand for them too.
pub(super) fn with_keys(kind: Kind, message: &str) -> String {
    // Out of an older cache it may have them.
    if message.contains(IN_THE_MANIFEST) {
        return message.to_owned();
    }
    let command = command(kind);
    let words: Vec<&str> = message.split_whitespace().collect();
    let bare = |word: &str| {
        word.trim_matches(|c: char| !c.is_alphanumeric() && !"-_=./".contains(c))
            .trim_end_matches('.')
            .to_owned()
    };
    let mut keys: Vec<String> = Vec::new();
    for (i, word) in words.iter().enumerate() {
        let given = bare(word);
        let Some(flag) = given.strip_prefix("--") else { continue };
        let (name, joined) = flag.split_once('=').map_or((flag, None), |(name, value)| (name, Some(value)));
        let Some(argument) = command.get_arguments().find(|a| a.get_long() == Some(name)) else { continue };
        if is_of_the_run(name) {
            continue;
        }
        let key = if matches!(argument.get_action(), ArgAction::SetTrue) {
            format!("`{name} = true`")
        } else {
            let ends = !word.ends_with(|c: char| c.is_alphanumeric());
            let next = joined.map(str::to_owned).or_else(|| Some(bare(words.get(i + 1)?)).filter(|_| !ends));
            // The next word is a value only where the flag takes it, and not whatever there is.
            let takes = |value: &str| try_word(kind, name, &format!("--{name}={value}")).is_ok();
            let is_value = |value: &String| {
                !value.is_empty() && takes(value) && (value.contains('=') || !takes("no such value"))
            };
            match next.filter(is_value) {
                Some(value) => format!("`{name} = \"{value}\"`"),
                None => format!("`{name}`"),
            }
        };
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    let valued = keys.clone();
    keys.retain(|key| {
        let begin = format!("{} = ", key.trim_end_matches('`'));
        !valued.iter().any(|other| other.starts_with(&begin))
    });
    match keys.as_slice() {
        [] => message.to_owned(),
        keys => format!("{message} {IN_THE_MANIFEST}{})", keys.join(" or ")),
    }
}

/// A flag error without the words that are about command lines.
fn reason(error: &clap::Error) -> String {
    let text = error.to_string();
    let about = text.split("\n\n").next().unwrap_or("");
    let about = about.trim_start_matches("error: ").split_whitespace().collect::<Vec<_>>().join(" ");
    range_in_words(&about)
}
