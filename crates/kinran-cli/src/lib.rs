//! The commands of `kinran`, as functions.
//!
//! Each command is a module: its flags (`Args`), the function that `main` calls (`run`), and the work itself
//! as a function that other commands can call.

mod backend;
pub mod bake;
pub mod budget;
pub mod cache;
pub mod cli;
pub mod compare;
mod compare_sheet;
pub mod completions;
mod console;
pub mod demo;
pub mod detail;
mod error;
pub mod fit;
pub mod fuzz_sheet;
pub mod init;
pub mod inspect;
pub mod model;
pub mod outputs;
mod page;
pub mod picture;
mod progress;
mod ranking;
pub mod render;
mod schema;
pub mod shaders;
mod sheet_flags;
pub mod skin;
pub mod skin_lut;
pub mod skin_sheet;
pub mod surfaces;
mod table;
mod values;
pub mod view;
#[cfg(feature = "view")]
pub mod viewer;

pub use console::{Console, Failed, Failure};
pub use error::Error;
pub use progress::{Progress, Stage};
pub use schema::schemas;
