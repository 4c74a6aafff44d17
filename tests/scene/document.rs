//! Small glTF documents, made in the test.

use glam::Vec3;
use lightfall::scene::{self, Scene};
use serde_json::{Value, json};

/// A glTF document under construction: JSON and one buffer.
pub struct Document {
    pub json: Value,
    pub bytes: Vec<u8>,
}

impl Document {
    /// One node with one mesh with one primitive, whose attributes follow.
    pub fn new() -> Self {
        Self {
            json: json!({
                "asset": {"version": "2.0"},
                "scenes": [{"nodes": [0]}],
                "nodes": [{"mesh": 0}],
                "meshes": [{"primitives": [{"attributes": {}}]}],
                "bufferViews": [],
                "accessors": [],
            }),
            bytes: Vec::new(),
        }
    }

    /// A triangle in the xy plane, counter-clockwise from +z.
    pub fn triangle() -> Self {
        let mut document = Self::new();
        document.attribute("POSITION", &[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
        document
    }

    /// The unit square in the xy plane with an upright image: v down.
    pub fn square(normals: bool) -> Self {
        let mut document = Self::new();
        let corners = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
        document.attribute("POSITION", &corners);
        document.attribute("TEXCOORD_0", &[[0., 1.], [1., 1.], [1., 0.], [0., 0.]]);
        if normals {
            document.attribute("NORMAL", &[[0., 0., 1.]; 4]);
        }
        document.indices(&[0, 1, 2, 0, 2, 3]);
        document
    }

    pub fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    pub fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    pub fn view(&mut self, bytes: &[u8]) -> usize {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        let view = json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()});
        self.push("bufferViews", view)
    }

    pub fn floats<const N: usize>(&mut self, elements: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = elements
            .iter()
            .flatten()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        let view = self.view(&bytes);
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5126, "count": elements.len(),
                   "type": format!("VEC{N}")}),
        )
    }

    pub fn attribute<const N: usize>(&mut self, name: &str, elements: &[[f32; N]]) {
        let accessor = self.floats(elements);
        self.primitive()["attributes"][name] = json!(accessor);
    }

    pub fn indices(&mut self, indices: &[u16]) {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let accessor = self.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5123, "count": indices.len(),
                   "type": "SCALAR"}),
        );
        self.primitive()["indices"] = json!(accessor);
    }

    pub fn material(&mut self, material: Value) {
        let i = self.push("materials", material);
        self.primitive()["material"] = json!(i);
    }

    pub fn lamp(&mut self, light: Value) {
        self.json["extensions"]["KHR_lights_punctual"] = json!({"lights": [light]});
        self.json["nodes"][0]["extensions"]["KHR_lights_punctual"] = json!({"light": 0});
    }

    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut bin = self.bytes.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let mut file = b"glTF".to_vec();
        let length = 12 + 8 + text.len() + 8 + bin.len();
        for word in [2, length as u32, text.len() as u32] {
            file.extend(word.to_le_bytes());
        }
        file.extend(b"JSON");
        file.extend(text);
        file.extend((bin.len() as u32).to_le_bytes());
        file.extend(b"BIN\0");
        file.extend(bin);
        file
    }

    pub fn try_load(&self) -> lightfall::Result<Scene> {
        load_files(&[("scene.glb", &self.glb())])
    }

    pub fn load(&self) -> Scene {
        self.try_load().unwrap()
    }

    /// The message that this document is refused with.
    pub fn fault(&self) -> String {
        let error = self.try_load().expect_err("must be refused").to_string();
        assert!(error.contains("scene.glb"), "{error}");
        error
    }
}

/// The JSON and the binary chunk of a GLB file.
pub fn parts(file: &[u8]) -> (Value, Vec<u8>) {
    let length = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
    let json = serde_json::from_slice(&file[20..20 + length]).unwrap();
    (json, file[28 + length..].to_vec())
}

/// Writes files into a new folder and loads the first.
pub fn load_files(files: &[(&str, &[u8])]) -> lightfall::Result<Scene> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    scene::load(&folder.path().join(files[0].0))
}

/// The corners and the face normal of triangle `i`.
pub fn corners(scene: &Scene, i: usize) -> ([Vec3; 3], Vec3) {
    let corners = scene.triangles[i].vertices;
    let [a, b, c] = corners.map(|i| scene.vertices[i as usize].position_w);
    ([a, b, c], (b - a).cross(c - a).normalize())
}

pub fn near(a: Vec3, b: Vec3) -> bool {
    a.abs_diff_eq(b, 1e-5)
}

pub fn png(color: [u8; 4]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_pixel(2, 1, image::Rgba(color))
        .write_to(&mut bytes, image::ImageFormat::Png)
        .unwrap();
    bytes.into_inner()
}

pub fn base64(bytes: &[u8]) -> String {
    let digits = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let mut word = [0; 4];
        word[1..=chunk.len()].copy_from_slice(chunk);
        let word = u32::from_be_bytes(word);
        for i in 0..4 {
            let digit = digits[(word >> (18 - 6 * i)) as usize & 63] as char;
            text.push(if i <= chunk.len() { digit } else { '=' });
        }
    }
    text
}
