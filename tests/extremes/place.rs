//! One scene in many sizes, and far from the origin.

use crate::check::settings;
use crate::table::{Table, rel_mse, render};
use glam::DVec3;
use lightfall::scene::{self, Scene};
use lightfall::settings::Settings;
use serde_json::{Value, json};
use std::path::Path;

/// Edges [m] of the scenes are about so long.
const EXTENT: f64 = 2.0;

/// A GLB file of scenes/ as JSON and the bytes of its buffer.
struct File {
    json: Value,
    bytes: Vec<u8>,
}

impl File {
    fn read(name: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("scenes")
            .join(name);
        let file = std::fs::read(path).unwrap();
        let length = u32::from_le_bytes(*file[12..].first_chunk().unwrap()) as usize;
        let (json, rest) = file[20..].split_at(length);
        Self {
            json: serde_json::from_slice(json).unwrap(),
            bytes: rest[8..].to_vec(),
        }
    }

    /// All of it below one node.
    fn place(&mut self, scale: f64, translation: DVec3) {
        let (scale, translation) = ([scale; 3], translation.to_array());
        let root = json!({"scale": scale, "translation": translation, "children": self.json["scenes"][0]["nodes"]});
        let nodes = self.json["nodes"].as_array_mut().unwrap();
        nodes.push(root);
        self.json["scenes"][0]["nodes"] = json!([nodes.len() - 1]);
    }

    /// Moves meshes in place, from and to the float grid; cameras stay.
    fn move_positions(&mut self, change: impl Fn(f32) -> f32) {
        let meshes = self.json["meshes"].as_array().unwrap();
        let primitives = meshes
            .iter()
            .flat_map(|mesh| mesh["primitives"].as_array().unwrap());
        let accessors: Vec<_> = primitives
            .map(|primitive| primitive["attributes"]["POSITION"].as_u64().unwrap() as usize)
            .collect();
        for index in accessors {
            let number = |value: &Value| value.as_u64().unwrap() as usize;
            let view =
                &self.json["bufferViews"][number(&self.json["accessors"][index]["bufferView"])];
            let (first, length) = (number(&view["byteOffset"]), number(&view["byteLength"]));
            for bytes in self.bytes[first..][..length].as_chunks_mut().0 {
                *bytes = change(f32::from_le_bytes(*bytes)).to_le_bytes();
            }
            for key in ["min", "max"] {
                for x in self.json["accessors"][index][key].as_array_mut().unwrap() {
                    *x = json!(change(x.as_f64().unwrap() as f32));
                }
            }
        }
    }

    fn load(mut self) -> Scene {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("data.bin"), &self.bytes).unwrap();
        self.json["buffers"][0]["uri"] = json!("data.bin");
        let path = folder.path().join("scene.gltf");
        std::fs::write(&path, self.json.to_string()).unwrap();
        scene::load(&path).unwrap()
    }
}

/// `scenes/cornell.glb` in another size and place, its lamp as bright.
pub fn cornell(scale: f64, translation: DVec3) -> Scene {
    let mut file = File::read("cornell.glb");
    file.place(scale, translation);
    file.load()
}

/// Everything is left to the pilot.
pub fn automatic() -> Settings {
    Settings {
        radius: None,
        caustic_radius: None,
        direct: lightfall::settings::Direct::Auto,
        ..settings(32, 10_000, 1.0)
    }
}

pub fn rows(table: &mut Table) {
    let unit = cornell(1.0, DVec3::ZERO);
    let all = table.ways(&automatic());
    let truths: Vec<_> = all
        .iter()
        .map(|settings| render(&table.device, &unit, settings, 1))
        .collect();
    let against_unit = |table: &mut Table, extreme: &str, bound: f64, scene: &Scene| {
        let pairs = all.iter().zip(&truths);
        let errors = pairs
            .map(|(settings, truth)| rel_mse(&render(&table.device, scene, settings, 1), truth));
        let worst = errors.fold(0.0, |worst, x| if x <= worst { worst } else { x });
        table.row(extreme, "relMSE against the scene itself", worst, bound);
    };
    for scale in [1e-4, 1e-1, 1e6] {
        against_unit(
            table,
            &format!("a scene scaled by {scale:e}"),
            1e-4,
            &cornell(scale, DVec3::ZERO),
        );
    }
    let away = DVec3::new(1e5, -1e5, 1e5) * EXTENT;
    against_unit(
        table,
        "moved 10⁵ extents by its node",
        1e-4,
        &cornell(1.0, away),
    );
    against_unit(
        table,
        "scaled by 10³, then moved 10⁵ extents",
        1e-4,
        &cornell(1e3, 1e3 * away),
    );

    // Positions that are far away in the file lie on its float grid: nothing brings back what that lost, but
    // nothing more may be lost.
    let far = (1e5 * EXTENT) as f32;
    let walls = |change: &dyn Fn(f32) -> f32, camera: f32| {
        let mut file = File::read("cornell.glb");
        file.move_positions(change);
        for node in file.json["nodes"].as_array_mut().unwrap() {
            // The balls, which their nodes place.
            if node["scale"][0].as_f64().is_some_and(|scale| scale != 1.0) {
                node.as_object_mut().unwrap().remove("mesh");
            }
            if !node["camera"].is_null() {
                *node = json!({"camera": 0, "translation": [camera, camera + 1.0, camera + 3.0]});
            }
        }
        file.load()
    };
    let (moved, rounded) = (walls(&|x| x + far, far), walls(&|x| (x + far) - far, 0.0));
    table.worst(
        "moved 10⁵ extents in its vertices",
        "relMSE against the same vertices moved back",
        1e-4,
        &automatic(),
        |device, settings| {
            rel_mse(
                &render(device, &moved, settings, 1),
                &render(device, &rounded, settings, 1),
            )
        },
    );
}
