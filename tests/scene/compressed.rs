//! Compressed files against what the reference decoders make of them. Encoders and decoders are
//! those of npm: fixtures/make.mjs.

use std::path::{Path, PathBuf};

use lightfall::scene::{self, Image, Scene, Vertex};
use serde_json::json;

use crate::document::{Document, load_files, near};

fn fixture(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scene/fixtures");
    folder.join(name)
}

pub fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(fixture(name)).unwrap()
}

fn load(name: &str) -> Scene {
    scene::load(&fixture(name)).unwrap()
}

/// The corners of triangle `i`.
fn triangle(scene: &Scene, i: usize) -> [Vertex; 3] {
    let corners = scene.triangles[i].vertices;
    corners.map(|i| scene.vertices[i as usize])
}

const TORUS: usize = 192;

#[test]
fn streams_of_meshopt_are_what_the_reference_makes_of_them() {
    for (name, exact) in [
        ("meshopt-ext", 2 * TORUS),
        ("meshopt-khr", 2 * TORUS),
        ("gltfpack", TORUS),
    ] {
        let found = load(&format!("{name}.glb"));
        let expected = load(&format!("{name}.plain.glb"));
        assert_eq!(found.warnings, expected.warnings, "{name}");
        let triangles = expected.triangles.len();
        assert_eq!(found.triangles.len(), triangles, "{name}");
        for i in 0..triangles {
            let (found, expected) = (triangle(&found, i), triangle(&expected, i));
            if i < exact {
                assert_eq!(found, expected, "{name}, triangle {i}");
            }
            // The rest stands as quaternions have it, which decoders are free to round.
            for (found, expected) in found.iter().zip(&expected) {
                assert!(
                    found.position_w.abs_diff_eq(expected.position_w, 1e-3),
                    "{name}"
                );
            }
        }
        assert!(triangles >= exact, "{name}");
    }
}

#[test]
fn streams_of_draco_are_what_the_reference_makes_of_them() {
    for method in ["edgebreaker", "sequential"] {
        let found = load(&format!("draco-{method}.glb"));
        let expected = load(&format!("draco-{method}.plain.glb"));
        assert_eq!(found.warnings, [] as [String; 0], "{method}");
        assert_eq!(found.triangles, expected.triangles, "{method}");
        assert_eq!(found.vertices, expected.vertices, "{method}");
        assert_eq!(found.triangles.len(), TORUS, "{method}");
    }
}

/// The Draco stream holds the attributes that it names: others lie beside it, and sparse values
/// replace what it holds.
#[test]
fn attributes_beside_a_draco_stream_are_read() {
    let (mut json, bin) = crate::document::parts(&bytes("draco-sequential.glb"));
    let plain = load("draco-sequential.plain.glb");
    let primitive = &mut json["meshes"][0]["primitives"][0];
    let position = primitive["attributes"]["POSITION"].as_u64().unwrap() as usize;
    let count = json["accessors"][position]["count"].as_u64().unwrap() as usize;
    let mut document = Document { json, bytes: bin };
    let uvs: Vec<[f32; 2]> = (0..count).map(|i| [i as f32, 0.5]).collect();
    document.attribute("TEXCOORD_1", &uvs);
    let indices = document.view(&[0, 0, 2, 0]);
    let values = document.view(&[7f32, 8., 9., 7., 8., 9.].map(f32::to_le_bytes).concat());
    document.json["accessors"][position]["sparse"] = json!({"count": 2,
        "indices": {"bufferView": indices, "componentType": 5123},
        "values": {"bufferView": values}});
    let scene = document.load();
    let is_replaced = |v: &&Vertex| v.position_w.to_array() == [7., 8., 9.];
    let replaced = scene.vertices.iter().filter(is_replaced);
    let mut replaced: Vec<f32> = replaced.map(|v| v.uv[1].x).collect();
    replaced.sort_by(f32::total_cmp);
    replaced.dedup();
    assert_eq!(replaced, [0., 2.]);
    // The sequential encoder keeps the order of the vertices.
    let order: Vec<f32> = scene.vertices.iter().map(|v| v.uv[1].x).collect();
    let mut sorted = order.clone();
    sorted.sort_by(f32::total_cmp);
    sorted.dedup();
    assert_eq!(sorted.len(), plain.vertices.len());
    assert!(scene.vertices.iter().all(|v| v.uv[1].y == 0.5));
}

/// A square with `file` as an image of the kind that `extension` names.
pub fn textured(file: &[u8], extension: &str) -> Document {
    let mut document = Document::square(true);
    let view = document.view(file);
    document.json["images"] = json!([{"bufferView": view}]);
    document.json["extensionsRequired"] = json!([extension]);
    document.json["textures"] = json!([{"extensions": {extension: {"source": 0}}}]);
    document.material(json!({"emissiveTexture": {"index": 0}}));
    document
}

fn read_png(name: &str) -> Vec<u8> {
    let image = image::open(fixture(name)).unwrap();
    image.into_rgba8().into_raw()
}

