//! Faults: refused with their place, whatever the bytes.

use std::path::Path;

use lightfall::scene::{self};
use serde_json::{Value, json};

use crate::document::{Document, base64, load_files, png};

#[test]
fn bad_geometry_is_refused() {
    let mut document = Document::triangle();
    document.indices(&[0, 1, 3]);
    assert!(document.fault().contains("/meshes/0/primitives/0: index 3"));

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
    assert!(document.fault().contains("leave the bufferView"));

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
    // Lamps are flattened, each a light of its own.
    document.material(json!({"emissiveFactor": [1, 1, 1]}));
    let nodes: Vec<Value> = (0..10_000).map(|_| json!({"mesh": 0})).collect();
    document.json["nodes"] = json!(nodes);
    document.json["scenes"][0]["nodes"] = json!((0..10_000).collect::<Vec<_>>());
    assert!(document.fault().contains("too large for its file"));
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
        let place = match uri {
            "data:,x" | "data:;base64,AAAA" => "scene.gltf: /bufferViews/0",
            _ => "scene.gltf: /buffers/0/uri",
        };
        assert!(fault.contains(place), "{fault}");
    }
    assert!(
        with("../my data.bin")
            .unwrap_err()
            .to_string()
            .contains("out of the scene's folder")
    );
}

/// A link out of the folder, a link within it, a pipe, a folder.
#[cfg(unix)]
#[test]
fn links_and_pipes_are_no_way_out() {
    let (inside, outside) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let mut document = Document::triangle();
    let place = |name: &str| inside.path().join(name);
    for path in [outside.path().join("data.bin"), place("data.bin")] {
        std::fs::write(path, &document.bytes).unwrap();
    }
    let link = |to: &Path, name: &str| std::os::unix::fs::symlink(to, place(name)).unwrap();
    link("data.bin".as_ref(), "near");
    link(&outside.path().join("data.bin"), "far");
    link(outside.path(), "door");
    link("/dev/zero".as_ref(), "endless");
    std::fs::create_dir(place("folder")).unwrap();
    let made = std::process::Command::new("mkfifo")
        .arg(place("pipe"))
        .status();
    assert!(made.unwrap().success());
    let length = document.bytes.len();
    let mut load = |uri: &str| {
        document.json["buffers"] = json!([{"byteLength": length, "uri": uri}]);
        std::fs::write(place("scene.gltf"), document.json.to_string()).unwrap();
        scene::load(&place("scene.gltf")).map_err(|error| error.to_string())
    };
    assert_eq!(load("near").unwrap().triangles.len(), 1);
    for (uri, fault) in [
        ("far", "leads out of the scene's folder"),
        ("door/data.bin", "leads out of the scene's folder"),
        ("endless", "leads out of the scene's folder"),
        ("folder", "not a regular file"),
        ("pipe", "not a regular file"),
    ] {
        let error = load(uri).expect_err(uri);
        assert!(
            error.contains(fault) && error.contains("/buffers/0/uri"),
            "{uri}: {error}"
        );
    }
}

/// A million brackets end in a message, not on the stack.
#[test]
fn deep_json_is_refused() {
    let deep = "[".repeat(1_000_000);
    for text in [
        format!("{{\"extras\":{deep}"),
        format!("{{\"nodes\":{deep}"),
    ] {
        let fault = load_files(&[("scene.gltf", text.as_bytes())]).unwrap_err();
        assert!(fault.to_string().contains("recursion limit"), "{fault}");
    }
}

/// The header of an image claims what only the decoder would find to be untrue.
#[test]
fn an_image_of_a_claimed_size_is_not_allocated() {
    let mut bytes = png([1, 2, 3, 255]);
    // Width and height in the header, and the header's checksum.
    bytes[16..24].copy_from_slice(&[0, 0, 0x3f, 0xff, 0, 0, 0x3f, 0xff]);
    let crc = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    let mut document = Document::square(true);
    let view = document.view(&bytes);
    document.json["images"] = json!([{"bufferView": view}]);
    document.json["textures"] = json!([{"source": 0}]);
    document.material(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let scene = document.load();
    let warning = "16383 × 16383 texels are too many";
    assert!(
        scene.warnings.iter().any(|w| w.contains(warning)),
        "{:?}",
        scene.warnings
    );
}

/// Of PNG chunks.
fn crc32(bytes: &[u8]) -> u32 {
    let bit = |crc: u32, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), bit)
    })
}

