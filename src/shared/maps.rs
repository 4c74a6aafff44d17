//! Photons in sorted places, and what finds them there.

use super::glsl::{Glsl, Header, shared_structs};
use super::records::*;
use crate::gpu::Ptr;
use bytemuck::{Pod, Zeroable};

shared_structs! {
    /// Photons in sorted order, caustic ones first. Pairs are of the caustic and the global map.
    struct PhotonMaps {
        positions_w: Ptr<[f32; 3]>,
        power: Ptr<PhotonPower>,
        /// For the acceleration structures.
        boxes: Ptr<PhotonBox>,
        /// Complete trees in heap order (see `near.glsl`). A box is a word an axis: 16 bits of its low
        /// side, 16 of its high side, in cells of a grid with this corner and so many cells a metre.
        caustic_tree: Ptr<[u32; 3]>,
        global_tree: Ptr<[u32; 3]>,
        grid_min_w: [f32; 3],
        grid_scale: f32,
        tlas: [u32; 2],
        first: [u32; 2],
        count: [u32; 2],
        first_leaf: [u32; 2],
        caustic_grid: PhotonGrid,
        global_grid: PhotonGrid,
        lists: PhotonLists,
    }

    /// A hashed grid over one photon map (see `grid.glsl`).
    struct PhotonGrid {
        /// Photons of slot s lie from `starts[s]` to before `starts[s + 1]`.
        starts: Ptr<u32>,
        /// Corner of the grid, and cells per metre.
        min_w: [f32; 3],
        scale: [f32; 3],
        first_slot: u32,
        /// Slots of each of the table's 16 parts, a power of two.
        row_slots: u32,
    }

    /// A hash table of photon lists over both maps (see `lists.glsl`).
    struct PhotonLists {
        /// The photon whose cell has the bucket, or NONE.
        owners: Ptr<u32>,
        /// Photons put into the bucket.
        counts: Ptr<u32>,
        /// Keys of those kept, the same number of places for each bucket.
        keys: Ptr<u32>,
        /// The map of each photon.
        maps: Ptr<u32>,
        min_w: [f32; 3],
        /// Cells per metre of the caustic and the global map.
        scale: [f32; 2],
        /// A power of two.
        buckets: u32,
        /// Of the keys in this iteration.
        seed: u32,
        unused: u32,
    }

    /// An axis-aligned box, as acceleration structures want it.
    struct PhotonBox {
        min_w: [f32; 3],
        max_w: [f32; 3],
    }
}
