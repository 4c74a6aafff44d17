//! The glTF loader: small documents made here, with known answers, and the scenes of
//! `../shared/scenes`, where present, against the numbers that their list gives.

use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3, Vec4};
use lightfall::scene::{self, Light, Material, Scene, Wrap};
use serde_json::{Value, json};

/// A glTF document under construction: JSON and one buffer.
struct Document {
    json: Value,
    bytes: Vec<u8>,
}

impl Document {
    /// One node with one mesh with one primitive, whose attributes follow.
    fn new() -> Self {
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
    fn triangle() -> Self {
        let mut document = Self::new();
        document.attribute("POSITION", &[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
        document
    }

    /// The unit square in the xy plane with an upright image: v down.
    fn square(normals: bool) -> Self {
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

    fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        while self.bytes.len() % 4 != 0 {
            self.bytes.push(0);
        }
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        let view = json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()});
        self.push("bufferViews", view)
    }

    fn floats<const N: usize>(&mut self, elements: &[[f32; N]]) -> usize {
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

    fn attribute<const N: usize>(&mut self, name: &str, elements: &[[f32; N]]) {
        let accessor = self.floats(elements);
        self.primitive()["attributes"][name] = json!(accessor);
    }

    fn indices(&mut self, indices: &[u16]) {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let accessor = self.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5123, "count": indices.len(),
                   "type": "SCALAR"}),
        );
        self.primitive()["indices"] = json!(accessor);
    }

    fn material(&mut self, material: Value) {
        let i = self.push("materials", material);
        self.primitive()["material"] = json!(i);
    }

    fn lamp(&mut self, light: Value) {
        self.json["extensions"]["KHR_lights_punctual"] = json!({"lights": [light]});
        self.json["nodes"][0]["extensions"]["KHR_lights_punctual"] = json!({"light": 0});
    }

    fn glb(&self) -> Vec<u8> {
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

    fn try_load(&self) -> lightfall::Result<Scene> {
        load_files(&[("scene.glb", &self.glb())])
    }

    fn load(&self) -> Scene {
        self.try_load().unwrap()
    }

    /// The message that this document is refused with.
    fn fault(&self) -> String {
        let error = self.try_load().expect_err("must be refused").to_string();
        assert!(error.contains("scene.glb"), "{error}");
        error
    }
}

/// Writes files into a new folder and loads the first.
fn load_files(files: &[(&str, &[u8])]) -> lightfall::Result<Scene> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    scene::load(&folder.path().join(files[0].0))
}

/// The corners and the face normal of triangle `i`.
fn corners(scene: &Scene, i: usize) -> ([Vec3; 3], Vec3) {
    let corners = scene.triangles[i].vertices;
    let [a, b, c] = corners.map(|i| scene.vertices[i as usize].position_w);
    ([a, b, c], (b - a).cross(c - a).normalize())
}

fn near(a: Vec3, b: Vec3) -> bool {
    a.abs_diff_eq(b, 1e-5)
}

fn png(color: [u8; 4]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_pixel(2, 1, image::Rgba(color))
        .write_to(&mut bytes, image::ImageFormat::Png)
        .unwrap();
    bytes.into_inner()
}

