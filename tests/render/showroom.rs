//! A scene with something of everything, and the traversals held to each other on it.

use crate::check::{Device, assert_traversals_agree, settings};
use crate::shapes::*;
use glam::{Vec3, vec3};
use lightfall::gpu::Gpu;
use lightfall::scene::{Alpha, Image, Light, Material, Scene, Texture, TextureRef, Wrap};
use lightfall::settings::{Direct, Settings};
use std::path::Path;

/// A room with a lamp, a glass ball, a mirror ball, rough metal, plastic, a blended sheet, an unlit one, a
/// checkered board with holes, and a spot light. Without the board where the device has no textures.
pub fn showroom(gpu: &Gpu) -> Scene {
    let mut scene = Scene {
        hash: [7; 32],
        ..Scene::default()
    };
    let wall = material(&mut scene, lambertian(vec3(0.7, 0.6, 0.5)));
    let shine = material(&mut scene, lamp(vec3(12.0, 10.0, 8.0)));
    let clear = material(&mut scene, glass(0.5));
    let shiny = material(&mut scene, mirror(0.9));
    let plastic = Material {
        metallic: 0.0,
        roughness: 0.3,
        base_color: vec3(0.2, 0.5, 0.3).extend(1.0),
        ..Material::default()
    };
    let plastic = material(&mut scene, plastic);
    let brass = material(&mut scene, brass());
    cuboid(&mut scene, Vec3::ZERO, Vec3::splat(-1.0), wall);
    quad(
        &mut scene,
        Vec3::Y * 0.98,
        Vec3::X * 0.3,
        Vec3::Z * 0.3,
        shine,
    );
    sphere(&mut scene, vec3(-0.4, -0.6, 0.2), 0.35, 3, true, clear);
    sphere(&mut scene, vec3(0.5, -0.65, -0.2), 0.35, 3, true, shiny);
    sphere(&mut scene, vec3(0.2, -0.8, 0.5), 0.2, 2, false, plastic);
    cuboid(
        &mut scene,
        vec3(-0.5, -0.7, -0.6),
        vec3(0.2, 0.3, 0.2),
        brass,
    );
    let veil = Material {
        base_color: vec3(0.3, 0.3, 0.8).extend(0.4),
        alpha: Alpha::Blend,
        double_sided: true,
        ..lambertian(Vec3::ONE)
    };
    let veil = material(&mut scene, veil);
    let sign = Material {
        unlit: true,
        ..lambertian(vec3(0.1, 0.9, 0.2))
    };
    let sign = material(&mut scene, sign);
    quad(
        &mut scene,
        vec3(0.1, 0.0, 0.3),
        vec3(0.7, 0.0, 0.2),
        Vec3::Y * 0.9,
        veil,
    );
    quad(
        &mut scene,
        vec3(-0.7, 0.3, -0.2),
        Vec3::X * 0.2,
        Vec3::Y * 0.2,
        sign,
    );
    if gpu.info().caps.descriptor_indexing {
        let board = board(&mut scene);
        quad(
            &mut scene,
            vec3(0.0, 0.1, -0.5),
            vec3(0.5, 0.0, 0.1),
            Vec3::Y * 0.3,
            board,
        );
    } else {
        println!("not tested: {} has no textures", gpu.info().name);
    }
    scene.lights.push(Light::Spot {
        position_w: vec3(0.8, 0.8, 0.8),
        direction_w: vec3(-1.0, -1.0, -1.0).normalize(),
        intensity: vec3(1.0, 2.0, 3.0),
        inner_cone: 0.1,
        outer_cone: 0.5,
    });
    camera(&mut scene, vec3(0.0, 0.0, 0.95), vec3(0.0, -0.3, -1.0), 1.4);
    scene
}

/// 4 × 4 texels, every other one a hole, seen from both sides.
fn board(scene: &mut Scene) -> u32 {
    let texels = (0..16_u8).flat_map(|i| [200, 40 + 12 * i, 90, 255 * ((i + i / 4) % 2)]);
    scene.images.push(Image {
        width: 4,
        height: 4,
        rgba: texels.collect(),
    });
    scene.textures.push(Texture {
        image: 0,
        wrap: [Wrap::Repeat; 2],
        nearest: true,
        srgb: true,
    });
    let reference = TextureRef {
        texture: 0,
        uv_set: 0,
        transform: [Vec3::X, Vec3::Y],
    };
    material(
        scene,
        Material {
            base_color_texture: Some(reference),
            alpha: Alpha::Mask { cutoff: 0.5 },
            double_sided: true,
            ..lambertian(Vec3::ONE)
        },
    )
}

/// One iteration of the same seed, on the showroom in every way and on two files.
#[test]
fn traversals_agree() {
    let device = Device::open();
    if device.traversals().len() < 2 {
        return;
    }
    let scene = showroom(&device);
    let plain = settings(64, 20_000, 0.05);
    let rays = Settings {
        direct: Direct::Rays,
        ..plain.clone()
    };
    let path = Settings {
        technique: "path".into(),
        ..plain.clone()
    };
    let photon_layers: &[&str] = &["emission", "caustic", "global"];
    let all_layers: &[&str] = &["emission", "direct", "caustic", "global"];
    for (what, settings, full) in [
        ("photons", &plain, photon_layers),
        ("rays", &rays, all_layers),
        ("path", &path, all_layers),
    ] {
        assert_traversals_agree(&device, &scene, settings, what, full);
    }
    for name in ["scenes/cornell.glb", "scenes/water-basin.glb"] {
        let scene = lightfall::scene::load(Path::new(name)).unwrap();
        assert_traversals_agree(&device, &scene, &plain, name, &[]);
    }
}
