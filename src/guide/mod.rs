//! Where light paths begin: the guide, and how it is learned.

mod learn;
mod probes;
mod sample;
mod text;
mod tree;

pub use learn::{Lesson, learn};
pub use probes::Probes;
pub use tree::Tree;

use crate::Result;
use crate::gpu::{Buffer, Gpu, Ptr};
use crate::shared::{self, GuideCell, GuideNode, ViewSample};
use crate::world::World;
use glam::Vec3;

/// The guide on the device.
pub struct Guide {
    guide: Buffer<shared::Guide>,
    nodes: Buffer<GuideNode>,
    cells: Buffer<GuideCell>,
    /// What it was made of; `None` where light paths begin as without a guide.
    learned: Option<(Focus, Tree)>,
}

impl Guide {
    /// None: light paths begin in proportion to luminous flux, and evenly where they can.
    pub fn none(gpu: &Gpu, world: &World) -> Result<Self> {
        let (min, max) = world.bounds_w;
        let everything = Focus {
            center_w: 0.5 * (min + max),
            // From nowhere is that a narrow bundle.
            reach: 1e18,
        };
        let even = Self::new(gpu, world, &everything, &Tree::even())?;
        Ok(Self {
            learned: None,
            ..even
        })
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
            learned: Some((*focus, tree.clone())),
        })
    }

    /// Where shaders find it.
    pub fn ptr(&self) -> Ptr<shared::Guide> {
        self.guide.ptr()
    }

    /// Of the table on the device.
    pub fn bytes(&self) -> usize {
        self.nodes.bytes() + self.cells.bytes()
    }

    /// Where it was learned: what [`Guide::from_text`] makes the same guide of.
    pub fn to_text(&self) -> Option<String> {
        let (focus, tree) = self.learned.as_ref()?;
        Some(text::write(focus, tree))
    }

    /// `None` where the text is of no guide.
    pub fn from_text(gpu: &Gpu, world: &World, text: &str) -> Option<Result<Self>> {
        let (focus, tree) = text::read(text)?;
        Some(Self::new(gpu, world, &focus, &tree))
    }
}

/// From a point to the farthest of a box (m).
fn farthest((min, max): (Vec3, Vec3), from: Vec3) -> f32 {
    (max - from).abs().max((min - from).abs()).length()
}

/// Where what matters lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Focus {
    pub center_w: Vec3,
    /// Most of it is this near to the center (m).
    pub reach: f32,
}

impl Focus {
    /// Of what the eye sees, if it sees anything.
    pub fn of(samples: &[ViewSample]) -> Option<Self> {
        let quantile = |mut values: Vec<f32>, share: f32| {
            values.sort_unstable_by(f32::total_cmp);
            values.get((values.len() as f32 * share) as usize).copied()
        };
        let axis = |i: usize| quantile(samples.iter().map(|s| s.position_w[i]).collect(), 0.5);
        let center_w = Vec3::new(axis(0)?, axis(1)?, axis(2)?);
        let distances = samples
            .iter()
            .map(|s| center_w.distance(s.position_w.into()));
        Some(Self {
            center_w,
            reach: quantile(distances.collect(), 0.75)?,
        })
    }
}
