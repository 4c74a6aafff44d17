//! Every path from eye to light is in one layer, and no technique finds it twice (the partition is written
//! down in `glsl/lib/eye.glsl`): layers of techniques that share no more than the scene must agree.

use crate::check::{Device, Estimate, SIGMAS, block_means, estimate, layer, settings};
use crate::environment::map;
use crate::shapes::*;
use crate::showroom::showroom;
use glam::{Vec3, vec3};
use lightfall::gpu::Gpu;
use lightfall::render::Renderer;
use lightfall::scene::{Material, Scene};
use lightfall::settings::{Direct, Settings};

const LAYERS: [&str; 4] = ["emission", "direct", "caustic", "global"];

/// A room with mirror, glass and rough metal, and smooth plastic, whose light paths from the eye can find
/// all: no light without area.
fn lamp_room(gpu: &Gpu) -> Scene {
    let mut scene = showroom(gpu);
    scene.lights.clear();
    // A coarse ball whose shading normals are not those of its faces.
    let chalk = material(&mut scene, lambertian(vec3(0.3, 0.4, 0.8)));
    sphere(&mut scene, vec3(-0.1, -0.8, 0.5), 0.2, 1, true, chalk);
    scene
}

/// Block means of each layer and of their sum, the beauty image, last.
fn measure(device: &Device, scene: &Scene, settings: &Settings, n: u32) -> Vec<Vec<Estimate>> {
    let mut renderer = Renderer::new(device, scene, settings).unwrap();
    let found = estimate(&mut renderer, n, |picture| {
        let layers = LAYERS.iter().chain(&[""]);
        layers
            .flat_map(|name| block_means(layer(picture, name)))
            .collect()
    });
    found.chunks(10).map(<[_]>::to_vec).collect()
}

/// Means of the image and of its blocks, within their standard errors together and `bias` of the whole; the
/// standard error of the image's mean is below `noise` of it.
fn assert_same(what: &str, a: &[Estimate], b: &[Estimate], bias: f64, noise: f64) {
    let whole = b[0].mean;
    let sigma = a[0].error.hypot(b[0].error);
    println!("{what}: {:.4} ± {:.4}", a[0].mean / whole, sigma / whole);
    assert!(
        whole > 0.0 && sigma < noise * whole,
        "{what}: too noisy to tell: {sigma} of {whole}"
    );
    for (block, (a, b)) in a.iter().zip(b).enumerate() {
        let most = SIGMAS * a.error.hypot(b.error) + bias * if block == 0 { whole } else { b.mean };
        assert!(
            (a.mean - b.mean).abs() <= most,
            "{what}: block {block}: {a:?}, {b:?}"
        );
    }
}

/// Radii whose blur is far below the noise.
fn photons() -> Settings {
    settings(48, 40_000, 0.02)
}

/// Glass, a mirror, rough metal and plastic on a floor, under a sky with a sun wide enough for paths from the eye.
fn open_air() -> Scene {
    let mut scene = Scene::default();
    let chalk = material(&mut scene, lambertian(vec3(0.7, 0.6, 0.5)));
    let clear = material(&mut scene, glass(0.5));
    let shiny = material(&mut scene, mirror(0.9));
    let metal = |roughness, metallic| Material {
        roughness,
        metallic,
        base_color: vec3(0.9, 0.7, 0.3).extend(1.0),
        ..Material::default()
    };
    let brass = material(&mut scene, metal(0.4, 1.0));
    let plastic = material(&mut scene, metal(0.3, 0.0));
    floor(&mut scene, 0.0, 1.2, chalk);
    sphere(&mut scene, vec3(-0.4, 0.35, 0.2), 0.3, 3, true, clear);
    sphere(&mut scene, vec3(0.5, 0.3, -0.2), 0.3, 3, true, shiny);
    sphere(&mut scene, vec3(0.2, 0.2, 0.5), 0.2, 3, true, plastic);
    cuboid(
        &mut scene,
        vec3(-0.5, 0.3, -0.6),
        vec3(0.2, 0.3, 0.2),
        brass,
    );
    camera(&mut scene, vec3(0.0, 1.0, 2.2), vec3(0.0, 0.2, 0.0), 0.9);
    scene.set_environment(map([16, 8], |x, y| match (x, y) {
        (11, 2) => vec3(90.0, 70.0, 50.0),
        _ => vec3(0.2, 0.3, 0.5) * (1.0 - y as f32 / 8.0) * (1.0 + (x % 4) as f32),
    }));
    scene
}

#[test]
fn direct_light_by_rays_or_by_photons() {
    let device = Device::open();
    rays_and_photons_agree(&device, &showroom(&device));
}

#[test]
fn light_straight_from_the_sky_by_rays_or_by_photons() {
    rays_and_photons_agree(&Device::open(), &open_air());
}

