//! A scene pays for what it uses, and for nothing else: what is bound, stored and run, and that leaving the rest out
//! changes no picture.

use crate::check::{Device, layer, settings, techniques};
use crate::shapes::*;
use crate::showroom::showroom;
use glam::{Vec3, vec3};
use lightfall::gpu::Gpu;
use lightfall::render::Renderer;
use lightfall::scene::{Light, Scene};
use lightfall::settings::{Direct, Evaluate, Settings, Trace};
use lightfall::technique::Row;
use lightfall::world::{everything, features};
use std::collections::BTreeMap;

/// Chalk under a lamp.
fn chalk() -> Scene {
    let mut scene = Scene::default();
    let chalk = material(&mut scene, lambertian(vec3(0.7, 0.6, 0.5)));
    let shine = material(&mut scene, lamp(Vec3::splat(3.0)));
    cuboid(&mut scene, Vec3::ZERO, Vec3::splat(-1.0), chalk);
    let (x, z) = (Vec3::X * 0.3, Vec3::Z * 0.3);
    quad(&mut scene, Vec3::Y * 0.98, x, z, shine);
    camera(&mut scene, vec3(0.0, 0.0, 0.95), Vec3::NEG_Z, 1.4);
    scene
}

/// Bytes on the device by name.
fn stored(gpu: &Gpu) -> BTreeMap<String, u64> {
    let mut bytes = BTreeMap::new();
    for (name, size) in gpu.allocations() {
        *bytes.entry(name).or_default() += size;
    }
    bytes
}

/// These: pipelines take their time to compile.
fn some_techniques(device: &Device, names: &[&str]) -> Vec<(&'static Row, Trace)> {
    let mut all = techniques(device);
    all.retain(|(row, _)| names.contains(&row.name));
    all
}

fn rendered(gpu: &Gpu, scene: &Scene, settings: &Settings, row: &Row, bits: u32) -> Renderer {
    let mut renderer = Renderer::with_features(gpu, scene, settings, row, bits).unwrap();
    for _ in 0..2 {
        renderer.iterate().unwrap();
    }
    renderer
}

#[test]
fn chalk_binds_builds_and_stores_nothing_for_textures_glass_and_metal() {
    let device = Device::open();
    let scene = chalk();
    for (row, trace) in some_techniques(&device, &["rtpm", "hash-grid"]) {
        let settings = Settings {
            trace,
            ..settings(16, 500, 0.1)
        };
        let [plain, all] = [features(&scene), everything()].map(|bits| {
            let renderer = rendered(&device, &scene, &settings, row, bits);
            let bound = renderer.engine().world.textures.is_some();
            let passes: Vec<&str> = renderer.timings().iter().map(|t| t.0).collect();
            (bound, passes, stored(&device))
        });
        assert!(!plain.0 && all.0, "{}", row.name);
        assert!(!plain.1.contains(&"caustic photons"), "{}", row.name);
        for name in [
            "texture slots",
            "TEXCOORD_0",
            "TEXCOORD_1",
            "tangents",
            "colours",
            "caustic photons",
        ] {
            assert_eq!(plain.2.get(name), None, "{}: {name}", row.name);
            // Ray queries alone put photons into acceleration structures.
            let boxes = all.2.contains_key("global photons");
            let expected = name != "caustic photons" || boxes;
            assert_eq!(all.2.contains_key(name), expected, "{}: {name}", row.name);
        }
        // One map's tree instead of two, give or take their alignment.
        if let Some(tree) = plain.2.get("photon tree") {
            assert!(2 * all.2["photon tree"] > 3 * tree, "{}", row.name);
        }
    }
}

#[test]
fn passes_that_can_contribute_nothing_do_not_run() {
    let device = Device::open();
    let mut metal = chalk();
    metal.materials[0] = mirror(0.9);
    let shallow = |edges| Settings {
        max_depth: edges,
        direct: Direct::Rays,
        ..settings(16, 500, 0.1)
    };
    for (row, trace) in some_techniques(&device, &["hash-grid", "hash-ppm"]) {
        for (scene, settings, expected) in [
            (&metal, settings(16, 500, 0.1), false),
            (&chalk(), shallow(2), false),
            (&chalk(), shallow(3), true),
        ] {
            let settings = Settings { trace, ..settings };
            let renderer = rendered(&device, scene, &settings, row, features(scene));
            let passes: Vec<&str> = renderer.timings().iter().map(|t| t.0).collect();
            for pass in ["emit", "sort", "build"] {
                assert_eq!(passes.contains(&pass), expected, "{}: {passes:?}", row.name);
            }
        }
    }
}

/// Something of everything, and a scene that leaves out most.
fn scenes(gpu: &Gpu) -> Vec<Scene> {
    let mut spot = chalk();
    spot.materials[1] = mirror(0.8);
    spot.lights.push(Light::Point {
        position_w: vec3(0.2, 0.3, 0.1),
        intensity: Vec3::ONE,
    });
    vec![showroom(gpu), spot]
}

#[test]
fn everything_on_gives_the_same_picture() {
    let device = Device::open();
    for (number, scene) in scenes(&device).iter().enumerate() {
        for (row, trace) in some_techniques(&device, &["rtpm", "path"]) {
            // Compiling everything takes long, and the driver's structures bring one constant of their own.
            if trace != Trace::Software && (row.name == "path" || number > 0) {
                continue;
            }
            let settings = Settings {
                trace,
                direct: Direct::Rays,
                // The choice between two ways to evaluate hangs on their times.
                evaluate: Evaluate::Full,
                ..settings(24, 2_000, 0.1)
            };
            let [plain, all] = [features(scene), everything()].map(|bits| {
                let renderer = rendered(&device, scene, &settings, row, bits);
                let picture = renderer.picture().unwrap();
                layer(&picture, "").to_vec()
            });
            let mean = plain.iter().sum::<f32>() / plain.len() as f32;
            assert!(mean > 0.0);
            let differ = |(a, b): &(&f32, &f32)| (*a - *b).abs() > 1e-4 * a.max(mean);
            let differ = plain.iter().zip(&all).filter(differ).count();
            assert_eq!(differ, 0, "scene {number}, {}, {trace:?}", row.name);
        }
    }
}
