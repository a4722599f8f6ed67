//! Geometry that is compressed by `KHR_draco_mesh_compression` or a meshopt extension, as plain buffer views.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::Path;

use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute, PointIndex};
use kinran_image::Tick;
use serde_json::{Map, Value, json};

use crate::{Error, meshopt};

const DRACO: &str = "KHR_draco_mesh_compression";
const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Bytes that a document's geometry may have: 64 MiB, and 128 for each byte of its compressed form. The best that meshopt
/// and Draco make of meshes in use is about a fiftieth.
const BYTES_FREE: usize = 64 << 20;
const BYTES_PER_BYTE: usize = 128;

/// Gives the bytes of a buffer.
type Buffers<'a> = &'a dyn Fn(usize) -> Result<Cow<'a, [u8]>, Error>;

/// Geometry of a document that was compressed.
pub(crate) struct Plain {
    /// The bytes of the buffer that was added, the last of the document's.
    pub(crate) bytes: Vec<u8>,
    /// Buffer, first byte and length of what the document needs no longer.
    pub(crate) freed: Vec<(usize, usize, usize)>,
}

/// Whether any geometry of a document is compressed, by its `extensionsUsed`.
pub(crate) fn is_compressed<'a>(mut used: impl Iterator<Item = &'a str>) -> bool {
    used.any(|name| name == DRACO || MESHOPT.contains(&name))
}

/// Replaces compressed geometry by buffer views of one more buffer, and takes the extensions out of the document. `tick` is
/// told of no units.
pub(crate) fn decompress<'a>(
    name: &'a Path,
    json: &mut Map<String, Value>,
    buffer: Buffers<'a>,
    tick: &'a Tick<'a>,
) -> Result<Plain, Error> {
    let count = list(json, "buffers").len();
    let mut work = Work {
        name,
        buffer,
        tick,
        added: count,
        compressed: 0,
        emptied: BTreeSet::new(),
        free: None,
        plain: Plain { bytes: Vec::new(), freed: Vec::new() },
    };
    work.views(json)?;
    work.primitives(json)?;
    for key in ["extensionsUsed", "extensionsRequired"] {
        let Some(names) = json.get_mut(key).and_then(Value::as_array_mut) else { continue };
        names.retain(|name| name != DRACO && MESHOPT.iter().all(|meshopt| name != *meshopt));
        if names.is_empty() {
            json.shift_remove(key);
        }
    }
    for buffer in list_mut(json, "buffers") {
        MESHOPT.iter().for_each(|name| drop(take_extension(buffer, name)));
    }
    let length = work.plain.bytes.len();
    list_mut(json, "buffers").push(json!({ "byteLength": length }));
    Ok(work.plain)
}

struct Work<'a> {
    name: &'a Path,
    buffer: Buffers<'a>,
    tick: &'a Tick<'a>,
    /// Index of the buffer that is added.
    added: usize,
    /// Compressed bytes that were read.
    compressed: usize,
    /// Buffer views of Draco streams that were read, and one of them that is free for other bytes.
    emptied: BTreeSet<usize>,
    free: Option<usize>,
    plain: Plain,
}

