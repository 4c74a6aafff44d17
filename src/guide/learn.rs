//! Learns where light paths should begin from paths of the eye (see `glsl/guide/importance.comp`).

use super::Guide;
use super::tree::{Sample, Tree};
use crate::Result;
use crate::render::Engine;
use crate::shared::*;
use glam::Vec3;

/// Paths from the eye.
const PATHS: u32 = 1 << 16;
/// What one of them found counts for so many times the mean at most: a rare bright one says little about where others are.
const MOST_OF_MEAN: f32 = 100.0;
/// Light is seen relative to what the block of the image has in all, and to this share of the image's mean.
const LEAST_OF_MEAN: f32 = 0.1;

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

/// A tree for the engine's scene, camera and lights.
pub fn learn(engine: &Engine, focus: &Focus) -> Result<Tree> {
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
    Ok(Tree::learn(&mut samples(&records, &paths)))
}

/// Both maps count alike: caustic photons are few, and matter most where they are.
fn samples(records: &[Importance], paths: &[ImportancePath]) -> Vec<Sample> {
    let light = block_light(paths);
    let mut samples: [Vec<Sample>; 2] = [Vec::new(), Vec::new()];
    for (of_path, path) in records.chunks_exact(IMPORTANCE_RECORDS as usize).zip(paths) {
        for record in of_path {
            for (samples, weight) in samples.iter_mut().zip(record.weight) {
                if weight > 0.0 {
                    let [[p, q], [v, w]] = [record.place, record.way];
                    samples.push(Sample {
                        at: [record.light, p, q, v, w],
                        weight: weight / light[path.block as usize],
                    });
                }
            }
        }
    }
    for samples in &mut samples {
        let sum = |samples: &[Sample]| samples.iter().map(|s| f64::from(s.weight)).sum::<f64>();
        let most = MOST_OF_MEAN * (sum(samples) / samples.len().max(1) as f64) as f32;
        samples.iter_mut().for_each(|s| s.weight = s.weight.min(most));
        let total = sum(samples) as f32;
        samples.iter_mut().for_each(|s| s.weight /= total);
    }
    samples.concat()
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
