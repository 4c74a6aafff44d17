//! The arguments of each pass.

use super::glsl::{Glsl, Header, shared_structs};
use super::guide::*;
use super::maps::*;
use super::records::*;
use super::scene::*;
use crate::gpu::Ptr;
use bytemuck::{Pod, Zeroable};

shared_structs! {
    /// The arguments of `view`. Those of passes that trace the scene begin with it: the shaders that their
    /// rays call read no more.
    struct ViewPush {
        world: Ptr<World>,
        frame: Ptr<Frame>,
        samples: Ptr<ViewSample>,
        pixels: Ptr<FramePixel>,
    }

    /// The arguments of `path`.
    struct PathPush {
        world: Ptr<World>,
        frame: Ptr<Frame>,
        pixels: Ptr<FramePixel>,
    }

    struct CullPush {
        frame: Ptr<Frame>,
        samples: Ptr<ViewSample>,
        mask: Ptr<u32>,
    }

    struct EmitPush {
        world: Ptr<World>,
        frame: Ptr<Frame>,
        mask: Ptr<u32>,
        photons: Ptr<Photon>,
        /// How many each path leaves.
        path_photons: Ptr<u32>,
        counters: Ptr<Counters>,
        guide: Ptr<Guide>,
    }

    /// The arguments of `importance`.
    struct ImportancePush {
        world: Ptr<World>,
        frame: Ptr<Frame>,
        guide: Ptr<Guide>,
        /// [`IMPORTANCE_RECORDS`](super::IMPORTANCE_RECORDS) a path.
        records: Ptr<Importance>,
        paths: Ptr<ImportancePath>,
        count: u32,
        unused: u32,
    }

    struct PrimariesPush {
        frame: Ptr<Frame>,
        guide: Ptr<Guide>,
        paths: Ptr<u32>,
        primaries: Ptr<PrimarySample>,
        count: u32,
        unused: u32,
    }

    /// Exclusive prefix sum, one level of a tree: `values` become offsets within their chunk, the
    /// chunk's total goes to `totals`.
    struct ScanPush {
        values: Ptr<u32>,
        totals: Ptr<u32>,
        count: u32,
        unused: u32,
    }

    struct PhotonKeysPush {
        photons: Ptr<Photon>,
        path_offsets: Ptr<u32>,
        keys: Ptr<u32>,
        indices: Ptr<u32>,
        /// The box that holds all photons, for the Hilbert curve.
        min_w: [f32; 3],
        scale: [f32; 3],
        /// Of the caustic and the global map, for slots.
        grids: Ptr<PhotonGrid>,
        count: u32,
        unused: u32,
    }

    struct SortPush {
        keys: Ptr<u32>,
        values: Ptr<u32>,
        keys_out: Ptr<u32>,
        values_out: Ptr<u32>,
        /// `histogram[digit * chunks + chunk]`.
        histogram: Ptr<u32>,
        count: u32,
        /// The digit: so many bits above so many others.
        digit_bits: u32,
        shift: u32,
        unused: u32,
    }

    struct ListInsertPush {
        maps: Ptr<PhotonMaps>,
        count: u32,
        unused: u32,
    }

    struct GridStartsPush {
        keys: Ptr<u32>,
        starts: Ptr<u32>,
        /// Of photons.
        count: u32,
        slots: u32,
    }

    struct PlacePush {
        frame: Ptr<Frame>,
        photons: Ptr<Photon>,
        indices: Ptr<u32>,
        maps: Ptr<PhotonMaps>,
        count: u32,
        unused: u32,
    }

    /// One level of a photon tree.
    struct TreePush {
        maps: Ptr<PhotonMaps>,
        map: u32,
        /// First node of this level and how many it has.
        first: u32,
        count: u32,
        unused: u32,
    }

    struct GatherPush {
        frame: Ptr<Frame>,
        samples: Ptr<ViewSample>,
        maps: Ptr<PhotonMaps>,
        pixels: Ptr<FramePixel>,
        /// Where pixels have radii of their own.
        statistics: Ptr<PixelStatistics>,
        map: u32,
        /// Photons kept by stochastic evaluation.
        reservoir: u32,
    }

    struct PixelRadiiPush {
        frame: Ptr<Frame>,
        pixels: Ptr<FramePixel>,
        statistics: Ptr<PixelStatistics>,
        alpha: f32,
        unused: u32,
    }

    struct FilmPush {
        frame: Ptr<Frame>,
        pixels: Ptr<FramePixel>,
        film: Ptr<FilmPixel>,
    }

    /// What `bench.rays` traces.
    struct Ray {
        origin_w: [f32; 3],
        /// Unit length.
        direction_w: [f32; 3],
        /// Where a shadow ray ends in metres.
        distance_w: f32,
    }

    struct BenchRaysPush {
        world: Ptr<World>,
        rays: Ptr<Ray>,
        met: Ptr<u32>,
        count: u32,
        /// 1: ask only whether something is in the way.
        shadow: u32,
    }
}
