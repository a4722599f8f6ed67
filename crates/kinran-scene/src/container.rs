//! Where the bytes of a glTF document stand: the GLB container and URIs.

use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};

use base64::Engine;
use percent_encoding::percent_decode_str;

use crate::Error;

/// A file's JSON and, in a GLB, its binary chunk.
pub(crate) struct Container<'a> {
    pub(crate) json: &'a [u8],
    pub(crate) bin: Option<&'a [u8]>,
}

const GLB_MAGIC: &[u8; 4] = b"glTF";
const HEADER_SIZE: usize = 12;
const CHUNK_HEADER_SIZE: usize = 8;

/// Splits a GLB into its chunks, or takes the whole file for JSON when it does not begin with the GLB
/// magic number (glTF 2.0 section 4.4; chunks of unknown type are skipped, as demanded there).
pub(crate) fn split<'a>(name: &Path, bytes: &'a [u8]) -> Result<Container<'a>, Error> {
    if !bytes.starts_with(GLB_MAGIC) {
        let json = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        if json.iter().find(|byte| !byte.is_ascii_whitespace()) != Some(&b'{') {
            return Err(Error::malformed(
                name,
                "is not glTF: it begins neither with the GLB magic number nor with a JSON object",
            ));
        }
        return Ok(Container { json, bin: None });
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

    let (mut json, mut bin, mut at) = (None, None, HEADER_SIZE);
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
            _ => {}
        }
        at += size;
    }
    let json = json.ok_or_else(|| Error::malformed(name, "the GLB has no JSON chunk"))?;
    Ok(Container { json, bin })
}

/// A GLB of a JSON and a binary chunk (no binary chunk when `bin` is empty), each padded to four bytes:
/// JSON with spaces, binary with zeros (glTF 2.0 section 4.4.3).
pub(crate) fn join(name: &Path, json: &[u8], bin: &[u8]) -> Result<Vec<u8>, Error> {
    let json_size = json.len().next_multiple_of(4);
    let bin_size = bin.len().next_multiple_of(4);
    let bin_chunk = if bin.is_empty() { 0 } else { CHUNK_HEADER_SIZE + bin_size };
    let length = HEADER_SIZE + CHUNK_HEADER_SIZE + json_size + bin_chunk;
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
    out.extend_from_slice(&(json_size as u32).to_le_bytes());
    out.extend_from_slice(b"JSON");
    out.extend_from_slice(json);
    out.resize(HEADER_SIZE + CHUNK_HEADER_SIZE + json_size, b' ');
    if !bin.is_empty() {
        out.extend_from_slice(&(bin_size as u32).to_le_bytes());
        out.extend_from_slice(b"BIN\0");
        out.extend_from_slice(bin);
        out.resize(length, 0);
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

/// Understands a `data:` URI or a relative path (glTF 2.0 section 2.8). Absolute paths and other schemes
/// are refused: a document must not make its reader open arbitrary files or connections.
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
    if path.is_empty() || path.starts_with(['/', '\\']) || path.contains('\0') {
        return Err(format!("the URI \"{shown}\" is not a relative path; put the file beside the document"));
    }
    Ok(Target::File(path))
}

/// The bytes behind a relative path, as [`parse_uri`] gives it.
pub(crate) type Resolver<'a> = dyn Fn(&str) -> io::Result<Vec<u8>> + Sync + 'a;

/// A resolver that reads files beside `document`.
pub(crate) fn beside(document: &Path) -> impl Fn(&str) -> io::Result<Vec<u8>> + Sync + use<> {
    let folder = document.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    move |path| read_regular_file(&folder.join(path))
}

/// All bytes of a file; devices, pipes and folders are refused, since reading them may never end.
pub(crate) fn read_regular_file(path: &Path) -> io::Result<Vec<u8>> {
    let metadata = std::fs::metadata(path)?;
    if metadata.is_dir() {
        return Err(io::Error::other("is a folder, not a file"));
    }
    if !metadata.is_file() {
        return Err(io::Error::other("is not a regular file"));
    }
    std::fs::read(path)
}

/// The bytes a URI points at; `what` names its place in the document.
pub(crate) fn fetch(name: &Path, what: &str, uri: &str, resolve: &Resolver<'_>) -> Result<Vec<u8>, Error> {
    match parse_uri(uri).map_err(|reason| Error::malformed(name, format!("{what}: {reason}")))? {
        Target::Data(bytes) => Ok(bytes),
        Target::File(path) => resolve(&path).map_err(|error| {
            Error::malformed(name, format!("{what}: the file \"{path}\" it names cannot be read: {error}"))
        }),
    }
}
