//! Hardware ray tracing photon mapping: photons are boxes in an acceleration structure, and a ray of
//! no length gathers those that hold its origin (Kern, Brüll, Grosch 2023).

use super::Technique;
use crate::Result;
use crate::bvh::{PhotonTree, Shape};
use crate::gpu::{BoxBlas, Buffer, Commands, Instance, Pass, Ptr, Tlas};
use crate::render::Engine;
use crate::settings::{Evaluate, Trace};
use crate::shaders::spirv;
use crate::shared::*;
use crate::world::address_words;
use glam::Vec3;

/// Passes and the sorted photons of one iteration.
pub struct Rtpm {
    place: Pass,
    tree: Pass,
    /// Full and stochastic evaluation.
    gather: [Pass; 2],
    /// The faster of the two, as last measured.
    stochastic: bool,
    maps: Buffer<PhotonMaps>,
    sorted: Sorted,
}

/// Buffers of a given capacity.
struct Sorted {
    power: Buffer<PhotonPower>,
    structure: Structure,
}

/// What finds photons near a point.
enum Structure {
    /// Trees of the caustic and the global map.
    Software {
        positions: Buffer<[f32; 3]>,
        trees: [PhotonTree; 2],
    },
    Query {
        boxes: Buffer<PhotonBox>,
        blas: [BoxBlas; 2],
        tlas: Tlas,
    },
}

impl Technique for Rtpm {
    fn iterate(&mut self, engine: &mut Engine) -> Result<()> {
        let counts = engine.trace_paths()?;
        self.reserve(engine, counts)?;
        let mut commands = engine.gpu.commands()?;
        let order = engine.record_sort(&mut commands, counts);
        self.record_build(engine, &mut commands, order, counts)?;
        // The last gather is the one that counts.
        let trial = self.trial(engine);
        if trial {
            self.record_gather(engine, &mut commands, counts, !self.stochastic);
        }
        self.record_gather(engine, &mut commands, counts, self.stochastic);
        engine.record_film(&mut commands);
        let timings = engine.finish(commands)?;
        if trial {
            let time = |pass: &str| {
                timings
                    .iter()
                    .filter(|t| t.0 == pass)
                    .map(|t| t.1)
                    .sum::<f64>()
            };
            self.stochastic = time(GATHER[1]) < time(GATHER[0]);
        }
        Ok(())
    }
}

/// Names of the gather passes: full and stochastic evaluation.
const GATHER: [&str; 2] = ["gather", "gather stochastic"];

impl Rtpm {
    /// For the engine's traversal.
    pub fn new(engine: &Engine) -> Result<Self> {
        let gpu = &engine.gpu;
        let trace = if engine.world.trace == Trace::Query {
            "query"
        } else {
            "software"
        };
        let gather = |name, features| {
            let code = spirv(&format!("rtpm.gather.{trace}"))?;
            gpu.pass(name, code, &[engine.world.features | features], None)
        };
        Ok(Self {
            place: gpu.pass("build", spirv(&format!("rtpm.place.{trace}"))?, &[], None)?,
            tree: gpu.pass("build", spirv("rtpm.tree")?, &[], None)?,
            gather: [
                gather(GATHER[0], 0)?,
                gather(GATHER[1], FEATURE_STOCHASTIC)?,
            ],
            stochastic: engine.evaluate != Evaluate::Full,
            maps: gpu.buffer("photon maps", 1)?,
            sorted: Sorted::new(engine, engine.photons.capacity())?,
        })
    }

    /// Whether to time both ways to evaluate: ever more rarely, as the radius shrinks ever more slowly
    /// (Kern et al. 2023, section 4.5 swaps at a fixed iteration).
    fn trial(&self, engine: &Engine) -> bool {
        let iteration = engine.iteration();
        engine.evaluate == Evaluate::Auto && (iteration < 2 || iteration.is_power_of_two())
    }

