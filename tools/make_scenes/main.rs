//! Writes the scenes in `scenes/`: `cargo run --release --example make-scenes`.
//!
//! They are made here, from nothing, so that they are small, exact and in the public domain.
//! Modules know each other by `super`, so that a test can include them and make the like with
//! other numbers.

mod glb;
mod lamps;
mod material;
mod scenes;
mod shape;
mod sunlit;

use std::path::PathBuf;

/// File names in `scenes/` and what is in them.
fn scenes() -> [(&'static str, Vec<u8>); 15] {
    [
        ("cornell.glb", scenes::cornell()),
        ("ring-caustic.glb", scenes::ring_caustic()),
        ("water-basin.glb", scenes::water_basin()),
        ("glass-mirror.glb", scenes::glass_mirror()),
        ("room.glb", scenes::room()),
        ("furnace.glb", scenes::furnace()),
        ("ball-small.glb", sunlit::ball(1.0, 0.0)),
        ("ball-wide.glb", sunlit::ball(1000.0, 0.0)),
        ("blinds.glb", sunlit::blinds()),
        ("town.glb", sunlit::town()),
        ("pool.glb", sunlit::pool()),
        ("door-ajar.glb", lamps::door_ajar()),
        ("lamp-shade.glb", lamps::lamp_shade()),
        ("fifty-lamps.glb", lamps::fifty_lamps(true)),
        ("one-lamp.glb", lamps::fifty_lamps(false)),
    ]
}

fn path(name: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "scenes", name]
        .iter()
        .collect()
}

fn main() -> std::io::Result<()> {
    for (name, bytes) in scenes() {
        std::fs::write(path(name), &bytes)?;
        println!("scenes/{name}: {} bytes", bytes.len());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::shape::Shape;
    use glam::{DVec3, dvec3};

    fn volume(shape: &Shape) -> f64 {
        let corners =
            |triangle: &[u16; 3]| triangle.map(|index| shape.positions[usize::from(index)]);
        let signed = |[a, b, c]: [DVec3; 3]| a.dot(b.cross(c)) / 6.0;
        shape.triangles.iter().map(corners).map(signed).sum()
    }

    /// A scene that the loader mends or that has no camera of its own would test something else.
    /// The ball's surroundings are a parameter, for tests that need others than the files have.
    #[test]
    fn scenes_load_as_they_are_meant() {
        let folder = tempfile::tempdir().unwrap();
        let others = [
            ("near towers.glb", super::sunlit::ball(10.0, 4.0)),
            ("far towers.glb", super::sunlit::ball(1000.0, 300.0)),
        ];
        for (name, bytes) in super::scenes().into_iter().chain(others) {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            let scene = lightfall::scene::load(&path).unwrap();
            assert!(scene.warnings.is_empty(), "{name}: {:?}", scene.warnings);
            assert_eq!(scene.cameras.len(), 1, "{name}");
            assert_eq!(scene.cameras[0].name, "camera", "{name}");
            assert_eq!(scene.origin, DVec3::ZERO, "{name}");
        }
    }

    /// What lies in several holes is cut out once, and what lies beside the box is no hole in it.
    #[test]
    fn what_is_carved_is_as_large_as_the_box_less_its_holes() {
        let room = [dvec3(1.0, 1.0, 1.0), dvec3(3.0, 2.0, 3.0)];
        let window = [dvec3(-1.0, 1.2, 1.5), dvec3(1.5, 1.7, 2.5)];
        let beside = [dvec3(4.0, 0.0, 0.0), dvec3(5.0, 3.0, 4.0)];
        let house =
            Shape::default().carved(DVec3::ZERO, dvec3(4.0, 3.0, 4.0), &[room, window, beside]);
        let expected = 48.0 - 4.0 - 0.5;
        assert!((volume(&house) - expected).abs() < 1e-12);
    }

    /// The committed files are what this code makes.
    #[test]
    fn committed_scenes_have_not_drifted() {
        for (name, bytes) in super::scenes() {
            let committed = std::fs::read(super::path(name)).unwrap_or_default();
            assert!(
                committed == bytes,
                "scenes/{name}: run `cargo run --release --example make-scenes` and commit"
            );
        }
    }

    /// Every volume of water or glass is closed and faces outwards, or light leaks out of it.
    #[test]
    fn volumes_are_closed() {
        use super::{scenes, sunlit};
        use std::collections::HashMap;
        let volumes: [(&str, Shape); 5] = [
            ("sphere", Shape::sphere(2)),
            ("water", scenes::water()),
            ("tumbler", scenes::tumbler()),
            ("ring", scenes::ring()),
            ("pool", sunlit::pool_water()),
        ];
        for (name, shape) in volumes {
            let mut edges: HashMap<_, i32> = HashMap::new();
            for triangle in &shape.triangles {
                let corners = triangle.map(|index| shape.positions[usize::from(index)]);
                let [a, b, c] = corners;
                let key = corners.map(|p| p.as_vec3().to_array().map(|x| (x + 0.0).to_bits()));
                for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                    *edges.entry((key[from], key[to])).or_default() += 1;
                    *edges.entry((key[to], key[from])).or_default() -= 1;
                }
                let face = (b - a).cross(c - a);
                for index in triangle {
                    let normal = shape.normals[usize::from(*index)];
                    assert!(face.dot(normal) > 0.0, "{name}: a normal points inwards");
                }
            }
            assert!(
                edges.values().all(|&balance| balance == 0),
                "{name} has a hole"
            );
            assert!(volume(&shape) > 0.0, "{name} is inside out");
        }
    }
}
