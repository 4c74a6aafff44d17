//! Photons in a hashed grid whose rows are runs of photons: the strongest grid known here, and on CPU
//! devices the fastest search of all.

use super::Technique;
use super::gather::{Gather, SortedPhotons};
use crate::gpu::{Buffer, Commands, DeviceKind, Gpu, Pass, Ptr};
use crate::photons::Order;
use crate::render::Engine;
use crate::shaders::spirv;
use crate::shared::*;
use crate::{Error, Result};
use glam::Vec3;
use std::mem::offset_of;

/// Cells per radius along x, y and z. A search spans few rows, and along them only what it reaches; see
/// also [`GRID_JOIN`].
const FINENESS: Vec3 = Vec3::new(3.0, 0.5, 0.5);
/// Slots for each photon, at least.
const SLOTS_PER_PHOTON: usize = 2;
/// Of a map's table: enough for the longest run of cells that a search reaches in each of 16 parts.
const LEAST_SLOTS: usize = 16 * 64;

/// Passes and the grids of one iteration.
pub struct HashGrid {
    keys: Pass,
    starts: Pass,
    gather: Gather,
    photons: SortedPhotons,
    table: Buffer<u32>,
}

impl Technique for HashGrid {
    fn iterate(&mut self, engine: &mut Engine) -> Result<()> {
        let counts = engine.trace_paths()?;
        if counts == [0, 0] {
            return engine.finish_without_photons();
        }
        let mut commands = engine.gpu.commands()?;
        let slots = self.reserve(engine, &mut commands, counts)?;
        let order = Order::Slots {
            keys: &self.keys,
            grids: self.grids(),
            bits: slots.next_power_of_two().ilog2(),
        };
        let [keys, indices] = engine.record_sort(&mut commands, counts, order);
        self.photons
            .record(engine, &mut commands, &self.gather.maps, indices, counts);
        self.record_starts(&mut commands, keys, counts, slots);
        self.gather.record(engine, &mut commands, counts);
        self.gather.finish(engine, commands)
    }
}

impl HashGrid {
    /// For either traversal: no ray is needed to find photons.
    ///
    /// # Errors
    /// Threads of this device's subgroups cannot search together.
    pub fn new(engine: &Engine) -> Result<Self> {
        let gpu = &engine.gpu;
        if gpu.info().caps.subgroup_size == 0 {
            return Err(Error::Device {
                device: gpu.info().name.clone(),
                fault: "no subgroup operations here; use --technique rtpm".into(),
            });
        }
        Ok(Self {
            keys: gpu.pass("sort", spirv("hash-grid.keys")?, &[], None)?,
            starts: gpu.pass("build", spirv("hash-grid.starts")?, &[], None)?,
            gather: Gather::for_points(
                engine,
                "hash-grid.gather",
                points(gpu, engine.view.pixel_count()),
            )?,
            photons: SortedPhotons::positions(engine)?,
            table: table(engine)?,
        })
    }

    /// Follows the photon buffers where they grew, and tells shaders where everything lies. Returns
    /// how many slots both maps have.
    fn reserve(
        &mut self,
        engine: &Engine,
        commands: &mut Commands,
        counts: [u32; 2],
    ) -> Result<u32> {
        if self.photons.outgrown(engine) {
            self.photons = SortedPhotons::positions(engine)?;
            self.table = table(engine)?;
        }
        let (min, max) = engine.world.bounds_w;
        // Cells at least so large that their numbers stay exact.
        let least = (max - min).max_element() / GRID_CELL_MAX as f32;
        let slots = counts.map(|n| if n == 0 { 0 } else { slots_for(n) });
        let grid = |map: usize, first_slot| PhotonGrid {
            starts: self.table.ptr(),
            min_w: min.into(),
            scale: (Vec3::splat(engine.radius()[map]) / FINENESS)
                .max(Vec3::splat(least))
                .recip()
                .into(),
            first_slot,
            row_slots: slots[map] / 16,
        };
        let maps = PhotonMaps {
            caustic_grid: grid(0, 0),
            global_grid: grid(1, slots[0]),
            ..self.photons.maps(counts)
        };
        commands.write(&self.gather.maps, 0, &[maps]);
        Ok(slots[0] + slots[1])
    }

    /// Of both maps, on the device.
    fn grids(&self) -> Ptr<PhotonGrid> {
        let first = offset_of!(PhotonMaps, caustic_grid);
        self.gather.maps.ptr().cast::<u8>().offset(first).cast()
    }

    fn record_starts(&self, commands: &mut Commands, keys: Ptr<u32>, counts: [u32; 2], slots: u32) {
        let push = GridStartsPush {
            keys,
            starts: self.table.ptr(),
            count: counts[0] + counts[1],
            slots,
        };
        commands.dispatch(&self.starts, &push, push.count as usize + 1);
    }
}

/// View samples that a thread gathers at: a CPU device has few threads in a subgroup to share rows and photons.
fn points(gpu: &Gpu, pixels: usize) -> u32 {
    match gpu.info().kind {
        DeviceKind::Cpu if pixels < 1 << 18 => 4,
        // More only pay where pixels are small beside radii: the driver compiles them for a second longer.
        DeviceKind::Cpu => 8,
        _ => 1,
    }
}

fn slots_for(photons: u32) -> u32 {
    (SLOTS_PER_PHOTON * photons as usize)
        .max(LEAST_SLOTS)
        .next_power_of_two() as u32
}

/// Slots of both maps and one behind the last: each power of two is at most twice what is asked for.
fn table(engine: &Engine) -> Result<Buffer<u32>> {
    let most = 2 * SLOTS_PER_PHOTON * engine.photons.capacity() + 4 * LEAST_SLOTS;
    engine.gpu.buffer("photon grids", most + 1)
}
