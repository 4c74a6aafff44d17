//! Where light paths begin: the guide, and how it is learned.

mod learn;
mod probes;
mod tree;

pub use learn::{Focus, learn, round};
pub use probes::Probes;
pub use tree::Tree;

use crate::Result;
use crate::gpu::{Buffer, Gpu, Ptr};
use crate::shared::{self, GuideCell, GuideNode};
use crate::world::World;
use glam::Vec3;

/// The guide on the device.
pub struct Guide {
    guide: Buffer<shared::Guide>,
    nodes: Buffer<GuideNode>,
    cells: Buffer<GuideCell>,
}

impl Guide {
    /// None: light paths begin in proportion to luminous flux, and evenly where they can.
    pub fn none(gpu: &Gpu, world: &World) -> Result<Self> {
        let (min, max) = world.bounds_w;
        let everything = Focus {
            center_w: 0.5 * (min + max),
            reach: f32::MAX.sqrt() * 0.25,
        };
        Self::new(gpu, world, &everything, &Tree::even())
    }

    /// Of a tree whose samples were taken with this focus.
    pub fn new(gpu: &Gpu, world: &World, focus: &Focus, tree: &Tree) -> Result<Self> {
        let nodes = gpu.upload("guide nodes", &tree.nodes)?;
        let cells = gpu.upload("guide cells", &tree.cells)?;
        let guide = shared::Guide {
            nodes: nodes.ptr(),
            cells: cells.ptr(),
            center_w: focus.center_w.into(),
            radius: farthest(world.bounds_w, focus.center_w),
            reach: focus.reach,
            unused: 0,
        };
        Ok(Self {
            guide: gpu.upload("guide", &[guide])?,
            nodes,
            cells,
        })
    }

    pub fn ptr(&self) -> Ptr<shared::Guide> {
        self.guide.ptr()
    }

    /// Of the table on the device.
    pub fn bytes(&self) -> usize {
        self.nodes.bytes() + self.cells.bytes()
    }
}

/// From a point to the farthest of a box (m).
fn farthest((min, max): (Vec3, Vec3), from: Vec3) -> f32 {
    (max - from).abs().max((min - from).abs()).length()
}
