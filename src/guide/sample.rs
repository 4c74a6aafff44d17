//! What a guide is learned from: primary samples and what they are worth, found from the eye and
//! from lights.

use super::probes::Brought;
use super::tree::Sample;
use super::{Focus, Guide, Tree};
use crate::Result;
use crate::render::Engine;
use crate::shaders::spirv;
use crate::shared::*;
use std::collections::BTreeMap;

/// Paths from the eye.
const PATHS: u32 = 1 << 16;
/// What one path found counts for so many times the mean at most: a rare bright one says little
/// about where others are.
const MOST_OF_MEAN: f32 = 50.0;
/// Light is seen relative to what the block of the image has in all, and to this share of the
/// image's mean.
const LEAST_OF_MEAN: f32 = 0.1;

/// What paths from the eye find.
pub struct FromEye {
    pub samples: Vec<Sample>,
    /// There is light for the caustic and the global map.
    pub maps: [bool; 2],
}

/// Asks for light with paths from the eye (`glsl/guide/importance.comp`).
pub fn from_eye(engine: &Engine, focus: &Focus) -> Result<FromEye> {
    let gpu = &engine.gpu;
    // Of the guide only the focus matters here.
    let guide = Guide::new(gpu, &engine.world, focus, &Tree::even())?;
    let features = engine.direct_features;
    let pass = engine.world.pass(gpu, "importance", features, &[])?;
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
    let light = block_light(&paths);
    let of_paths = records.chunks_exact(IMPORTANCE_RECORDS as usize).zip(paths);
    let samples = of_paths.flat_map(|(records, path)| {
        let light = light[path.block as usize];
        let there = records.iter().filter(|record| record.weight != 0.0);
        there.map(move |record| Sample {
            at: numbers(&record.primary),
            weight: record.weight.abs() / light,
            square: 0.0,
        })
    });
    Ok(FromEye {
        samples: bounded(samples.collect()),
        maps: [
            records.iter().any(|record| record.weight < 0.0),
            records.iter().any(|record| record.weight > 0.0),
        ],
    })
}

/// What to compare the light of each block of the image with.
fn block_light(paths: &[ImportancePath]) -> Vec<f32> {
    let mut blocks = vec![[0.0; 2]; (IMPORTANCE_BLOCKS * IMPORTANCE_BLOCKS) as usize];
    for path in paths {
        let block: &mut [f32; 2] = &mut blocks[path.block as usize];
        block[0] += path.seen;
        block[1] += 1.0;
    }
    let mean = paths.iter().map(|p| p.seen).sum::<f32>() / paths.len().max(1) as f32;
    let floor = (LEAST_OF_MEAN * mean).max(f32::MIN_POSITIVE);
    let means = blocks.iter().map(|[sum, count]| sum / count.max(1.0));
    means.map(|mean| mean + floor).collect()
}

/// What the photons of each light path of the iteration under way brought.
pub fn from_light(engine: &Engine, brought: &[Brought]) -> Result<Vec<Sample>> {
    let mut of_paths: BTreeMap<u32, (f32, f32)> = BTreeMap::new();
    for b in brought {
        let (sum, square) = of_paths.entry(b.path).or_default();
        *sum += b.relative;
        // So rare with the guide's density, and as strong without.
        *square += b.relative * b.relative * b.density;
    }
    let paths: Vec<u32> = of_paths.keys().copied().collect();
    let samples = primaries(engine, &paths)?
        .into_iter()
        .zip(of_paths.values());
    let samples = samples.map(|(at, &(weight, square))| Sample { at, weight, square });
    Ok(bounded(samples.collect()))
}

/// Where light paths of the iteration under way began.
pub fn primaries(engine: &Engine, paths: &[u32]) -> Result<Vec<[u32; 7]>> {
    let gpu = &engine.gpu;
    let pass = gpu.pass("primaries", spirv("primaries")?, &[], None)?;
    let count = paths.len();
    let paths = gpu.upload("paths", paths)?;
    let primaries = gpu.buffer::<PrimarySample>("primaries", count)?;
    let mut commands = engine.commands()?;
    let push = PrimariesPush {
        frame: engine.traced().frame.ptr(),
        guide: engine.guide.ptr(),
        paths: paths.ptr(),
        primaries: primaries.ptr(),
        count: count as u32,
        unused: 0,
    };
    commands.dispatch(&pass, &push, count);
    commands.submit()?;
    let primaries = gpu.read(&primaries, 0..count)?;
    Ok(primaries.iter().map(numbers).collect())
}

fn numbers(primary: &PrimarySample) -> [u32; 7] {
    let [place, way, bounce] = [primary.place, primary.way, primary.bounce];
    [
        primary.light,
        place[0],
        place[1],
        way[0],
        way[1],
        bounce[0],
        bounce[1],
    ]
}

/// None far above the mean.
pub fn bounded(mut samples: Vec<Sample>) -> Vec<Sample> {
    let sum: f64 = samples.iter().map(|s| f64::from(s.weight)).sum();
    let most = MOST_OF_MEAN * (sum / samples.len().max(1) as f64) as f32;
    for sample in &mut samples {
        sample.weight = sample.weight.min(most);
    }
    samples
}

/// Weights that add up to `total`.
pub fn normalized(samples: &[Sample], total: f32) -> impl Iterator<Item = Sample> {
    let sum: f64 = samples.iter().map(|s| f64::from(s.weight)).sum();
    let scale = total / sum as f32;
    samples.iter().map(move |s| Sample {
        weight: s.weight * scale,
        ..*s
    })
}

/// Samples that begin beside others, at all distances alike on a logarithmic scale. What surfaces
/// beside a place send there falls with the square of the distance, and so does the density of
/// these: so that what comes from afar, which was found too seldom to be learned, is not left with
/// the light of all the scene on a few photons.
pub fn around(samples: &[Sample]) -> Vec<Sample> {
    const WAYS: [usize; 2] = [3, 4];
    const BOUNCES: [usize; 2] = [5, 6];
    let mut state = 1_u64;
    // In [0, 1) (Knuth's MMIX generator).
    let mut random = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 32) as f64 / 4294967296.0
    };
    let beside = samples.iter().map(|sample| {
        let mut at = sample.at;
        let distance = (32.0 * random()).exp2();
        for axis in WAYS {
            let there = f64::from(at[axis]) + distance * (random() - 0.5);
            at[axis] = there.clamp(0.0, f64::from(u32::MAX)) as u32;
        }
        for axis in BOUNCES {
            at[axis] = (4294967296.0 * random()) as u32;
        }
        Sample {
            at,
            square: 0.0,
            ..*sample
        }
    });
    beside.collect()
}
