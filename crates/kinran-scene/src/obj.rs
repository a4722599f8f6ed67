//! Wavefront OBJ, as the glTF that it says the same as.

use std::path::Path;

use serde_json::{Value, json};
use tobj::{LoadError, LoadOptions, Model};

use crate::Error;

/// Vertices and faces of an OBJ as `.glb`: polygons in triangles, a primitive for each object or group, one grey material.
/// Material libraries are not read. OBJ knows no unit; what reads the glTF takes metres.
///
/// # Errors
/// [`Error::Malformed`] where a line is none of the format, or there are no faces.
pub(crate) fn glb_from_obj(name: &Path, mut text: &[u8]) -> Result<Vec<u8>, Error> {
    let options = LoadOptions { single_index: true, triangulate: true, ..LoadOptions::default() };
    let (models, _) = tobj::load_obj_buf(&mut text, &options, |_| Ok(Default::default()))
        .map_err(|e| Error::malformed(name, format!("{}; export the OBJ anew", reason(&e))))?;
    let mut file = Parts::default();
    let primitives: Vec<Value> =
        models.iter().filter(|m| !m.mesh.indices.is_empty()).map(|m| file.primitive(m)).collect();
    if primitives.is_empty() {
        return Err(Error::malformed(name, "the OBJ has no faces; export the mesh with them"));
    }
    let document = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "materials": [{
            "name": "grey",
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.6, 0.6, 0.6, 1.0], "metallicFactor": 0, "roughnessFactor": 0.6
            },
        }],
        "meshes": [{ "primitives": primitives }],
        "accessors": file.accessors,
        "bufferViews": file.views,
        "buffers": [{ "byteLength": file.binary.len() }],
    });
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = 28 + json.len() + file.binary.len();
    let mut glb = Vec::with_capacity(length);
    let word = |glb: &mut Vec<u8>, number: usize| {
        let number = u32::try_from(number).map_err(|_| Error::malformed(name, "is larger than 4 GiB"))?;
        glb.extend(number.to_le_bytes());
        Ok::<_, Error>(())
    };
    glb.extend(b"glTF");
    word(&mut glb, 2)?;
    word(&mut glb, length)?;
    word(&mut glb, json.len())?;
    glb.extend(b"JSON");
    glb.extend(json);
    word(&mut glb, file.binary.len())?;
    glb.extend(b"BIN\0");
    glb.extend(file.binary);
    Ok(glb)
}

fn reason(error: &LoadError) -> &'static str {
    match error {
        LoadError::PositionParseError => "a v line has no three numbers",
        LoadError::NormalParseError => "a vn line has no three numbers",
        LoadError::TexcoordParseError => "a vt line has no two numbers",
        LoadError::FaceVertexOutOfBounds => "a face names a v that is not there",
        LoadError::FaceTexCoordOutOfBounds => "a face names a vt that is not there",
        LoadError::FaceNormalOutOfBounds => "a face names a vn that is not there",
        LoadError::FaceParseError => "an f line is no face",
        _ => "it is no OBJ",
    }
}

/// What primitives are made of.
#[derive(Default)]
struct Parts {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Parts {
    fn primitive(&mut self, model: &Model) -> Value {
        let mesh = &model.mesh;
        let mut attributes = json!({ "POSITION": self.floats(&mesh.positions, 3) });
        if !mesh.normals.is_empty() {
            attributes["NORMAL"] = self.floats(&mesh.normals, 3).into();
        }
        if !mesh.texcoords.is_empty() {
            // OBJ counts v from below.
            let uvs: Vec<f32> = mesh.texcoords.chunks_exact(2).flat_map(|t| [t[0], 1.0 - t[1]]).collect();
            attributes["TEXCOORD_0"] = self.floats(&uvs, 2).into();
        }
        let indices = mesh.indices.iter().flat_map(|i| i.to_le_bytes());
        let indices = self.accessor(
            indices,
            json!({
                "componentType": 5125, "count": mesh.indices.len(), "type": "SCALAR"
            }),
        );
        json!({ "attributes": attributes, "indices": indices, "material": 0 })
    }

    fn floats(&mut self, numbers: &[f32], width: usize) -> usize {
        let accessor = json!({
            "componentType": 5126, "count": numbers.len() / width, "type": format!("VEC{width}")
        });
        self.accessor(numbers.iter().flat_map(|x| x.to_le_bytes()), accessor)
    }

    fn accessor(&mut self, bytes: impl Iterator<Item = u8>, mut accessor: Value) -> usize {
        let start = self.binary.len();
        self.binary.extend(bytes);
        let length = self.binary.len() - start;
        accessor["bufferView"] = self.views.len().into();
        self.views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": length }));
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
}
