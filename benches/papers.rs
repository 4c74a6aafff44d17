//! Scenes at the settings of Kern et al. 2023 (sections 4.1 and 4.3): `rtpm` with and without culling and stochastic
//! evaluation beside the hash tables, in one process on one device. Iterations take turns, and the ratio of medians is
//! what counts. Prints Markdown.
//!
//! `cargo bench --bench papers -- [-n ITERATIONS] SCENE=PHOTONS…`, photons being light paths an iteration.
//! `LIGHTFALL_DEVICE` names a device.

mod common;

use common::{median, open};
use lightfall::gpu::Gpu;
use lightfall::render::Renderer;
use lightfall::scene::{self, Scene};
use lightfall::settings::{Direct, Evaluate, Settings, Switch};
use lightfall::{Error, Result};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

/// Of a table's columns; `other` passes follow.
const PASSES: &[&str] = &["view", "cull", "emit", "sort", "build", "gather", "host"];

/// Technique, culling, stochastic evaluation: the table 4 of the paper, then its rivals.
const VARIANTS: &[(&str, bool, bool)] = &[
    ("rtpm", false, false),
    ("rtpm", true, false),
    ("rtpm", false, true),
    ("rtpm", true, true),
    ("hash-grid", true, false),
    ("hash-ppm", true, false),
    ("stochastic-hash", true, false),
];

fn main() -> Result<()> {
    // What cargo adds is no scene.
    let mut words = std::env::args().skip(1).filter(|word| word != "--bench");
    let (mut iterations, mut scenes) = (3, Vec::new());
    while let Some(word) = words.next() {
        match (word.as_str(), word.split_once('=')) {
            ("-n", _) => iterations = number("-n", &words.next().unwrap_or_default())?,
            (_, Some((path, photons))) => scenes.push((path.to_string(), number(path, photons)?)),
            _ => return Err(fault(&word, "SCENE=PHOTONS is asked for")),
        }
    }
    let (gpu, what) = open()?;
    println!("{what}, medians of {iterations} iterations in turn, after one to warm up\n");
    println!(
        "| scene | technique | culling | stochastic | stored: caustic, global | ms an iteration | of the first's | {} | other |",
        PASSES.join(" | ")
    );
    println!("|{}", "---|".repeat(8 + PASSES.len()));
    for (path, photons) in scenes {
        measure(&gpu, &scene::load(Path::new(&path))?, photons, iterations)?;
    }
    Ok(())
}

fn fault(word: &str, fault: &str) -> Error {
    Error::Option {
        option: "papers",
        fault: format!("{word}: {fault}"),
    }
}

fn number(of: &str, digits: &str) -> Result<u32> {
    let number = digits.parse().ok().filter(|&n| n > 0);
    number.ok_or_else(|| fault(of, "a number above 0 is asked for"))
}

/// Times (ms) of a variant: those of iterations, and sums over passes.
struct Times {
    renderer: Renderer,
    iterations: Vec<f64>,
    passes: BTreeMap<&'static str, f64>,
}

/// The rows of one scene.
fn measure(gpu: &Gpu, scene: &Scene, photons: u32, iterations: u32) -> Result<()> {
    let mut all = Vec::new();
    for &(technique, cull, stochastic) in VARIANTS {
        let settings = Settings {
            size: Some([1920, 1080]),
            photons: Some(photons),
            max_depth: 10,
            direct: Direct::Photons,
            reject: 0.7,
            reservoir: 3,
            technique: technique.into(),
            cull: if cull { Switch::On } else { Switch::Off },
            evaluate: match stochastic {
                true => Evaluate::Stochastic,
                false => Evaluate::Full,
            },
            ..Settings::default()
        };
        let mut renderer = Renderer::new(gpu, scene, &settings)?;
        // Compiles pipelines and warms caches.
        renderer.iterate()?;
        renderer.restart()?;
        all.push(Times {
            renderer,
            iterations: Vec::new(),
            passes: BTreeMap::new(),
        });
    }
    for _ in 0..iterations {
        for times in &mut all {
            let start = Instant::now();
            times.renderer.iterate()?;
            let ms = start.elapsed().as_secs_f64() * 1e3;
            times.iterations.push(ms);
        }
    }
    let mut first = None;
    for (times, (technique, cull, stochastic)) in all.iter_mut().zip(VARIANTS) {
        let ms = median(&mut times.iterations);
        for (pass, ms) in times.renderer.timings() {
            let name = match pass {
                "scan" => "sort",
                "gather stochastic" => "gather",
                _ => PASSES
                    .iter()
                    .find(|p| **p == pass)
                    .copied()
                    .unwrap_or("other"),
            };
            *times.passes.entry(name).or_default() += ms / f64::from(iterations);
        }
        let of = |name: &str| format!("{:.1}", times.passes.get(name).unwrap_or(&0.0));
        let columns: Vec<_> = PASSES.iter().map(|name| of(name)).collect();
        let [caustic, stored] = ["stored, caustic", "stored"].map(|name| {
            let ledger = times.renderer.ledger();
            let sum = ledger
                .iter()
                .find(|(n, _)| *n == name)
                .map_or(0, |(_, n)| *n);
            sum / u64::from(iterations)
        });
        let yes = |on: &bool| if *on { "yes" } else { "" };
        println!(
            "| {} | {technique} | {} | {} | {caustic}, {} | {ms:.1} | **{:.2}** | {} | {} |",
            scene.path.file_stem().unwrap_or_default().display(),
            yes(cull),
            yes(stochastic),
            stored - caustic,
            ms / *first.get_or_insert(ms),
            columns.join(" | "),
            of("other"),
        );
    }
    Ok(())
}
