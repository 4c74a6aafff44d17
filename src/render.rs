//! Settings and a scene become iterations, and iterations a picture.

mod accuracy;
mod choices;
mod engine;
mod idle;
mod pilot;
mod radius;
mod traced;

use crate::film::Film;
use crate::gpu::{Gpu, Timings};
use crate::guide::{Guide, Lesson};
use crate::image::{Metadata, Picture};
use crate::photons::Photons;
use crate::scene::Scene;
use crate::settings::{Direct, Evaluate, Settings};
use crate::shared::{
    FEATURE_DIFFUSE, FEATURE_DIRECT_RAYS, FEATURE_LEDGER, FEATURE_SPECULAR, FilmPixel, Frame,
};
use crate::technique::{Row, Technique};
use crate::view::{View, camera_frame};
use crate::world::{World, check_size, features};
use crate::{Error, Result};
use std::path::Path;
use std::time::{Duration, Instant};

pub use accuracy::{Accuracy, Unknown, next_look};
pub use choices::auto_trace;
pub use engine::Engine;
pub use radius::shrink;
pub use traced::Traced;

use accuracy::accuracy;
use choices::{
    check_photons, choose_camera, choose_technique, choose_trace, default_paths, default_size,
    has_hidden_light,
};
use engine::Ledger64;
use idle::Idle;
use traced::{Turns, first_capacity};

/// Radii (m) of one iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radii {
    pub global: f32,
    pub caustic: f32,
}

