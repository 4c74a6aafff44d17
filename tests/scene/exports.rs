//! What exporters write although glTF forbids it, and other viewers read: read with a warning that
//! names it, and refused by `strict`.

use std::path::Path;

use lightfall::scene::{self, LoadOptions, Scene};
use serde_json::{Value, json};

use crate::document::{Document, base64, load_files, near};

/// A way in which a file breaks a rule: what the warning says, the file.
fn breaches() -> Vec<(&'static str, Vec<u8>)> {
    let mut all = Vec::new();
    let mut document = Document::triangle();
    document.bytes.splice(0..0, [0; 2]);
    document.json["bufferViews"][0]["byteOffset"] = json!(2);
    all.push(("not aligned to its components of 4", document.glb()));

    for more in [&[0][..], &[0, 1]] {
        let mut document = Document::triangle();
        document.indices(&[&[0, 1, 2], more].concat());
        all.push(("the last indices are no whole triangle", document.glb()));
    }
    let mut document = Document::triangle();
    document.json["bufferViews"][0]["byteStride"] = json!(0);
    all.push(("byteStride is 0", document.glb()));

    let mut document = Document::triangle();
    document.attribute("NORMAL", &[[0., 0., -1.]; 3]);
    all.push(("NORMALs point away from their faces", document.glb()));

    let mut document = Document::triangle();
    document
        .bytes
        .extend([f32::NAN; 9].map(f32::to_le_bytes).concat());
    document.json["bufferViews"][0]["byteLength"] = json!(72);
    document.json["accessors"][0]["count"] = json!(6);
    all.push(("a POSITION is infinite or no number", document.glb()));

    let whole = Document::triangle().glb();
    let length = u32::from_le_bytes(whole[12..16].try_into().unwrap()) as usize;
    let mut nul = whole.clone();
    nul.splice(20 + length..20 + length, [0; 4]);
    nul[8..12].copy_from_slice(&(whole.len() as u32 + 4).to_le_bytes());
    nul[12..16].copy_from_slice(&(length as u32 + 4).to_le_bytes());
    all.push(("is padded with NUL", nul));

    let text = with_uri(&data_uri("data:"));
    all.push(("byte order mark", [b"\xef\xbb\xbf", &text[..]].concat()));
    let text = String::from_utf8(text).unwrap();
    let named = text.replacen('{', "{\"extras\": \"\u{1}\",", 1);
    let latin: Vec<u8> = named
        .bytes()
        .map(|b| if b == 1 { 0xe4 } else { b })
        .collect();
    all.push(("is not UTF-8", latin));

    let mut short: Value = serde_json::from_str(&text).unwrap();
    short["buffers"][0]["byteLength"] = json!(38);
    all.push(("fewer bytes than its byteLength", short.to_string().into()));
    short["buffers"][0]["byteLength"] = json!(35);
    all.push(("leaves the byteLength", short.to_string().into()));

    let whole = padded();
    let lines: Vec<String> = whole
        .as_bytes()
        .chunks(20)
        .map(String::from_utf8_lossy)
        .map(Into::into)
        .collect();
    let encoded = whole
        .replace('+', "%2B")
        .replace('/', "%2F")
        .replace('A', "%41");
    for (what, uri) in [
        ("does not begin with data:", data_uri("DATA:")),
        (
            "white space in its base64",
            data_uri("data:").replace(&whole, &lines.join("\r\n")),
        ),
        (
            "percent-encoded base64",
            data_uri("data:").replace(&whole, &encoded),
        ),
        (
            "not padded",
            data_uri("data:").replace(&whole, &whole[..whole.len() - 1]),
        ),
    ] {
        all.push((what, with_uri(&uri)));
    }
    all
}

/// One byte more than is needed, so that there is padding to leave out.
fn padded() -> String {
    base64(&[&Document::triangle().bytes[..], &[0xfb]].concat())
}

fn data_uri(scheme: &str) -> String {
    format!("{scheme}application/octet-stream;base64,{}", padded())
}

fn with_uri(uri: &str) -> Vec<u8> {
    let mut json = Document::triangle().json;
    json["buffers"] = json!([{"byteLength": 36, "uri": uri}]);
    json.to_string().into()
}

