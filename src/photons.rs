//! Light paths: emission, storage without loss, and the order of the photons.

use crate::Result;
use crate::gpu::{Buffer, Commands, DeviceKind, Gpu, Pass, Ptr};
use crate::guide::Guide;
use crate::render::Traced;
use crate::shaders::spirv;
use crate::shared::{CULL_CELLS, CullPush, EmitPush, PhotonGrid, PhotonKeysPush};
use crate::sort::{Scan, Sort};
use crate::world::World;
use glam::Vec3;

/// Bits of a sort key: the map above 30 of a place on a Hilbert curve.
const KEY_BITS: u32 = 31;

/// The passes that make photons and put them in order.
pub struct Photons {
    cull: Pass,
    emit: Pass,
    keys: Pass,
    scan: Scan,
    sort: Sort,
    mask: Buffer<u32>,
    paths_per_thread: u32,
}

impl Photons {
    /// For `paths` light paths an iteration and as many photons as `capacity`, at first; `features` are FEATURE_ bits
    /// beside the world's.
    pub fn new(
        gpu: &Gpu,
        world: &World,
        paths: u32,
        capacity: usize,
        features: u32,
    ) -> Result<Self> {
        let paths_per_thread = paths_per_thread(gpu);
        Ok(Self {
            cull: gpu.pass("cull", spirv("cull")?, &[], None)?,
            emit: world.pass(gpu, "emit", features, &[paths_per_thread])?,
            paths_per_thread,
            keys: gpu.pass("sort", spirv("photon_keys")?, &[], None)?,
            scan: Scan::new(gpu, paths as usize + 1)?,
            sort: Sort::new(gpu, capacity)?,
            mask: gpu.buffer("culling mask", CULL_CELLS as usize / 32)?,
        })
    }

    /// Photons that any iteration may have.
    pub fn capacity(&self) -> usize {
        self.sort.keys[0].len()
    }

    /// Makes room for `photons`.
    pub fn reserve(&mut self, gpu: &Gpu, photons: usize) -> Result<()> {
        if self.capacity() < photons {
            self.sort = Sort::new(gpu, photons)?;
        }
        Ok(())
    }

    /// Marks the cells that the view samples can gather from.
    pub fn record_cull(&self, commands: &mut Commands, traced: &Traced) {
        commands.fill(&self.mask, 0);
        let push = CullPush {
            frame: traced.frame.ptr(),
            samples: traced.samples.ptr(),
            mask: self.mask.ptr(),
        };
        commands.dispatch(&self.cull, &push, traced.samples.len());
    }

    /// Traces the light paths. Their counters may exceed what there is room for: then photons are missing.
    pub fn record_emit(
        &self,
        commands: &mut Commands,
        world: &World,
        guide: &Guide,
        traced: &Traced,
        paths: u32,
    ) {
        commands.fill(&traced.counters, 0);
        let push = EmitPush {
            world: world.world.ptr(),
            frame: traced.frame.ptr(),
            mask: self.mask.ptr(),
            photons: traced.photons.ptr(),
            path_photons: traced.path_photons.ptr(),
            counters: traced.counters.ptr(),
            guide: guide.ptr(),
        };
        let threads = paths.div_ceil(self.paths_per_thread);
        commands.dispatch(&self.emit, &push, threads as usize);
    }

    /// Orders `count` photons as `order` says, equal keys by their paths; returns their keys and
    /// indices in that order.
    pub fn record_sort(
        &self,
        commands: &mut Commands,
        world: &World,
        traced: &Traced,
        paths: u32,
        count: u32,
        order: Order,
    ) -> [Ptr<u32>; 2] {
        let (min, max) = world.bounds_w;
        let extent = (max - min).max(Vec3::splat(f32::MIN_POSITIVE));
        self.scan
            .record(commands, traced.path_photons.ptr(), paths as usize + 1);
        let mut push = PhotonKeysPush {
            photons: traced.photons.ptr(),
            path_offsets: traced.path_photons.ptr(),
            keys: self.sort.keys[0].ptr(),
            indices: self.sort.values[0].ptr(),
            min_w: min.into(),
            scale: (Vec3::splat(1024.0) / extent).into(),
            count,
            ..Default::default()
        };
        let (pass, bits) = match order {
            Order::Hilbert => (&self.keys, KEY_BITS),
            Order::Slots { keys, grids, bits } => {
                push.grids = grids;
                (keys, bits)
            }
        };
        commands.dispatch(pass, &push, count as usize);
        self.sort.record(commands, count as usize, bits)
    }
}

/// What photons are sorted by.
pub enum Order<'a> {
    /// Map, then place on a Hilbert curve.
    Hilbert,
    /// Their slots in grids over the caustic and the global map, numbers of so many bits.
    Slots {
        keys: &'a Pass,
        grids: Ptr<PhotonGrid>,
        bits: u32,
    },
}

/// A CPU device runs few threads at once, a GPU needs many to hide its memory.
fn paths_per_thread(gpu: &Gpu) -> u32 {
    match gpu.info().kind {
        DeviceKind::Cpu => 32,
        _ => 4,
    }
}
