//! Light paths: emission, storage without loss, and the order of the photons.

use crate::Result;
use crate::gpu::{Buffer, Commands, DeviceKind, Gpu, Pass, Ptr, Timings};
use crate::shaders::spirv;
use crate::shared::{
    CULL_CELLS, Counters, CullPush, EmitPush, Frame, Photon, PhotonGrid, PhotonKeysPush,
};
use crate::sort::{Scan, Sort};
use crate::view::View;
use crate::world::World;
use glam::Vec3;

/// Bits of a sort key: the map above 30 of a place on a Hilbert curve.
const KEY_BITS: u32 = 31;

/// Photons of one iteration, as emission left them.
pub struct Photons {
    cull: Pass,
    emit: Pass,
    keys: Pass,
    scan: Scan,
    sort: Sort,
    mask: Buffer<u32>,
    counters: Buffer<Counters>,
    paths_per_thread: u32,
    pub photons: Buffer<Photon>,
    /// Photons of each path; then, scanned, where each path's begin.
    path_photons: Buffer<u32>,
    path_slots: Buffer<u32>,
}

impl Photons {
    /// For `paths` light paths of up to `max_depth` edges an iteration; `features` are FEATURE_ bits
    /// beside the world's.
    pub fn new(
        gpu: &Gpu,
        world: &World,
        paths: u32,
        max_depth: u32,
        features: u32,
    ) -> Result<Self> {
        let capacity = first_capacity(paths);
        let paths_per_thread = paths_per_thread(gpu);
        Ok(Self {
            cull: gpu.pass("cull", spirv("cull")?, &[], None)?,
            emit: world.pass(gpu, "emit", features, &[paths_per_thread])?,
            paths_per_thread,
            keys: gpu.pass("sort", spirv("photon_keys")?, &[], None)?,
            scan: Scan::new(gpu, paths as usize + 1)?,
            sort: Sort::new(gpu, capacity)?,
            mask: gpu.buffer("culling mask", CULL_CELLS as usize / 32)?,
            counters: gpu.buffer("counters", 1)?,
            photons: gpu.buffer("photons", capacity)?,
            path_photons: gpu.buffer("path photons", paths as usize + 1)?,
            path_slots: gpu.buffer("path slots", paths as usize * max_depth as usize)?,
        })
    }

    /// Photons that the buffers hold.
    pub fn capacity(&self) -> usize {
        self.photons.len()
    }

    /// Positions (m) of the caustic and the global photons, after [`Self::emit`] and before sorting.
    pub fn positions(&self, gpu: &Gpu, frame: &Frame) -> Result<[Vec<Vec3>; 2]> {
        let counts = gpu.read(&self.path_photons, 0..frame.paths as usize)?;
        let slots = gpu.read(&self.path_slots, 0..self.path_slots.len())?;
        let photons = gpu.read(&self.photons, 0..self.capacity())?;
        let mut positions = [Vec::new(), Vec::new()];
        for (slots, count) in slots.chunks_exact(frame.max_depth as usize).zip(counts) {
            for slot in slots.iter().take(count as usize) {
                if let Some(photon) = photons.get((slot & 0x7fff_ffff) as usize) {
                    positions[(slot >> 31) as usize].push(photon.position_w.into());
                }
            }
        }
        Ok(positions)
    }

    /// Makes room for `photons` and some more.
    pub fn grow(&mut self, gpu: &Gpu, photons: u32) -> Result<()> {
        let capacity = photons as usize + photons as usize / 4;
        self.photons = gpu.buffer("photons", capacity)?;
        self.sort = Sort::new(gpu, capacity)?;
        Ok(())
    }

    /// Marks the cells that the view samples can gather from.
    pub fn record_cull(&self, commands: &mut Commands, view: &View, frame: &Buffer<Frame>) {
        commands.fill(&self.mask, 0);
        let push = CullPush {
            frame: frame.ptr(),
            samples: view.samples.ptr(),
            mask: self.mask.ptr(),
        };
        commands.dispatch(&self.cull, &push, view.pixel_count());
    }

    /// Traces the light paths, runs `commands` with them, and says what came of it. The counts may
    /// exceed [`Self::capacity`]: then photons are missing, and the caller grows and repeats.
    pub fn emit(
        &self,
        gpu: &Gpu,
        mut commands: Commands,
        world: &World,
        frame: &Buffer<Frame>,
        paths: u32,
    ) -> Result<(Counters, Timings)> {
        commands.fill(&self.counters, 0);
        let push = EmitPush {
            world: world.world.ptr(),
            frame: frame.ptr(),
            mask: self.mask.ptr(),
            photons: self.photons.ptr(),
            path_photons: self.path_photons.ptr(),
            path_slots: self.path_slots.ptr(),
            counters: self.counters.ptr(),
        };
        commands.dispatch(
            &self.emit,
            &push,
            paths.div_ceil(self.paths_per_thread) as usize,
        );
        let timings = commands.submit()?;
        let counters = gpu.read(&self.counters, 0..1)?;
        Ok((counters.first().copied().unwrap_or_default(), timings))
    }

    /// Orders `count` photons as `order` says, equal keys by their paths; returns their keys and
    /// indices in that order.
    pub fn record_sort(
        &self,
        commands: &mut Commands,
        world: &World,
        frame: &Buffer<Frame>,
        paths: u32,
        count: u32,
        order: Order,
    ) -> [Ptr<u32>; 2] {
        let (min, max) = world.bounds_w;
        let extent = (max - min).max(Vec3::splat(f32::MIN_POSITIVE));
        self.scan
            .record(commands, self.path_photons.ptr(), paths as usize + 1);
        let mut push = PhotonKeysPush {
            frame: frame.ptr(),
            photons: self.photons.ptr(),
            path_offsets: self.path_photons.ptr(),
            path_slots: self.path_slots.ptr(),
            keys: self.sort.keys[0].ptr(),
            indices: self.sort.values[0].ptr(),
            min_w: min.into(),
            scale: (Vec3::splat(1024.0) / extent).into(),
            ..Default::default()
        };
        let (pass, bits) = match order {
            Order::Hilbert => (&self.keys, KEY_BITS),
            Order::Slots { keys, grids, bits } => {
                push.grids = grids;
                (keys, bits)
            }
        };
        commands.dispatch(pass, &push, paths as usize);
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

/// Enough for most scenes; others grow.
fn first_capacity(paths: u32) -> usize {
    (paths as usize * 2).max(1024)
}

/// A CPU device runs few threads at once, a GPU needs many to hide its memory.
fn paths_per_thread(gpu: &Gpu) -> u32 {
    match gpu.info().kind {
        DeviceKind::Cpu => 32,
        _ => 4,
    }
}
