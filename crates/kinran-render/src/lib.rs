//! Renderers and what is needed to judge their pictures.
//!
//! [`mod@reference`] is a deterministic ray caster on the CPU: the ground truth for every approximation in the
//! house and the renderer where there is no GPU. [`mod@tonemap`] turns its radiance into a picture for a
//! display, [`metrics`] says how far two pictures are apart.

mod error;
pub mod metrics;
pub mod reference;
pub mod tonemap;

pub use error::Error;
