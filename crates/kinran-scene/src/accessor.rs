//! Reads accessors (glTF 2.0 section 3.6.2), having checked every claim about counts, strides and
//! ranges against the bytes that are there.

use std::path::Path;

use crate::Error;
use crate::json::{Accessor, Root};

/// Elements that a document may have beyond one for each byte of its buffers.
///
/// Without sharing, a vertex or an index takes a byte or more, so an honest document needs at most as
/// many elements as it has bytes, however large it is. Only accessors that read the same bytes again, or
/// sparse ones that read none, need this allowance. At its worst, as the indices of a strip whose corners
/// must all be split, 2^22 elements become 12.6 million vertices, about 2 GB while tangents are made: an
/// amount chosen so that a small file cannot exhaust a machine.
const SHARED_ELEMENTS_MAX: u64 = 1 << 22;

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// Reads the accessors of one document.
pub(crate) struct Accessors<'a> {
    name: &'a Path,
    root: &'a Root,
    buffers: &'a [Vec<u8>],
    /// Elements that may still be read.
    remaining: u64,
}

/// Some elements of a buffer view, known to lie within their buffer.
struct Elements<'a> {
    bytes: &'a [u8],
    count: usize,
    stride: usize,
    size: usize,
}

impl<'a> Elements<'a> {
    fn iter(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let (bytes, stride, size) = (self.bytes, self.stride, self.size);
        (0..self.count).map(move |i| &bytes[i * stride..i * stride + size])
    }
}

impl<'a> Accessors<'a> {
    /// `buffers` hold at least the `byteLength` that `root` claims for each.
    pub(crate) fn new(name: &'a Path, root: &'a Root, buffers: &'a [Vec<u8>]) -> Self {
        let bytes: u64 = buffers.iter().map(|buffer| buffer.len() as u64).sum();
        Accessors { name, root, buffers, remaining: bytes.saturating_add(SHARED_ELEMENTS_MAX) }
    }

