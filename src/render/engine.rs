//! What all techniques share, and the parts of an iteration that they call.

use super::idle::Idle;
use super::radius::shrink;
use super::traced::{Traced, Turns};
use crate::Result;
use crate::film::Film;
use crate::gpu::{Commands, Done, Gpu, Ptr, Timings};
use crate::guide::{Guide, Lesson};
use crate::photons::{Order, Photons};
use crate::settings::Evaluate;
use crate::shared::{Counters, Frame};
use crate::view::View;
use crate::world::World;

/// What all techniques share: the scene, camera paths, light paths and the film.
pub struct Engine {
    // Dropped, and so waited for, before what paths reach.
    pub(super) turns: Turns,
    pub gpu: Gpu,
    pub world: World,
    pub guide: Guide,
    /// How the guide came about.
    pub lesson: Lesson,
    /// FEATURE_ bits of direct light.
    pub direct_features: u32,
    pub view: View,
    pub photons: Photons,
    pub film: Film,
    /// Of the iteration under way.
    pub(crate) frame_data: Frame,
    /// Squares (m²) of the caustic and the global radius of the first iteration.
    pub(super) first_radius2: [f64; 2],
    pub(super) alpha: f64,
    /// See [`crate::technique::Row`].
    pub(super) pixel_radii: bool,
    pub reservoir: u32,
    pub evaluate: Evaluate,
    pub(super) timings: Timings,
    pub(super) idle: Idle,
    pub(super) ledger: Ledger64,
}

/// Sums of [`Counters`] over iterations.
#[derive(Default)]
pub(super) struct Ledger64 {
    pub emitted: u64,
    pub stored: u64,
    pub caustic: u64,
    pub culled: u64,
    pub rejected: u64,
    pub absorbed: u64,
    pub escaped: u64,
    pub terminated: u64,
    pub too_long: u64,
    pub regrown: u64,
}

impl Engine {
    /// What the paths of the iteration under way left.
    pub fn traced(&self) -> &Traced {
        self.turns.now()
    }

    /// Where the passes begin of an iteration that traces paths of its own: the device knows the frame.
    pub fn commands(&self) -> Result<Commands> {
        let mut commands = self.gpu.commands()?;
        commands.write(&self.traced().frame, 0, &[self.frame_data]);
        Ok(commands)
    }

    /// Puts the photons in order; returns their keys and indices.
    pub fn record_sort(
        &self,
        commands: &mut Commands,
        counts: [u32; 2],
        order: Order,
    ) -> [Ptr<u32>; 2] {
        let count = counts[0] + counts[1];
        self.photons.record_sort(
            commands,
            &self.world,
            self.traced(),
            self.frame_data.paths,
            count,
            order,
        )
    }

    /// Adds the iteration to the film.
    pub fn record_film(&self, commands: &mut Commands) {
        self.film.record(commands, self.traced());
    }

    /// The rest of an iteration that stored no photon.
    pub fn finish_without_photons(&mut self) -> Result<()> {
        let mut commands = self.gpu.commands()?;
        self.record_film(&mut commands);
        self.finish(commands)?;
        Ok(())
    }

    /// Runs the rest of the iteration.
    pub fn finish(&mut self, commands: Commands) -> Result<Timings> {
        let running = commands.start()?;
        self.look_ahead()?;
        let done = running.wait()?;
        self.add_timings(&done);
        Ok(done.timings)
    }

    /// Radii (m) of the caustic and the global map in the iteration under way.
    pub fn radius(&self) -> [f32; 2] {
        self.frame_data.radius
    }

    /// Radii (m) of the caustic and the global map in an iteration.
    pub(super) fn radius_in(&self, iteration: u64) -> [f32; 2] {
        self.first_radius2.map(|first| {
            let radius2 = match self.pixel_radii {
                true => first,
                false => shrink(first, self.alpha, iteration),
            };
            radius2.sqrt() as f32
        })
    }

    /// How slowly radii shrink, as the settings say.
    pub fn alpha(&self) -> f32 {
        self.alpha as f32
    }

    /// The number of the iteration under way, from 0.
    pub fn iteration(&self) -> u32 {
        self.frame_data.iteration
    }

    /// A seed of the iteration under way alone.
    pub fn iteration_seed(&self) -> u32 {
        let counter = u64::from(self.frame_data.seed) << 32 | u64::from(self.frame_data.iteration);
        // SplitMix64 (Steele et al. 2014).
        let z = counter.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z >> 32) as u32
    }

    /// What was measured and counted so far.
    pub(super) fn forget_measurements(&mut self) {
        self.timings.clear();
        self.idle = Idle::default();
        self.ledger = Ledger64::default();
    }

    pub(super) fn add_timings(&mut self, done: &Done) {
        for (name, ms) in &done.timings {
            match self.timings.iter_mut().find(|(n, _)| n == name) {
                Some((_, total)) => *total += ms,
                None => self.timings.push((name, *ms)),
            }
        }
        self.idle.add(done.span_ms);
    }

    /// Sets the frame for an iteration.
    pub(crate) fn begin(&mut self, iteration: u64) {
        if !self.turns.are_ahead() {
            // Who knows what the device did since the last iteration.
            self.idle.pause();
        }
        self.frame_data.iteration = iteration as u32;
        self.frame_data.radius = self.radius_in(iteration);
    }
}

impl Ledger64 {
    pub fn add(&mut self, paths: u32, c: &Counters) {
        self.emitted += u64::from(paths);
        for (sum, n) in [
            (&mut self.stored, c.photons),
            (&mut self.caustic, c.caustic_photons),
            (&mut self.culled, c.culled),
            (&mut self.rejected, c.rejected),
            (&mut self.absorbed, c.absorbed),
            (&mut self.escaped, c.escaped),
            (&mut self.terminated, c.terminated),
            (&mut self.too_long, c.too_long),
        ] {
            *sum += u64::from(n);
        }
    }
}