#[test]
fn textures_of_basis_universal_are_what_the_reference_makes_of_them() {
    for name in ["etc1s", "uastc", "uastc-raw"] {
        let file = bytes(&format!("{name}.ktx2"));
        let scene = textured(&file, "KHR_texture_basisu").load();
        assert_eq!(scene.warnings, [] as [String; 0], "{name}");
        let Image {
            width,
            height,
            rgba,
        } = &scene.images[0];
        assert_eq!((*width, *height), (18, 11), "{name}");
        assert_eq!(*rgba, read_png(&format!("{name}.png")), "{name}");
    }
}

#[test]
fn textures_of_direct3d_are_what_the_reference_makes_of_them() {
    for name in ["bc1", "bc3", "bc4", "bc5", "bc7"] {
        let file = bytes(&format!("{name}.dds"));
        let scene = textured(&file, "MSFT_texture_dds").load();
        assert_eq!(scene.warnings, [] as [String; 0], "{name}");
        let found = &scene.images[0];
        assert_eq!((found.width, found.height), (18, 11), "{name}");
        let expected = read_png(&format!("{name}.png"));
        // The reference shows BC4 as red and BC5 as red and green.
        let channels = match name {
            "bc4" => 1,
            "bc5" => 2,
            _ => 4,
        };
        // Of BC7 every bit is laid down; others may be rounded either way.
        let most = if name == "bc7" { 0 } else { 1 };
        for (found, expected) in found.rgba.chunks(4).zip(expected.chunks(4)) {
            for (found, expected) in found.iter().zip(expected).take(channels) {
                assert!(found.abs_diff(*expected) <= most, "{name}");
            }
        }
        let [r, g, b, _] = found.rgba[..4] else {
            panic!()
        };
        if name == "bc4" {
            assert_eq!([r, r], [g, b], "grey");
        } else if name == "bc5" {
            let [x, y, z] = [r, g, b].map(|c| f32::from(c) / 127.5 - 1.0);
            let length = x * x + y * y + z * z;
            assert!(z >= 0.0 && (length - 1.0).abs() < 0.02 || x * x + y * y > 1.0);
        }
    }
}

/// DDS without blocks: blue comes first, and 3 bytes a texel are not padded.
#[test]
fn plain_direct3d_textures_are_read() {
    let file = |bits: u32, alpha: u32, texels: &[u8]| {
        let mut words = [0u32; 32];
        words[0] = u32::from_le_bytes(*b"DDS ");
        words[1..5].copy_from_slice(&[124, 0x100f, 1, 2]);
        words[19..21].copy_from_slice(&[32, if alpha == 0 { 0x40 } else { 0x41 }]);
        words[22..27].copy_from_slice(&[bits, 0xff0000, 0xff00, 0xff, alpha]);
        words[27] = 0x1000;
        let header = words.iter().flat_map(|word| word.to_le_bytes());
        header.chain(texels.iter().copied()).collect::<Vec<u8>>()
    };
    let four = file(32, 0xff000000, &[1, 2, 3, 4, 5, 6, 7, 8]);
    let three = file(24, 0, &[1, 2, 3, 5, 6, 7]);
    for (file, expected) in [
        (&four, [3, 2, 1, 4, 7, 6, 5, 8]),
        (&three, [3, 2, 1, 255, 7, 6, 5, 255]),
    ] {
        let scene = textured(file, "MSFT_texture_dds").load();
        assert_eq!(scene.images[0].rgba, expected, "{:?}", scene.warnings);
    }
    let short = &four[..four.len() - 1];
    let warnings = textured(short, "MSFT_texture_dds").load().warnings;
    assert!(
        warnings[0].contains("ends before its texels"),
        "{warnings:?}"
    );
}

/// KTX2 without Basis Universal, which the extension forbids and other viewers read.
#[test]
fn plain_ktx2_textures_are_read() {
    let file = |format: u32, scheme: u32, level: &[u8], size: u64| {
        let mut file = bytes("uastc.ktx2")[..12].to_vec();
        let words = [format, 1, 2, 1, 0, 0, 1, 1, scheme, 0, 0, 0, 0, 0, 0, 0, 0];
        file.extend(words.map(u32::to_le_bytes).concat());
        file.extend(
            [104, level.len() as u64, size]
                .map(u64::to_le_bytes)
                .concat(),
        );
        [&file, level].concat()
    };
    let rgb = [1, 2, 3, 5, 6, 7];
    // A frame of one block that is not compressed (RFC 8878, section 3.1.1).
    let frame = [
        &[0x28, 0xb5, 0x2f, 0xfd, 0x20, 6, 6 << 3 | 1, 0, 0],
        &rgb[..],
    ]
    .concat();
    for file in [file(23, 0, &rgb, 6), file(29, 2, &frame, 6)] {
        let scene = textured(&file, "KHR_texture_basisu").load();
        assert_eq!(scene.warnings, [] as [String; 0]);
        assert_eq!(scene.images[0].rgba, [1, 2, 3, 255, 5, 6, 7, 255]);
    }
    for (file, fault) in [
        (file(23, 0, &rgb[1..], 6), "ends before its texels"),
        (file(29, 2, &frame[..12], 6), "Zstandard"),
        (file(37, 2, &frame, 8), "Zstandard"),
        (file(23, 3, &rgb, 6), "scheme 3"),
        (
            file(97, 0, &rgb, 6),
            "npx @gltf-transform/cli ktxdecompress",
        ),
    ] {
        let warnings = textured(&file, "KHR_texture_basisu").load().warnings;
        assert!(warnings[0].contains(fault), "{warnings:?}");
    }
}

