//! Learns where light paths should begin: first from paths of the eye that look for light
//! (`glsl/guide/importance.comp`), then from light paths that begin there, by what their photons bring to view samples.

use super::probes::{Brought, Probes, gain};
use super::tree::{Sample, Tree};
use super::Guide;
use crate::Result;
use crate::render::Engine;
use crate::shaders::spirv;
use crate::shared::*;
use glam::Vec3;
use std::collections::BTreeMap;

/// Paths from the eye.
const PATHS: u32 = 1 << 16;
/// Rounds of light paths.
const ROUNDS: u64 = 3;
/// What one path found counts for so many times the mean at most: a rare bright one says little about where others are.
const MOST_OF_MEAN: f32 = 50.0;
/// Light is seen relative to what the block of the image has in all, and to this share of the image's mean.
const LEAST_OF_MEAN: f32 = 0.1;
/// What paths from the eye found counts for so much of the whole, once there are light paths.
const EYE_SHARE: f32 = 0.25;
const HALO_SHARE: f32 = 0.1;

/// Where what matters lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Focus {
    pub center_w: Vec3,
    /// Most of it is this near to the center (m).
    pub reach: f32,
}

impl Focus {
    /// Of what the eye sees.
    pub fn of(samples: &[ViewSample]) -> Option<Self> {
        let median = |mut values: Vec<f32>, share: f32| {
            values.sort_unstable_by(f32::total_cmp);
            values.get((values.len() as f32 * share) as usize).copied()
        };
        let axis = |i: usize| median(samples.iter().map(|s| s.position_w[i]).collect(), 0.5);
        let center_w = Vec3::new(axis(0)?, axis(1)?, axis(2)?);
        let distances = samples.iter().map(|s| center_w.distance(s.position_w.into()));
        Some(Self {
            center_w,
            reach: median(distances.collect(), 0.75)?,
        })
    }
}

/// Camera and light paths of an iteration, and what they leave.
pub fn round(engine: &mut Engine, iteration: u64) -> Result<(Probes, Vec<Photon>)> {
    engine.begin(iteration);
    let counts = engine.trace_paths()?;
    let stored = (counts[0] + counts[1]) as usize;
    let photons = engine.gpu.read(&engine.traced().photons, 0..stored)?;
    Ok((Probes::of(engine)?, photons))
}

/// Sets the engine's guide, if that gains anything. `pixels`: within how many photons of the caustic and the global map
/// matter to a view sample. Returns the last round of light paths.
pub fn learn(engine: &mut Engine, pixels: [f32; 2], auto: bool) -> Result<(Probes, Vec<Photon>)> {
    let (probes, even) = round(engine, 0)?;
    let Some(focus) = Focus::of(&probes.samples) else {
        return Ok((probes, even));
    };
    let radii = pixels.map(|p| p * probes.footprint.unwrap_or(0.0));
    let start = std::time::Instant::now();
    let of_eye = from_eye(engine, &focus)?;
    let mut of_light = Vec::new();
    let mut tree = Tree::learn(&mut of_eye.clone());
    let mut probes = probes;
    for i in 0..=ROUNDS {
        engine.guide = Guide::new(&engine.gpu, &engine.world, &focus, &tree)?;
        let (seen, photons) = round(engine, i)?;
        let brought = seen.relative(&photons, radii);
        probes = seen;
        if i == ROUNDS {
            let pixels = 4 * engine.view.pixel_count();
            let cost = |photons: &[Photon]| (pixels + engine.frame_data.paths as usize + 2 * photons.len()) as f32;
            let ratio = cost(&photons) / cost(&even);
            let u = |b: &[Brought]| b.iter().map(|b| b.path).collect::<std::collections::BTreeSet<_>>().len() as f32 / engine.frame_data.paths as f32;
            eprintln!("learned: U {:.3} -> {:.3}, cells {}, gain {:.3}, cost {ratio:.3}, {:?}", u(&probes.relative(&even, radii)), u(&brought), tree.cells.len(), gain(&brought), start.elapsed());
            if auto && gain(&brought) < 1.5 * ratio {
                engine.guide = Guide::none(&engine.gpu, &engine.world)?;
                return Ok((probes, even));
            }
            return Ok((probes, photons));
        }
        of_light.extend(from_light(engine, &brought)?);
        let mut samples = normalized(&of_light, 1.0 - EYE_SHARE);
        samples.extend(normalized(&of_eye, EYE_SHARE));
        samples.extend(normalized(&around(&of_light), HALO_SHARE));
        tree = Tree::learn(&mut samples);
    }
    Ok((probes, even))
}

/// Weights that add up to `total`.
fn normalized(samples: &[Sample], total: f32) -> Vec<Sample> {
    let sum: f64 = samples.iter().map(|s| f64::from(s.weight)).sum();
    let scaled = samples.iter().map(|s| Sample {
        weight: s.weight * total / sum as f32,
        ..*s
    });
    scaled.collect()
}

