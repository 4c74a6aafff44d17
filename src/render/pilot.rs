//! Before the first iteration: one round of camera and light paths finds the radii to start with,
//! whether culling pays, and how many photons the buffers must hold.

use super::engine::Engine;
use crate::guide::{Focus, Guide, learn};
use crate::settings::{Length, Settings, Switch};
use crate::shared::ViewSample;
use crate::{Error, Result};
use glam::{IVec3, Vec3};
use std::collections::HashMap;
use std::ops::RangeInclusive;

/// Photons that a gather should find in the first iteration, at the median view sample.
const WANTED: [f32; 2] = [24.0, 48.0];
/// Between these radii in pixels: finer than a pixel gains nothing, coarser blurs what can be seen.
const PIXELS: [RangeInclusive<f32>; 2] = [1.0..=3.0, 1.5..=6.0];
/// View samples at which photons are counted.
const PROBES: usize = 4096;
/// Culling pays where it leaves at most this share of the photons.
const CULL_BELOW: f32 = 0.75;

/// Sets the first radii, culling, and buffer sizes of the engine.
pub fn prepare(engine: &mut Engine, settings: &Settings) -> Result<()> {
    engine.begin(0);
    let mut counts = engine.trace_paths()?;
    let samples = view_samples(engine)?;
    if settings.guide != Switch::Off
        && engine.frame_data.paths > 0
        && let Some(focus) = Focus::of(&samples)
    {
        let start = std::time::Instant::now();
        let tree = learn(engine, &focus)?;
        eprintln!("learned {} cells in {:?}, focus {focus:?}", tree.cells.len(), start.elapsed());
        engine.guide = Guide::new(&engine.gpu, &engine.world, &focus, &tree)?;
        engine.begin(0);
        counts = engine.trace_paths()?;
    }
    let photons = engine.traced().positions(&engine.gpu, counts)?;
    let stored = counts[0] + counts[1];

    let pixel = pixel_footprint(&samples).unwrap_or(engine.world.radius() * 1e-3);
    let least = engine.world.resolution();
    let wishes = [
        ("--caustic-radius", settings.caustic_radius),
        ("--radius", settings.radius),
    ];
    for (map, (option, wish)) in wishes.into_iter().enumerate() {
        let radius = match wish {
            Some(Length::World(radius)) => at_least(least, radius, option)?,
            Some(Length::Pixels(pixels)) => at_least(least, pixels * pixel, option)?,
            None => {
                let probe = PIXELS[map].end() * pixel;
                let found = median_found(&samples, &photons[map], probe).unwrap_or(0.0);
                let wanted = (WANTED[map] / found.max(1e-3)).sqrt() * PIXELS[map].end();
                let wanted = wanted.clamp(*PIXELS[map].start(), *PIXELS[map].end()) * pixel;
                round(wanted.max(2.0 * least))
            }
        };
        engine.first_radius2[map] = f64::from(radius) * f64::from(radius);
    }

    engine.frame_data.cull = match settings.cull {
        Switch::On => 1,
        Switch::Off => 0,
        Switch::Auto => {
            engine.frame_data.cull = 1;
            engine.begin(0);
            let [caustic, global] = engine.trace_paths()?;
            u32::from(((caustic + global) as f32) < CULL_BELOW * stored as f32)
        }
    };
    engine.forget_measurements();
    Ok(())
}

/// A radius (m) that was asked for, if positions can be told apart so finely.
fn at_least(least: f32, radius: f32, option: &'static str) -> Result<f32> {
    if radius >= least {
        return Ok(radius);
    }
    Err(Error::Option {
        option,
        fault: format!(
            "{radius:e} m is below the {least:e} m to which the positions of this scene are known"
        ),
    })
}

/// To 8 bits of mantissa, so that devices whose last bits differ start alike, and one can go on where
/// another stopped.
fn round(radius: f32) -> f32 {
    f32::from_bits(radius.to_bits() & 0xffff_8000)
}

fn view_samples(engine: &Engine) -> Result<Vec<ViewSample>> {
    let mut samples = engine
        .gpu
        .read(&engine.traced().samples, 0..engine.view.pixel_count())?;
    samples.retain(|s| s.weight != [0.0; 3]);
    Ok(samples)
}

/// Width [m] that a pixel has at the median view sample.
fn pixel_footprint(samples: &[ViewSample]) -> Option<f32> {
    let mut footprints: Vec<f32> = samples.iter().map(|s| s.footprint).collect();
    median(&mut footprints)
}

fn median(values: &mut [f32]) -> Option<f32> {
    values.sort_unstable_by(f32::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Photons within `radius` of the median view sample, among those that find any.
fn median_found(samples: &[ViewSample], photons: &[Vec3], radius: f32) -> Option<f32> {
    let cell = |p: Vec3| (p / radius).floor().as_ivec3();
    let mut grid: HashMap<IVec3, Vec<Vec3>> = HashMap::new();
    for &p in photons {
        grid.entry(cell(p)).or_default().push(p);
    }
    let step = samples.len().div_ceil(PROBES).max(1);
    let mut found: Vec<f32> = samples
        .iter()
        .step_by(step)
        .map(|sample| {
            let at = Vec3::from(sample.position_w);
            let near = (0..27).map(|i| cell(at) + IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
            let photons = near.filter_map(|c| grid.get(&c)).flatten();
            photons
                .filter(|p| p.distance_squared(at) <= radius * radius)
                .count() as f32
        })
        .filter(|&n| n > 0.0)
        .collect();
    median(&mut found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_photons_about_the_median_sample() {
        let sample = |x: f32| ViewSample {
            position_w: [x, 0.0, 0.0],
            ..Default::default()
        };
        let photons = [0.05, -0.09, 0.2, 10.0, 10.01, 10.02].map(|x| Vec3::new(x, 0.0, 0.0));
        assert_eq!(median_found(&[sample(0.0)], &photons, 0.1), Some(2.0));
        // The sample that finds nothing does not count.
        assert_eq!(
            median_found(&[sample(10.0), sample(50.0)], &photons, 0.1),
            Some(3.0)
        );
        assert_eq!(median_found(&[sample(50.0)], &photons, 0.1), None);
    }
}
