//! Smooth and rough, bent not at all or as far as it goes.

use crate::check::settings;
use crate::shapes::*;
use crate::table::{Table, furthest, mean, rel_mse, render};
use glam::{Vec3, vec3};
use lightfall::scene::{Material, Scene};
use lightfall::settings::{Direct, Settings};

pub fn rows(table: &mut Table) {
    let rays = Settings {
        direct: Direct::Rays,
        ..settings(32, 100, 0.1)
    };
    let image = |table: &Table, roughness: f32| {
        let metal = Material {
            roughness,
            ..mirror(0.9)
        };
        render(&table.device, &below_a_lamp(metal), &rays, 64)
    };
    let smooth = image(table, 0.0);
    for roughness in [1e-4, 2e-3] {
        let found = rel_mse(&image(table, roughness), &smooth);
        table.row(
            &format!("roughness {roughness}"),
            "relMSE against 0",
            found,
            1e-3,
        );
    }
    for ior in [1.0, 1.000001, 3.0] {
        let scene = white_sky(Material { ior, ..glass(0.0) });
        let found = furthest(&render(&table.device, &scene, &deep(), 4), 1.0);
        table.row(
            &format!("a ball of ior {ior}"),
            "any pixel off the truth",
            found,
            1e-5,
        );
    }
    // Radiance in glass is n² times that outside, in every direction that light can come from.
    for ior in [1.5, 3.0] {
        let mut scene = white_sky(Material { ior, ..glass(0.0) });
        camera(&mut scene, vec3(0.3, 0.1, 0.0), vec3(-1.0, 0.2, 0.1), 1.2);
        let found = furthest(
            &render(&table.device, &scene, &deep(), 8),
            f64::from(ior * ior),
        );
        table.row(
            &format!("a camera inside glass of ior {ior}"),
            "any pixel off the truth",
            found,
            1e-5,
        );
    }
    // Along a pane: total reflection at 85° and more, up to a hundred times, until the edge lets light out.
    let mut scene = sky();
    let clear = material(&mut scene, glass(0.0));
    cuboid(&mut scene, Vec3::ZERO, vec3(1.0, 0.01, 1.0), clear);
    camera(&mut scene, Vec3::ZERO, Vec3::X, 0.15);
    let found = (mean(&render(&table.device, &scene, &deep(), 8)) / 2.25 - 1.0).abs();
    table.row(
        "total reflection at grazing angles",
        "mean off the truth",
        found,
        1e-5,
    );
}

/// Long paths, and light by rays.
fn deep() -> Settings {
    Settings {
        max_depth: 64,
        direct: Direct::Rays,
        ..settings(24, 100, 0.05)
    }
}

/// Light of radiance 1 from everywhere.
fn sky() -> Scene {
    let mut scene = Scene::default();
    let shine = material(&mut scene, lamp(Vec3::ONE));
    sphere(&mut scene, Vec3::ZERO, -10.0, 1, false, shine);
    scene
}

/// A ball under that sky which fills the view.
fn white_sky(ball: Material) -> Scene {
    let mut scene = sky();
    let ball = material(&mut scene, ball);
    sphere(&mut scene, Vec3::ZERO, 1.0, 4, true, ball);
    camera(&mut scene, Vec3::Z * 3.0, Vec3::ZERO, 0.4);
    scene
}

/// A floor that shows a small lamp.
fn below_a_lamp(metal: Material) -> Scene {
    let mut scene = Scene::default();
    let metal = material(&mut scene, metal);
    floor(&mut scene, 0.0, 1.0, metal);
    let shine = material(&mut scene, lamp(Vec3::ONE));
    quad(
        &mut scene,
        vec3(0.0, 1.0, -1.0),
        Vec3::X * 0.3,
        vec3(0.0, 0.3, -0.3).cross(Vec3::X).normalize() * 0.3,
        shine,
    );
    quad(
        &mut scene,
        vec3(0.0, 1.0, -1.0),
        vec3(0.0, 0.3, -0.3).cross(Vec3::X).normalize() * 0.3,
        Vec3::X * 0.3,
        shine,
    );
    camera(&mut scene, vec3(0.0, 1.0, 1.0), Vec3::ZERO, 0.6);
    scene
}
