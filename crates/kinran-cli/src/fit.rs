//! `kinran fit`: coefficients that shaders ask for, with their errors.

mod fuzz;
mod fuzz_plots;

use crate::{Console, Error};

pub use fuzz::{FuzzArgs, FuzzLanguage};

/// Fits what shaders approximate, and tells how far off it is
#[derive(Debug, clap::Args)]
pub struct Args {
    /// What to fit
    #[command(subcommand)]
    pub subject: Subject,
}

/// What can be fitted.
#[derive(Debug, clap::Subcommand)]
pub enum Subject {
    /// A layer of fibres of one tilt and one spread
    Fuzz(FuzzArgs),
}

/// The command.
///
/// # Errors
/// One that names the flag or the file.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    match &args.subject {
        Subject::Fuzz(args) => fuzz::run(args, console),
    }
}
