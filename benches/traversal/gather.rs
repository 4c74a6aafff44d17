//! The gather of 200k photons at 512 × 512, through the passes of `rtpm`.

use crate::room::room;
use crate::{RUNS, median};
use glam::Vec3;
use lightfall::Result;
use lightfall::gpu::Gpu;
use lightfall::render::Renderer;
use lightfall::scene::Scene;
use lightfall::settings::{Direct, Length, Settings, Switch, Trace};
use std::collections::BTreeMap;

const PHOTONS: u64 = 200_000;
/// Photons that a gather finds on average.
const FOUND: [f64; 2] = [10.0, 100.0];
/// Radii [m] are looked for below this, in steps of a thousandth of it.
const RADIUS_MAX: f32 = 0.2;
const STEPS: usize = 1000;

/// Medians [ms].
struct Cost {
    sort: f64,
    build: f64,
    gather: f64,
}

pub fn run(gpu: &Gpu) -> Result<()> {
    let scene = room(8, 3);
    let (paths, counts) = calibrate(gpu, &scene)?;
    println!(
        "| gather | found | radius [m] | | sort [ms] | build [ms] | gather [ms] | build + gather | with sort |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for wish in FOUND {
        let step = counts.iter().position(|c| *c >= wish).unwrap_or(STEPS - 1);
        let radius = RADIUS_MAX * (step + 1) as f32 / STEPS as f32;
        let (costs, differ) = measure(gpu, &scene, paths, radius)?;
        let totals = costs
            .each_ref()
            .map(|c| [c.build + c.gather, c.sort + c.build + c.gather]);
        for (name, cost, total) in [
            ("software", &costs[0], totals[0]),
            ("ray query", &costs[1], totals[1]),
        ] {
            println!(
                "| 200k photons | {:.1} | {radius:.4} | {name} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} |",
                counts[step], cost.sort, cost.build, cost.gather, total[0], total[1]
            );
        }
        let [own, all] = [0, 1].map(|i| totals[1][i] / totals[0][i]);
        let gather = costs[1].gather / costs[0].gather;
        println!("| | | | ratio | | | {gather:.2} | **{own:.2}** | **{all:.2}** |");
        println!("\n{differ} of 262144 pixels differ by more than 1e-4 of their value\n");
    }
    Ok(())
}

fn settings(paths: u32, radius: f32, trace: Trace) -> Settings {
    let radius = Some(Length::World(radius));
    Settings {
        size: Some([512; 2]),
        photons: Some(paths),
        radius,
        caustic_radius: radius,
        // The radius stays what it is.
        alpha: 1.0 - f32::EPSILON,
        trace,
        // Photons everywhere, whatever the device would choose.
        cull: Switch::Off,
        direct: Direct::Photons,
        ..Settings::default()
    }
}

/// Light paths that leave [`PHOTONS`] photons, and how many of those lie on average within each
/// radius of a view sample.
fn calibrate(gpu: &Gpu, scene: &Scene) -> Result<(u32, Vec<f64>)> {
    let mut paths = 50_000;
    loop {
        let mut renderer = Renderer::new(gpu, scene, &settings(paths, 1e-3, Trace::Software))?;
        renderer.iterate()?;
        let stored = renderer
            .ledger()
            .iter()
            .find(|(name, _)| *name == "stored")
            .map_or(0, |(_, n)| *n);
        if stored.abs_diff(PHOTONS) * 100 > PHOTONS {
            paths = (u64::from(paths) * PHOTONS / stored.max(1)) as u32;
            continue;
        }
        let engine = renderer.engine();
        let photons = gpu.read(&engine.photons.photons, 0..stored as usize)?;
        let samples = gpu.read(&engine.view.samples, 0..engine.view.pixel_count())?;
        let points: Vec<Vec3> = samples
            .iter()
            .filter(|s| s.weight != [0.0; 3])
            .step_by(251)
            .map(|s| s.position_w.into())
            .collect();
        let mut counts = vec![0.0; STEPS + 1];
        for point in &points {
            for photon in &photons {
                let distance = point.distance(photon.position_w.into());
                counts[((distance / RADIUS_MAX * STEPS as f32) as usize).min(STEPS)] +=
                    1.0 / points.len() as f64;
            }
        }
        for i in 1..STEPS {
            counts[i] += counts[i - 1];
        }
        counts.truncate(STEPS);
        return Ok((paths, counts));
    }
}

/// Costs of software and ray query, and how many pixels of their last iteration's picture differ.
fn measure(gpu: &Gpu, scene: &Scene, paths: u32, radius: f32) -> Result<([Cost; 2], usize)> {
    let [software, query] = [Trace::Software, Trace::Query]
        .map(|trace| Renderer::new(gpu, scene, &settings(paths, radius, trace)));
    let mut renderers = [software?, query?];
    let mut times: [BTreeMap<&str, Vec<f64>>; 2] = Default::default();
    for run in 0..=RUNS {
        for (renderer, times) in renderers.iter_mut().zip(&mut times) {
            let before: BTreeMap<_, _> = renderer.timings().into_iter().collect();
            renderer.iterate()?;
            if run == 0 {
                continue;
            }
            let mut parts = BTreeMap::from([("sort", 0.0), ("build", 0.0), ("gather", 0.0)]);
            for (pass, ms) in renderer.timings() {
                let part = match pass {
                    "sort" | "scan" => "sort",
                    "gather" => "gather",
                    "view" | "emit" | "cull" | "film" | "host" => continue,
                    // Boxes and trees, or boxes and acceleration structures.
                    _ => "build",
                };
                *parts.entry(part).or_default() += ms - before.get(pass).unwrap_or(&0.0);
            }
            for (part, ms) in parts {
                times.entry(part).or_default().push(ms);
            }
        }
    }
    let costs = times.map(|mut times| {
        let [sort, build, gather] =
            ["sort", "build", "gather"].map(|part| times.get_mut(part).map_or(0.0, |t| median(t)));
        Cost {
            sort,
            build,
            gather,
        }
    });
    let mut beauty = Vec::new();
    for renderer in &renderers {
        beauty.push(
            renderer
                .picture()?
                .layers
                .into_iter()
                .find(|l| l.name.is_empty())
                .map_or(Vec::new(), |l| l.pixels),
        );
    }
    let differs = |(a, b): &(&[f32], &[f32])| {
        a.iter()
            .zip(*b)
            .any(|(a, b)| (a - b).abs() > 1e-4 * a.abs())
    };
    let differ = beauty[0]
        .chunks(3)
        .zip(beauty[1].chunks(3))
        .filter(differs)
        .count();
    Ok((costs, differ))
}
