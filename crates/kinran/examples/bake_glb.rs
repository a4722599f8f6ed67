//! Bakes a `.glb` from bytes to bytes: `cargo run -p kinran --example bake_glb -- lamp.glb baked/`. Enter stops it.

#![allow(clippy::print_stderr)]

use std::path::Path;

use kinran::bake::{GltfOptions, gltf};
use kinran::{Cancel, Error, Memory, OutputFolder, Progress, Sink, Task};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let [model, folder] = [1, 2].map(|i| std::env::args().nth(i).unwrap_or_default());
    let (files, out) = (Memory::from([("model.glb", std::fs::read(model)?)]), Memory::new());
    static CANCEL: Cancel = Cancel::new();
    std::thread::spawn(|| {
        matches!(std::io::stdin().read_line(&mut String::new()), Ok(1..)).then(|| CANCEL.cancel())
    });
    let tell = |p: Progress<'_>| eprintln!("{p}: {} of {}", p.done, p.total);
    let mut how = GltfOptions::default();
    how.all_textures = true;
    match gltf(&files, Path::new("model.glb"), &how, &out, Task { tell: &tell, cancel: &CANCEL }) {
        Ok(report) => report.warnings.iter().for_each(|warning| eprintln!("warning: {warning}")),
        Err(Error::Cancelled) => return Ok(()),
        Err(error) => return Err(format!("{}: {error}", error.code()).into()),
    }
    let folder = OutputFolder::new(&folder);
    for (name, bytes) in out.files() {
        folder.put(&name.to_string_lossy(), &bytes)?;
    }
    Ok(folder.finish()?)
}
