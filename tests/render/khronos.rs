//! Khronos's sample assets that have a pattern to pass or fail, seen straight on by parallel rays, so that
//! a place of the scene has its place in the picture.

use crate::check::{Device, layer};
use crate::shapes::camera;
use glam::{Vec2, Vec3, vec2, vec3};
use lightfall::gpu::Gpu;
use lightfall::image::Picture;
use lightfall::render::Renderer;
use lightfall::scene::{self, Light, Projection, Scene};
use lightfall::settings::{Settings, Trace};
use std::path::Path;

/// The sample, lit from the front; `None`, with a word, where there are none.
fn sample(gpu: &Gpu, name: &str) -> Option<Scene> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes/khronos");
    let path = folder.join(name);
    if !path.is_file() || !gpu.info().caps.descriptor_indexing {
        println!("skipped: {} is absent, or no textures", path.display());
        return None;
    }
    let mut scene = scene::load(&path).unwrap();
    scene.lights.push(Light::Directional {
        direction_w: vec3(0.2, -0.3, -1.0).normalize(),
        illuminance: Vec3::ONE,
    });
    Some(scene)
}

/// A picture of the plane across `axis` through `center`.
struct View {
    picture: Picture,
    center: Vec2,
    /// Edge of a pixel [m].
    pixel: f32,
}

impl View {
    fn new(gpu: &Gpu, scene: &mut Scene, (center, pixel, size): (Vec2, f32, [u32; 2])) -> Self {
        Self::along(gpu, scene, Vec3::Z, (center, pixel, size))
    }

    fn along(
        gpu: &Gpu,
        scene: &mut Scene,
        axis: Vec3,
        (center, pixel, size): (Vec2, f32, [u32; 2]),
    ) -> Self {
        let target = center.extend(0.0);
        camera(scene, target + axis * 20.0, target, 1.0);
        scene.cameras[0].projection = Projection::Orthographic {
            ymag: pixel * size[1] as f32 * 0.5,
        };
        let settings = Settings {
            size: Some(size),
            technique: "path".into(),
            trace: Trace::Software,
            ..Settings::default()
        };
        let mut renderer = Renderer::new(gpu, scene, &settings).unwrap();
        for _ in 0..16 {
            renderer.iterate().unwrap();
        }
        Self {
            picture: renderer.picture().unwrap(),
            center,
            pixel,
        }
    }

    /// The values of a layer within `half` of a place, row by row.
    fn window(&self, name: &str, at: Vec2, half: Vec2) -> Vec<Vec3> {
        let pixels = layer(&self.picture, name);
        let (width, height) = (self.picture.width as usize, self.picture.height as usize);
        let channels = pixels.len() / (width * height);
        let middle = vec2(width as f32, height as f32) * 0.5;
        let place = middle + (at - self.center) * vec2(1.0, -1.0) / self.pixel;
        let low = (place - half / self.pixel).round().as_usizevec2();
        let count = (half * 2.0 / self.pixel).round().as_usizevec2();
        let mut values = Vec::new();
        for y in low.y..low.y + count.y {
            for x in low.x..low.x + count.x {
                let at = (y * width + x) * channels;
                values.push(Vec3::from(
                    [0, 1, 2].map(|c| pixels[at + c.min(channels - 1)]),
                ));
            }
        }
        values
    }

    fn mean(&self, name: &str, at: Vec2, half: f32) -> Vec3 {
        let window = self.window(name, at, Vec2::splat(half));
        window.iter().sum::<Vec3>() / window.len() as f32
    }

    /// The mean difference of two windows over the mean deviation within the second: 0 for the same
    /// picture, about 1 for others.
    fn difference(&self, name: &str, [a, b]: [Vec2; 2], half: f32) -> f32 {
        let [a, b] = [a, b].map(|at| self.window(name, at, Vec2::splat(half)));
        let mean = b.iter().sum::<Vec3>() / b.len() as f32;
        let off: f32 = a.iter().zip(&b).map(|(a, b)| (*a - *b).length()).sum();
        let own: f32 = b.iter().map(|b| (*b - mean).length()).sum();
        off / own
    }
}

