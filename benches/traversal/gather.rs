//! The gather of 200k photons at 512 × 512, through the passes of `rtpm`.

use crate::cells::CELLS;
use crate::room::room;
use crate::{RUNS, median};
use glam::Vec3;
use lightfall::Result;
use lightfall::gpu::Gpu;
use lightfall::render::Renderer;
use lightfall::scene::Scene;
use lightfall::settings::{Direct, Length, Settings, Switch, Trace};
use lightfall::technique::{Row, TECHNIQUES};
use std::collections::BTreeMap;

const PHOTONS: u64 = 200_000;
/// Photons that a gather finds on average.
const FOUND: [f64; 2] = [10.0, 100.0];
/// Radii [m] are looked for below this, in steps of a thousandth of it.
const RADIUS_MAX: f32 = 0.2;
const STEPS: usize = 1000;

/// Medians [ms], the sum of each run, and how many pixels of the last iteration's picture differ from the first
/// variant's by more than 1e-4 of their value.
struct Cost {
    sort: f64,
    build: f64,
    gather: f64,
    sums: Vec<f64>,
    differ: usize,
}

/// The variant that all others are held to.
const FIRST: &str = "row grid";

/// What searches: a name, a technique, a traversal.
type Variant = (&'static str, &'static Row, Trace);

/// All that search on this device and are `wanted`, the row grid first.
fn variants(gpu: &Gpu, wanted: impl Fn(&str) -> bool) -> Vec<Variant> {
    let caps = &gpu.info().caps;
    let row = |name| TECHNIQUES.iter().find(move |row| row.name == name);
    [
        (FIRST, row("hash-grid"), Trace::Software),
        ("tree", row("rtpm"), Trace::Software),
        ("eight cells", Some(&CELLS), Trace::Software),
        ("lists", row("hash-ppm"), Trace::Software),
        ("one of a cell", row("stochastic-hash"), Trace::Software),
        ("ray query", row("rtpm"), Trace::Query),
        ("pipeline", row("rtpm"), Trace::Pipeline),
    ]
    .into_iter()
    .filter(|v| v.2 != Trace::Query || caps.ray_query)
    .filter(|v| v.2 != Trace::Pipeline || caps.ray_tracing_pipeline)
    .filter(|v| v.0 == FIRST || wanted(v.0))
    .filter_map(|(name, row, trace)| Some((name, row?, trace)))
    .collect()
}

pub fn run(gpu: &Gpu, wanted: impl Fn(&str) -> bool) -> Result<()> {
    let scene = room(8, 3);
    let (paths, counts) = calibrate(gpu, &scene)?;
    let variants = variants(gpu, wanted);
    println!(
        "| found | radius [m] | photons in | sort [ms] | build [ms] | gather [ms] | sum [ms] | of the row grid's | least, most | pixels that differ |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for wish in FOUND {
        let (radius, found) = radius_of(&counts, wish);
        let costs = measure(gpu, &scene, paths, radius, &variants)?;
        for (variant, cost) in variants.iter().zip(&costs) {
            // Of each turn: machines are slow for a while, and for all alike.
            let mut ratios: Vec<f64> = cost
                .sums
                .iter()
                .zip(&costs[0].sums)
                .map(|(sum, first)| sum / first)
                .collect();
            let ratio = median(&mut ratios);
            println!(
                "| {found:.1} | {radius:.4} | {} | {:.1} | {:.1} | {:.1} | {:.1} | **{ratio:.2}** | {:.2}, {:.2} | {} |",
                variant.0,
                cost.sort,
                cost.build,
                cost.gather,
                median(&mut cost.sums.clone()),
                ratios[0],
                ratios[ratios.len() - 1],
                cost.differ,
            );
        }
    }
    println!();
    Ok(())
}

pub fn settings(paths: u32, radius: f32, trace: Trace) -> Settings {
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
/// radius of a view sample (see [`radius_of`]).
pub fn calibrate(gpu: &Gpu, scene: &Scene) -> Result<(u32, Vec<f64>)> {
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
        let photons = gpu.read(&engine.traced().photons, 0..stored as usize)?;
        let samples = gpu.read(&engine.traced().samples, 0..engine.view.pixel_count())?;
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

/// The radius [m] within which so many photons lie, and how many those are.
pub fn radius_of(counts: &[f64], wish: f64) -> (f32, f64) {
    let step = counts.iter().position(|c| *c >= wish).unwrap_or(STEPS - 1);
    (RADIUS_MAX * (step + 1) as f32 / STEPS as f32, counts[step])
}

/// One more iteration, and the time [ms] of its parts.
pub fn parts(renderer: &mut Renderer) -> Result<BTreeMap<&'static str, f64>> {
    let before: BTreeMap<_, _> = renderer.timings().into_iter().collect();
    renderer.iterate()?;
    let mut parts = BTreeMap::new();
    for (pass, ms) in renderer.timings() {
        let part = match pass {
            "scan" => "sort",
            "sort" | "gather" | "view" | "emit" | "cull" | "film" | "host" | "other" => pass,
            // Boxes and trees, boxes and acceleration structures, or tables.
            _ => "build",
        };
        *parts.entry(part).or_default() += ms - before.get(pass).unwrap_or(&0.0);
    }
    Ok(parts)
}

/// Costs of each variant.
fn measure(
    gpu: &Gpu,
    scene: &Scene,
    paths: u32,
    radius: f32,
    variants: &[Variant],
) -> Result<Vec<Cost>> {
    let renderer = |v: &Variant| Renderer::with(gpu, scene, &settings(paths, radius, v.2), v.1);
    let mut renderers = variants.iter().map(renderer).collect::<Result<Vec<_>>>()?;
    let mut times = vec![BTreeMap::<&str, Vec<f64>>::new(); variants.len()];
    for run in 0..=RUNS {
        for (renderer, times) in renderers.iter_mut().zip(&mut times) {
            let parts = parts(renderer)?;
            if run == 0 {
                continue;
            }
            let of_search = |part| (part, parts.get(part).copied().unwrap_or(0.0));
            let search = ["sort", "build", "gather"].map(of_search);
            let sum = search.iter().map(|(_, ms)| ms).sum();
            for (part, ms) in search.into_iter().chain([("sum", sum)]) {
                times.entry(part).or_default().push(ms);
            }
        }
    }
    let mut costs = Vec::new();
    let mut first = Vec::new();
    for (renderer, mut times) in renderers.iter().zip(times) {
        let layers = renderer.picture()?.layers;
        let beauty = layers.into_iter().find(|l| l.name.is_empty());
        let beauty = beauty.map_or(Vec::new(), |l| l.pixels);
        if first.is_empty() {
            first = beauty.clone();
        }
        let differs = |(a, b): &(&[f32], &[f32])| {
            a.iter()
                .zip(*b)
                .any(|(a, b)| (a - b).abs() > 1e-4 * a.abs())
        };
        let mut of = |part| times.get_mut(part).map_or(0.0, |t| median(t));
        costs.push(Cost {
            sort: of("sort"),
            build: of("build"),
            gather: of("gather"),
            sums: times.remove("sum").unwrap_or_default(),
            differ: first
                .chunks(3)
                .zip(beauty.chunks(3))
                .filter(differs)
                .count(),
        });
    }
    Ok(costs)
}
