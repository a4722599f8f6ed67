//! Files that commands write: whose they are, whether they can be written, and what is known of them afterwards. All
//! that can be refused is refused before long work, not after it.

use std::collections::BTreeSet;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use kinran::report::{KnownFiles, WrittenFile};
use kinran::{OutputFolder, Sink, Space};

use crate::{Console, Error};

/// Whether a path ends in `.extension`, in any case.
pub(crate) fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// A file's name without its folder, as it stands in reports.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// `name` in the folder that the input is in: where files go that nobody names a place for.
pub(crate) fn beside(input: &Path, name: &str) -> PathBuf {
    // "." and ".." have no parent in their names.
    let full = input.file_name().is_none().then(|| input.canonicalize().ok()).flatten();
    full.as_deref().unwrap_or(input).parent().unwrap_or(Path::new("")).join(name)
}

/// What is called after the input and stands beside it: `lamp.render.png` beside `lamp.glb` or a folder `lamp`, and
/// `lamp.obj.render.png` where `lamp.glb` is there as well.
pub(crate) fn named_after(input: &Path, ending: &str) -> PathBuf {
    let full = input.canonicalize().unwrap_or_else(|_| input.to_path_buf());
    let is_model = |path: &Path| kinran_scene::is_gltf(path) || has_extension(path, "obj");
    let stands_for = |path: PathBuf| {
        let name =
            if path.is_dir() { path.file_name() } else { path.file_stem().filter(|_| is_model(&path)) };
        path != full && name.is_some() && name == full.file_stem()
    };
    let siblings = || full.parent().and_then(|folder| std::fs::read_dir(folder).ok()).into_iter().flatten();
    let is_shared = || siblings().flatten().any(|entry| stands_for(entry.path()));
    let name = if full.is_dir() || is_shared() { full.file_name() } else { full.file_stem() };
    beside(input, &format!("{}{ending}", name.unwrap_or_default().to_string_lossy()))
}

/// Tells where files went that nobody named a place for.
pub(crate) fn tell_place(console: &Console, named: Option<&Path>, place: &Path) {
    if named.is_none() {
        console.note(format!("no --output was given: it went to {}", place.display()));
    }
}

/// Refuses a file whose extension is not among `extensions`, that is a folder, or whose folder neither exists nor can be
/// made; [`make_place`] makes it.
pub(crate) fn check_file(path: &Path, extensions: &[&str]) -> Result<(), Error> {
    if !extensions.iter().any(|e| has_extension(path, e)) {
        let wanted = extensions.iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(" or ");
        return Err(Error::file_error(path, format!("the name must end in {wanted}; rename it")));
    }
    if path.is_dir() {
        return Err(Error::file_error(path, "is a folder; name a file"));
    }
    check_folder(folder_of(path))
}

/// Makes the folder of a file that is to be written.
pub(crate) fn make_place(path: &Path) -> Result<(), Error> {
    Ok(kinran_image::make_folder(folder_of(path))?)
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Refuses a folder that neither exists nor can be made, or that cannot be written to.
///
/// # Errors
/// [`Error::File`] that names it.
pub fn check_folder(path: &Path) -> Result<(), Error> {
    let existing = existing_folder(path);
    if !existing.is_dir() {
        // As it was typed, unless it is a part of that.
        let shown = if path.exists() { path } else { &existing };
        return Err(Error::file_error(shown, "is a file; name a folder"));
    }
    check_writable(&existing)
}

/// The path, or the nearest folder above it that is there.
fn existing_folder(path: &Path) -> PathBuf {
    let full = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    full.ancestors().find(|p| p.exists()).unwrap_or(&full).to_path_buf()
}

fn check_writable(folder: &Path) -> Result<(), Error> {
    // A file without a name: a process that is killed here leaves nothing behind.
    tempfile::tempfile_in(folder).map(drop).map_err(|e| match e.kind() {
        // Folders of the system's own, as /proc.
        ErrorKind::NotFound => Error::file_error(folder, "no file can be made in this folder; name another"),
        // The error itself would name the temporary file.
        kind => kinran_image::Error::io(folder, kind.into()).into(),
    })
}

/// Refuses to write a file over one that the work is made from.
pub(crate) fn refuse_input<'a>(
    output: &Path,
    inputs: impl IntoIterator<Item = &'a Path>,
) -> Result<(), Error> {
    let Ok(existing) = output.canonicalize() else { return Ok(()) };
    let same = |input: &Path| input.canonicalize().is_ok_and(|input| input == existing);
    if inputs.into_iter().any(same) {
        return Err(Error::file_error(output, "is read and would be overwritten; choose another --output"));
    }
    Ok(())
}

