//! How near each pass of `hash-grid` and `rtpm` comes to what the device can do: scene rays alone, and copies.

use crate::gather::{calibrate, parts, radius_of, settings};
use crate::rays::rates;
use crate::room::room;
use crate::{RUNS, median};
use lightfall::Result;
use lightfall::gpu::Gpu;
use lightfall::render::{Renderer, auto_trace};
use lightfall::settings::Settings;
use lightfall::shared::{FilmPixel, FramePixel, Photon, PhotonBox, PhotonPower, ViewSample};
use std::collections::BTreeMap;
use std::time::Instant;

/// In the order in which they run; `cull` and what is not the device's left out.
const PASSES: [&str; 6] = ["view", "emit", "sort", "build", "gather", "film"];
/// Photons that a gather finds on average.
const FOUND: f64 = 10.0;
/// Bytes that are copied to learn how fast memory is: more than caches hold.
const COPIED: usize = 1 << 28;

/// Of one iteration.
struct Counts {
    pixels: usize,
    paths: usize,
    photons: usize,
}

pub fn run(gpu: &Gpu) -> Result<()> {
    let scene = room(8, 3);
    let trace = auto_trace(gpu.info());
    let [camera, any_order] = rates(gpu, &scene, trace)?;
    let copied = copy_rate(gpu)?;
    println!(
        "Alone: camera rays {camera:.2} M/s, bounced rays in any order {any_order:.2} M/s; a copy moves {copied:.1} GB/s, reads and writes.\n"
    );
    println!(
        "| technique | pass | ms | rays [M/s] | of rays alone | least bytes [MB] | GB/s | of a copy |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let (paths, found) = calibrate(gpu, &scene)?;
    let (radius, _) = radius_of(&found, FOUND);
    for technique in ["hash-grid", "rtpm"] {
        let settings = Settings {
            technique: technique.into(),
            ..settings(paths, radius, trace)
        };
        let boxes = technique == "rtpm" && trace.uses_structures();
        let mut renderer = Renderer::new(gpu, &scene, &settings)?;
        renderer.iterate()?;
        renderer.restart()?;
        let mut times = BTreeMap::<&str, Vec<f64>>::new();
        for _ in 0..RUNS {
            for (part, ms) in parts(&mut renderer)? {
                times.entry(part).or_default().push(ms);
            }
        }
        let stored = renderer
            .ledger()
            .iter()
            .find(|(name, _)| *name == "stored")
            .map_or(0, |(_, n)| *n);
        let counts = Counts {
            pixels: renderer.engine().view.pixel_count(),
            paths: paths as usize,
            photons: stored as usize / RUNS,
        };
        for part in PASSES {
            let ms = median(times.entry(part).or_default());
            // Everything is diffuse, the lamp alone stores no photon, and photons bring all light.
            let rays = match part {
                "view" => Some((counts.pixels, camera)),
                "emit" => Some((counts.photons, any_order)),
                _ => None,
            };
            let rays = rays.map_or("| ".into(), |(rays, alone)| {
                let rate = rays as f64 / ms * 1e-3;
                format!("{rate:.2} | {:.2}", rate / alone)
            });
            let bytes = least_bytes(part, boxes, &counts).map_or("| | ".into(), |bytes| {
                let rate = bytes as f64 / ms * 1e-6;
                format!(
                    "{:.1} | {rate:.2} | {:.2}",
                    bytes as f64 * 1e-6,
                    rate / copied
                )
            });
            println!("| {technique} | {part} | {ms:.1} | {rays} | {bytes} |");
        }
    }
    Ok(())
}

/// What a pass reads and writes, with photons as positions or as `boxes`, if it touches everything that it needs once: what a gather reads of photons and what
/// rays read of the scene comes on top.
fn least_bytes(part: &str, boxes: bool, n: &Counts) -> Option<usize> {
    let photon = size_of::<Photon>();
    let place = match boxes {
        true => size_of::<PhotonBox>(),
        false => size_of::<[f32; 3]>(),
    } + size_of::<PhotonPower>();
    let word = size_of::<u32>();
    Some(match part {
        "view" => n.pixels * (size_of::<ViewSample>() + size_of::<FramePixel>()),
        "emit" => n.photons * photon + n.paths * word,
        // Keys and indices are made; in two passes at least keys are counted, then both are moved.
        "sort" => n.photons * (photon + 2 * word + 2 * 5 * word) + n.paths * 2 * word,
        "build" => n.photons * (word + photon + place),
        "gather" => {
            n.pixels * (size_of::<ViewSample>() + 2 * size_of::<FramePixel>()) + n.photons * place
        }
        "film" => n.pixels * (size_of::<FramePixel>() + 2 * size_of::<FilmPixel>()),
        _ => return None,
    })
}

/// Gigabytes a second that the device reads and writes as it copies.
fn copy_rate(gpu: &Gpu) -> Result<f64> {
    let from = gpu.buffer::<u32>("copied", COPIED / size_of::<u32>())?;
    let to = gpu.buffer::<u32>("copy", from.len())?;
    let mut seconds = Vec::new();
    for run in 0..=RUNS {
        let mut commands = gpu.commands()?;
        commands.copy(&from, 0..from.len(), &to, 0);
        let start = Instant::now();
        commands.submit()?;
        if run > 0 {
            seconds.push(start.elapsed().as_secs_f64());
        }
    }
    Ok(2.0 * COPIED as f64 * 1e-9 / median(&mut seconds))
}
