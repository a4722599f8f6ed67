//! Whole tasks: bakes, looks into files, the command line.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use kinran::inspect::InspectOptions;
use kinran::library::{JobOptions, Kind};
use kinran::report::Report;
use kinran::{Cancel, Disk, Files, Memory, Progress, Sink, Task};
use kinran_cli::outputs::Output;
use kinran_cli::{Console, Error};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::raise;

/// How often the calling thread looks for Ctrl-C and tells of progress: soon enough to feel at once.
const TICK: Duration = Duration::from_millis(50);

/// Runs `work` on a thread of its own without the interpreter's lock. The calling thread looks for signals and calls
/// `progress` with what is being done, units done and in all; where one of them raises, the work is stopped, and that comes
/// out.
fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(Task<'_>) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let cancel = Cancel::new();
    let latest = Mutex::new(None::<(String, u64, u64)>);
    let tell = |p: Progress<'_>| {
        *latest.lock().unwrap_or_else(PoisonError::into_inner) = Some((p.to_string(), p.done, p.total));
    };
    let look = || -> PyResult<()> {
        let news = latest.lock().unwrap_or_else(PoisonError::into_inner).take();
        Python::attach(|py| {
            py.check_signals()?;
            match (&progress, news) {
                (Some(progress), Some(news)) => progress.call1(py, news).map(drop),
                _ => Ok(()),
            }
        })
    };
    let (result, fault) = py.detach(|| {
        std::thread::scope(|scope| {
            let (done, is_done) = channel();
            let (tell, cancel) = (&tell, &cancel);
            let worker = scope.spawn(move || {
                let result = work(Task { tell, cancel });
                // Whoever waits has not gone.
                let _ = done.send(());
                result
            });
            let mut fault = None;
            while let Err(RecvTimeoutError::Timeout) = is_done.recv_timeout(TICK) {
                if fault.is_none()
                    && let Err(error) = look()
                {
                    cancel.cancel();
                    fault = Some(error);
                }
            }
            let last = if fault.is_none() { look().err() } else { None };
            let result = worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            (result, fault.or(last))
        })
    });
    match fault {
        Some(fault) => Err(fault),
        None => result.map_err(|error| raise(py, error)),
    }
}

/// A document, and of a bake in memory its files.
type Baked = (String, Option<BTreeMap<String, Vec<u8>>>);

fn json(value: &impl serde::Serialize) -> Result<String, Error> {
    serde_json::to_string(value).map_err(|e| Error::Internal(e.to_string()))
}

/// Bakes a folder, a model, a target of detail maps or tables of skin (`kind`) by the words of its flags: from the disk into
/// the folder `output`, or where `files` are given, from these into memory.
#[pyfunction]
#[pyo3(signature = (kind, input, words, output=None, files=None, force=false, progress=None))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn bake(
    py: Python<'_>,
    kind: &str,
    input: PathBuf,
    words: Vec<String>,
    output: Option<PathBuf>,
    files: Option<BTreeMap<String, Vec<u8>>>,
    force: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Baked> {
    let kind = match kind {
        "folder" => Kind::Aniso,
        "model" => Kind::Mesh,
        "detail" => Kind::Detail,
        "skin" => Kind::Skin,
        other => return Err(PyValueError::new_err(format!("{other}: no such kind"))),
    };
    watched(py, progress, move |task| {
        let how = kinran_cli::bake::options_of(kind, &input, &words)?;
        let quiet = Console { quiet: true, ..Console::default() };
        match (files, output) {
            (Some(files), _) => {
                let (memory, out) = (Memory::from_iter(files), Memory::new());
                let report = bake_one(&memory, &input, &how, &out, task)?;
                let files = out.files().into_iter();
                let files = files.map(|(name, bytes)| (name.to_string_lossy().into_owned(), bytes.to_vec()));
                Ok((report, Some(files.collect())))
            }
            (None, Some(output)) => {
                kinran_cli::outputs::check_folder(&output)?;
                let out = Output::new(&output, &input, force, &quiet);
                Ok((bake_one(&Disk, &input, &how, &out, task)?, None))
            }
            (None, None) => Err(Error::Usage("name an output folder".into())),
        }
    })
}

