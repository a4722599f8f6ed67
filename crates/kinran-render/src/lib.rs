//! Renderers and what is needed to judge their pictures.
//!
//! [`mod@reference`] is a deterministic ray caster on the CPU: the ground truth for every approximation in the
//! house and the renderer where there is no GPU. `realtime` (feature `gpu`) draws the same scenes as a game does,
//! by wgpu. [`mod@tonemap`] turns its radiance into a picture for a
//! display, [`metrics`] says how far two pictures are apart.
//!
//! ```
//! use glam::{Vec3, vec3};
//! use kinran_render::reference::{RenderScene, Settings, frame_box, render};
//! use kinran_render::tonemap::{Tonemap, to_srgb8};
//! use kinran_scene::{Environment, Scene};
//!
//! # let gltf = br#"{
//! #   "asset": { "version": "2.0" },
//! #   "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
//! #   "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
//! #   "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
//! #                   "min": [0, 0, 0], "max": [1, 1, 0] }],
//! #   "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
//! #   "buffers": [{ "byteLength": 36, "uri":
//! #     "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }]
//! # }"#;
//! # let nothing = |_: &str| Err(std::io::ErrorKind::NotFound.into());
//! # let scene = Scene::from_bytes("triangle.gltf".as_ref(), gltf, &nothing)?;
//! // `scene` is a triangle; the sky is white.
//! let sky = Environment::from_fn(8, |_| Vec3::ONE);
//! let scene = RenderScene::new(&scene, vec![None; scene.materials.len()], Some(sky))?;
//! let (min, max) = scene.geometry.bounds().expect("there are triangles");
//! let camera = frame_box(min, max, vec3(0.0, 0.0, 1.0), 0.6, 1.0);
//! let settings = Settings { width: 8, height: 8, ..Settings::default() };
//! let film = render(&scene, &camera, &settings, &kinran_image::untold)?;
//! let picture = to_srgb8(&film.pixels, 0.0, Tonemap::None);
//! assert_eq!(picture[0], [255; 3], "the sky");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
pub mod metrics;
#[cfg(feature = "gpu")]
pub mod realtime;
pub mod reference;
pub mod tonemap;

pub use error::Error;
