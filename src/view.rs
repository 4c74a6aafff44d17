//! Camera paths to the first diffuse event: one view sample per pixel and iteration.

use crate::Result;
use crate::gpu::{Commands, Gpu, Pass};
use crate::render::Traced;
use crate::scene::{Camera, Projection};
use crate::shared::{Frame, ViewPush};
use crate::world::World;
use glam::Vec3;

/// The view pass and the image's size.
pub struct View {
    pass: Pass,
    pub size: [u32; 2],
}

impl View {
    /// For images of `size` pixels; `features` are FEATURE_ bits beside the world's.
    pub fn new(gpu: &Gpu, world: &World, size: [u32; 2], features: u32) -> Result<Self> {
        Ok(Self {
            pass: world.pass(gpu, "view", features, &[])?,
            size,
        })
    }

    /// Pixels of the image.
    pub fn pixel_count(&self) -> usize {
        self.size.map(|edge| edge as usize).iter().product()
    }

    /// Threads that cover the image in tiles of 8 × 8 (see `glsl/lib/camera.glsl`).
    pub fn tiled_threads(&self) -> usize {
        self.size
            .map(|edge| edge.div_ceil(8) as usize * 8)
            .iter()
            .product()
    }

    /// Traces every pixel's path.
    pub fn record(&self, commands: &mut Commands, world: &World, traced: &Traced) {
        let push = ViewPush {
            world: world.world.ptr(),
            frame: traced.frame.ptr(),
            samples: traced.samples.ptr(),
            pixels: traced.pixels.ptr(),
        };
        commands.dispatch(&self.pass, &push, self.tiled_threads());
    }
}

/// The camera's part of a frame: position, and axes scaled to the image's edges.
pub fn camera_frame(camera: &Camera, size: [u32; 2]) -> Frame {
    let axis = |v: Vec3| camera.world_from_camera.transform_vector3(v);
    let (up, orthographic) = match camera.projection {
        Projection::Perspective { yfov } => ((yfov * 0.5).tan(), 0),
        Projection::Orthographic { ymag } => (ymag, 1),
    };
    let right = up * size[0] as f32 / size[1] as f32;
    Frame {
        camera_position_w: camera.world_from_camera.w_axis.truncate().into(),
        camera_right_w: (axis(Vec3::X) * right).into(),
        camera_up_w: (axis(Vec3::Y) * up).into(),
        camera_forward_w: axis(Vec3::NEG_Z).into(),
        orthographic,
        size,
        ..Default::default()
    }
}
