//! Whole tasks: what a person does with Kinran, as functions of plain options, input and destination.
//!
//! Input comes from [`Files`]: the system's disk ([`Disk`]) or names and bytes in memory ([`Memory`]). Output goes to a
//! [`Sink`]: a folder ([`OutputFolder`]) or memory again. A [`Task`] tells how far the work is and stops it. Nothing prints,
//! nothing exits; warnings stand in the reports. `examples/bake_glb.rs` is a whole program.
//!
//! ```
//! use kinran::bake::{GltfOptions, gltf};
//! use kinran::{Cancel, Error, Memory, Progress, Task};
//! # use kinran_image::{Channels, Image, Pixels, encode_png};
//! # let texels = (0..16 * 16).flat_map(|i| [100 + (i % 16) as u8, 128, 250]).collect();
//! # let png = encode_png(&Image::new(16, 16, Channels::Rgb, Pixels::U8(texels))?)?;
//! # let json = br#"{ "asset": { "version": "2.0" }, "materials": [{ "name": "brass", "normalTexture": { "index": 0 } }],
//! #   "textures": [{ "source": 0 }], "images": [{ "uri": "bumps.png" }] }"#;
//!
//! let files = Memory::from([("lamp.gltf", json.to_vec()), ("bumps.png", png)]);
//! let (out, cancel) = (Memory::new(), Cancel::new());
//! let tell = |p: Progress<'_>| println!("{p}: {} of {}", p.done, p.total);
//! let mut how = GltfOptions::default();
//! how.textures.zstd = 9;
//! match gltf(&files, "lamp.gltf".as_ref(), &how, &out, Task { tell: &tell, cancel: &cancel }) {
//!     Ok(report) => report.warnings.iter().for_each(|warning| println!("{warning}")),
//!     Err(Error::Cancelled) => println!("another thread said cancel.cancel()"),
//!     Err(error) => println!("{}: {error}", error.code()),
//! }
//! let names: Vec<_> = out.files().into_iter().map(|(name, _)| name.display().to_string()).collect();
//! assert!(names.contains(&"lamp_brass_normal.ktx2".to_owned()) && names.contains(&"lamp.gltf".to_owned()), "{names:?}");
//! # Ok::<(), kinran_image::Error>(())
//! ```

pub mod bake;
mod check;
pub mod content;
pub mod detail;
mod error;
pub mod fit;
pub mod inspect;
pub mod library;
mod names;
pub mod options;
mod outgoing;
pub mod report;
mod sink;
pub mod skin;
mod skin_profile;
mod task;
mod textures;

pub use check::{Checked, Finding, check};
pub use error::{Error, InputFault};
pub use kinran_image::{Disk, Entry, Files, Memory};
pub use sink::{OutputFolder, Sink, Space};
pub use task::{Cancel, Progress, Stage, Task};