fn base64(bytes: &[u8]) -> String {
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

#[test]
fn triangle_without_normals_gets_the_face_normal() {
    let scene = Document::triangle().load();
    assert_eq!(scene.triangles.len(), 1);
    assert_eq!(scene.vertices.len(), 3);
    assert!(
        scene
            .vertices
            .iter()
            .all(|v| v.normal_w == Vec3::Z && v.color == Vec4::ONE)
    );
    assert_eq!(scene.materials, [Material::default()]);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn flat_normals_split_shared_vertices() {
    let mut document = Document::new();
    let p = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
    document.attribute("POSITION", &p);
    document.indices(&[0, 1, 2, 0, 2, 3]);
    let scene = document.load();
    assert_eq!(
        scene
            .vertices
            .iter()
            .filter(|v| v.normal_w == Vec3::Z)
            .count(),
        4 - 1
    );
    for (i, triangle) in scene.triangles.iter().enumerate() {
        let (_, normal) = corners(&scene, i);
        for v in triangle.vertices {
            assert_eq!(scene.vertices[v as usize].normal_w, normal);
        }
    }
}

#[test]
fn useless_normals_are_replaced() {
    let mut document = Document::triangle();
    document.attribute("NORMAL", &[[0., 0., 0.], [f32::NAN, 0., 0.], [0., 3., 4.]]);
    let scene = document.load();
    let normals = scene.triangles[0]
        .vertices
        .map(|i| scene.vertices[i as usize].normal_w);
    assert_eq!(normals[..2], [Vec3::Z; 2]);
    assert!(near(normals[2], Vec3::new(0., 0.6, 0.8)));
}

#[test]
fn mirroring_keeps_triangles_counter_clockwise() {
    let mut document = Document::triangle();
    document.attribute("NORMAL", &[[0.6, 0., 0.8]; 3]);
    document.json["nodes"][0]["scale"] = json!([-2, 1, 1]);
    let scene = document.load();
    let (_, normal) = corners(&scene, 0);
    assert_eq!(normal, Vec3::Z);
    // By the inverse transpose: (0.6 / −2, 0, 0.8).
    let expected = Vec3::new(-0.3, 0., 0.8).normalize();
    assert!(scene.vertices.iter().all(|v| near(v.normal_w, expected)));

    // A mirror along z turns the front of this triangle, and its normals, to −z.
    document.json["nodes"][0]["scale"] = json!([1, 1, -1]);
    let scene = document.load();
    assert_eq!(corners(&scene, 0).1, Vec3::NEG_Z);
    assert!(near(scene.vertices[0].normal_w, Vec3::new(0.6, 0., -0.8)));
}

#[test]
fn transforms_nest() {
    let mut document = Document::triangle();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    document.json["nodes"] = json!([
        {"children": [1], "translation": [10, 0, 0], "rotation": [0, half, 0, half]},
        {"children": [2], "scale": [2, 3, 4]},
        {"mesh": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 1,1,1,1]},
    ]);
    let scene = document.load();
    // (x, y, z) + 1, scaled, turned by 90° about y (x → −z, z → x), moved.
    let place =
        |x: f32, y: f32, z: f32| Vec3::new(10. + 4. * (z + 1.), 3. * (y + 1.), -2. * (x + 1.));
    let expected = [place(0., 0., 0.), place(1., 0., 0.), place(0., 1., 0.)];
    let (found, _) = corners(&scene, 0);
    assert!(
        found.iter().zip(expected).all(|(a, b)| near(*a, b)),
        "{found:?}"
    );
}

#[test]
fn flattening_and_zero_scale() {
    let mut document = Document::triangle();
    document.attribute("NORMAL", &[[1., 0., 0.]; 3]);
    document.json["nodes"] = json!([{"mesh": 0}, {"mesh": 0, "scale": [0, 0, 0]},
        {"mesh": 0, "scale": [1, 1, 0]}, {"mesh": 0, "scale": [0, 1, 1]}]);
    document.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
    let scene = document.load();
    // Zero scale hides; flattening along z keeps the area; along x it leaves none.
    assert_eq!(scene.triangles.len(), 2);
    let flat = scene.triangles[1]
        .vertices
        .map(|i| scene.vertices[i as usize].normal_w);
    assert_eq!(flat, [Vec3::Z; 3]);
}

#[test]
fn triangles_without_area_are_dropped() {
    let mut document = Document::new();
    let p = [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [0., 1., 0.]];
    document.attribute("POSITION", &p);
    document.indices(&[0, 1, 2, 0, 0, 1, 0, 1, 3]);
    assert_eq!(document.load().triangles.len(), 1);
}

#[test]
fn strips_and_fans_face_the_same_way() {
    let strip = [
        [0., 0., 0.],
        [1., 0., 0.],
        [0., 1., 0.],
        [1., 1., 0.],
        [0., 2., 0.],
    ];
    let fan = [
        [0., 0., 0.],
        [1., 0., 0.],
        [1., 1., 0.],
        [0., 1., 0.],
        [-1., 1., 0.],
    ];
    for (mode, positions, area) in [(5, strip, 1.5), (6, fan, 1.5)] {
        let mut document = Document::new();
        document.attribute("POSITION", &positions);
        document.primitive()["mode"] = json!(mode);
        let scene = document.load();
        assert_eq!(scene.triangles.len(), 3, "mode {mode}");
        let mut sum = 0.0;
        for i in 0..3 {
            let ([a, b, c], normal) = corners(&scene, i);
            assert_eq!(normal, Vec3::Z, "mode {mode}, triangle {i}");
            sum += (b - a).cross(c - a).length() / 2.0;
        }
        assert_eq!(sum, area, "mode {mode}");
    }
}

#[test]
fn points_and_lines_are_named() {
    let mut document = Document::triangle();
    let mut points = document.primitive().clone();
    points["mode"] = json!(0);
    let primitives = document.json["meshes"][0]["primitives"]
        .as_array_mut()
        .unwrap();
    primitives.push(points);
    let scene = document.load();
    assert_eq!(scene.triangles.len(), 1);
    assert_eq!(scene.warnings.len(), 1);
    assert!(scene.warnings[0].starts_with("/meshes/0/primitives/1/mode: "));
}

#[test]
fn interleaved_and_normalized_attributes() {
    let mut document = Document::new();
    let mut bytes = Vec::new();
    for (p, uv) in [
        ([0., 0., 0.], [0u16, 65535]),
        ([1., 0., 0.], [65535, 0]),
        ([0., 1., 0.], [13107, 0]),
    ] {
        bytes.extend(p.iter().flat_map(|x: &f32| x.to_le_bytes()));
        bytes.extend(uv.iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([255, 51, 0, 255]);
    }
    let view = document.view(&bytes);
    document.json["bufferViews"][view]["byteStride"] = json!(20);
    for (name, offset, kind, components) in [
        ("POSITION", 0, 5126, "VEC3"),
        ("TEXCOORD_0", 12, 5123, "VEC2"),
        ("COLOR_0", 16, 5121, "VEC4"),
    ] {
        let accessor = json!({"bufferView": view, "byteOffset": offset, "componentType": kind,
            "count": 3, "type": components, "normalized": kind != 5126});
        let i = document.push("accessors", accessor);
        document.primitive()["attributes"][name] = json!(i);
    }
    let scene = document.load();
    let vertex = scene.vertices[scene.triangles[0].vertices[2] as usize];
    assert_eq!(vertex.position_w, Vec3::Y);
    assert!(vertex.uv[0].abs_diff_eq(Vec2::new(0.2, 0.0), 1e-6));
    assert!(
        vertex
            .color
            .abs_diff_eq(Vec4::new(1.0, 0.2, 0.0, 1.0), 1e-6)
    );
}

#[test]
fn sparse_accessors_replace_elements() {
    let mut document = Document::triangle();
    let indices = document.view(&[0, 2]);
    let bytes: Vec<u8> = [0f32, 0., 7., 0., 5., 7.]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let values = document.view(&bytes);
    let sparse = json!({"count": 2, "values": {"bufferView": values},
        "indices": {"bufferView": indices, "componentType": 5121}});
    document.json["accessors"][0]["sparse"] = sparse;
    let (found, _) = corners(&document.load(), 0);
    assert_eq!(
        found,
        [Vec3::new(0., 0., 7.), Vec3::X, Vec3::new(0., 5., 7.)]
    );

    // Without a bufferView the rest is zero.
    let accessor = document.json["accessors"][0].as_object_mut().unwrap();
    accessor.remove("bufferView");
    let (found, _) = corners(&document.load(), 0);
    assert_eq!(found[1], Vec3::ZERO);

    document.bytes[36] = 3; // the first sparse index: beyond its element count, and out of order
    assert!(
        document.fault().contains("/accessors/0/sparse/indices"),
        "{}",
        document.fault()
    );
}

#[test]
fn indices_of_all_widths() {
    for (kind, size) in [(5121, 1), (5123, 2), (5125, 4)] {
        let mut document = Document::triangle();
        let bytes: Vec<u8> = [2u32, 0, 1]
            .iter()
            .flat_map(|i| i.to_le_bytes()[..size].to_vec())
            .collect();
        let view = document.view(&bytes);
        let accessor =
            json!({"bufferView": view, "componentType": kind, "count": 3, "type": "SCALAR"});
        let i = document.push("accessors", accessor);
        document.primitive()["indices"] = json!(i);
        let (found, _) = corners(&document.load(), 0);
        assert_eq!(found, [Vec3::Y, Vec3::ZERO, Vec3::X], "{kind}");
    }
}

#[test]
fn bad_geometry_is_refused() {
    let mut document = Document::triangle();
    document.indices(&[0, 1, 3]);
    assert!(document.fault().contains("/meshes/0/primitives/0: index 3"));

    let mut document = Document::triangle();
    document.indices(&[0, 1, 2, 0]);
    assert!(document.fault().contains("not whole triangles"));

    let mut document = Document::triangle();
    document.json["accessors"][0]["count"] = json!(4_000_000_000u64);
    assert!(
        document
            .fault()
            .contains("/accessors/0: 4000000000 elements")
    );

    let mut document = Document::triangle();
    document.json["accessors"][0]["count"] = json!(u64::MAX);
    assert!(document.fault().contains("/accessors/0"));

    let mut document = Document::triangle();
    document.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX);
    assert!(document.fault().contains("/bufferViews/0"));

    let mut document = Document::triangle();
    document.json["accessors"][0]["byteOffset"] = json!(2);
    assert!(document.fault().contains("not aligned"));

    let mut document = Document::triangle();
    document.attribute("NORMAL", &[[0., 0., 1.]; 2]);
    assert!(document.fault().contains("different counts"));

    let mut document = Document::triangle();
    document.json["nodes"][0]["translation"] = json!([1e30, 0, 0]);
    assert!(document.fault().contains("/nodes/0"));

    let mut document = Document::triangle();
    let view = document.json["accessors"][0].as_object_mut().unwrap();
    view.remove("bufferView");
    document.json["accessors"][0]["count"] = json!(3_000_000_000u64);
    assert!(document.fault().contains("without a bufferView"));
}

#[test]
fn instancing_bomb_is_refused_before_it_is_read() {
    let mut document = Document::new();
    document.attribute("POSITION", &vec![[0., 0., 0.]; 30_000]);
    let nodes: Vec<Value> = (0..10_000).map(|_| json!({"mesh": 0})).collect();
    document.json["nodes"] = json!(nodes);
    document.json["scenes"][0]["nodes"] = json!((0..10_000).collect::<Vec<_>>());
    assert!(document.fault().contains("instances counted"));
}

#[test]
fn cycles_and_shared_children_are_refused() {
    for nodes in [
        json!([{"mesh": 0, "children": [0]}]),
        json!([{"children": [1]}, {"mesh": 0, "children": [2]}, {"children": [1]}]),
        json!([{"children": [1, 2]}, {"children": [3]}, {"children": [3]}, {"mesh": 0}]),
    ] {
        let mut document = Document::triangle();
        document.json["nodes"] = nodes;
        assert!(document.fault().contains("reached twice"));
    }
}

#[test]
fn deep_chains_do_not_overflow_the_stack() {
    let mut document = Document::triangle();
    let depth = 200_000;
    let mut nodes: Vec<Value> = (1..depth).map(|i| json!({"children": [i]})).collect();
    nodes.push(json!({"mesh": 0}));
    document.json["nodes"] = json!(nodes);
    assert_eq!(document.load().triangles.len(), 1);
    // JSON that nests as deeply is not glTF, and is refused, not followed.
    let bomb = "{\"asset\":".to_owned() + &"[".repeat(100_000);
    assert!(load_files(&[("scene.gltf", bomb.as_bytes())]).is_err());
}

#[test]
fn the_default_scene_is_used_else_the_first() {
    let mut document = Document::triangle();
    document.json["nodes"] = json!([{"mesh": 0}, {"mesh": 0, "translation": [0, 0, 5]}]);
    document.json["scenes"] = json!([{"nodes": [0]}, {"nodes": [1]}]);
    assert_eq!(document.load().bounds().0.z, 0.0);
    document.json["scene"] = json!(1);
    assert_eq!(
        document.load().bounds(),
        (Vec3::new(0., 0., 5.), Vec3::new(1., 1., 5.))
    );
    document.json["scene"] = json!(2);
    assert!(document.fault().contains("/scene: "));
}

#[test]
fn a_scene_without_triangles_is_refused() {
    let mut document = Document::triangle();
    document.json["nodes"] = json!([{}]);
    assert!(document.fault().ends_with("no triangles to render"));
}

#[test]
fn default_camera_frames_the_box() {
    let mut document = Document::triangle();
    document.json["nodes"][0]["scale"] = json!([200, 3, 1]);
    document.json["nodes"][0]["translation"] = json!([-50, 20, 7]);
    let scene = document.load();
    let [camera] = &scene.cameras[..] else {
        panic!()
    };
    assert!((camera.yfov.to_degrees() - 45.0).abs() < 1e-4);
    let camera_from_world = camera.world_from_camera.inverse();
    let (low, high) = scene.bounds();
    let limit = (camera.yfov / 2.0).tan();
    let mut widest = 0f32;
    for corner in 0..8 {
        let pick = |bit: usize| {
            if corner >> bit & 1 == 0 {
                low[bit]
            } else {
                high[bit]
            }
        };
        let p = camera_from_world.transform_point3(Vec3::new(pick(0), pick(1), pick(2)));
        assert!(p.z < 0.0);
        widest = widest.max(p.x.abs().max(p.y.abs()) / -p.z);
    }
    assert!(
        widest <= limit && widest > 0.8 * limit,
        "{widest} of {limit}"
    );
}

#[test]
fn cameras_are_rigid() {
    let mut document = Document::triangle();
    document.json["cameras"] = json!([
        {"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1, "aspectRatio": 1.5}},
        {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "zfar": 1, "znear": 0}},
    ]);
    document.json["nodes"] = json!([{"mesh": 0}, {"camera": 1},
        {"scale": [-3, 2, 5], "children": [3]}, {"camera": 0, "name": "eye", "translation": [1, 0, 0]}]);
    document.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    let scene = document.load();
    let [camera] = &scene.cameras[..] else {
        panic!()
    };
    assert_eq!(
        (camera.name.as_str(), camera.yfov, camera.aspect),
        ("eye", 0.8, Some(1.5))
    );
    let m = camera.world_from_camera;
    assert!((m.determinant() - 1.0).abs() < 1e-5);
    assert!(near(m.z_axis.truncate(), Vec3::Z) && near(m.y_axis.truncate(), Vec3::Y));
    assert!(near(m.w_axis.truncate(), Vec3::new(-3., 0., 0.)));
    assert_eq!(scene.warnings.len(), 1);
    assert!(scene.warnings[0].starts_with("/cameras/1: "));

    for lens in [
        json!({"yfov": 0}),
        json!({"yfov": 4}),
        json!({}),
        json!({"yfov": 1, "aspectRatio": -1}),
    ] {
        document.json["cameras"][0]["perspective"] = lens;
        assert!(document.fault().contains("/cameras/0/perspective"));
    }
}

#[test]
fn material_extensions_have_their_values() {
    let mut document = Document::triangle();
    document.material(json!({
        "name": "glass", "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.25,
        "emissiveFactor": [0.5, 1, 0],
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5,
            "roughnessFactor": 0.125},
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 8},
            "KHR_materials_ior": {"ior": 1.75},
            "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [2, 1, 0]},
            "KHR_materials_transmission": {"transmissionFactor": 0.75},
            "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 0.5,
                "attenuationColor": [1, 0.5, 0]},
        },
    }));
    document.json["extensionsRequired"] = json!(["KHR_materials_volume", "KHR_materials_specular"]);
    let scene = document.load();
    let expected = Material {
        name: "glass".into(),
        base_color: Vec4::new(0.1, 0.2, 0.3, 0.4),
        metallic: 0.5,
        roughness: 0.125,
        emission: Vec3::new(4., 8., 0.),
        alpha_cutoff: Some(0.25),
        double_sided: true,
        ior: 1.75,
        specular: 0.5,
        specular_color: Vec3::new(2., 1., 0.),
        transmission: 0.75,
        absorption: Some(Vec3::new(0., 2.0 * std::f32::consts::LN_2, 1e30)),
        ..Material::default()
    };
    assert_eq!(scene.materials, [expected]);
    assert!(scene.materials[0].is_transmissive());
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn absorption_only_with_a_thickness_and_transmission() {
    let absorption = |transmission: bool, volume: Value| {
        let mut document = Document::triangle();
        document.material(json!({"extensions": {"KHR_materials_volume": volume}}));
        if transmission {
            let extensions = &mut document.json["materials"][0]["extensions"];
            extensions["KHR_materials_transmission"] = json!({"transmissionFactor": 1});
        }
        document.load().materials[0].absorption
    };
    assert_eq!(absorption(true, json!({})), None);
    assert_eq!(absorption(false, json!({"thicknessFactor": 1})), None);
    let clear = absorption(
        true,
        json!({"thicknessFactor": 1, "attenuationColor": [0, 0.5, 1]}),
    );
    assert_eq!(clear, Some(Vec3::ZERO), "the default distance is infinite");
    let tiny = json!({"thicknessFactor": 1, "attenuationDistance": 1e-300, "attenuationColor": [0, 0.5, 1]});
    assert_eq!(absorption(true, tiny), Some(Vec3::new(1e30, 1e30, 0.)));
}

