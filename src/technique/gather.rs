//! What every technique does that gathers photons at view samples, however it finds them: photons in
//! sorted places, full and stochastic evaluation.

use crate::Result;
use crate::gpu::{Buffer, Commands, Gpu, Pass, Ptr};
use crate::render::Engine;
use crate::settings::Evaluate;
use crate::shaders::spirv;
use crate::shared::*;

/// Names of the gather passes: full and stochastic evaluation.
const NAMES: [&str; 2] = ["gather", "gather stochastic"];

/// The gather pass in both ways to evaluate, and what it reads.
pub struct Gather {
    passes: [Pass; 2],
    /// View samples that a thread of either gathers at.
    points: [u32; 2],
    /// The faster of the two, as last measured.
    stochastic: bool,
    pub maps: Buffer<PhotonMaps>,
    /// Nowhere, unless pixels have radii of their own.
    pub statistics: Ptr<PixelStatistics>,
}

impl Gather {
    /// With the gather pass of this stem, and a photon list's length for those that need one.
    pub fn new(engine: &Engine, stem: &str, list_length: u32) -> Result<Self> {
        let code = spirv(stem)?;
        Self::with(engine, list_length, 1, |name, constants| {
            engine.gpu.pass(name, code, constants, None)
        })
    }

    /// With a pass whose threads gather at so many view samples each, where they evaluate all photons.
    pub fn for_points(engine: &Engine, stem: &str, points: u32) -> Result<Self> {
        let code = spirv(stem)?;
        Self::with(engine, 0, points, |name, constants| {
            engine.gpu.pass(name, code, constants, None)
        })
    }

    /// With the gather pass that `pass` makes from a name and specialization constants.
    pub fn with(
        engine: &Engine,
        list_length: u32,
        points: u32,
        pass: impl Fn(&'static str, &[u32]) -> Result<Pass>,
    ) -> Result<Self> {
        let subgroup = engine.gpu.info().caps.subgroup_size;
        let pass = |name, features, points| {
            let features = engine.world.features | features;
            pass(name, &[features, 0, subgroup, list_length, points])
        };
        Ok(Self {
            passes: [
                pass(NAMES[0], 0, points)?,
                pass(NAMES[1], FEATURE_STOCHASTIC, 1)?,
            ],
            points: [points, 1],
            stochastic: engine.evaluate != Evaluate::Full,
            maps: engine.gpu.buffer("photon maps", 1)?,
            statistics: Ptr::null(),
        })
    }

    /// Gathers from both maps and adds the iteration to the film.
    pub fn record(&self, engine: &Engine, commands: &mut Commands, counts: [u32; 2]) {
        // The last gather is the one that counts.
        if trial(engine) {
            self.record_one(engine, commands, counts, !self.stochastic);
        }
        self.record_one(engine, commands, counts, self.stochastic);
        engine.record_film(commands);
    }

    /// Runs the rest of the iteration, and learns from it which way to evaluate is faster.
    pub fn finish(&mut self, engine: &mut Engine, commands: Commands) -> Result<()> {
        let timings = engine.finish(commands)?;
        if trial(engine) {
            let [full, stochastic] = NAMES.map(|name| {
                let of_pass = timings.iter().filter(|t| t.0 == name);
                of_pass.map(|t| t.1).sum::<f64>()
            });
            self.stochastic = stochastic < full;
        }
        Ok(())
    }

    fn record_one(
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
                frame: engine.traced().frame.ptr(),
                samples: engine.traced().samples.ptr(),
                maps: self.maps.ptr(),
                pixels: engine.traced().pixels.ptr(),
                statistics: self.statistics,
                map,
                reservoir: engine.reservoir,
            };
            let way = usize::from(stochastic);
            let threads = engine.view.tiled_threads() / self.points[way] as usize;
            commands.dispatch(&self.passes[way], &push, threads);
        }
    }
}

/// Whether to time both ways to evaluate: ever more rarely, as the radius shrinks ever more slowly
/// (Kern et al. 2023, section 4.5 swaps at a fixed iteration).
fn trial(engine: &Engine) -> bool {
    let iteration = engine.iteration();
    engine.evaluate == Evaluate::Auto && (iteration < 2 || iteration.is_power_of_two())
}

/// Photons in sorted places.
pub struct SortedPhotons {
    pass: Pass,
    power: Buffer<PhotonPower>,
    places: Places,
}

enum Places {
    Positions(Buffer<[f32; 3]>),
    Boxes(Buffer<PhotonBox>),
}

impl SortedPhotons {
    /// As positions.
    pub fn positions(engine: &Engine) -> Result<Self> {
        Self::new(engine, "place.positions", |gpu, capacity| {
            Ok(Places::Positions(gpu.buffer("photon positions", capacity)?))
        })
    }

    /// As boxes of edge 2r.
    pub fn boxes(engine: &Engine) -> Result<Self> {
        Self::new(engine, "place.boxes", |gpu, capacity| {
            Ok(Places::Boxes(gpu.buffer("photon boxes", capacity)?))
        })
    }

    fn new(
        engine: &Engine,
        stem: &str,
        places: impl Fn(&Gpu, usize) -> Result<Places>,
    ) -> Result<Self> {
        let (gpu, capacity) = (&engine.gpu, engine.photons.capacity());
        Ok(Self {
            pass: gpu.pass("build", spirv(stem)?, &[], None)?,
            power: gpu.buffer("photon power", capacity)?,
            places: places(gpu, capacity)?,
        })
    }

    /// There is no room for what the engine may store.
    pub fn outgrown(&self, engine: &Engine) -> bool {
        self.power.len() < engine.photons.capacity()
    }

    /// Where the boxes lie; nowhere if they are positions.
    pub fn boxes_ptr(&self) -> Ptr<PhotonBox> {
        match &self.places {
            Places::Boxes(boxes) => boxes.ptr(),
            Places::Positions(_) => Ptr::null(),
        }
    }

    /// What a gather needs to know of the photons, however it finds them.
    pub fn maps(&self, counts: [u32; 2]) -> PhotonMaps {
        PhotonMaps {
            power: self.power.ptr(),
            positions_w: match &self.places {
                Places::Positions(positions) => positions.ptr(),
                Places::Boxes(_) => Ptr::null(),
            },
            boxes: self.boxes_ptr(),
            first: [0, counts[0]],
            count: counts,
            ..Default::default()
        }
    }

    /// Moves the photons with these `indices` to their places.
    pub fn record(
        &self,
        engine: &Engine,
        commands: &mut Commands,
        maps: &Buffer<PhotonMaps>,
        indices: Ptr<u32>,
        counts: [u32; 2],
    ) {
        let count = counts[0] + counts[1];
        let push = PlacePush {
            frame: engine.traced().frame.ptr(),
            photons: engine.traced().photons.ptr(),
            indices,
            maps: maps.ptr(),
            count,
            unused: 0,
        };
        commands.dispatch(&self.pass, &push, count as usize);
    }
}
