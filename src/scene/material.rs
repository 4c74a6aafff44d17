//! glTF materials with their extensions, every factor in its range.

use std::ops::RangeInclusive;

use glam::Vec3;
use gltf::json::extensions::material::{Material as Extensions, Volume};
use gltf::json::material::{AlphaMode, NormalTexture};
use gltf::json::texture::Info;
use gltf::json::{self, Root};

use super::asset::{Checked, valid};
use super::texture::{Meaning, Textures};
use super::warnings::Warnings;
use super::{Alpha, Material, specular_glossiness};

/// Above this a radiometric number [nit, cd, lx] or σ [1/m] would overflow f32 once multiplied.
pub(super) const MAX_RADIANCE: f32 = 1e20;
const MAX_ABSORPTION: f64 = 1e30;
/// From here on glass reflects 99.6 % at normal incidence. It also stands for KHR_materials_ior's
/// ior 0, which means "all light is reflected".
pub(super) const MAX_IOR: f32 = 1000.0;

/// All materials of the file, in its order.
pub(super) fn materials(
    root: &Root,
    textures: &mut Textures,
    warnings: &mut Warnings,
) -> Checked<Vec<Material>> {
    let materials = root.materials.iter().enumerate();
    materials
        .map(|(i, json)| material(json, &format!("/materials/{i}"), textures, warnings))
        .collect()
}

fn material(
    json: &json::Material,
    path: &str,
    textures: &mut Textures,
    warnings: &mut Warnings,
) -> Checked<Material> {
    let mut material = Material {
        name: json.name.clone().unwrap_or_default(),
        double_sided: json.double_sided,
        alpha: alpha(json, path, warnings)?,
        ..Material::default()
    };
    metallic_roughness(json, path, &mut material, textures, warnings)?;
    if let Some(normal) = &json.normal_texture {
        let info = Some(normal_info(normal, path)?);
        material.normal_texture =
            textures.texture(&info, path, "normalTexture", Meaning::Data, warnings)?;
        let key = "normalTexture/scale";
        material.normal_scale = factor(normal.scale, -1e6..=1e6, path, key, warnings);
    }
    let emission = json.emissive_factor.0;
    material.emission = factors(emission, 0.0..=1.0, path, "emissiveFactor", warnings).into();
    let info = &json.emissive_texture;
    material.emission_texture =
        textures.texture(info, path, "emissiveTexture", Meaning::Color, warnings)?;
    if let Some(extensions) = &json.extensions {
        extend(extensions, path, &mut material, textures, warnings)?;
        if let Some(json) = &extensions.pbr_specular_glossiness {
            let path = format!("{path}/extensions/KHR_materials_pbrSpecularGlossiness");
            specular_glossiness::convert(json, &path, &mut material, textures, warnings)?;
        }
        if extensions.others.contains_key("KHR_materials_unlit") {
            return Ok(unlit(material));
        }
    }
    Ok(material)
}

fn metallic_roughness(
    json: &json::Material,
    path: &str,
    material: &mut Material,
    textures: &mut Textures,
    warnings: &mut Warnings,
) -> Checked<()> {
    let json = &json.pbr_metallic_roughness;
    let path = &format!("{path}/pbrMetallicRoughness");
    let color = json.base_color_factor.0;
    material.base_color = factors(color, 0.0..=1.0, path, "baseColorFactor", warnings).into();
    let (metallic, roughness) = (json.metallic_factor.0, json.roughness_factor.0);
    material.metallic = factor(metallic, 0.0..=1.0, path, "metallicFactor", warnings);
    material.roughness = factor(roughness, 0.0..=1.0, path, "roughnessFactor", warnings);
    let (info, key) = (&json.base_color_texture, "baseColorTexture");
    material.base_color_texture = textures.texture(info, path, key, Meaning::Color, warnings)?;
    let (info, key) = (&json.metallic_roughness_texture, "metallicRoughnessTexture");
    material.metallic_roughness_texture =
        textures.texture(info, path, key, Meaning::Data, warnings)?;
    Ok(())
}

/// KHR_materials_unlit: of the material only the base colour remains.
fn unlit(material: Material) -> Material {
    Material {
        name: material.name,
        base_color: material.base_color,
        base_color_texture: material.base_color_texture,
        alpha: material.alpha,
        double_sided: material.double_sided,
        metallic: 0.0,
        specular: 0.0,
        unlit: true,
        ..Material::default()
    }
}

/// A normal texture as an ordinary one, because only there the crate knows KHR_texture_transform.
fn normal_info(normal: &NormalTexture, path: &str) -> Checked<Info> {
    let extensions = match &normal.extensions {
        Some(extensions) => serde_json::from_value(extensions.others.clone().into())
            .map_err(|error| format!("{path}/normalTexture/extensions: {error}"))?,
        None => None,
    };
    Ok(Info {
        index: normal.index,
        tex_coord: normal.tex_coord,
        extensions,
        extras: None,
    })
}

