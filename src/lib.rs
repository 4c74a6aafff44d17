//! lightfall: photon mapping on Vulkan ray tracing hardware.
//!
//! The map of the house, in the order that light takes through it:
//!
//! | room | what it does |
//! |---|---|
//! | [`scene`] | a glTF file becomes plain triangles, materials, lights and cameras |
//! | [`settings`] | what a render can be asked for: options, ranges, defaults |
//! | [`gpu`] | the Vulkan device; the only unsafe code |
//! | [`shared`] | the structs that Rust and GLSL both read, declared once |
//! | [`image`] | pictures: EXR and PNG in and out |
//! | [`render`] | iterations of a technique, and the picture they add up to |
//! | [`cli`] | the command line, one file per subcommand |
#![deny(unsafe_code)]

pub mod cli;
pub mod error;
#[allow(unsafe_code)]
pub mod gpu;
pub mod image;
pub mod render;
pub mod scene;
pub mod settings;
pub mod shaders;
pub mod shared;

pub use error::{Error, Result};
