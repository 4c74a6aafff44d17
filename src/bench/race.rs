//! Techniques side by side on one device: whatever else the machine does hits all of them alike.

use super::plan::{Budget, Factors, Variant, checkpoints};
use super::{Progress, Session};
use crate::Result;
use crate::image::{Picture, Rgb, resample};
use crate::metrics::{Metric, Pair};
use crate::render::{Radii, Renderer};
use crate::scene::Scene;
use crate::settings::{Length, MAX_PHOTONS, Settings};

/// What is measured at every checkpoint. FLIP takes long and is left for the end.
pub const METRICS: [Metric; 5] = [
    Metric::RelMse,
    Metric::RelMseTrimmed,
    Metric::Mse,
    Metric::Mae,
    Metric::Ssim,
];

/// Iterations before the clock runs: pipelines are compiled, caches filled and both gathers tried.
const WARM_UP: usize = 2;

/// How one variant did with one seed.
pub struct Track {
    /// Into the variants that raced.
    pub variant: usize,
    pub seed: u64,
    /// Of the first iteration.
    pub radii: Radii,
    /// Time (s) of each iteration, on the host's clock.
    pub seconds: Vec<f64>,
    /// Time (ms) of each pass in each iteration, on the device's clock; `host`: it waited for the host; `other`: the rest.
    pub passes: Vec<(&'static str, Vec<f64>)>,
    pub checkpoints: Vec<Checkpoint>,
    pub photons: Photons,
    pub guided: Guided,
    /// After the last iteration.
    pub image: Rgb,
    pub flip: f64,
    /// Why it went no further.
    pub failure: Option<String>,
}

/// Sums over all iterations.
#[derive(Debug, Clone, Copy, Default)]
pub struct Photons {
    pub emitted: u64,
    pub stored_caustic: u64,
    pub stored_global: u64,
}

/// What was learned before the first iteration of where light paths should begin.
#[derive(Debug, Clone, Copy, Default)]
pub struct Guided {
    /// Whether they begin there.
    pub on: bool,
    /// Share of light paths that leave a photon where a view sample gathers.
    pub useful: f32,
    pub cells: usize,
    /// That learning took.
    pub seconds: f64,
}

/// The error after so many iterations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checkpoint {
    pub iterations: u64,
    /// On iterations; reading back and measuring do not count.
    pub seconds: f64,
    /// As in [`METRICS`].
    pub errors: [f64; METRICS.len()],
}

impl Track {
    pub fn iterations(&self) -> u64 {
        self.seconds.len() as u64
    }

    pub fn total_seconds(&self) -> f64 {
        self.seconds.iter().sum()
    }
}

/// Where and against what variants race.
pub struct Course<'a> {
    pub session: &'a Session<'a>,
    pub scene: &'a Scene,
    pub reference: &'a Rgb,
}

/// When a race ends.
pub enum End {
    /// Each variant has used up its own.
    Budget(Budget),
    /// All have done as many iterations as fit into these seconds together, at least so many.
    Rounds { seconds: f64, least: u64 },
}

/// Runs `variants`, one iteration at a time: always of the one that has used up least. One that fails is out of the race.
pub fn race(course: &Course, variants: &[Variant], seed: u64, end: &End) -> Vec<Track> {
    let mut runners: Vec<Runner> = variants
        .iter()
        .enumerate()
        .map(|(i, variant)| Runner::start(course, i, variant, seed))
        .collect();
    let mut progress = Progress::start();
    while !(course.session.stop)() {
        let total: f64 = runners.iter().map(|r| r.busy).sum();
        let used = |runner: &Runner| {
            let (n, seconds) = (runner.track.iterations(), runner.busy);
            match *end {
                End::Budget(budget) => budget.used(n, seconds),
                End::Rounds { seconds, least } if total >= seconds && n >= least => f64::INFINITY,
                End::Rounds { .. } => n as f64 * f64::MIN_POSITIVE,
            }
        };
        let left = runners
            .iter()
            .enumerate()
            .filter(|(_, r)| r.renderer.is_some());
        let next = left
            .map(|(i, r)| (i, used(r)))
            .filter(|(_, used)| *used < 1.0)
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((i, least)) = next else {
            break;
        };
        let done = match *end {
            End::Budget(_) => least,
            End::Rounds { seconds, .. } => total / seconds,
        };
        progress.update(course.session, done.min(1.0));
        let runner = &mut runners[i];
        runner.step();
        let due = match *end {
            End::Budget(budget) => runner.is_due(budget),
            End::Rounds { .. } => false,
        };
        if due {
            runner.checkpoint(course);
        }
    }
    runners.into_iter().map(|r| r.finish(course)).collect()
}

