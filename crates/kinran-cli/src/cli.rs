//! The command line as a whole: what it takes, and what becomes of what it cannot take.

use std::ffi::OsString;
use std::io::{Write, stderr};
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser, Subcommand};

use crate::values::range_in_words;
#[cfg(feature = "view")]
use crate::viewer;
use crate::{
    Console, Error, Progress, bake, cache, compare, completions, demo, detail, fit, fuzz_sheet, init,
    inspect, render, shaders, skin_lut, skin_sheet,
};

/// Anisotropic materials from authored maps to pictures.
#[derive(Parser)]
#[command(
    name = "kinran",
    version,
    max_term_width = 100,
    arg_required_else_help = true,
    propagate_version = true
)]
#[command(after_help = "Examples:
  kinran demo
  kinran bake model.glb -o baked/
  kinran init materials/ && kinran bake materials/kinran.toml
  kinran render model.glb -o model.png
  kinran compare model.glb -o comparison/
  kinran detail solve helmet.png --layer steel.png,scale=4 -o baked/
  kinran inspect model_normal.ktx2
  kinran fit fuzz --tilt 30 --spread 0.2
  kinran shaders --lang hlsl -o shaders/

Angles are degrees. `kinran help COMMAND` tells all about a command.
Exit codes: 0 done, 2 something in the input or the flags is wrong, 1 a defect of the program, \
130 interrupted. With --json standard output is one JSON document, unless interrupted: the result, or {\"error\": ...}; docs/json.md \
tells more.")]
struct Cli {
    #[command(subcommand)]
    command: Command,

    /// Worker threads; the default is one for each core. Results are the same for any number
    #[arg(long, global = true, help_heading = "Of every command", value_name = "N",
        value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,

    /// No progress, no warnings, no summary; errors only
    #[arg(long, short, global = true, help_heading = "Of every command")]
    quiet: bool,

    /// Says more: a line for each thing that went well
    #[arg(long, short, global = true, help_heading = "Of every command", conflicts_with = "quiet")]
    verbose: bool,

    /// The result as JSON on standard output, an error too, for programs; implies no progress
    #[arg(long, global = true, help_heading = "Of every command")]
    json: bool,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::Args),
    Bake(Box<bake::Args>),
    Init(init::Args),
    Cache(cache::Args),
    Render(render::Args),
    Compare(compare::Args),
    Detail(detail::Args),
    Inspect(inspect::Args),
    Fit(fit::Args),
    Fuzz(Box<fuzz_sheet::Args>),
    Shaders(shaders::Args),
    Skin(Box<skin_sheet::Args>),
    SkinLut(skin_lut::Args),
    #[cfg(feature = "view")]
    View(Box<viewer::Args>),
    #[cfg(not(feature = "view"))]
    View(NoWindow),
    Completions(completions::Args),
    Man(completions::ManArgs),
}

/// Opens a window on a model; this kinran was built without it
#[cfg(not(feature = "view"))]
#[derive(clap::Args)]
#[command(disable_help_flag = true)]
struct NoWindow {
    /// Whatever is asked for.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    rest: Vec<OsString>,
}

/// All commands with their flags, as help, completions and manual pages tell them.
pub fn command() -> clap::Command {
    Cli::command()
}

/// Does what the words of a command line ask for; the first is the program's name.
pub fn run(words: impl IntoIterator<Item = OsString>) -> ExitCode {
    ExitCode::from(run_words(words))
}