#[test]
fn factors_out_of_range_are_moved_and_named() {
    let mut document = Document::triangle();
    document.material(json!({"alphaMode": "BLEND",
        "pbrMetallicRoughness": {"roughnessFactor": -1.5, "metallicFactor": 7},
        "extensions": {"KHR_materials_ior": {"ior": 0.5},
            "KHR_materials_emissive_strength": {"emissiveStrength": -1}}}));
    let scene = document.load();
    let material = &scene.materials[0];
    assert_eq!(
        (material.roughness, material.metallic, material.ior),
        (0.0, 1.0, 1.0)
    );
    assert_eq!(material.alpha_cutoff, None);
    for path in [
        "/materials/0/pbrMetallicRoughness/roughnessFactor: ",
        "/materials/0/pbrMetallicRoughness/metallicFactor: ",
        "/materials/0/alphaMode: ",
        "/materials/0/extensions/KHR_materials_ior/ior: ",
        "/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength: ",
    ] {
        let count = scene
            .warnings
            .iter()
            .filter(|w| w.starts_with(path))
            .count();
        assert_eq!(count, 1, "{path}: {:?}", scene.warnings);
    }
    assert_eq!(scene.warnings.len(), 5);

    document.json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = json!("high");
    assert!(
        document
            .fault()
            .contains("metallicFactor: must be a number")
    );
}