fn alpha(json: &json::Material, path: &str, warnings: &mut Warnings) -> Checked<Alpha> {
    let cutoff = json.alpha_cutoff.unwrap_or_default().0;
    let cutoff = factor(cutoff, 0.0..=1e6, path, "alphaCutoff", warnings);
    let mode = valid(json.alpha_mode, format_args!("{path}/alphaMode"))?;
    Ok(match mode {
        AlphaMode::Opaque => Alpha::Opaque,
        AlphaMode::Mask => Alpha::Mask { cutoff },
        AlphaMode::Blend => Alpha::Blend,
    })
}

/// KHR_materials_emissive_strength, _ior, _specular, _transmission and _volume.
fn extend(
    extensions: &Extensions,
    path: &str,
    material: &mut Material,
    textures: &mut Textures,
    warnings: &mut Warnings,
) -> Checked<()> {
    let path = |name| format!("{path}/extensions/KHR_materials_{name}");
    if let Some(json) = &extensions.emissive_strength {
        let (path, strength) = (&path("emissive_strength"), json.emissive_strength.0);
        let range = 0.0..=MAX_RADIANCE;
        material.emission *= factor(strength, range, path, "emissiveStrength", warnings);
    }
    if let Some(json) = &extensions.ior {
        let (path, ior) = (&path("ior"), json.ior.0);
        material.ior = if ior == 0.0 {
            let what = "ior 0 (all light is reflected) is approximated by 1000";
            warnings.add(format_args!("{path}/ior"), what);
            MAX_IOR
        } else {
            factor(ior, 1.0..=MAX_IOR, path, "ior", warnings)
        };
    }
    if let Some(json) = &extensions.specular {
        let (path, color) = (&path("specular"), json.specular_color_factor.0);
        let specular = json.specular_factor.0;
        material.specular = factor(specular, 0.0..=1.0, path, "specularFactor", warnings);
        let (info, key) = (&json.specular_texture, "specularTexture");
        material.specular_texture = textures.texture(info, path, key, Meaning::Data, warnings)?;
        let color = factors(color, 0.0..=1e6, path, "specularColorFactor", warnings);
        material.specular_color = color.into();
        let (info, key) = (&json.specular_color_texture, "specularColorTexture");
        material.specular_color_texture =
            textures.texture(info, path, key, Meaning::Color, warnings)?;
    }
    if let Some(json) = &extensions.transmission {
        let (path, share) = (&path("transmission"), json.transmission_factor.0);
        material.transmission = factor(share, 0.0..=1.0, path, "transmissionFactor", warnings);
        let (info, key) = (&json.transmission_texture, "transmissionTexture");
        material.transmission_texture =
            textures.texture(info, path, key, Meaning::Data, warnings)?;
    }
    if let Some(json) = &extensions.volume {
        // The thickness itself, and its texture, are for rasterizers; here light crosses the mesh.
        let (path, thickness) = (&path("volume"), json.thickness_factor.0);
        let thickness = factor(thickness, 0.0..=f32::MAX, path, "thicknessFactor", warnings);
        let absorption = absorption(json, path, warnings);
        if thickness > 0.0 && extensions.transmission.is_some() {
            material.absorption = Some(absorption);
        }
    }
    Ok(())
}

/// σ [1/m] of KHR_materials_volume: −ln(attenuationColor) / attenuationDistance.
fn absorption(json: &Volume, path: &str, warnings: &mut Warnings) -> Vec3 {
    let color = json.attenuation_color.0;
    let color = factors(color, 0.0..=1.0, path, "attenuationColor", warnings);
    let distance = f64::from(json.attenuation_distance.0);
    if distance <= 0.0 {
        let what = "attenuationDistance must be above 0: the least possible is used";
        warnings.breach(path, what);
    }
    if distance == f64::INFINITY {
        return Vec3::ZERO;
    }
    // abs() turns the −0 of a white medium into 0.
    let sigma = color.map(|c| -f64::from(c).ln() / distance.max(f64::MIN_POSITIVE));
    Vec3::from(sigma.map(|s| s.clamp(0.0, MAX_ABSORPTION) as f32)).abs()
}

/// The number `key` of the object at `path`, moved into `range` with a warning where it lies outside.
pub(super) fn factor(
    value: f32,
    range: RangeInclusive<f32>,
    path: &str,
    key: &str,
    warnings: &mut Warnings,
) -> f32 {
    let [value] = factors([value], range, path, key, warnings);
    value
}

/// The numbers `key`, each moved into `range`, with one warning where any lies outside.
pub(super) fn factors<const N: usize>(
    values: [f32; N],
    range: RangeInclusive<f32>,
    path: &str,
    key: &str,
    warnings: &mut Warnings,
) -> [f32; N] {
    let (low, high) = (*range.start(), *range.end());
    if !values.iter().all(|value| range.contains(value)) {
        let what = format_args!("not within [{low}, {high:?}]: moved there");
        warnings.breach(format_args!("{path}/{key}"), what);
    }
    values.map(|value| value.clamp(low, high))
}
