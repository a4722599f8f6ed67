//! The program, run as people run it.

mod bad_input;
mod common;
mod help;
mod init;
mod inspect;
mod json;
mod render;
mod shaders;
mod shape;
mod sheets;
mod trust;
mod words;
