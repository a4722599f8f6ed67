//! Where the bytes of a glTF document stand: the GLB container and URIs.

use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};

use base64::Engine;
use kinran_image::{Files, IMAGE_EXTENSIONS, plain};
use percent_encoding::percent_decode_str;

use crate::Error;

/// A file's JSON and, in a GLB, its other chunks.
pub(crate) struct Container<'a> {
    pub(crate) json: &'a [u8],
    pub(crate) bin: Option<&'a [u8]>,
    /// Chunks that glTF does not know, each with its type.
    pub(crate) others: Vec<([u8; 4], &'a [u8])>,
    /// What was mended, a sentence each.
    pub(crate) warnings: Vec<String>,
}

impl<'a> Container<'a> {
    /// Takes away what some exporters put around the JSON and glTF forbids (sections 4.4.3.2 and 2.7).
    fn new(json: &'a [u8], bin: Option<&'a [u8]>, others: Vec<([u8; 4], &'a [u8])>) -> Self {
        let mut warnings = Vec::new();
        let bare = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
        if bare.len() < json.len() {
            warnings
                .push("the JSON begins with a byte order mark, which glTF forbids; it was left out".into());
        }
        let end = bare.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
        if end < bare.len() {
            warnings.push("the JSON is padded with zeros where glTF wants spaces; they were left out".into());
        }
        Container { json: &bare[..end], bin, others, warnings }
    }
}

const GLB_MAGIC: &[u8; 4] = b"glTF";
const HEADER_SIZE: usize = 12;
const CHUNK_HEADER_SIZE: usize = 8;

/// Whether a file is glTF by its name: `.gltf`, `.glb`, or `.vrm`, which is a GLB.
pub fn is_gltf(path: &Path) -> bool {
    path.extension().is_some_and(|own| ["gltf", "glb", "vrm"].iter().any(|e| own.eq_ignore_ascii_case(e)))
}

/// Splits a GLB into its chunks, or takes the whole file for JSON when it does not begin with the GLB
/// magic number (glTF 2.0 section 4.4; chunks of unknown type are handed on, as demanded there).
pub(crate) fn split<'a>(name: &Path, bytes: &'a [u8]) -> Result<Container<'a>, Error> {
    if !bytes.starts_with(GLB_MAGIC) {
        let container = Container::new(bytes, None, Vec::new());
        if container.json.iter().find(|byte| !byte.is_ascii_whitespace()) != Some(&b'{') {
            let reason = match name.extension().filter(|_| !is_gltf(name)) {
                Some(extension) if extension.eq_ignore_ascii_case("obj") => {
                    "is an OBJ, which has no materials and no document; save it as .glb".into()
                }
                Some(extension) => {
                    format!("`.{}` is not read; give .glb, .gltf or .obj", extension.to_string_lossy())
                }
                None => {
                    "is not glTF: it begins neither with the GLB magic number nor with a JSON object".into()
                }
            };
            return Err(Error::malformed(name, reason));
        }
        return Ok(container);
    }
    if bytes.len() < HEADER_SIZE {
        return Err(Error::malformed(name, "the GLB header is cut off; fetch or export the file again"));
    }
    let u32_at = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    let (version, length) = (u32_at(4), u32_at(8) as usize);
    if version != 2 {
        return Err(Error::unsupported(name, format!("GLB version {version}; export it as glTF 2.0")));
    }
    if length > bytes.len() {
        return Err(Error::malformed(
            name,
            format!(
                "the GLB header promises {length} bytes and the file has {}: it is truncated; fetch or export it again",
                bytes.len()
            ),
        ));
    }

    let (mut json, mut bin, mut others, mut at) = (None, None, Vec::new(), HEADER_SIZE);
    while at + CHUNK_HEADER_SIZE <= length {
        let (size, kind) = (u32_at(at) as usize, &bytes[at + 4..at + 8]);
        at += CHUNK_HEADER_SIZE;
        if size > length - at {
            return Err(Error::malformed(
                name,
                format!("a GLB chunk of {size} bytes begins at byte {at} of {length}: it does not fit"),
            ));
        }
        let chunk = &bytes[at..at + size];
        match kind {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if json.is_some() && bin.is_none() => bin = Some(chunk),
            _ if json.is_none() => {
                return Err(Error::malformed(name, "the first GLB chunk is not JSON"));
            }
            kind => others.push(([kind[0], kind[1], kind[2], kind[3]], chunk)),
        }
        at += size;
    }
    let json = json.ok_or_else(|| Error::malformed(name, "the GLB has no JSON chunk"))?;
    Ok(Container::new(json, bin, others))
}

