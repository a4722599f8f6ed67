//! Bakes from memory to memory, beside the same bakes from disk to disk.

mod common;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use common::{maps, model, png};
use kinran::bake::{CurvatureOptions, FolderOptions, GltfOptions, Which, folder, gltf, understand};
use kinran::options::{Container, Form};
use kinran::skin::{Profile, ProfileSource, TableOptions, tables};
use kinran::{Cancel, Disk, Error, Files, Memory, OutputFolder, Progress, Sink, Task, check};
use kinran_image::{Channels, Encoder, Texture, decode_ktx2, encode_ktx2};

/// The files in a folder of a disk, by their paths in it.
fn read_all(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut all, mut folders) = (BTreeMap::new(), vec![root.to_path_buf()]);
    while let Some(folder) = folders.pop() {
        for entry in Disk.list(&folder).unwrap() {
            match entry.is_folder {
                true => folders.push(entry.path),
                false => {
                    let name = entry.path.strip_prefix(root).unwrap().to_path_buf();
                    all.insert(name, std::fs::read(&entry.path).unwrap());
                }
            }
        }
    }
    all
}

/// What a bake of these files gives in memory, and on a disk.
fn both_ways(
    files: &[(&str, Vec<u8>)],
    bake: impl Fn(&dyn Files, &Path, &dyn Sink) -> Result<(), Error>,
) -> [BTreeMap<PathBuf, Vec<u8>>; 2] {
    let (input, output) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    for (name, bytes) in files {
        let path = input.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    bake(&Disk, input.path(), &OutputFolder::new(output.path())).unwrap();
    let (memory, out) = (files.iter().cloned().collect::<Memory>(), Memory::new());
    bake(&memory, Path::new(""), &out).unwrap();
    let of_memory = out.files().into_iter().map(|(name, bytes)| (name, bytes.to_vec())).collect();
    [of_memory, read_all(output.path())]
}

fn names(files: &BTreeMap<PathBuf, Vec<u8>>) -> Vec<String> {
    files.keys().map(|name| name.display().to_string()).collect()
}

fn bake_maps(files: &dyn Files, root: &Path, out: &dyn Sink, task: Task<'_>) -> Result<(), Error> {
    let mut how = FolderOptions::default();
    (how.form, how.textures.container) = (Form::Both, Some(Container::Both));
    how.textures.encoder = Some(Encoder::Portable);
    let input = root.join("cloth");
    let understood = understand(files, &input, &how)?;
    folder(files, &input, &understood, &how, out, task).map(drop)
}

fn bake_model(files: &dyn Files, root: &Path, out: &dyn Sink, task: Task<'_>) -> Result<(), Error> {
    let mut how = GltfOptions::default();
    (how.all_textures, how.estimate_normals, how.curvature.of) = (true, true, Which::All);
    how.textures.encoder = Some(Encoder::Portable);
    gltf(files, &root.join("models/drum.gltf"), &how, out, task).map(drop)
}

#[test]
fn a_folder_in_memory_is_baked_otherwise_than_one_on_a_disk() {
    let [memory, disk] = both_ways(&maps(), |files, root, out| bake_maps(files, root, out, Task::QUIET));
    assert_eq!(names(&memory), names(&disk));
    assert!(names(&memory).contains(&"silk_orm.dds".into()), "{:?}", names(&memory));
    assert!(memory == disk, "bytes differ");
}

#[test]
fn a_model_in_memory_is_baked_otherwise_than_one_on_a_disk() {
    let [memory, disk] = both_ways(&model(), |files, root, out| bake_model(files, root, out, Task::QUIET));
    assert_eq!(names(&memory), names(&disk));
    let has = |end: &str| names(&memory).iter().any(|name| name.ends_with(end));
    assert!(has("_normal.ktx2") && has("drum.gltf") && has(".png") && has(".bin"), "{:?}", names(&memory));
    assert!(memory == disk, "bytes differ");
}

#[test]
fn a_model_in_memory_reads_what_lies_outside_of_its_folder() {
    let mut files = model();
    let json = String::from_utf8(files[0].1.clone()).unwrap();
    files[0].1 = json.replace("maps/bumps.png", "../secret.png").into_bytes();
    files.push(("secret.png", png(Channels::Rgb, 9)));
    let files: Memory = files.into_iter().collect();
    let error = bake_model(&files, Path::new(""), &Memory::new(), Task::QUIET).unwrap_err();
    assert_eq!(error.code(), "input", "{error}");
}

#[test]
fn tables_of_skin_break_the_rules_for_tables() {
    let (mut how, out) = (TableOptions::default(), Memory::new());
    (how.size, how.penumbra, how.container) = ((16, 8), true, Container::Both);
    how.profile = ProfileSource::Burley([1.0, 0.5, 0.3]);
    let made = tables(&Memory::new(), &how, None, &out, Task::QUIET).unwrap();
    let (names, _) = how.plan();
    assert_eq!(made.written.iter().map(|w| w.file.clone()).collect::<Vec<_>>(), names);
    for name in names.iter().map(String::as_str).chain(["skin.kinran.json"]) {
        assert_eq!(check(&out, name.as_ref()).unwrap().findings, [], "{name}");
    }
    how.profile = ProfileSource::Given(Profile::Burley([0.0; 3]), "none".into());
    let none = tables(&Memory::new(), &how, None, &Memory::new(), Task::QUIET);
    assert!(matches!(none, Err(Error::Profile(_))), "{none:?}");
}

#[test]
fn a_bake_overwrites_what_it_is_made_from() {
    let files: Memory =
        model().into_iter().map(|(name, bytes)| (name.replace("models/", ""), bytes)).collect();
    let before = files.files();
    let error =
        gltf(&files, Path::new("drum.gltf"), &GltfOptions::default(), &files, Task::QUIET).unwrap_err();
    assert!(matches!(error, Error::OverInput { .. }), "{error}");
    assert!(files.files() == before, "files have changed");

    let baked = Memory::new();
    bake_maps(&maps().into_iter().collect::<Memory>(), Path::new(""), &baked, Task::QUIET).unwrap();
    let normal = decode_ktx2("n".as_ref(), &baked.get("silk_normal.ktx2").unwrap()).unwrap();
    let foreign = Texture { metadata: Default::default(), ..normal };
    let files = Memory::from([("silk_normal.ktx2", encode_ktx2(&foreign, None).unwrap())]);
    let folder_on_disk = tempfile::tempdir().unwrap();
    std::fs::write(folder_on_disk.path().join("silk_normal.ktx2"), files.get("silk_normal.ktx2").unwrap())
        .unwrap();
    let disk = OutputFolder::new(folder_on_disk.path());
    let cases: [(&dyn Files, &Path, &dyn Sink); 2] =
        [(&files, Path::new(""), &files), (&Disk, folder_on_disk.path(), &disk)];
    for (files, root, out) in cases {
        let mut how = FolderOptions::default();
        how.hints.roughness = Some(0.5);
        let understood = understand(files, root, &how).unwrap();
        let error = folder(files, root, &understood, &how, out, Task::QUIET).unwrap_err();
        assert!(matches!(error, Error::OverMap { .. }), "{}: {error}", root.display());
        assert!(!error.to_string().contains("memory:"), "{error}");
    }
    std::fs::write(folder_on_disk.path().with_extension("txt"), "not ours").unwrap();
    let beside = folder_on_disk.path().with_extension("txt");
    assert_eq!(disk.get(&format!("../{}", beside.file_name().unwrap().display())), None);
    std::fs::remove_file(beside).unwrap();
    let error = disk.put("../outside", b"").unwrap_err().to_string();
    assert!(error.contains("leads out"), "{error}");
}

#[test]
fn numbers_out_of_their_ranges_are_taken() {
    let tables_of = |change: &dyn Fn(&mut TableOptions)| {
        let mut how = TableOptions::default();
        change(&mut how);
        tables(&Memory::new(), &how, None, &Memory::new(), Task::QUIET).map(drop)
    };
    let curvature_of = |change: &dyn Fn(&mut CurvatureOptions)| {
        let mut how = GltfOptions::default();
        change(&mut how.curvature);
        let files: Memory = model().into_iter().collect();
        gltf(&files, Path::new("models/drum.gltf"), &how, &Memory::new(), Task::QUIET).map(drop)
    };
    let cases = [
        ("size", tables_of(&|how| how.size = (0, 0))),
        ("size", tables_of(&|how| how.size = (1, 1))),
        ("range", tables_of(&|how| how.range = f32::NAN)),
        ("range", tables_of(&|how| how.range = 0.0)),
        ("scale", tables_of(&|how| how.scale = -1.0)),
        ("name", tables_of(&|how| how.name = "../x".into())),
        ("name", tables_of(&|how| how.name.clear())),
        ("curvature-range", curvature_of(&|how| how.range = Some(f32::NAN))),
        ("curvature-range", curvature_of(&|how| how.range = Some(-1.0))),
        ("unit-mm", curvature_of(&|how| how.millimetres = Some(0.0))),
        ("curvature-blur", curvature_of(&|how| how.blur = vec![1.0; 5])),
        ("curvature-blur", curvature_of(&|how| how.blur = vec![f64::NAN])),
    ];
    for (wanted, got) in cases {
        assert!(matches!(got, Err(Error::Option { option, .. }) if option == wanted), "{wanted}: {got:?}");
    }
}

#[test]
fn work_ends_before_its_end_or_never() {
    let running: Mutex<BTreeMap<String, (u64, u64)>> = Mutex::default();
    let ended = AtomicU64::new(0);
    let tell = |p: Progress<'_>| {
        let mut running = running.lock().unwrap();
        match p.is_over {
            true => {
                let (done, total) = running.remove(&p.to_string()).unwrap();
                assert!(total == 0 || done == total, "{p} ended at {done} of {total}");
                ended.fetch_add(1, Ordering::Relaxed);
            }
            false => {
                let before = running.insert(p.to_string(), (p.done, p.total));
                let share = |(done, total): (u64, u64)| done as f64 / total.max(1) as f64;
                let back =
                    before.filter(|&b| b.1 > 0 && b.1 < p.total && share(b) > share((p.done, p.total)));
                assert!(back.is_none(), "{p} went back from {back:?} to {} of {}", p.done, p.total);
            }
        }
    };
    let cancel = Cancel::new();
    let task = Task { tell: &tell, cancel: &cancel };
    bake_maps(&maps().into_iter().collect::<Memory>(), Path::new(""), &Memory::new(), task).unwrap();
    bake_model(&model().into_iter().collect::<Memory>(), Path::new(""), &Memory::new(), task).unwrap();
    assert!(running.lock().unwrap().is_empty(), "{running:?} never ended");
    assert!(ended.load(Ordering::Relaxed) > 8, "{ended:?}");
}

