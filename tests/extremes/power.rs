//! Light from faint to blinding, and long paths.

use crate::check::settings;
use crate::place::{automatic, cornell};
use crate::shapes::{camera, lambertian, material, sphere};
use crate::table::{Table, mean, rel_mse, render};
use glam::{DVec3, Vec3, vec3};
use lightfall::scene::{Material, Scene};
use lightfall::settings::Settings;

pub fn rows(table: &mut Table) {
    let unit = cornell(1.0, DVec3::ZERO);
    let settings_ = table.ways(&automatic()).swap_remove(0);
    let truth = render(&table.device, &unit, &settings_, 1);
    for (power, scale) in [(1e-8, 1.0), (1e12, 1.0), (1e-8, 1e-4), (1e12, 1e6)] {
        let mut scene = cornell(scale, DVec3::ZERO);
        scene
            .materials
            .iter_mut()
            .for_each(|m| m.emission *= power as f32);
        let mut image = render(&table.device, &scene, &settings_, 1);
        image.pixels.iter_mut().for_each(|x| *x /= power as f32);
        let place = if scale == 1.0 {
            String::new()
        } else {
            format!(" in a scene scaled by {scale:e}")
        };
        table.row(
            &format!("light times {power:e}{place}"),
            "relMSE, divided by it",
            rel_mse(&image, &truth),
            1e-4,
        );
    }

    // 64 edges: the series 1 + ρ + ρ² … has 64 terms.
    let scene = furnace_sphere(1.0, 1.0 / 64.0);
    let long = Settings {
        max_depth: 64,
        ..settings(16, 1_000, 0.1)
    };
    table.worst(
        "albedo 1, paths of 64 edges",
        "mean off the truth",
        0.005,
        &long,
        |device, settings| (mean(&render(device, &scene, settings, 8)) - 1.0).abs(),
    );
}

/// A sphere of radius 1 m that reflects and shines, seen from within.
pub fn furnace_sphere(albedo: f32, radiance: f32) -> Scene {
    let mut scene = Scene::default();
    let wall = Material {
        emission: Vec3::splat(radiance),
        ..lambertian(Vec3::splat(albedo))
    };
    let wall = material(&mut scene, wall);
    sphere(&mut scene, Vec3::ZERO, -1.0, 4, false, wall);
    camera(&mut scene, vec3(0.4, 0.1, -0.2), vec3(-1.0, 0.2, 0.3), 1.5);
    scene
}
