//! Where tests find sample assets: models and materials made by others, which are no part of the project.
//! A test file takes this one in by `#[path = "../../sample_assets.rs"] mod sample_assets;`.

use std::path::{Path, PathBuf};

/// The folder of sample assets: `KINRAN_ASSETS`, else one beside the project; nothing where there is none, which is
/// said.
///
/// # Panics
/// Where the test that asks has a name without `sample_assets`: by it `./x test-assets` finds what the assets change.
#[expect(clippy::print_stdout, reason = "a skipped test says so")]
pub(crate) fn sample_assets() -> Option<PathBuf> {
    let test = std::thread::current().name().unwrap_or_default().to_owned();
    assert!(test.contains("sample_assets"), "{test}: takes sample assets; call it so");
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/assets");
    let folder = std::env::var_os("KINRAN_ASSETS").map_or(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("SKIPPED: no sample assets at {}; KINRAN_ASSETS names their folder", folder.display());
    None
}