#[test]
fn extensions_are_done_ignored_or_refused() {
    let mut document = Document::triangle();
    document.material(
        json!({"extensions": {"KHR_materials_clearcoat": {}}, "extras": {"extensions": {"X": 1}}}),
    );
    document.json["extensionsUsed"] = json!([
        "KHR_materials_clearcoat",
        "EXT_other",
        "KHR_texture_transform"
    ]);
    let warnings = document.load().warnings;
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(warnings[0].starts_with("/materials/0/extensions/KHR_materials_clearcoat: "));
    assert!(warnings[1].starts_with("/extensionsUsed/1: EXT_other"));

    for (name, fix) in [
        ("EXT_other", "EXT_other"),
        ("KHR_materials_clearcoat", "clearcoat"),
        ("EXT_mesh_gpu_instancing", "instancing"),
        ("KHR_draco_mesh_compression", "npx @gltf-transform/cli copy"),
        ("EXT_meshopt_compression", "npx @gltf-transform/cli copy"),
        ("KHR_texture_basisu", "npx @gltf-transform/cli"),
    ] {
        document.json["extensionsRequired"] = json!([name]);
        let fault = document.fault();
        assert!(
            fault.contains("/extensionsRequired/0") && fault.contains(fix),
            "{fault}"
        );
    }
    document.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    document.load();
}

