//! Culling, rejection and stochastic evaluation are cheaper ways to the same picture, and the ledger
//! accounts for every path and photon.

use crate::check::{Device, Estimate, SIGMAS, block_means, estimate, layer, settings};
use crate::shapes::*;
use crate::showroom::showroom;
use glam::Vec3;
use lightfall::render::Renderer;
use lightfall::scene::{Light, Scene};
use lightfall::settings::{Evaluate, Settings, Switch, Trace};

/// Means of both maps and of their blocks.
pub fn measure(device: &Device, scene: &Scene, settings: &Settings) -> Vec<Estimate> {
    let mut renderer = Renderer::new(device, scene, settings).unwrap();
    estimate(&mut renderer, 24, |picture| {
        let of = |name| block_means(layer(picture, name));
        [of("global"), of("caustic")].concat()
    })
}

/// Block means of both maps in two renders with different seeds, against their standard errors together.
pub fn assert_same_expectation(what: &str, a: &[Estimate], b: &[Estimate]) {
    assert_same_within(0.03, what, a, b);
}

/// Likewise, with a relative standard error of the means of at most so much.
pub fn assert_same_within(most_noise: f64, what: &str, a: &[Estimate], b: &[Estimate]) {
    for (block, (a, b)) in a.iter().zip(b).enumerate() {
        let sigma = a.error.hypot(b.error);
        assert!(
            (a.mean - b.mean).abs() <= SIGMAS * sigma,
            "{what}: block {block}: {a:?}, plain {b:?}"
        );
    }
    for map in [0, a.len() / 2] {
        let noise = a[map].error.hypot(b[map].error) / b[map].mean;
        println!("{what}: {:.5} ± {noise:.5}", a[map].mean / b[map].mean);
        assert!(noise < most_noise, "{what}: too noisy to tell: {noise}");
    }
}

#[test]
fn cheaper_estimators_leave_the_expected_image() {
    let device = Device::open();
    let scene = showroom(&device);
    for trace in device.two_traversals() {
        let plain = Settings {
            trace,
            cull: Switch::Off,
            evaluate: Evaluate::Full,
            ..settings(32, 70_000, 0.1)
        };
        let truth = measure(&device, &scene, &plain);
        let variants = [
            (
                "stochastic",
                Settings {
                    evaluate: Evaluate::Stochastic,
                    seed: 1,
                    ..plain.clone()
                },
            ),
            (
                "one of all",
                Settings {
                    evaluate: Evaluate::Stochastic,
                    reservoir: 1,
                    seed: 2,
                    ..plain.clone()
                },
            ),
            (
                "reject",
                Settings {
                    reject: 0.7,
                    seed: 3,
                    ..plain.clone()
                },
            ),
            (
                "all",
                Settings {
                    evaluate: Evaluate::Stochastic,
                    reject: 0.7,
                    cull: Switch::On,
                    seed: 4,
                    ..plain.clone()
                },
            ),
        ];
        // The traversals gather the same, which other tests hold; all at once is enough for the slow ones.
        let first = if trace == Trace::Software { 0 } else { 3 };
        for (what, settings) in variants.into_iter().skip(first) {
            assert_same_expectation(what, &measure(&device, &scene, &settings), &truth);
        }
    }
}

/// Culling drops only photons that nobody gathers, so even the bits stay. Small radii: with large
/// ones every cell is marked.
#[test]
fn culling_loses_nothing() {
    let device = Device::open();
    let scene = showroom(&device);
    let images = [Switch::Off, Switch::On].map(|cull| {
        let settings = Settings {
            cull,
            ledger: true,
            trace: Trace::Software,
            ..settings(32, 20_000, 0.01)
        };
        let mut renderer = Renderer::new(&device, &scene, &settings).unwrap();
        (0..3).for_each(|_| renderer.iterate().unwrap());
        assert_eq!(count(&renderer, "culled") > 0, cull == Switch::On);
        renderer.picture().unwrap().layers.swap_remove(0).pixels
    });
    let most = images[0]
        .iter()
        .zip(&images[1])
        .map(|(a, b)| (a - b).abs() / a.max(1e-3))
        .fold(0.0, f32::max);
    // The tree's leaves hold other photons, so sums run in another order.
    assert!(most < 1e-5, "{most}");
}

fn count(renderer: &Renderer, name: &str) -> u64 {
    renderer
        .ledger()
        .iter()
        .find(|(n, _)| *n == name)
        .expect(name)
        .1
}

#[test]
fn the_ledger_balances() {
    let device = Device::open();
    let mut scene = showroom(&device);
    // A way out of the room: without its ceiling.
    scene.triangles.retain(|t| {
        t.vertices
            .iter()
            .any(|v| scene.vertices[*v as usize].position_w.y < 1.0)
    });
    let plain = Settings {
        ledger: true,
        max_depth: 6,
        cull: Switch::Off,
        ..settings(16, 50_000, 0.02)
    };
    let met = |settings: &Settings| {
        let mut renderer = Renderer::new(&device, &scene, settings).unwrap();
        (0..3).for_each(|_| renderer.iterate().unwrap());
        let sum = |names: &[&str]| names.iter().map(|name| count(&renderer, name)).sum::<u64>();
        println!("{:?}", renderer.ledger());
        assert_eq!(count(&renderer, "emitted"), 150_000);
        let ends = ["absorbed", "escaped", "terminated by roulette", "too long"];
        assert_eq!(sum(&ends), 150_000);
        assert!(ends.iter().all(|end| count(&renderer, end) > 0));
        [
            sum(&["stored", "culled", "rejected"]),
            count(&renderer, "culled"),
            count(&renderer, "rejected"),
        ]
    };
    let [all, 0, 0] = met(&plain) else {
        panic!("neither culling nor rejection was asked for")
    };
    let [met_by_culled, culled, 0] = met(&Settings {
        cull: Switch::On,
        ..plain.clone()
    }) else {
        panic!("rejected")
    };
    assert_eq!(met_by_culled, all);
    assert!(culled > 0);
    let [met_by_rejected, 0, rejected] = met(&Settings {
        reject: 0.7,
        ..plain.clone()
    }) else {
        panic!("culled")
    };
    assert_eq!(met_by_rejected, all);
    assert!(rejected > 0);
}

#[test]
fn only_specular_surfaces_make_caustics() {
    let device = Device::open();
    let mut scene = Scene::default();
    let wall = material(&mut scene, lambertian(Vec3::splat(0.5)));
    cuboid(&mut scene, Vec3::ZERO, Vec3::splat(-1.0), wall);
    scene.lights.push(Light::Point {
        position_w: Vec3::ZERO,
        intensity: Vec3::ONE,
    });
    camera(&mut scene, Vec3::Z * 0.9, Vec3::ZERO, 0.7);
    let caustic = |scene: &Scene| {
        let mut renderer = Renderer::new(&device, scene, &settings(8, 10_000, 0.1)).unwrap();
        renderer.iterate().unwrap();
        assert!(count(&renderer, "stored") > 0);
        count(&renderer, "stored, caustic")
    };
    assert_eq!(caustic(&scene), 0);
    scene.materials[0].specular = 1.0;
    assert!(caustic(&scene) > 0);
}
