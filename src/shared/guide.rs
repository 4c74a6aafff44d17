//! What guides light paths (see `guide.glsl`), and what it is learned from.

use super::glsl::{Glsl, Header, shared_structs};
use crate::gpu::Ptr;
use bytemuck::{Pod, Zeroable};

shared_structs! {
    /// Where light paths begin.
    struct Guide {
        nodes: Ptr<GuideNode>,
        cells: Ptr<GuideCell>,
        /// The middle of what matters.
        center_w: [f32; 3],
        /// Of the sphere about it that holds the scene (m).
        radius: f32,
        /// Of what matters (m): from twice as far, lights see it as a narrow bundle.
        reach: f32,
        unused: u32,
    }

    /// A split of the tree over primary samples, or a cell.
    struct GuideNode {
        /// 0: light, 1 and 2: place, 3 and 4: way, 5 and 6: bounce; NONE for a cell.
        axis: u32,
        /// The node below the split, beside the one above it; or the number of the cell.
        child: u32,
        /// Numbers below this one stay below the split.
        threshold: u32,
        /// By which numbers become as many as before.
        scale_below: f32,
        scale_above: f32,
        unused: u32,
    }

    /// A box of primary samples: where it begins, and its size; 0 stands for 2^32.
    struct GuideCell {
        first_light: u32,
        size_light: u32,
        first_place: [u32; 2],
        size_place: [u32; 2],
        first_way: [u32; 2],
        size_way: [u32; 2],
        first_bounce: [u32; 2],
        size_bounce: [u32; 2],
        /// Over that of uniform samples.
        density: f32,
        unused: u32,
    }

    /// What a light path begins with (see `emission.glsl`).
    struct PrimarySample {
        light: u32,
        place: [u32; 2],
        way: [u32; 2],
        bounce: [u32; 2],
    }

    /// Light that a path from the eye found.
    struct Importance {
        /// Of a light path that would have brought it.
        primary: PrimarySample,
        /// What its photons would add to the pixel (nit); below 0 what caustic ones would.
        weight: f32,
    }

    /// All that such a path found.
    struct ImportancePath {
        /// Luminance (nit) of the pixel.
        seen: f32,
        /// Of the image.
        block: u32,
    }
}