/// Where the file has the data once more for those that cannot decode, a broken stream costs
/// nothing but a warning; where it has not, the file is refused with the place.
#[test]
fn what_cannot_be_decoded_has_its_fallback_or_is_refused() {
    let plain = load("fallback.glb");
    assert_eq!(plain.warnings, [] as [String; 0]);
    let breaking = |name: &str| {
        let mut file = bytes(name);
        let json = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
        file[20 + json + 8] ^= 0xff;
        file
    };
    let fallback = bytes("fallback.fallback.bin");
    let file = breaking("fallback.glb");
    let read = load_files(&[("a.glb", &file), ("fallback.fallback.bin", &fallback)]).unwrap();
    assert_eq!(read.warnings.len(), 1, "{:?}", read.warnings);
    assert!(
        read.warnings[0].contains("not decoded: "),
        "{:?}",
        read.warnings
    );
    assert_eq!(read.triangles.len(), TORUS);
    for i in 0..TORUS {
        let (found, expected) = (triangle(&read, i), triangle(&plain, i));
        assert!(
            found
                .iter()
                .zip(&expected)
                .all(|(a, b)| near(a.position_w, b.position_w))
        );
    }
    // It may be absent, as long as nothing is broken; with or without a name.
    let alone = load_files(&[("a.glb", &bytes("fallback.glb"))]).unwrap();
    assert_eq!(alone.triangles, plain.triangles);
    let (mut json, bin) = crate::document::parts(&bytes("meshopt-ext.glb"));
    json["buffers"][1]
        .as_object_mut()
        .unwrap()
        .remove("extensions");
    json["buffers"][0]["uri"] = json!("a.bin");
    let text = json.to_string();
    let nameless = load_files(&[("a.gltf", text.as_bytes()), ("a.bin", &bin)]).unwrap();
    assert_eq!(nameless.triangles, load("meshopt-ext.glb").triangles);
    for (name, place) in [
        ("fallback.glb", "/bufferViews/0: meshopt: "),
        ("meshopt-ext.glb", "/bufferViews/0: meshopt: "),
        (
            "draco-edgebreaker.glb",
            "/meshes/0/primitives/0/extensions/KHR_draco",
        ),
    ] {
        let fault = load_files(&[("a.glb", &breaking(name))])
            .unwrap_err()
            .to_string();
        assert!(fault.contains(place), "{fault}");
    }
}

/// A texture that cannot be decoded has the texture's own image for that.
#[test]
fn textures_have_their_fallback() {
    let file = bytes("etc1s.ktx2");
    let mut document = textured(&file[..file.len() / 2], "KHR_texture_basisu");
    let warnings = document.load().warnings;
    assert!(
        warnings[0].starts_with("/images/0: texture left out: KTX2: "),
        "{warnings:?}"
    );
    let view = document.view(&bytes("etc1s.png"));
    document.push("images", json!({"bufferView": view}));
    document.json["textures"][0]["source"] = json!(1);
    let scene = document.load();
    assert_eq!((scene.images.len(), scene.textures.len()), (1, 1));
    assert_eq!(scene.images[0].rgba, read_png("etc1s.png"));
}

/// A small file that claims a lot is refused before anything is allocated.
#[test]
fn decoders_are_asked_for_no_more_than_a_file_can_hold() {
    let mut document = Document::triangle();
    let stream = document.view(&[0xa0; 64]);
    let stream = document.json["bufferViews"][stream].clone();
    let mut claim = |count: u64| {
        document.json["bufferViews"][0] = json!({
            "buffer": 0, "byteLength": count * 12, "byteStride": 12,
            "extensions": {"EXT_meshopt_compression": {
                "buffer": 0, "byteOffset": stream["byteOffset"], "byteLength": 64,
                "byteStride": 12, "count": count, "mode": "ATTRIBUTES"}}});
        document.fault()
    };
    for count in [100_000_000, u64::MAX / 12, u64::MAX] {
        let fault = claim(count);
        assert!(fault.contains("more than 64 bytes can hold"), "{fault}");
    }
    let mut huge = bytes("uastc.ktx2");
    huge[96..104].copy_from_slice(&u64::MAX.to_le_bytes());
    let warnings = textured(&huge, "KHR_texture_basisu").load().warnings;
    assert!(warnings[0].contains("is too large"), "{warnings:?}");
    for (name, at) in [("uastc.ktx2", 20), ("bc7.dds", 12)] {
        let mut huge = bytes(name);
        huge[at..at + 4].copy_from_slice(&16_385u32.to_le_bytes());
        let warnings = textured(&huge, "KHR_texture_basisu").load().warnings;
        assert!(warnings[0].contains("texels are too many"), "{warnings:?}");
    }
}
