//! Which lamp a ray asks.

use crate::check::{Device, check_by, expected, layer, settings};
use crate::closed_forms::{ALBEDO, floor_scene, on_floor};
use crate::shapes::{lamp, material, quad};
use glam::{Vec3, vec3};
use lightfall::render::Renderer;
use lightfall::scene::{Image, Light, Material, Texture, TextureRef, Wrap};
use lightfall::settings::Settings;
use std::f32::consts::{PI, TAU};

/// A dim lamp over the floor and 49 bright ones far away light it about alike; of their flux it has one part in fifty
/// thousand. Means of 8 × 8 pixels are held to the closed form, the worst of them too.
#[test]
fn a_dim_lamp_nearby_beside_bright_ones_far_away() {
    let near = (vec3(0.1, 0.25, -0.05), vec3(0.02, 0.02, 0.02));
    let far = (0..49).map(|i| {
        let (angle, ring) = (TAU * i as f32 / 49.0, 25.0 + (i % 7) as f32);
        let place = vec3(
            ring * angle.cos(),
            15.0 + (i % 5) as f32,
            ring * angle.sin(),
        );
        (place, vec3(30.0, 20.0, 10.0) * (0.5 + (i % 3) as f32))
    });
    let lamps: Vec<(Vec3, Vec3)> = far.chain([near]).collect();
    let mut scene = floor_scene(1.0, 0.3);
    scene
        .lights
        .extend(lamps.iter().map(|&(position_w, intensity)| Light::Point {
            position_w,
            intensity,
        }));
    let edge = 64;
    let truth = expected(&scene, edge, |eye, d| {
        let p = on_floor(eye, d);
        let light = lamps.iter().map(|(place, intensity)| {
            let to = *place - p;
            *intensity * to.y / to.length().powi(3)
        });
        ALBEDO / PI * light.sum::<Vec3>()
    });
    let device = Device::open();
    let settings = Settings {
        technique: "path".into(),
        max_depth: 2,
        ..settings(edge, 0, 0.1)
    };
    let mut renderer = Renderer::new(&device, &scene, &settings).unwrap();
    (0..16).for_each(|_| renderer.iterate().unwrap());
    let picture = renderer.picture().unwrap();
    let found = regions(layer(&picture, ""), edge as usize);
    let errors = found.iter().zip(regions(&truth, edge as usize));
    let worst = errors.map(|(f, t)| (f / t - 1.0).abs()).fold(0.0, f32::max);
    println!("the worst region is {:.2} % off", 100.0 * worst);
    assert!(worst < 0.06, "{worst}");
}

/// A lamp of which one texel in 4096 shines: of the area A of a texel, L = ρ Lₑ A h² / (π d⁴).
#[test]
fn a_tiny_spot_of_a_textured_lamp() {
    let device = Device::open();
    if !device.info().caps.descriptor_indexing {
        println!("not tested: {} has no textures", device.info().name);
        return;
    }
    let (size, height, half, emitted) = (64, 0.7, 0.4, vec3(3e4, 5e4, 7e4));
    let (column, row) = (20, 10);
    let mut scene = floor_scene(1.5, 0.6);
    let texels = (0..size * size).flat_map(|i| [255 * u8::from(i == row * size + column); 4]);
    scene.images.push(Image {
        width: size,
        height: size,
        rgba: texels.collect(),
    });
    scene.textures.push(Texture {
        image: 0,
        wrap: [Wrap::Repeat; 2],
        nearest: false,
        srgb: true,
    });
    let screen = Material {
        emission_texture: Some(TextureRef {
            texture: 0,
            uv_set: 0,
            transform: [Vec3::X, Vec3::Y],
        }),
        ..lamp(emitted)
    };
    let screen = material(&mut scene, screen);
    quad(
        &mut scene,
        Vec3::Y * height,
        Vec3::X * half,
        Vec3::Z * half,
        screen,
    );
    let texel = 2.0 * half / size as f32;
    let from_edge = |i: u32| (i as f32 + 0.5) * texel - half;
    let spot = vec3(from_edge(column), height, from_edge(row));
    check_by(
        |row| matches!(row.name, "rtpm" | "path"),
        &scene,
        &settings(48, 100_000, 0.03),
        16,
        "",
        |eye, d| {
            let d2 = on_floor(eye, d).distance_squared(spot);
            ALBEDO * emitted * (texel * height / d2).powi(2) / PI
        },
    );
}

/// Means of 8 × 8 pixels over all channels.
fn regions(pixels: &[f32], edge: usize) -> Vec<f32> {
    let across = edge / 8;
    let mut sums = vec![0.0; across * across];
    for (i, value) in pixels.iter().enumerate() {
        let (x, y) = (i / 3 % edge, i / 3 / edge);
        sums[y / 8 * across + x / 8] += value / (8.0 * 8.0 * 3.0);
    }
    sums
}
