//! Documents on their way to their destination.

use std::path::{Path, PathBuf};

use kinran_scene::Document;

use crate::{Error, Sink};

/// A document and the files that it takes along.
pub(crate) struct Outgoing {
    /// Names and contents, the document last.
    pub(crate) files: Vec<(String, Vec<u8>)>,
    /// What could not be cleaned up.
    pub(crate) warnings: Vec<String>,
}

/// The document as it goes to its destination.
pub(crate) fn pack(document: &Document, model: &str, out: &dyn Sink) -> Result<Outgoing, Error> {
    let (packed, folder) = match out.place(model).filter(|_| out.is_on_disk()) {
        Some(place) => (document.pack(&place)?, place.parent().map(Path::to_path_buf).unwrap_or_default()),
        None => (document.pack_in_memory(model)?, PathBuf::new()),
    };
    let name = |path: &Path| {
        let path = path.strip_prefix(&folder).unwrap_or(path);
        path.components().map(|c| c.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
    };
    let files = packed.files.into_iter().map(|(path, bytes)| (name(&path), bytes)).collect();
    Ok(Outgoing { files, warnings: packed.warnings })
}
