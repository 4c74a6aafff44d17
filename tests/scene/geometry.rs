//! Vertices and triangles.

use glam::{Vec2, Vec3, Vec4};
use lightfall::scene::Material;
use serde_json::json;

use crate::document::{Document, corners, near};

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
fn every_sparse_element_is_found() {
    let mut document = Document::triangle();
    let indices = document.view(&[0, 1, 2]);
    let corners_w = [[4f32, 0., 0.], [5., 0., 0.], [4., 6., 0.]];
    let bytes: Vec<u8> = corners_w
        .iter()
        .flatten()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let values = document.view(&bytes);
    document.json["accessors"][0]["sparse"] = json!({"count": 3, "values": {"bufferView": values},
        "indices": {"bufferView": indices, "componentType": 5121}});
    assert_eq!(corners(&document.load(), 0).0, corners_w.map(Vec3::from));
}
