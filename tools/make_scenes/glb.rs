//! A writer of binary glTF 2.0 (<https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html>).

use glam::{DMat4, DVec3, Vec3};
use serde_json::{Value, json};

use super::shape::Shape;

/// A glTF file in the making. Materials, meshes and so on are named by their index.
#[derive(Default)]
pub struct Glb {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    lights: Vec<Value>,
    cameras: Vec<Value>,
    nodes: Vec<Value>,
}

/// A shape's accessors: several meshes may share them.
#[derive(Clone, Copy)]
pub struct Geometry {
    positions: usize,
    normals: usize,
    indices: usize,
}

impl Glb {
    /// A glTF material object.
    pub fn material(&mut self, material: Value) -> usize {
        push(&mut self.materials, material)
    }

    pub fn geometry(&mut self, shape: &Shape) -> Geometry {
        let positions = self.vectors(&shape.positions);
        let normals = if shape.normals == shape.positions {
            positions // a unit sphere
        } else {
            self.vectors(&shape.normals)
        };
        let indices: Vec<u8> = shape
            .triangles
            .iter()
            .flatten()
            .flat_map(|index| index.to_le_bytes())
            .collect();
        let view = self.view(&indices, ELEMENT_ARRAY_BUFFER);
        let accessor = json!({
            "bufferView": view, "componentType": UNSIGNED_SHORT, "type": "SCALAR",
            "count": 3 * shape.triangles.len(),
        });
        let indices = push(&mut self.accessors, accessor);
        Geometry {
            positions,
            normals,
            indices,
        }
    }

    /// Puts a geometry of one material into the scene, scaled and then moved.
    pub fn place(
        &mut self,
        name: &str,
        geometry: Geometry,
        material: usize,
        scale: f64,
        position: DVec3,
    ) {
        let mesh = json!({ "name": name, "primitives": [{
            "attributes": { "POSITION": geometry.positions, "NORMAL": geometry.normals },
            "indices": geometry.indices, "material": material,
        }] });
        // A shape that stands in many places is stored once: the file stays small.
        let known = self.meshes.iter().position(|known| *known == mesh);
        let mesh = known.unwrap_or_else(|| push(&mut self.meshes, mesh));
        self.nodes.push(json!({
            "name": name, "mesh": mesh, "scale": [scale, scale, scale],
            "translation": position.to_array(),
        }));
    }

    /// A shape in world space.
    pub fn put(&mut self, name: &str, shape: &Shape, material: usize) {
        let geometry = self.geometry(shape);
        self.place(name, geometry, material, 1.0, DVec3::ZERO);
    }

    /// `yfov` [rad], `aspect` width over height.
    pub fn camera(&mut self, eye: DVec3, target: DVec3, yfov: f64, aspect: f64) {
        let camera = json!({ "type": "perspective", "perspective": {
            "yfov": yfov, "aspectRatio": aspect, "znear": 0.01,
        } });
        let camera = push(&mut self.cameras, camera);
        let matrix = looking(eye, target);
        self.nodes
            .push(json!({ "name": "camera", "camera": camera, "matrix": matrix }));
    }

    /// `intensity` [cd]; cone half-angles [rad].
    pub fn spot(&mut self, position: DVec3, target: DVec3, intensity: f64, cone: [f64; 2]) {
        let light = json!({
            "type": "spot", "intensity": intensity,
            "spot": { "innerConeAngle": cone[0], "outerConeAngle": cone[1] },
        });
        self.light(light, looking(position, target));
    }

    /// `intensity` [cd], the same in every direction.
    pub fn point(&mut self, position: DVec3, intensity: f64) {
        let light = json!({ "type": "point", "intensity": intensity });
        self.light(light, DMat4::from_translation(position).to_cols_array());
    }

    /// A sun: `illuminance` [lx] on what faces it; its light goes along `direction`.
    pub fn sun(&mut self, direction: DVec3, illuminance: f64) {
        let light = json!({ "type": "directional", "intensity": illuminance });
        self.light(light, looking(DVec3::ZERO, direction));
    }

    fn light(&mut self, light: Value, matrix: [f64; 16]) {
        let light = push(&mut self.lights, light);
        self.nodes.push(json!({
            "name": "light", "matrix": matrix,
            "extensions": { "KHR_lights_punctual": { "light": light } },
        }));
    }

    /// The finished file.
    pub fn finish(self) -> Vec<u8> {
        let mut root = json!({
            "asset": {
                "version": "2.0", "generator": "lightfall make-scenes",
                "copyright": "Public domain (CC0 1.0)",
            },
            "scene": 0,
            "scenes": [{ "nodes": (0..self.nodes.len()).collect::<Vec<_>>() }],
            "nodes": self.nodes, "meshes": self.meshes, "materials": self.materials,
            "cameras": self.cameras, "accessors": self.accessors, "bufferViews": self.views,
            "buffers": [{ "byteLength": self.binary.len() }],
        });
        if !self.lights.is_empty() {
            root["extensions"] = json!({ "KHR_lights_punctual": { "lights": self.lights } });
        }
        let text = root.to_string();
        let used: Vec<&str> = EXTENSIONS
            .into_iter()
            .filter(|name| text.contains(name))
            .collect();
        if !used.is_empty() {
            root["extensionsUsed"] = json!(used);
        }
        let json = chunk(b"JSON", root.to_string().into_bytes(), b' ');
        let binary = chunk(b"BIN\0", self.binary, 0);
        let length = (12 + json.len() + binary.len()) as u32;
        let header = [
            &b"glTF"[..],
            &2_u32.to_le_bytes(),
            &length.to_le_bytes(),
            &json,
            &binary,
        ];
        header.concat()
    }

    fn view(&mut self, bytes: &[u8], target: u32) -> usize {
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let view = json!({
            "buffer": 0, "byteOffset": offset, "byteLength": bytes.len(), "target": target,
        });
        push(&mut self.views, view)
    }

    fn vectors(&mut self, vectors: &[DVec3]) -> usize {
        let vectors: Vec<Vec3> = vectors.iter().map(|vector| vector.as_vec3()).collect();
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &vector in &vectors {
            low = low.min(vector);
            high = high.max(vector);
        }
        let view = self.view(bytemuck::cast_slice(&vectors), ARRAY_BUFFER);
        let accessor = json!({
            "bufferView": view, "componentType": FLOAT, "type": "VEC3", "count": vectors.len(),
            "min": low.as_dvec3().to_array(), "max": high.as_dvec3().to_array(),
        });
        push(&mut self.accessors, accessor)
    }
}

const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const UNSIGNED_SHORT: u32 = 5123;
const FLOAT: u32 = 5126;

const EXTENSIONS: [&str; 6] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_volume",
];

fn push(list: &mut Vec<Value>, value: Value) -> usize {
    list.push(value);
    list.len() - 1
}

fn chunk(kind: &[u8; 4], mut bytes: Vec<u8>, padding: u8) -> Vec<u8> {
    bytes.resize(bytes.len().next_multiple_of(4), padding);
    let length = bytes.len() as u32;
    [&length.to_le_bytes()[..], kind, &bytes].concat()
}

/// Cameras, spots and suns look down −Z of their node; +Y is up.
fn looking(eye: DVec3, target: DVec3) -> [f64; 16] {
    let z = (eye - target).normalize();
    let x = DVec3::Y.cross(z).normalize();
    let columns = [x, z.cross(x), z].map(|axis| axis.extend(0.0));
    DMat4::from_cols(columns[0], columns[1], columns[2], eye.extend(1.0)).to_cols_array()
}