/// A GLB of a document's JSON and the bytes of its first buffer.
///
/// # Errors
/// [`Error::Unsupported`] where it would have four GiB or more.
pub fn glb(json: &[u8], binary: &[u8]) -> Result<Vec<u8>, Error> {
    join(Path::new("the model"), json, binary, &[])
}

/// A GLB of a JSON chunk, a binary one (none when `bin` is empty) and others, each padded to four bytes: JSON with spaces,
/// the others with zeros (glTF 2.0 section 4.4.3).
pub(crate) fn join(
    name: &Path,
    json: &[u8],
    bin: &[u8],
    others: &[([u8; 4], Vec<u8>)],
) -> Result<Vec<u8>, Error> {
    let bin = (!bin.is_empty()).then_some((*b"BIN\0", bin));
    let others = others.iter().map(|(kind, bytes)| (*kind, bytes.as_slice()));
    let chunks: Vec<([u8; 4], &[u8])> = std::iter::once((*b"JSON", json)).chain(bin).chain(others).collect();
    let sizes = chunks.iter().map(|(_, bytes)| CHUNK_HEADER_SIZE + bytes.len().next_multiple_of(4));
    let length = HEADER_SIZE + sizes.sum::<usize>();
    let length_u32 = u32::try_from(length).map_err(|_| {
        Error::unsupported(
            name,
            format!("a GLB of {length} bytes does not fit its 32-bit length field; write a .gltf instead"),
        )
    })?;

    let mut out = Vec::with_capacity(length);
    out.extend_from_slice(GLB_MAGIC);
    out.extend_from_slice(&2u32.to_le_bytes());
    out.extend_from_slice(&length_u32.to_le_bytes());
    for (kind, bytes) in chunks {
        out.extend_from_slice(&(bytes.len().next_multiple_of(4) as u32).to_le_bytes());
        out.extend_from_slice(&kind);
        out.extend_from_slice(bytes);
        out.resize(out.len().next_multiple_of(4), if kind == *b"JSON" { b' ' } else { 0 });
    }
    Ok(out)
}

/// What a URI in a document points at.
pub(crate) enum Target<'a> {
    /// The bytes are in the URI itself.
    Data(Vec<u8>),
    /// A file relative to the document, percent-decoded, `/`-separated.
    File(Cow<'a, str>),
}

/// Understands a `data:` URI or a relative path (glTF 2.0 section 2.8). Absolute paths, drives and other schemes
/// are refused: a document must not make its reader open arbitrary files or connections. A backslash separates
/// folders as `/` does, as in browsers and on Windows. Whether `..` leads too far is [`beside`]'s question.
pub(crate) fn parse_uri(uri: &str) -> Result<Target<'_>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (header, payload) = data.split_once(',').ok_or("a data: URI has no comma")?;
        if !header.ends_with(";base64") {
            return Ok(Target::Data(percent_decode_str(payload).collect()));
        }
        // Some exporters leave out the final padding.
        let config = base64::engine::GeneralPurposeConfig::new()
            .with_decode_padding_mode(base64::engine::DecodePaddingMode::Indifferent);
        return base64::engine::GeneralPurpose::new(&base64::alphabet::STANDARD, config)
            .decode(payload)
            .map(Target::Data)
            .map_err(|error| format!("a data: URI is not valid base64: {error}"));
    }
    let shown: String = uri.chars().take(120).collect();
    let scheme_length = uri.find(|c: char| !(c.is_ascii_alphanumeric() || "+-.".contains(c)));
    if scheme_length.is_some_and(|length| length > 0 && uri[length..].starts_with(':')) {
        return Err(format!("the URI \"{shown}\" is not relative; put the file beside the document"));
    }
    let path = percent_decode_str(uri)
        .decode_utf8()
        .map_err(|_| format!("the URI \"{shown}\" is not UTF-8 once percent-decoded"))?;
    let path = if path.contains('\\') { Cow::Owned(path.replace('\\', "/")) } else { path };
    let drive = path.as_bytes().first().is_some_and(u8::is_ascii_alphabetic) && path[1..].starts_with(':');
    if path.is_empty() || path.starts_with('/') || drive || path.contains('\0') {
        return Err(format!("the URI \"{shown}\" is not a relative path; put the file beside the document"));
    }
    Ok(Target::File(path))
}

