//! The program, run as people run it.

mod bad_input;
mod common;
mod inspect;
mod render;
mod shaders;
mod trust;
