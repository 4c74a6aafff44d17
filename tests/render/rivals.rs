//! Techniques held to each other: the same photons, found in other ways.

use crate::check::{Device, layer, settings};
use crate::showroom::showroom;
use glam::{Mat4, Vec3, vec3};
use lightfall::gpu::Gpu;
use lightfall::render::Renderer;
use lightfall::scene::{Light, Scene};
use lightfall::settings::Settings;

/// The caustic and the global layer of one iteration.
fn iteration(gpu: &Gpu, scene: &Scene, settings: &Settings, technique: &str) -> [Vec<f32>; 2] {
    let settings = Settings {
        technique: technique.into(),
        ..settings.clone()
    };
    let mut renderer = Renderer::new(gpu, scene, &settings).unwrap();
    renderer.iterate().unwrap();
    let picture = renderer.picture().unwrap();
    ["caustic", "global"].map(|name| layer(&picture, name).to_vec())
}

fn shifted(mut scene: Scene, by: Vec3) -> Scene {
    for vertex in &mut scene.vertices {
        vertex.position_w += by;
    }
    for light in &mut scene.lights {
        if let Light::Spot { position_w, .. } = light {
            *position_w += by;
        }
    }
    for camera in &mut scene.cameras {
        camera.world_from_camera = Mat4::from_translation(by) * camera.world_from_camera;
    }
    scene
}

/// A grid finds what boxes find: with cells larger than the scene, with far more cells than slots, and
/// far from the origin, where rounding is coarse.
#[test]
fn a_hashed_grid_finds_the_same_photons() {
    let device = Device::open();
    let room = showroom(&device);
    let far = shifted(room.clone(), vec3(1000.0, -700.0, 300.0));
    for trace in device.traversals() {
        for (what, scene, edge, radius) in [
            ("middling", &room, 64, 0.05),
            ("large", &room, 64, 0.3),
            ("larger than the scene", &room, 16, 5.0),
            ("tiny", &room, 256, 1e-3),
            ("far", &far, 64, 0.05),
            ("far and small", &far, 256, 0.004),
        ] {
            let settings = Settings {
                trace,
                ..settings(edge, 20_000, radius)
            };
            let boxes = iteration(&device, scene, &settings, "rtpm");
            let grid = iteration(&device, scene, &settings, "hash-grid");
            for (a, b) in boxes.iter().zip(&grid) {
                let seen = a.iter().filter(|x| **x != 0.0).count();
                let most = a
                    .iter()
                    .zip(b)
                    .map(|(a, b)| (a - b).abs() / a.abs().max(1e-6))
                    .fold(0.0, f32::max);
                println!("{trace:?}, {what}: {seen} values, at most {most:e} off");
                assert!(seen > 0, "{trace:?}, {what}: nothing is found");
                assert!(most <= 1e-4, "{trace:?}, {what}: {most:e} off");
            }
        }
    }
}