/// What the pictures of this program begin with: the software that a PNG's text and an EXR's attribute name.
const SOFTWARE: &str = "Kinran";

/// Bytes in which [`SOFTWARE`] stands: behind a PNG's size, and among an EXR's attributes.
const PICTURE_HEAD: u64 = 4096;

/// Bytes of a PNG before its second chunk: the signature, and a header of 13 bytes with length, name and checksum.
const PNG_HEADER: usize = 8 + 4 + 4 + 13 + 4;

/// A PNG with a text chunk that says who drew it.
pub(crate) fn signed_png(mut png: Vec<u8>) -> Vec<u8> {
    let chunk = format!("tEXtSoftware\0{SOFTWARE}");
    let length = chunk.len() as u32 - 4;
    let mut checksum = crc32fast::Hasher::new();
    checksum.update(chunk.as_bytes());
    let bytes =
        length.to_be_bytes().into_iter().chain(chunk.bytes()).chain(checksum.finalize().to_be_bytes());
    png.splice(PNG_HEADER..PNG_HEADER, bytes);
    png
}

/// Refuses to overwrite a picture that kinran did not draw.
///
/// # Errors
/// [`Error::File`].
pub(crate) fn refuse_other_picture(picture: &Path) -> Result<(), Error> {
    let Ok(file) = std::fs::File::open(picture) else { return Ok(()) };
    let mut head = Vec::new();
    file.take(PICTURE_HEAD).read_to_end(&mut head).map_err(|e| kinran_image::Error::io(picture, e))?;
    if head.windows(SOFTWARE.len()).any(|bytes| bytes == SOFTWARE.as_bytes()) {
        return Ok(());
    }
    let reason = "kinran did not draw this picture; name another with --output, or overwrite it with --force";
    Err(Error::file_error(picture, reason))
}

/// Refuses to overwrite a page that kinran did not write, which is told by its title.
pub(crate) fn refuse_other_page(page: &Path) -> Result<(), Error> {
    let Ok(text) = std::fs::read(page) else { return Ok(()) };
    if String::from_utf8_lossy(&text).contains("<title>Kinran") {
        return Ok(());
    }
    Err(Error::file_error(page, "is a page that kinran did not write; name another folder with --output"))
}

/// What is known of a file that was just written to `folder`.
///
/// # Errors
/// Where it cannot be read.
pub(crate) fn written_file(folder: &Path, file: impl Into<String>) -> Result<WrittenFile, Error> {
    let file = file.into();
    let path = folder.join(&file);
    let bytes = match path.is_file() {
        true => std::fs::read(&path),
        false => Err(std::io::Error::other("is no regular file; move it away")),
    };
    let bytes = bytes.map_err(|e| kinran_image::Error::io(&path, e))?;
    Ok(WrittenFile::new(file, &bytes))
}

/// Where a bake's files go: a folder in which nothing of a person's is overwritten.
#[derive(Debug)]
pub struct Output<'a> {
    folder: OutputFolder,
    input: &'a Path,
    force: bool,
    console: &'a Console,
}

