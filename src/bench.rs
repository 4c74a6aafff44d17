//! The referee: techniques side by side on one device, measured against a reference, and a report of it.
//!
//! | room | what it does |
//! |---|---|
//! | [`plan`] | what is to be measured |
//! | [`mod@reference`] | the image that is taken for the truth |
//! | [`mod@race`] | variants side by side, one iteration at a time |
//! | [`ablation`] | culling, evaluation and radius by themselves |
//! | [`trade`] | one setting at a time: what it buys, and the front of error against time |
//! | [`statistics`], [`standing`] | medians, intervals, and who is ahead |
//! | [`about`] | device, driver, commit, command line |
//! | [`data`], [`report`] | for machines and for people |

pub mod ablation;
pub mod about;
pub mod data;
pub mod plan;
pub mod race;
pub mod reference;
pub mod report;
pub mod standing;
pub mod statistics;
pub mod trade;

use crate::gpu::Gpu;
use crate::image::Rgb;
use crate::metrics::{Split, split};
use crate::scene::{self, Scene};
use crate::settings::Settings;
use crate::{Error, Result};
use ablation::Ablation;
use about::About;
use plan::{Budget, Plan, Variant};
use race::{Course, End, Track, race};
use reference::Reference;
use std::path::Path;
use std::time::{Duration, Instant};
use trade::Trade;

/// Everything that was measured.
pub struct Results {
    pub about: About,
    pub plan: Plan,
    pub scenes: Vec<SceneResults>,
    /// Scenes that could not be measured.
    pub failures: Vec<Error>,
    /// Ended before its time.
    pub interrupted: bool,
}

/// One scene.
pub struct SceneResults {
    pub name: String,
    pub scene_hash: [u8; 32],
    pub triangles: usize,
    pub warnings: Vec<String>,
    pub size: [u32; 2],
    pub reference: Reference,
    /// Of all seeds, seed by seed; only the first of each variant keeps its image.
    pub tracks: Vec<Track>,
    /// Of each variant's last images.
    pub splits: Vec<Option<Split>>,
    /// Of each seed.
    pub ablations: Vec<Ablation>,
    pub trade: Option<Trade>,
}

/// What every measurement needs.
pub struct Session<'a> {
    pub gpu: &'a Gpu,
    /// Asked after each iteration: whether to end.
    pub stop: &'a dyn Fn() -> bool,
    /// Hears how far it is.
    pub say: &'a dyn Fn(&str),
}

/// Says how far something long is, every so often.
struct Progress {
    next: Instant,
}

impl Progress {
    const INTERVAL: Duration = Duration::from_secs(15);

    fn start() -> Self {
        Self {
            next: Instant::now() + Self::INTERVAL,
        }
    }

    fn update(&mut self, session: &Session, done: f64) {
        if Instant::now() >= self.next {
            self.next = Instant::now() + Self::INTERVAL;
            (session.say)(&format!("{:3.0} %", 100.0 * done));
        }
    }
}

/// Size of the images (px) where neither the user nor a reference says.
const SIZE: [u32; 2] = [256, 256];

/// Runs the plan; what fails is told in the results.
pub fn run(plan: Plan, session: &Session) -> Results {
    let Session { gpu, stop, say } = *session;
    let mut results = Results {
        about: About::now(gpu),
        scenes: Vec::new(),
        failures: Vec::new(),
        interrupted: false,
        plan,
    };
    let plan = &results.plan;
    for path in &plan.scenes {
        if stop() {
            break;
        }
        match run_scene(plan, session, path) {
            Ok(scene) => results.scenes.push(scene),
            Err(_) if stop() => {}
            Err(error) => {
                say(&format!("error: {error}"));
                results.failures.push(error);
            }
        }
    }
    results.interrupted = stop();
    results
}

