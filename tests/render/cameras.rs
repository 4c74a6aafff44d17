//! Orthographic cameras, and what only cameras see.

use crate::check::{Device, check, layer, settings};
use crate::closed_forms::{ALBEDO, floor_scene, on_floor};
use crate::shapes::*;
use glam::{Vec3, vec3};
use lightfall::render::Renderer;
use lightfall::scene::{Light, Material, Projection, Scene};
use std::f32::consts::PI;

const COLOR: Vec3 = vec3(0.2, 0.5, 0.9);

fn unlit(scene: &mut Scene) -> u32 {
    let unlit = Material {
        unlit: true,
        ..lambertian(COLOR)
    };
    material(scene, unlit)
}

/// Parallel rays see the sheet as large as it is, with its colour in nit; it throws no shadow.
#[test]
fn an_unlit_sheet_seen_by_an_orthographic_camera() {
    let (direction_w, illuminance) = (vec3(0.6, -0.8, 0.0), vec3(3.0, 5.0, 7.0));
    let mut scene = floor_scene(1.5, 0.6);
    let unlit = unlit(&mut scene);
    floor(&mut scene, 1.0, 0.5, unlit);
    scene.cameras[0].projection = Projection::Orthographic { ymag: 1.0 };
    scene.lights.push(Light::Directional {
        direction_w,
        illuminance,
    });
    check(
        &scene,
        &settings(64, 100_000, 0.03),
        16,
        "",
        |eye, d| match on_floor(eye, d).abs().max_element() < 0.5 {
            true => COLOR,
            false => ALBEDO * illuminance * 0.8 / PI,
        },
    );
}

/// What is unlit needs no light.
#[test]
fn a_scene_that_is_all_unlit_renders() {
    let device = Device::open();
    let mut scene = Scene::default();
    let unlit = unlit(&mut scene);
    floor(&mut scene, 0.0, 1.0, unlit);
    camera(&mut scene, Vec3::Y, Vec3::ZERO, 0.5);
    for technique in ["rtpm", "path"] {
        let settings = lightfall::settings::Settings {
            technique: technique.into(),
            ..settings(8, 1000, 0.03)
        };
        let mut renderer = Renderer::new(&device, &scene, &settings).unwrap();
        renderer.iterate().unwrap();
        let picture = renderer.picture().unwrap();
        for (i, value) in layer(&picture, "").iter().enumerate() {
            assert!((value - COLOR[i % 3]).abs() < 1e-5, "{technique}: {value}");
        }
    }
}