    /// The bytes of a buffer view.
    pub(crate) fn view(&self, index: usize, what: &str) -> Result<&'a [u8], Error> {
        let view = (self.root.buffer_views.get(index))
            .ok_or_else(|| self.error(what, format!("bufferView {index} does not exist")))?;
        let buffer = (self.buffers.get(view.buffer))
            .ok_or_else(|| self.error(what, format!("buffer {} does not exist", view.buffer)))?;
        slice(buffer, view.byte_offset, view.byte_length).ok_or_else(|| {
            self.error(
                what,
                format!(
                    "bufferView {index} claims bytes {} to {} of buffer {}, which has {}",
                    view.byte_offset,
                    view.byte_offset.saturating_add(view.byte_length),
                    view.buffer,
                    buffer.len()
                ),
            )
        })
    }

    /// Floats, or integers as floats (divided by the largest one when normalised, section 3.6.2.2), of an
    /// accessor of exactly `N` components; all finite.
    pub(crate) fn floats<const N: usize>(
        &mut self,
        index: usize,
        what: &str,
    ) -> Result<Vec<[f32; N]>, Error> {
        let accessor = self.accessor(index, what)?;
        let components = components(&accessor.kind).unwrap_or(0);
        if components != N {
            return Err(self.error(
                what,
                format!("accessor {index} has type \"{}\" where {N} components are wanted", accessor.kind),
            ));
        }
        let (component_type, normalized) = (accessor.component_type, accessor.normalized);
        let component =
            component_size(component_type).filter(|_| component_type != UNSIGNED_INT).ok_or_else(|| {
                self.error(
                    what,
                    format!("accessor {index} has componentType {component_type}, not a vertex's"),
                )
            })?;
        let decode = |bytes: &[u8]| -> [f32; N] {
            std::array::from_fn(|c| {
                to_f32(&bytes[c * component..(c + 1) * component], component_type, normalized)
            })
        };

        let count = self.count(index, what)?;
        let mut out: Vec<[f32; N]> = match accessor.buffer_view {
            Some(view) => {
                let elements =
                    self.elements(view, accessor.byte_offset, count, component * N, true, what, index)?;
                elements.iter().map(decode).collect()
            }
            None => vec![[0.0; N]; count],
        };
        if let Some(sparse) = &accessor.sparse {
            let targets = self.sparse_indices(index, what)?;
            let values = self.elements(
                sparse.values.buffer_view,
                sparse.values.byte_offset,
                targets.len(),
                component * N,
                false,
                what,
                index,
            )?;
            for (target, value) in targets.into_iter().zip(values.iter()) {
                out[target] = decode(value);
            }
        }
        if let Some(at) = out.iter().position(|element| element.iter().any(|x| !x.is_finite())) {
            return Err(self.error(
                what,
                format!(
                    "element {at} of accessor {index} is {:?}; every component must be a finite number",
                    out[at]
                ),
            ));
        }
        Ok(out)
    }

    /// RGB or RGBA colours, alpha one where the accessor has none.
    pub(crate) fn colors(&mut self, index: usize, what: &str) -> Result<Vec<[f32; 4]>, Error> {
        if self.accessor(index, what)?.kind == "VEC3" {
            let rgb = self.floats::<3>(index, what)?;
            return Ok(rgb.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect());
        }
        self.floats::<4>(index, what)
    }

    /// Vertex indices.
    pub(crate) fn indices(&mut self, index: usize, what: &str) -> Result<Vec<u32>, Error> {
        let accessor = self.accessor(index, what)?;
        if accessor.kind != "SCALAR" {
            return Err(
                self.error(what, format!("accessor {index} has type \"{}\", not SCALAR", accessor.kind))
            );
        }
        let size = self.index_size(accessor.component_type, index, what)?;
        let count = self.count(index, what)?;
        let mut out: Vec<u32> = match accessor.buffer_view {
            Some(view) => {
                let elements = self.elements(view, accessor.byte_offset, count, size, true, what, index)?;
                elements.iter().map(to_u32).collect()
            }
            None => vec![0; count],
        };
        if let Some(sparse) = &accessor.sparse {
            let targets = self.sparse_indices(index, what)?;
            let values = self.elements(
                sparse.values.buffer_view,
                sparse.values.byte_offset,
                targets.len(),
                size,
                false,
                what,
                index,
            )?;
            for (target, value) in targets.into_iter().zip(values.iter()) {
                out[target] = to_u32(value);
            }
        }
        Ok(out)
    }

    /// The elements that a sparse accessor replaces, each below its count.
    fn sparse_indices(&self, index: usize, what: &str) -> Result<Vec<usize>, Error> {
        let accessor = self.accessor(index, what)?;
        let Some(sparse) = &accessor.sparse else { return Ok(Vec::new()) };
        if sparse.count > accessor.count {
            return Err(self.error(
                what,
                format!("accessor {index} has {} elements and replaces {}", accessor.count, sparse.count),
            ));
        }
        let size = self.index_size(sparse.indices.component_type, index, what)?;
        let elements = self.elements(
            sparse.indices.buffer_view,
            sparse.indices.byte_offset,
            sparse.count as usize,
            size,
            false,
            what,
            index,
        )?;
        let targets: Vec<usize> = elements.iter().map(|bytes| to_u32(bytes) as usize).collect();
        match targets.iter().find(|&&target| target as u64 >= accessor.count) {
            Some(target) => Err(self.error(
                what,
                format!("accessor {index} has {} elements and replaces number {target}", accessor.count),
            )),
            None => Ok(targets),
        }
    }

    fn accessor(&self, index: usize, what: &str) -> Result<&'a Accessor, Error> {
        let root: &'a Root = self.root;
        root.accessors.get(index).ok_or_else(|| self.error(what, format!("accessor {index} does not exist")))
    }

    /// The accessor's element count, paid for out of the document's allowance.
    fn count(&mut self, index: usize, what: &str) -> Result<usize, Error> {
        let count = self.accessor(index, what)?.count;
        self.remaining = self.remaining.checked_sub(count).ok_or_else(|| {
            self.error(
                what,
                format!(
                    "accessor {index} claims {count} elements; the document as a whole claims more than its \
                     bytes can hold, and more than {SHARED_ELEMENTS_MAX} by sharing them"
                ),
            )
        })?;
        usize::try_from(count).map_err(|_| self.error(what, format!("accessor {index} has {count} elements")))
    }

    /// `count` elements of `size` bytes in a view. Only vertex and index data is strided (`strided`), the
    /// parts of a sparse accessor never are.
    #[expect(clippy::too_many_arguments, reason = "one private function with the fields of an accessor")]
    fn elements(
        &self,
        view: usize,
        offset: u64,
        count: usize,
        size: usize,
        strided: bool,
        what: &str,
        accessor: usize,
    ) -> Result<Elements<'a>, Error> {
        let bytes = self.view(view, what)?;
        let stride = match self.root.buffer_views[view].byte_stride {
            Some(stride) if strided => stride,
            _ => size as u64,
        };
        if stride < size as u64 {
            return Err(self.error(
                what,
                format!("bufferView {view} has byteStride {stride}, less than accessor {accessor}'s element of {size} bytes"),
            ));
        }
        let length = match (count as u64).checked_sub(1) {
            Some(steps) => stride.checked_mul(steps).and_then(|bytes| bytes.checked_add(size as u64)),
            None => Some(0),
        };
        let bytes = length.and_then(|length| slice(bytes, offset, length)).ok_or_else(|| {
            self.error(
                what,
                format!(
                    "accessor {accessor} claims {count} elements of {size} bytes, {stride} apart, from byte \
                     {offset} of bufferView {view}, which has {} bytes",
                    bytes.len()
                ),
            )
        })?;
        Ok(Elements { bytes, count, stride: stride as usize, size })
    }

    fn index_size(&self, component_type: u32, index: usize, what: &str) -> Result<usize, Error> {
        match component_type {
            UNSIGNED_BYTE => Ok(1),
            UNSIGNED_SHORT => Ok(2),
            UNSIGNED_INT => Ok(4),
            _ => Err(self.error(
                what,
                format!("accessor {index} has indices of componentType {component_type}; 5121, 5123 or 5125 are allowed"),
            )),
        }
    }

    fn error(&self, what: &str, reason: String) -> Error {
        Error::malformed(self.name, format!("{what}: {reason}"))
    }
}

