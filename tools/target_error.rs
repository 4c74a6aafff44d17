//! How often `--target-error` is right: renders scenes with several seeds until the estimated error is below the target,
//! and compares each picture with a reference. Prints Markdown.
//!
//! `cargo run --release --example target-error -- TARGET SEEDS SCENE[=REFERENCE.exr]…`. References of any multiple of the size are
//! averaged down to it; those that are not given are rendered here by `path`, whose only error is noise, until that is
//! estimated below a sixth of the target.

use std::error::Error;
use std::path::Path;

use lightfall::gpu::{Gpu, OpenOptions};
use lightfall::image::{Rgb, read_layer};
use lightfall::metrics::{Metric, Pair};
use lightfall::render::{Accuracy, Renderer, next_look};
use lightfall::scene::{self, Scene};
use lightfall::settings::Settings;

/// Smaller images have wider pixels and so wider radii: they take longer to lose their blur.
const SIZE: [u32; 2] = [128, 128];
/// Iterations of a reference at most.
const REFERENCE_MAX: u64 = 20_000;

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
    for argument in arguments {
        let (path, file) = argument.split_once('=').unwrap_or((&argument, ""));
        let scene = scene::load(Path::new(path))?;
        let name = Path::new(path).file_stem().unwrap_or_default();
        let (reference, own) = match file {
            "" => rendered_reference(&gpu, &scene, target)?,
            file => (
                averaged_down(read_layer(Path::new(file), "")?)?,
                "of a file".into(),
            ),
        };
        let (mut errors, mut bounds, mut iterations) = (vec![], vec![], vec![]);
        for seed in 1..=seeds {
            let settings = Settings {
                size: Some(SIZE),
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
            "| {} | {own} | {right} of {seeds} | {:.4}, {largest:.4} | {:.4} | {:.0} |",
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

/// And the relative error that it is estimated to have.
fn rendered_reference(
    gpu: &Gpu,
    scene: &Scene,
    target: f64,
) -> Result<(Rgb, String), Box<dyn Error>> {
    let settings = Settings {
        size: Some(SIZE),
        technique: "path".into(),
        seed: 1000,
        ..Settings::default()
    };
    let mut renderer = Renderer::new(gpu, scene, &settings)?;
    let accuracy = render(&mut renderer, target / 6.0, REFERENCE_MAX)?;
    Ok((image(&renderer)?, format!("{:.4}", accuracy.error)))
}

fn averaged_down(image: Rgb) -> Result<Rgb, String> {
    let step = image.size[0] / SIZE[0];
    if step == 0 || image.size != SIZE.map(|edge| edge * step) {
        return Err(format!(
            "expected a multiple of {SIZE:?} px, not {:?}",
            image.size
        ));
    }
    let mut pixels = vec![0.0; (3 * SIZE[0] * SIZE[1]) as usize];
    for (i, value) in image.pixels.iter().enumerate() {
        let [x, y] = [
            i / 3 % image.size[0] as usize,
            i / 3 / image.size[0] as usize,
        ]
        .map(|at| at / step as usize);
        pixels[3 * (y * SIZE[0] as usize + x) + i % 3] += value / (step * step) as f32;
    }
    Ok(Rgb { size: SIZE, pixels })
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
