//! Libraries by the crate's functions; `kinran-cli/tests/library.rs` has the whole of it, by the command.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use kinran::bake::FolderOptions;
use kinran::detail::{SolveOptions, TiledLayer};
use kinran::library::{BakeOptions, JobOptions, Kind, Library, LibraryReport, Manifest, Plan, STATE, Status};
use kinran::options::{Encoder, Format};
use kinran::skin::TableOptions;
use kinran::{Cancel, Disk, Error, Memory, Progress, Task};
use kinran_image::{Channels, Image, Pixels, encode_png};

fn png(seed: usize, blue: u8) -> Vec<u8> {
    let texels = (0..16 * 16).flat_map(|i| [110 + ((i * seed) % 16) as u8, 128, blue]).collect();
    encode_png(&Image::new(16, 16, Channels::Rgb, Pixels::U8(texels)).unwrap()).unwrap()
}

/// Two folders of maps, a target of detail maps, and human skin.
fn library(home: &Path) -> Manifest {
    for (name, bytes) in [
        ("maps/brass/brass_normal.png", png(3, 250)),
        ("maps/cloth/cloth_normal.png", png(7, 250)),
        ("wall_color.png", png(5, 90)),
        ("brick.png", png(3, 90)),
    ] {
        std::fs::create_dir_all(home.join(name).parent().unwrap()).unwrap();
        std::fs::write(home.join(name), bytes).unwrap();
    }
    let text = "[[aniso]]\ninput = \"maps/*\"\n[[detail]]\ninput = \"wall_color.png\"\n[[skin]]\n";
    Manifest::parse(&home.join("kinran.toml"), text.into()).unwrap()
}

fn plans(library: &Library, manifest: &Manifest, home: &Path) -> Vec<Plan> {
    let plan = |job: kinran::library::Job| {
        let how = match job.kind {
            Kind::Detail => {
                let mut how = SolveOptions::new(vec![TiledLayer::new(home.join("brick.png"))]);
                how.format = Some(Format::Rgba8);
                JobOptions::Detail(how)
            }
            Kind::Skin => {
                let mut how = TableOptions::default();
                how.size = (8, 8);
                JobOptions::Skin(how)
            }
            _ => {
                let mut how = FolderOptions::default();
                how.textures.encoder = Some(Encoder::Portable);
                JobOptions::Folder(how)
            }
        };
        Plan::new(job, how)
    };
    library.jobs(manifest).into_iter().map(|job| plan(job.unwrap())).collect()
}

fn bake(home: &Path, task: Task<'_>) -> Result<LibraryReport, Error> {
    let manifest = library(home);
    let library = Library::open(home.join("baked"), Some(&home.join("cache")))?;
    let plans = plans(&library, &manifest, home).into_iter().map(Ok).collect();
    library.look(plans, &|_, _| false, task)?.bake(&BakeOptions::default(), task)
}

/// The files below a folder by their paths in it, without what is known of them.
fn tree(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut files, mut folders) = (BTreeMap::new(), vec![folder.to_path_buf()]);
    while let Some(inner) = folders.pop() {
        for entry in std::fs::read_dir(inner).unwrap() {
            let path = entry.unwrap().path();
            if path.file_name().is_some_and(|name| name == STATE) {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else {
                files.insert(path.strip_prefix(folder).unwrap().to_path_buf(), std::fs::read(&path).unwrap());
            }
        }
    }
    files
}

#[test]
fn an_entry_that_is_baked_by_itself_is_another() {
    let home = tempfile::tempdir().unwrap();
    let report = bake(home.path(), Task::QUIET).unwrap();
    let told: Vec<_> = report.entries.iter().map(|entry| (&*entry.name, entry.status)).collect();
    assert!(told.iter().all(|(_, status)| *status == Status::Baked), "{:?}", report.entries);
    assert_eq!(told.len(), 4, "{told:?}");
    let manifest = library(home.path());
    let other = Library::open(home.path().join("other"), None).unwrap();
    for plan in plans(&other, &manifest, home.path()) {
        let out = Memory::new();
        plan.bake(&Disk, None, &out, Task::QUIET).unwrap();
        let alone: BTreeMap<PathBuf, Vec<u8>> =
            out.files().into_iter().map(|(name, bytes)| (name, bytes.to_vec())).collect();
        let inside = tree(&home.path().join("baked").join(&plan.job.folder));
        assert!(
            !alone.is_empty() && alone == inside,
            "{}: {:?} and {:?}",
            plan.job.name,
            alone.keys(),
            inside.keys()
        );
    }
}

#[test]
fn a_stopped_library_leaves_parts_of_entries_or_forgets_what_is_done() {
    let whole = tempfile::tempdir().unwrap();
    bake(whole.path(), Task::QUIET).unwrap();
    let whole = tree(&whole.path().join("baked"));
    let home = tempfile::tempdir().unwrap();
    let mut stopped = 0;
    // Each run is stopped later than the one before, and begins with what that one has finished.
    for told in (0..).step_by(7) {
        let (cancel, count) = (Cancel::new(), AtomicUsize::new(0));
        let tell = |_: Progress<'_>| {
            if count.fetch_add(1, Ordering::Relaxed) == told {
                cancel.cancel();
            }
        };
        let result = bake(home.path(), Task { tell: &tell, cancel: &cancel });
        let files = match home.path().join("baked").is_dir() {
            true => tree(&home.path().join("baked")),
            false => BTreeMap::new(),
        };
        for (name, bytes) in &files {
            assert_eq!(whole.get(name), Some(bytes), "{}, stopped when {told} was told", name.display());
        }
        match result {
            Err(Error::Cancelled) => stopped += 1,
            result => {
                result.unwrap();
                assert_eq!(files, whole);
                break;
            }
        }
    }
    assert!(stopped > 2, "it was never stopped on its way");
}
