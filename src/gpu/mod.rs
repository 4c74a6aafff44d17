//! The Vulkan device: memory, passes, acceleration structures. The only room with unsafe code.
//!
//! Buffers travel to shaders as typed device addresses ([`Ptr`]) in push constants; the one
//! descriptor set is the [`TextureArray`]. Work is recorded in [`Commands`] and may run on as [`Running`]: buffers and
//! structures that are dropped wait for all of it. What an address in a push constant or buffer
//! points at is beyond any check here: whoever passes it keeps its buffer alive and its count right.

mod accel;
mod binding_table;
mod buffer;
mod commands;
mod device;
mod geometry;
mod info;
mod instance;
mod memory;
mod pass;
mod ray_pass;
mod recorder;
mod running;
mod texture;

pub use accel::{Blas, BoxBlas, Tlas};
pub use buffer::{Buffer, Ptr};
pub use commands::Commands;
pub use device::{Gpu, OpenOptions, devices};
pub use geometry::{Instance, TriangleGeometry};
pub use info::{Caps, DeviceInfo, DeviceKind};
pub use pass::{GROUP_SIZE, MAX_PUSH_BYTES, Pass};
pub use ray_pass::RayShaders;
pub use running::{Done, Running, Timings};
pub use texture::{TextureArray, TextureData};
