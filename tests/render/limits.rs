//! The emptiest and least lit of renders; tests/extremes has the smallest and largest.

use crate::check::{Device, layer, settings};
use crate::closed_forms::floor_scene;
use crate::showroom::showroom;
use glam::{Vec3, vec3};
use lightfall::render::Renderer;
use lightfall::scene::{Light, Scene};
use lightfall::settings::{Settings, Trace};

#[test]
fn nothing_that_shines_is_an_error() {
    let device = Device::open();
    for trace in device.traversals() {
        let settings = Settings {
            trace,
            ..settings(8, 100, 0.1)
        };
        let error = Renderer::new(&device, &floor_scene(1.0, 0.5), &settings)
            .err()
            .expect("light");
        assert!(error.to_string().contains("nothing emits light"), "{error}");
    }
}

/// Light, but nothing to see or to store a photon on.
#[test]
fn nothing_in_view_is_black() {
    let device = Device::open();
    let mut scene = floor_scene(1.0, 0.5);
    crate::shapes::camera(&mut scene, vec3(0.0, 3.0, 0.0), vec3(0.0, 4.0, 0.0), 0.5);
    scene.lights.push(Light::Point {
        position_w: vec3(0.0, -1.0, 0.0),
        intensity: Vec3::ONE,
    });
    let empty = Scene {
        triangles: Vec::new(),
        vertices: Vec::new(),
        ..scene.clone()
    };
    for trace in device.traversals() {
        for scene in [&scene, &empty] {
            let settings = Settings {
                trace,
                ..settings(9, 1_000, 0.1)
            };
            let mut renderer = Renderer::new(&device, scene, &settings).unwrap();
            (0..2).for_each(|_| renderer.iterate().unwrap());
            assert!(
                layer(&renderer.picture().unwrap(), "")
                    .iter()
                    .all(|x| *x == 0.0)
            );
        }
    }
}

/// Sizes that are no multiple of a tile, and lengths in pixels.
#[test]
fn odd_sizes() {
    let device = Device::open();
    let settings = Settings {
        size: Some([13, 7]),
        photons: Some(3_001),
        trace: Trace::Software,
        ..Settings::default()
    };
    let mut renderer = Renderer::new(&device, &showroom(&device), &settings).unwrap();
    renderer.iterate().unwrap();
    let picture = renderer.picture().unwrap();
    assert_eq!((picture.width, picture.height), (13, 7));
    assert!(
        layer(&picture, "albedo")
            .chunks(3)
            .all(|rgb| rgb.iter().all(|x| *x >= 0.0))
    );
    assert!(layer(&picture, "").iter().all(|x| x.is_finite()));
}
