//! Materials and extensions.

use glam::{Vec3, Vec4};
use lightfall::scene::{Alpha, Material, TextureRef};
use serde_json::{Value, json};

use crate::document::{Document, near, png};

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
        ("EXT_other", "requires EXT_other"),
        ("EXT_other", "take it out of extensionsRequired"),
        ("EXT_texture_avif", "npx @gltf-transform/cli png"),
    ] {
        document.json["extensionsRequired"] = json!([name]);
        let fault = document.fault();
        assert!(
            fault.contains("/extensionsRequired/0") && fault.contains(fix),
            "{fault}"
        );
    }
    // What is only left out is no reason to refuse.
    document.json["extensionsRequired"] = json!([
        "KHR_mesh_quantization",
        "MSFT_lod",
        "KHR_xmp",
        "KHR_materials_clearcoat",
        "KHR_materials_sheen"
    ]);
    let extensions = document.load().extensions;
    let clearcoat = ("KHR_materials_clearcoat", "left out: there is no coat");
    let other = ("EXT_other", "unknown here and ignored");
    let transform = ("KHR_texture_transform", "supported");
    let expected = [clearcoat, other, transform].map(|(a, b)| (a.into(), b.into()));
    assert_eq!(extensions, expected);
}

/// The specular colour is the reflectance at normal incidence, whatever the index of refraction;
/// glossiness is the complement of roughness.
#[test]
fn specular_glossiness_becomes_what_looks_the_same() {
    let mut document = Document::square(true);
    let factors = json!({"diffuseFactor": [0.1, 0.2, 0.3, 0.4], "specularFactor": [0.5, 0.6, 1],
        "glossinessFactor": 0.75});
    document.material(
        json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]},
        "extensions": {"KHR_materials_pbrSpecularGlossiness": factors}}),
    );
    document.json["extensionsRequired"] = json!(["KHR_materials_pbrSpecularGlossiness"]);
    let material = document.load().materials.remove(0);
    assert_eq!(material.base_color, Vec4::new(0.1, 0.2, 0.3, 0.4));
    assert_eq!((material.metallic, material.roughness), (0.0, 0.25));
    let reflected = ((material.ior - 1.0) / (material.ior + 1.0)).powi(2);
    let f0 = reflected * material.specular_color * material.specular;
    assert!(near(f0, Vec3::new(0.5, 0.6, 1.0)), "{f0}");

    let view = document.view(&png([10, 20, 30, 102]));
    document.json["images"] = json!([{"bufferView": view}]);
    document.json["textures"] = json!([{"source": 0}]);
    let textured = &mut document.json["materials"][0]["extensions"];
    textured["KHR_materials_pbrSpecularGlossiness"]["specularGlossinessTexture"] =
        json!({"index": 0});
    let scene = document.load();
    let material = &scene.materials[0];
    assert_eq!(material.roughness, 1.0);
    let image = |texture: Option<TextureRef>| {
        let texture = scene.textures[texture.unwrap().texture as usize];
        (
            &scene.images[texture.image as usize].rgba[..4],
            texture.srgb,
        )
    };
    let specular = image(material.specular_color_texture);
    assert_eq!(specular, (&[10, 20, 30, 102][..], true));
    // 1 - 0.75 · 0.4 = 0.7.
    let (rough, srgb) = image(material.metallic_roughness_texture);
    assert!(rough[1].abs_diff(178) <= 1 && !srgb, "{rough:?}");
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
