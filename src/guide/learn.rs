//! Learns where light paths should begin: first from paths of the eye that look for light, then
//! from light paths that begin there, by what their photons bring to view samples.

use super::probes::{Brought, Probes, gain};
use super::sample::{around, from_eye, from_light, normalized, primaries};
use super::{Focus, Guide, Tree};
use crate::Result;
use crate::render::Engine;
use crate::settings::Switch;
use crate::shared::Photon;
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

/// Rounds of light paths.
const ROUNDS: u64 = 3;
/// Where this share of all light paths leaves photons that view samples gather, there is little to
/// gain.
const USEFUL: f32 = 0.15;
/// A guide must spare so many times what it costs: the estimates of both are rough, and light paths
/// spread less evenly.
const LEAST_GAIN: f32 = 1.5;
/// Where photons that view samples gather are fewer, it is asked whether there should be more.
const FEW: usize = 1000;
/// What paths from the eye found counts for so much of the whole, once there are light paths.
const EYE_SHARE: f32 = 0.25;
/// Likewise, what lies beside that of light paths.
const HALO_SHARE: f32 = 0.1;

/// What was learned, and from what.
#[derive(Default)]
pub struct Lesson {
    /// Share of light paths that left a photon where a view sample gathers: without and with a
    /// guide.
    pub useful: [f32; 2],
    /// The variance without a guide over that with it.
    pub gain: f32,
    pub cells: usize,
    pub bytes: usize,
    /// Whether the guide is used.
    pub on: bool,
    /// Whether paths from the eye found light for the caustic and the global map; yes where none
    /// were asked.
    pub light: [bool; 2],
    /// Of each light: its name, `useful`, and whether any path began there.
    pub lights: Vec<(String, [f32; 2])>,
    pub seconds: Duration,
}

/// Camera and light paths of an iteration, and what they leave.
struct Round {
    probes: Probes,
    photons: Vec<Photon>,
    brought: Vec<Brought>,
}

impl Round {
    fn new(engine: &mut Engine, iteration: u64, pixels: [f32; 2]) -> Result<Self> {
        engine.begin(iteration);
        let counts = engine.trace_paths()?;
        let stored = (counts[0] + counts[1]) as usize;
        let photons = engine.gpu.read(&engine.traced().photons, 0..stored)?;
        let probes = Probes::of(engine)?;
        let brought = probes.brought(&photons, pixels);
        Ok(Self {
            probes,
            photons,
            brought,
        })
    }

    /// Paths that brought something to a view sample.
    fn useful(&self) -> BTreeSet<u32> {
        self.brought.iter().map(|b| b.path).collect()
    }

    /// What an iteration takes, in edges of paths: about one a photon beside the last of each path,
    /// and a few for each pixel's path and gathers.
    fn cost(&self, engine: &Engine) -> f32 {
        let pixels = engine.view.pixel_count() as f32;
        4.0 * pixels + engine.frame_data.paths as f32 + 2.0 * self.photons.len() as f32
    }
}

/// Sets the engine's guide, if that is wanted and gains enough. `pixels`: radii within which
/// photons of the caustic and the global map matter to a view sample. Returns view samples and
/// photons of the last round, and what was learned.
pub fn learn(
    engine: &mut Engine,
    wish: Switch,
    pixels: [f32; 2],
) -> Result<(Probes, Vec<Photon>, Lesson)> {
    let start = Instant::now();
    let even = Round::new(engine, 0, pixels)?;
    let paths = engine.frame_data.paths;
    let useful = even.useful();
    let share = useful.len() as f32 / paths.max(1) as f32;
    let mut lesson = Lesson {
        useful: [share; 2],
        gain: 1.0,
        light: [true; 2],
        ..Lesson::default()
    };
    let enough = match wish {
        Switch::Off => even.brought.iter().filter(|b| b.caustic).count() >= FEW,
        Switch::Auto => share >= USEFUL,
        Switch::On => false,
    };
    let Some(focus) = Focus::of(&even.probes.samples).filter(|_| paths > 0 && !enough) else {
        return Ok((even.probes, even.photons, lesson));
    };
    let eye = from_eye(engine, &focus)?;
    lesson.light = eye.maps;
    if wish == Switch::Off || eye.samples.is_empty() {
        lesson.seconds = start.elapsed();
        return Ok((even.probes, even.photons, lesson));
    }
    let by_light_before = by_light(engine, &useful)?;
    let mut tree = Tree::learn(&mut eye.samples.clone());
    let mut found = Vec::new();
    for i in 0..ROUNDS {
        engine.guide = Guide::new(&engine.gpu, &engine.world, &focus, &tree)?;
        let round = Round::new(engine, i, pixels)?;
        found.extend(from_light(engine, &round.brought)?);
        let beside = around(&found);
        let samples = normalized(&found, 1.0 - EYE_SHARE - HALO_SHARE)
            .chain(normalized(&eye.samples, EYE_SHARE))
            .chain(normalized(&beside, HALO_SHARE));
        tree = Tree::learn(&mut samples.collect::<Vec<_>>());
    }
    engine.guide = Guide::new(&engine.gpu, &engine.world, &focus, &tree)?;
    let guided = Round::new(engine, 0, pixels)?;
    let useful = guided.useful();
    let by_light = by_light(engine, &useful)?;
    let names = engine.world.light_names.names().iter().cloned();
    let shares = by_light_before.into_iter().zip(by_light);
    let more = guided.cost(engine) / even.cost(engine);
    lesson = Lesson {
        useful: [share, useful.len() as f32 / paths as f32],
        gain: gain(&guided.brought),
        cells: tree.cells.len(),
        bytes: engine.guide.bytes(),
        lights: names.zip(shares.map(|(a, b)| [a, b])).collect(),
        seconds: start.elapsed(),
        ..lesson
    };
    lesson.on = wish == Switch::On || lesson.gain > LEAST_GAIN * more;
    if lesson.on {
        return Ok((guided.probes, guided.photons, lesson));
    }
    engine.guide = Guide::none(&engine.gpu, &engine.world)?;
    Ok((even.probes, even.photons, lesson))
}

/// The share of each light's paths that are useful; of those that begin at lights of the same name.
fn by_light(engine: &Engine, useful: &BTreeSet<u32>) -> Result<Vec<f32>> {
    let all: Vec<u32> = (0..engine.frame_data.paths).collect();
    let names = &engine.world.light_names;
    let mut counts = vec![[0.0_f32; 2]; names.names().len()];
    for (path, primary) in all.iter().zip(primaries(engine, &all)?) {
        if let Some(name) = names.of_number(primary[0]) {
            counts[name][0] += 1.0;
            counts[name][1] += f32::from(useful.contains(path));
        }
    }
    let share = |[all, useful]: &[f32; 2]| useful / all.max(1.0);
    Ok(counts.iter().map(share).collect())
}