/// What became of the light paths, over all iterations: names and counts. Paths: emitted = absorbed
/// + escaped + terminated + too long. Photons: met a diffuse surface = stored + culled + rejected.
pub type Ledger = Vec<(&'static str, u64)>;

/// Where photons of a map reached fewer pixels than this, as there should be some, nothing is known of them.
const LEAST_LIT: usize = 16;

/// A render under way.
pub struct Renderer {
    engine: Engine,
    technique: Box<dyn Technique>,
    settings: String,
    scene_hash: [u8; 32],
    seed: u64,
    /// The technique finds no light of lamps without area by way of mirrors and glass, and there are such.
    blind: bool,
    iterations: u64,
    /// Of iterations before a resume.
    seconds_before: f64,
    busy: Duration,
}

impl Renderer {
    /// Uploads the scene and chooses what the settings leave open.
    ///
    /// # Errors
    /// Settings that the scene or the device cannot follow; out of device memory.
    pub fn new(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Result<Self> {
        Self::with(
            gpu,
            scene,
            settings,
            choose_technique(gpu, &settings.technique)?,
        )
    }

    /// As [`Self::new`], by a technique that need not be in the table.
    pub fn with(gpu: &Gpu, scene: &Scene, settings: &Settings, row: &Row) -> Result<Self> {
        Self::with_features(gpu, scene, settings, row, features(scene))
    }

    /// As [`Self::with`], compiled for these features, which include the scene's: benchmarks switch on what it
    /// does not use.
    pub fn with_features(
        gpu: &Gpu,
        scene: &Scene,
        settings: &Settings,
        row: &Row,
        features: u32,
    ) -> Result<Self> {
        check_size(scene, &gpu.info().name)?;
        let trace = choose_trace(gpu, settings.trace)?;
        let camera = choose_camera(scene, settings.camera.as_deref())?;
        let size = settings.size.unwrap_or_else(|| default_size(camera));
        let max_depth = settings.max_depth;
        let rays = settings.direct != Direct::Photons;
        // With direct light by rays, photons bring light over at least two edges, to where the eye's is a third.
        let gathers = row.photons && features & FEATURE_DIFFUSE != 0;
        let paths = match gathers && (!rays || max_depth > 2) {
            true => settings.photons.unwrap_or_else(|| default_paths(gpu, size)),
            false => 0,
        };
        check_photons(paths, max_depth)?;
        let direct = if rays { FEATURE_DIRECT_RAYS } else { 0 };

        let world = World::new(gpu, scene, trace, features)?;
        let view = View::new(gpu, &world, size, direct)?;
        let ledger = if settings.ledger { FEATURE_LEDGER } else { 0 };
        let capacity = first_capacity(paths);
        let photons = Photons::new(gpu, &world, paths, capacity, direct | ledger)?;
        let turns = Turns::new(gpu, view.pixel_count(), paths)?;
        let film = Film::new(gpu, &view)?;
        let frame_data = Frame {
            seed: (settings.seed ^ settings.seed >> 32) as u32,
            paths,
            max_depth,
            reject: settings.reject,
            ..camera_frame(camera, size)
        };
        let mut engine = Engine {
            turns,
            gpu: gpu.clone(),
            frame_data,
            first_radius2: [0.0; 2],
            alpha: f64::from(settings.alpha),
            pixel_radii: row.pixel_radii,
            reservoir: settings.reservoir,
            evaluate: settings.evaluate,
            timings: Timings::new(),
            idle: Idle::default(),
            ledger: Ledger64::default(),
            guide: Guide::none(gpu, &world)?,
            lesson: Lesson {
                light: [true; 2],
                ..Lesson::default()
            },
            direct_features: direct,
            world,
            view,
            photons,
            film,
        };
        if row.photons {
            pilot::prepare(&mut engine, settings)?;
        }
        let technique = (row.build)(&engine)?;
        Ok(Self {
            settings: canonical(settings, &engine, row.name, rays),
            engine,
            technique,
            scene_hash: scene.hash,
            seed: settings.seed,
            blind: !row.photons && has_hidden_light(scene),
            iterations: 0,
            seconds_before: 0.0,
            busy: Duration::ZERO,
        })
    }

    /// Goes on from a saved picture.
    ///
    /// # Errors
    /// The picture is of another scene or other settings, or lacks the layers to go on from.
    pub fn resume(&mut self, picture: &Picture) -> Result<()> {
        let refuse = |fault: String| Error::image(Path::new("--resume"), fault);
        let saved = &picture.metadata;
        if saved.scene_hash != self.scene_hash {
            return Err(refuse("the image was rendered from another scene".into()));
        }
        let line = |settings: &str, seed| format!("seed {seed} {settings}");
        let [before, now] = [
            line(&saved.settings, saved.seed),
            line(&self.settings, self.seed),
        ];
        if before != now {
            let differences = differences(&before, &now);
            return Err(refuse(format!(
                "the image was rendered with other settings: {differences}"
            )));
        }
        let engine = &mut self.engine;
        // Learned anew it could differ in a bit, on another device.
        engine.guide = match saved.guide.as_str() {
            "" => Guide::none(&engine.gpu, &engine.world)?,
            text => Guide::from_text(&engine.gpu, &engine.world, text)
                .ok_or_else(|| refuse("its lightfall.guide is damaged".into()))??,
        };
        engine.forget_ahead();
        engine.film.restore(&engine.gpu, &picture.layers)?;
        self.technique.restore(&self.engine, &picture.layers)?;
        self.iterations = saved.iterations;
        self.seconds_before = saved.seconds;
        Ok(())
    }

    /// One iteration.
    pub fn iterate(&mut self) -> Result<()> {
        let start = Instant::now();
        self.engine.begin(self.iterations);
        self.technique.iterate(&mut self.engine)?;
        self.iterations += 1;
        self.busy += start.elapsed();
        Ok(())
    }

    /// Forgets all iterations and measurements, and keeps what lies on the device: for measurements after a warm-up.
    /// A technique with a state of its own begins it anew at iteration 0.
    pub fn restart(&mut self) -> Result<()> {
        self.engine.film.clear(&self.engine.gpu)?;
        self.engine.forget_measurements();
        self.iterations = 0;
        self.seconds_before = 0.0;
        self.busy = Duration::ZERO;
        Ok(())
    }

    /// What lies on the device, for measurements.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Iterations in the picture.
    pub fn iterations(&self) -> u64 {
        self.iterations
    }

    /// Light paths of each iteration.
    pub fn photons_per_iteration(&self) -> u32 {
        self.engine.frame_data.paths
    }

    /// Light paths since the start of this process.
    pub fn photons_emitted(&self) -> u64 {
        self.engine.ledger.emitted
    }

    /// Of the next iteration; the largest that a pixel may have where each has its own.
    pub fn radii(&self) -> Radii {
        let [caustic, global] = self.engine.radius_in(self.iterations);
        Radii { global, caustic }
    }

    /// How far the picture is thought to be from the truth.
    pub fn accuracy(&self) -> Result<Accuracy> {
        let pixels = self.engine.film.pixels(&self.engine.gpu)?;
        let known = accuracy(&pixels, self.engine.view.size[0], self.iterations);
        Ok(Accuracy {
            unknown: self.unknown(&pixels),
            ..known
        })
    }

    /// Light that the picture should have, of which too little was found to know how much it varies.
    fn unknown(&self, pixels: &[FilmPixel]) -> Option<Unknown> {
        if self.blind {
            return Some(Unknown::Unseen);
        }
        if self.engine.frame_data.paths == 0 {
            return None;
        }
        // A picture of a few pixels has no more that could be lit.
        let least = LEAST_LIT.min(pixels.len() / 8);
        let [caustic, global] = self.engine.lesson.light;
        let found = |layer: fn(&FilmPixel) -> [f32; 3]| {
            let lit = pixels.iter().filter(|p| layer(p) != [0.0; 3]);
            lit.count()
        };
        let features = self.engine.world.features;
        if caustic && features & FEATURE_SPECULAR != 0 && found(|p| p.caustic) < least {
            return Some(Unknown::Caustics);
        }
        (global && found(|p| p.global) < least).then_some(Unknown::Indirect)
    }

    /// How light paths were guided.
    pub fn lesson(&self) -> &Lesson {
        &self.engine.lesson
    }

    /// All layers so far.
    pub fn picture(&self) -> Result<Picture> {
        let [width, height] = self.engine.view.size;
        let radii = self.radii();
        let mut layers = self.engine.film.layers(&self.engine.gpu, self.iterations)?;
        layers.extend(self.technique.state(&self.engine)?);
        Ok(Picture {
            width,
            height,
            layers,
            metadata: Metadata {
                scene_hash: self.scene_hash,
                settings: self.settings.clone(),
                seed: self.seed,
                iterations: self.iterations,
                radius_global: radii.global,
                radius_caustic: radii.caustic,
                device: format!(
                    "{}, {}",
                    self.engine.gpu.info().name,
                    self.engine.gpu.info().driver
                ),
                version: env!("CARGO_PKG_VERSION").into(),
                seconds: self.seconds_before + self.busy.as_secs_f64(),
                guide: self.engine.guide.to_text().unwrap_or_default(),
            },
        })
    }

    /// Passes with their total time (ms) on the device; `host`: the device waited for the host between submissions;
    /// `other`: the rest of the time that iterations took.
    pub fn timings(&self) -> Timings {
        let mut timings = self.engine.timings.clone();
        let device: f64 = timings.iter().map(|(_, ms)| ms).sum();
        let rest = (self.busy.as_secs_f64() * 1e3 - device).max(0.0);
        let host = self.engine.idle.ms.min(rest);
        timings.extend([("host", host), ("other", rest - host)]);
        timings
    }

    /// What became of the light paths; counted only where the settings ask for it.
    pub fn ledger(&self) -> Ledger {
        let l = &self.engine.ledger;
        vec![
            ("emitted", l.emitted),
            ("absorbed", l.absorbed),
            ("escaped", l.escaped),
            ("terminated by roulette", l.terminated),
            ("too long", l.too_long),
            ("stored", l.stored),
            ("stored, caustic", l.caustic),
            ("culled", l.culled),
            ("rejected", l.rejected),
            ("iterations repeated with larger buffers", l.regrown),
        ]
    }
}

/// Where two lines of names and values differ.
fn differences(before: &str, now: &str) -> String {
    let [a, b] = [before, now].map(|line| line.split(' ').collect::<Vec<_>>());
    let pairs = || a.chunks(2).zip(b.chunks(2));
    if a.len() != b.len() || pairs().any(|(a, b)| a.first() != b.first()) {
        // Of another version of lightfall, or a camera whose name has spaces.
        return format!("{before}; now {now}");
    }
    let different = pairs().filter(|(a, b)| a != b);
    let words: Vec<String> = different
        .map(|(a, b)| format!("{}, now {}", a.join(" "), b.get(1).unwrap_or(&"")))
        .collect();
    words.join("; ")
}

/// Everything that changes the expected image or its random numbers, in one line.
fn canonical(settings: &Settings, engine: &Engine, technique: &str, rays: bool) -> String {
    let frame = &engine.frame_data;
    let [caustic, global] = engine.first_radius2.map(f64::sqrt);
    format!(
        "technique {technique} size {}x{} camera {} photons {} depth {} direct {} radius {global:e} caustic {caustic:e} alpha {} cull {} evaluate {} reservoir {} reject {} guide {}",
        frame.size[0],
        frame.size[1],
        settings.camera.as_deref().unwrap_or("0"),
        frame.paths,
        frame.max_depth,
        if rays { "rays" } else { "photons" },
        settings.alpha,
        frame.cull,
        match engine.evaluate {
            Evaluate::Auto => "auto",
            Evaluate::Full => "full",
            Evaluate::Stochastic => "stochastic",
        },
        settings.reservoir,
        settings.reject,
        if engine.lesson.on { "on" } else { "off" },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_named() {
        let before = "seed 0 size 8x8 camera 0";
        assert_eq!(
            differences(before, "seed 1 size 8x9 camera 0"),
            "seed 0, now 1; size 8x8, now 8x9"
        );
        let camera = "seed 0 size 8x8 camera the left one";
        assert_eq!(
            differences(before, camera),
            format!("{before}; now {camera}")
        );
    }
}
