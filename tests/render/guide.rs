//! Guided light paths: the same expected image on every kind of light, the same photons in all
//! traversals, and the same picture however far the rest of the scene reaches.

use crate::check::{Device, SIGMAS, assert_traversals_agree, layer, settings};
use crate::environment::{map, uniform};
use crate::estimators::{assert_same_within, measure};
use crate::shapes::*;
use crate::showroom::showroom;
use glam::{Vec3, vec3};
use lightfall::gpu::Gpu;
use lightfall::image::Picture;
use lightfall::render::{Renderer, Unknown};
use lightfall::scene::{Light, Scene};
use lightfall::settings::{Direct, Settings, Switch, Trace};

/// A floor, a wall and a glass ball in the corner of a wide world.
fn corner(half_extent: f32, towers: f32) -> Scene {
    let mut scene = Scene {
        hash: [9; 32],
        ..Scene::default()
    };
    let chalk = material(&mut scene, lambertian(vec3(0.5, 0.6, 0.7)));
    let clear = material(&mut scene, glass(1.5));
    quad(
        &mut scene,
        Vec3::ZERO,
        Vec3::Z * half_extent,
        Vec3::X * half_extent,
        chalk,
    );
    quad(
        &mut scene,
        vec3(0.0, 0.25, -0.5),
        Vec3::X * 0.5,
        Vec3::Y * 0.25,
        chalk,
    );
    sphere(&mut scene, vec3(0.0, 0.14, 0.0), 0.1, 3, true, clear);
    for side in [-1.0, 1.0] {
        if towers > 0.0 {
            let at = vec3(side * 0.9 * half_extent, 0.5 * towers, 0.0);
            let size = vec3(0.05 * half_extent, towers, 0.05 * half_extent);
            cuboid(&mut scene, at, 0.5 * size, chalk);
        }
    }
    let direction = vec3(0.0, -0.5, -0.8).normalize();
    camera(&mut scene, vec3(0.0, 0.7, 1.0), direction, 0.7);
    scene
}

fn sun(scene: &mut Scene, illuminance: f32) {
    scene.lights.push(Light::Directional {
        direction_w: vec3(0.3, -1.0, -0.2).normalize(),
        illuminance: Vec3::splat(illuminance),
    });
}

/// An emissive square of edge `size` at a distance, in the sun's direction, which brings as much
/// light.
fn square_sun(scene: &mut Scene, distance: f32, size: f32, illuminance: f32) {
    let shine = illuminance * (distance / size).powi(2);
    let shine = material(scene, lamp(Vec3::splat(shine)));
    let towards = -vec3(0.3, -1.0, -0.2).normalize();
    let (x, z) = towards.any_orthonormal_pair();
    // Its front faces the scene.
    let (x, z) = if x.cross(z).dot(towards) < 0.0 {
        (x, z)
    } else {
        (z, x)
    };
    let half = 0.5 * size;
    quad(scene, towards * distance, x * half, z * half, shine);
}

fn guided(edge: u32, photons: u32, radius: f32) -> Settings {
    Settings {
        guide: Switch::On,
        ..settings(edge, photons, radius)
    }
}

/// Skies, suns, lamps with and without area: guided means are unguided ones, block by block.
/// Unguided noise grows with the extent of the world, so it is small here.
#[test]
fn guided_means_are_unguided_means() {
    let device = Device::open();
    let with = |light: &dyn Fn(&mut Scene)| {
        let mut scene = corner(1.5, 0.0);
        light(&mut scene);
        scene
    };
    let sky =
        |x: u32, y: u32| vec3(x as f32, 2.0, 1.0 + y as f32) + 40.0 * f32::from(x == 2) * Vec3::ONE;
    for (what, scene) in [
        ("everything", showroom(&device)),
        ("sun", with(&|s| sun(s, 100.0))),
        ("sky", with(&|s| s.set_environment(map([8, 4], sky)))),
        ("even sky", with(&|s| s.set_environment(uniform(Vec3::ONE)))),
        ("near lamp", with(&|s| square_sun(s, 0.6, 0.1, 50.0))),
        ("far lamp", with(&|s| square_sun(s, 3.0, 0.3, 50.0))),
        (
            "point and spot",
            with(&|s| {
                s.lights.push(Light::Point {
                    position_w: vec3(0.4, 0.6, 0.2),
                    intensity: vec3(1.0, 2.0, 1.0),
                });
                s.lights.push(Light::Spot {
                    position_w: vec3(-0.4, 0.8, 0.2),
                    direction_w: vec3(0.4, -0.7, -0.2).normalize(),
                    intensity: vec3(9.0, 4.0, 2.0),
                    inner_cone: 0.1,
                    outer_cone: 0.5,
                });
            }),
        ),
    ] {
        for direct in [Direct::Rays, Direct::Photons] {
            if direct == Direct::Photons && what != "everything" {
                continue;
            }
            let settings = |guide, seed| Settings {
                guide,
                seed,
                direct,
                trace: Trace::Software,
                ..settings(32, 100_000, 0.1)
            };
            let truth = measure(&device, &scene, &settings(Switch::Off, 1));
            let found = measure(&device, &scene, &settings(Switch::On, 2));
            assert_same_within(0.05, &format!("{what}, {direct:?}"), &found, &truth);
        }
    }
}

