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
//! | [`shaders`] | the list of compiled passes |
//! | [`world`] | the scene on the device |
//! | [`bvh`] | the software traversal's trees over triangles and photons |
//! | [`view`], [`photons`], [`film`] | what all techniques share: camera paths, light paths, sums |
//! | [`guide`] | where light paths begin, and how that is learned |
//! | [`technique`] | the techniques, one file each |
//! | [`render`] | settings and a scene become iterations and a picture |
//! | [`image`] | pictures: EXR and PNG in and out |
//! | [`metrics`] | how far a picture is from a reference |
//! | [`mod@bench`] | the referee: techniques side by side, and the report |
//! | [`cli`] | the command line, one file per subcommand |
#![deny(unsafe_code)]

pub mod bench;
pub mod bvh;
pub mod cli;
pub mod error;
pub mod film;
#[allow(unsafe_code)]
pub mod gpu;
pub mod guide;
pub mod image;
pub mod metrics;
pub mod photons;
pub mod render;
pub mod scene;
pub mod settings;
pub mod shaders;
pub mod shared;
pub mod sort;
pub mod technique;
pub mod view;
pub mod world;

pub use error::{Error, Result};