/// A variant under way.
struct Runner {
    /// `None` once it failed.
    renderer: Option<Renderer>,
    track: Track,
    busy: f64,
    /// Cumulative, as of the last iteration.
    timings: Vec<(&'static str, f64)>,
    /// Shares of the budget still to be measured at, the next one last.
    due: Vec<f64>,
}

impl Runner {
    fn start(course: &Course, index: usize, variant: &Variant, seed: u64) -> Self {
        let settings = Settings {
            seed,
            ..variant.settings.clone()
        };
        let mut runner = Self {
            renderer: None,
            track: Track {
                variant: index,
                seed,
                radii: Radii {
                    global: 0.0,
                    caustic: 0.0,
                },
                seconds: Vec::new(),
                passes: Vec::new(),
                checkpoints: Vec::new(),
                photons: Photons::default(),
                guided: Guided::default(),
                image: Rgb {
                    size: [0; 2],
                    pixels: Vec::new(),
                },
                flip: f64::NAN,
                failure: None,
            },
            busy: 0.0,
            timings: Vec::new(),
            due: checkpoints().collect(),
        };
        runner.due.reverse();
        match warm(course, settings, variant.factors) {
            Ok(renderer) => {
                runner.track.radii = renderer.radii();
                let lesson = renderer.lesson();
                runner.track.guided = Guided {
                    on: lesson.on,
                    useful: lesson.useful[usize::from(lesson.on)],
                    cells: lesson.cells,
                    seconds: lesson.seconds.as_secs_f64(),
                };
                runner.renderer = Some(renderer);
            }
            Err(error) => runner.track.failure = Some(error.to_string()),
        }
        runner
    }

    fn step(&mut self) {
        let Some(renderer) = &mut self.renderer else {
            return;
        };
        let start = std::time::Instant::now();
        if let Err(error) = renderer.iterate() {
            self.track.failure = Some(error.to_string());
            self.renderer = None;
            return;
        }
        let seconds = start.elapsed().as_secs_f64();
        let before = self.track.seconds.len();
        self.track.seconds.push(seconds);
        self.busy += seconds;
        let timings = renderer.timings();
        for &(name, total) in &timings {
            let earlier = self
                .timings
                .iter()
                .find(|t| t.0 == name)
                .map_or(0.0, |t| t.1);
            let passes = &mut self.track.passes;
            let at = passes.iter().position(|p| p.0 == name).unwrap_or_else(|| {
                passes.push((name, vec![0.0; before]));
                passes.len() - 1
            });
            passes[at].1.resize(before, 0.0);
            passes[at].1.push((total - earlier).max(0.0));
        }
        self.timings = timings;
    }

    fn is_due(&mut self, budget: Budget) -> bool {
        let used = budget.used(self.track.iterations(), self.busy);
        let before = self.due.len();
        while self.due.last().is_some_and(|share| *share <= used) {
            self.due.pop();
        }
        self.due.len() < before
    }

    /// Measures the image so far, if it has not been.
    fn checkpoint(&mut self, course: &Course) {
        let Some(renderer) = &self.renderer else {
            return;
        };
        let iterations = self.track.iterations();
        let last = self.track.checkpoints.last();
        if iterations == 0 || last.is_some_and(|c| c.iterations == iterations) {
            return;
        }
        let measured = renderer.picture().map(beauty).and_then(|mut image| {
            if image.size != course.reference.size {
                image = resample(&image, course.reference.size);
            }
            let pair = Pair::new(&image, course.reference)
                .map_err(|fault| crate::Error::image("--reference".as_ref(), fault))?;
            Ok((METRICS.map(|metric| pair.measure(metric).value), image))
        });
        match measured {
            Ok((errors, image)) => {
                self.track.image = image;
                self.track.checkpoints.push(Checkpoint {
                    iterations,
                    seconds: self.busy,
                    errors,
                });
            }
            Err(error) => self.track.failure = Some(error.to_string()),
        }
    }

    fn finish(mut self, course: &Course) -> Track {
        self.checkpoint(course);
        let iterations = self.track.seconds.len();
        for (_, ms) in &mut self.track.passes {
            ms.resize(iterations, 0.0);
        }
        if let Some(renderer) = &self.renderer {
            let ledger = renderer.ledger();
            let count = |name| ledger.iter().find(|l| l.0 == name).map_or(0, |l| l.1);
            let caustic = count("stored, caustic");
            self.track.photons = Photons {
                emitted: count("emitted"),
                stored_caustic: caustic,
                stored_global: count("stored").saturating_sub(caustic),
            };
        }
        if let Ok(pair) = Pair::new(&self.track.image, course.reference) {
            self.track.flip = pair.measure(Metric::Flip).value;
        }
        self.track
    }
}

/// A renderer whose first iteration is as fast as its others.
fn warm(course: &Course, mut settings: Settings, factors: Factors) -> Result<Renderer> {
    if factors.edges != 1.0 {
        let scaled = |edge: u32| (f64::from(edge) * factors.edges).round().max(1.0) as u32;
        settings.size = Some(course.reference.size.map(scaled));
    }
    let gpu = course.session.gpu;
    let mut renderer = Renderer::new(gpu, course.scene, &settings)?;
    if factors.radii != 1.0 {
        let radii = renderer.radii();
        let length = |radius: f32| Length::World((f64::from(radius) * factors.radii) as f32);
        settings.radius = Some(length(radii.global));
        settings.caustic_radius = Some(length(radii.caustic));
        renderer = Renderer::new(gpu, course.scene, &settings)?;
    }
    if factors.photons != 1.0 {
        let photons = f64::from(renderer.photons_per_iteration()) * factors.photons;
        settings.photons = Some(photons.round().clamp(1.0, MAX_PHOTONS.into()) as u32);
        renderer = Renderer::new(gpu, course.scene, &settings)?;
    }
    for _ in 0..WARM_UP {
        renderer.iterate()?;
    }
    renderer.restart()?;
    Ok(renderer)
}

/// The layer that people look at.
pub fn beauty(picture: Picture) -> Rgb {
    let size = [picture.width, picture.height];
    let layer = picture.layers.into_iter().find(|l| l.name.is_empty());
    Rgb {
        size,
        pixels: layer.map_or_else(Vec::new, |l| l.pixels),
    }
}
