//! `kinran completions` and `kinran man`: the command line told to shells and to `man`.

use std::path::{Path, PathBuf};

use clap::Command;
use clap_complete::Shell;
use clap_mangen::Man;
use kinran_image::write_atomically;
use schemars::JsonSchema;
use serde::Serialize;

use crate::{Console, Error, outputs};

/// Prints what a shell needs to complete commands and flags
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran completions bash > ~/.local/share/bash-completion/completions/kinran
  kinran completions zsh > ~/.zfunc/_kinran
  kinran completions fish > ~/.config/fish/completions/kinran.fish")]
pub struct Args {
    /// The shell
    #[arg(value_enum, value_name = "SHELL")]
    pub shell: Shell,
}

/// Prints the manual page, or writes a page for each command
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran man | man -l -
  kinran man -o ~/.local/share/man/man1/")]
pub struct ManArgs {
    /// The folder for the pages of all commands, kinran.1, kinran-bake.1, ...; made if it is not there
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,
}

/// A text that a command prints, or the files that it wrote.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Report {
    /// Files in the folder.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    files: Vec<String>,
    /// The text, where there is no folder.
    #[serde(skip_serializing_if = "Option::is_none")]
    text: Option<String>,
}

/// `kinran completions` of a program.
///
/// # Errors
/// Those of standard output.
pub fn run(args: &Args, mut program: Command, console: &Console) -> Result<(), Error> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut program, "kinran", &mut script);
    print(script, console)
}

/// `kinran man` of a program.
///
/// # Errors
/// Those of the folder and of standard output.
pub fn run_man(args: &ManArgs, mut program: Command, console: &Console) -> Result<(), Error> {
    program.build();
    let Some(folder) = &args.output else { return print(page(&Man::new(program))?, console) };
    outputs::check_folder(folder)?;
    kinran_image::make_folder(folder)?;
    let mut files = Vec::new();
    write_pages(&program, folder, &mut files)?;
    let text = format!("{} pages are in {}", files.len(), folder.display());
    console.result(&Report { files, text: None }, &text)
}

/// The text is what was asked for, not a summary of it: it comes when quiet too.
fn print(bytes: Vec<u8>, console: &Console) -> Result<(), Error> {
    let text = String::from_utf8(bytes).map_err(|e| Error::Internal(e.to_string()))?;
    let report = Report { files: Vec::new(), text: Some(text.clone()) };
    Console { quiet: false, ..console.clone() }.result(&report, &text)
}

fn page(man: &Man) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    man.render(&mut bytes).map_err(|e| Error::Internal(e.to_string()))?;
    Ok(bytes)
}

/// The page of a command and those of the commands in it.
fn write_pages(command: &Command, folder: &Path, files: &mut Vec<String>) -> Result<(), Error> {
    let man = Man::new(command.clone());
    let file = man.get_filename();
    let path = folder.join(&file);
    let is_ours = |text: Vec<u8>| String::from_utf8_lossy(&text).contains(".TH kinran");
    if std::fs::read(&path).is_ok_and(|text| !is_ours(text)) {
        let reason =
            "is a page that kinran did not write; move it away, or name another folder with --output";
        return Err(Error::file_error(&path, reason));
    }
    write_atomically(&path, &page(&man)?)?;
    files.push(file);
    let mut inner = command.get_subcommands().filter(|command| command.get_name() != "help");
    inner.try_for_each(|command| write_pages(command, folder, files))
}