/// Why the bytes behind a relative path are not given.
pub(crate) enum Refusal {
    /// The file cannot be read.
    Io(io::Error),
    /// It lies in `folder`, which is neither the document's own nor allowed.
    Outside { folder: PathBuf },
}

/// The bytes behind a relative path, as [`parse_uri`] gives it.
pub(crate) type Resolver<'a> = dyn Fn(&str) -> Result<Vec<u8>, Refusal> + Sync + 'a;

/// As [`Resolver`], of a caller who has files elsewhere than on a disk.
pub(crate) type GivenResolver<'a> = dyn Fn(&str) -> io::Result<Vec<u8>> + Sync + 'a;

/// A caller's resolver, which is never asked for a path that leaves the document's folder.
pub(crate) fn given<'a>(
    resolve: &'a GivenResolver<'a>,
) -> impl Fn(&str) -> Result<Vec<u8>, Refusal> + Sync + 'a {
    |path| {
        let plain = plain(Path::new(path));
        if plain.starts_with("..") {
            return Err(Refusal::Outside { folder: plain.parent().unwrap_or(&plain).to_path_buf() });
        }
        resolve(path).map_err(Refusal::Io)
    }
}

/// A resolver that reads the files of the folder of `document`, of folders in it, and of `allowed` folders. A link
/// counts for where it leads.
pub(crate) fn beside<'a>(
    files: &'a dyn Files,
    document: &Path,
    allowed: &'a [PathBuf],
) -> impl Fn(&str) -> Result<Vec<u8>, Refusal> + Sync + use<'a> {
    let folder = folder_of(document);
    move |path| files.read(&locate(files, &folder, allowed, path)?).map_err(Refusal::Io)
}

/// Where a file of a document in `folder` really lies, if that is a place for it.
pub(crate) fn locate(
    files: &dyn Files,
    folder: &Path,
    allowed: &[PathBuf],
    path: &str,
) -> Result<PathBuf, Refusal> {
    let file = folder.join(path);
    let outside = |file: &Path| Refusal::Outside { folder: plain(file.parent().unwrap_or(file)) };
    let within = |file: &Path, place: &dyn Fn(&Path) -> io::Result<PathBuf>| {
        let folders = std::iter::once(folder).chain(allowed.iter().map(PathBuf::as_path));
        folders.filter_map(|folder| place(folder).ok()).any(|folder| file.starts_with(folder))
    };
    let real = match files.canonical(&file) {
        Ok(real) => real,
        // Whether there is such a file elsewhere is nothing that a document may find out.
        Err(error) => {
            let absolute = |path: &Path| Ok(plain(&std::path::absolute(path)?));
            let lexical = absolute(&file).map_err(Refusal::Io)?;
            return Err(if within(&lexical, &absolute) { Refusal::Io(error) } else { outside(&file) });
        }
    };
    if !within(&real, &|folder| files.canonical(folder)) {
        let leaves = plain(Path::new(path)).starts_with("..");
        return Err(outside(if leaves { &file } else { &real }));
    }
    Ok(real)
}

/// The folder of a file; the current one where its name is all there is.
pub(crate) fn folder_of(file: &Path) -> PathBuf {
    file.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_path_buf()
}