impl<'a> Output<'a> {
    /// For what is made of `input`; with `force` files that kinran did not write are overwritten all the same. The console is
    /// told where room may be short.
    pub fn new(folder: &Path, input: &'a Path, force: bool, console: &'a Console) -> Self {
        Output { folder: OutputFolder::new(folder), input, force, console }
    }
}

impl Sink for Output<'_> {
    fn expect(&self, names: &[String], space: Space) -> Result<(), kinran::Error> {
        let checked = || {
            let folder = &self.folder.path;
            refuse_other_source(folder, names, self.input, self.force)?;
            refuse_foreign(folder, names, self.force)?;
            // What is there stays until all is finished.
            check_space(folder, space)
        };
        match checked() {
            Err(error) => Err(kinran::Error::Refused(Box::new(error))),
            Ok(warning) => {
                warning.into_iter().for_each(|warning| self.console.warn(warning));
                Ok(())
            }
        }
    }

    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), kinran::Error> {
        self.folder.put(name, bytes)
    }

    fn finish(&self) -> Result<(), kinran::Error> {
        self.folder.finish()
    }

    fn get(&self, name: &str) -> Option<Vec<u8>> {
        self.folder.get(name)
    }

    fn place(&self, name: &str) -> Option<PathBuf> {
        self.folder.place(name)
    }

    fn is_on_disk(&self) -> bool {
        true
    }
}

/// The end of a report's name, by which a later run finds it.
const REPORTS: [&str; 2] = [".kinran.json", ".detail.json"];

/// Files that a sentence on earlier runs names.
const KEPT_NAMED: usize = 4;

fn is_report(file: &str) -> bool {
    REPORTS.iter().any(|end| file.ends_with(end))
}

/// Refuses to overwrite, in `folder`, files that no earlier run wrote there, or that somebody has changed since: what a
/// report beside them names, with the hash that it has now, is written again without a question.
///
/// # Errors
/// [`Error::File`]; also for a folder in the place of a file, which `force` does not help.
pub(crate) fn refuse_foreign(folder: &Path, files: &[String], force: bool) -> Result<(), Error> {
    let mut own: Option<BTreeSet<WrittenFile>> = None;
    // A report that is none explains why nothing else is known.
    let (reports, others): (Vec<&String>, Vec<&String>) = files.iter().partition(|file| is_report(file));
    for file in reports.into_iter().chain(others) {
        let path = folder.join(file);
        if path.is_dir() {
            let reason = "is a folder where a file must be written; move it away, or name another folder with --output";
            return Err(Error::file_error(&path, reason));
        }
        if force || !path.exists() {
            continue;
        }
        let ours = if is_report(file) {
            read_report(&path).is_some()
        } else {
            let written = written_file(folder, file)?;
            // What another report names is another model's, or another material's; but models themselves go from hand to
            // hand, from a bake to a solution of their detail maps.
            let own = own.get_or_insert_with(|| {
                reported(files.iter().filter(|file| is_report(file)).map(|file| folder.join(file)))
            });
            own.contains(&written) || (kinran_scene::is_gltf(&path) && known_files(folder).contains(&written))
        };
        if !ours {
            let reason = "kinran did not write this file, or it was changed since; move it away, name another folder \
                          with --output, or overwrite it with --force";
            return Err(Error::file_error(&path, reason));
        }
    }
    Ok(())
}

/// Refuses to overwrite a report, and with it its files, that was made from something else than `input`: two folders may
/// have a material of one name.
///
/// # Errors
/// [`Error::File`] with both, unless forced.
pub(crate) fn refuse_other_source(
    folder: &Path,
    files: &[String],
    input: &Path,
    force: bool,
) -> Result<(), Error> {
    for file in files.iter().filter(|file| is_report(file) && !force) {
        let path = folder.join(file);
        let Some(source) = read_report(&path).and_then(|report| report.source) else { continue };
        if way(folder, input).is_some_and(|way| way != source) {
            let source = folder.join(source);
            let reason = format!(
                "was baked from {}, and what is baked from {} would take its place; name another folder with --output, \
                 or overwrite it with --force",
                source.canonicalize().unwrap_or(source).display(),
                input.display()
            );
            return Err(Error::file_error(&path, reason));
        }
    }
    Ok(())
}

