//! Where the fuzzer starts: small files that together reach every part of the loader.

use serde_json::json;

use crate::document::{Document, base64, png};

/// Whole files of npm's encoders, and images of theirs: see make.mjs beside them.
const COMPRESSED: [&[u8]; 6] = [
    include_bytes!("../scene/fixtures/meshopt-ext.glb"),
    include_bytes!("../scene/fixtures/meshopt-khr.glb"),
    include_bytes!("../scene/fixtures/fallback.glb"),
    include_bytes!("../scene/fixtures/gltfpack.glb"),
    include_bytes!("../scene/fixtures/draco-edgebreaker.glb"),
    include_bytes!("../scene/fixtures/draco-sequential.glb"),
];
const IMAGES: [(&str, &[u8]); 6] = [
    (
        "KHR_texture_basisu",
        include_bytes!("../scene/fixtures/etc1s.ktx2"),
    ),
    (
        "KHR_texture_basisu",
        include_bytes!("../scene/fixtures/uastc.ktx2"),
    ),
    (
        "KHR_texture_basisu",
        include_bytes!("../scene/fixtures/uastc-raw.ktx2"),
    ),
    (
        "MSFT_texture_dds",
        include_bytes!("../scene/fixtures/bc1.dds"),
    ),
    (
        "MSFT_texture_dds",
        include_bytes!("../scene/fixtures/bc5.dds"),
    ),
    (
        "MSFT_texture_dds",
        include_bytes!("../scene/fixtures/bc7.dds"),
    ),
];
const MADE_HERE: usize = 5;
pub const COUNT: usize = MADE_HERE + COMPRESSED.len() + IMAGES.len();

/// The seed number `i`, counted round.
pub fn seed(i: usize) -> Vec<u8> {
    let i = i % COUNT;
    if let Some((extension, image)) = IMAGES.get(i.wrapping_sub(MADE_HERE)) {
        return with_image(extension, image).glb();
    }
    if let Some(file) = COMPRESSED.get(i.wrapping_sub(MADE_HERE + IMAGES.len())) {
        return file.to_vec();
    }
    match i {
        0 => textured().glb(),
        1 => hierarchy().glb(),
        2 => compact().glb(),
        3 => external(),
        _ => Document::triangle().glb(),
    }
}

/// A specular-glossiness material with a compressed image.
fn with_image(extension: &str, image: &[u8]) -> Document {
    let mut document = Document::square(true);
    let view = document.view(image);
    document.json["images"] = json!([{"bufferView": view}]);
    document.json["textures"] = json!([{"extensions": {extension: {"source": 0}}}]);
    let texture = json!({"index": 0});
    document.material(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": {
        "diffuseTexture": texture, "glossinessFactor": 0.5, "specularGlossinessTexture": texture,
    }}}));
    document.json["extensions"] = json!({"CESIUM_RTC": {"center": [1, 2, 3]}});
    document
}

/// Every member of a material, textures of all kinds.
fn textured() -> Document {
    let mut document = Document::square(true);
    document.attribute("TEXCOORD_1", &[[0., 0.]; 4]);
    document.attribute("COLOR_0", &[[1., 0.5, 0., 1.]; 4]);
    let view = document.view(&png([255, 128, 0, 255]));
    document.json["images"] = json!([{"bufferView": view}, {"uri": "image.png"}]);
    document.json["samplers"] = json!([{"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}]);
    document.json["textures"] = json!([
        {"source": 0, "sampler": 0},
        {"source": 1, "extensions": {"EXT_texture_webp": {"source": 0}}},
    ]);
    let info = json!({"index": 0, "texCoord": 1, "extensions": {
        "KHR_texture_transform": {"offset": [0.5, 0], "rotation": 1, "scale": [2, 2], "texCoord": 0},
    }});
    let other = json!({"index": 1});
    document.material(json!({
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "baseColorTexture": info, "metallicFactor": 0.5,
                                 "roughnessFactor": 0.5, "metallicRoughnessTexture": other},
        "normalTexture": {"index": 1, "scale": 2, "extensions": info["extensions"]},
        "emissiveFactor": [1, 1, 1], "emissiveTexture": other,
        "alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": true,
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 5},
            "KHR_materials_ior": {"ior": 1.4},
            "KHR_materials_specular": {"specularFactor": 0.5, "specularTexture": other,
                                       "specularColorFactor": [1, 1, 2], "specularColorTexture": other},
            "KHR_materials_transmission": {"transmissionFactor": 1, "transmissionTexture": other},
            "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 0]},
        },
    }));
    document
}

