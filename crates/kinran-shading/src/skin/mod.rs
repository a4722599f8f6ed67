//! Skin by pre-integration, with directional curvature.
//!
//! - Penner, Borshukov. Pre-Integrated Skin Shading. GPU Pro 2, 2011.
//! - Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020 (slides: Skin Shading).
//!
//! Lengths are millimetres, curvature is 1/mm, convex is positive. A profile says how light that enters at one
//! point leaves around it. Its two forms are different types, for the wrong one gives a plausible wrong picture:
//! a [`RadialProfile`](profile::RadialProfile) is per area, against the distance from a point, and belongs on a
//! sphere (ambient light); a [`LinearProfile`](profile::LinearProfile) is per length, against the distance from
//! a line, and belongs on a cylinder (punctual light).
//!
//! ```
//! use kinran_shading::skin::profile::RadialProfile;
//!
//! // A row of the table: skin that bends with a radius of 10 mm. Red reaches around the terminator.
//! let mut row = [[0.0; 3]; 32];
//! RadialProfile::skin().to_linear().ring_row(0.1, &mut row);
//! let [red, green, blue] = row[14];
//! assert!(red > green && green > blue && blue >= 0.0);
//! ```

mod bessel;
pub mod curvature;
pub mod lighting;
pub mod penumbra;
pub mod profile;
pub mod ring;
mod row;
pub mod sampled;
mod samples;
pub mod sphere;