impl Work<'_> {
    fn error(&self, reason: impl Into<String>) -> Error {
        Error::malformed(self.name, reason)
    }

    /// Bytes that a part of `compressed` bytes may become.
    fn room(&self, compressed: usize) -> usize {
        let all = self.compressed.saturating_add(compressed).saturating_mul(BYTES_PER_BYTE);
        BYTES_FREE.saturating_add(all).saturating_sub(self.plain.bytes.len())
    }

    fn too_much(&self, compressed: usize, what: &str) -> Error {
        self.error(format!(
            "{what}: its {compressed} bytes claim to hold more than geometry can; export it anew"
        ))
    }

    /// A part of a buffer, `None` where it is not there.
    fn part(&self, place: &Map<String, Value>, what: &str) -> Result<Vec<u8>, Error> {
        let (buffer, start, length) = self.place(place, what)?;
        let bytes = (self.buffer)(buffer)?;
        let part = start.checked_add(length).and_then(|end| bytes.get(start..end));
        part.map(<[u8]>::to_vec).ok_or_else(|| {
            self.error(format!(
                "{what}: bytes {start} and {length} more of buffer {buffer}, which has {}",
                bytes.len()
            ))
        })
    }

    fn place(&self, place: &Map<String, Value>, what: &str) -> Result<(usize, usize, usize), Error> {
        let number = |key: &str| place.get(key).map_or(Some(0), index);
        match (place.get("buffer").and_then(index), number("byteOffset"), number("byteLength")) {
            (Some(buffer), Some(start), Some(length)) => Ok((buffer, start, length)),
            _ => Err(self.error(format!("{what}: its buffer, byteOffset or byteLength is no index"))),
        }
    }

    /// Adds bytes; gives where they begin.
    fn add(&mut self, bytes: &[u8]) -> usize {
        let start = self.plain.bytes.len().next_multiple_of(4);
        self.plain.bytes.resize(start, 0);
        self.plain.bytes.extend_from_slice(bytes);
        start
    }

    fn views(&mut self, json: &mut Map<String, Value>) -> Result<(), Error> {
        for i in 0..list(json, "bufferViews").len() {
            let view = &mut list_mut(json, "bufferViews")[i];
            let Some(extension) = MESHOPT.iter().find_map(|name| take_extension(view, name)) else {
                continue;
            };
            let what = format!("bufferView {i}: meshopt compression");
            let Some(extension) = extension.as_object() else {
                return Err(self.error(format!("{what}: is no object")));
            };
            let bytes = self.view(extension, &what)?;
            (self.tick)(0)?;
            let (buffer, start, length) = self.place(extension, &what)?;
            self.plain.freed.push((buffer, start, length));
            self.compressed += length;
            let start = self.add(&bytes);
            if let Some(view) = view.as_object_mut() {
                view.insert("buffer".into(), self.added.into());
                view.insert("byteOffset".into(), start.into());
                view.insert("byteLength".into(), bytes.len().into());
            }
        }
        Ok(())
    }

    /// A buffer view's bytes.
    fn view(&self, extension: &Map<String, Value>, what: &str) -> Result<Vec<u8>, Error> {
        let number = |key: &str| {
            let value = extension.get(key).and_then(index);
            value.ok_or_else(|| self.error(format!("{what}: there is no {key}")))
        };
        let (count, stride) = (number("count")?, number("byteStride")?);
        let data = self.part(extension, what)?;
        if count.checked_mul(stride).is_none_or(|size| size > self.room(data.len())) {
            return Err(self.too_much(data.len(), what));
        }
        let text = |key: &str, default| extension.get(key).map_or(Some(default), Value::as_str).unwrap_or("");
        let decoded = match text("mode", "") {
            "ATTRIBUTES" => meshopt::attributes(&data, count, stride).and_then(|mut bytes| {
                meshopt::unfilter(text("filter", "NONE"), &mut bytes, stride)?;
                Ok(bytes)
            }),
            "TRIANGLES" => meshopt::triangles(&data, count).and_then(|all| index_bytes(&all, stride)),
            "INDICES" => meshopt::indices(&data, count).and_then(|all| index_bytes(&all, stride)),
            _ => Err("it has an unknown mode"),
        };
        decoded.map_err(|reason| self.error(format!("{what}: {reason}; export it anew")))
    }

    fn primitives(&mut self, json: &mut Map<String, Value>) -> Result<(), Error> {
        let views: Vec<Map<String, Value>> = list(json, "bufferViews")
            .iter()
            .map(|view| view.as_object().cloned().unwrap_or_default())
            .collect();
        for m in 0..list(json, "meshes").len() {
            let count =
                list(json, "meshes")[m].get("primitives").and_then(Value::as_array).map_or(0, Vec::len);
            for p in 0..count {
                let primitive = &mut list_mut(json, "meshes")[m]["primitives"][p];
                let Some(extension) = take_extension(primitive, DRACO) else { continue };
                (self.tick)(0)?;
                let primitive = primitive.clone();
                let what = format!("mesh {m}, primitive {p}: {DRACO}");
                self.primitive(json, &primitive, &extension, &views, &what)?;
            }
        }
        Ok(())
    }

    fn primitive(
        &mut self,
        json: &mut Map<String, Value>,
        primitive: &Value,
        extension: &Value,
        views: &[Map<String, Value>],
        what: &str,
    ) -> Result<(), Error> {
        let number = extension.get("bufferView").and_then(index);
        let view = number.and_then(|view| views.get(view));
        let view = view.ok_or_else(|| self.error(format!("{what}: its bufferView does not exist")))?;
        self.free = number.filter(|&view| self.emptied.insert(view));
        let data = self.part(view, what)?;
        let left = self.room(data.len());
        // A face is three indices of four bytes.
        let limits = DecodeLimits::default()
            .with_max_decoded_bytes(left as u64)
            .with_max_faces(left as u64 / 12)
            .with_max_points(left as u64 / 4);
        let mut mesh = Mesh::new();
        MeshDecoder::new()
            .decode(&mut DecoderBuffer::new(&data).with_limits(limits), &mut mesh)
            .map_err(|error| self.error(format!("{what}: {error}; export it anew")))?;
        let points = mesh.num_points();
        // The decoder does not look at the limit of a mesh's points.
        if points > left / 4 {
            return Err(self.too_much(data.len(), what));
        }

        let attributes = primitive.get("attributes").and_then(Value::as_object);
        let ids = extension.get("attributes").and_then(Value::as_object);
        for (name, id) in ids.into_iter().flatten() {
            let accessor = attributes.and_then(|attributes| attributes.get(name)).and_then(index);
            let id = index(id).and_then(|id| u32::try_from(id).ok());
            let (Some(accessor), Some(id)) = (accessor, id) else {
                return Err(self.error(format!("{what}: its attribute {name} is none of the primitive's")));
            };
            let Some(attribute) = mesh.attribute_by_unique_id(id) else {
                return Err(
                    self.error(format!("{what}: {name} is attribute {id}, which its stream does not have"))
                );
            };
            let entry = list(json, "accessors").get(accessor);
            let component = entry.and_then(|entry| entry.get("componentType")?.as_u64());
            if component != component_type(attribute.data_type()) {
                return Err(self.error(format!(
                    "{what}: {name} is held as {:?}, and its accessor says otherwise",
                    attribute.data_type()
                )));
            }
            let bytes = attribute_bytes(attribute, points);
            self.set(json, accessor, &bytes, points, what)?;
        }
        if let Some(accessor) = primitive.get("indices").and_then(index) {
            let corners: Vec<u32> = mesh.faces().iter().flatten().map(|point| point.0).collect();
            let width =
                list(json, "accessors").get(accessor).and_then(|entry| entry.get("componentType")?.as_u64());
            let bytes = match width {
                Some(5121) => corners.iter().map(|&i| i as u8).collect(),
                Some(5123) => index_bytes(&corners, 2).unwrap_or_default(),
                _ => index_bytes(&corners, 4).unwrap_or_default(),
            };
            self.set(json, accessor, &bytes, corners.len(), what)?;
        }
        self.plain.freed.push(self.place(view, what)?);
        self.compressed += data.len();
        Ok(())
    }

    /// Gives an accessor `count` elements in bytes of its own.
    fn set(
        &mut self,
        json: &mut Map<String, Value>,
        accessor: usize,
        bytes: &[u8],
        count: usize,
        what: &str,
    ) -> Result<(), Error> {
        let (start, added) = (self.add(bytes), self.added);
        let views = list_mut(json, "bufferViews");
        let place = json!({ "buffer": added, "byteOffset": start, "byteLength": bytes.len() });
        let view = match self.free.take() {
            Some(view) => {
                views[view] = place;
                view
            }
            None => {
                views.push(place);
                views.len() - 1
            }
        };
        let Some(entry) = list_mut(json, "accessors").get_mut(accessor).and_then(Value::as_object_mut) else {
            return Err(self.error(format!("{what}: accessor {accessor} does not exist")));
        };
        entry.insert("bufferView".into(), view.into());
        entry.insert("count".into(), count.into());
        entry.shift_remove("byteOffset");
        entry.shift_remove("sparse");
        Ok(())
    }
}