/// Samples beside others, at all distances alike on a logarithmic scale.
fn around(samples: &[Sample]) -> Vec<Sample> {
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f64 / (1u64 << 31) as f64
    };
    let halo = samples.iter().map(|s| {
        let scale = (32.0 * random()).exp2();
        let mut at = s.at;
        for axis in [3, 4] {
            let there = f64::from(at[axis]) + scale * (random() - 0.5);
            at[axis] = there.clamp(0.0, f64::from(u32::MAX)) as u32;
        }
        for axis in [5, 6] {
            at[axis] = (random() * 4294967295.0) as u32;
        }
        Sample { at, weight: s.weight, square: 0.0 }
    });
    halo.collect()
}

fn bounded(mut samples: Vec<Sample>) -> Vec<Sample> {
    let sum: f64 = samples.iter().map(|s| f64::from(s.weight)).sum();
    let most = MOST_OF_MEAN * (sum / samples.len().max(1) as f64) as f32;
    samples.iter_mut().for_each(|s| s.weight = s.weight.min(most));
    samples
}

/// What the photons of each path brought.
fn from_light(engine: &Engine, brought: &[Brought]) -> Result<Vec<Sample>> {
    let mut of_paths: BTreeMap<u32, (f32, f32)> = BTreeMap::new();
    for b in brought {
        let e = of_paths.entry(b.path).or_default();
        e.0 += b.relative;
        e.1 += b.relative * b.relative * b.density;
    }
    let gpu = &engine.gpu;
    let paths: Vec<u32> = of_paths.keys().copied().collect();
    let numbers = gpu.upload("guided paths", &paths)?;
    let primaries = gpu.buffer::<PrimarySample>("primaries", paths.len())?;
    let pass = gpu.pass("primaries", spirv("primaries")?, &[], None)?;
    let mut commands = gpu.commands()?;
    let push = PrimariesPush {
        frame: engine.traced().frame.ptr(),
        guide: engine.guide.ptr(),
        paths: numbers.ptr(),
        primaries: primaries.ptr(),
        count: paths.len() as u32,
        unused: 0,
    };
    commands.dispatch(&pass, &push, paths.len());
    commands.submit()?;
    let primaries = gpu.read(&primaries, 0..primaries.len())?;
    let samples = primaries.iter().zip(of_paths.values());
    Ok(bounded(samples
            .map(|(primary, &weight)| Sample { square: weight.1, ..sample(primary, weight.0) })
            .collect(),
))
}

/// What paths from the eye find.
fn from_eye(engine: &Engine, focus: &Focus) -> Result<Vec<Sample>> {
    let gpu = &engine.gpu;
    // Of the guide only the center matters here.
    let guide = Guide::new(gpu, &engine.world, focus, &Tree::even())?;
    let direct = engine.direct_features;
    let pass = engine.world.pass(gpu, "importance", direct, &[])?;
    let records = gpu.buffer::<Importance>("importance", (PATHS * IMPORTANCE_RECORDS) as usize)?;
    let paths = gpu.buffer::<ImportancePath>("importance paths", PATHS as usize)?;
    let mut commands = engine.commands()?;
    commands.fill(&records, 0);
    let push = ImportancePush {
        world: engine.world.world.ptr(),
        frame: engine.traced().frame.ptr(),
        guide: guide.ptr(),
        records: records.ptr(),
        paths: paths.ptr(),
        count: PATHS,
        unused: 0,
    };
    commands.dispatch(&pass, &push, PATHS as usize);
    commands.submit()?;
    let records = gpu.read(&records, 0..records.len())?;
    let paths = gpu.read(&paths, 0..paths.len())?;
    Ok(seen_by(&records, &paths))
}

fn seen_by(records: &[Importance], paths: &[ImportancePath]) -> Vec<Sample> {
    let light = block_light(paths);
    let of_paths = records.chunks_exact(IMPORTANCE_RECORDS as usize).zip(paths);
    let samples = of_paths.flat_map(|(records, path)| {
        let light = light[path.block as usize];
        let there = records.iter().filter(|record| record.weight > 0.0);
        there.map(move |record| sample(&record.primary, record.weight / light))
    });
    bounded(samples.collect())
}

fn sample(primary: &PrimarySample, weight: f32) -> Sample {
    let PrimarySample {
        light,
        place: [p, q],
        way: [v, w],
        bounce: [b, c],
    } = *primary;
    Sample {
        at: [light, p, q, v, w, b, c],
        weight,
        ..Sample::default()
    }
}

/// What to compare the light of each block of the image with.
fn block_light(paths: &[ImportancePath]) -> Vec<f32> {
    let mut blocks = vec![(0.0, 0.0); (IMPORTANCE_BLOCKS * IMPORTANCE_BLOCKS) as usize];
    for path in paths {
        let block: &mut (f32, f32) = &mut blocks[path.block as usize];
        block.0 += path.seen;
        block.1 += 1.0;
    }
    let mean = paths.iter().map(|p| p.seen).sum::<f32>() / paths.len().max(1) as f32;
    let floor = (LEAST_OF_MEAN * mean).max(f32::MIN_POSITIVE);
    blocks
        .iter()
        .map(|(sum, count)| sum / f32::max(*count, 1.0) + floor)
        .collect()
}