/// As [`run`], for programs that have this one inside: gives the exit code as a number.
pub fn run_words(words: impl IntoIterator<Item = OsString>) -> u8 {
    let words: Vec<OsString> = words.into_iter().collect();
    match Cli::try_parse_from(&words) {
        Ok(cli) => {
            let Cli { command, threads, quiet, verbose, json } = cli;
            if draws_on_a_gpu(&command) {
                with_runtime_folder(&words);
            }
            let bars = Some(Progress::new(!quiet && !json));
            let console = Console { quiet, verbose, json, bars };
            match start_threads(threads).and_then(|()| do_command(&command, &console)) {
                Ok(()) => 0,
                Err(error) => {
                    kinran_image::remove_empty_folders();
                    console.failure(&error);
                    error.exit_code()
                }
            }
        }
        Err(error) => {
            let error = shortened(error);
            if error.use_stderr() && asks_for_json(&words) {
                let console = Console { json: true, ..Console::default() };
                let said = misunderstood(&error);
                console.failure(&said);
                return said.exit_code();
            }
            // Nobody is left to tell that the stream is closed.
            let _ = match error.render().to_string() {
                text if text.contains("..=") => write!(stderr(), "{}", range_in_words(&text)),
                _ => error.print(),
            };
            error.exit_code() as u8
        }
    }
}

/// Whether a command opens a Vulkan device.
fn draws_on_a_gpu(command: &Command) -> bool {
    match command {
        Command::Render(args) => args.backend == render::Backend::Gpu,
        Command::Fuzz(args) => args.draws_on_a_gpu(),
        Command::View(_) => cfg!(feature = "view"),
        _ => false,
    }
}

/// Starts the program again with XDG_RUNTIME_DIR where there is none. Mesa's Vulkan looks for a Wayland display, and
/// its library writes "error: XDG_RUNTIME_DIR is invalid or not set" to standard error where it has no folder to look
/// in, though nothing is wrong; and no program can change its own variables safely.
#[cfg(target_os = "linux")]
fn with_runtime_folder(words: &[OsString]) {
    use std::os::unix::process::CommandExt;
    const NAME: &str = "XDG_RUNTIME_DIR";
    if std::env::var_os(NAME).is_some() {
        return;
    }
    if let Ok(program) = std::env::current_exe() {
        let mut again = std::process::Command::new(program);
        // Returns only where that fails; then the line is seen, and no more.
        let _ = again.args(&words[1..]).env(NAME, std::env::temp_dir()).exec();
    }
}

#[cfg(not(target_os = "linux"))]
fn with_runtime_folder(_: &[OsString]) {}

fn do_command(command: &Command, console: &Console) -> Result<(), Error> {
    match command {
        Command::Demo(args) => demo::run(args, console),
        Command::Bake(args) => bake::run(args, console).map_err(|e| e.about(&args.input)),
        Command::Init(args) => init::run(args, console),
        Command::Cache(args) => cache::run(args, console),
        Command::Render(args) => render::run(args, console).map_err(|e| e.about(&args.file)),
        Command::Compare(args) => compare::run(args, console).map_err(|e| e.about(&args.file)),
        Command::Detail(args) => detail::run(args, console),
        Command::Inspect(args) => inspect::run(args, console).map_err(|e| e.about(&args.file)),
        Command::Fit(args) => fit::run(args, console),
        Command::Fuzz(args) => fuzz_sheet::run(args, console).map_err(|e| e.about(&args.file)),
        #[cfg(feature = "view")]
        Command::View(args) => viewer::run(args, console),
        #[cfg(not(feature = "view"))]
        Command::View(_) => Err(Error::Usage(
            "view: this kinran was built without a window; build it with `cargo build --release -p kinran-cli --features \
             view`, or use `kinran render`"
                .into(),
        )),
        Command::Shaders(args) => shaders::run(args, console),
        Command::Skin(args) => skin_sheet::run(args, console).map_err(|e| e.about(&args.file)),
        Command::SkinLut(args) => skin_lut::run(args, console),
        Command::Completions(args) => completions::run(args, self::command(), console),
        Command::Man(args) => completions::run_man(args, self::command(), console),
    }
}

fn start_threads(threads: Option<u16>) -> Result<(), Error> {
    let Some(threads) = threads else { return Ok(()) };
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.into())
        .build_global()
        .map_err(|e| Error::flag_error(format!("--threads {threads}"), format!("{e}; ask for fewer")))
}

