//! `lightfall info`: what a scene file holds.

use super::load::LoadArgs;
use crate::{
    Error, Result,
    scene::{self, Camera, Light, Projection, Scene, Triangle},
    world::{FEATURES, Reached, Use, upload_bytes},
};
use glam::Vec3;
use std::{
    fmt::Write as _,
    io::{ErrorKind, Write as _},
    path::Path,
};

/// Prints a summary of the scene at `path` on stdout.
pub fn run(path: &Path, load: &LoadArgs) -> Result<()> {
    let text = summary(&scene::load_with(path, &load.options())?);
    let printed = std::io::stdout().write_all(text.as_bytes());
    match printed {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::io("stdout".as_ref(), e)),
        _ => Ok(()),
    }
}

fn summary(scene: &Scene) -> String {
    let mut text = String::new();
    let mut row = |name: &str, value: String| {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{name:11}{value}");
    };
    row("triangles", scene.stored_triangles().count().to_string());
    row("vertices", scene.stored_vertices().count().to_string());
    row("materials", scene.materials.len().to_string());
    let (textures, images) = (scene.textures.len(), scene.images.len());
    row("textures", format!("{textures} of {images} images"));
    row("lights", lights(scene));
    features(scene, &mut row);
    for (i, camera) in scene.cameras.iter().enumerate() {
        let position_w = camera.world_from_camera.w_axis;
        let aspect = camera
            .aspect
            .map_or(String::new(), |a| format!(", aspect {a:.3}"));
        row(
            if i == 0 { "cameras" } else { "" },
            format!(
                "{i} '{}': {}{aspect}, at {}",
                camera.name,
                projection(camera.projection),
                metres(scene, position_w.truncate()),
            ),
        );
    }
    row("bounds", bounds(scene));
    far_away(scene, &mut row);
    let hash: String = scene.hash.iter().map(|b| format!("{b:02x}")).collect();
    row("hash", hash);
    for (i, (name, becomes)) in scene.extensions.iter().enumerate() {
        let title = if i == 0 { "extensions" } else { "" };
        row(title, format!("{name}: {becomes}"));
    }
    for warning in &scene.warnings {
        row("warning", warning.clone());
    }
    text
}

/// What the scene uses, how much of it does, and what it makes the device do; then what is left
/// out.
fn features(scene: &Scene, row: &mut impl FnMut(&str, String)) {
    let reached = Reached::new(scene);
    let mut title = "features";
    let mut left_out = Vec::new();
    for feature in FEATURES {
        let used = feature.used_in(scene, &reached);
        if used == Use::default() {
            left_out.push(feature.name);
            continue;
        }
        let counts = [
            (used.materials, "materials"),
            (used.triangles, "triangles"),
            (used.lights, "lights"),
            (used.vertices, "vertices"),
            (used.meshes, "meshes"),
            (used.places, "places"),
            (used.textures, "textures"),
        ];
        let counts = counts.into_iter().filter(|(count, _)| *count > 0);
        let counts = counts.map(|(count, of)| format!("{of} {count}"));
        let bytes = (used.bytes > 0).then(|| kilobytes(used.bytes));
        let counts: Vec<String> = counts.chain(bytes).collect();
        let (name, on) = (feature.name, feature.switches_on);
        row(
            std::mem::take(&mut title),
            format!("{name} ({}): {on}", counts.join(", ")),
        );
    }
    row("left out", left_out.join(", "));
    row("uploads", kilobytes(upload_bytes(scene)));
}

fn kilobytes(bytes: u64) -> String {
    format!("{:.1} kB", bytes as f64 * 1e-3)
}

fn projection(projection: Projection) -> String {
    match projection {
        Projection::Perspective { yfov } => format!("yfov {:.1}°", yfov.to_degrees()),
        Projection::Orthographic { ymag } => format!("orthographic, ymag {ymag} m"),
    }
}

fn lights(scene: &Scene) -> String {
    let count = |is: fn(&Light) -> bool| scene.lights.iter().filter(|l| is(l)).count();
    let emissive = scene.triangles.iter().filter(|t| {
        let material = scene.materials.get(t.material as usize);
        material.is_some_and(|m| m.emission.max_element() > 0.0)
    });
    format!(
        "{} point, {} spot, {} directional, {} emissive triangles",
        count(|l| matches!(l, Light::Point { .. })),
        count(|l| matches!(l, Light::Spot { .. })),
        count(|l| matches!(l, Light::Directional { .. })),
        emissive.count(),
    )
}

