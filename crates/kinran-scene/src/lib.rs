//! glTF scenes in and out.
//!
//! [`Scene`] is a flat, validated form of a glTF document: everything an index points at exists, all
//! vertex data is finite, every primitive has normals and tangents. [`Document`] is the document itself,
//! for tools that replace its textures and leave everything else as it was.

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

pub use container::is_gltf;
pub use detail::{
    DETAIL_EXTENSION, DETAIL_LAYERS_MAX, Detail, DetailLayer, DetailMap, DetailMask, LayerTransform,
};
pub use document::{Attribute, Document, Object, Packed, Slot, TextureExtension};
pub use environment::Environment;
pub use error::Error;
pub use fuzz::{FUZZ_EXTENSION, Fuzz, FuzzAttenuation, FuzzDirection, FuzzLayer, FuzzPhase, SHEEN_MATCH};
pub use load::{Maps, Needs};
pub use scene::{
    AlphaMode, Anisotropy, Camera, DiffuseTransmission, Instance, Light, LightKind, Material, Pose,
    Primitive, Scene, Skin, SkinProfile, Source, VertexCurvature,
};
pub use tangent::arbitrary as any_tangent;
pub use texture_ref::{TextureRef, Wrap};
