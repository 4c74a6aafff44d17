//! A closed room whose every wall reflects ρ and shines L looks L / (1 - ρ) in every direction,
//! from any place (the furnace): energy that any part of the renderer loses or gains shows here.

use crate::check::{check, settings};
use crate::shapes::*;
use glam::{Vec3, vec3};
use lightfall::scene::{Material, Scene};

/// Of reflectance ρ and radiance 1 - ρ, so that all is 1.
fn furnace(albedo: f32, room: impl Fn(&mut Scene, u32), eye: Vec3, target: Vec3) -> Scene {
    let mut scene = Scene::default();
    let wall = Material {
        emission: Vec3::splat(1.0 - albedo),
        ..lambertian(Vec3::splat(albedo))
    };
    let wall = material(&mut scene, wall);
    room(&mut scene, wall);
    camera(&mut scene, eye, target, 1.5);
    scene
}

/// Twelve edges hold all but 2⁻¹² of the series.
#[test]
fn a_box_looks_the_same_everywhere() {
    let room = |scene: &mut Scene, wall| cuboid(scene, Vec3::ZERO, -vec3(1.0, 1.0, 1.0), wall);
    let scene = furnace(0.5, room, vec3(0.5, 0.3, 0.6), vec3(-1.0, -0.7, -0.9));
    check(&scene, &settings(96, 50_000, 0.012), 16, "", |_, _| {
        Vec3::ONE
    });
}

/// Wide kernels reach beyond the walls' edges, and two edges meet in each corner.
#[test]
fn a_box_looks_the_same_through_wide_kernels() {
    let room = |scene: &mut Scene, wall| cuboid(scene, Vec3::ZERO, -vec3(1.0, 1.0, 1.0), wall);
    let scene = furnace(0.5, room, vec3(0.5, 0.3, 0.6), vec3(-1.0, -0.7, -0.9));
    check(&scene, &settings(48, 20_000, 0.2), 16, "", |_, _| Vec3::ONE);
}

/// No edge here: a ball of radius r about a point of a sphere cuts off exactly π r² of it
/// (Archimedes), so the density estimate is without bias but for the facets.
#[test]
fn a_sphere_looks_the_same_everywhere() {
    let room = |scene: &mut Scene, wall| sphere(scene, Vec3::ZERO, -1.0, 4, false, wall);
    let scene = furnace(0.5, room, vec3(0.4, 0.1, -0.2), vec3(-1.0, 0.2, 0.3));
    check(&scene, &settings(48, 30_000, 0.05), 16, "", |_, _| {
        Vec3::ONE
    });
}

/// A path leaves seven photons here, more than the first buffers hold: none may be lost when they
/// grow. Twelve edges hold 1 - ρ¹² of the series.
#[test]
fn a_bright_sphere_keeps_every_photon() {
    let room = |scene: &mut Scene, wall| sphere(scene, Vec3::ZERO, -1.0, 4, false, wall);
    let scene = furnace(0.9, room, vec3(0.4, 0.1, -0.2), vec3(-1.0, 0.2, 0.3));
    check(&scene, &settings(32, 20_000, 0.1), 16, "", |_, _| {
        Vec3::ONE * (1.0 - 0.9_f32.powi(12))
    });
}