fn bake_one(
    files: &dyn Files,
    input: &Path,
    how: &JobOptions,
    out: &dyn Sink,
    task: Task<'_>,
) -> Result<String, Error> {
    match how {
        JobOptions::Folder(how) => {
            let understood = kinran::bake::understand(files, input, how)?;
            let reports: Vec<Report> = kinran::bake::folder(files, input, &understood, how, out, task)?;
            json(&serde_json::json!({ "files": understood.rows, "materials": reports }))
        }
        JobOptions::Model(how) => json(&kinran::bake::gltf(files, input, how, out, task)?),
        JobOptions::Detail(how) => json(&kinran::detail::solve(files, input, how, out, task)?),
        JobOptions::Skin(how) => {
            kinran::skin::tables(files, how, Some(&kinran_cli::skin_lut::draw), out, task)?;
            Ok("{}".into())
        }
        other => Err(Error::Internal(format!("{other:?}"))),
    }
}

/// Bakes what a manifest lists, as `kinran bake kinran.toml` does.
#[pyfunction]
#[pyo3(signature = (manifest, words, progress=None))]
pub(crate) fn bake_library(
    py: Python<'_>,
    manifest: PathBuf,
    words: Vec<String>,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    watched(py, progress, move |task| json(&kinran_cli::bake::library_report(&manifest, &words, task)?))
}

/// What is in a file.
#[pyfunction]
#[pyo3(signature = (path, role=None, exr_layer=None, allow_outside=vec![], files=None))]
pub(crate) fn inspect(
    py: Python<'_>,
    path: PathBuf,
    role: Option<String>,
    exr_layer: Option<String>,
    allow_outside: Vec<PathBuf>,
    files: Option<BTreeMap<String, Vec<u8>>>,
) -> PyResult<String> {
    let mut how = InspectOptions::default();
    if let Some(role) = role {
        let content = kinran::content::Content::named(&role);
        how.role = Some(content.ok_or_else(|| PyValueError::new_err(format!("role={role:?}: no such map")))?);
    }
    (how.exr_layer, how.allow_outside) = (exr_layer, allow_outside);
    watched(py, None, move |task| {
        let memory = files.map(Memory::from_iter);
        let files: &dyn Files = memory.as_ref().map_or(&Disk, |memory| memory);
        json(&kinran::inspect::inspect(files, &path, &how, task)?)
    })
}

/// What of a file breaks the rules for what Kinran writes.
#[pyfunction]
pub(crate) fn check(py: Python<'_>, path: PathBuf) -> PyResult<String> {
    watched(py, None, move |_| json(&kinran::check(&Disk, &path)?))
}

/// Coefficients of fuzz, as JSON.
#[pyfunction]
pub(crate) fn fit_fuzz(py: Python<'_>, tilt: f32, spread: f32, table: bool) -> PyResult<String> {
    let mut how = kinran::fit::FuzzOptions::default();
    (how.tilt, how.spread, how.table) = (tilt, spread, table);
    watched(py, None, move |_| json(&kinran::fit::fuzz(&how)?.report))
}

/// The shader library in a language: all of it, or a module with what it needs.
#[pyfunction]
#[pyo3(signature = (language, module=None))]
pub(crate) fn shader(py: Python<'_>, language: &str, module: Option<&str>) -> PyResult<String> {
    kinran_cli::shaders::text_of(language, module).map_err(|error| raise(py, error))
}

/// The command line: gives the exit code.
#[pyfunction]
pub(crate) fn command(py: Python<'_>, words: Vec<String>) -> u8 {
    py.detach(|| kinran_cli::cli::run_words(words.into_iter().map(Into::into)))
}
