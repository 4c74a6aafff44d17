//! How fast radii shrink and errors fall.

use crate::check::{Device, expected, layer, settings};
use crate::closed_forms::{ALBEDO, floor_scene, on_floor};
use crate::shapes::*;
use glam::{Vec3, vec3};
use lightfall::bench::statistics::{bootstrap, slope};
use lightfall::gpu::Gpu;
use lightfall::render::Renderer;
use lightfall::scene::{Light, Scene};
use lightfall::settings::{Settings, Trace};
use std::f32::consts::PI;
use std::ops::RangeInclusive;

/// Of `sppm`: with the density of photons constant, r² goes with n^(α - 1) (Hachisuka et al. 2008), and where no photon
/// is found it stays.
#[test]
fn pixels_shrink_their_radii_as_they_find_photons() {
    const EDGE: usize = 16;
    const RADIUS: f32 = 0.05;
    let device = Device::open();
    let mut scene = floor_scene(1.5, 0.4);
    scene.lights.push(Light::Spot {
        position_w: Vec3::Y,
        direction_w: Vec3::NEG_Y,
        intensity: Vec3::ONE,
        inner_cone: 0.25,
        outer_cone: 0.3,
    });
    for (trace, alpha) in device.traversals().into_iter().zip([2.0 / 3.0, 0.5]) {
        let settings = Settings {
            technique: "sppm".into(),
            trace,
            alpha,
            ..settings(EDGE as u32, 2_000, RADIUS)
        };
        let mut renderer = Renderer::new(&device, &scene, &settings).unwrap();
        let mut log2_radius2 = Vec::new();
        for iterations in [16, 256] {
            while renderer.iterations() < iterations {
                renderer.iterate().unwrap();
            }
            let picture = renderer.picture().unwrap();
            let radius2 =
                |x: usize, y: usize| layer(&picture, "resume.sppm")[(y * EDGE + x) * 4 + 3];
            let unlit = radius2(0, 0);
            assert!((unlit / (RADIUS * RADIUS) - 1.0).abs() < 1e-6, "{unlit}");
            let middle = (0..16).map(|i| f64::from(radius2(6 + i % 4, 6 + i / 4)).log2());
            log2_radius2.push(middle.sum::<f64>() / 16.0);
        }
        let rate = (log2_radius2[1] - log2_radius2[0]) / 4.0;
        println!("α {alpha}: r² goes with n^{rate:.4}");
        assert!((rate - f64::from(alpha) + 1.0).abs() < 0.01, "{rate}");
    }
}

const EDGE: u32 = 24;
const SEEDS: u64 = 8;
/// Powers of two at which errors are measured. Earlier, the mean of r² is still below n^(-1/3) of its limit.
const LOG2_ITERATIONS: RangeInclusive<u32> = 6..=11;
const SHINE: Vec3 = vec3(3.0, 5.0, 7.0);

/// At α = 2/3 variance and squared bias of the mean of n iterations both go with n^(-2/3) (Knaus & Zwicker 2011,
/// section 4), with radii of the frame's and each pixel's own. Lamps with area: the sequences that photons start with
/// make smooth one-dimensional light less noisy than theory has it. The image's error is that of the mean square.
#[test]
#[ignore = "takes minutes; benches/README.md has what it says"]
fn errors_fall_as_theory_says() {
    let device = Device::open();
    let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let above = square.map(|(x, z)| vec3(0.2 * x, 0.35, 0.2 * z));
    let beside = square.map(|(x, y)| vec3(0.3 * x, 0.225 - 0.175 * y, 0.6));
    println!("| lamp | technique | slope | 95 % of seeds | squared bias, share at 64 and 2048 |");
    println!("|---|---|---|---|---|");
    for (what, corners) in [("above", above), ("beside", beside)] {
        let mut scene = floor_scene(2.0, 0.34);
        let shine = material(&mut scene, lamp(SHINE));
        polygon(&mut scene, &corners, shine);
        let truth = expected(&scene, EDGE, |eye, d| {
            ALBEDO * SHINE * form_factor(on_floor(eye, d), &corners)
        });
        for technique in ["rtpm", "sppm"] {
            let images: Vec<_> = (0..SEEDS)
                .map(|seed| {
                    let settings = Settings {
                        technique: technique.into(),
                        trace: Trace::Software,
                        seed,
                        ..settings(EDGE, 400, 0.15)
                    };
                    images(&device, &scene, &settings)
                })
                .collect();
            let found = bootstrap(images.len(), 1, |drawn| {
                let points: Vec<_> = LOG2_ITERATIONS
                    .zip(0..)
                    .map(|(log2, i)| {
                        let errors = drawn.iter().map(|&s| mean_square(&images[s][i], &truth));
                        [f64::from(log2), errors.sum::<f64>().log2()]
                    })
                    .collect();
                slope(&points)
            });
            let [low, high] = found.interval.unwrap();
            let [first, last] = [0, images[0].len() - 1].map(|i| bias_share(&images, i, &truth));
            println!(
                "| {what} | {technique} | {:.3} | {low:.3} … {high:.3} | {first:.2}, {last:.2} |",
                found.value
            );
            assert!(low <= -2.0 / 3.0 && -2.0 / 3.0 <= high);
            assert!(high - low < 0.2, "too noisy to tell");
        }
    }
}

/// ∫ cos / π over a polygon above a floor, seen from `p` on it (Lambert 1760).
fn form_factor(p: Vec3, corners: &[Vec3]) -> f32 {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let sum: f32 = edges
        .map(|(a, b)| [*a, *b].map(|corner| (corner - p).normalize()))
        .map(|[a, b]| a.angle_between(b) * a.cross(b).normalize().y)
        .sum();
    (sum / (2.0 * PI)).abs()
}

/// Of one seed, after each of the measured iterations.
fn images(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Vec<Vec<f32>> {
    let mut renderer = Renderer::new(gpu, scene, settings).unwrap();
    let mut images = Vec::new();
    for log2 in LOG2_ITERATIONS {
        while renderer.iterations() < 1 << log2 {
            renderer.iterate().unwrap();
        }
        images.push(layer(&renderer.picture().unwrap(), "").to_vec());
    }
    images
}

fn mean_square(a: &[f32], b: &[f32]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
    squares.sum::<f64>() / b.len() as f64
}

/// Of the mean square error of the seeds' images number `i`.
fn bias_share(images: &[Vec<Vec<f32>>], i: usize, truth: &[f32]) -> f64 {
    let seeds = images.len() as f64;
    let mean: Vec<f32> = (0..truth.len())
        .map(|p| images.iter().map(|of| of[i][p]).sum::<f32>() / seeds as f32)
        .collect();
    let about = |of: &[f32]| images.iter().map(|x| mean_square(&x[i], of)).sum::<f64>();
    let variance = about(&mean) / (seeds - 1.0);
    (mean_square(&mean, truth) - variance / seeds) / (about(truth) / seeds)
}
