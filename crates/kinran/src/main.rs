//! The command line.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
#[cfg(feature = "view")]
use kinran::viewer;
use kinran::{
    Console, Error, bake, cache, compare, demo, detail, fit, fuzz_sheet, inspect, render, shaders, skin_lut,
    skin_sheet,
};

/// Anisotropic materials from authored maps to pictures.
#[derive(Parser)]
#[command(name = "kinran", version, max_term_width = 100, arg_required_else_help = true)]
#[command(after_help = "Examples:
  kinran demo
  kinran bake model.glb -o baked/
  kinran render model.glb -o model.png
  kinran compare model.glb -o comparison/
  kinran detail solve helmet.png --layer steel.png,scale=4 -o baked/
  kinran inspect model_normal.ktx2
  kinran fit fuzz --tilt 30 --spread 0.2
  kinran shaders --lang hlsl -o shaders/

Angles are degrees. `kinran help COMMAND` tells all about a command.
Exit codes: 0 done, 2 something in the input or the flags is wrong, 1 a defect of the program, 130 interrupted.")]
struct Cli {
    #[command(subcommand)]
    command: Command,

    /// Worker threads; the default is one for each core. Results are the same for any number
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,

    /// No progress, no warnings, no summary; errors only
    #[arg(long, short, global = true)]
    quiet: bool,

    /// Says more: a line for each thing that went well
    #[arg(long, short, global = true, conflicts_with = "quiet")]
    verbose: bool,

    /// The summary as JSON on standard output, for programs; implies no progress
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::Args),
    Bake(Box<bake::Args>),
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
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let console = Console { quiet: cli.quiet, verbose: cli.verbose, json: cli.json, bars: None };
    clean_up_when_interrupted();
    match start_threads(cli.threads).and_then(|()| run(&cli.command, &console)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console.failure(&error);
            ExitCode::from(error.exit_code())
        }
    }
}

fn run(command: &Command, console: &Console) -> Result<(), Error> {
    match command {
        Command::Demo(args) => demo::run(args, console),
        Command::Bake(args) => bake::run(args, console),
        Command::Cache(args) => cache::run(args, console),
        Command::Render(args) => render::run(args, console),
        Command::Compare(args) => compare::run(args, console),
        Command::Detail(args) => detail::run(args, console),
        Command::Inspect(args) => inspect::run(args, console),
        Command::Fit(args) => fit::run(args, console),
        Command::Fuzz(args) => fuzz_sheet::run(args, console),
        #[cfg(feature = "view")]
        Command::View(args) => viewer::run(args, console),
        Command::Shaders(args) => shaders::run(args, console),
        Command::Skin(args) => skin_sheet::run(args, console),
        Command::SkinLut(args) => skin_lut::run(args, console),
    }
}

/// From now on Ctrl-C, and on Unix a polite kill, leave nothing unfinished behind. Where no handler can be had the next
/// run removes it. Exit codes are as shells have them: 128 and the number of the signal.
fn clean_up_when_interrupted() {
    fn end(signal: i32) -> ! {
        kinran_image::remove_unfinished();
        std::process::exit(128 + signal)
    }
    #[cfg(unix)]
    {
        use signal_hook::consts::{SIGINT, SIGTERM};
        if let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) {
            std::thread::spawn(move || {
                if let Some(signal) = signals.forever().next() {
                    end(signal);
                }
            });
        }
    }
    #[cfg(windows)]
    let _ = ctrlc::set_handler(|| end(2));
}

fn start_threads(threads: Option<u16>) -> Result<(), Error> {
    let Some(threads) = threads else { return Ok(()) };
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.into())
        .build_global()
        .map_err(|e| Error::Usage(format!("--threads {threads}: {e}; ask for fewer")))
}
