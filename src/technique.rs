//! The techniques. Adding one is a Rust file, a GLSL folder and a row in [`TECHNIQUES`].

pub mod gather;
mod hash_grid;
mod hash_ppm;
mod lists;
mod path;
mod rtpm;
mod stochastic_hash;

use crate::Result;
use crate::render::Engine;

/// What a technique needs to do once per iteration, on top of what all of them share.
pub trait Technique {
    /// One iteration, from camera paths to the film.
    fn iterate(&mut self, engine: &mut Engine) -> Result<()>;
}

/// What the rest of the program knows of a technique.
pub struct Row {
    /// As in the command line, `src/technique/` and `glsl/`.
    pub name: &'static str,
    pub paper: &'static str,
    /// How its expected image differs from the truth.
    pub bias: &'static str,
    /// Whether it gathers photons: only then are buffers for them made and first radii found.
    pub photons: bool,
    pub build: fn(&Engine) -> Result<Box<dyn Technique>>,
}

/// All techniques.
pub const TECHNIQUES: &[Row] = &[
    Row {
        name: "rtpm",
        paper: "Kern, Brüll, Grosch 2023",
        bias: "blur of the photon radius, which shrinks to nothing",
        photons: true,
        build: |engine| Ok(Box::new(rtpm::Rtpm::new(engine)?)),
    },
    Row {
        name: "hash-grid",
        paper: "own, after Mara et al. 2013",
        bias: "as rtpm",
        photons: true,
        build: |engine| Ok(Box::new(hash_grid::HashGrid::new(engine)?)),
    },
    Row {
        name: "hash-ppm",
        paper: "Kern et al. 2023 after Mara et al. 2013",
        bias: "as rtpm",
        photons: true,
        build: |engine| Ok(Box::new(hash_ppm::new(engine)?)),
    },
    Row {
        name: "stochastic-hash",
        paper: "Hachisuka & Jensen 2010, Davidovič et al. 2014",
        bias: "as rtpm",
        photons: true,
        build: |engine| Ok(Box::new(stochastic_hash::new(engine)?)),
    },
    Row {
        name: "path",
        paper: "Kajiya 1986; Veach 1997",
        bias: "nothing, but it does not see lights without area through smooth glass or in smooth mirrors",
        photons: false,
        build: |engine| Ok(Box::new(path::Path::new(engine)?)),
    },
];