/// Nodes below nodes, lights, cameras, one mesh in two places.
fn hierarchy() -> Document {
    let mut document = Document::triangle();
    document.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    document.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "intensity": 10, "color": [1, 1, 1]},
        {"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}},
        {"type": "directional", "name": "sun"},
    ]}});
    let lamp = |i: u32| json!({"KHR_lights_punctual": {"light": i}});
    document.json["cameras"] = json!([
        {"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1, "aspectRatio": 1.5}},
        {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "zfar": 2, "znear": 0.1}},
    ]);
    document.json["nodes"] = json!([
        {"mesh": 0, "children": [1, 2, 3], "scale": [1, -2, 1]},
        {"mesh": 0, "rotation": [0, 0.7, 0, 0.7], "translation": [1, 2, 3], "extensions": lamp(0)},
        {"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 5, 5, 1], "camera": 0, "extensions": lamp(1)},
        {"name": "sun", "camera": 1, "extensions": lamp(2)},
    ]);
    document.json["scene"] = json!(0);
    document
}

/// A sparse accessor, quantized and strided attributes, strips, fans, a normal map without tangents.
fn compact() -> Document {
    let mut document = Document::square(false);
    let image = document.view(&png([128, 128, 255, 255]));
    document.json["images"] = json!([{"bufferView": image}]);
    document.json["textures"] = json!([{"source": 0}]);
    document.material(json!({"normalTexture": {"index": 0}}));
    let (indices, values) = (document.view(&[1, 3]), document.view(&[0x3f; 24]));
    document.json["accessors"][0]["sparse"] = json!({
        "count": 2,
        "indices": {"bufferView": indices, "componentType": 5121},
        "values": {"bufferView": values},
    });
    let bytes = document.view(&[1, 2, 3, 0, 4, 5, 6, 0, 9, 8, 7, 0, 3, 1, 7, 0]);
    document.json["bufferViews"][bytes]["byteStride"] = json!(4);
    let quantized = json!({"bufferView": bytes, "componentType": 5120, "normalized": true, "count": 4, "type": "VEC3"});
    let quantized = document.push("accessors", quantized);
    let zeros = json!({"componentType": 5126, "count": 4, "type": "VEC4"});
    let zeros = document.push("accessors", zeros);
    let mode = |mode: u32| json!({"attributes": {"POSITION": quantized, "NORMAL": quantized, "TANGENT": zeros}, "mode": mode});
    document.json["meshes"][0]["primitives"]
        .as_array_mut()
        .expect("primitives")
        .extend([5, 6, 1].map(mode));
    document
}

/// A text file that refers to a file beside it and holds data of its own.
fn external() -> Vec<u8> {
    let mut document = Document::square(true);
    let image = format!("data:image/png;base64,{}", base64(&png([1, 2, 3, 4])));
    document.json["images"] = json!([{"uri": image}, {"uri": "image.png"}]);
    document.json["textures"] = json!([{"source": 0}]);
    document.material(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let data = format!(
        "data:application/octet-stream;base64,{}",
        base64(&document.bytes)
    );
    document.json["buffers"] = json!([
        {"byteLength": document.bytes.len(), "uri": data},
        {"byteLength": 4096, "uri": "data.bin"},
    ]);
    document.json["bufferViews"][1]["buffer"] = json!(1);
    document.json.to_string().into_bytes()
}
