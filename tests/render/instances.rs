//! Meshes that are stored once and shown many times: the same picture as of their triangles each where it stands.

use crate::check::{Device, layer, settings};
use crate::shapes::*;
use glam::{Affine3A, Quat, Vec3, vec3};
use lightfall::render::Renderer;
use lightfall::scene::{
    Alpha, Image, Light, Material, Mesh, Scene, Texture, TextureRef, Triangle, Vertex, Wrap,
};
use lightfall::settings::{Direct, Evaluate, Settings};

/// A room and, in it, a mesh of glass, metal, chalk and a one-sided board with holes and a normal map, at places that turn
/// and stretch it.
fn scene_with_meshes(device: &Device) -> Scene {
    let mut scene = Scene::default();
    let wall = material(&mut scene, lambertian(vec3(0.7, 0.6, 0.5)));
    let shine = material(&mut scene, lamp(vec3(12.0, 10.0, 8.0)));
    let clear = material(&mut scene, glass(0.5));
    let brass = material(&mut scene, brass());
    cuboid(&mut scene, Vec3::ZERO, Vec3::splat(-1.0), wall);
    let (x, z) = (Vec3::X * 0.3, Vec3::Z * 0.3);
    quad(&mut scene, Vec3::Y * 0.98, x, z, shine);
    scene.lights.push(Light::Point {
        position_w: vec3(-0.5, 0.6, 0.7),
        intensity: Vec3::ONE,
    });
    camera(&mut scene, vec3(0.0, 0.0, 0.95), vec3(0.0, -0.3, -1.0), 1.4);

    let mut mesh = Scene {
        materials: scene.materials.clone(),
        ..Scene::default()
    };
    sphere(&mut mesh, vec3(-0.2, 0.0, 0.0), 0.2, 2, true, clear);
    cuboid(&mut mesh, vec3(0.25, 0.0, 0.1), vec3(0.1, 0.2, 0.1), brass);
    sphere(&mut mesh, vec3(0.1, 0.3, 0.0), 0.12, 1, false, wall);
    if device.info().caps.descriptor_indexing {
        let board = board(&mut mesh);
        let (center, right) = (vec3(0.0, -0.3, 0.1), vec3(0.3, 0.0, 0.05));
        quad(&mut mesh, center, right, Vec3::Y * 0.1, board);
        for vertex in &mut mesh.vertices {
            let tangent = vertex.normal_w.any_orthonormal_vector();
            vertex.tangent_w = tangent.extend(-1.0);
        }
        (scene.materials, scene.textures, scene.images) =
            (mesh.materials, mesh.textures, mesh.images);
    }
    let place = |scale: Vec3, turn: Vec3, at: Vec3| {
        let turn = Quat::from_scaled_axis(turn);
        Affine3A::from_scale_rotation_translation(scale, turn, at)
    };
    scene.meshes.push(Mesh {
        vertices: mesh.vertices,
        triangles: mesh.triangles,
        places: vec![
            Affine3A::from_translation(vec3(-0.4, -0.4, 0.0)),
            place(Vec3::splat(0.7), vec3(0.3, 1.2, -0.4), vec3(0.5, -0.5, 0.1)),
            place(vec3(0.5, 1.4, 0.8), Vec3::Y * 2.0, vec3(0.1, 0.3, -0.4)),
        ],
    });
    scene
}

/// Half holes, with a normal map that leans.
fn board(scene: &mut Scene) -> u32 {
    let texels = (0..16_u8).flat_map(|i| [200, 40 + 12 * i, 90, 255 * ((i + i / 4) % 2)]);
    let images = [(4, texels.collect()), (1, vec![160, 100, 240, 255])];
    let references = images.map(|(edge, rgba)| {
        let number = scene.textures.len() as u32;
        scene.images.push(Image {
            width: edge,
            height: edge,
            rgba,
        });
        scene.textures.push(Texture {
            image: number,
            wrap: [Wrap::Repeat; 2],
            nearest: true,
            srgb: number == 0,
        });
        Some(TextureRef {
            texture: number,
            uv_set: 0,
            transform: [Vec3::X, Vec3::Y],
        })
    });
    let board = Material {
        base_color_texture: references[0],
        normal_texture: references[1],
        alpha: Alpha::Mask { cutoff: 0.5 },
        ..lambertian(Vec3::ONE)
    };
    material(scene, board)
}

