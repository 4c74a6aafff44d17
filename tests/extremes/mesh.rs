//! Geometry that modellers never meant.

use crate::check::{Device, settings};
use crate::document::Document;
use crate::shapes::*;
use crate::table::{Table, mean, rel_mse, render};
use glam::{Vec3, vec3};
use lightfall::scene::{Light, Scene};
use lightfall::settings::{Direct, Settings};
use serde_json::json;

pub fn rows(table: &mut Table) {
    let photons = settings(32, 10_000, 0.1);
    let rays = Settings {
        direct: Direct::Rays,
        ..photons.clone()
    };

    let scene = broken_furnace();
    let off = |device: &Device, settings: &Settings| {
        (mean(&render(device, &scene, settings, 6)) - 1.0).abs()
    };
    let name = "slivers, no area, duplicates, bad normals";
    table.worst(
        name,
        "mean off the truth, all by photons",
        0.005,
        &photons,
        off,
    );
    table.one(
        name,
        "mean off the truth, direct light by rays",
        0.005,
        &rays,
        off,
    );

    let [once, twice] = [1, 2].map(floor_times);
    let off = |device: &Device, settings: &Settings| {
        rel_mse(
            &render(device, &twice, settings, 1),
            &render(device, &once, settings, 1),
        )
    };
    let name = "coincident surfaces";
    table.worst(
        name,
        "relMSE against one surface, all by photons",
        1e-6,
        &photons,
        off,
    );
    table.one(
        name,
        "relMSE against one surface, direct light by rays",
        1e-6,
        &rays,
        off,
    );

    for (name, thickness) in [
        ("a wall of 0.1 mm lit from behind", 1e-4),
        ("a shade without thickness lit from behind", 0.0),
    ] {
        let scene = shade(thickness);
        let halo =
            |device: &Device, settings: &Settings| mean(&render(device, &scene, settings, 1));
        table.worst(name, "halo (mean), all by photons", 0.0, &photons, halo);
        table.one(name, "halo (mean), direct light by rays", 0.0, &rays, halo);
    }
}

/// A furnace of radiance 1 whose mesh has every fault that a file may have.
fn broken_furnace() -> Scene {
    let mut plain = Scene::default();
    cuboid(&mut plain, Vec3::ZERO, -Vec3::ONE, 0);
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    let mut triangle = |corners: [Vec3; 3], normal: Vec3| {
        positions.extend(corners.map(|p| p.to_array()));
        normals.extend([normal.to_array(); 3]);
    };
    for (i, t) in plain.triangles.iter().enumerate() {
        let [a, b, c] = t.vertices.map(|v| plain.vertices[v as usize].position_w);
        let normal = plain.vertices[t.vertices[0] as usize].normal_w;
        let normal = [normal, Vec3::ZERO, normal * 1e-20, normal * 1e6][i % 4];
        // A sliver along an edge, the rest, and what has no area.
        let near_b = b + (c - b) * 1e-6;
        triangle([a, b, near_b], normal);
        triangle([a, near_b, c], normal);
        triangle([a, a, b], normal);
        triangle([a, (a + b) * 0.5, b], normal);
        triangle([c, c, c], normal);
    }
    let mut document = Document::new();
    document.attribute("POSITION", &positions);
    document.attribute("NORMAL", &normals);
    document.material(json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0},
        "emissiveFactor": [0.5, 0.5, 0.5],
        "extensions": {"KHR_materials_specular": {"specularFactor": 0}},
    }));
    let mut scene = document.load();
    camera(&mut scene, vec3(0.5, 0.3, 0.6), vec3(-1.0, -0.7, -0.9), 1.5);
    scene
}

/// So many floors in one place below a lamp.
fn floor_times(times: u32) -> Scene {
    let mut scene = Scene::default();
    let diffuse = material(&mut scene, lambertian(vec3(0.8, 0.5, 0.3)));
    (0..times).for_each(|_| floor(&mut scene, 0.0, 1.0, diffuse));
    let shine = material(&mut scene, lamp(Vec3::ONE));
    quad(&mut scene, Vec3::Y, Vec3::X * 0.3, Vec3::Z * 0.3, shine);
    camera(&mut scene, vec3(0.0, 0.9, 1.5), Vec3::ZERO, 0.9);
    scene
}

/// A lamp behind a wall that fills the view.
fn shade(thickness: f32) -> Scene {
    let mut scene = Scene::default();
    let mut paper = lambertian(Vec3::splat(0.8));
    paper.double_sided = true;
    let paper = material(&mut scene, paper);
    match thickness {
        0.0 => quad(&mut scene, Vec3::ZERO, Vec3::X, Vec3::Y, paper),
        _ => cuboid(
            &mut scene,
            Vec3::ZERO,
            vec3(1.0, 1.0, 0.5 * thickness),
            paper,
        ),
    }
    scene.lights.push(Light::Point {
        position_w: vec3(0.2, 0.1, -0.5),
        intensity: Vec3::ONE,
    });
    camera(&mut scene, vec3(0.0, 0.0, 1.0), Vec3::ZERO, 0.8);
    scene
}
