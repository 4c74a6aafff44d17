//! A plain grid as a rival: cells of edge 2r, of which a search visits the nearest eight.

use glam::Vec3;
use lightfall::Result;
use lightfall::gpu::{Buffer, Pass};
use lightfall::photons::Order;
use lightfall::render::Engine;
use lightfall::shaders::spirv;
use lightfall::shared::{GridStartsPush, PhotonGrid, PhotonMaps};
use lightfall::technique::gather::{Gather, SortedPhotons};
use lightfall::technique::{Row, Technique};

pub const CELLS: Row = Row {
    name: "cells",
    paper: "",
    bias: "",
    photons: true,
    pixel_radii: false,
    build: |engine| Ok(Box::new(Cells::new(engine)?)),
};

/// A power of two above twice the photons of the bench, as many as the row grid takes. There are no caustics in it.
const SLOTS: u32 = 1 << 19;

struct Cells {
    keys: Pass,
    starts: Pass,
    gather: Gather,
    photons: SortedPhotons,
    table: Buffer<u32>,
    grids: Buffer<PhotonGrid>,
}

impl Cells {
    fn new(engine: &Engine) -> Result<Self> {
        let gpu = &engine.gpu;
        Ok(Self {
            keys: gpu.pass("sort", spirv("bench.cells.keys")?, &[], None)?,
            starts: gpu.pass("build", spirv("hash-grid.starts")?, &[], None)?,
            gather: Gather::new(engine, "bench.cells.gather", 0)?,
            photons: SortedPhotons::positions(engine)?,
            table: gpu.buffer("cells", SLOTS as usize + 1)?,
            grids: gpu.buffer("grids", 2)?,
        })
    }
}

impl Technique for Cells {
    fn iterate(&mut self, engine: &mut Engine) -> Result<()> {
        let counts = engine.trace_paths()?;
        if self.photons.outgrown(engine) {
            self.photons = SortedPhotons::positions(engine)?;
        }
        let grid = |map: usize| PhotonGrid {
            starts: self.table.ptr(),
            min_w: engine.world.bounds_w.0.into(),
            // A little wider than a search, which then never reaches a third.
            scale: Vec3::splat(1.0 / (2.01 * engine.radius()[map])).into(),
            first_slot: 0,
            row_slots: SLOTS / 16,
        };
        let grids = [grid(0), grid(1)];
        let mut commands = engine.gpu.commands()?;
        commands.write(&self.grids, 0, &grids);
        let maps = PhotonMaps {
            caustic_grid: grids[0],
            global_grid: grids[1],
            ..self.photons.maps(counts)
        };
        commands.write(&self.gather.maps, 0, &[maps]);
        let order = Order::Slots {
            keys: &self.keys,
            grids: self.grids.ptr(),
            bits: SLOTS.ilog2(),
        };
        let [keys, indices] = engine.record_sort(&mut commands, counts, order);
        self.photons
            .record(engine, &mut commands, &self.gather.maps, indices, counts);
        let push = GridStartsPush {
            keys,
            starts: self.table.ptr(),
            count: counts[0] + counts[1],
            slots: SLOTS,
        };
        commands.dispatch(&self.starts, &push, push.count as usize + 1);
        self.gather.record(engine, &mut commands, counts);
        self.gather.finish(engine, commands)
    }
}
