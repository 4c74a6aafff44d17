//! Camera and light paths of an iteration: what they leave, and those of iterations to come.

use super::engine::Engine;
use crate::Result;
use crate::gpu::{Buffer, DeviceKind, Gpu, Running};
use crate::shared::{Counters, Frame, FramePixel, Photon, ViewSample};
use std::collections::VecDeque;

/// What the paths of one iteration leave for the rest of it.
pub struct Traced {
    /// Of that iteration.
    pub frame: Buffer<Frame>,
    /// One a pixel, as [`Self::pixels`].
    pub samples: Buffer<ViewSample>,
    pub pixels: Buffer<FramePixel>,
    pub photons: Buffer<Photon>,
    /// Photons of each path; then, scanned, where each path's begin.
    pub path_photons: Buffer<u32>,
    pub counters: Buffer<Counters>,
    counted: Buffer<Counters>,
}

impl Traced {
    /// For so many pixels and light paths.
    pub fn new(gpu: &Gpu, pixels: usize, paths: u32) -> Result<Self> {
        Ok(Self {
            frame: gpu.buffer("frame", 1)?,
            samples: gpu.buffer("view samples", pixels)?,
            pixels: gpu.buffer("pixels", pixels)?,
            photons: gpu.buffer("photons", first_capacity(paths))?,
            path_photons: gpu.buffer("path photons", paths as usize + 1)?,
            counters: gpu.buffer("counters", 1)?,
            counted: gpu.host_buffer("counted", 1)?,
        })
    }
}

/// Photons that most scenes store at most; for others buffers grow.
pub fn first_capacity(paths: u32) -> usize {
    (paths as usize * 2).max(1024)
}

/// Paths under way.
struct Tracing {
    iteration: u64,
    running: Running,
}

/// What paths leave in turn, and the paths that the device traces while the host is at something
/// else.
///
/// The host must know how many photons an iteration has before it can ask for the rest of it. So
/// that a GPU has work until then, the paths of the next two iterations are always under way: those
/// of i + 2 follow the rest of i, whose place they take. A CPU device would trace them on the cores
/// that the host wants, at an end in vain.
pub struct Turns {
    // Dropped, and so waited for, before what it fills.
    ahead: VecDeque<Tracing>,
    sets: Vec<Traced>,
    now: usize,
}

impl Turns {
    /// One set for CPU devices and for techniques without light paths; else two, where there is
    /// memory for both.
    pub fn new(gpu: &Gpu, pixels: usize, paths: u32) -> Result<Self> {
        let set = || Traced::new(gpu, pixels, paths);
        let mut sets = vec![set()?];
        if paths > 0 && gpu.info().kind != DeviceKind::Cpu {
            sets.extend(set().ok());
        }
        Ok(Self {
            ahead: VecDeque::new(),
            sets,
            now: 0,
        })
    }

    /// The device has work between iterations.
    pub fn are_ahead(&self) -> bool {
        !self.ahead.is_empty()
    }

    /// Of the iteration under way.
    pub fn now(&self) -> &Traced {
        &self.sets[self.now]
    }
}

impl Engine {
    /// Camera paths, then light paths, if there are any, repeated with larger buffers until no
    /// photon is lost. Returns how many photons the caustic and the global map hold.
    pub fn trace_paths(&mut self) -> Result<[u32; 2]> {
        let iteration = u64::from(self.frame_data.iteration);
        self.turns.now = iteration as usize % self.turns.sets.len();
        let expected = self.turns.ahead.pop_front();
        let mut tracing = match expected.filter(|t| t.iteration == iteration) {
            Some(tracing) => tracing,
            None => {
                self.turns.ahead.clear();
                self.start_paths(iteration)?
            }
        };
        loop {
            let done = tracing.running.wait()?;
            self.add_timings(&done);
            if self.frame_data.paths == 0 {
                return Ok([0, 0]);
            }
            let counted = self.gpu.read(&self.turns.now().counted, 0..1)?;
            let counters = counted.first().copied().unwrap_or_default();
            if counters.photons as usize <= self.turns.now().photons.len() {
                self.ledger.add(self.frame_data.paths, &counters);
                return Ok([
                    counters.caustic_photons,
                    counters.photons - counters.caustic_photons,
                ]);
            }
            let capacity = counters.photons as usize + counters.photons as usize / 4;
            self.turns.sets[self.turns.now].photons = self.gpu.buffer("photons", capacity)?;
            self.photons.reserve(&self.gpu, capacity)?;
            self.ledger.regrown += 1;
            tracing = self.start_paths(iteration)?;
        }
    }

