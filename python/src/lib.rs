//! The extension module `kinran._kinran`: what `kinran/*.py` calls. It takes and gives plain values, names and flat arrays;
//! shapes, defaults and docstrings are made there.

mod arrays;
mod errors;
mod formulas;
mod options;
mod tasks;

use pyo3::prelude::*;

/// The module.
#[pymodule]
mod _kinran {
    #[pymodule_export]
    use super::arrays::{curvature, decode_levels, encode_levels, filter_surface, read_image};
    #[pymodule_export]
    use super::formulas::{formula, formulas};
    #[pymodule_export]
    use super::options::options;
    #[pymodule_export]
    use super::tasks::{bake, bake_library, check, command, fit_fuzz, inspect, shader};
    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