fn run_scene(plan: &Plan, session: &Session, path: &Path) -> Result<SceneResults> {
    let Session { stop, say, .. } = *session;
    let name = path
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let mut scene = scene::load_with(path, &plan.load)?;
    if let Some(environment) = &plan.environment {
        scene.set_environment(environment.clone());
    }
    say(&format!(
        "{name}: {} triangles",
        scene.stored_triangles().count()
    ));
    for warning in &scene.warnings {
        say(&format!("warning: {warning}"));
    }
    let (size, reference) = find_reference(plan, session, path, &scene)?;
    let sized = |settings: &Settings| Settings {
        size: Some(size),
        ..settings.clone()
    };
    let variants: Vec<Variant> = plan
        .variants
        .iter()
        .map(|v| Variant {
            settings: sized(&v.settings),
            ..v.clone()
        })
        .collect();
    let course = Course {
        session,
        scene: &scene,
        reference: &reference.image,
    };
    let mut tracks: Vec<Track> = Vec::new();
    // Seeds one after another, so that only as many renders as there are variants lie on the device; each is a block in which all
    // variants run side by side, and comparisons are made within blocks.
    for seed in 0..plan.seeds {
        if stop() {
            break;
        }
        let raced = race(&course, &variants, seed, &End::Budget(plan.budget));
        for track in &raced {
            say(&progress(plan, seed, &variants, track));
        }
        tracks.extend(raced);
    }
    let splits = split_and_drop(&mut tracks, variants.len(), &reference.image);
    let mut ablations = Vec::new();
    if let Some(base) = &plan.ablation
        && !stop()
    {
        let seconds = match plan.budget {
            Budget::Seconds(seconds) => seconds,
            Budget::Iterations(_) => statistics::median(tracks.iter().map(Track::total_seconds)),
        };
        say("culling, evaluation and radii by themselves");
        let seconds = seconds / plan.seeds as f64;
        for seed in (0..plan.seeds).take_while(|_| !stop()) {
            ablations.push(ablation::measure(&course, &sized(base), seed, seconds));
        }
    }
    let trade = match plan.trade {
        true => trade::trade(&tracks, variants.len()),
        false => None,
    };
    Ok(SceneResults {
        name,
        scene_hash: scene.hash,
        triangles: scene.stored_triangles().count(),
        warnings: scene.warnings.clone(),
        size,
        reference,
        tracks,
        splits,
        ablations,
        trade,
    })
}

/// Bias² and variance of each variant; then the images that no picture is made of are let go.
fn split_and_drop(tracks: &mut [Track], variants: usize, reference: &Rgb) -> Vec<Option<Split>> {
    let of_variant = |v| {
        let images: Vec<&Rgb> = standing::of(tracks, v).map(|t| &t.image).collect();
        split(&images, reference)
    };
    let splits = (0..variants).map(of_variant).collect();
    for v in 0..variants {
        let measured = tracks
            .iter_mut()
            .filter(|t| t.variant == v && !t.checkpoints.is_empty());
        measured.skip(1).for_each(|t| t.image.pixels = Vec::new());
    }
    splits
}

fn find_reference(
    plan: &Plan,
    session: &Session,
    path: &Path,
    scene: &Scene,
) -> Result<([u32; 2], Reference)> {
    if let Some(file) = reference::file(plan, path)? {
        let found = reference::read(&file)?;
        let size = plan.size.unwrap_or(found.image.size);
        return Ok((size, reference::at_size(found, size, &file)?));
    }
    let size = plan.size.unwrap_or(SIZE);
    // What all variants share decides the expected image.
    let first = plan.variants.first().map(|v| &v.settings);
    let settings = Settings {
        size: Some(size),
        camera: first.and_then(|s| s.camera.clone()),
        max_depth: first.map_or(Settings::default().max_depth, |s| s.max_depth),
        trace: first.map_or(Settings::default().trace, |s| s.trace),
        ..Settings::default()
    };
    let found = reference::make(plan, session, scene, &settings)?;
    Ok((size, found))
}

fn progress(plan: &Plan, seed: u64, variants: &[Variant], track: &Track) -> String {
    let label = &variants[track.variant].label;
    let head = format!("seed {} of {}: {label}", seed + 1, plan.seeds);
    match (&track.failure, track.checkpoints.last()) {
        (Some(fault), _) => format!("{head}: {fault}"),
        (None, None) => format!("{head}: not one iteration"),
        (None, Some(last)) => format!(
            "{head}: {} iterations, {:.1} s, relMSE {:.5}",
            last.iterations, last.seconds, last.errors[0]
        ),
    }
}