/// `componentType` of what Draco holds.
fn component_type(data: DataType) -> Option<u64> {
    Some(match data {
        DataType::Int8 => 5120,
        DataType::Uint8 => 5121,
        DataType::Int16 => 5122,
        DataType::Uint16 => 5123,
        DataType::Uint32 => 5125,
        DataType::Float32 => 5126,
        _ => return None,
    })
}

/// An attribute's element for each point, one after the other.
fn attribute_bytes(attribute: &PointAttribute, points: usize) -> Vec<u8> {
    let size = usize::from(attribute.num_components()) * attribute.data_type().byte_length();
    let stride = attribute.byte_stride().max(0) as usize;
    let data = attribute.buffer().data();
    let mut bytes = vec![0; points * size];
    for (point, out) in bytes.chunks_exact_mut(size.max(1)).enumerate() {
        let value = attribute.mapped_index(PointIndex(point as u32)).0 as usize;
        let held = value.checked_mul(stride).and_then(|start| data.get(start..)?.get(..size));
        if let Some(held) = held {
            out.copy_from_slice(held);
        }
    }
    bytes
}

fn index_bytes(indices: &[u32], width: usize) -> Result<Vec<u8>, &'static str> {
    match width {
        2 => Ok(indices.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect()),
        4 => Ok(indices.iter().flat_map(|i| i.to_le_bytes()).collect()),
        _ => Err("its byteStride is neither 2 nor 4"),
    }
}

/// Takes an extension out of an object, and the list with its last one.
fn take_extension(object: &mut Value, name: &str) -> Option<Value> {
    let extensions = object.get_mut("extensions")?.as_object_mut()?;
    let taken = extensions.shift_remove(name);
    if extensions.is_empty() {
        object.as_object_mut()?.shift_remove("extensions");
    }
    taken
}

fn index(value: &Value) -> Option<usize> {
    usize::try_from(value.as_u64()?).ok()
}

fn list<'a>(json: &'a Map<String, Value>, key: &str) -> &'a [Value] {
    json.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn list_mut<'a>(json: &'a mut Map<String, Value>, key: &str) -> &'a mut Vec<Value> {
    let value = json.entry(key).or_insert_with(|| Value::Array(Vec::new()));
    if !value.is_array() {
        *value = Value::Array(Vec::new());
    }
    value.as_array_mut().expect("made a list above")
}
