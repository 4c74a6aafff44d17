//! Images of one pixel and of a million in a row; lenses from 1° to 170°.

use crate::check::{expected, settings};
use crate::place::automatic;
use crate::power::furnace_sphere;
use crate::shapes::*;
use crate::table::{Table, furthest, mean, rel_mse, render};
use glam::{Vec3, vec3};
use lightfall::image::Rgb;
use lightfall::scene::{Light, Scene};
use lightfall::settings::{Direct, Settings};
use std::f32::consts::PI;

pub fn rows(table: &mut Table) {
    let scene = furnace_sphere(0.5, 0.5);
    let one = Settings {
        size: Some([1, 1]),
        ..settings(1, 5_000, 0.2)
    };
    table.worst(
        "an image of 1 × 1",
        "mean off the truth",
        0.02,
        &one,
        |device, settings| (mean(&render(device, &scene, settings, 128)) - 1.0).abs(),
    );
    // Fills the view, whatever the camera.
    let mut sky = Scene::default();
    let shine = material(&mut sky, lamp(Vec3::ONE));
    sphere(&mut sky, Vec3::ZERO, -1.0, 2, false, shine);
    camera(&mut sky, Vec3::ZERO, Vec3::X, 0.01);
    let wide = Settings {
        size: Some([16384, 64]),
        ..automatic()
    };
    let found = furthest(&render(&table.device, &sky, &wide, 1), 1.0);
    table.row(
        "an image of 16384 × 64",
        "any pixel off the truth",
        found,
        1e-6,
    );

    let (height, albedo) = (0.8, vec3(0.8, 0.5, 0.3));
    for degrees in [1.0_f32, 170.0] {
        let mut scene = Scene::default();
        let diffuse = material(&mut scene, lambertian(albedo));
        floor(&mut scene, 0.0, 50.0, diffuse);
        scene.lights.push(Light::Point {
            position_w: Vec3::Y * height,
            intensity: Vec3::ONE,
        });
        camera(
            &mut scene,
            vec3(0.0, 3.0, 0.0),
            Vec3::ZERO,
            degrees.to_radians(),
        );
        let rays = Settings {
            direct: Direct::Rays,
            ..settings(32, 1_000, 0.1)
        };
        let truth = Rgb {
            size: [32, 32],
            pixels: expected(&scene, 32, |eye, d| {
                let p = eye - d * (eye.y / d.y);
                albedo * (height / p.distance(Vec3::Y * height)).powi(3) / (PI * height * height)
            }),
        };
        let found = rel_mse(&render(&table.device, &scene, &rays, 64), &truth);
        table.row(
            &format!("a field of view of {degrees}°"),
            "relMSE against the closed form",
            found,
            1e-3,
        );
    }
}
