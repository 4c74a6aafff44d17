//! glTF materials with their extensions, every factor in its range.

use std::ops::RangeInclusive;

use glam::{Vec3, Vec4};

use super::Material;
use super::json::{Checked, Json};
use super::texture::Textures;
use super::warnings::Warnings;

/// Above this a radiometric number [nit, cd, lx] or σ [1/m] would overflow f32 once multiplied.
pub(super) const MAX_RADIANCE: f64 = 1e20;
const MAX_ABSORPTION: f64 = 1e30;
/// From here on glass reflects 99.6 % at normal incidence. It also stands for KHR_materials_ior's
/// ior 0, which means "all light is reflected".
const MAX_IOR: f64 = 1000.0;

/// All materials of the file, in its order.
pub(super) fn materials<'a>(
    root: &Json<'a>,
    textures: &mut Textures<'a, '_>,
    warnings: &mut Warnings,
) -> Checked<Vec<Material>> {
    root.items("materials")?
        .iter()
        .map(|json| material(json, textures, warnings))
        .collect()
}

fn material<'a>(
    json: &Json<'a>,
    textures: &mut Textures<'a, '_>,
    warnings: &mut Warnings,
) -> Checked<Material> {
    let mut material = Material {
        name: json.text("name")?.unwrap_or_default().to_owned(),
        double_sided: json.flag("doubleSided")?,
        ..Material::default()
    };
    if let Some(pbr) = json.get("pbrMetallicRoughness")? {
        let color = factors(&pbr, "baseColorFactor", [1.0; 4], 0.0..=1.0, warnings)?;
        material.base_color = Vec4::from(color);
        material.base_color_texture = textures.texture(&pbr, "baseColorTexture", true, warnings)?;
        material.metallic = factor(&pbr, "metallicFactor", 1.0, 0.0..=1.0, warnings)?;
        material.roughness = factor(&pbr, "roughnessFactor", 1.0, 0.0..=1.0, warnings)?;
        material.metallic_roughness_texture =
            textures.texture(&pbr, "metallicRoughnessTexture", false, warnings)?;
    }
    if let Some(normal) = json.get("normalTexture")? {
        material.normal_texture = textures.texture(json, "normalTexture", false, warnings)?;
        material.normal_scale = factor(&normal, "scale", 1.0, -1e6..=1e6, warnings)?;
    }
    alpha(json, &mut material, warnings)?;
    emission(json, &mut material, textures, warnings)?;
    dielectric(json, &mut material, textures, warnings)?;
    Ok(material)
}

fn alpha(json: &Json, material: &mut Material, warnings: &mut Warnings) -> Checked<()> {
    let cutoff = factor(json, "alphaCutoff", 0.5, 0.0..=1e6, warnings)?;
    let Some(mode) = json.get("alphaMode")? else {
        return Ok(());
    };
    match mode.as_text()? {
        "OPAQUE" => {}
        "MASK" => material.alpha_cutoff = Some(cutoff),
        "BLEND" => warnings.add(mode.path(), "BLEND is not supported: opaque"),
        other => return Err(mode.fault(format_args!("{other} is no alpha mode"))),
    }
    Ok(())
}

fn emission<'a>(
    json: &Json<'a>,
    material: &mut Material,
    textures: &mut Textures<'a, '_>,
    warnings: &mut Warnings,
) -> Checked<()> {
    let color = factors(json, "emissiveFactor", [0.0; 3], 0.0..=1.0, warnings)?;
    let strength = match json.extension("KHR_materials_emissive_strength")? {
        Some(json) => factor(&json, "emissiveStrength", 1.0, 0.0..=MAX_RADIANCE, warnings)?,
        None => 1.0,
    };
    material.emission = Vec3::from(color) * strength;
    material.emission_texture = textures.texture(json, "emissiveTexture", true, warnings)?;
    Ok(())
}