#[test]
fn what_exporters_write_is_read_with_a_warning_and_refused_where_asked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.gltf");
    for (what, bytes) in breaches() {
        std::fs::write(&path, &bytes).unwrap();
        let scene = scene::load(&path).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!(scene.triangles.len(), 1, "{what}");
        for vertex in scene.triangles[0].vertices {
            assert_eq!(scene.vertices[vertex as usize].normal_w.z, 1.0, "{what}");
        }
        let [warning] = &scene.warnings[..] else {
            panic!("{what}: {:?}", scene.warnings)
        };
        assert!(warning.contains(what), "{what}: {warning}");
        let strict = LoadOptions {
            strict: true,
            ..LoadOptions::default()
        };
        let error = scene::load_with(&path, &strict)
            .expect_err(what)
            .to_string();
        assert!(
            error.contains(what) && error.contains("--strict"),
            "{error}"
        );
    }
}

/// A hundred faults of a kind are one line, however long the URIs.
#[test]
fn faults_are_counted_and_data_uris_never_shown() {
    let mut document = Document::triangle();
    let primitive = document.primitive().clone();
    let primitives = vec![primitive; 100];
    document.json["meshes"][0]["primitives"] = json!(primitives);
    document.attribute(
        "POSITION",
        &[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]],
    );
    let accessor = document.primitive()["attributes"]["POSITION"].clone();
    for i in 0..100 {
        document.json["meshes"][0]["primitives"][i]["attributes"]["POSITION"] = accessor.clone();
    }
    let warnings = document.load().warnings;
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(
        warnings[0].ends_with("left out (and at 99 more places)"),
        "{}",
        warnings[0]
    );

    let long = "A".repeat(1_000_000);
    for uri in [
        format!("data:;base64,{long}@"),
        format!("DATA:;base64,{long}*"),
        format!("data:{long}"),
        format!("{long}.bin"),
        format!("x:{long}"),
        format!("../{long}"),
        format!("%FF{long}"),
    ] {
        let error = load_files(&[("scene.gltf", &with_uri(&uri))])
            .unwrap_err()
            .to_string();
        assert!(error.len() < 500, "{}", &error[..500]);
    }
    let mut json = Document::triangle().json;
    json["buffers"] = json!([{"byteLength": format!("data:{long}")}]);
    let error = load_files(&[("scene.gltf", json.to_string().as_bytes())]).unwrap_err();
    assert!(error.to_string().len() < 500);
}

/// The triangle with its buffer in the file that `uri` names, seen from `scene`.
fn write_scene(scene: &Path, uri: &str) {
    std::fs::create_dir_all(scene.parent().unwrap()).unwrap();
    std::fs::write(scene, with_uri(uri)).unwrap();
}

fn write_data(path: &Path) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, Document::triangle().bytes).unwrap();
}

fn within(root: &Path, scene: &Path) -> Result<Scene, String> {
    let options = LoadOptions {
        root: Some(root.into()),
        strict: false,
    };
    scene::load_with(scene, &options).map_err(|error| error.to_string())
}

#[test]
fn a_root_that_the_user_names_lets_paths_leave_the_folder() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let scene = at("p/models/scene.gltf");
    write_data(&at("p/data/a.bin"));
    write_data(&at("secret.bin"));
    write_scene(&scene, "../data/a.bin");
    let error = scene::load(&scene).unwrap_err().to_string();
    assert!(
        error.contains("/buffers/0/uri: ../data/a.bin: leads out of"),
        "{error}"
    );
    assert!(error.contains("--root DIR"), "{error}");
    let read = within(&at("p"), &scene).unwrap();
    assert_eq!(read.warnings, [] as [String; 0]);
    let mut files = read.files;
    files.sort();
    assert_eq!(
        files,
        [at("p/data/a.bin"), scene.clone()].map(|f| f.canonicalize().unwrap())
    );

    write_scene(&scene, "../../secret.bin");
    let error = within(&at("p"), &scene).unwrap_err();
    assert!(error.contains("of the one that --root names"), "{error}");
    assert!(
        within(&at("absent"), &scene)
            .unwrap_err()
            .contains("--root")
    );
}

