//! How fast the error falls: at α = 2/3 variance and squared bias of the mean of n iterations both go with n^(-2/3)
//! (Knaus & Zwicker 2011, section 4), with radii of the frame's or each pixel's own.

use crate::check::{Device, expected, layer, settings};
use crate::closed_forms::floor_scene;
use crate::shapes::*;
use glam::{Vec3, vec3};
use lightfall::bench::statistics::{bootstrap, slope};
use lightfall::gpu::Gpu;
use lightfall::render::Renderer;
use lightfall::scene::Scene;
use lightfall::settings::{Settings, Trace};

const EDGE: u32 = 24;
const SEEDS: u64 = 8;
/// Powers of two at which the error is measured. Earlier the mean of r² still is well below its limit's n^(-1/3).
const LOG2_ITERATIONS: std::ops::RangeInclusive<u32> = 4..=9;

/// ∫ cos / π over a polygon seen from `p` on a floor (Lambert 1760).
fn form_factor(p: Vec3, corners: &[Vec3]) -> f32 {
    let n = corners.len();
    let edge = |i: usize| {
        let [a, b] = [corners[i], corners[(i + 1) % n]].map(|c| (c - p).normalize());
        a.angle_between(b) * a.cross(b).normalize().y
    };
    ((0..n).map(edge).sum::<f32>() / (2.0 * std::f32::consts::PI)).abs()
}

/// Images of one seed at each of the measured iterations.
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

fn mean_square<'a>(a: impl IntoIterator<Item = &'a f32>, b: &[f32]) -> f64 {
    let squares = a.into_iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
    squares.sum::<f64>() / b.len() as f64
}

#[test]
fn the_error_falls_as_theory_says() {
    let device = Device::open();
    let above = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(x, z)| vec3(0.2 * x, 0.35, 0.2 * z));
    let beside = [(-0.3, 0.05), (-0.3, 0.4), (0.3, 0.4), (0.3, 0.05)].map(|(x, y)| vec3(x, y, 0.6));
    for (what, corners) in [("above", above), ("beside", beside)] {
        let mut scene = floor_scene(2.0, 0.34);
        let shine = material(&mut scene, lamp(vec3(3.0, 5.0, 7.0)));
        polygon(&mut scene, &corners, shine);
        let truth = expected(&scene, EDGE, |eye, d| {
            let p = crate::closed_forms::on_floor(eye, d);
            crate::closed_forms::ALBEDO * vec3(3.0, 5.0, 7.0) * form_factor(p, &corners)
        });
        for technique in ["rtpm", "sppm"] {
            let start = std::time::Instant::now();
            let seeds: Vec<_> = (0..SEEDS)
                .map(|seed| {
                    let settings = Settings {
                        technique: technique.into(),
                        trace: Trace::Software,
                        seed,
                        ..settings(EDGE, PHOTONS, RADIUS)
                    };
                    images(&device, &scene, &settings)
                })
                .collect();
            let logs: Vec<f64> = LOG2_ITERATIONS.map(f64::from).collect();
            let curve = |drawn: &[usize], f: &dyn Fn(usize, usize) -> f64| {
                let points: Vec<_> = (0..logs.len())
                    .map(|i| {
                        let sum: f64 = drawn.iter().map(|&s| f(s, i)).sum();
                        [logs[i], (sum / drawn.len() as f64).log2()]
                    })
                    .collect();
                points
            };
            let mse = |s: usize, i: usize| mean_square(&seeds[s][i], &truth);
            let found = bootstrap(seeds.len(), 1, |drawn| slope(&curve(drawn, &mse)));
            // explore
            let all: Vec<usize> = (0..seeds.len()).collect();
            for i in 0..logs.len() {
                let n = truth.len();
                let mean: Vec<f32> = (0..n)
                    .map(|p| seeds.iter().map(|s| s[i][p]).sum::<f32>() / SEEDS as f32)
                    .collect();
                let var: f64 = seeds.iter().map(|s| mean_square(&s[i], &mean)).sum::<f64>()
                    / (SEEDS - 1) as f64;
                let b2 = mean_square(&mean, &truth) - var / SEEDS as f64;
                let m = curve(&all, &mse)[i][1].exp2();
                println!(
                    "{what} {technique} n 2^{} mse {m:e} var {:.3} bias2 {:.3}",
                    logs[i], var, b2
                );
            }
            println!("{what} {technique} slope {found:?} {:?}", start.elapsed());
        }
    }
}
const PHOTONS: u32 = 400;
const RADIUS: f32 = 0.15;
