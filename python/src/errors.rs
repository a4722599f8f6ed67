//! Errors as Python has them: the classes of `kinran._errors`.

use kinran_cli::{Error, Failure};
use pyo3::prelude::*;

/// The exception for an error: of what the command would print with `--json` the members, and its text.
pub(crate) fn raise(py: Python<'_>, error: impl Into<Error>) -> PyErr {
    let failure = Failure::of(&error.into());
    let json = serde_json::to_string(&failure).unwrap_or_else(|_| "{}".into());
    let made = (py.import("kinran._errors")).and_then(|module| module.getattr("of")?.call1((json,)));
    made.map_or_else(|error| error, PyErr::from_value)
}
