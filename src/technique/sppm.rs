//! Stochastic progressive photon mapping: each pixel's radii shrink by the photons that it found (Hachisuka
//! & Jensen 2009). Photons are found as `rtpm` finds them; boxes are as large as the first radius, which bounds all.

use super::Technique;
use super::rtpm::Rtpm;
use crate::Result;
use crate::film::resumed_layer;
use crate::gpu::{Buffer, Pass};
use crate::image::Layer;
use crate::render::Engine;
use crate::shaders::spirv;
use crate::shared::*;

/// [`PixelStatistics`] in a saved picture.
const LAYER: &str = "resume.sppm";
const CHANNELS: &[&str] = &[
    "kept_caustic",
    "kept_global",
    "radius2_caustic",
    "radius2_global",
];

/// What finds photons, and what is known of each pixel.
pub struct Sppm {
    photons: Rtpm,
    shrink: Pass,
    statistics: Buffer<PixelStatistics>,
}

impl Technique for Sppm {
    fn iterate(&mut self, engine: &mut Engine) -> Result<()> {
        let (mut commands, counts) = self.photons.build(engine)?;
        self.photons.gather.record(engine, &mut commands, counts);
        let push = PixelRadiiPush {
            frame: engine.traced().frame.ptr(),
            pixels: engine.traced().pixels.ptr(),
            statistics: self.statistics.ptr(),
            alpha: engine.alpha(),
            unused: 0,
        };
        commands.dispatch(&self.shrink, &push, engine.view.pixel_count());
        self.photons.gather.finish(engine, commands)
    }

    fn state(&self, engine: &Engine) -> Result<Vec<Layer>> {
        let pixels = engine
            .gpu
            .read(&self.statistics, 0..self.statistics.len())?;
        let floats = bytemuck::cast_slice(&pixels).to_vec();
        Ok(vec![Layer::new(LAYER, CHANNELS, floats)])
    }

    fn restore(&mut self, engine: &Engine, layers: &[Layer]) -> Result<()> {
        let layer = resumed_layer(layers, LAYER, self.statistics.len() * CHANNELS.len())?;
        let pixels: &[PixelStatistics] = bytemuck::cast_slice(&layer.pixels);
        engine.gpu.write(&self.statistics, 0, pixels)
    }
}

impl Sppm {
    /// For the engine's traversal.
    pub fn new(engine: &Engine) -> Result<Self> {
        let gpu = &engine.gpu;
        let nothing = vec![PixelStatistics::default(); engine.view.pixel_count()];
        let statistics = gpu.upload("pixel statistics", &nothing)?;
        let mut photons = Rtpm::new(engine, "sppm")?;
        photons.gather.statistics = statistics.ptr();
        Ok(Self {
            photons,
            shrink: gpu.pass("shrink", spirv("sppm.shrink")?, &[], None)?,
            statistics,
        })
    }
}
