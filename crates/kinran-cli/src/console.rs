use std::fmt::Display;
use std::io::{ErrorKind, Write, stderr, stdout};
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
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
    /// Where bars show: those of the whole command, or of the work that this one is a part of. `None` for none.
    pub bars: Option<Progress>,
}

/// Why a command failed, for programs: what `--json` prints in the place of the result, as `error`.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Failure {
    /// What kind of error it is, see [`Error::code`].
    pub code: &'static str,
    /// What is wrong, and what to do about it; one line.
    pub message: String,
    /// The file or folder that it is about, where it is about one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// The flag that it is about, where it is about one, or the argument that is missing: `--size`, `<FILE>`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flag: Option<String>,
    /// The line in the file, from 1, where it is a text.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<usize>,
    /// The character in the line, from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub column: Option<usize>,
    /// The program's exit code: 2 where the input or the flags are to blame, 1 where the program is.
    pub exit_code: u8,
}

impl Failure {
    /// What programs are told of an error.
    pub fn of(error: &Error) -> Self {
        let (line, column) = error.line_and_column().unzip();
        Failure {
            code: error.code(),
            message: one_line(&error.to_string()),
            file: error.file().map(Path::to_path_buf),
            flag: error.flag(),
            line,
            column,
            exit_code: error.exit_code(),
        }
    }
}

/// The document that `--json` prints where there is no result.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Failed {
    /// Why.
    pub error: Failure,
}

/// Characters of the longest word that is said whole: more than a path has that a person would type.
const WORD: usize = 300;

/// A word too long for a message without its middle; `None` for one that is short enough.
pub(crate) fn shortened(word: &str) -> Option<String> {
    let length = word.chars().count();
    (length > WORD).then(|| {
        let head: String = word.chars().take(WORD / 5).collect();
        let tail: String = word.chars().skip(length - WORD / 5).collect();
        format!("{head}…{tail}")
    })
}

/// A message in one line, without what would bury it.
fn one_line(message: &str) -> String {
    let word = |word| shortened(word).unwrap_or_else(|| word.to_owned());
    message.split_whitespace().map(word).collect::<Vec<_>>().join(" ")
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
            self.tell(&format!("warning: {}", one_line(&warning.to_string())));
        }
    }

    /// Tells what goes on, or was done without being asked for, unless quiet.
    pub fn note(&self, note: impl Display) {
        if !self.quiet {
            self.tell(&note.to_string());
        }
    }

    /// Tells an error, in one line.
    pub fn error(&self, error: impl Display) {
        self.tell(&format!("error: {}", one_line(&error.to_string())));
    }

    fn tell(&self, line: &str) {
        self.progress().suspend(|| {
            // Nobody is left to tell that standard error is closed.
            let _ = writeln!(stderr(), "{line}");
        });
    }

    /// Tells why a command failed, and shows the place in the file where there is one; with `--json` also as the one
    /// document on standard output, unless the result is there already and says it.
    pub fn failure(&self, error: &Error) {
        self.error(error);
        if let Some(snippet) = error.snippet() {
            self.tell(snippet);
        }
        if self.json && !matches!(error, Error::Entries { .. } | Error::Findings { .. } | Error::Stdout(_)) {
            // Where standard output is closed, standard error has told it.
            let _ = self.result(&Failed { error: Failure::of(error) }, "");
        }
    }

    /// The bars of this work.
    pub fn progress(&self) -> Progress {
        self.bars.clone().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_one_line_that_can_be_read() {
        assert_eq!(one_line("a\n  b\tc"), "a b c");
        let long = format!("{}: is too long", "é".repeat(5000));
        let said = one_line(&long);
        assert!(said.chars().count() < 200 && said.ends_with("é: is too long"), "{said}");
        assert_eq!(shortened(&"x".repeat(WORD)), None);
    }
}