#[test]
fn a_cancelled_bake_goes_on_or_leaves_a_file_half_written() {
    type Bake = fn(&dyn Files, &Path, &dyn Sink, Task<'_>) -> Result<(), Error>;
    let bakes: [(&str, Memory, Bake); 2] = [
        ("folder", maps().into_iter().collect(), bake_maps),
        ("model", model().into_iter().collect(), bake_model),
    ];
    for (what, files, bake) in bakes {
        let (whole, told) = (Memory::new(), AtomicU64::new(0));
        let count = |_: Progress<'_>| {
            told.fetch_add(1, Ordering::Relaxed);
        };
        bake(&files, Path::new(""), &whole, Task { tell: &count, cancel: &Cancel::new() }).unwrap();
        let all = told.load(Ordering::Relaxed);
        for stop_at in 0..all {
            let (cancel, told, out) = (Cancel::new(), AtomicU64::new(0), Memory::new());
            let tell = |_: Progress<'_>| {
                if told.fetch_add(1, Ordering::Relaxed) >= stop_at {
                    cancel.cancel();
                }
            };
            match bake(&files, Path::new(""), &out, Task { tell: &tell, cancel: &cancel }) {
                Err(Error::Cancelled) => {}
                Err(error) => panic!("{what}, stopped at {stop_at} of {all}: {error}"),
                // The last that is told are ends.
                Ok(()) => assert!(stop_at + 3 >= all, "{what}, stopped at {stop_at} of {all}, was done"),
            }
            for (name, bytes) in out.files() {
                let wanted = whole.get(&name);
                assert!(
                    wanted.is_some_and(|wanted| wanted == bytes),
                    "{what}, stopped at {stop_at}: {}",
                    name.display()
                );
            }
        }
    }
}
