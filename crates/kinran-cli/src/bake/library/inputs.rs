//! What an entry is made from: its key, and a copy of its files that nobody changes while they are baked.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Component, Path, PathBuf};
use std::time::Duration;

use kinran_bake::cache::{Key, WorkFolder, hash_file};
use kinran_bake::folder::{inner_folder, scan};
use kinran_bake::manifest::{Job, Kind, SettingValue};
use kinran_bake::stamps::Stamp;
use kinran_image::{Encoder, Encoding};
use kinran_scene::Document;

use super::super::file_name;
use super::super::settings::Flags;
use crate::{Error, Failure};

/// Part of every key. To be raised whenever the same version bakes other bytes from the same files and flags; a test
/// holds the bytes of a small library against it (`tests/library.rs`).
const BYTES_VERSION: u32 = 9;

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
    /// Those of a job; `refers_to` tells the files that a model refers to.
    pub(super) fn of(
        job: &Job,
        flags: &Flags,
        refers_to: &dyn Fn(&Path) -> Result<Vec<PathBuf>, Error>,
    ) -> Result<Sources, Error> {
        let mut words = vec![env!("CARGO_PKG_VERSION").into(), BYTES_VERSION.to_string()];
        words.extend(encoders(&flags.encodings()));
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
        match flags {
            Flags::Bake(_) if job.kind == Kind::Mesh => add_model(&job.input)?,
            Flags::Bake(flags) => {
                let folder = scan(&job.input, &flags.hints())?;
                let rows: Vec<_> = folder.rows.iter().filter(|row| row.is_picture()).collect();
                words.push(serde_json::to_string(&rows).map_err(|e| Error::Internal(e.to_string()))?);
                for material in folder.materials {
                    let twins = material.twins.into_iter().map(|twin| (twin.other_role, twin.other));
                    for (role, path) in material.files.into_iter().chain(twins) {
                        files.push((format!("{} {}", role.name(), file_name(&path)), path));
                    }
                }
            }
            Flags::Detail(flags) => {
                if let Some(model) = &flags.model {
                    add_model(model)?;
                }
                files.push((file_name(&job.input), job.input.clone()));
                for path in flags.layer.iter().flat_map(|layer| [Some(&layer.tile), layer.mask.as_ref()]) {
                    let Some(path) = path else { continue };
                    // Textures of tiles that have one name are called after their folders too.
                    let folder = path.parent().map(file_name).unwrap_or_default();
                    files.push((format!("{folder}/{}", file_name(path)), path.clone()));
                }
            }
            Flags::Skin(flags) => {
                files.extend(flags.profile.iter().map(|path| (file_name(path), path.clone())));
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

/// A job's files as they were at one moment, copied to where nobody else writes. What is baked from them is made from
/// exactly the bytes that its key tells of, and nothing but the files that the key knows can be read.
pub(super) struct Snapshot {
    /// The job, with the copy as its input.
    pub(super) job: Job,
    /// Its flags, with copies for the files that they name.
    pub(super) flags: Flags,
    /// The key of the copied bytes.
    pub(super) key: Key,
    copies: Copies,
}

impl Snapshot {
    /// Copies the files of a job into a folder under `state`.
    ///
    /// # Errors
    /// A file that cannot be read or is being written without a pause, and whatever is wrong with the job.
    pub(super) fn take(state: &Path, job: &Job, flags: &Flags) -> Result<Snapshot, Error> {
        let mut copies = Copies::new(state)?;
        let taken = copies.take(job, flags);
        let (job, flags, key) = taken.map_err(|e| copies.as_about_originals(e))?;
        Ok(Snapshot { job, flags, key, copies })
    }

    /// An error about the copies as one about the originals.
    pub(super) fn as_about_originals(&self, error: Error) -> Error {
        self.copies.as_about_originals(error)
    }

    /// As [`Self::as_about_originals`], of any text.
    pub(super) fn original_names(&self, text: &str) -> String {
        self.copies.original_names(text)
    }
}

/// Copies in a folder of work, each at the place of its original in the whole tree of files, so that paths from one to
/// another stay as they are.
struct Copies {
    work: WorkFolder,
    /// Copied folders, and those that they stand for.
    folders: BTreeMap<PathBuf, PathBuf>,
    /// What was copied to where, links resolved.
    copied: BTreeMap<PathBuf, PathBuf>,
}

impl Copies {
    fn new(state: &Path) -> Result<Copies, Error> {
        Ok(Copies { work: WorkFolder::new(state)?, folders: BTreeMap::new(), copied: BTreeMap::new() })
    }

    fn take(&mut self, job: &Job, flags: &Flags) -> Result<(Job, Flags, Key), Error> {
        let mut input = PathBuf::new();
        if job.kind == Kind::Aniso {
            input = self.copy_names(&job.input)?;
        } else if !job.input.as_os_str().is_empty() {
            input = self.copy(&job.input)?;
        }
        // Names of files in the folder of maps stay names, and a model has no use for maps.
        let inside = |path: &Path| path.is_relative() && job.input.join(path).is_file();
        let stays = |path: &Path| job.kind == Kind::Mesh || (job.kind == Kind::Aniso && inside(path));
        let named = match flags {
            Flags::Detail(flags) => flags.model.as_ref(),
            _ => None,
        };
        let mut failed = Ok(());
        let mut flags = flags.with_files(&mut |path| {
            if stays(path) {
                return path.to_path_buf();
            }
            self.copy(path).unwrap_or_else(|e| {
                failed = Err(e);
                PathBuf::new()
            })
        });
        failed?;
        let (original, model) = match (&mut flags, named) {
            (Flags::Bake(flags), _) if job.kind == Kind::Mesh => (Some(&job.input), Some(&mut flags.model)),
            (Flags::Detail(flags), named) => (named, Some(&mut flags.trust)),
            _ => (None, None),
        };
        if let Some(model) = model {
            // A copy of what a link leads to would be none.
            if let Some(original) = original {
                Document::open_allowing(original, model.allowed()?)?.check_files()?;
            }
            let allowed = model.allowed()?.iter().map(|folder| self.place(folder));
            let allowed: Vec<PathBuf> = allowed.collect::<Result<_, Error>>()?;
            for folder in &allowed {
                kinran_image::make_folder(folder)?;
            }
            model.allow_outside = allowed;
        }

        let job = Job { input, ..job.clone() };
        let sources = Sources::of(&job, &flags, &|model| Ok(Document::open(model)?.files()))?;
        let mut hashes = BTreeMap::new();
        for (_, copy) in &sources.files {
            let original = (self.folders.iter())
                .find_map(|(folder, original)| Some(original.join(copy.strip_prefix(folder).ok()?)));
            self.copy(&original.unwrap_or_else(|| copy.clone()))?;
            hashes.insert(copy.clone(), hash_file(copy)?.1);
        }
        let key = sources.key(&|path| Ok(hashes.get(path).cloned().unwrap_or_default()))?;
        Ok((job, flags, key))
    }

    /// Where the copy of a file or folder is.
    fn place(&self, original: &Path) -> Result<PathBuf, Error> {
        let absolute = std::path::absolute(original).map_err(|e| kinran_image::Error::io(original, e))?;
        let mut place = self.work.path().to_path_buf();
        let mut depth = 0_usize;
        for component in absolute.components() {
            match component {
                Component::Prefix(disk) => {
                    let letters = disk.as_os_str().to_string_lossy();
                    place.push(letters.chars().filter(|c| c.is_alphanumeric()).collect::<String>());
                }
                Component::RootDir | Component::CurDir => {}
                Component::ParentDir => {
                    depth = depth.checked_sub(1).ok_or_else(|| {
                        Error::file_error(
                            original,
                            "leads above the topmost folder; write a path that exists",
                        )
                    })?;
                    place.push("..");
                }
                Component::Normal(name) => {
                    depth += 1;
                    place.push(name);
                }
            }
        }
        Ok(place)
    }

    /// Copies a file, once.
    fn copy(&mut self, original: &Path) -> Result<PathBuf, Error> {
        let place = self.place(original)?;
        let fail = |e| kinran_image::Error::io(original, e);
        let parent = |path: &Path| path.parent().map(Path::to_path_buf).unwrap_or_default();
        fs::create_dir_all(parent(&place)).map_err(fail)?;
        self.folders.insert(parent(&place), parent(original));
        let resolved = parent(&place).canonicalize().map_err(fail)?.join(file_name(&place));
        let from = original.canonicalize().map_err(fail)?;
        match self.copied.get(&resolved) {
            Some(known) if *known == from => {}
            Some(known) => {
                let reason =
                    format!("and {} differ only by a link on the way to them; rename one", from.display());
                return Err(Error::file_error(known, reason));
            }
            None => {
                copy_whole(original, &place).map_err(fail)?;
                self.copied.insert(resolved, from);
            }
        }
        Ok(place)
    }

    /// Copies the names of the files in a folder, and in the one in it that has its maps: what is understood of a folder is
    /// understood by names. Those that are used are copied later.
    fn copy_names(&mut self, folder: &Path) -> Result<PathBuf, Error> {
        if let Some(inner) = inner_folder(folder) {
            self.copy_names(&inner)?;
        }
        let place = self.place(folder)?;
        let fail = |e| kinran_image::Error::io(folder, e);
        fs::create_dir_all(&place).map_err(fail)?;
        self.folders.insert(place.clone(), folder.to_path_buf());
        for entry in fs::read_dir(folder).map_err(fail)? {
            let path = entry.map_err(fail)?.path();
            if !path.is_dir() {
                File::create(place.join(path.file_name().unwrap_or_default())).map_err(fail)?;
            }
        }
        Ok(place)
    }

    fn as_about_originals(&self, error: Error) -> Error {
        let failure = Failure::of(&error);
        let message = self.original_names(&failure.message);
        let file = failure.file.map(|file| PathBuf::from(self.original_names(&file.to_string_lossy())));
        Error::Retold(Box::new(Failure { message, file, ..failure }))
    }

    fn original_names(&self, text: &str) -> String {
        // Folders in others come after those.
        let folders = self.folders.iter().rev();
        folders.fold(text.to_owned(), |text, (copy, original)| {
            text.replace(&copy.display().to_string(), &original.display().to_string())
        })
    }
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