fn rays_and_photons_agree(device: &Device, scene: &Scene) {
    for trace in device.two_traversals() {
        let by = |direct, seed| {
            let settings = Settings {
                trace,
                direct,
                seed,
                ..photons()
            };
            measure(device, scene, &settings, 32)
        };
        let [photons, rays] = [by(Direct::Photons, 1), by(Direct::Rays, 2)];
        assert_same(
            &format!("{trace:?}, all"),
            &rays[4],
            &photons[4],
            0.003,
            0.015,
        );
        // Direct light is what moved.
        assert!(photons[1].iter().all(|block| block.mean == 0.0));
        assert_same(
            &format!("{trace:?}, caustic"),
            &rays[2],
            &photons[2],
            0.003,
            0.05,
        );
        let moved: Vec<Estimate> = rays[1]
            .iter()
            .zip(&rays[3])
            .map(|(direct, rest)| Estimate {
                mean: direct.mean + rest.mean,
                error: direct.error.hypot(rest.error),
            })
            .collect();
        assert_same(
            &format!("{trace:?}, direct and global"),
            &moved,
            &photons[3],
            0.003,
            0.015,
        );
    }
}

#[test]
fn photons_and_paths_agree_in_every_layer() {
    let device = Device::open();
    // Few paths meet the lamp, fewer behind glass.
    let noise = [0.1, 0.01, 0.05, 0.02];
    photons_and_paths_agree(&device, &lamp_room(&device), [48, 256], noise);
}

#[test]
fn photons_and_paths_agree_in_every_layer_of_the_sky() {
    let noise = [0.04, 0.01, 0.06, 0.05];
    photons_and_paths_agree(&Device::open(), &open_air(), [24, 128], noise);
}

fn photons_and_paths_agree(device: &Device, scene: &Scene, iterations: [u32; 2], noise: [f64; 4]) {
    for trace in device.two_traversals() {
        let rays = Settings {
            trace,
            direct: Direct::Rays,
            // One without the rare photon that grazes a shading normal and outshines all others.
            seed: 4,
            ..photons()
        };
        let paths = Settings {
            technique: "path".into(),
            seed: 1,
            ..rays.clone()
        };
        let photons = measure(device, scene, &rays, iterations[0]);
        let paths = measure(device, scene, &paths, iterations[1]);
        for (i, noise) in noise.into_iter().enumerate() {
            let name = LAYERS[i];
            assert_same(
                &format!("{trace:?}, {name}"),
                &photons[i],
                &paths[i],
                0.005,
                noise,
            );
        }
    }
}

/// Two edges are direct light; with each further one light can only be gained, and the techniques agree
/// on how much.
#[test]
fn the_longest_path_is_the_same_for_all() {
    let device = Device::open();
    let scene = lamp_room(&device);
    let mut before = 0.0;
    for max_depth in [2, 3, 4] {
        let rays = Settings {
            max_depth,
            direct: Direct::Rays,
            ..photons()
        };
        let by_photons = Settings {
            direct: Direct::Photons,
            seed: 1,
            ..rays.clone()
        };
        let paths = Settings {
            technique: "path".into(),
            seed: 2,
            ..rays.clone()
        };
        let paths = measure(&device, &scene, &paths, 128);
        for (what, settings) in [("rays", rays), ("photons", by_photons)] {
            let found = measure(&device, &scene, &settings, 32);
            assert_same(
                &format!("{max_depth} edges, {what}"),
                &found[4],
                &paths[4],
                0.005,
                0.03,
            );
            let [caustic, global] = [found[2][0].mean, found[3][0].mean];
            let indirect = max_depth > 2;
            assert_eq!(caustic > 0.0, indirect);
            assert_eq!(global > 0.0, indirect || what == "photons");
        }
        assert_eq!(paths[2][0].mean + paths[3][0].mean > 0.0, max_depth > 2);
        assert!(paths[4][0].mean > before);
        before = paths[4][0].mean;
    }
}

/// One edge is what shines into the eye, and nothing else, whichever way.
#[test]
fn one_edge_is_emission() {
    let device = Device::open();
    let mut scene = lamp_room(&device);
    camera(&mut scene, Vec3::ZERO, Vec3::Y, 1.4);
    for technique in ["rtpm", "path"] {
        for direct in [Direct::Photons, Direct::Rays] {
            let settings = Settings {
                technique: technique.into(),
                direct,
                max_depth: 1,
                ..settings(8, 1_000, 0.1)
            };
            let found = measure(&device, &scene, &settings, 2);
            assert!(found[0][0].mean > 0.0);
            assert!(found[1..4].iter().flatten().all(|block| block.mean == 0.0));
        }
    }
}
