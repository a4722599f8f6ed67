//! What the project makes for itself and commits: the shader library in every language.

mod flat;
mod languages;
mod library;
mod source;
mod spirv;
mod split;

use std::path::Path;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// What went wrong, in words.
type Error = Box<dyn std::error::Error>;

/// Makes files that are committed.
#[derive(Parser)]
#[command(name = "xtask", arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Translates crates/kinran-shaders/src/*.wesl into every language
    Shaders {
        /// Writes nothing; fails where a committed file is not what would be written
        #[arg(long)]
        check: bool,
    },
}

fn main() -> ExitCode {
    let Command::Shaders { check } = Cli::parse().command;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    match library::make(&root).and_then(|files| if check { files.check() } else { files.write() }) {
        Ok(message) => {
            say(&message);
            ExitCode::SUCCESS
        }
        Err(error) => {
            say(&format!("error: {error}"));
            ExitCode::FAILURE
        }
    }
}

#[expect(clippy::print_stderr, reason = "this is the program's only voice")]
fn say(message: &str) {
    eprintln!("{message}");
}
