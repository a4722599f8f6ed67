//! Wavefront OBJ, as the glTF that it says the same as.

use std::collections::HashMap;
use std::path::Path;

use serde_json::{Value, json};

use crate::Error;

/// Whether an OBJ names a library of materials, which is not read.
pub(crate) fn names_materials(text: &[u8]) -> bool {
    text.split(|byte| *byte == b'\n').any(|line| line.trim_ascii_start().starts_with(b"mtllib "))
}

/// Vertices and faces of an OBJ as `.glb`: polygons in triangles, a primitive for each object or group, one grey material.
/// Faces with and without normals or UVs are primitives of their own. Lines, points, curves and material libraries are not
/// read. OBJ knows no unit; what reads the glTF takes metres.
///
/// # Errors
/// [`Error::Malformed`] where a line is none of the format, or there are no faces.
pub(crate) fn glb_from_obj(name: &Path, text: &[u8]) -> Result<Vec<u8>, Error> {
    let meshes = parse(text).map_err(|(line, reason)| {
        Error::malformed(name, format!("line {line}: {reason}; export the OBJ anew"))
    })?;
    let mut file = Parts::default();
    let primitives: Vec<Value> = meshes.iter().map(|mesh| file.primitive(mesh)).collect();
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

/// Triangles whose corners all have the same attributes.
#[derive(Default)]
struct Mesh {
    positions: Vec<f32>,
    /// Empty where corners have none.
    uvs: Vec<f32>,
    /// Empty where corners have none.
    normals: Vec<f32>,
    indices: Vec<u32>,
    /// The vertex of a `v/vt/vn`.
    vertices: HashMap<[Option<usize>; 3], u32>,
}

/// The faces of an OBJ, and else the number of a line and what is wrong there.
fn parse(text: &[u8]) -> Result<Vec<Mesh>, (usize, String)> {
    let (mut positions, mut uvs, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    let mut meshes: Vec<Mesh> = Vec::new();
    // Meshes of the group that is read, by whether they have UVs and normals.
    let mut group: HashMap<[bool; 2], usize> = HashMap::new();
    for (number, line) in lines(text) {
        let at = |reason: String| (number, reason);
        // Comments and names may be in any encoding.
        let line = String::from_utf8_lossy(&line);
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => positions.push(numbers::<3>(words, "v").map_err(at)?),
            Some("vt") => uvs.push(numbers::<2>(words, "vt").map_err(at)?),
            Some("vn") => normals.push(numbers::<3>(words, "vn").map_err(at)?),
            Some("o" | "g") => group.clear(),
            Some("f") => {
                let counts = [positions.len(), uvs.len(), normals.len()];
                let corners: Result<Vec<_>, String> = words.map(|word| corner(word, counts)).collect();
                let mut corners = corners.map_err(at)?;
                if corners.len() < 3 {
                    return Err(at(format!("a face of {} corners", corners.len())));
                }
                let has = [1, 2].map(|part| corners.iter().all(|corner| corner[part].is_some()));
                let mesh = *group.entry(has).or_insert_with(|| {
                    meshes.push(Mesh::default());
                    meshes.len() - 1
                });
                let mesh = &mut meshes[mesh];
                for corner in &mut corners {
                    // What only some corners of a face have is not there.
                    corner[1] = corner[1].filter(|_| has[0]);
                    corner[2] = corner[2].filter(|_| has[1]);
                }
                let face: Vec<u32> = (corners.into_iter())
                    .map(|corner| {
                        *mesh.vertices.entry(corner).or_insert_with(|| {
                            let [v, vt, vn] = corner;
                            mesh.positions.extend(v.iter().flat_map(|&v| positions[v]));
                            // OBJ counts v from below.
                            mesh.uvs.extend(vt.iter().flat_map(|&vt| [uvs[vt][0], 1.0 - uvs[vt][1]]));
                            mesh.normals.extend(vn.iter().flat_map(|&vn| normals[vn]));
                            (mesh.positions.len() / 3 - 1) as u32
                        })
                    })
                    .collect();
                for pair in face[1..].windows(2) {
                    mesh.indices.extend([face[0], pair[0], pair[1]]);
                }
            }
            _ => {}
        }
    }
    Ok(meshes)
}

/// Lines without their comments, each with the number of its first one; a backslash at the end joins the next, but not in a
/// comment, which may end with the name of a folder.
fn lines(text: &[u8]) -> impl Iterator<Item = (usize, Vec<u8>)> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let mut lines = text.split(|&byte| byte == b'\n').enumerate();
    std::iter::from_fn(move || {
        let (number, mut line) = lines.next()?;
        let mut whole = Vec::new();
        loop {
            let end = line.iter().position(|&byte| byte == b'#').unwrap_or(line.len());
            match line[..end].trim_ascii_end().strip_suffix(b"\\") {
                Some(part) => {
                    whole.extend(part);
                    whole.push(b' ');
                }
                None => {
                    whole.extend(&line[..end]);
                    break;
                }
            }
            let Some((_, next)) = lines.next() else { break };
            line = next;
        }
        Some((number + 1, whole))
    })
}

/// The first numbers of a line; more may follow, such as colours of vertices.
fn numbers<'a, const N: usize>(
    mut words: impl Iterator<Item = &'a str>,
    what: &str,
) -> Result<[f32; N], String> {
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        let word = words.next().ok_or_else(|| format!("a {what} line has fewer than {N} numbers"))?;
        *number = word.parse().map_err(|_| format!("a {what} line has \"{word}\" for a number"))?;
    }
    Ok(numbers)
}

/// Indices of a face's corner from 0, of `v`, `v/vt`, `v//vn` or `v/vt/vn`; negative ones count from the end of what was
/// read so far.
fn corner(word: &str, counts: [usize; 3]) -> Result<[Option<usize>; 3], String> {
    let mut corner = [None; 3];
    for (i, (part, count)) in word.split('/').zip(counts).enumerate() {
        if part.is_empty() && i > 0 {
            continue;
        }
        let name = ["v", "vt", "vn"][i];
        let index: i64 = part.parse().map_err(|_| format!("a face has \"{word}\" for a corner"))?;
        let from_zero = if index < 0 { count as i64 + index } else { index - 1 };
        let within = usize::try_from(from_zero).ok().filter(|&index| index < count);
        corner[i] =
            Some(within.ok_or_else(|| format!("a face names {name} {index}, and there are {count}"))?);
    }
    Ok(corner)
}

/// What primitives are made of.
#[derive(Default)]
struct Parts {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Parts {
    fn primitive(&mut self, mesh: &Mesh) -> Value {
        let mut attributes = json!({ "POSITION": self.floats(&mesh.positions, 3) });
        if !mesh.normals.is_empty() {
            attributes["NORMAL"] = self.floats(&mesh.normals, 3).into();
        }
        if !mesh.uvs.is_empty() {
            attributes["TEXCOORD_0"] = self.floats(&mesh.uvs, 2).into();
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
