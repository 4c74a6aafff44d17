//! Path tracing with next-event estimation and multiple importance sampling: the reference without
//! bias that the others are held to (Kajiya 1986; Veach 1997, chapter 9).

use super::Technique;
use crate::Result;
use crate::gpu::Pass;
use crate::render::Engine;
use crate::shared::PathPush;

/// One path per pixel and iteration.
pub struct Path {
    pass: Pass,
}

impl Technique for Path {
    fn iterate(&mut self, engine: &mut Engine) -> Result<()> {
        let mut commands = engine.commands()?;
        let push = PathPush {
            world: engine.world.world.ptr(),
            frame: engine.traced().frame.ptr(),
            pixels: engine.traced().pixels.ptr(),
        };
        commands.dispatch(&self.pass, &push, engine.view.tiled_threads());
        engine.record_film(&mut commands);
        engine.finish(commands)?;
        Ok(())
    }
}

impl Path {
    /// For the engine's world.
    pub fn new(engine: &Engine) -> Result<Self> {
        Ok(Self {
            pass: engine.world.pass(&engine.gpu, "path", 0, &[])?,
        })
    }
}
