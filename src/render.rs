//! The renderer: its face towards the command line, until the techniques move in.

use crate::{Error, Result, gpu::Gpu, image::Picture, scene::Scene, settings::Settings};

/// Per-iteration radii [m] of the two photon maps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radii {
    pub global: f32,
    pub caustic: f32,
}

/// What became of the light paths: a name and a count each.
pub type Ledger = Vec<(&'static str, u64)>;

/// A render in progress.
pub struct Renderer;

fn absent<T>() -> Result<T> {
    Err(Error::NoDevice("this build has no technique yet".into()))
}

impl Renderer {
    pub fn new(_gpu: &Gpu, _scene: &Scene, _settings: &Settings) -> Result<Self> {
        absent()
    }
    /// Goes on from `picture`; refuses another scene's, or one of other settings.
    pub fn resume(&mut self, _picture: &Picture) -> Result<()> {
        absent()
    }
    pub fn iterate(&mut self) -> Result<()> {
        absent()
    }
    pub fn iterations(&self) -> u64 {
        0
    }
    pub fn photons_emitted(&self) -> u64 {
        0
    }
    pub fn radii(&self) -> Radii {
        Radii {
            global: 0.0,
            caustic: 0.0,
        }
    }
    /// Relative standard error of the image's mean.
    pub fn noise(&self) -> Result<f64> {
        absent()
    }
    pub fn picture(&self) -> Result<Picture> {
        absent()
    }
    /// Time [ms] that each pass took in all.
    pub fn timings(&self) -> crate::gpu::Timings {
        crate::gpu::Timings::new()
    }
    pub fn ledger(&self) -> Option<Ledger> {
        None
    }
}
