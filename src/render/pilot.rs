//! Before the first iteration: a few rounds of camera and light paths find where light paths should
//! begin, the radii to start with, whether culling pays, and how many photons the buffers must
//! hold.

use super::engine::Engine;
use crate::guide::{Probes, learn};
use crate::settings::{Length, Settings, Switch};
use crate::shared::Photon;
use crate::{Error, Result};
use std::ops::RangeInclusive;

/// Photons that a gather should find in the first iteration, at the median view sample.
const WANTED: [f32; 2] = [24.0, 48.0];
/// Between these radii in pixels: finer than a pixel gains nothing, coarser blurs what can be seen.
const PIXELS: [RangeInclusive<f32>; 2] = [1.0..=3.0, 1.5..=6.0];
/// Culling pays where it leaves at most this share of the photons.
const CULL_BELOW: f32 = 0.75;

/// Sets the guide, the first radii, culling, and buffer sizes of the engine.
pub fn prepare(engine: &mut Engine, settings: &Settings) -> Result<()> {
    let pixels = PIXELS.map(|p| *p.end());
    let (probes, photons, lesson) =
        learn(engine, settings.guide, settings.photons.is_some(), pixels)?;
    engine.lesson = lesson;
    first_radii(engine, settings, &probes, &photons)?;
    engine.frame_data.cull = match settings.cull {
        Switch::On => 1,
        Switch::Off => 0,
        Switch::Auto => {
            engine.frame_data.cull = 1;
            engine.begin(0);
            let [caustic, global] = engine.trace_paths()?;
            u32::from(((caustic + global) as f32) < CULL_BELOW * photons.len() as f32)
        }
    };
    engine.forget_measurements();
    Ok(())
}

fn first_radii(
    engine: &mut Engine,
    settings: &Settings,
    probes: &Probes,
    photons: &[Photon],
) -> Result<()> {
    let pixel = probes.footprint.unwrap_or(engine.world.radius() * 1e-3);
    let least = probes
        .resolution
        .unwrap_or_else(|| engine.world.resolution());
    let wishes = [
        ("--caustic-radius", settings.caustic_radius),
        ("--radius", settings.radius),
    ];
    for (map, (option, wish)) in wishes.into_iter().enumerate() {
        let radius = match wish {
            Some(Length::World(radius)) => at_least(least, radius, option)?,
            Some(Length::Pixels(pixels)) => at_least(least, pixels * pixel, option)?,
            None => {
                let [start, end] = [*PIXELS[map].start(), *PIXELS[map].end()];
                let found = probes.median_found(photons, map as u32, end * pixel);
                let wanted = (WANTED[map] / found.unwrap_or(0.0).max(1e-3)).sqrt() * end;
                round_bits((wanted.clamp(start, end) * pixel).max(2.0 * least))
            }
        };
        engine.first_radius2[map] = f64::from(radius) * f64::from(radius);
    }
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
            "{radius:e} m is below the {least:e} m to which the positions seen here are known"
        ),
    })
}

/// To 8 bits of mantissa, so that devices whose last bits differ start alike, and one can go on
/// where another stopped.
fn round_bits(radius: f32) -> f32 {
    f32::from_bits(radius.to_bits() & 0xffff_8000)
}
