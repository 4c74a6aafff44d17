//! Photons in hash tables of lists of fixed length: what `hash-ppm` and `stochastic-hash` share.

use super::Technique;
use super::gather::{Gather, SortedPhotons};
use crate::Result;
use crate::gpu::{Buffer, Commands, Pass, Ptr};
use crate::photons::Order;
use crate::render::Engine;
use crate::shaders::spirv;
use crate::shared::*;

/// Passes and the table of one iteration.
pub struct Lists {
    keys: Pass,
    insert: Pass,
    gather: Gather,
    photons: SortedPhotons,
    length: u32,
    buckets: fn(usize) -> usize,
    table: Table,
}

struct Table {
    owners: Buffer<u32>,
    counts: Buffer<u32>,
    keys: Buffer<u32>,
}

impl Technique for Lists {
    fn iterate(&mut self, engine: &mut Engine) -> Result<()> {
        let counts = engine.trace_paths()?;
        if counts == [0, 0] {
            return engine.finish_without_photons();
        }
        if self.photons.outgrown(engine) {
            self.photons = SortedPhotons::positions(engine)?;
            self.table = Table::new(engine, self.length, self.buckets)?;
        }
        let mut commands = engine.gpu.commands()?;
        // In the order of their paths: nothing is sorted.
        let order = Order::Slots {
            keys: &self.keys,
            grids: Ptr::null(),
            bits: 0,
        };
        let [maps, indices] = engine.record_sort(&mut commands, counts, order);
        self.describe(engine, &mut commands, counts, maps);
        self.photons
            .record(engine, &mut commands, &self.gather.maps, indices, counts);
        self.record_insert(&mut commands, counts);
        self.gather.record(engine, &mut commands, counts);
        self.gather.finish(engine, commands)
    }
}

impl Lists {
    /// Lists of `length` in so many `buckets`, a power of two, for a number of photons.
    pub fn new(engine: &Engine, length: u32, buckets: fn(usize) -> usize) -> Result<Self> {
        let gpu = &engine.gpu;
        let insert = [engine.world.features, 0, 0, length];
        Ok(Self {
            keys: gpu.pass("sort", spirv("hash-ppm.keys")?, &[], None)?,
            insert: gpu.pass("build", spirv("hash-ppm.insert")?, &insert, None)?,
            gather: Gather::new(engine, "hash-ppm.gather", length)?,
            photons: SortedPhotons::positions(engine)?,
            length,
            buckets,
            table: Table::new(engine, length, buckets)?,
        })
    }

    /// Tells shaders where everything lies.
    fn describe(&self, engine: &Engine, commands: &mut Commands, counts: [u32; 2], maps: Ptr<u32>) {
        let (min, max) = engine.world.bounds_w;
        // Cells at least so large that their numbers stay exact.
        let least = (max - min).max_element() / GRID_CELL_MAX as f32;
        let lists = PhotonLists {
            owners: self.table.owners.ptr(),
            counts: self.table.counts.ptr(),
            keys: self.table.keys.ptr(),
            maps,
            min_w: min.into(),
            scale: engine.radius().map(|r| r.max(least).recip()),
            buckets: self.table.counts.len() as u32,
            seed: engine.iteration_seed(),
            unused: 0,
        };
        let maps = PhotonMaps {
            lists,
            ..self.photons.maps(counts)
        };
        commands.write(&self.gather.maps, 0, &[maps]);
    }

    fn record_insert(&self, commands: &mut Commands, counts: [u32; 2]) {
        commands.fill(&self.table.owners, NONE);
        commands.fill(&self.table.counts, 0);
        commands.fill(&self.table.keys, NONE);
        let push = ListInsertPush {
            maps: self.gather.maps.ptr(),
            count: counts[0] + counts[1],
            unused: 0,
        };
        commands.dispatch(&self.insert, &push, push.count as usize);
    }
}

impl Table {
    /// For as many photons as the engine may store.
    fn new(engine: &Engine, length: u32, buckets: fn(usize) -> usize) -> Result<Self> {
        let (gpu, buckets) = (&engine.gpu, buckets(engine.photons.capacity()));
        Ok(Self {
            owners: gpu.buffer("owners of photon lists", buckets)?,
            counts: gpu.buffer("counts of photon lists", buckets)?,
            keys: gpu.buffer("photon lists", buckets * length as usize)?,
        })
    }
}
