//! glTF scenes in and out.
//!
//! [`Scene`] is a flat, validated form of a glTF document: everything an index points at exists, all
//! vertex data is finite, every primitive has normals and tangents. [`Document`] is the document itself,
//! for tools that replace its textures and leave everything else as it was.
//!
//! ```
//! use kinran_scene::{Document, Scene};
//!
//! // A triangle, all in one file.
//! let gltf = br#"{
//!   "asset": { "version": "2.0" },
//!   "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
//!   "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
//!   "materials": [{ "name": "brass", "pbrMetallicRoughness": { "roughnessFactor": 0.4 } }],
//!   "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
//!                   "min": [0, 0, 0], "max": [1, 1, 0] }],
//!   "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
//!   "buffers": [{ "byteLength": 36, "uri":
//!     "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }]
//! }"#;
//! let nothing_beside_it = |_: &str| Err(std::io::ErrorKind::NotFound.into());
//! let scene = Scene::from_bytes("brass.gltf".as_ref(), gltf, &nothing_beside_it)?;
//! assert_eq!(scene.primitives[0].normals, [glam::Vec3::Z; 3], "normals are made where there are none");
//! assert_eq!(scene.materials[0].roughness_factor, 0.4);
//!
//! let mut document = Document::from_bytes("brass.gltf".as_ref(), gltf)?;
//! document.material_mut(0).insert("name".into(), "copper".into());
//! # Ok::<(), kinran_scene::Error>(())
//! ```

mod accessor;
mod compressed;
mod container;
mod detail;
mod document;
mod environment;
mod error;
mod frame;
mod fuzz;
mod json;
mod load;
mod meshopt;
mod obj;
mod scene;
mod studio;
mod tangent;
mod texture_ref;

pub use container::{glb, is_gltf};
pub use detail::{
    DETAIL_EXTENSION, DETAIL_LAYERS_MAX, Detail, DetailLayer, DetailMap, DetailMask, LayerTransform,
};
pub use document::{Attribute, Document, Object, Packed, Slot, TextureExtension};
pub use environment::Environment;
pub use error::Error;
pub use fuzz::{FUZZ_EXTENSION, Fuzz, FuzzAttenuation, FuzzDirection, FuzzLayer, FuzzPhase, SHEEN_MATCH};
pub use load::{Maps, Needs};
pub use scene::{
    AlphaMode, Anisotropy, Camera, Dielectric, DiffuseTransmission, Instance, Light, LightKind, Material,
    Pose, Primitive, Scene, Skin, SkinProfile, Source, VertexCurvature,
};
pub use tangent::arbitrary as any_tangent;
pub use texture_ref::{TextureRef, Wrap};
