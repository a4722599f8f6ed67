//! What an entry is made from: its key, and a copy of its files that nobody changes while they are baked.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use kinran_bake::cache::{Key, WorkFolder, hash_file};
use kinran_bake::folder::{inner_folder, scan_in};
use kinran_bake::manifest::SettingValue;
use kinran_bake::stamps::Stamp;
use kinran_image::{Disk, Encoder, Encoding, Entry, Files, image_size};
use kinran_scene::Document;

use super::lock;
use super::plan::{JobOptions, Plan};
use crate::Error;
use crate::detail::Carrier;
use crate::names::file_name;
use crate::skin::ProfileSource;

/// Part of every key. To be raised whenever the same version bakes other bytes from the same files and options; a test
/// holds the bytes of a small library against it (`kinran-cli/tests/library.rs`).
const BYTES_VERSION: u32 = 11;

/// How often a file that is being written is looked at again, waiting twice as long each time: 1.3 s in all.
const LOOKS: u32 = 8;
const FIRST_WAIT: Duration = Duration::from_millis(5);

/// What an entry's files depend on.
pub(super) struct Sources {
    /// All but the files.
    words: Vec<String>,
    /// The files, and what each is to the entry.
    pub(super) files: Vec<(String, PathBuf)>,
}

impl Sources {
    /// Those of an entry; `refers_to` tells the files that a model refers to.
    pub(super) fn of(
        plan: &Plan,
        inputs: &dyn Files,
        refers_to: &dyn Fn(&Path) -> Result<Vec<PathBuf>, Error>,
    ) -> Result<Sources, Error> {
        let job = &plan.job;
        let mut words = vec![env!("CARGO_PKG_VERSION").into(), BYTES_VERSION.to_string()];
        words.extend(encoders(&plan.encodings()));
        words.push(job.kind.name().into());
        words.extend(job.settings.iter().map(|setting| match &setting.value {
            SettingValue::Switch(on) => format!("{} {on}", setting.name),
            SettingValue::Texts(texts) => {
                let texts: Vec<&str> = texts.iter().map(|(text, _)| text.as_str()).collect();
                format!("{} {texts:?}", setting.name)
            }
        }));
        let mut files = Vec::new();
        let mut add_model = |model: &Path| -> Result<(), Error> {
            files.push((file_name(model), model.to_path_buf()));
            files.extend(refers_to(model)?.into_iter().map(|file| (file_name(&file), file)));
            Ok(())
        };
        match &plan.how {
            JobOptions::Model(_) => add_model(&job.input)?,
            JobOptions::Folder(how) => {
                let folder = scan_in(inputs, &job.input, &how.hints)?;
                let rows: Vec<_> = folder.rows.iter().filter(|row| row.is_picture()).collect();
                words.push(serde_json::to_string(&rows).map_err(|e| Error::Internal(e.to_string()))?);
                for material in folder.materials {
                    let twins = material.twins.into_iter().map(|twin| (twin.other_role, twin.other));
                    for (role, path) in material.files.into_iter().chain(twins) {
                        files.push((format!("{} {}", role.name(), file_name(&path)), path));
                    }
                }
            }
            JobOptions::Detail(how) => {
                if let Some(Carrier::Model { path, .. }) = &how.carrier {
                    add_model(path)?;
                }
                files.push((file_name(&job.input), job.input.clone()));
                for path in how.images() {
                    // Textures of tiles that have one name are called after their folders too.
                    let folder = path.parent().map(file_name).unwrap_or_default();
                    files.push((format!("{folder}/{}", file_name(path)), path.clone()));
                }
            }
            JobOptions::Skin(how) => {
                if let ProfileSource::File(path) = &how.profile {
                    files.push((file_name(path), path.clone()));
                }
            }
        }
        Ok(Sources { words, files })
    }

    /// The key of what is made from these; `hash` tells BLAKE3 of a file.
    pub(super) fn key(&self, hash: &dyn Fn(&Path) -> Result<String, Error>) -> Result<Key, Error> {
        let mut words = self.words.clone();
        for (what, path) in &self.files {
            words.push(format!("{what} {}", hash(path)?));
        }
        Ok(Key::new(words.iter().map(String::as_bytes)))
    }
}

/// What decides about the bytes of blocks: the encoders, and where Intel's is among them, the instruction sets that it
/// chooses among.
fn encoders(encodings: &[Encoding]) -> Vec<String> {
    let mut words: Vec<String> = encodings.iter().map(|encoding| format!("{encoding:?}")).collect();
    if encodings.iter().any(|encoding| encoding.encoder == Encoder::Ispc) {
        #[cfg(target_arch = "x86_64")]
        let sets = [
            std::arch::is_x86_feature_detected!("sse4.1"),
            std::arch::is_x86_feature_detected!("avx"),
            std::arch::is_x86_feature_detected!("avx2"),
            std::arch::is_x86_feature_detected!("avx512f"),
        ];
        #[cfg(not(target_arch = "x86_64"))]
        let sets = [(); 0];
        words.push(format!("{} {sets:?}", std::env::consts::ARCH));
    }
    words
}

/// An entry's files as they were at one moment, copied to where nobody else writes, and found by the paths of their
/// originals. What is baked from them is made from exactly the bytes that the key tells of, and nothing but the files that the
/// key knows can be read.
#[derive(Clone, Debug)]
pub(super) struct Snapshot(Arc<Copies>);

#[derive(Debug)]
struct Copies {
    work: WorkFolder,
    /// What was copied, by each path that may be asked for.
    files: Mutex<BTreeMap<PathBuf, Copied>>,
    /// What the folders of maps held, by path: what is understood of a folder is understood by names.
    folders: Mutex<BTreeMap<PathBuf, Vec<Entry>>>,
}

