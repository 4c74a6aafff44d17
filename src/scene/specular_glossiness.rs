//! KHR_materials_pbrSpecularGlossiness, as the metallic-roughness material that looks the same.
//!
//! Its specular colour is the reflectance at normal incidence: that of KHR_materials_specular on a
//! dielectric whose index of refraction is so high that it alone would reflect all light.

use gltf::json::extensions::material::PbrSpecularGlossiness;

use super::asset::Checked;
use super::material::{MAX_IOR, factor, factors};
use super::texture::{Meaning, Textures};
use super::warnings::Warnings;
use super::{Image, Material};

/// Puts the extension at `path` in place of the material's base colour, metal and roughness.
pub(super) fn convert(
    json: &PbrSpecularGlossiness,
    path: &str,
    material: &mut Material,
    textures: &mut Textures,
    warnings: &mut Warnings,
) -> Checked<()> {
    let unit = 0.0..=1.0;
    let diffuse = json.diffuse_factor.0;
    material.base_color = factors(diffuse, unit.clone(), path, "diffuseFactor", warnings).into();
    let (info, key) = (&json.diffuse_texture, "diffuseTexture");
    material.base_color_texture = textures.texture(info, path, key, Meaning::Color, warnings)?;
    material.metallic = 0.0;

    material.ior = MAX_IOR;
    let reflected = ((MAX_IOR - 1.0) / (MAX_IOR + 1.0)).powi(2);
    let specular = json.specular_factor.0;
    let specular = factors(specular, unit.clone(), path, "specularFactor", warnings);
    material.specular = 1.0;
    material.specular_texture = None;
    material.specular_color = specular.map(|f0| f0 / reflected).into();
    let (info, key) = (
        &json.specular_glossiness_texture,
        "specularGlossinessTexture",
    );
    let texture = textures.texture(info, path, key, Meaning::Color, warnings)?;
    material.specular_color_texture = texture;

    let glossiness = json.glossiness_factor.0;
    let glossiness = factor(glossiness, unit, path, "glossinessFactor", warnings);
    material.metallic_roughness_texture = None;
    material.roughness = 1.0 - glossiness;
    if texture.is_some() {
        let factor = (255.0 * glossiness).round() as u8;
        let meaning = Meaning::Glossiness { factor };
        material.roughness = 1.0;
        material.metallic_roughness_texture =
            textures.texture(info, path, key, meaning, warnings)?;
    }
    Ok(())
}

/// The roughness, in G, where A is glossiness over `factor` / 255.
pub(super) fn roughness(glossiness: &Image, factor: u8) -> Image {
    let texel = |texel: &[u8; 4]| {
        let product = u32::from(texel[3]) * u32::from(factor);
        [0, 255 - ((product + 127) / 255) as u8, 0, 255]
    };
    let texels = glossiness.rgba.as_chunks().0;
    Image {
        rgba: texels.iter().flat_map(texel).collect(),
        ..*glossiness
    }
}
