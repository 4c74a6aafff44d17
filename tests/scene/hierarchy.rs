//! Nodes, scenes, cameras and lights.

use glam::Vec3;
use lightfall::scene::{Light, Projection};
use serde_json::{Value, json};

use crate::document::{Document, corners, load_files, near};

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

/// As an offset of all that there is, cameras and lights included.
#[test]
fn a_model_stands_where_cesium_rtc_says() {
    let mut document = Document::triangle();
    document.lamp(json!({"type": "point"}));
    document.json["extensionsRequired"] = json!(["CESIUM_RTC"]);
    document.json["extensions"]["CESIUM_RTC"] = json!({"center": [10, -20.5, 30]});
    let scene = document.load();
    assert_eq!(scene.warnings, [] as [String; 0]);
    let (low, _) = scene.bounds();
    let center = Vec3::new(10., -20.5, 30.);
    assert!(near(low, center), "{low}");
    let Light::Point { position_w, .. } = scene.lights[0] else {
        panic!()
    };
    assert!(near(position_w, center), "{position_w}");
    for center in [json!([1, 2]), json!(["x", 0, 0]), json!(null)] {
        document.json["extensions"]["CESIUM_RTC"]["center"] = center;
        assert!(
            document
                .fault()
                .contains("/extensions/CESIUM_RTC/center: must be")
        );
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
    // A scene may lack nodes: here nobody asks for it.
    document.json["scenes"][0] = json!({"name": "empty"});
    assert_eq!(document.load().bounds().0.z, 5.0);
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
    let Projection::Perspective { yfov } = camera.projection else {
        panic!()
    };
    assert!((yfov.to_degrees() - 45.0).abs() < 1e-4);
    let camera_from_world = camera.world_from_camera.inverse();
    let (low, high) = scene.bounds();
    let limit = (yfov / 2.0).tan();
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
        {"type": "orthographic", "orthographic": {"xmag": 3, "ymag": -2, "zfar": 1, "znear": 0}},
    ]);
    document.json["nodes"] = json!([{"mesh": 0}, {"camera": 1},
        {"scale": [-3, 2, 5], "children": [3]}, {"camera": 0, "name": "eye", "translation": [1, 0, 0]}]);
    document.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    let scene = document.load();
    let bytes = document.bytes.clone();
    let [flat, camera] = &scene.cameras[..] else {
        panic!()
    };
    assert_eq!(
        (flat.projection, flat.aspect),
        (Projection::Orthographic { ymag: 2.0 }, Some(1.5))
    );
    assert_eq!(
        (camera.name.as_str(), camera.projection, camera.aspect),
        ("eye", Projection::Perspective { yfov: 0.8 }, Some(1.5))
    );
    let m = camera.world_from_camera;
    assert!((m.determinant() - 1.0).abs() < 1e-5);
    assert!(near(m.z_axis.truncate(), Vec3::Z) && near(m.y_axis.truncate(), Vec3::Y));
    assert!(near(m.w_axis.truncate(), Vec3::new(-3., 0., 0.)));
    assert_eq!(scene.warnings.len(), 1);
    assert!(scene.warnings[0].starts_with("/cameras/1/orthographic/ymag: "));

    for lens in [
        json!({"xmag": 0, "ymag": 1, "zfar": 1, "znear": 0}),
        json!({"xmag": 1, "ymag": 1e30, "zfar": 1, "znear": 0}),
    ] {
        let mut document = document.json.clone();
        document["cameras"][1]["orthographic"] = lens;
        let fault = Document {
            json: document,
            bytes: bytes.clone(),
        }
        .fault();
        assert!(
            fault.contains("/cameras/1/orthographic/") && fault.contains("mag: "),
            "{fault}"
        );
    }
    for lens in [
        json!({"yfov": 0, "znear": 1}),
        json!({"yfov": 4, "znear": 1}),
        json!({"znear": 1}),
        json!({"yfov": 1, "znear": 1, "aspectRatio": -1}),
    ] {
        document.json["cameras"][0]["perspective"] = lens;
        let fault = document.fault();
        assert!(fault.contains("/cameras/0/perspective"), "{fault}");
        assert!(
            fault.contains("yfov") || fault.contains("aspectRatio"),
            "{fault}"
        );
    }
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
    let rounded = std::f64::consts::FRAC_PI_2 + 4e-6;
    let narrow = json!({"innerConeAngle": rounded - 1e-9, "outerConeAngle": rounded});
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
fn instances_stand_where_their_attributes_say() {
    let mut document = Document::triangle();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let translation = document.floats(&[[0f32, 0., 5.], [1., 0., 0.], [9., 9., 9.]]);
    // 90° about x, as normalized integers.
    let view = document.view(
        &[0i16, 0, 0, 32767, 23170, 0, 0, 23170, 0, 0, 0, 32767]
            .map(i16::to_le_bytes)
            .concat(),
    );
    let rotation = document.push(
        "accessors",
        json!({"bufferView": view, "componentType": 5122, "normalized": true, "count": 3, "type": "VEC4"}),
    );
    let scale = document.floats(&[[1f32, 1., 1.], [2., 2., -2.], [0., 0., 0.]]);
    let two = document.floats(&[[1f32; 3]; 2]);
    document.json["nodes"][0]["translation"] = json!([0, 10, 0]);
    document.json["nodes"][0]["rotation"] = json!([0, half, 0, half]);
    let attributes = json!({"TRANSLATION": translation, "ROTATION": rotation, "SCALE": scale});
    document.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
    document.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let scene = document.load();
    assert_eq!(
        scene.triangles.len(),
        2,
        "one instance is scaled to nothing"
    );
    // The node turns x to −z and z to x.
    let (corners_0, normal) = corners(&scene, 0);
    assert!(
        near(corners_0[0], Vec3::new(5., 10., 0.)) && near(corners_0[1], Vec3::new(5., 10., -1.))
    );
    assert!(near(normal, Vec3::X));
    // The second turns y to z and mirrors: its face turns round with it.
    let (corners_1, normal) = corners(&scene, 1);
    let expected = [[0., 10., -1.], [0., 10., -3.], [2., 10., -1.]].map(Vec3::from);
    for expected in expected {
        let off = |p: &Vec3| p.distance(expected) < 1e-3;
        assert!(
            corners_1.iter().any(off),
            "{expected} is not in {corners_1:?}"
        );
    }
    let vertex = scene.vertices[scene.triangles[1].vertices[0] as usize];
    assert!(vertex.normal_w.dot(normal) > 0.999, "{vertex:?}, {normal}");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);

    for (key, accessor, words) in [
        ("SCALE", json!(two), "different counts"),
        ("SCALE", json!(rotation), "does not allow"),
        ("ROTATION", json!(-1), "must be an index"),
        ("TRANSLATION", json!(99), "is 99"),
    ] {
        let mut document = Document {
            json: document.json.clone(),
            bytes: document.bytes.clone(),
        };
        document.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"][key] =
            accessor;
        let fault = document.fault();
        let path = "/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes";
        assert!(fault.contains(path) && fault.contains(words), "{fault}");
    }
}

#[test]
fn what_is_not_visible_is_left_out_with_its_children() {
    let mut document = Document::triangle();
    let hidden = json!({"KHR_node_visibility": {"visible": false}});
    document.json["nodes"] = json!([{"mesh": 0}, {"extensions": hidden, "mesh": 0, "children": [2]},
        {"mesh": 0}, {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": true}}}]);
    document.json["scenes"][0]["nodes"] = json!([0, 1, 3]);
    assert_eq!(document.load().triangles.len(), 2);
}