/// What reaches many times as far from the first camera as what it sees, by materials: where light
/// paths have to be guided, and positions are rounded for all.
fn far_away(scene: &Scene, row: &mut impl FnMut(&str, String)) {
    const TIMES: f32 = 100.0;
    const MOST: usize = 4;
    let Some(camera) = scene.cameras.first() else {
        return;
    };
    let camera_from_world = camera.world_from_camera.inverse();
    let corners = |triangle: &Triangle| {
        let places = triangle.vertices.map(|v| {
            let vertex = scene.vertices.get(v as usize);
            vertex.map(|v| camera_from_world.transform_point3(v.position_w))
        });
        places.into_iter().flatten()
    };
    let mut seen: Vec<f32> = scene
        .triangles
        .iter()
        .flat_map(corners)
        .filter(|at| in_view(camera, *at))
        .map(Vec3::length)
        .collect();
    seen.sort_unstable_by(f32::total_cmp);
    let Some(&median) = seen.get(seen.len() / 2) else {
        return;
    };
    let mut farthest = vec![0.0_f32; scene.materials.len()];
    for triangle in &scene.triangles {
        if let Some(far) = farthest.get_mut(triangle.material as usize) {
            *far = corners(triangle).map(Vec3::length).fold(*far, f32::max);
        }
    }
    let mut far: Vec<_> = scene.materials.iter().zip(farthest).collect();
    far.retain(|(_, distance)| *distance > TIMES * median);
    far.sort_by(|a, b| b.1.total_cmp(&a.1));
    for (i, (material, distance)) in far.iter().take(MOST).enumerate() {
        let title = if i == 0 { "far away" } else { "" };
        let name = &material.name;
        row(
            title,
            format!(
                "'{name}' reaches {distance:.3e} m from camera 0, which looks at things {median:.3e} m away"
            ),
        );
    }
}

/// A point in the camera's space, with the widest picture that there is.
fn in_view(camera: &Camera, at: Vec3) -> bool {
    let aspect = camera.aspect.unwrap_or(16.0 / 9.0);
    let high = match camera.projection {
        Projection::Perspective { yfov } => (0.5 * yfov).tan() * -at.z,
        Projection::Orthographic { ymag } => ymag,
    };
    at.z < 0.0 && at.y.abs() <= high && at.x.abs() <= aspect * high
}

fn bounds(scene: &Scene) -> String {
    let (low, high) = scene.bounds();
    format!("{} to {}", metres(scene, low), metres(scene, high))
}

/// In the file's world.
fn metres(scene: &Scene, point_w: Vec3) -> String {
    let point_w = (scene.origin + point_w.as_dvec3()).as_vec3();
    format!("({}, {}, {}) m", point_w.x, point_w.y, point_w.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Vertex};

    #[test]
    fn counts() {
        let vertex = |x| Vertex {
            position_w: Vec3::new(x, -x, 0.5),
            ..Vertex::default()
        };
        let glowing = Material {
            emission: Vec3::new(0.0, 2.0, 0.0),
            ..Material::default()
        };
        let triangle = |material| Triangle {
            vertices: [0, 1, 2],
            material,
        };
        let scene = Scene {
            vertices: [1.0, 2.0, 3.0].map(vertex).into(),
            triangles: [0, 1, 1].map(triangle).into(),
            materials: vec![Material::default(), glowing],
            lights: vec![Light::Point {
                position_w: Vec3::ZERO,
                intensity: Vec3::ONE,
            }],
            cameras: vec![Camera {
                name: "Main".into(),
                world_from_camera: glam::Mat4::from_translation(Vec3::Y),
                projection: Projection::Perspective {
                    yfov: std::f32::consts::FRAC_PI_2,
                },
                aspect: Some(1.5),
            }],
            extensions: vec![("KHR_x".into(), "not done".into())],
            warnings: vec!["/nodes/0: skin".into()],
            ..Scene::default()
        };
        let text = summary(&scene);
        for line in [
            "triangles  3",
            "materials  2",
            "lights     1 point, 0 spot, 0 directional, 2 emissive triangles",
            "features   specular (materials 2, triangles 3): specular lobes, a photon map of caustics",
            "           delta lights (lights 1): point, spot and directional lights",
            "           vertex colours (vertices 3, 0.0 kB): colours of vertices",
            "left out   diffuse, transmission, absorption, alpha, blend, unlit, instances, environment, base colour textures, \
             metallic-roughness textures, normal maps, emission textures, specular textures, specular colour \
             textures, transmission textures, second texture coordinates",
            "uploads    0.4 kB",
            "cameras    0 'Main': yfov 90.0°, aspect 1.500, at (0, 1, 0) m",
            "bounds     (1, -3, 0.5) m to (3, -1, 0.5) m",
            "extensions KHR_x: not done",
            "warning    /nodes/0: skin",
        ] {
            assert!(text.lines().any(|l| l == line), "{line} not in\n{text}");
        }
    }
}