fn assert_alike(view: &View, layer: &str, [test, sample]: [Vec2; 2], half: f32, what: &str) {
    let difference = view.difference(layer, [test, sample], half);
    println!("{what}: {difference:.3}");
    assert!(difference < 0.4, "{what}: {difference}");
}

#[test]
fn negative_scale_test() {
    let device = Device::open();
    let Some(mut scene) = sample(&device, "NegativeScaleTest.glb") else {
        return;
    };
    let view = View::new(&device, &mut scene, (Vec2::ZERO, 0.05, [212, 180]));
    for (y, row) in [(2.68, "scale 1"), (1.52, "scale -1")] {
        for (x, column) in [(0.007, "front"), (1.9, "back")] {
            let cells = [vec2(x, y), vec2(3.828, y)];
            assert_alike(&view, "albedo", cells, 0.4, &format!("{row}, {column}"));
        }
    }
    // Both of each pair of balls bulge.
    for y in [-1.0, -2.25, -3.5] {
        let balls = [vec2(3.0, y), vec2(1.0, y)];
        assert_alike(&view, "normal", balls, 0.45, &format!("balls at {y}"));
        let left = view.mean("normal", vec2(2.7, y), 0.1);
        assert!(left.x < -0.4 && left.z > 0.5, "{left}");
    }
}

#[test]
fn texture_settings_test() {
    let device = Device::open();
    let Some(mut scene) = sample(&device, "TextureSettingsTest.glb") else {
        return;
    };
    let view = View::new(&device, &mut scene, (vec2(1.5, -1.1), 0.05365, [80, 180]));
    let rows = [2.545, 1.52, 0.467, -0.57, -1.604, -2.641, -3.678, -4.715];
    for (i, y) in rows.into_iter().enumerate() {
        let cells = [vec2(0.455, y), vec2(2.601, y)];
        if matches!(i, 2 | 3) {
            // The clamped ones have one colour all over.
            for at in cells {
                for texel in view.window("albedo", at, Vec2::splat(0.4)) {
                    assert!(texel.y > 4.0 * texel.x, "row {i}: {texel}");
                }
            }
        } else {
            assert_alike(&view, "albedo", cells, 0.4, &format!("row {i}"));
        }
    }
}

#[test]
fn texture_transform_test() {
    let device = Device::open();
    let Some(mut scene) = sample(&device, "TextureTransformTest/TextureTransformTest.gltf") else {
        return;
    };
    let view = View::new(&device, &mut scene, (Vec2::ZERO, 0.02, [170, 130]));
    let corners = [-1.0, 1.0].map(|x| [-1.0, 1.0].map(|y| vec2(x, y) * 0.44));
    for (x, color) in [(-1.1, [0, 1, 0]), (0.0, [0, 0, 1]), (1.1, [0, 1, 1])] {
        for corner in corners.iter().flatten() {
            let seen = view.mean("albedo", vec2(x, 0.55) + corner, 0.04);
            for (c, on) in color.into_iter().enumerate() {
                assert_eq!(seen[c] > 0.1, on == 1, "at {x} + {corner}: {seen}");
            }
        }
    }
    // The arrow ends at the mark that says so.
    let dark = |at: Vec2, half: f32| {
        let window = view.window("albedo", at, Vec2::splat(half + 0.1));
        window.iter().filter(|t| t.max_element() < 0.1).count()
    };
    for (what, at, half) in [
        ("rotation", vec2(-1.179, -1.066), 0.075),
        ("scale", vec2(0.019, -0.569), 0.05),
        ("all", vec2(1.03, -0.8), 0.05),
    ] {
        println!("{what}: {} dark texels", dark(at, half));
        assert!(dark(at, half) >= 4, "{what}");
    }
    for (what, at) in [
        ("rotation not supported", vec2(-0.822, -0.828)),
        ("scale not supported", vec2(0.278, -0.828)),
    ] {
        println!("{what}: {} dark texels", dark(at, 0.075));
        assert_eq!(dark(at, 0.075), 0, "{what}");
    }
}

