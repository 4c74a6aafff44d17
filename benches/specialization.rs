//! What it buys that a scene pays only for what it uses: each scene as it is rendered beside the same with everything
//! switched on, in one process on one device. Iterations take turns, and the median of the ratios of pairs is what counts.
//! Prints Markdown; fails where the two pictures differ.
//!
//! `cargo bench --bench specialization -- [-t TECHNIQUE] [SCENE…]`; without scenes, those of `scenes/`.
//! `LIGHTFALL_DEVICE` names a device.

mod common;

use common::{median, open};
use lightfall::gpu::Gpu;
use lightfall::render::Renderer;
use lightfall::scene::{self, Scene};
use lightfall::settings::{Evaluate, Settings};
use lightfall::technique::TECHNIQUES;
use lightfall::world::{everything, features};
use lightfall::{Error, Result};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Pairs of iterations, after one that compiles pipelines and warms caches.
const PAIRS: usize = 9;
const SIZE: [u32; 2] = [256, 256];
/// A channel of a pixel may differ by this share of its value, or of the picture's mean.
const TOLERANCE: f32 = 1e-4;
/// Of all channels: a path that rounding turned another way, past an edge, changes what it meets.
const MAY_DIFFER: f64 = 1e-3;

fn main() -> Result<()> {
    // What cargo adds is no scene.
    let mut words = std::env::args().skip(1).filter(|word| word != "--bench");
    let (mut technique, mut scenes) = ("hash-grid".to_string(), Vec::new());
    while let Some(word) = words.next() {
        match word.as_str() {
            "-t" => technique = words.next().unwrap_or_default(),
            _ => scenes.push(PathBuf::from(word)),
        }
    }
    if scenes.is_empty() {
        let all = std::fs::read_dir("scenes").map_err(|e| Error::io(Path::new("scenes"), e))?;
        scenes.extend(all.flatten().map(|entry| entry.path()));
        scenes.retain(|path| path.extension().is_some_and(|e| e == "glb"));
        scenes.sort();
    }
    let (gpu, what) = open()?;
    let [width, height] = SIZE;
    println!("{what}, {technique}, medians of {PAIRS} pairs in turn, {width} × {height}\n");
    println!(
        "| scene | as it is [ms] | everything on [ms] | ratio | least, most | view | emit | others | channels that differ |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for path in scenes {
        compare(&gpu, &scene::load(&path)?, &technique)?;
    }
    Ok(())
}

/// One row of the table.
fn compare(gpu: &Gpu, scene: &Scene, technique: &str) -> Result<()> {
    let settings = Settings {
        size: Some(SIZE),
        technique: technique.into(),
        // The choice between two ways to evaluate hangs on their times.
        evaluate: Evaluate::Full,
        ..Settings::default()
    };
    let row = TECHNIQUES.iter().find(|row| row.name == technique);
    let row = row.ok_or_else(|| Error::Option {
        option: "-t",
        fault: format!("there is no technique {technique}"),
    })?;
    let renderer = |bits| Renderer::with_features(gpu, scene, &settings, row, bits);
    let mut renderers = [renderer(features(scene))?, renderer(everything())?];
    for renderer in &mut renderers {
        renderer.iterate()?;
        renderer.restart()?;
    }
    let (mut times, mut ratios) = ([Vec::new(), Vec::new()], Vec::new());
    for pair in 0..PAIRS {
        let mut ms = [0.0; 2];
        // Neither is always the first.
        for i in [pair % 2, 1 - pair % 2] {
            let start = Instant::now();
            renderers[i].iterate()?;
            ms[i] = start.elapsed().as_secs_f64() * 1e3;
            times[i].push(ms[i]);
        }
        ratios.push(ms[1] / ms[0]);
    }
    let [specialized, all] = times.each_mut().map(|times| median(times));
    let ratio = median(&mut ratios);
    let passes = renderers.each_ref().map(|renderer| {
        let of = |name: &str| {
            let timings = renderer.timings();
            timings.iter().find(|t| t.0 == name).map_or(0.0, |t| t.1)
        };
        let total: f64 = renderer.timings().iter().map(|t| t.1).sum();
        let (view, emit) = (of("view") + of("path"), of("emit"));
        [view, emit, total - view - emit]
    });
    let of_pass = |i: usize| match passes[0][i] > 0.0 {
        true => format!("{:.2}", passes[1][i] / passes[0][i]),
        false => "–".into(),
    };
    let (differ, pixels) = difference(&renderers)?;
    println!(
        "| {} | {specialized:.1} | {all:.1} | **{ratio:.2}** | {:.2}, {:.2} | {} | {} | {} | {differ} of {pixels} |",
        scene.path.file_stem().unwrap_or_default().display(),
        ratios.first().unwrap_or(&f64::NAN),
        ratios.last().unwrap_or(&f64::NAN),
        of_pass(0),
        of_pass(1),
        of_pass(2),
    );
    if differ as f64 > MAY_DIFFER * pixels as f64 {
        return Err(Error::scene(
            &scene.path,
            "the specialized picture is another",
        ));
    }
    Ok(())
}

/// Channels of the image that differ between the two, of how many.
fn difference(renderers: &[Renderer; 2]) -> Result<(usize, usize)> {
    let mut beauties = Vec::new();
    for renderer in renderers {
        let layers = renderer.picture()?.layers;
        let beauty = layers.into_iter().find(|layer| layer.name.is_empty());
        beauties.push(beauty.map_or(Vec::new(), |layer| layer.pixels));
    }
    let [a, b] = [&beauties[0], &beauties[1]];
    let mean = a.iter().sum::<f32>() / a.len() as f32;
    let differs = |(a, b): &(&f32, &f32)| (*a - *b).abs() > TOLERANCE * a.abs().max(mean);
    let differ = a.iter().zip(b).filter(differs).count();
    Ok((differ + a.len().abs_diff(b.len()), a.len()))
}
