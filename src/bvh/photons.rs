//! The software tree over the photons of one map: complete, in heap order (see `glsl/lib/near.glsl`).

use crate::Result;
use crate::gpu::{Buffer, Commands, Gpu, Pass, Ptr};
use crate::shared::{PHOTON_FANOUT_LOG2, PHOTON_LEAF, PhotonMaps, TreePush};

/// The boxes of one photon map's tree.
pub struct PhotonTree {
    boxes: Buffer<[u32; 3]>,
}

impl PhotonTree {
    /// For up to `photons`.
    pub fn new(gpu: &Gpu, photons: usize) -> Result<Self> {
        let boxes = gpu.buffer("photon tree", Shape::of(photons).nodes)?;
        Ok(Self { boxes })
    }

    /// Where the boxes lie.
    pub fn ptr(&self) -> Ptr<[u32; 3]> {
        self.boxes.ptr()
    }

    /// Builds the tree level by level, leaves first.
    pub fn build(
        commands: &mut Commands,
        pass: &Pass,
        maps: Ptr<PhotonMaps>,
        map: u32,
        photons: usize,
    ) {
        let shape = Shape::of(photons);
        let (mut first, mut count) = (shape.first_leaf, shape.nodes - shape.first_leaf);
        loop {
            let push = TreePush {
                maps,
                map,
                first: first as u32,
                count: count as u32,
                unused: 0,
            };
            commands.dispatch(pass, &push, count);
            if count == 1 {
                return;
            }
            count >>= PHOTON_FANOUT_LOG2;
            first -= count;
        }
    }
}

/// The size of a tree.
#[derive(Debug, PartialEq)]
pub struct Shape {
    pub nodes: usize,
    pub first_leaf: usize,
}

impl Shape {
    /// Of the smallest complete tree for this many photons.
    pub fn of(photons: usize) -> Self {
        let (mut leaves, mut first_leaf) = (1, 0);
        while leaves * (PHOTON_LEAF as usize) < photons {
            first_leaf += leaves;
            leaves <<= PHOTON_FANOUT_LOG2;
        }
        Self {
            nodes: first_leaf + leaves,
            first_leaf,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_complete() {
        assert_eq!(
            Shape::of(0),
            Shape {
                nodes: 1,
                first_leaf: 0
            }
        );
        assert_eq!(
            Shape::of(8),
            Shape {
                nodes: 1,
                first_leaf: 0
            }
        );
        let fanout = 1 << PHOTON_FANOUT_LOG2;
        assert_eq!(
            Shape::of(9),
            Shape {
                nodes: 1 + fanout,
                first_leaf: 1
            }
        );
        for photons in [100, 5000, 200_000] {
            let shape = Shape::of(photons);
            assert!((shape.nodes - shape.first_leaf) * PHOTON_LEAF as usize >= photons);
        }
    }
}