/// A scene far from the origin keeps the detail that f32 could not hold there.
#[test]
fn a_far_scene_is_moved_to_the_origin() {
    let mut document = Document::triangle();
    document.json["accessors"][0]["min"] = json!([0, 0, 0]);
    document.json["accessors"][0]["max"] = json!([1, 1, 0]);
    let near = document.load();
    assert_eq!(near.origin, glam::DVec3::ZERO);
    document.json["nodes"][0]["translation"] = json!([100_000_000, 0, 0]);
    let far = document.load();
    assert_eq!(far.origin, glam::DVec3::new(100_000_000.5, 0.5, 0.0));
    for (far, near) in far.vertices.iter().zip(&near.vertices) {
        assert_eq!(far.position_w, near.position_w - glam::vec3(0.5, 0.5, 0.0));
    }
}

#[test]
fn glb_lengths_are_checked() {
    let whole = Document::triangle().glb();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.glb");
    let load = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        scene::load(&path)
    };
    let length = whole.len() as u32;
    for length in [0, 11, 12, 19, length - 1, length + 1, u32::MAX] {
        let mut bytes = whole.clone();
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
        let fault = load(&bytes).expect_err("must be refused").to_string();
        assert!(fault.contains("scene.glb: GLB: "), "{length}: {fault}");
    }
    // What follows the length is not part of the GLB.
    let scene = load(&[&whole[..], b"tail"].concat()).unwrap();
    assert_eq!(scene.path, path);
    assert_eq!(scene.triangles.len(), 1);
}

#[test]
fn references_and_names_are_checked_where_they_are_used() {
    type Damage = fn(&mut Value);
    let cases: [(&str, Damage); 7] = [
        ("/nodes/0/mesh: is 7, but the file has 1", |json| {
            json["nodes"][0]["mesh"] = json!(7)
        }),
        (
            "/meshes/0/primitives/0/attributes/POSITION: is 7,",
            |json| {
                json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(7);
            },
        ),
        ("/meshes/0/primitives/0/material: is 7,", |json| {
            json["meshes"][0]["primitives"][0]["material"] = json!(7);
        }),
        ("/meshes/0/primitives/0/mode: ", |json| {
            json["meshes"][0]["primitives"][0]["mode"] = json!(7);
        }),
        ("/accessors/0/bufferView: is 7,", |json| {
            json["accessors"][0]["bufferView"] = json!(7)
        }),
        ("/accessors/0/componentType: ", |json| {
            json["accessors"][0]["componentType"] = json!(5124);
        }),
        ("/bufferViews/0/buffer: is 7,", |json| {
            json["bufferViews"][0]["buffer"] = json!(7)
        }),
    ];
    for (expected, damage) in cases {
        let mut document = Document::triangle();
        damage(&mut document.json);
        let fault = document.fault();
        assert!(fault.contains(expected), "{fault}");
    }
}

#[test]
fn numbers_beyond_f32_do_no_harm() {
    let mut document = Document::square(true);
    let view = document.view(&png([1, 2, 3, 255]));
    document.json["images"] = json!([{"bufferView": view}]);
    document.json["textures"] = json!([{"source": 0}]);
    let transform = json!({"offset": [1e300, -1e300], "rotation": 1e300, "scale": [1e300, 0]});
    let info = json!({"index": 0, "extensions": {"KHR_texture_transform": transform}});
    document.material(json!({"normalTexture": info,
        "pbrMetallicRoughness": {"baseColorTexture": info, "baseColorFactor": [1e300, 0, 0, 1]}}));
    document.lamp(json!({"type": "point", "intensity": 1e300, "color": [0, 1, -1e300]}));
    let scene = document.load();
    let material = &scene.materials[0];
    assert_eq!(material.base_color.x, 1.0);
    // The crate types this extension in one of the two only.
    let (color, normal) = (material.base_color_texture, material.normal_texture);
    assert_eq!(color.unwrap().transform, normal.unwrap().transform);
    assert!(color.unwrap().transform.iter().all(|row| row.is_finite()));
    let lightfall::scene::Light::Point { intensity, .. } = scene.lights[0] else {
        panic!()
    };
    assert_eq!(intensity, glam::Vec3::new(0., 1e20, 0.));
    document.json["nodes"][0]["scale"] = json!([1e300, 1, 1]);
    assert!(document.fault().contains("/nodes/0: "));
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

/// Many cuts and many single-byte changes of a document with all kinds of data: any outcome, no
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
    for cut in (0..whole.len()).step_by(3) {
        attempt(&whole[..cut]);
    }
    let mut state = 1u64;
    for _ in 0..2_000 {
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