#[test]
fn texture_transform_multi_test() {
    let device = Device::open();
    let Some(mut scene) = sample(&device, "TextureTransformMultiTest.glb") else {
        return;
    };
    let view = View::new(&device, &mut scene, (vec2(0.35, 0.0), 0.01, [80, 200]));
    for (what, layer, y) in [
        ("base colour", "albedo", 0.75),
        ("emission", "emission", 0.5),
        ("normal", "normal", 0.25),
        ("metal and roughness", "", 0.0),
        ("unlit", "emission", -0.5),
    ] {
        for (set, x) in [0.1, 0.35].into_iter().enumerate() {
            let cells = [vec2(x, y), vec2(0.6, y)];
            assert_alike(&view, layer, cells, 0.08, &format!("{what}, set {set}"));
        }
    }
}

#[test]
fn texture_coordinate_test() {
    let device = Device::open();
    let Some(mut scene) = sample(&device, "TextureCoordinateTest.glb") else {
        return;
    };
    let view = View::new(&device, &mut scene, (Vec2::ZERO, 0.04, [60, 60]));
    for (x, y, what, color) in [
        (-0.6, 0.6, "yellow", vec3(0.7, 0.7, 0.0)),
        (0.6, 0.6, "orange", vec3(0.9, 0.3, 0.0)),
        (-0.6, -0.6, "blue", vec3(0.0, 0.3, 0.8)),
        (0.6, -0.6, "green", vec3(0.0, 0.8, 0.0)),
    ] {
        let seen = view.mean("albedo", vec2(x, y), 0.1);
        assert!(
            seen.normalize().dot(color.normalize()) > 0.95,
            "{what}: {seen}"
        );
    }
}

#[test]
fn vertex_color_test() {
    let device = Device::open();
    let Some(mut scene) = sample(&device, "VertexColorTest.glb") else {
        return;
    };
    let view = View::new(&device, &mut scene, (Vec2::ZERO, 0.0124, [150, 130]));
    for (x, what) in [(-0.548, "red"), (0.0, "green"), (0.592, "blue")] {
        let cells = [vec2(x, 0.3405), vec2(x, -0.528)];
        assert_alike(&view, "albedo", cells, 0.2, what);
    }
}

#[test]
fn normal_tangent_test() {
    let device = Device::open();
    let Some(mut scene) = sample(&device, "NormalTangentTest.glb") else {
        return;
    };
    let view = View::new(&device, &mut scene, (Vec2::ZERO, 0.02, [120, 110]));
    for x in [-0.65, 0.16, 0.96] {
        for y in [0.8, 0.4, 0.0, -0.4, -0.8] {
            // The bump of the normal map, and that of the mesh.
            let cells = [vec2(x, y), vec2(x - 0.32, y)];
            assert_alike(&view, "normal", cells, 0.12, &format!("bumps at {x}, {y}"));
        }
    }
}

/// Coverage, by depth: the panels stand 0.467 m before the wall. The arrows beside them tell where they end.
#[test]
fn alpha_blend_mode_test() {
    let device = Device::open();
    let Some(mut scene) = sample(&device, "AlphaBlendModeTest.glb") else {
        return;
    };
    let view = View::new(&device, &mut scene, (vec2(0.0, 1.1), 0.02, [370, 120]));
    let coverage = |x: f32, y: f32| {
        // Right of the labels.
        let window = view.window("depth", vec2(x + 0.17, y), vec2(0.24, 0.02));
        let mean = window.iter().map(|depth| depth.x).sum::<f32>() / window.len() as f32;
        (20.467 - mean) / 0.467
    };
    for (cutoff, y, x) in [(0.25, 1.457, 0.0), (0.5, 1.068, 1.5), (0.75, 0.682, 3.0)] {
        println!("alpha {cutoff}: {}", coverage(-1.5, y));
        assert!(
            (coverage(-1.5, y) - cutoff).abs() < 0.05,
            "{}",
            coverage(-1.5, y)
        );
        assert!(coverage(-3.0, y) > 0.999, "opaque");
        assert!(coverage(x, y - 0.07) > 0.99, "below {cutoff}");
        assert!(coverage(x, y + 0.07) < 0.01, "above {cutoff}");
    }
}