/// The way from a folder to a path, `/`-separated; nothing where there is none, as between two drives.
pub(crate) fn way(folder: &Path, path: &Path) -> Option<String> {
    let (folder, path) = (real(folder)?, real(path)?);
    let common = folder.components().zip(path.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(common).map(|_| "..".into());
    let down = path.components().skip(common).map(|part| part.as_os_str().to_string_lossy().into_owned());
    let parts: Vec<String> = up.chain(down).collect();
    match (common, parts.is_empty()) {
        (0, _) => None,
        (_, true) => Some(".".into()),
        (_, false) => Some(parts.join("/")),
    }
}

/// Where a path leads, also one whose last folders are yet to be made.
fn real(path: &Path) -> Option<PathBuf> {
    let full = std::path::absolute(path).ok()?;
    let there = full.ancestors().find(|part| part.exists())?;
    Some(there.canonicalize().ok()?.components().chain(full.strip_prefix(there).ok()?.components()).collect())
}

/// The files that reports in a folder name, and the reports: what was baked there.
pub(crate) fn written_in(folder: &Path) -> BTreeSet<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let reports: Vec<PathBuf> =
        entries.map(|e| e.path()).filter(|path| is_report(&path.to_string_lossy())).collect();
    let files = known_files(folder).into_iter().map(|written| folder.join(written.file));
    files.chain(reports).collect()
}

/// What the reports in a folder name.
fn known_files(folder: &Path) -> BTreeSet<WrittenFile> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    reported(entries.map(|e| e.path()).filter(|path| is_report(&path.to_string_lossy())))
}

/// What these reports name.
fn reported(reports: impl Iterator<Item = PathBuf>) -> BTreeSet<WrittenFile> {
    reports.filter_map(|path| read_report(&path)).flat_map(KnownFiles::files).collect()
}

/// A line on files that [`kept_files`] found; empty where there are none.
pub(crate) fn kept_remark(kept: &[WrittenFile]) -> String {
    let names: Vec<&str> = kept.iter().map(|w| &*w.file).take(KEPT_NAMED).collect();
    let more = match kept.len() - names.len() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    match names.len() {
        0 => String::new(),
        _ => format!("of an earlier run with other flags, left as they are: {}{more}\n", names.join(", ")),
    }
}

fn read_report(path: &Path) -> Option<KnownFiles> {
    serde_json::from_slice(&std::fs::read(path).ok()?).ok()
}

/// Space as people read it.
pub(crate) fn space_text(space: Space) -> String {
    match (bytes_text(space.least), bytes_text(space.most)) {
        (least, most) if least == most => most,
        (least, most) => format!("{least} to {most}"),
    }
}

/// Refuses output for which the disk of `folder` has clearly no room. The sentence that it may give is a warning: it
/// may be too little.
///
/// # Errors
/// [`Error::File`] with both numbers.
pub(crate) fn check_space(folder: &Path, needed: Space) -> Result<Option<String>, Error> {
    // A disk that does not tell is no reason to stop.
    let Ok(free) = fs4::available_space(existing_folder(folder)) else { return Ok(None) };
    room(folder, needed, free)
}

fn room(folder: &Path, needed: Space, free: u64) -> Result<Option<String>, Error> {
    let (place, free_text) = (folder.display(), bytes_text(free));
    if free < needed.least {
        let reason = format!(
            "the files take at least {} and {free_text} are free; free some space or choose another disk",
            bytes_text(needed.least)
        );
        return Err(Error::file_error(folder, reason));
    }
    Ok((free < needed.most).then(|| {
        let most = bytes_text(needed.most);
        format!("{place}: the files may take {most} and {free_text} are free")
    }))
}