    /// Has the paths of the next two iterations traced once the rest of this one, which the device
    /// knows of, is done.
    pub(super) fn look_ahead(&mut self) -> Result<()> {
        if self.turns.sets.len() > 1 {
            while let missing = self.turns.ahead.len() as u64
                && missing < 2
            {
                let tracing =
                    self.start_paths(u64::from(self.frame_data.iteration) + 1 + missing)?;
                self.turns.ahead.push_back(tracing);
            }
        }
        Ok(())
    }

    /// Paths that are under way begin where they should not.
    pub(super) fn forget_ahead(&mut self) {
        self.turns.ahead.clear();
    }

    fn start_paths(&self, iteration: u64) -> Result<Tracing> {
        let traced = &self.turns.sets[iteration as usize % self.turns.sets.len()];
        let frame = Frame {
            iteration: iteration as u32,
            radius: self.radius_in(iteration),
            capacity: traced.photons.len() as u32,
            ..self.frame_data
        };
        let mut commands = self.gpu.commands()?;
        commands.write(&traced.frame, 0, &[frame]);
        self.view.record(&mut commands, &self.world, traced);
        if frame.paths > 0 {
            if frame.cull != 0 {
                self.photons.record_cull(&mut commands, traced);
            }
            self.photons
                .record_emit(&mut commands, &self.world, &self.guide, traced, frame.paths);
            commands.copy(&traced.counters, 0..1, &traced.counted, 0);
        }
        Ok(Tracing {
            iteration,
            running: commands.start()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Renderer;
    use crate::settings::{Direct, Settings, Trace};
    use std::path::Path;

    /// As a discrete GPU whose memory the host does not see, beside the CPU device that it is: the
    /// same light paths and pixels, however often buffers grow under way; and bit for bit the same
    /// when it goes on from a saved picture.
    #[test]
    fn paths_traced_ahead_change_nothing() {
        let gpus = [DeviceKind::Cpu, DeviceKind::Discrete].map(|kind| {
            Gpu::open_as(|info| {
                info.kind = kind;
                info.caps.unified = kind == DeviceKind::Cpu;
            })
        });
        let scene = crate::scene::load(Path::new("scenes/room.glb")).unwrap();
        for technique in ["rtpm", "sppm", "hash-ppm"] {
            let settings = Settings {
                size: Some([24; 2]),
                // So few leave more photons than there is room for, now and then.
                photons: Some(600),
                trace: Trace::Software,
                technique: technique.into(),
                direct: Direct::Photons,
                ledger: true,
                ..Settings::default()
            };
            let [truth, ahead] = gpus.each_ref().map(|gpu| {
                let mut renderer = Renderer::new(gpu, &scene, &settings).unwrap();
                for _ in 0..7 {
                    renderer.iterate().unwrap();
                }
                renderer
            });
            assert_eq!(ahead.engine.turns.ahead.len(), 2);
            assert_eq!(truth.engine.turns.sets.len(), 1);
            let counts = |renderer: &Renderer| {
                let mut ledger = renderer.ledger();
                let (_, grown) = ledger.pop().unwrap();
                (ledger, grown)
            };
            let ((of_truth, _), (of_ahead, grown)) = (counts(&truth), counts(&ahead));
            assert_eq!(of_truth, of_ahead, "{technique}");
            assert!(grown > 0, "{technique}");

            let mut resumed = Renderer::new(&gpus[1], &scene, &settings).unwrap();
            for _ in 0..3 {
                resumed.iterate().unwrap();
            }
            let saved = resumed.picture().unwrap();
            // What is traced ahead is of other iterations than those to come.
            resumed.iterate().unwrap();
            resumed.resume(&saved).unwrap();
            for _ in 3..7 {
                resumed.iterate().unwrap();
            }
            let [truth, ahead, resumed] = [truth, ahead, resumed].map(|r| r.picture().unwrap());
            for (i, layer) in ahead.layers.iter().enumerate() {
                let name = &layer.name;
                assert!(
                    layer.pixels == resumed.layers[i].pixels,
                    "{technique} {name}"
                );
                let differs = |(a, b): &(&f32, &f32)| (*a - *b).abs() > 1e-4 * a.abs().max(1e-6);
                let pairs = truth.layers[i].pixels.iter().zip(&layer.pixels);
                let low = name.ends_with(".low") || name.contains("bias");
                let count = pairs.filter(differs).count();
                assert!(low || count == 0, "{technique} {name}: {count}");
            }
        }
        for gpu in &gpus {
            assert_eq!(gpu.validation_messages(), Vec::<String>::new());
        }
    }
}