/// Whether `--json` stands among the words, which were not understood.
fn asks_for_json(words: &[OsString]) -> bool {
    words.iter().take_while(|word| *word != "--").any(|word| word == "--json")
}

/// The error without what a person typed at length.
fn shortened(mut error: clap::Error) -> clap::Error {
    let long: Vec<(ContextKind, ContextValue)> = error
        .context()
        .filter_map(|(kind, value)| match value {
            ContextValue::String(text) => {
                Some((kind, ContextValue::String(crate::console::shortened(text)?)))
            }
            _ => None,
        })
        .collect();
    // clap's "to pass '--size' as a value, use '-- --size'": nobody means that.
    if let Some(ContextValue::StyledStrs(tips)) = error.get(ContextKind::Suggested) {
        let sound: Vec<_> =
            tips.iter().filter(|tip| !tip.to_string().contains(" as a value")).cloned().collect();
        match sound.is_empty() {
            true => drop(error.remove(ContextKind::Suggested)),
            false => drop(error.insert(ContextKind::Suggested, ContextValue::StyledStrs(sound))),
        }
    }
    if !long.is_empty() {
        // What it suggests would have it once more.
        error.remove(ContextKind::Suggested);
    }
    for (kind, value) in long {
        error.insert(kind, value);
    }
    error
}

/// An error about words as one of ours.
fn misunderstood(error: &clap::Error) -> Error {
    let message = sentence(error);
    let about = match error.get(ContextKind::InvalidArg) {
        Some(ContextValue::String(argument)) => Some(argument),
        Some(ContextValue::Strings(arguments)) => arguments.first(),
        _ => None,
    };
    match about.and_then(|argument| argument.split([' ', '=']).next()) {
        Some(flag) => Error::Flag { flag: flag.to_owned(), file: None, message },
        None => Error::Usage(message),
    }
}

/// What is wrong with a flag and what might have been meant, in one line.
pub(crate) fn sentence(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let parts = text.split("\n\n").map(|part| part.split_whitespace().collect::<Vec<_>>().join(" "));
    let kept: Vec<String> =
        parts.filter(|part| part.starts_with("error: ") || part.starts_with("tip: ")).collect();
    let said = kept.join("; ").replace("error: ", "").replace("tip: ", "");
    match error.kind() {
        // Help in the place of an error.
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => "no command; `kinran help` lists them".into(),
        _ => range_in_words(&said),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(words: &[&str]) -> String {
        match Cli::try_parse_from(words) {
            Ok(_) => panic!("{words:?} were understood"),
            Err(error) => sentence(&shortened(error)),
        }
    }

    #[test]
    fn a_mistake_is_told_in_one_line_with_what_may_have_been_meant() {
        let told = said(&["kinran", "bake", "x", "--outptu", "y"]);
        assert_eq!(told, "unexpected argument '--outptu' found; a similar argument exists: '--output'");
        assert_eq!(said(&["kinran"]), "no command; `kinran help` lists them");
        let told = said(&["kinran", "render", "x", "-o", "y.png", "--size", "huge"]);
        let few = said(&["kinran", "render", "x", "--spp", "0"]);
        assert!(few.contains("--spp") && few.ends_with("0 is not from 1 to 1048576"), "{few}");
        assert!(told.contains("--size") && told.contains("1280x720") && !told.contains("--help"), "{told}");
    }

    #[test]
    fn five_thousand_letters_are_not_said_again() {
        let long = "x".repeat(5000);
        for words in [
            ["kinran", "render", "a", &format!("--size={long}")],
            ["kinran", "render", "a", &format!("--{long}")],
            ["kinran", &long, "a", "b"],
            ["kinran", "shaders", "--lang", &long],
            ["kinran", "inspect", "a", &long],
        ] {
            let told = said(&words);
            assert!(told.len() < 700 && told.contains("xxx"), "{} characters: {told}", told.len());
        }
    }
}