/// What a document names a file for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    Buffer,
    Image,
}

/// Extensions of buffers: those that `application/gltf-buffer` is registered with.
const BUFFER_EXTENSIONS: [&str; 3] = ["bin", "glbin", "glbuf"];

/// Extensions of images that `kinran_image` does not read, those of glTF's extensions among them.
const OTHER_IMAGES: [&str; 4] = ["avif", "basis", "ktx", "gif"];

impl Purpose {
    /// Refuses a file that cannot be what it is named for. Its name must say it, so that no document gets a key or a
    /// password written into what is made of it; an image may say it by its first bytes.
    fn check(self, path: &str, bytes: &[u8]) -> Result<(), String> {
        let is = |extensions: &[&str]| {
            let own = Path::new(path).extension();
            own.is_some_and(|own| extensions.iter().any(|e| own.eq_ignore_ascii_case(e)))
        };
        match self {
            Purpose::Buffer if !is(&BUFFER_EXTENSIONS) => Err(format!(
                "the file \"{path}\" is no buffer by its name; buffers end in .{}",
                BUFFER_EXTENSIONS.join(", .")
            )),
            Purpose::Image if !is(&IMAGE_EXTENSIONS) && !is(&OTHER_IMAGES) && !is_image(bytes) => {
                Err(format!(
                    "the file \"{path}\" is no image, neither by its name nor by its first bytes; name a PNG or JPEG"
                ))
            }
            _ => Ok(()),
        }
    }
}

/// Whether bytes begin as PNG, JPEG, WebP, KTX2 or DDS do.
fn is_image(bytes: &[u8]) -> bool {
    let magic: [&[u8]; 4] = [b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"\xabKTX 20\xbb", b"DDS "];
    let webp = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP");
    webp || magic.iter().any(|magic| bytes.starts_with(magic))
}

/// The bytes a URI points at; `what` names its place in the document.
pub(crate) fn fetch(
    name: &Path,
    what: &str,
    purpose: Purpose,
    uri: &str,
    resolve: &Resolver<'_>,
) -> Result<Vec<u8>, Error> {
    let malformed = |reason: String| Error::malformed(name, format!("{what}: {reason}"));
    match parse_uri(uri).map_err(malformed)? {
        Target::Data(bytes) => Ok(bytes),
        Target::File(path) => match resolve(&path) {
            Ok(bytes) => purpose.check(&path, &bytes).map(|()| bytes).map_err(malformed),
            Err(Refusal::Io(source)) => Err(Error::Unreadable {
                path: name.to_path_buf(),
                what: what.into(),
                file: path.into_owned(),
                others: Vec::new(),
                source,
            }),
            Err(Refusal::Outside { folder }) => Err(Error::Outside {
                path: name.to_path_buf(),
                what: what.into(),
                file: path.into_owned(),
                folder,
            }),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::{Target, parse_uri};

    #[test]
    fn uris_that_are_not_relative_are_taken() {
        for refused in [
            "/etc/passwd",
            "%2Fetc/passwd",
            "\\\\server\\share\\a.png",
            "%5C%5Cserver/a.png",
            "file:///etc/passwd",
            "FILE:a.png",
            "http://localhost/a.png",
            "C:\\a.png",
            "C:a.png",
            "C%3A%5Ca.png",
            "c%3Aa.png",
            "a%00.png",
            "",
        ] {
            assert!(parse_uri(refused).is_err(), "{refused:?} was taken");
        }
        let decoded = |uri| match parse_uri(uri) {
            Ok(Target::File(path)) => path.into_owned(),
            Ok(Target::Data(_)) => panic!("{uri} is a file"),
            Err(e) => panic!("{uri}: {e}"),
        };
        assert_eq!(decoded("textures\\a%20b.png"), "textures/a b.png");
        assert_eq!(decoded("%2e%2e%5Ca.png"), "../a.png", "what is hidden by an encoding");
        assert_eq!(decoded("ü.png"), "ü.png");
    }
}
