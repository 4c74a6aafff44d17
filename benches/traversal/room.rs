//! What is traced: a closed room with a lamp, full of bumpy balls.

use crate::shapes::*;
use glam::{Vec3, vec3};
use lightfall::scene::Scene;

/// Corners of the lamp under the ceiling: its centre and half edges [m].
pub const LAMP: [Vec3; 3] = [
    Vec3::new(0.0, 0.98, 0.0),
    Vec3::new(0.3, 0.0, 0.0),
    Vec3::new(0.0, 0.0, 0.3),
];

/// 2 m wide, with `balls` (at most 27) of 20 · 4^`splits` triangles each. Every triangle has
/// vertices of its own.
pub fn room(balls: usize, splits: u32) -> Scene {
    let mut scene = Scene::default();
    let wall = material(&mut scene, lambertian(vec3(0.7, 0.65, 0.6)));
    let shine = material(&mut scene, lamp(Vec3::splat(10.0)));
    cuboid(&mut scene, Vec3::ZERO, Vec3::splat(-1.0), wall);
    quad(&mut scene, LAMP[0], LAMP[1], LAMP[2], shine);
    for i in 0..balls {
        // Neighbours in the list lie in different layers, so that few balls fill the room too.
        let cell = vec3(
            (i % 3) as f32,
            (i * 2 / 3 % 3) as f32,
            (i / 9 + i / 3) as f32 % 3.0,
        ) - 1.0;
        let shift = vec3(
            (i as f32 * 1.7).sin(),
            (i as f32 * 2.3).sin(),
            (i as f32 * 3.1).sin(),
        );
        let center = cell * 0.6 + shift * 0.08;
        let first = scene.vertices.len();
        sphere(&mut scene, center, 0.2, splits, false, wall);
        for vertex in scene.vertices.iter_mut().skip(first) {
            let d = (vertex.position_w - center) * 60.0;
            vertex.position_w +=
                (vertex.position_w - center) * 0.08 * (d.x.sin() + d.y.sin() * d.z.sin());
        }
    }
    camera(&mut scene, vec3(0.0, 0.0, 0.99), vec3(0.0, -0.1, -1.0), 1.4);
    scene
}
