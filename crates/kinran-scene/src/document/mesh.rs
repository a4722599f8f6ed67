//! New vertex attributes in a document, and primitives with other vertices.

use glam::{Vec3, Vec4};
use serde_json::{Value, json};

use super::{Document, Object, View, array, array_mut, index, object_mut};
use crate::Error;

const UNSIGNED_BYTE: u64 = 5121;
const UNSIGNED_SHORT: u64 = 5123;
const UNSIGNED_INT: u64 = 5125;
const FLOAT: u64 = 5126;

/// `bufferView.target` of vertices and of indices.
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A vertex attribute's data, an element for each vertex of its primitive.
#[derive(Clone, Copy, Debug)]
pub enum Attribute<'a> {
    /// Three floats.
    Float3(&'a [Vec3]),
    /// Four floats.
    Float4(&'a [Vec4]),
    /// Four bytes, 255 is one.
    Byte4(&'a [[u8; 4]]),
}

impl Document {
    /// Sets a vertex attribute of a primitive, in bytes of its own.
    ///
    /// # Panics
    /// When there is no such primitive.
    pub fn set_attribute(&mut self, mesh: usize, primitive: usize, name: &str, data: Attribute<'_>) {
        let (bytes, count, component, kind, normalized): (Vec<u8>, _, _, _, _) = match data {
            Attribute::Float3(v) => {
                let bytes = v.iter().flat_map(|v| v.to_array()).flat_map(f32::to_le_bytes).collect();
                (bytes, v.len(), FLOAT, "VEC3", false)
            }
            Attribute::Float4(v) => {
                let bytes = v.iter().flat_map(|v| v.to_array()).flat_map(f32::to_le_bytes).collect();
                (bytes, v.len(), FLOAT, "VEC4", false)
            }
            Attribute::Byte4(v) => (v.as_flattened().to_vec(), v.len(), UNSIGNED_BYTE, "VEC4", true),
        };
        let view = self.add_view(&bytes, ARRAY_BUFFER);
        let mut accessor =
            json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
        if normalized {
            accessor["normalized"] = true.into();
        }
        let accessor = self.add_accessor(accessor);
        let primitive = self.primitive_mut(mesh, primitive);
        object_mut(primitive, "attributes").insert(name.into(), accessor.into());
    }

    /// A primitive's JSON, to set its extensions.
    ///
    /// # Panics
    /// When there is no such primitive.
    pub fn primitive_mut(&mut self, mesh: usize, primitive: usize) -> &mut Object {
        array_mut(&mut self.json, "meshes")[mesh]
            .get_mut("primitives")
            .and_then(|primitives| primitives.get_mut(primitive)?.as_object_mut())
            .expect("the caller names a primitive that the scene has")
    }

    /// Gives a primitive other vertices: `vertices` names the old vertex of each new one, `triangles` names new vertices. All
    /// attributes and morph targets follow; the old bytes stay for whoever else uses them.
    ///
    /// # Errors
    /// Where an accessor points nowhere.
    ///
    /// # Panics
    /// When there is no such primitive.
    pub fn gather_vertices(
        &mut self,
        mesh: usize,
        primitive: usize,
        vertices: &[u32],
        triangles: &[[u32; 3]],
    ) -> Result<(), Error> {
        let mut object = self.primitive_mut(mesh, primitive).clone();
        let mut lists: Vec<Object> = vec![object.get("attributes").and_then(Value::as_object).cloned()]
            .into_iter()
            .flatten()
            .collect();
        let targets = object.get("targets").and_then(Value::as_array).into_iter().flatten();
        lists.extend(targets.filter_map(|target| target.as_object().cloned()));
        for list in &mut lists {
            for (_, accessor) in list.iter_mut() {
                let Some(old) = index(accessor) else { continue };
                *accessor = self.gather_accessor(old, vertices)?.into();
            }
        }
        let mut lists = lists.into_iter();
        if let Some(attributes) = lists.next() {
            object.insert("attributes".into(), attributes.into());
        }
        let targets: Vec<Value> = lists.map(Value::from).collect();
        if !targets.is_empty() {
            object.insert("targets".into(), targets.into());
        }

        let flat = triangles.as_flattened();
        let short = vertices.len() < usize::from(u16::MAX);
        let bytes: Vec<u8> = if short {
            flat.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect()
        } else {
            flat.iter().flat_map(|i| i.to_le_bytes()).collect()
        };
        let view = self.add_view(&bytes, ELEMENT_ARRAY_BUFFER);
        let component = if short { UNSIGNED_SHORT } else { UNSIGNED_INT };
        let indices = self.add_accessor(
            json!({ "bufferView": view, "componentType": component, "count": flat.len(), "type": "SCALAR" }),
        );
        object.insert("indices".into(), indices.into());
        object.shift_remove("mode");
        *self.primitive_mut(mesh, primitive) = object;
        Ok(())
    }

    /// A new accessor with the named elements of an old one.
    fn gather_accessor(&mut self, old: usize, elements: &[u32]) -> Result<usize, Error> {
        let (bytes, size) = self.elements(old)?;
        let mut gathered = Vec::with_capacity(elements.len() * size.next_multiple_of(4));
        // Every vertex begins at a multiple of four bytes (glTF 2.0 section 3.6.2.4).
        let stride = size.next_multiple_of(4);
        for &element in elements {
            let start = element as usize * size;
            let element = bytes.get(start..start + size).ok_or_else(|| {
                Error::malformed(&self.path, format!("accessor {old} has no element {element}"))
            })?;
            gathered.extend_from_slice(element);
            gathered.resize(gathered.len().next_multiple_of(stride), 0);
        }
        let view = self.add_view(&gathered, ARRAY_BUFFER);
        if stride != size
            && let Some(view) = array_mut(&mut self.json, "bufferViews")[view].as_object_mut()
        {
            view.insert("byteStride".into(), stride.into());
        }
        let mut accessor = array(&self.json, "accessors")[old].clone();
        if let Some(object) = accessor.as_object_mut() {
            for key in ["byteOffset", "sparse", "name"] {
                object.shift_remove(key);
            }
            object.insert("bufferView".into(), view.into());
            object.insert("count".into(), elements.len().into());
            // Bounds of fewer elements may be tighter; only POSITION must have them, and its are floats or given back.
            if object.contains_key("min")
                && object.get("componentType").and_then(Value::as_u64) == Some(FLOAT)
            {
                let width = size / 4;
                let mut bounds = vec![[f32::INFINITY, f32::NEG_INFINITY]; width];
                for (i, float) in gathered.chunks_exact(4).enumerate() {
                    let x = f32::from_le_bytes([float[0], float[1], float[2], float[3]]);
                    let bound = &mut bounds[i % width];
                    *bound = [bound[0].min(x), bound[1].max(x)];
                }
                let side = |k: usize| Value::from(bounds.iter().map(|b| b[k]).collect::<Vec<f32>>());
                object.insert("min".into(), side(0));
                object.insert("max".into(), side(1));
            }
        }
        Ok(self.add_accessor(accessor))
    }

    /// An accessor's elements, tightly packed, and the size of each.
    fn elements(&self, accessor: usize) -> Result<(Vec<u8>, usize), Error> {
        let fail = |reason: &str| Error::malformed(&self.path, format!("accessor {accessor} {reason}"));
        let object = array(&self.json, "accessors")
            .get(accessor)
            .and_then(Value::as_object)
            .ok_or_else(|| fail("does not exist"))?;
        let component = match object.get("componentType").and_then(Value::as_u64) {
            Some(5120 | UNSIGNED_BYTE) => 1,
            Some(5122 | UNSIGNED_SHORT) => 2,
            Some(UNSIGNED_INT | FLOAT) => 4,
            _ => return Err(fail("has no known componentType")),
        };
        let components = match object.get("type").and_then(Value::as_str) {
            Some("SCALAR") => 1,
            Some("VEC2") => 2,
            Some("VEC3") => 3,
            Some("VEC4") => 4,
            _ => return Err(fail("is no vertex attribute")),
        };
        let size = component * components;
        let count = object.get("count").and_then(index).unwrap_or(0);
        let mut packed = match object.get("bufferView").and_then(index) {
            Some(view) => self.strided(view, object, count, size, true)?,
            None => vec![0; count.checked_mul(size).ok_or_else(|| fail("claims too many elements"))?],
        };
        if let Some(sparse) = object.get("sparse").and_then(Value::as_object) {
            let part =
                |name: &str| sparse.get(name).and_then(Value::as_object).ok_or_else(|| fail("is damaged"));
            let (indices, values) = (part("indices")?, part("values")?);
            let replaced = sparse.get("count").and_then(index).unwrap_or(0);
            let width = match indices.get("componentType").and_then(Value::as_u64) {
                Some(UNSIGNED_BYTE) => 1,
                Some(UNSIGNED_SHORT) => 2,
                _ => 4,
            };
            let view =
                |part: &Object| part.get("bufferView").and_then(index).ok_or_else(|| fail("is damaged"));
            let targets = self.strided(view(indices)?, indices, replaced, width, false)?;
            let new = self.strided(view(values)?, values, replaced, size, false)?;
            for (target, new) in targets.chunks_exact(width).zip(new.chunks_exact(size)) {
                let target = target.iter().rev().fold(0usize, |value, &byte| value << 8 | usize::from(byte));
                let place = packed.get_mut(target * size..(target + 1) * size);
                place.ok_or_else(|| fail("replaces an element that it does not have"))?.copy_from_slice(new);
            }
        }
        Ok((packed, size))
    }

    fn strided(
        &self,
        view: usize,
        part: &Object,
        count: usize,
        size: usize,
        may_stride: bool,
    ) -> Result<Vec<u8>, Error> {
        let fail = || Error::malformed(&self.path, format!("bufferView {view} has too few bytes"));
        let entry = array(&self.json, "bufferViews").get(view).ok_or_else(fail)?;
        let place = View::read(entry).ok_or_else(fail)?;
        let stride = entry.get("byteStride").and_then(index).filter(|_| may_stride).unwrap_or(size);
        let offset = part.get("byteOffset").and_then(index).unwrap_or(0);
        let buffer = self.buffer(place.buffer)?;
        let end = place.offset.checked_add(place.length).ok_or_else(fail)?;
        let bytes = buffer.get(place.offset..end).and_then(|bytes| bytes.get(offset..)).ok_or_else(fail)?;
        let needed = count.checked_sub(1).map_or(Some(0), |n| n.checked_mul(stride)?.checked_add(size));
        if needed.is_none_or(|needed| needed > bytes.len()) {
            return Err(fail());
        }
        Ok((0..count).flat_map(|i| bytes[i * stride..i * stride + size].iter().copied()).collect())
    }

    /// Adds bytes to the buffer of additions, and a view of them.
    fn add_view(&mut self, bytes: &[u8], target: u32) -> usize {
        let (buffer, added) = self.added_buffer.get_or_insert_with(|| {
            let buffers = array_mut(&mut self.json, "buffers");
            buffers.push(json!({ "byteLength": 0 }));
            (buffers.len() - 1, Vec::new())
        });
        let offset = added.len().next_multiple_of(4);
        added.resize(offset, 0);
        added.extend_from_slice(bytes);
        let (buffer, length) = (*buffer, added.len());
        array_mut(&mut self.json, "buffers")[buffer]["byteLength"] = length.into();
        let views = array_mut(&mut self.json, "bufferViews");
        views.push(json!({
            "buffer": buffer, "byteOffset": offset, "byteLength": bytes.len(), "target": target
        }));
        views.len() - 1
    }

    fn add_accessor(&mut self, accessor: Value) -> usize {
        let accessors = array_mut(&mut self.json, "accessors");
        accessors.push(accessor);
        accessors.len() - 1
    }
}