/// Light of the backdrop through cubes of d metres, by all four ways to say how much they absorb: in a
/// slab the sum over its inner reflections.
#[test]
fn attenuation_test() {
    let device = Device::open();
    let Some(mut scene) = sample(&device, "AttenuationTest.glb") else {
        return;
    };
    scene.lights.clear();
    let backdrop = scene
        .materials
        .iter_mut()
        .find(|m| m.name == "FlatBackdrop");
    let backdrop = backdrop.unwrap();
    (backdrop.emission, backdrop.emission_texture) = (Vec3::ONE, None);
    let view = View::new(&device, &mut scene, (vec2(1.5, -1.5), 0.05, [220, 220]));
    for (x, d) in [
        (-3.5, 0.25),
        (-2.0, 0.5),
        (0.0, 1.0),
        (2.5, 1.5),
        (6.0, 2.0),
    ] {
        let (through, r) = (vec3(0.1, 0.5, 0.9).powf(d), 0.04);
        let expected = (1.0 - r) * (1.0 - r) * through / (1.0 - r * r * through * through);
        for (row, y) in [(2, 3.0), (3, 0.0), (4, -3.0), (5, -6.0)] {
            let seen = view.mean("emission", vec2(x, y), 0.1 + 0.2 * (d - 0.25));
            println!("row {row}, {d} m: {seen} for {expected}");
            let off = (seen - expected).abs().max_element();
            assert!(off < 0.03, "row {row}, {d} m: {seen} for {expected}");
        }
    }
}

/// Each arrow and what it points at, of one colour, look like one piece.
#[test]
fn orientation_test() {
    let device = Device::open();
    let Some(mut scene) = sample(&device, "OrientationTest.glb") else {
        return;
    };
    let color_of = |scene: &Scene, name| {
        let material = scene.materials.iter().find(|m| m.name == name);
        material.unwrap().base_color.truncate()
    };
    let base = color_of(&scene, "BaseMaterial");
    for (axis, name) in [
        (Vec3::X, "MatX1"),
        (Vec3::NEG_X, "MatX2"),
        (Vec3::Y, "MatY1"),
        (Vec3::NEG_Y, "MatY2"),
        (Vec3::Z, "MatZ1"),
        (Vec3::NEG_Z, "MatZ2"),
    ] {
        let color = color_of(&scene, name);
        let view = View::along(&device, &mut scene, axis, (Vec2::ZERO, 0.08, [110, 110]));
        let inside: Vec<bool> = view
            .window("albedo", Vec2::ZERO, Vec2::splat(4.4))
            .iter()
            .map(|seen| (seen - base).dot(color - base) > 0.3 * (color - base).length_squared())
            .collect();
        let pieces = pieces(&inside, 110);
        println!("{name}: {pieces:?}");
        assert!(pieces.len() == 1 && pieces[0] > 400, "{name}: {pieces:?}");
    }
}

/// Sizes of the pieces of more than four pixels; what is less than three apart is one piece.
fn pieces(inside: &[bool], width: usize) -> Vec<usize> {
    let mut left = inside.to_vec();
    let mut sizes = Vec::new();
    for start in 0..left.len() {
        let (mut todo, mut size) = (vec![start], 0);
        while let Some(i) = todo.pop() {
            if !std::mem::replace(&mut left[i], false) {
                continue;
            }
            size += 1;
            let (x, y) = (i % width, i / width);
            for ny in y.saturating_sub(2)..(y + 3).min(left.len() / width) {
                todo.extend((x.saturating_sub(2)..(x + 3).min(width)).map(|nx| ny * width + nx));
            }
        }
        if size > 4 {
            sizes.push(size);
        }
    }
    sizes
}

/// Unlit, it needs no lamp, and shows its base colour in nit.
#[test]
fn unlit_test() {
    let device = Device::open();
    let Some(mut scene) = sample(&device, "UnlitTest.glb") else {
        return;
    };
    scene.lights.clear();
    let view = View::new(&device, &mut scene, (Vec2::ZERO, 0.05, [90, 45]));
    for (x, name) in [(-1.2, "Orange"), (1.2, "Blue")] {
        let seen = view.mean("", vec2(x, 0.0), 0.2);
        let colors = scene.materials.iter().map(|m| m.base_color.truncate());
        let nearest = colors.map(|c| seen.distance(c)).fold(f32::MAX, f32::min);
        assert!(nearest < 1e-4, "{name}: {seen}");
    }
    assert!(view.mean("", vec2(-1.2, 0.0), 0.2).x > view.mean("", vec2(1.2, 0.0), 0.2).x);
}