#[test]
fn what_is_not_done_is_named_once() {
    let mut document = Document::triangle();
    document.json["animations"] = json!([{}, {}]);
    document.json["skins"] = json!([{"joints": [0]}]);
    document.json["nodes"][0]["skin"] = json!(0);
    document.primitive()["targets"] = json!([{"POSITION": 0}]);
    let warnings = document.load().warnings;
    for path in [
        "/animations: ",
        "/nodes/0/skin: ",
        "/meshes/0/primitives/0/targets: ",
    ] {
        assert_eq!(
            warnings.iter().filter(|w| w.starts_with(path)).count(),
            1,
            "{warnings:?}"
        );
    }
    assert_eq!(warnings.len(), 3);
}

#[test]
fn lights_stand_where_their_nodes_are() {
    let light = |light: Value| {
        let mut document = Document::triangle();
        document.json["nodes"][0]["translation"] = json!([1, 2, 3]);
        let half = std::f32::consts::FRAC_1_SQRT_2;
        // 90° about x turns −z to +y.
        document.json["nodes"][0]["rotation"] = json!([half, 0, 0, half]);
        document.json["nodes"][0]["scale"] = json!([-2, 2, 2]);
        document.lamp(light);
        document.try_load().map(|scene| scene.lights[0])
    };
    let position_w = Vec3::new(1., 2., 3.);
    let point = light(json!({"type": "point"})).unwrap();
    assert_eq!(
        point,
        Light::Point {
            position_w,
            intensity: Vec3::ONE
        }
    );
    let sun =
        light(json!({"type": "directional", "intensity": 100, "color": [1, 0.5, 0]})).unwrap();
    let Light::Directional {
        direction_w,
        illuminance,
    } = sun
    else {
        panic!()
    };
    assert!(near(direction_w, Vec3::Y));
    assert_eq!(illuminance, Vec3::new(100., 50., 0.));

    let spot = |spot: Value| light(json!({"type": "spot", "spot": spot, "intensity": 5}));
    let Light::Spot {
        inner_cone,
        outer_cone,
        direction_w,
        intensity,
        ..
    } = spot(json!({})).unwrap()
    else {
        panic!()
    };
    assert!(near(direction_w, Vec3::Y));
    assert_eq!((inner_cone, outer_cone), (0.0, std::f32::consts::FRAC_PI_4));
    assert_eq!(intensity, Vec3::splat(5.0));
    // Equal in f32, though not in the file; and π/2 rounded up.
    let narrow = json!({"innerConeAngle": 1.570_799_999, "outerConeAngle": 1.5708});
    let Light::Spot {
        inner_cone,
        outer_cone,
        ..
    } = spot(narrow).unwrap()
    else {
        panic!()
    };
    assert!(inner_cone < outer_cone && outer_cone <= std::f32::consts::FRAC_PI_2);
    let wrong = spot(json!({"innerConeAngle": 1.2, "outerConeAngle": 0.4})).unwrap_err();
    assert!(
        wrong
            .to_string()
            .contains("/extensions/KHR_lights_punctual/lights/0/spot")
    );
    assert!(light(json!({"type": "laser"})).is_err());
}

