//! Meshes that are shown often are stored once; what does not fit that is flattened.

use crate::document::Document;
use lightfall::scene::Scene;
use serde_json::{Value, json};

/// Squares along each side of the grid below.
const SIDE: u16 = 110;
const TRIANGLES: usize = 2 * SIDE as usize * SIDE as usize;

/// A bumpy grid in the first primitive, a lamp of one triangle in the second.
fn document() -> Document {
    let mut document = Document::new();
    let points = (0..=SIDE).flat_map(|y| (0..=SIDE).map(move |x| (f32::from(x), f32::from(y))));
    let points: Vec<_> = points
        .map(|(x, y)| [x * 0.01 + 3.0, y * 0.02, (x * 0.3).sin() * 0.1])
        .collect();
    document.attribute("POSITION", &points);
    let mut indices = Vec::new();
    for i in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| y * (SIDE + 1) + x)) {
        let above = i + SIDE + 1;
        indices.extend([i, i + 1, above, above, i + 1, above + 1]);
    }
    document.indices(&indices);
    let lamp = document.push("materials", json!({"emissiveFactor": [1, 1, 1]}));
    let corners = document.floats(&[[0f32, 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
    let primitive = json!({"attributes": {"POSITION": corners}, "material": lamp});
    let primitives = document.json["meshes"][0]["primitives"].as_array_mut();
    primitives.unwrap().push(primitive);
    document
}

/// All of these nodes show the mesh; or each shows a mesh of its own, which is the same.
fn load(nodes: &[Value], shared: bool) -> Scene {
    let mut document = document();
    let mesh = document.json["meshes"][0].clone();
    let mut numbered = nodes.to_vec();
    for (i, node) in numbered.iter_mut().enumerate() {
        node["mesh"] = json!(if shared { 0 } else { i });
    }
    document.json["scenes"][0]["nodes"] = json!((0..nodes.len()).collect::<Vec<_>>());
    document.json["nodes"] = json!(numbered);
    if !shared {
        document.json["meshes"] = json!(vec![mesh; nodes.len()]);
    }
    document.load()
}

#[test]
fn a_mesh_that_is_shown_often_is_stored_once() {
    let place = |i: usize, mirror: f32| {
        let half = 0.3 * i as f32;
        json!({
            "translation": [i, -2 * i as i32, 7],
            "rotation": [0, half.sin(), 0, half.cos()],
            "scale": [mirror, 1.0 + 0.2 * i as f32, 0.5],
        })
    };
    let plain = (0..12).map(|i| place(i, 1.0));
    let mirrored = (0..12).map(|i| place(i, -2.0));
    let odd = [
        json!({"scale": [1, 1, 0]}),
        json!({"scale": [1, 40, 1]}),
        json!({"scale": [1e4, 1e4, 1e4]}),
    ];
    let nodes: Vec<Value> = plain.chain(mirrored).chain(odd).collect();
    let [stored, flat] = [true, false].map(|shared| load(&nodes, shared));
    assert_eq!(flat.meshes.len(), 0);
    assert_eq!(stored.meshes.len(), 2);
    // The odd ones, and lamps wherever they are.
    let lamps = nodes.len();
    assert_eq!(stored.triangles.len(), 3 * TRIANGLES + lamps);
    assert_eq!(flat.triangles.len(), nodes.len() * TRIANGLES + lamps);

    let mut i = 0;
    for (mesh, count) in stored.meshes.iter().zip([12, 12]) {
        assert_eq!(mesh.triangles.len(), TRIANGLES);
        assert_eq!(mesh.places.len(), count);
        for place in &mesh.places {
            assert!(place.matrix3.determinant() > 0.0);
            let normals = glam::Mat3::from(place.matrix3).inverse().transpose();
            // In the order of the nodes: the grid, then its lamp.
            let there = &flat.triangles[i * (TRIANGLES + 1)..][..TRIANGLES];
            for (here, there) in mesh.triangles.iter().zip(there).step_by(97) {
                for (here, there) in here.vertices.into_iter().zip(there.vertices) {
                    let (a, b) = (mesh.vertices[here as usize], flat.vertices[there as usize]);
                    let off = place.transform_point3(a.position_w) - b.position_w;
                    assert!(off.length() < 1e-5 * b.position_w.length(), "{off}");
                    let off = (normals * a.normal_w).normalize() - b.normal_w;
                    assert!(off.length() < 1e-5, "{off}");
                }
            }
            i += 1;
        }
    }
    let [a, b] = [&stored, &flat].map(Scene::bounds);
    let size = b.1 - b.0;
    assert!(a.0.cmple(b.0 + 1e-5 * size).all() && a.1.cmpge(b.1 - 1e-5 * size).all());
}

#[test]
fn a_mesh_that_is_shown_seldom_is_flattened() {
    let nodes = vec![json!({}); 9];
    let scene = load(&nodes, true);
    assert_eq!(scene.meshes.len(), 0);
    assert_eq!(scene.triangles.len(), 9 * (TRIANGLES + 1));
}