    /// Follows the photon buffers where they grew, and tells shaders where everything lies.
    fn reserve(&mut self, engine: &Engine, counts: [u32; 2]) -> Result<()> {
        if self.sorted.power.len() < engine.photons.capacity() {
            self.sorted = Sorted::new(engine, engine.photons.capacity())?;
        }
        let s = &self.sorted;
        let (grid_min_w, grid_scale) = grid(engine.world.bounds_w);
        let mut maps = PhotonMaps {
            power: s.power.ptr(),
            first: [0, counts[0]],
            count: counts,
            first_leaf: counts.map(|n| Shape::of(n as usize).first_leaf as u32),
            grid_min_w: grid_min_w.into(),
            grid_scale,
            ..Default::default()
        };
        match &s.structure {
            Structure::Software {
                positions,
                trees: [caustic, global],
            } => {
                maps.positions_w = positions.ptr();
                maps.caustic_tree = caustic.ptr();
                maps.global_tree = global.ptr();
            }
            Structure::Query { boxes, tlas, .. } => {
                maps.boxes = boxes.ptr();
                maps.tlas = address_words(tlas.address());
            }
        }
        engine.gpu.write(&self.maps, 0, &[maps])
    }

    fn record_build(
        &self,
        engine: &Engine,
        commands: &mut Commands,
        order: Ptr<u32>,
        counts: [u32; 2],
    ) -> Result<()> {
        let count = counts[0] + counts[1];
        let push = PlacePush {
            frame: engine.frame.ptr(),
            photons: engine.photons.photons.ptr(),
            indices: order,
            maps: self.maps.ptr(),
            count,
            unused: 0,
        };
        commands.dispatch(&self.place, &push, count as usize);
        match &self.sorted.structure {
            Structure::Software { .. } => {
                for map in [MAP_CAUSTIC, MAP_GLOBAL] {
                    let photons = counts[map as usize] as usize;
                    if photons > 0 {
                        PhotonTree::build(commands, &self.tree, self.maps.ptr(), map, photons);
                    }
                }
            }
            Structure::Query { boxes, blas, tlas } => {
                let mut first = 0;
                let mut instances = Vec::new();
                for map in 0..2 {
                    let photons = counts[map] as usize;
                    if photons > 0 {
                        commands.build_boxes(&blas[map], boxes.ptr().offset(first).cast(), photons);
                        instances.push(Instance {
                            blas_address: blas[map].address(),
                            custom_index: map as u32,
                            mask: 1 << map,
                            facing_cull_disable: false,
                            front_ccw: false,
                        });
                    }
                    first += photons;
                }
                commands.build_tlas(tlas, &instances);
            }
        }
        Ok(())
    }

    fn record_gather(
        &self,
        engine: &Engine,
        commands: &mut Commands,
        counts: [u32; 2],
        stochastic: bool,
    ) {
        for map in [MAP_CAUSTIC, MAP_GLOBAL] {
            if counts[map as usize] == 0 {
                continue;
            }
            let push = GatherPush {
                frame: engine.frame.ptr(),
                samples: engine.view.samples.ptr(),
                maps: self.maps.ptr(),
                pixels: engine.view.pixels.ptr(),
                map,
                reservoir: engine.reservoir,
            };
            let pass = &self.gather[usize::from(stochastic)];
            commands.dispatch(pass, &push, engine.view.tiled_threads());
        }
    }
}

/// Corner and cells per metre of a grid that holds everything in 16 bits an axis, with a few cells
/// to spare at either end.
fn grid((min, max): (Vec3, Vec3)) -> (Vec3, f32) {
    let scale = 65520.0 / (max - min).max_element().max(1e-30);
    (min - 4.0 / scale, scale)
}

impl Sorted {
    fn new(engine: &Engine, capacity: usize) -> Result<Self> {
        let gpu = &engine.gpu;
        let structure = match engine.world.trace {
            Trace::Query => Structure::Query {
                boxes: gpu.buffer("photon boxes", capacity)?,
                blas: [
                    gpu.box_blas("caustic photons", capacity)?,
                    gpu.box_blas("global photons", capacity)?,
                ],
                tlas: gpu.tlas("photons", 2)?,
            },
            _ => Structure::Software {
                positions: gpu.buffer("photon positions", capacity)?,
                trees: [
                    PhotonTree::new(gpu, capacity)?,
                    PhotonTree::new(gpu, capacity)?,
                ],
            },
        };
        Ok(Self {
            power: gpu.buffer("photon power", capacity)?,
            structure,
        })
    }
}