/// KHR_materials_ior, _specular, _transmission and _volume.
fn dielectric<'a>(
    json: &Json<'a>,
    material: &mut Material,
    textures: &mut Textures<'a, '_>,
    warnings: &mut Warnings,
) -> Checked<()> {
    if let Some(json) = json.extension("KHR_materials_ior")? {
        material.ior = match json.number("ior", 1.5)? {
            0.0 => {
                let what = "ior 0 (all light is reflected) is approximated by 1000";
                warnings.add(&format!("{}/ior", json.path()), what);
                MAX_IOR as f32
            }
            _ => factor(&json, "ior", 1.5, 1.0..=MAX_IOR, warnings)?,
        };
    }
    if let Some(json) = json.extension("KHR_materials_specular")? {
        material.specular = factor(&json, "specularFactor", 1.0, 0.0..=1.0, warnings)?;
        material.specular_texture = textures.texture(&json, "specularTexture", false, warnings)?;
        let color = factors(&json, "specularColorFactor", [1.0; 3], 0.0..=1e6, warnings)?;
        material.specular_color = Vec3::from(color);
        material.specular_color_texture =
            textures.texture(&json, "specularColorTexture", true, warnings)?;
    }
    let transmission = json.extension("KHR_materials_transmission")?;
    if let Some(json) = &transmission {
        material.transmission = factor(json, "transmissionFactor", 0.0, 0.0..=1.0, warnings)?;
        material.transmission_texture =
            textures.texture(json, "transmissionTexture", false, warnings)?;
    }
    if let Some(json) = json.extension("KHR_materials_volume")? {
        // The thickness itself, and its texture, are for rasterizers; here light crosses the mesh.
        let thickness = factor(&json, "thicknessFactor", 0.0, 0.0..=f64::MAX, warnings)?;
        let absorption = absorption(&json, warnings)?;
        if thickness > 0.0 && transmission.is_some() {
            material.absorption = Some(absorption);
        }
    }
    Ok(())
}

/// σ [1/m] of KHR_materials_volume: −ln(attenuationColor) / attenuationDistance.
fn absorption(json: &Json, warnings: &mut Warnings) -> Checked<Vec3> {
    let color = factors(json, "attenuationColor", [1.0; 3], 0.0..=1.0, warnings)?;
    let distance = json.number("attenuationDistance", f64::INFINITY)?;
    if distance <= 0.0 {
        let what = "attenuationDistance must be above 0: the least possible is used";
        warnings.add(json.path(), what);
    }
    if distance == f64::INFINITY {
        return Ok(Vec3::ZERO);
    }
    // abs() turns the −0 of a white medium into 0.
    let sigma = color.map(|c| -f64::from(c).ln() / distance.max(f64::MIN_POSITIVE));
    Ok(Vec3::from(sigma.map(|s| s.clamp(0.0, MAX_ABSORPTION) as f32)).abs())
}

/// The number `key`, moved into `range` with a warning where it lies outside.
pub(super) fn factor(
    json: &Json,
    key: &str,
    default: f64,
    range: RangeInclusive<f64>,
    warnings: &mut Warnings,
) -> Checked<f32> {
    let value = json.number(key, default)?;
    let [value] = clamped([value], json, key, range, warnings);
    Ok(value)
}

/// The numbers `key`, each moved into `range`, with one warning where any lies outside.
pub(super) fn factors<const N: usize>(
    json: &Json,
    key: &str,
    default: [f64; N],
    range: RangeInclusive<f64>,
    warnings: &mut Warnings,
) -> Checked<[f32; N]> {
    let values = json.numbers(key, default)?;
    Ok(clamped(values, json, key, range, warnings))
}

fn clamped<const N: usize>(
    values: [f64; N],
    json: &Json,
    key: &str,
    range: RangeInclusive<f64>,
    warnings: &mut Warnings,
) -> [f32; N] {
    if !values.iter().all(|value| range.contains(value)) {
        let (low, high) = (range.start(), range.end());
        let what = format!("not within [{low}, {high:?}]: moved there");
        warnings.add(&format!("{}/{key}", json.path()), &what);
    }
    values.map(|value| {
        let value = value.clamp(*range.start(), *range.end());
        value.clamp(f32::MIN.into(), f32::MAX.into()) as f32
    })
}