#[test]
fn guided_photons_are_the_same_in_all_traversals() {
    let device = Device::open();
    let settings = Settings {
        direct: Direct::Rays,
        ..guided(32, 20_000, 0.05)
    };
    let maps = ["caustic", "global"];
    assert_traversals_agree(&device, &showroom(&device), &settings, "showroom", &maps);
}

/// Of hundreds of thousands of rays over a wide ground, traversals see one or two otherwise, and
/// learn a little otherwise; by the same guide they make the same photons.
#[test]
fn a_saved_guide_makes_the_same_photons_in_all_traversals() {
    let device = Device::open();
    let mut scene = corner(100.0, 30.0);
    sun(&mut scene, 100.0);
    scene.set_environment(map([8, 4], |x, y| vec3(x as f32, 1.0, y as f32)));
    let renderer = |trace| {
        let settings = Settings {
            trace,
            cull: Switch::Off,
            direct: Direct::Rays,
            ..guided(32, 20_000, 0.05)
        };
        Renderer::new(&device, &scene, &settings).unwrap()
    };
    let mut software = renderer(Trace::Software);
    let learned = software.picture().unwrap();
    software.iterate().unwrap();
    let truth = software.picture().unwrap();
    for trace in device.traversals().into_iter().skip(1) {
        let mut other = renderer(trace);
        other.resume(&learned).unwrap();
        other.iterate().unwrap();
        let picture = other.picture().unwrap();
        for name in ["caustic", "global"] {
            let [a, b] = [&truth, &picture].map(|p| layer(p, name));
            assert!(a.iter().any(|x| *x != 0.0), "{name}");
            let differs = |(a, b): &(&f32, &f32)| (*a - *b).abs() > 1e-4 * a.abs();
            let count = a.iter().zip(b).filter(differs).count();
            println!("{trace:?}, {name}: {count} of {} values differ", a.len());
            assert!(count < a.len() / 50, "{trace:?}, {name}: {count}");
        }
    }
}

/// Of the sum of a layer, its standard error over iterations, and the photons that came near view
/// samples.
fn caustic(gpu: &Gpu, scene: &Scene, settings: &Settings) -> (f64, f64, u64, Picture) {
    let mut renderer = Renderer::new(gpu, scene, settings).unwrap();
    let mut before = 0.0;
    let mut sums = Vec::new();
    for n in 1..=16 {
        renderer.iterate().unwrap();
        let picture = renderer.picture().unwrap();
        let pixels = layer(&picture, "caustic").iter();
        let sum = f64::from(n) * pixels.map(|&x| f64::from(x)).sum::<f64>();
        sums.push(sum - before);
        before = sum;
    }
    let mean = sums.iter().sum::<f64>() / 16.0;
    let variance = sums.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / (16.0 * 15.0);
    let stored = renderer
        .ledger()
        .iter()
        .find(|row| row.0 == "stored, caustic")
        .unwrap()
        .1;
    (mean, variance.sqrt(), stored, renderer.picture().unwrap())
}