/// Bytes as people read them.
pub(crate) fn bytes_text(bytes: u64) -> String {
    match bytes {
        0..1_024 => format!("{bytes} B"),
        1_024..1_048_576 => format!("{:.1} KiB", bytes as f64 / 1_024.0),
        1_048_576..1_073_741_824 => format!("{:.1} MiB", bytes as f64 / 1_048_576.0),
        _ => format!("{:.1} GiB", bytes as f64 / 1_073_741_824.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_two_models_of_one_stem_take_one_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("lamp.glb"), "").unwrap();
        std::fs::write(path("lamp.png"), "").unwrap();
        let name = |input: &str| named_after(&path(input), ".render.png");
        assert_eq!(name("lamp.glb"), path("lamp.render.png"));
        std::fs::write(path("lamp.obj"), "").unwrap();
        assert_eq!(name("lamp.glb"), path("lamp.glb.render.png"));
        assert_eq!(name("lamp.obj"), path("lamp.obj.render.png"));
        std::fs::create_dir(path("lamp")).unwrap();
        assert_eq!(name("lamp"), path("lamp.render.png"));
    }

    #[test]
    fn a_full_disk_is_found_out_after_the_work() {
        let needed = Space { least: 3 << 30, most: 5 << 30 };
        let of = |free: u64| room(Path::new("out"), needed, free).map_err(|e| e.to_string());
        let refused = of((3 << 30) - 1).unwrap_err();
        assert_eq!(
            refused,
            "out: the files take at least 3.0 GiB and 3.0 GiB are free; free some space or choose another disk"
        );
        assert_eq!(of(4 << 30).unwrap().unwrap(), "out: the files may take 5.0 GiB and 4.0 GiB are free");
        assert_eq!(of(5 << 30).unwrap(), None);
    }

    #[test]
    fn a_file_that_somebody_changed_is_taken_for_ours() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let write = |name: &str, text: &str| std::fs::write(path(name), text).unwrap();
        let refused = |names: &[&str], force| {
            let names: Vec<String> = names.iter().map(|&n| n.into()).collect();
            refuse_foreign(folder.path(), &names, force).map_err(|e| e.to_string())
        };
        write("a.ktx2", "a");
        assert!(refused(&["a.ktx2"], false).unwrap_err().contains("a.ktx2: kinran did not write"));
        refused(&["a.ktx2"], true).unwrap();
        refused(&["b.ktx2", "m.kinran.json"], false).unwrap();

        let report = serde_json::json!({ "written": [written_file(folder.path(), "a.ktx2").unwrap()] });
        write("m.kinran.json", &report.to_string());
        refused(&["a.ktx2", "m.kinran.json"], false).unwrap();
        assert!(refused(&["a.ktx2", "other.kinran.json"], false).unwrap_err().contains("a.ktx2"));
        write("a.ktx2", "b");
        assert!(refused(&["a.ktx2", "m.kinran.json"], false).unwrap_err().contains("a.ktx2"));
        write("m.kinran.json", "{ \"notes\": \"mine\" }");
        assert!(refused(&["m.kinran.json"], false).unwrap_err().contains("m.kinran.json"));
        let other =
            |named: &str| refuse_other_source(folder.path(), &["m.kinran.json".into()], &path(named), false);
        for source in ["x", "y"] {
            std::fs::create_dir(path(source)).unwrap();
        }
        write("m.kinran.json", &serde_json::json!({ "written": [], "source": "x" }).to_string());
        other("x").unwrap();
        assert!(other("y").unwrap_err().to_string().contains("was baked from"));
        assert_eq!(way(&path("x"), &path("y")).as_deref(), Some("../y"));
        assert_eq!(way(&path("x"), &path("x")).as_deref(), Some("."));
        assert_eq!(way(&path("not/yet"), &path("x")).as_deref(), Some("../../x"));
        std::fs::create_dir(path("d.ktx2")).unwrap();
        assert!(refused(&["d.ktx2"], true).unwrap_err().contains("is a folder"));
    }
}
