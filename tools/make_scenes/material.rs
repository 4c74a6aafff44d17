//! glTF materials in the field's conventions, see `scenes/README.md`.

use serde_json::{Value, json};

pub const WHITE: [f64; 3] = [0.73, 0.73, 0.73];
pub const RED: [f64; 3] = [0.61, 0.06, 0.05];
pub const GREEN: [f64; 3] = [0.12, 0.45, 0.09];
pub const WOOD: [f64; 3] = [0.5, 0.36, 0.22];
pub const BLACK: [f64; 3] = [0.0, 0.0, 0.0];
/// The pictures' aspect ratio where it is not 1.
pub const WIDE: f64 = 16.0 / 9.0;

/// Lambertian: the glTF default also has a specular coat.
pub fn diffuse(name: &str, albedo: [f64; 3]) -> Value {
    json!({
        "name": name, "doubleSided": true,
        "pbrMetallicRoughness": {
            "baseColorFactor": [albedo[0], albedo[1], albedo[2], 1.0],
            "metallicFactor": 0.0, "roughnessFactor": 1.0,
        },
        "extensions": { "KHR_materials_specular": { "specularFactor": 0.0 } },
    })
}

/// Lambertian and sends `radiance` [nit] from its front.
pub fn light(name: &str, albedo: [f64; 3], radiance: [f64; 3]) -> Value {
    let strength = radiance.into_iter().fold(1.0, f64::max);
    let mut material = diffuse(name, albedo);
    material["emissiveFactor"] = json!(radiance.map(|channel| channel / strength));
    if strength > 1.0 {
        material["extensions"]["KHR_materials_emissive_strength"] =
            json!({ "emissiveStrength": strength });
    }
    material
}

/// Smooth metal; `f0` is its reflectance at normal incidence.
pub fn metal(name: &str, f0: [f64; 3]) -> Value {
    json!({
        "name": name, "doubleSided": true,
        "pbrMetallicRoughness": {
            "baseColorFactor": [f0[0], f0[1], f0[2], 1.0],
            "metallicFactor": 1.0, "roughnessFactor": 0.0,
        },
    })
}

/// A smooth, solid dielectric. The thickness only says "solid": the real geometry is traced.
pub fn dielectric(name: &str, ior: f64) -> Value {
    json!({
        "name": name, "doubleSided": false,
        "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.0 },
        "extensions": {
            "KHR_materials_ior": { "ior": ior },
            "KHR_materials_transmission": { "transmissionFactor": 1.0 },
            "KHR_materials_volume": { "thicknessFactor": 0.01 },
        },
    })
}