#[test]
fn textures_come_with_sampler_and_transform() {
    let mut document = Document::square(true);
    let view = document.view(&png([10, 20, 30, 255]));
    document.json["images"] = json!([{"bufferView": view, "mimeType": "image/png"}]);
    document.json["samplers"] = json!([{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}]);
    document.json["textures"] = json!([{"source": 0, "sampler": 0}]);
    let transform = json!({"KHR_texture_transform": {"offset": [0, 1], "texCoord": 1,
        "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.5]}});
    document.material(json!({"pbrMetallicRoughness": {
        "baseColorTexture": {"index": 0, "extensions": transform},
        "metallicRoughnessTexture": {"index": 0}}}));
    let scene = document.load();
    assert_eq!(scene.images.len(), 1);
    assert_eq!((scene.images[0].width, scene.images[0].height), (2, 1));
    assert_eq!(scene.images[0].rgba, [10, 20, 30, 255, 10, 20, 30, 255]);
    assert_eq!(scene.textures.len(), 2, "one as colour, one as data");
    let color = scene.materials[0].base_color_texture.unwrap();
    let data = scene.materials[0].metallic_roughness_texture.unwrap();
    let texture = scene.textures[color.texture as usize];
    assert!(texture.srgb && !scene.textures[data.texture as usize].srgb && texture.nearest);
    assert_eq!(texture.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert_eq!((color.uv_set, data.uv_set), (1, 0));
    // The extension's own example: the lower left quadrant of the image, u in [0, ½], v in [½, 1].
    for (uv, expected) in [
        ((0., 0.), (0., 1.)),
        ((1., 0.), (0., 0.5)),
        ((0., 1.), (0.5, 1.)),
    ] {
        let uv = Vec3::new(uv.0, uv.1, 1.0);
        let found = Vec2::from(color.transform.map(|row| row.dot(uv)));
        assert!(found.abs_diff_eq(expected.into(), 1e-6), "{uv}: {found}");
    }
    // TEXCOORD_1 is not there.
    assert_eq!(scene.warnings.len(), 1);
    assert!(
        scene.warnings[0].contains("TEXCOORD_1"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn tangents_follow_the_image_where_a_normal_map_needs_them() {
    let mut document = Document::square(false);
    let plain = document.load();
    assert!(plain.vertices.iter().all(|v| v.tangent_w == Vec4::ZERO));

    let view = document.view(&png([128, 128, 255, 255]));
    document.json["images"] = json!([{"bufferView": view}]);
    document.json["textures"] = json!([{"source": 0}]);
    document.material(json!({"normalTexture": {"index": 0, "scale": 2}}));
    // An upright image: u is +x, and its green points up, +y = cross(n, t) · w.
    let scene = document.load();
    assert_eq!(scene.materials[0].normal_scale, 2.0);
    for vertex in &scene.vertices {
        assert!(near(vertex.tangent_w.truncate(), Vec3::X), "{vertex:?}");
        assert_eq!(vertex.tangent_w.w, 1.0);
    }
    // Mirrored: u is −x, +y stays, the front is still +z.
    document.json["nodes"][0]["scale"] = json!([-1, 1, 1]);
    for vertex in &document.load().vertices {
        assert!(near(vertex.tangent_w.truncate(), Vec3::NEG_X) && vertex.tangent_w.w == -1.0);
        assert_eq!(vertex.normal_w, Vec3::Z);
    }
    // Those of the file, where it has them.
    document.json["nodes"] = json!([{"mesh": 0}]);
    document.attribute("TANGENT", &[[0., 2., 0., -1.]; 4]);
    for vertex in &document.load().vertices {
        assert_eq!(vertex.tangent_w, Vec4::new(0., 1., 0., -1.));
    }
}

#[test]
fn a_fan_of_many_triangles_gets_tangents() {
    let mut document = Document::new();
    let rim = 300_000;
    let mut positions = vec![[0f32, 0., 0.]];
    positions.extend((0..rim).map(|i| {
        let angle = i as f32 / rim as f32 * 6.0;
        [angle.cos(), angle.sin(), 0.]
    }));
    let uvs: Vec<[f32; 2]> = positions.iter().map(|p| [p[0], -p[1]]).collect();
    document.attribute("POSITION", &positions);
    document.attribute("TEXCOORD_0", &uvs);
    document.attribute("NORMAL", &vec![[0., 0., 1.]; rim + 1]);
    document.primitive()["mode"] = json!(6);
    let view = document.view(&png([128, 128, 255, 255]));
    document.json["images"] = json!([{"bufferView": view}]);
    document.json["textures"] = json!([{"source": 0}]);
    document.material(json!({"normalTexture": {"index": 0}}));
    let scene = document.load();
    assert!(scene.triangles.len() > rim / 2);
    for triangle in &scene.triangles {
        let vertex = scene.vertices[triangle.vertices[0] as usize];
        assert!(vertex.tangent_w.truncate().dot(Vec3::X) > 0.9, "{vertex:?}");
        assert_eq!(vertex.tangent_w.w, 1.0);
    }
    assert!(scene.warnings[0].contains("MikkTSpace"));
}

#[test]
fn images_that_cannot_be_had_are_left_out_and_named() {
    for image in [
        json!({"uri": "absent.png"}),
        json!({"uri": "data:image/png;base64,AAAA"}),
        json!({}),
        json!({"uri": "../x.png"}),
        json!({"uri": "https://example.com/x.png"}),
    ] {
        let mut document = Document::square(true);
        document.json["images"] = json!([image]);
        document.json["textures"] = json!([{"source": 0}]);
        document.material(json!({"normalTexture": {"index": 0},
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
        let scene = document.load();
        assert_eq!(scene.materials[0].normal_texture, None);
        assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
        assert!(scene.warnings[0].starts_with("/images/0: "));
    }
}

#[test]
fn external_files_stay_in_the_folder() {
    let document = Document::triangle();
    let with = |uri: &str| {
        let mut json = document.json.clone();
        json["buffers"] = json!([{"byteLength": document.bytes.len(), "uri": uri}]);
        let text = json.to_string();
        load_files(&[
            ("scene.gltf", text.as_bytes()),
            ("my data.bin", &document.bytes),
        ])
    };
    let here = with("my%20data.bin").unwrap();
    assert_eq!(here.triangles.len(), 1);
    let data = format!(
        "data:application/octet-stream;base64,{}",
        base64(&document.bytes)
    );
    let inline = with(&data).unwrap();
    assert_eq!(inline.vertices, here.vertices);

    for uri in [
        "../my data.bin",
        "%2e%2e/x.bin",
        "a/../../x.bin",
        "/etc/hostname",
        "..\\x.bin",
        "\\x.bin",
        "C:\\x.bin",
        "file:///etc/hostname",
        "http://localhost:1/x.bin",
        "",
        "%00",
        "%FF",
        ".",
        "absent.bin",
        "data:,x",
        "data:;base64,@",
        "data:;base64,AAAA",
    ] {
        let fault = with(uri).expect_err(uri).to_string();
        assert!(fault.contains("scene.gltf: /buffers/0"), "{fault}");
    }
    assert!(
        with("../my data.bin")
            .unwrap_err()
            .to_string()
            .contains("out of the scene's folder")
    );
}

#[test]
fn the_hash_covers_external_files() {
    let mut document = Document::triangle();
    let hash = |document: &Document| {
        let mut json = document.json.clone();
        json["buffers"] = json!([{"byteLength": document.bytes.len(), "uri": "a.bin"}]);
        let text = json.to_string();
        let scene = load_files(&[("a.gltf", text.as_bytes()), ("a.bin", &document.bytes)]).unwrap();
        let expected = blake3::hash(&[text.as_bytes(), &document.bytes].concat());
        assert_eq!(scene.hash, *expected.as_bytes());
        scene.hash
    };
    let before = hash(&document);
    document.bytes[12] ^= 1;
    assert_ne!(hash(&document), before);
}

/// Every cut and many single-byte changes of a document with all kinds of data: any outcome, no
/// panic, and only finite numbers.
#[test]
fn no_damage_makes_it_panic() {
    let mut document = Document::square(true);
    let view = document.view(&png([128, 128, 255, 255]));
    document.json["images"] = json!([{"bufferView": view}]);
    document.json["textures"] = json!([{"source": 0}]);
    document.material(json!({"normalTexture": {"index": 0}}));
    document.lamp(json!({"type": "spot", "spot": {}}));
    let whole = document.glb();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.glb");
    let attempt = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        if let Ok(scene) = scene::load(&path) {
            for vertex in scene.triangles.iter().flat_map(|t| t.vertices) {
                let vertex = scene.vertices[vertex as usize];
                assert!(vertex.position_w.is_finite() && vertex.normal_w.is_finite());
                assert!(vertex.tangent_w.is_finite() && vertex.uv[0].is_finite());
            }
        }
    };
    for cut in 0..whole.len() {
        attempt(&whole[..cut]);
    }
    let mut state = 1u64;
    for _ in 0..5_000 {
        let mut bytes = whole.clone();
        for _ in 0..3 {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            let at = (state >> 33) as usize % bytes.len();
            bytes[at] = (state >> 24) as u8;
        }
        attempt(&bytes);
    }
}

/// The rows of the list of public scenes: file, triangles, punctual lights, cameras.
#[test]
fn shared_scenes_load_with_the_numbers_of_their_list() {
    let folder: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes");
    let Ok(list) = std::fs::read_to_string(folder.join("LICENSES.md")) else {
        println!("skipped: {} is absent", folder.display());
        return;
    };
    let mut scenes = 0;
    for row in list.lines() {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let [_, file, _, triangles, contents, ..] = cells[..] else {
            continue;
        };
        let path = folder.join(file);
        let (Ok(triangles), true) = (triangles.parse::<usize>(), path.is_file()) else {
            continue;
        };
        scenes += 1;
        let start = std::time::Instant::now();
        let result = scene::load(&path);
        let time = start.elapsed().as_millis();
        let scene = result.unwrap();
        println!(
            "{file}: {} of {triangles} triangles, {} vertices, {} lights, {} cameras ({contents}), {time} ms",
            scene.triangles.len(),
            scene.vertices.len(),
            scene.lights.len(),
            scene.cameras.len()
        );
        for warning in &scene.warnings {
            println!("    {warning}");
        }
        let contents: Vec<usize> = contents
            .split('/')
            .map(|n| n.trim().parse().unwrap())
            .collect();
        assert_eq!(scene.lights.len(), contents[1], "{file}");
        assert_eq!(scene.cameras.len(), contents[2].max(1), "{file}");
        assert!(scene.triangles.len() <= triangles, "{file}");
    }
    assert!(scenes > 50, "only {scenes} scenes of the list were found");
}
