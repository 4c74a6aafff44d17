//! Light from all around: against closed forms, and which way it is turned.

use crate::check::{Device, check_by, layer, settings};
use crate::closed_forms::{ALBEDO, floor_scene};
use crate::shapes::*;
use glam::{Vec3, vec3};
use lightfall::image::Rgb;
use lightfall::render::Renderer;
use lightfall::scene::{self, Environment, Scene, Source};
use lightfall::settings::Settings;
use lightfall::technique::Row;
use std::f32::consts::{PI, TAU};
use std::path::Path;

pub fn uniform(radiance: Vec3) -> Environment {
    Environment::load(&Source::Uniform(radiance.into()), 1.0, 0.0).unwrap()
}

/// A map of `size`, of what `radiance` says of each texel (column, row).
pub fn map(size: [u32; 2], radiance: impl Fn(u32, u32) -> Vec3) -> Environment {
    let texels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    Environment {
        map: Rgb {
            size,
            pixels: texels
                .flat_map(|(x, y)| radiance(x, y).to_array())
                .collect(),
        },
        ..uniform(Vec3::ZERO)
    }
}

/// Photons and paths: techniques that gather differ in nothing that has to do with where light comes from.
fn check(scene: &Scene, settings: &Settings, radiance: Vec3) {
    let wanted = |row: &Row| matches!(row.name, "rtpm" | "path");
    check_by(wanted, scene, settings, 16, "", |_, _| radiance);
}

/// A floor sees half of it: E = π L, and reflects ρ L.
#[test]
fn an_even_sky_over_a_floor() {
    let sky = vec3(3.0, 5.0, 7.0);
    let mut scene = floor_scene(1.1, 0.6);
    scene.set_environment(uniform(sky));
    check(&scene, &settings(32, 100_000, 0.05), ALBEDO * sky);
}

/// L = ρ (L₀ + 2 L₁ / 3) under a sky of L₀ + L₁ cos θ, which is how a map is interpolated.
#[test]
fn a_sky_brighter_towards_the_zenith() {
    let (even, zenith) = (vec3(3.0, 5.0, 7.0), vec3(9.0, 5.0, 1.0));
    let height = 64;
    let mut scene = floor_scene(1.1, 0.6);
    scene.set_environment(map([4, height], |_, y| {
        let cosine = (PI * (y as f32 + 0.5) / height as f32).cos();
        if cosine > 0.0 {
            even + zenith * cosine
        } else {
            Vec3::ZERO
        }
    }));
    check(
        &scene,
        &settings(32, 60_000, 0.05),
        ALBEDO * (even + zenith * (2.0 / 3.0)),
    );
}

/// The furnace: before an even sky all that loses no light vanishes.
#[test]
fn what_loses_no_light_vanishes_before_an_even_sky() {
    let mut scene = Scene::default();
    let white = material(&mut scene, lambertian(Vec3::ONE));
    let clear = material(&mut scene, glass(0.0));
    let shiny = material(&mut scene, mirror(1.0));
    cuboid(&mut scene, vec3(-0.7, 0.0, 0.0), Vec3::splat(0.4), white);
    sphere(&mut scene, vec3(0.25, 0.0, 0.0), 0.4, 2, false, clear);
    sphere(&mut scene, vec3(0.7, 0.0, -0.7), 0.4, 2, false, shiny);
    camera(&mut scene, vec3(0.0, 1.5, 3.5), Vec3::ZERO, 0.5);
    scene.set_environment(uniform(Vec3::ONE));
    let settings = Settings {
        max_depth: 64,
        ..settings(32, 60_000, 0.04)
    };
    check(&scene, &settings, Vec3::ONE);
}

/// Light from +Z, turned by 90° counter-clockwise seen from above, comes from +X: that is where the eye sees it, and it
/// falls on what faces there.
#[test]
fn a_map_is_turned_about_the_vertical() {
    let device = Device::open();
    for (rotation, bright) in [(0.0, Vec3::Z), (90.0, Vec3::X), (-90.0, -Vec3::X)] {
        for technique in ["path", "rtpm"] {
            for axis in [Vec3::X, -Vec3::X, Vec3::Z, -Vec3::Z] {
                let mut scene = Scene::default();
                let white = material(&mut scene, lambertian(Vec3::ONE));
                quad(
                    &mut scene,
                    -4.0 * axis,
                    axis.cross(Vec3::Y),
                    -Vec3::Y,
                    white,
                );
                // +Z is to the right of the middle, in the map's third quarter from the left.
                let sun = |x, y| Vec3::splat(f32::from(matches!((x, y), (47 | 48, 15 | 16))));
                scene.set_environment(Environment {
                    rotation: f32::to_radians(rotation),
                    ..map([64, 32], sun)
                });
                let settings = Settings {
                    technique: technique.into(),
                    ..settings(16, 20_000, 0.3)
                };
                let seen = |scene: &mut Scene, target| {
                    camera(scene, Vec3::ZERO, target, 0.1);
                    let mut renderer = Renderer::new(&device, scene, &settings).unwrap();
                    (0..4).for_each(|_| renderer.iterate().unwrap());
                    let picture = renderer.picture().unwrap();
                    layer(&picture, "").iter().sum::<f32>() / (16.0 * 16.0 * 3.0)
                };
                let (sky, wall) = (seen(&mut scene, axis), seen(&mut scene, -axis));
                let what = format!("{technique}, {rotation}°, {axis}: {sky} and {wall}");
                // 2 × 2 texels; a wall aside sees half of them and of the slopes about them, edge-on.
                let sun = 4.0 * (TAU / 64.0).powi(2) / PI;
                if axis == bright {
                    assert!(
                        (sky - 1.0).abs() < 0.05 && (wall / sun - 1.0).abs() < 0.03,
                        "{what}"
                    );
                } else {
                    assert!(sky == 0.0 && wall < 0.05 * sun, "{what}");
                }
            }
        }
    }
}

/// Khronos's samples bring no light of their own, and most of them no camera.
#[test]
fn khronos_samples_under_an_even_sky() {
    let device = Device::open();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes/khronos");
    for name in [
        "Box",
        "AttenuationTest",
        "MetalRoughSpheresNoTextures",
        "UnlitTest",
    ] {
        let path = folder.join(name).with_extension("glb");
        if !path.is_file() || !device.info().caps.descriptor_indexing {
            println!("skipped: {} is absent, or no textures", path.display());
            continue;
        }
        let mut scene = scene::load(&path).unwrap();
        scene.set_environment(uniform(Vec3::ONE));
        let settings = Settings {
            technique: "path".into(),
            ..settings(48, 0, 0.1)
        };
        let mut renderer = Renderer::new(&device, &scene, &settings).unwrap();
        renderer.iterate().unwrap();
        let picture = renderer.picture().unwrap();
        let pixels = layer(&picture, "");
        let mean = pixels.iter().sum::<f32>() / pixels.len() as f32;
        let depth = layer(&picture, "depth");
        let there = depth.iter().filter(|d| **d > 0.0).count() as f32 / depth.len() as f32;
        println!("{name}: {mean} nit, {there} of the picture");
        // Something stands before the sky, and shines by it alone.
        assert!((0.1..0.9).contains(&there), "{name}: {there}");
        assert!(mean > 0.3 && mean <= 1.0, "{name}: {mean}");
    }
}
