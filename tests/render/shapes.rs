//! Scenes in a few lines: materials, quads, boxes, spheres, cameras.

use glam::{Mat4, Vec2, Vec3, Vec4, vec2, vec3};
use lightfall::scene::{Camera, Material, Projection, Scene, Triangle, Vertex};
use std::collections::HashMap;

/// Diffuse and nothing else.
pub fn lambertian(albedo: Vec3) -> Material {
    Material {
        base_color: albedo.extend(1.0),
        metallic: 0.0,
        specular: 0.0,
        ..Material::default()
    }
}

/// Shines [nit] and reflects nothing.
pub fn lamp(radiance: Vec3) -> Material {
    Material {
        emission: radiance,
        ..lambertian(Vec3::ZERO)
    }
}

/// Perfectly smooth metal.
pub fn mirror(reflectance: f32) -> Material {
    Material {
        base_color: Vec3::splat(reflectance).extend(1.0),
        roughness: 0.0,
        ..Material::default()
    }
}

/// Of roughness 0.5.
pub fn brass() -> Material {
    Material {
        roughness: 0.5,
        base_color: vec3(0.9, 0.7, 0.3).extend(1.0),
        ..Material::default()
    }
}

/// Smooth, colourless, refracting glass that absorbs σ [1/m].
pub fn glass(absorption: f32) -> Material {
    Material {
        absorption: Some(Vec3::splat(absorption)),
        ..pane()
    }
}

/// Smooth, colourless, thin-walled glass.
pub fn pane() -> Material {
    Material {
        metallic: 0.0,
        roughness: 0.0,
        transmission: 1.0,
        ..Material::default()
    }
}

/// The index of a new material.
pub fn material(scene: &mut Scene, material: Material) -> u32 {
    scene.materials.push(material);
    scene.materials.len() as u32 - 1
}

/// A triangle with a normal for each corner.
fn triangle(scene: &mut Scene, corners: [(Vec3, Vec3, Vec2); 3], material: u32) {
    let first = scene.vertices.len() as u32;
    scene
        .vertices
        .extend(corners.map(|(position_w, normal_w, uv)| Vertex {
            position_w,
            normal_w,
            uv: [uv; 2],
            color: Vec4::ONE,
            ..Vertex::default()
        }));
    scene.triangles.push(Triangle {
        vertices: [first, first + 1, first + 2],
        material,
    });
}

/// A convex polygon, counter-clockwise seen from its front.
pub fn polygon(scene: &mut Scene, corners: &[Vec3], material: u32) {
    let normal = (corners[1] - corners[0])
        .cross(corners[2] - corners[0])
        .normalize();
    for i in 1..corners.len() - 1 {
        let fan = [corners[0], corners[i], corners[i + 1]];
        triangle(scene, fan.map(|p| (p, normal, Vec2::ZERO)), material);
    }
}

/// A parallelogram about `center` with half edges `u` and `v`; its front looks along u × v, uv runs
/// from 0 to 1 along the edges, and the shading normal is `normal`.
pub fn bent_quad(scene: &mut Scene, center: Vec3, u: Vec3, v: Vec3, normal: Vec3, material: u32) {
    let corner = |a: f32, b: f32| (center + a * u + b * v, normal, vec2(a, b) * 0.5 + 0.5);
    let [p, q, r, s] = [
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ];
    triangle(scene, [p, q, r], material);
    triangle(scene, [p, r, s], material);
}

/// A flat parallelogram.
pub fn quad(scene: &mut Scene, center: Vec3, u: Vec3, v: Vec3, material: u32) {
    bent_quad(scene, center, u, v, u.cross(v).normalize(), material);
}

/// A floor at height `y`, its front up, with edges of 2 `half`.
pub fn floor(scene: &mut Scene, y: f32, half: f32, material: u32) {
    quad(scene, Vec3::Y * y, Vec3::Z * half, Vec3::X * half, material);
}

/// A box with its faces outwards, or inwards where `half` is negative.
pub fn cuboid(scene: &mut Scene, center: Vec3, half: Vec3, material: u32) {
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let mut n = Vec3::ZERO;
            n[axis] = side;
            let mut u = Vec3::ZERO;
            u[(axis + 1) % 3] = half[(axis + 1) % 3];
            let mut v = Vec3::ZERO;
            v[(axis + 2) % 3] = side * half[(axis + 2) % 3].abs();
            quad(scene, center + n * half[axis].abs(), u, v, material);
        }
    }
}

/// An icosahedron split `splits` times and blown up to a sphere; faces inwards where `radius` is
/// negative; `smooth`: shaded by the sphere's normals.
pub fn sphere(
    scene: &mut Scene,
    center: Vec3,
    radius: f32,
    splits: u32,
    smooth: bool,
    material: u32,
) {
    let (mut points, mut faces) = icosahedron();
    for _ in 0..splits {
        let mut middles = HashMap::new();
        let mut middle = |a: usize, b: usize| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a] + points[b]).normalize());
                points.len() - 1
            })
        };
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    for [a, b, c] in faces {
        let [a, b, c] = if radius < 0.0 { [a, c, b] } else { [a, b, c] }.map(|i| points[i]);
        let flat = (b - a).cross(c - a).normalize();
        let corner = |p: Vec3| {
            (
                center + p * radius.abs(),
                if smooth { p * radius.signum() } else { flat },
                Vec2::ZERO,
            )
        };
        triangle(scene, [corner(a), corner(b), corner(c)], material);
    }
}

fn icosahedron() -> (Vec<Vec3>, Vec<[usize; 3]>) {
    let golden = 0.5 + 1.25_f32.sqrt();
    let mut points = Vec::new();
    for (a, b) in [
        (1.0, golden),
        (1.0, -golden),
        (-1.0, golden),
        (-1.0, -golden),
    ] {
        points.extend([
            Vec3::new(0.0, a, b),
            Vec3::new(a, b, 0.0),
            Vec3::new(b, 0.0, a),
        ]);
    }
    // Corners that are an edge apart, wound outwards.
    let near = |a: usize, b: usize| (points[a].distance(points[b]) - 2.0).abs() < 0.01;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outwards = (points[b] - points[a])
                        .cross(points[c] - points[a])
                        .dot(points[a])
                        > 0.0;
                    faces.push(if outwards { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    (points.iter().map(|p| p.normalize()).collect(), faces)
}

/// Sets the scene's only camera; `yfov` in radians.
pub fn camera(scene: &mut Scene, eye: Vec3, target: Vec3, yfov: f32) {
    let forward = (target - eye).normalize();
    let right = forward
        .cross(if forward.y.abs() > 0.99 {
            Vec3::NEG_Z
        } else {
            Vec3::Y
        })
        .normalize();
    let up = right.cross(forward);
    scene.cameras = vec![Camera {
        name: "camera".into(),
        world_from_camera: Mat4::from_cols(
            right.extend(0.0),
            up.extend(0.0),
            -forward.extend(0.0),
            eye.extend(1.0),
        ),
        projection: Projection::Perspective { yfov },
        aspect: None,
    }];
}
