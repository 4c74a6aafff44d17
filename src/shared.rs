//! The structs that Rust and GLSL both read, declared once.
//!
//! `shared_structs!` makes the `Pod` struct and [`glsl_header`] prints its GLSL twin in scalar
//! layout, so the two cannot differ: `Pod` refuses hidden padding at compile time, and scalar
//! layout adds none. See [`glsl`] for what else GLSL gets.

mod constants;
pub mod glsl;
mod guide;
mod maps;
mod push;
mod records;
mod scene;

pub use constants::*;
pub use guide::*;
pub use maps::*;
pub use push::*;
pub use records::*;
pub use scene::*;

use crate::gpu::{GROUP_SIZE, Ptr};
use constants::CONSTANTS;
use glsl::{Glsl, Header};

/// The text of the virtual file `shared.glsl` that every pass includes.
pub fn glsl_header() -> String {
    let mut header = Header::default();
    for (name, value) in CONSTANTS {
        header.text += &format!("const uint {name} = {value}u;\n");
    }
    header.text += &format!("const uint GROUP_SIZE = {GROUP_SIZE}u;\n");
    header.text += &format!("const float FOLD_COSINE = {FOLD_COSINE:?};\n");
    header.text += &format!("const float GRID_JOIN = {GRID_JOIN:?};\n");
    <Ptr<f32>>::declare(&mut header);
    for declare in [
        scene::declare_structs,
        records::declare_structs,
        maps::declare_structs,
        guide::declare_structs,
        push::declare_structs,
    ] {
        declare(&mut header);
    }
    header.text
}

/// Shaders that rays call know nothing of a pass's arguments but that they begin with the world.
const _: () = {
    use std::mem::offset_of;
    assert!(offset_of!(ViewPush, world) == 0);
    assert!(offset_of!(PathPush, world) == 0);
    assert!(offset_of!(EmitPush, world) == 0);
    assert!(offset_of!(ImportancePush, world) == 0);
    assert!(offset_of!(BenchRaysPush, world) == 0);
};