/// Windows writes \; some exporters do not encode what they write, or encode it twice.
#[test]
fn file_names_are_found_as_other_viewers_find_them() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.gltf");
    for (file, uri, warned) in [
        ("tex/a b.bin", "tex/a%20b.bin", ""),
        ("tex/a b.bin", "tex/a b.bin", ""),
        ("tex/a b.bin", "./tex//a b.bin", ""),
        ("tex/a b.bin", "tex\\a b.bin", "\\ for /"),
        ("tex/a b.bin", "tex%5Ca%20b.bin", "\\ for /"),
        ("100%25.bin", "100%25.bin", "bare %"),
        ("50%.bin", "50%.bin", ""),
        ("ä#?.bin", "ä#?.bin", ""),
    ] {
        write_data(&folder.path().join(file));
        write_scene(&scene, uri);
        let read = scene::load(&scene).unwrap_or_else(|error| panic!("{uri}: {error}"));
        let said = read.warnings.join(" ");
        assert!(
            said.contains(warned) && said.is_empty() == warned.is_empty(),
            "{uri}: {said}"
        );
    }
}

/// Stores of git-annex, DVC, Bazel and Nix: every file is a link.
#[cfg(unix)]
#[test]
fn a_scene_of_links_is_read() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    write_data(&at("store/1/m.bin"));
    write_scene(&at("store/1/m.gltf"), "m.bin");
    std::fs::create_dir_all(at("p")).unwrap();
    symlink("../store/1/m.gltf", at("p/m.gltf")).unwrap();
    // What lies beside the file that the link leads to is found, by a link of its own or without.
    assert_eq!(scene::load(&at("p/m.gltf")).unwrap().triangles.len(), 1);
    symlink("../store/1/m.bin", at("p/m.bin")).unwrap();
    assert_eq!(scene::load(&at("p/m.gltf")).unwrap().triangles.len(), 1);
    let strict = LoadOptions {
        strict: true,
        ..LoadOptions::default()
    };
    let error = scene::load_with(&at("p/m.gltf"), &strict)
        .unwrap_err()
        .to_string();
    assert!(error.contains("leads out of the scene's folder"), "{error}");

    std::fs::create_dir_all(at("store/2")).unwrap();
    std::fs::rename(at("store/1/m.bin"), at("store/2/m.bin")).unwrap();
    std::fs::remove_file(at("p/m.bin")).unwrap();
    symlink("../store/2/m.bin", at("p/m.bin")).unwrap();
    let error = scene::load(&at("p/m.gltf")).unwrap_err().to_string();
    assert!(error.contains("--root DIR"), "{error}");
    assert_eq!(
        within(folder.path(), &at("p/m.gltf"))
            .unwrap()
            .triangles
            .len(),
        1
    );
}

/// A tetrahedron whose normals point out and whose triangles are wound inwards, beside a triangle
/// that is right and shares its vertices: each face has its normals on its side.
#[test]
fn normals_are_turned_to_the_side_of_their_face() {
    let corners = [[1., 1., 1.], [-1., -1., 1.], [-1., 1., -1.], [1., -1., -1.]];
    let outward = [[0, 1, 3], [0, 2, 1], [0, 3, 2], [1, 2, 3]].map(|[a, b, c]| [a, c, b]);
    let inward = outward.map(|[a, b, c]| [a, c, b]);
    let build = |faces: &[[u16; 3]]| {
        let mut document = Document::new();
        document.attribute("POSITION", &corners);
        document.attribute("NORMAL", &corners);
        document.indices(faces.as_flattened());
        document.load()
    };
    let right = build(&outward);
    let is_right = right.warnings.is_empty();
    let (right, wrong) = match is_right {
        true => (right, build(&inward)),
        false => (build(&inward), right),
    };
    assert!(right.warnings.is_empty(), "{:?}", right.warnings);
    assert_eq!(wrong.warnings.len(), 1, "{:?}", wrong.warnings);
    assert!(wrong.warnings[0].starts_with("/meshes/0: NORMALs point away"));
    assert_eq!(wrong.vertices.len(), 4, "turned in place");
    for wrong in &wrong.vertices {
        let right = right.vertices.iter();
        let mut same = right.filter(|right| right.position_w == wrong.position_w);
        assert!(near(wrong.normal_w, -same.next().unwrap().normal_w));
    }
    let all = if is_right {
        [&outward[..], &inward[..1]]
    } else {
        [&inward[..], &outward[..1]]
    };
    let both = build(&all.concat());
    assert_eq!(both.vertices.len(), 7, "three are seen from both sides");
    for (i, triangle) in both.triangles.iter().enumerate() {
        let (_, face) = crate::document::corners(&both, i);
        for vertex in triangle.vertices {
            assert!(both.vertices[vertex as usize].normal_w.dot(face) > 0.0);
        }
    }
}
