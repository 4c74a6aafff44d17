//! Hardware ray tracing photon mapping: photons are boxes in an acceleration structure, and a ray of
//! no length gathers those that hold its origin (Kern, Brüll, Grosch 2023).

use super::Technique;
use super::gather::{Gather, SortedPhotons};
use crate::Result;
use crate::bvh::{PhotonTree, Shape};
use crate::gpu::{BoxBlas, Commands, Instance, Pass, Ptr, RayShaders, Tlas};
use crate::photons::Order;
use crate::render::Engine;
use crate::settings::Trace;
use crate::shaders::spirv;
use crate::shared::*;
use crate::world::address_words;
use glam::Vec3;

/// Passes, and what holds the photons of one iteration.
pub struct Rtpm {
    tree: Pass,
    pub gather: Gather,
    photons: SortedPhotons,
    structure: Structure,
}

/// What finds photons near a point, for as many as the buffers hold: of the caustic and the global map. There is no
/// caustic map where nothing is specular.
enum Structure {
    Software([Option<PhotonTree>; 2]),
    /// The driver's, over boxes.
    Boxes {
        blas: [Option<BoxBlas>; 2],
        tlas: Tlas,
    },
}

impl Technique for Rtpm {
    fn iterate(&mut self, engine: &mut Engine) -> Result<()> {
        let (mut commands, counts) = self.build(engine)?;
        self.gather.record(engine, &mut commands, counts);
        self.gather.finish(engine, commands)
    }
}

impl Rtpm {
    /// For the engine's traversal, with the gather pass of this technique.
    pub fn new(engine: &Engine, technique: &str) -> Result<Self> {
        let (photons, structure) = structure(engine)?;
        let trace = engine.world.trace;
        let stem = format!("{technique}.gather.{}", trace.variant());
        let gather = match trace {
            Trace::Pipeline => {
                let called = RayShaders {
                    any_hit: Some(spirv("photon.any")?),
                    intersection: Some(spirv("photon.intersection")?),
                    ..RayShaders::default()
                };
                let code = spirv(&stem)?;
                Gather::with(engine, 0, 1, |name, constants| {
                    engine.gpu.ray_pass(name, code, &called, constants, None)
                })?
            }
            _ => Gather::new(engine, &stem, 0)?,
        };
        Ok(Self {
            tree: engine.gpu.pass("build", spirv("rtpm.tree")?, &[], None)?,
            gather,
            photons,
            structure,
        })
    }

    /// Photons of one iteration and what finds them. Returns how many the caustic and the global map hold.
    pub fn build(&mut self, engine: &mut Engine) -> Result<(Commands, [u32; 2])> {
        let counts = engine.trace_paths()?;
        let mut commands = engine.gpu.commands()?;
        if counts == [0, 0] {
            return Ok((commands, counts));
        }
        self.reserve(engine, &mut commands, counts)?;
        let [_, indices] = engine.record_sort(&mut commands, counts, Order::Hilbert);
        self.photons
            .record(engine, &mut commands, &self.gather.maps, indices, counts);
        self.record_build(&mut commands, counts)?;
        Ok((commands, counts))
    }

    /// Follows the photon buffers where they grew, and tells shaders where everything lies.
    fn reserve(
        &mut self,
        engine: &Engine,
        commands: &mut Commands,
        counts: [u32; 2],
    ) -> Result<()> {
        if self.photons.outgrown(engine) {
            (self.photons, self.structure) = structure(engine)?;
        }
        let (grid_min_w, grid_scale) = grid(engine.world.bounds_w);
        let mut maps = PhotonMaps {
            first_leaf: counts.map(|n| Shape::of(n as usize).first_leaf as u32),
            grid_min_w: grid_min_w.into(),
            grid_scale,
            ..self.photons.maps(counts)
        };
        match &self.structure {
            Structure::Software([caustic, global]) => {
                let ptr =
                    |tree: &Option<PhotonTree>| tree.as_ref().map_or(Ptr::null(), |t| t.ptr());
                maps.caustic_tree = ptr(caustic);
                maps.global_tree = ptr(global);
            }
            Structure::Boxes { tlas, .. } => maps.tlas = address_words(tlas.address()),
        }
        commands.write(&self.gather.maps, 0, &[maps]);
        Ok(())
    }

    fn record_build(&self, commands: &mut Commands, counts: [u32; 2]) -> Result<()> {
        match &self.structure {
            Structure::Software(_) => {
                for map in [MAP_CAUSTIC, MAP_GLOBAL] {
                    let photons = counts[map as usize] as usize;
                    if photons > 0 {
                        let maps = self.gather.maps.ptr();
                        PhotonTree::build(commands, &self.tree, maps, map, photons);
                    }
                }
            }
            Structure::Boxes { blas, tlas } => {
                let boxes = self.photons.boxes_ptr();
                let mut first = 0;
                let mut instances = Vec::new();
                for map in 0..2 {
                    let photons = counts[map] as usize;
                    if let Some(blas) = blas[map].as_ref().filter(|_| photons > 0) {
                        commands.build_boxes(blas, boxes.offset(first).cast(), photons);
                        instances.push(Instance {
                            blas_address: blas.address(),
                            transform: Instance::IDENTITY,
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
}

/// Corner and cells per metre of a grid that holds everything in 16 bits an axis, with a few cells
/// to spare at either end.
fn grid((min, max): (Vec3, Vec3)) -> (Vec3, f32) {
    let scale = 65520.0 / (max - min).max_element().max(1e-30);
    (min - 4.0 / scale, scale)
}

/// Room for as many photons as the engine may store.
fn structure(engine: &Engine) -> Result<(SortedPhotons, Structure)> {
    let (gpu, capacity) = (&engine.gpu, engine.photons.capacity());
    let caustics = engine.world.features & FEATURE_SPECULAR != 0;
    Ok(match engine.world.trace.uses_structures() {
        true => (
            SortedPhotons::boxes(engine)?,
            Structure::Boxes {
                blas: [
                    caustics
                        .then(|| gpu.box_blas("caustic photons", capacity))
                        .transpose()?,
                    Some(gpu.box_blas("global photons", capacity)?),
                ],
                tlas: gpu.tlas("photons", 2)?,
            },
        ),
        false => (
            SortedPhotons::positions(engine)?,
            Structure::Software([
                caustics
                    .then(|| PhotonTree::new(gpu, capacity))
                    .transpose()?,
                Some(PhotonTree::new(gpu, capacity)?),
            ]),
        ),
    })
}