/// The ball's caustic does not know how far the ground goes, what stands there, or how far away the
/// lamp is.
#[test]
fn far_surroundings_cost_nothing() {
    let device = Device::open();
    let settings = Settings {
        guide: Switch::Auto,
        direct: Direct::Rays,
        trace: Trace::Software,
        ledger: true,
        cull: Switch::On,
        ..settings(48, 100_000, 0.05)
    };
    let sunny = |mut scene: Scene| {
        sun(&mut scene, 100.0);
        scene
    };
    let lit = |distance: f32| {
        let mut scene = corner(2.0, 0.0);
        square_sun(&mut scene, distance, 0.01 * distance, 100.0);
        scene
    };
    let skies = |mut scene: Scene| {
        scene.set_environment(uniform(Vec3::splat(10.0)));
        scene
    };
    let families: [(&str, Scene, Vec<Scene>); 3] = [
        (
            "sun",
            sunny(corner(2.0, 0.0)),
            vec![
                sunny(corner(1e3, 0.0)),
                sunny(corner(1e4, 0.0)),
                sunny(corner(1e3, 500.0)),
            ],
        ),
        ("far lamp", lit(20.0), vec![lit(2e3), lit(2e5)]),
        (
            "sky",
            skies(corner(20.0, 0.0)),
            vec![skies(corner(1e3, 0.0)), skies(corner(1e4, 0.0))],
        ),
    ];
    for (what, near, wide) in families {
        let truth = caustic(&device, &near, &settings);
        for (i, scene) in wide.iter().enumerate() {
            let found = caustic(&device, scene, &settings);
            let photons = found.2 as f64 / truth.2 as f64;
            println!(
                "{what} {i}: caustic {:.4} ± {:.4} of {:.4} ± {:.4}, photons {photons:.3}",
                found.0, found.1, truth.0, truth.1
            );
            let sigma = found.1.hypot(truth.1);
            assert!((found.0 - truth.0).abs() <= SIGMAS * sigma, "{what} {i}");
            assert!(sigma < 0.1 * truth.0, "{what} {i}: too noisy to tell");
            assert!((0.8..1.25).contains(&photons), "{what} {i}");
        }
    }
}

/// Without a guide nothing is found of the caustic, and the error says so.
#[test]
fn what_is_not_found_is_not_known() {
    let device = Device::open();
    let mut scene = corner(1e4, 0.0);
    sun(&mut scene, 100.0);
    for (guide, unknown) in [(Switch::Off, Some(Unknown::Caustics)), (Switch::Auto, None)] {
        let settings = Settings {
            guide,
            direct: Direct::Rays,
            trace: Trace::Software,
            ..settings(32, 20_000, 0.02)
        };
        let mut renderer = Renderer::new(&device, &scene, &settings).unwrap();
        (0..4).for_each(|_| renderer.iterate().unwrap());
        let found = renderer.accuracy().unwrap();
        assert_eq!(found.unknown, unknown, "{guide:?}");
        assert!(!found.reaches(1e-9) && (found.reaches(1e9) == unknown.is_none()));
    }
}

/// Nothing is missing where there is no glass and nothing else to light a surface by.
#[test]
fn a_lonely_floor_is_known() {
    let device = Device::open();
    let mut scene = Scene::default();
    let chalk = material(&mut scene, lambertian(Vec3::splat(0.5)));
    quad(&mut scene, Vec3::ZERO, Vec3::Z, Vec3::X, chalk);
    camera(&mut scene, Vec3::Y, Vec3::NEG_Y, 0.5);
    sun(&mut scene, 100.0);
    for guide in [Switch::Off, Switch::Auto] {
        let settings = Settings {
            guide,
            direct: Direct::Rays,
            ..settings(16, 1_000, 0.02)
        };
        let mut renderer = Renderer::new(&device, &scene, &settings).unwrap();
        (0..4).for_each(|_| renderer.iterate().unwrap());
        assert_eq!(renderer.accuracy().unwrap().unknown, None, "{guide:?}");
    }
}

/// A picture brings its guide along: bit for bit what would have been without the interruption.
#[test]
fn a_guided_render_goes_on_where_it_stopped() {
    let device = Device::open();
    let scene = showroom(&device);
    let settings = Settings {
        direct: Direct::Rays,
        trace: Trace::Software,
        ..guided(24, 5_000, 0.1)
    };
    let mut whole = Renderer::new(&device, &scene, &settings).unwrap();
    (0..2).for_each(|_| whole.iterate().unwrap());
    let saved = whole.picture().unwrap();
    assert!(saved.metadata.guide.len() > 100, "{}", saved.metadata.guide);
    (0..2).for_each(|_| whole.iterate().unwrap());
    let mut resumed = Renderer::new(&device, &scene, &settings).unwrap();
    resumed.resume(&saved).unwrap();
    (0..2).for_each(|_| resumed.iterate().unwrap());
    let [a, b] = [whole, resumed].map(|r| r.picture().unwrap());
    for (a, b) in a.layers.iter().zip(&b.layers) {
        assert!(a.pixels == b.pixels, "{}", a.name);
    }
    let mut damaged = saved.clone();
    damaged.metadata.guide.truncate(101);
    let mut other = Renderer::new(&device, &scene, &settings).unwrap();
    let fault = other.resume(&damaged).unwrap_err().to_string();
    assert!(fault.contains("lightfall.guide"), "{fault}");
}
