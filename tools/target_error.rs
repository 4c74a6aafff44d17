//! How often `--target-error` is right: renders scenes with several seeds until the estimated error is below the target,
//! and compares each picture with a reference. Prints Markdown.
//!
//! `cargo run --release --example target-error -- TARGET SEEDS SCENE…`. References are rendered here, from another
//! seed, with radii that begin at a pixel, until their own error is a sixth of the target; it is printed.

use std::error::Error;
use std::path::Path;

use lightfall::gpu::{Gpu, OpenOptions};
use lightfall::image::Rgb;
use lightfall::metrics::{Metric, Pair};
use lightfall::render::{Accuracy, Renderer, next_look};
use lightfall::scene::{self, Scene};
use lightfall::settings::{Length, Settings};

const SIZE: [u32; 2] = [64, 64];
/// Few: what matters here is how often the estimate is right, not how soon.
const PHOTONS: u32 = 20_000;
/// Iterations of a reference at most.
const REFERENCE_MAX: u64 = 4_000;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut next = |what| arguments.next().ok_or(format!("expected {what}"));
    let target: f64 = next("a target, such as 0.05")?.parse()?;
    let seeds: u64 = next("how many seeds")?.parse()?;
    let gpu = Gpu::open(&OpenOptions::default())?;
    println!(
        "| scene | error of the reference | pictures below {target} | errors: median, largest | estimated bound | iterations |"
    );
    println!("|---|---|---|---|---|---|");
    for path in arguments {
        let scene = scene::load(Path::new(&path))?;
        let name = Path::new(&path).file_stem().unwrap_or_default();
        let (reference, own) = reference(&gpu, &scene, target)?;
        let (mut errors, mut bounds, mut iterations) = (vec![], vec![], vec![]);
        for seed in 1..=seeds {
            let settings = Settings {
                size: Some(SIZE),
                photons: Some(PHOTONS),
                seed,
                ..Settings::default()
            };
            let mut renderer = Renderer::new(&gpu, &scene, &settings)?;
            let accuracy = render(&mut renderer, target, u64::MAX)?;
            let pair = Pair::new(&image(&renderer)?, &reference)?;
            errors.push(pair.measure(Metric::Relative).value);
            bounds.push(accuracy.error_95);
            iterations.push(renderer.iterations() as f64);
        }
        let right = errors.iter().filter(|e| **e <= target).count();
        let largest = errors.iter().copied().fold(0.0, f64::max);
        println!(
            "| {} | {own:.4} | {right} of {seeds} | {:.4}, {largest:.4} | {:.4} | {:.0} |",
            name.display(),
            median(&mut errors),
            median(&mut bounds),
            median(&mut iterations),
        );
    }
    Ok(())
}

/// Iterates until the estimated error is below `target`.
fn render(renderer: &mut Renderer, target: f64, most: u64) -> Result<Accuracy, Box<dyn Error>> {
    let mut look = next_look(0);
    loop {
        renderer.iterate()?;
        if renderer.iterations() < look.min(most) {
            continue;
        }
        look = next_look(renderer.iterations());
        let accuracy = renderer.accuracy()?;
        if accuracy.error_95 <= target || renderer.iterations() >= most {
            return Ok(accuracy);
        }
    }
}

fn reference(gpu: &Gpu, scene: &Scene, target: f64) -> Result<(Rgb, f64), Box<dyn Error>> {
    let settings = Settings {
        size: Some(SIZE),
        photons: Some(PHOTONS),
        seed: 1000,
        radius: Some(Length::Pixels(1.0)),
        caustic_radius: Some(Length::Pixels(1.0)),
        ..Settings::default()
    };
    let mut renderer = Renderer::new(gpu, scene, &settings)?;
    let accuracy = render(&mut renderer, target / 6.0, REFERENCE_MAX)?;
    Ok((image(&renderer)?, accuracy.error))
}

fn image(renderer: &Renderer) -> Result<Rgb, Box<dyn Error>> {
    let layers = renderer.picture()?.layers;
    let beauty = layers.into_iter().find(|l| l.name.is_empty());
    Ok(Rgb {
        size: SIZE,
        pixels: beauty.ok_or("no beauty layer")?.pixels,
    })
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
