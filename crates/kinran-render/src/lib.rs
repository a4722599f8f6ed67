//! Renderers and what is needed to judge their pictures.
//!
//! [`mod@reference`] is a deterministic ray caster on the CPU: the ground truth for every approximation in the
//! house and the renderer where there is no GPU. `realtime` (feature `gpu`) draws the same scenes as a game does,
//! by wgpu. [`mod@tonemap`] turns its radiance into a picture for a
//! display, [`metrics`] says how far two pictures are apart.

mod error;
pub mod metrics;
#[cfg(feature = "gpu")]
pub mod realtime;
pub mod reference;
pub mod tonemap;

pub use error::Error;
