//! Techniques held to each other: the same photons, found in other ways.

use crate::check::{Device, layer, settings};
use crate::estimators::{assert_same_expectation, measure};
use crate::showroom::showroom;
use glam::{Mat4, Vec3, vec3};
use lightfall::gpu::Gpu;
use lightfall::render::Renderer;
use lightfall::scene::{Light, Scene};
use lightfall::settings::{Evaluate, Settings, Switch, Trace};
use lightfall::technique::TECHNIQUES;

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

/// Grids find what boxes find: with cells larger than the scene, with far more cells than slots, and
/// far from the origin, where rounding is coarse. Lists do as long as none is full.
#[test]
fn grids_find_the_same_photons() {
    let device = Device::open();
    let room = showroom(&device);
    let far = shifted(room.clone(), vec3(1000.0, -700.0, 300.0));
    let (grid, all) = (&["hash-grid"][..], &["hash-grid", "hash-ppm"][..]);
    for trace in device.traversals() {
        for (what, scene, edge, radius, rivals) in [
            ("middling", &room, 64, 0.05, grid),
            ("large", &room, 64, 0.3, grid),
            ("larger than the scene", &room, 16, 5.0, grid),
            ("tiny", &room, 256, 1e-3, all),
            ("far", &far, 64, 0.05, grid),
            // So large that a thread of a CPU device gathers at twice as many points.
            ("far and small", &far, 512, 0.004, all),
        ] {
            let settings = Settings {
                trace,
                ..settings(edge, 20_000, radius)
            };
            let boxes = iteration(&device, scene, &settings, "rtpm");
            for rival in rivals {
                let found = iteration(&device, scene, &settings, rival);
                for (a, b) in boxes.iter().zip(&found) {
                    let seen = a.iter().filter(|x| **x != 0.0).count();
                    let most = a
                        .iter()
                        .zip(b)
                        .map(|(a, b)| (a - b).abs() / a.abs().max(1e-6))
                        .fold(0.0, f32::max);
                    println!("{rival}, {trace:?}, {what}: {seen} values, at most {most:e} off");
                    assert!(seen > 0, "{trace:?}, {what}: nothing is found");
                    assert!(most <= 1e-4, "{rival}, {trace:?}, {what}: {most:e} off");
                }
            }
        }
    }
}

/// Full lists, one photon for many, and lists of which every other photon is looked at, all leave the
/// expected image.
#[test]
fn rivals_leave_the_expected_image() {
    let device = Device::open();
    let scene = showroom(&device);
    let plain = Settings {
        trace: Trace::Software,
        cull: Switch::Off,
        // One without the rare photon that grazes a shading normal and outshines all others.
        seed: 40,
        ..settings(32, 100_000, 0.08)
    };
    let truth = measure(&device, &scene, &plain);
    let rivals = TECHNIQUES
        .iter()
        .filter(|row| row.photons && row.name != "rtpm");
    for (row, seed) in rivals.zip(1..) {
        for evaluate in [Evaluate::Full, Evaluate::Stochastic] {
            let settings = Settings {
                technique: row.name.into(),
                evaluate,
                seed,
                ..plain.clone()
            };
            let what = format!("{}, {evaluate:?}", row.name);
            assert_same_expectation(&what, &measure(&device, &scene, &settings), &truth);
        }
    }
}