#[derive(Clone, Debug)]
struct Copied {
    copy: PathBuf,
    /// Where the original really was.
    real: PathBuf,
}

impl Snapshot {
    /// Copies the files of an entry into a folder under `state`; gives the key of the copied bytes too.
    ///
    /// # Errors
    /// A file that cannot be read or is being written without a pause, and whatever is wrong with the entry.
    pub(super) fn take(state: &Path, plan: &Plan) -> Result<(Snapshot, Key), Error> {
        let (files, folders) = (Mutex::default(), Mutex::default());
        let snapshot = Snapshot(Arc::new(Copies { work: WorkFolder::new(state)?, files, folders }));
        if let JobOptions::Folder(how) = &plan.how {
            snapshot.list_folder(&plan.job.input)?;
            // Names of files in the folder of maps stay names; those that are used are copied below.
            let outside = how.hints.maps.iter().map(|(_, path)| path);
            for path in outside.filter(|path| !plan.job.input.join(path).is_file()) {
                snapshot.copy(path)?;
            }
        }
        if let Some(folder) = plan.allowed().iter().find(|folder| !folder.is_dir()) {
            let (given, reason) =
                (folder.display().to_string(), "there is no such folder; name one that exists".into());
            return Err(Error::Option { option: "allow-outside", given, file: None, reason });
        }
        let refers_to = |model: &Path| {
            snapshot.copy(model)?;
            let bytes = snapshot.read(model).map_err(|e| kinran_image::Error::io(model, e))?;
            Ok(Document::from_bytes(model, &bytes)?.files())
        };
        let sources = Sources::of(plan, &snapshot, &refers_to)?;
        let key = sources.key(&|path| Ok(hash_file(&snapshot.copy(path)?)?.1))?;
        Ok((snapshot, key))
    }

    /// Copies a file, once; gives the place of the copy.
    fn copy(&self, original: &Path) -> Result<PathBuf, Error> {
        let fail = |e| kinran_image::Error::io(original, e);
        let (asked, real) = (absolute(original), original.canonicalize().map_err(fail)?);
        let mut files = lock(&self.0.files);
        if let Some(known) = files.get(&asked).or_else(|| files.get(&real)).cloned() {
            files.insert(asked, known.clone());
            return Ok(known.copy);
        }
        let folder = self.0.work.path().join(files.len().to_string());
        fs::create_dir(&folder).map_err(fail)?;
        let copy = folder.join(file_name(original));
        copy_whole(original, &copy).map_err(fail)?;
        let copied = Copied { copy: copy.clone(), real: real.clone() };
        files.insert(asked, copied.clone());
        files.insert(real, copied);
        Ok(copy)
    }

    /// Remembers what a folder of maps holds, and the one in it that has its maps.
    fn list_folder(&self, folder: &Path) -> Result<(), Error> {
        if let Some(inner) = inner_folder(folder) {
            self.list_folder(&inner)?;
        }
        let entries = Disk.list(folder).map_err(|e| kinran_image::Error::io(folder, e))?;
        lock(&self.0.folders).insert(absolute(folder), entries);
        Ok(())
    }

    fn find(&self, path: &Path) -> Option<Copied> {
        let files = lock(&self.0.files);
        let known = files.get(path).or_else(|| files.get(&absolute(path)));
        known.or_else(|| files.get(&path.canonicalize().ok()?)).cloned()
    }

    fn is_listed(&self, path: &Path) -> bool {
        let listed = |folder: &Path| lock(&self.0.folders).get(&absolute(folder)).cloned();
        let entries = path.parent().and_then(listed).unwrap_or_default();
        entries.iter().any(|entry| !entry.is_folder && entry.path.file_name() == path.file_name())
    }
}

impl Files for Snapshot {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        fs::read(self.find(path).ok_or(ErrorKind::NotFound)?.copy)
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<Entry>> {
        Ok(lock(&self.0.folders).get(&absolute(folder)).ok_or(ErrorKind::NotFound)?.clone())
    }

    fn canonical(&self, path: &Path) -> io::Result<PathBuf> {
        self.find(path).map_or_else(|| Disk.canonical(path), |copied| Ok(copied.real))
    }

    fn is_file(&self, path: &Path) -> bool {
        self.find(path).is_some() || self.is_listed(path)
    }

    fn size(&self, path: &Path) -> Option<u64> {
        Some(fs::metadata(self.find(path)?.copy).ok()?.len())
    }

    fn place(&self, path: &Path) -> Option<PathBuf> {
        self.canonical(path).ok()
    }

    fn share(&self) -> Arc<dyn Files> {
        Arc::new(self.clone())
    }

    fn image_size(&self, path: &Path) -> Option<(u32, u32)> {
        image_size(&self.find(path)?.copy)
    }
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf())
}

/// Copies a file that is not written meanwhile.
fn copy_whole(from: &Path, to: &Path) -> io::Result<()> {
    // Opening a pipe may never end.
    if !fs::metadata(from)?.is_file() {
        return Err(io::Error::other("is not a regular file"));
    }
    let mut wait = FIRST_WAIT;
    for _ in 0..LOOKS {
        let mut file = File::open(from)?;
        let before = Stamp::from(&file.metadata()?);
        io::copy(&mut file, &mut File::create(to)?)?;
        if Stamp::from(&file.metadata()?).has_content_of(&before) {
            return Ok(());
        }
        std::thread::sleep(wait);
        wait *= 2;
    }
    Err(io::Error::other("is being written all the time; bake again when it is finished"))
}
