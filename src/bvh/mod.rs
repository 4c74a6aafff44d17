//! The software traversal's structures: a tree over the scene's triangles, built on the host at
//! load, and one over the photons, built on the device in every iteration.

mod node;
mod photons;
mod scene;

pub use photons::{PhotonTree, Shape};
pub use scene::{SceneTree, morton_order};
