use std::fmt::Display;
use std::io::{ErrorKind, Write, stderr, stdout};

use serde::Serialize;

use crate::{Error, Progress};

/// Where a command's words go: results to standard output, everything else to standard error.
#[derive(Clone, Debug, Default)]
pub struct Console {
    /// Errors only.
    pub quiet: bool,
    /// Also what went well, one by one.
    pub verbose: bool,
    /// Results as JSON.
    pub json: bool,
    /// Shows these bars, whatever is said above: those of work that is a part of other work.
    pub bars: Option<Progress>,
}

impl Console {
    /// Prints a command's result: `text` for people, or `data` as JSON where that was asked for. Text is
    /// left out when quiet, JSON is not. A reader that stops reading is no error.
    ///
    /// # Errors
    /// [`Error::Stdout`] where standard output fails in another way.
    pub fn result(&self, data: &impl Serialize, text: &str) -> Result<(), Error> {
        let text = match (self.json, self.quiet) {
            (true, _) => serde_json::to_string_pretty(data).map_err(|e| Error::Internal(e.to_string()))?,
            (false, false) => text.trim_end().to_owned(),
            (false, true) => return Ok(()),
        };
        let mut out = stdout().lock();
        match writeln!(out, "{text}").and_then(|()| out.flush()) {
            Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(e.into()),
            _ => Ok(()),
        }
    }

    /// Tells a warning, unless quiet.
    pub fn warn(&self, warning: impl Display) {
        if !self.quiet {
            // Nobody is left to tell that standard error is closed.
            let _ = writeln!(stderr(), "warning: {warning}");
        }
    }

    /// Tells what goes on, unless quiet.
    pub fn note(&self, note: impl Display) {
        if !self.quiet {
            let _ = writeln!(stderr(), "{note}");
        }
    }

    /// Tells an error, in one line.
    pub fn error(&self, error: impl Display) {
        let line = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
        let _ = writeln!(stderr(), "error: {line}");
    }

    /// Tells why a command failed, and shows the place in the file where there is one.
    pub fn failure(&self, error: &Error) {
        self.error(error);
        if let Some(snippet) = error.snippet() {
            let _ = writeln!(stderr(), "{snippet}");
        }
    }

    /// Progress bars that show unless quiet or JSON is asked for.
    pub fn progress(&self) -> Progress {
        self.bars.clone().unwrap_or_else(|| Progress::new(!self.quiet && !self.json))
    }
}
