//! What all techniques share, and the parts of an iteration that they call.

use super::radius::shrink;
use crate::Result;
use crate::film::Film;
use crate::gpu::{Buffer, Commands, Gpu, Ptr, Timings};
use crate::photons::{Order, Photons};
use crate::settings::Evaluate;
use crate::shared::{Counters, Frame};
use crate::view::View;
use crate::world::World;

/// What all techniques share: the scene, camera paths, light paths and the film.
pub struct Engine {
    pub gpu: Gpu,
    pub world: World,
    pub view: View,
    pub photons: Photons,
    pub film: Film,
    /// Of the iteration under way.
    pub frame: Buffer<Frame>,
    pub(super) frame_data: Frame,
    /// Squares (m²) of the caustic and the global radius of the first iteration.
    pub(super) first_radius2: [f64; 2],
    pub(super) alpha: f64,
    /// See [`crate::technique::Row`].
    pub(super) pixel_radii: bool,
    pub reservoir: u32,
    pub evaluate: Evaluate,
    pub(super) timings: Timings,
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
    /// Where the passes of an iteration begin: the device knows the frame.
    pub fn commands(&self) -> Result<Commands> {
        self.gpu.write(&self.frame, 0, &[self.frame_data])?;
        self.gpu.commands()
    }

    /// Camera paths, then light paths, if there are any, repeated with larger buffers until no photon is lost.
    /// Returns how many photons the caustic and the global map hold.
    pub fn trace_paths(&mut self) -> Result<[u32; 2]> {
        let paths = self.frame_data.paths;
        if paths == 0 {
            let mut commands = self.commands()?;
            self.view.record(&mut commands, &self.world, &self.frame);
            self.finish(commands)?;
            return Ok([0, 0]);
        }
        loop {
            self.frame_data.capacity = self.photons.capacity() as u32;
            let mut commands = self.commands()?;
            self.view.record(&mut commands, &self.world, &self.frame);
            if self.frame_data.cull != 0 {
                self.photons
                    .record_cull(&mut commands, &self.view, &self.frame);
            }
            let (counters, timings) =
                self.photons
                    .emit(&self.gpu, commands, &self.world, &self.frame, paths)?;
            self.add_timings(timings);
            if counters.photons as usize <= self.photons.capacity() {
                self.ledger.add(paths, &counters);
                return Ok([
                    counters.caustic_photons,
                    counters.photons - counters.caustic_photons,
                ]);
            }
            self.photons.grow(&self.gpu, counters.photons)?;
            self.ledger.regrown += 1;
        }
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
            &self.frame,
            self.frame_data.paths,
            count,
            order,
        )
    }

    /// Adds the iteration to the film.
    pub fn record_film(&self, commands: &mut Commands) {
        self.film.record(commands, &self.view, &self.frame);
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
        let timings = commands.submit()?;
        self.add_timings(timings.clone());
        Ok(timings)
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

    fn add_timings(&mut self, timings: Timings) {
        for (name, ms) in timings {
            match self.timings.iter_mut().find(|(n, _)| *n == name) {
                Some((_, total)) => *total += ms,
                None => self.timings.push((name, ms)),
            }
        }
    }

    /// Sets the frame for an iteration.
    pub(super) fn begin(&mut self, iteration: u64) {
        self.frame_data.iteration = iteration as u32;
        self.frame_data.radius = self.radius_in(iteration);
    }
}

impl Ledger64 {
    fn add(&mut self, paths: u32, c: &Counters) {
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