/// `length` bytes from `offset`, if they are all there.
fn slice(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let end = offset.checked_add(length)?;
    bytes.get(usize::try_from(offset).ok()?..usize::try_from(end).ok()?)
}

fn components(kind: &str) -> Option<usize> {
    match kind {
        "SCALAR" => Some(1),
        "VEC2" => Some(2),
        "VEC3" => Some(3),
        "VEC4" => Some(4),
        "MAT4" => Some(16),
        _ => None,
    }
}

fn component_size(component_type: u32) -> Option<usize> {
    match component_type {
        BYTE | UNSIGNED_BYTE => Some(1),
        SHORT | UNSIGNED_SHORT => Some(2),
        UNSIGNED_INT | FLOAT => Some(4),
        _ => None,
    }
}

/// One component; the conversions of section 3.6.2.2 when normalised, where the most negative integer
/// means -1 like its neighbour.
fn to_f32(bytes: &[u8], component_type: u32, normalized: bool) -> f32 {
    let (value, largest) = match (component_type, bytes) {
        (BYTE, &[a]) => (f32::from(a as i8), 127.0),
        (UNSIGNED_BYTE, &[a]) => (f32::from(a), 255.0),
        (SHORT, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])), 32767.0),
        (UNSIGNED_SHORT, &[a, b]) => (f32::from(u16::from_le_bytes([a, b])), 65535.0),
        (FLOAT, &[a, b, c, d]) => return f32::from_le_bytes([a, b, c, d]),
        _ => unreachable!("component_size() has admitted componentType {component_type}"),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}

fn to_u32(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
}
