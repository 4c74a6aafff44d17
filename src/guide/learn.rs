//! Learns where light paths should begin: first from paths of the eye that look for light, then
//! from light paths that begin there, by what their photons bring to view samples.

use super::probes::{Brought, Probes, gain};
use super::sample::{around, from_eye, from_light, normalized, primaries};
use super::tree::Sample;
use super::{Focus, Guide, Tree};
use crate::Result;
use crate::render::Engine;
use crate::settings::Switch;
use crate::shared::Photon;
use crate::world::LightNames;
use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

/// Rounds of light paths.
const ROUNDS: u64 = 3;
/// Where this share of all light paths leaves photons that view samples gather, there is little to
/// gain.
const USEFUL: f32 = 0.15;
/// A guide must spare so many times what it costs: the estimates of both are rough, and light paths
/// spread less evenly.
const LEAST_GAIN: f32 = 1.5;
/// Light paths of an iteration, if guided ones take so long that there are to be fewer, at least.
const LEAST_PATHS: u32 = 8192;
/// Where photons that view samples gather are fewer, it is asked whether there should be more.
const FEW: usize = 1000;
/// What paths from the eye found counts for so much of the whole, once there are light paths.
const EYE_SHARE: f32 = 0.25;
/// Likewise, what lies beside that of light paths.
const HALO_SHARE: f32 = 0.15;
/// So many lights are told apart whatever that gains.
const MOST_LIGHTS: usize = 64;
/// Likewise, what light paths found without a guide.
const CHANCE_SHARE: f32 = 0.02;
/// Over the number of lights: the share that each of them has at least that was found to matter.
const HEED_SHARE: f32 = 0.1;

/// What was learned, and from what.
#[derive(Default)]
pub struct Lesson {
    /// Share of light paths that left a photon where a view sample gathers: without and with a
    /// guide.
    pub useful: [f32; 2],
    /// The variance without a guide over that with it, of as many light paths.
    pub gain: f32,
    /// How many times as long a guided light path takes, all in all.
    pub cost: f32,
    pub cells: usize,
    pub bytes: usize,
    /// Whether the guide is used.
    pub on: bool,
    /// Whether paths from the eye found light for the caustic and the global map; yes where none
    /// were asked.
    pub light: [bool; 2],
    /// Of each light: its name, and `useful`.
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

    /// What light paths take, in edges of the cheapest ones: those that leave nothing end soon, the
    /// others run through what the scene is full of. Counted, not timed, so that all runs decide
    /// alike.
    fn cost(&self, paths: u32) -> f32 {
        let mut longest: BTreeMap<u32, u32> = BTreeMap::new();
        for photon in &self.photons {
            let edges = longest.entry(photon.path).or_default();
            *edges = photon.power.edges().max(*edges);
        }
        0.25 * paths as f32
            + longest
                .values()
                .map(|&edges| 2.0 * edges as f32)
                .sum::<f32>()
    }
}

/// Sets the engine's guide, if that is wanted and gains enough, and the number of light paths,
/// unless that is to be kept. `pixels`: radii within which photons of the caustic and the global
/// map matter to a view sample. Returns view samples and photons of the last round, and what was
/// learned.
pub fn learn(
    engine: &mut Engine,
    wish: Switch,
    keep_paths: bool,
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
        cost: 1.0,
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
    let lights = engine.world.light_names.borders(MOST_LIGHTS);
    let mut tree = Tree::learn(&mut eye.samples.clone(), &lights);
    // What is found without a guide shows what paths from the eye did not find.
    let by_chance = from_light(engine, &even.brought)?;
    let mut found = Vec::new();
    for i in 0..ROUNDS {
        engine.guide = Guide::new(&engine.gpu, &engine.world, &focus, &tree)?;
        let round = Round::new(engine, i, pixels)?;
        found.extend(from_light(engine, &round.brought)?);
        let beside = around(&found);
        let samples = normalized(&found, 1.0 - EYE_SHARE - HALO_SHARE - CHANCE_SHARE)
            .chain(normalized(&eye.samples, EYE_SHARE))
            .chain(normalized(&by_chance, CHANCE_SHARE))
            .chain(normalized(&beside, HALO_SHARE));
        let mut samples: Vec<Sample> = samples.collect();
        heed_all_lights(&mut samples, &engine.world.light_names);
        tree = Tree::learn(&mut samples, &lights);
    }
    engine.guide = Guide::new(&engine.gpu, &engine.world, &focus, &tree)?;
    let mut guided = Round::new(engine, 0, pixels)?;
    let useful = guided.useful();
    let by_light = by_light(engine, &useful)?;
    let names = engine.world.light_names.names().iter().cloned();
    let shares = by_light_before.into_iter().zip(by_light);
    // Per pixel that is what its path and its gathers take.
    let others = 1.5 * engine.view.pixel_count() as f32;
    let [cost_even, cost_guided] = [&even, &guided].map(|round| round.cost(paths));
    // Guided paths take longer, so fewer do, in about the time that others would have taken: what
    // else is in the picture than photons needs its iterations too.
    let share_of_paths = ((others + cost_even) / cost_guided).min(1.0);
    let more = (others + share_of_paths * cost_guided) / (others + cost_even);
    lesson = Lesson {
        useful: [share, useful.len() as f32 / paths as f32],
        gain: gain(&guided.brought),
        cost: more / share_of_paths,
        cells: tree.cells.len(),
        bytes: engine.guide.bytes(),
        lights: names.zip(shares.map(|(a, b)| [a, b])).collect(),
        ..lesson
    };
    lesson.on = wish == Switch::On || lesson.gain > LEAST_GAIN * lesson.cost;
    if lesson.on && !keep_paths {
        let fewer = (paths as f32 * share_of_paths) as u32;
        engine.frame_data.paths = fewer.max(LEAST_PATHS).min(paths);
        guided = Round::new(engine, 0, pixels)?;
    }
    lesson.seconds = start.elapsed();
    if lesson.on {
        return Ok((guided.probes, guided.photons, lesson));
    }
    engine.guide = Guide::none(&engine.gpu, &engine.world)?;
    Ok((even.probes, even.photons, lesson))
}

/// Lights that were seldom found to matter get a share all the same, from which the next round
/// learns more of them: what was found once may be the only light of a room.
fn heed_all_lights(samples: &mut [Sample], names: &LightNames) {
    let mut weights = vec![0.0_f32; names.names().len()];
    let name = |sample: &Sample| names.of_number(sample.at[0]);
    for sample in samples.iter() {
        if let Some(name) = name(sample) {
            weights[name] += sample.weight;
        }
    }
    let found = weights.iter().filter(|w| **w > 0.0).count();
    let least = HEED_SHARE * weights.iter().sum::<f32>() / found.max(1) as f32;
    for sample in samples {
        if let Some(name) = name(sample)
            && weights[name] < least
        {
            sample.weight *= least / weights[name];
        }
    }
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
