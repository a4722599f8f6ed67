//! What stands in a folder when a bake does not come to its end.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use kinran::bake::{GltfOptions, gltf};
use kinran::options::{Container, Encoder, Filter};
use kinran::report::Report;
use kinran::{Cancel, Error, Memory, OutputFolder, Progress, Task};
use kinran_image::{Channels, Image, Pixels, Staging, encode_png};

/// A model of two materials with normal maps.
fn model() -> Memory {
    let png = |seed: usize| {
        let texels = (0..16 * 16).flat_map(|i| [110 + ((i * seed) % 16) as u8, 128, 250]).collect();
        encode_png(&Image::new(16, 16, Channels::Rgb, Pixels::U8(texels)).unwrap()).unwrap()
    };
    let json = br#"{ "asset": { "version": "2.0" },
        "materials": [{ "name": "a", "normalTexture": { "index": 0 } }, { "name": "b", "normalTexture": { "index": 1 } }],
        "textures": [{ "source": 0 }, { "source": 1 }], "images": [{ "uri": "a.png" }, { "uri": "b.png" }] }"#;
    Memory::from([("lamp.gltf", json.to_vec()), ("a.png", png(3)), ("b.png", png(7))])
}

fn options(filter: Filter, container: Container) -> GltfOptions {
    let mut how = GltfOptions::default();
    (how.textures.filter, how.textures.container) = (filter, Some(container));
    how.textures.encoder = Some(Encoder::Portable);
    how
}

fn bake(folder: &Path, how: &GltfOptions, task: Task<'_>) -> Result<Report, Error> {
    gltf(&model(), Path::new("lamp.gltf"), how, &OutputFolder::new(folder), task)
}

/// Every file below a folder, hidden ones too.
fn tree(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.insert(path.clone(), Vec::new());
            files.extend(tree(&path));
        } else {
            files.insert(path.clone(), fs::read(&path).unwrap());
        }
    }
    files
}

#[test]
fn a_stopped_bake_changes_some_of_the_files_that_were_there() {
    let home = tempfile::tempdir().unwrap();
    bake(home.path(), &options(Filter::Linear, Container::Ktx2), Task::QUIET).unwrap();
    let before = tree(home.path());
    let other = options(Filter::Ml, Container::Both);
    for told in 0.. {
        let (cancel, count) = (Cancel::new(), AtomicUsize::new(0));
        let tell = |_: Progress<'_>| {
            if count.fetch_add(1, Ordering::Relaxed) == told {
                cancel.cancel();
            }
        };
        match bake(home.path(), &other, Task { tell: &tell, cancel: &cancel }) {
            Err(Error::Cancelled) => {
                let now = tree(home.path());
                let names = |tree: &BTreeMap<PathBuf, Vec<u8>>| tree.keys().cloned().collect::<Vec<_>>();
                assert_eq!(names(&now), names(&before), "stopped when {told} was told");
                assert!(now == before, "stopped when {told} was told, a file has another content");
            }
            result => {
                result.unwrap();
                assert!(told > 4, "it was never stopped on its way");
                break;
            }
        }
    }
    let after = tree(home.path());
    assert!(after.contains_key(&home.path().join("lamp_a_normal.dds")), "{:?}", after.keys());
    assert!(after.keys().all(|path| path.is_file()), "{:?}", after.keys());
}

#[test]
fn a_bake_that_fails_late_leaves_what_it_wrote_before() {
    let home = tempfile::tempdir().unwrap();
    // The document comes last.
    fs::create_dir(home.path().join("lamp.gltf")).unwrap();
    let before = tree(home.path());
    let error = bake(home.path(), &options(Filter::Linear, Container::Ktx2), Task::QUIET).unwrap_err();
    assert!(error.to_string().contains("lamp.gltf"), "{error}");
    assert_eq!(tree(home.path()), before);
}

#[test]
fn work_of_a_dead_process_stays_or_that_of_a_living_one_goes() {
    let home = tempfile::tempdir().unwrap();
    let part = |letter: &str| home.path().join(format!(".kinran-{}.part", letter.repeat(16)));
    for letter in ["a", "b"] {
        fs::create_dir_all(part(letter).join("files")).unwrap();
        fs::write(part(letter).join("files/x.ktx2"), "half").unwrap();
    }
    fs::write(part("a").join("lock"), "").unwrap();
    let living = File::create(part("b").join("lock")).unwrap();
    living.lock().unwrap();
    let mut staging = Staging::new(home.path()).unwrap();
    assert!(!part("a").exists() && part("b").join("files/x.ktx2").exists());
    staging.put(Path::new("inner/y.txt"), b"whole").unwrap();
    assert!(!home.path().join("inner").exists());
    staging.publish().unwrap();
    assert_eq!(fs::read(home.path().join("inner/y.txt")).unwrap(), b"whole");
    assert_eq!(
        fs::read_dir(home.path()).unwrap().count(),
        2,
        "the living one's folder, and what was written"
    );
}
