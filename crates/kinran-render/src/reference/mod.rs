//! A deterministic ray caster on the CPU.
//!
//! [`RenderScene`] holds a scene in world space with its textures, [`render`] draws it. Primary rays carry
//! differentials, so that a texture can be read as a GPU reads it; light comes from punctual sources and from
//! an environment (diffuse by order-2 spherical harmonics, specular by multiple importance sampling). There is
//! no light between surfaces.

pub(crate) mod albedo;
mod bound;
mod bvh;
mod camera;
mod detail;
mod diffuse;
mod fuzz;
mod geometry;
mod light;
mod render;
pub(crate) mod sampler;
mod scene;
mod shading;
mod skin;
mod texture;

pub use bound::BoundTexture;
pub use bvh::{Bvh, Hit};
pub use camera::{CameraRay, PictureCamera, frame_box, look_at};
pub use detail::{DetailShown, RenderDetail, RenderDetailLayer};
pub use fuzz::{FUZZ_TILTS, FuzzCoefficients, FuzzFits, RenderFuzz};
pub use geometry::{FLAT, Geometry, MAX_TRIANGLES, SurfacePoint};
pub use render::{Background, Film, Settings, ShadingRate, render};
pub use scene::{
    AnisoEncoding, ColorTextures, RenderDielectric, RenderMaterial, RenderScene, SurfaceTextures,
    Surroundings, Translucency,
};
pub use skin::{RenderSkin, SkinCurvature, SkinTable, SkinTables};
pub use texture::{MipLevel, MipTexture, TextureFiltering};