/// The same with every triangle where it stands.
fn flattened(scene: &Scene) -> Scene {
    let mut flat = scene.clone();
    for mesh in flat.meshes.drain(..).collect::<Vec<_>>() {
        for place in &mesh.places {
            let first = flat.vertices.len() as u32;
            let normals = glam::Mat3::from(place.matrix3).inverse().transpose();
            flat.vertices.extend(mesh.vertices.iter().map(|v| Vertex {
                position_w: place.transform_point3(v.position_w),
                normal_w: (normals * v.normal_w).normalize(),
                tangent_w: {
                    let tangent = place.transform_vector3(v.tangent_w.truncate());
                    tangent.normalize_or_zero().extend(v.tangent_w.w)
                },
                ..*v
            }));
            flat.triangles
                .extend(mesh.triangles.iter().map(|t| Triangle {
                    vertices: t.vertices.map(|v| first + v),
                    ..*t
                }));
        }
    }
    flat
}

#[test]
fn instances_look_like_their_triangles() {
    let device = Device::open();
    let scene = scene_with_meshes(&device);
    let flat = flattened(&scene);
    for trace in device.two_traversals() {
        let settings = Settings {
            trace,
            direct: Direct::Rays,
            evaluate: Evaluate::Full,
            ..settings(48, 5_000, 0.1)
        };
        let [instanced, flat] = [&scene, &flat].map(|scene| {
            let mut renderer = Renderer::new(&device, scene, &settings).unwrap();
            (0..2).for_each(|_| renderer.iterate().unwrap());
            (renderer.picture().unwrap(), renderer.ledger())
        });
        assert_eq!(instanced.1, flat.1, "{trace:?}");
        for name in ["", "albedo", "normal", "depth"] {
            let [a, b] = [&instanced.0, &flat.0].map(|picture| layer(picture, name));
            let mean = a.iter().map(|x| x.abs()).sum::<f32>() / a.len() as f32;
            let differ = |(a, b): &(&f32, &f32)| (*a - *b).abs() > 1e-4 * a.abs().max(mean);
            let differ = a.iter().zip(b).filter(differ).count();
            // A few rays past an edge, where positions are rounded in another way.
            assert!(500 * differ <= a.len(), "{trace:?}, {name}: {differ}");
        }
    }
}

/// A plane of squares, each a mesh of so many triangles.
fn tiles(edge: u32, splits: u32) -> Scene {
    let mut scene = Scene::default();
    let chalk = material(&mut scene, lambertian(Vec3::splat(0.5)));
    let mut mesh = Scene::default();
    let half = 0.5 / splits as f32;
    let at = |i: u32| (i as f32 + 0.5) / splits as f32 - 0.5;
    for (x, z) in (0..splits * splits).map(|i| (i % splits, i / splits)) {
        let center = vec3(at(x), 0.0, at(z));
        quad(&mut mesh, center, Vec3::Z * half, Vec3::X * half, chalk);
    }
    let places = (0..edge * edge).map(|i| {
        let middle = 0.5 * edge as f32;
        let at = vec3((i % edge) as f32 - middle, 0.0, (i / edge) as f32 - middle);
        // Quarter turns leave the plane as it is.
        let turn = Quat::from_rotation_y(i as f32 * std::f32::consts::FRAC_PI_2);
        Affine3A::from_rotation_translation(turn, at)
    });
    scene.meshes.push(Mesh {
        vertices: mesh.vertices,
        triangles: mesh.triangles,
        places: places.collect(),
    });
    scene.lights.push(Light::Directional {
        direction_w: Vec3::NEG_Y,
        illuminance: Vec3::ONE,
    });
    camera(&mut scene, vec3(0.0, 40.0, 0.1), Vec3::ZERO, 1.0);
    scene
}

#[test]
fn a_hundred_million_triangles_take_the_memory_of_ten_thousand() {
    let device = Device::open();
    let scene = tiles(100, 71);
    let shown = scene.meshes[0].triangles.len() * scene.meshes[0].places.len();
    assert!(shown > 100_000_000);
    for trace in device.two_traversals() {
        let settings = Settings {
            trace,
            direct: Direct::Rays,
            ..settings(32, 1_000, 0.5)
        };
        let mut renderer = Renderer::new(&device, &scene, &settings).unwrap();
        renderer.iterate().unwrap();
        let stored: u64 = device.allocations().iter().map(|of| of.1).sum();
        assert!(stored < 100 << 20, "{trace:?}: {stored} bytes");
        let picture = renderer.picture().unwrap();
        // The whole view is plane, and shines by 0.5 / π nit.
        for value in layer(&picture, "direct") {
            let expected = 0.5 / std::f32::consts::PI;
            assert!((value - expected).abs() < 1e-4, "{trace:?}: {value}");
        }
    }
}
