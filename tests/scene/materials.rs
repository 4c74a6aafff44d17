//! Materials and extensions.

use glam::{Vec3, Vec4};
use lightfall::scene::{Alpha, Material};
use serde_json::{Value, json};

use crate::document::Document;

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
        alpha: Alpha::Mask { cutoff: 0.25 },
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
    assert_eq!(material.alpha, Alpha::Blend);
    for path in [
        "/materials/0/pbrMetallicRoughness/roughnessFactor: ",
        "/materials/0/pbrMetallicRoughness/metallicFactor: ",
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
    assert_eq!(scene.warnings.len(), 4);

    document.json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = json!("high");
    let fault = document.fault();
    let expected = "/materials/0/pbrMetallicRoughness/metallicFactor: invalid type: string";
    assert!(fault.contains(expected), "{fault}");
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
        ("KHR_materials_sheen", "take it out of extensionsRequired"),
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
    document.json["extensionsRequired"] = json!(["KHR_mesh_quantization", "MSFT_lod", "KHR_xmp"]);
    let extensions = document.load().extensions;
    let clearcoat = ("KHR_materials_clearcoat", "ignored: there is no coat");
    let other = ("EXT_other", "unknown here and ignored");
    let transform = ("KHR_texture_transform", "supported");
    let expected = [clearcoat, other, transform].map(|(a, b)| (a.into(), b.into()));
    assert_eq!(extensions, expected);
}

#[test]
fn of_an_unlit_material_the_base_color_remains() {
    let mut document = Document::triangle();
    document.material(
        json!({"doubleSided": true, "alphaMode": "BLEND", "emissiveFactor": [1, 1, 1],
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "roughnessFactor": 0},
        "extensions": {"KHR_materials_unlit": {},
            "KHR_materials_transmission": {"transmissionFactor": 1}}}),
    );
    let expected = Material {
        base_color: Vec4::new(0.1, 0.2, 0.3, 0.4),
        alpha: Alpha::Blend,
        double_sided: true,
        metallic: 0.0,
        specular: 0.0,
        unlit: true,
        ..Material::default()
    };
    assert_eq!(document.load().materials, [expected]);
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
