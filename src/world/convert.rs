//! The scene's structs as shaders read them.

use super::is_one_sided;
use crate::Result;
use crate::gpu::{Gpu, TextureArray, TextureData};
use crate::scene::{Alpha, Material, Scene, TextureRef};
use crate::shared::*;

pub fn shading(scene: &Scene, triangle: u32, folded: u32) -> TriangleShading {
    let t = &scene.triangles[triangle as usize];
    let material = &scene.materials[t.material as usize];
    let mut word = t.material | (folded * TRIANGLE_EDGE);
    if is_one_sided(material) {
        word |= TRIANGLE_ONE_SIDED;
    }
    if material.has_holes() {
        word |= TRIANGLE_ALPHA;
    }
    TriangleShading {
        vertices: t.vertices,
        material: word,
    }
}

pub fn vertex(v: &crate::scene::Vertex) -> VertexShading {
    VertexShading {
        normal_w: v.normal_w.into(),
        tangent_w: v.tangent_w.into(),
        uv0: v.uv[0].into(),
        uv1: v.uv[1].into(),
        color: v.color.into(),
    }
}

pub fn material(m: &Material) -> crate::shared::Material {
    let flag = |is: bool, flag| if is { flag } else { 0 };
    crate::shared::Material {
        base_color: m.base_color.into(),
        emission: m.emission.into(),
        metallic: m.metallic,
        specular_color: m.specular_color.into(),
        specular: m.specular,
        absorption: m.absorption.unwrap_or_default().into(),
        transmission: m.transmission,
        roughness: m.roughness,
        ior: m.ior,
        alpha_cutoff: match m.alpha {
            Alpha::Mask { cutoff } => cutoff,
            Alpha::Opaque | Alpha::Blend => 0.0,
        },
        normal_scale: m.normal_scale,
        flags: flag(m.absorption.is_some(), MATERIAL_SOLID)
            | flag(m.alpha == Alpha::Blend, MATERIAL_BLEND)
            | flag(m.unlit, MATERIAL_UNLIT),
    }
}

/// In the order of the SLOT_ constants.
fn references(m: &Material) -> [Option<TextureRef>; SLOTS_PER_MATERIAL as usize] {
    [
        m.base_color_texture,
        m.metallic_roughness_texture,
        m.normal_texture,
        m.emission_texture,
        m.specular_texture,
        m.specular_color_texture,
        m.transmission_texture,
    ]
}

pub fn slots(m: &Material) -> [TextureSlot; SLOTS_PER_MATERIAL as usize] {
    references(m).map(|reference| match reference {
        None => TextureSlot {
            texture: NONE,
            ..Default::default()
        },
        Some(r) => TextureSlot {
            texture: r.texture,
            uv_set: r.uv_set,
            row0: r.transform[0].into(),
            row1: r.transform[1].into(),
        },
    })
}

pub fn is_textured(scene: &Scene) -> bool {
    let mut references = scene.materials.iter().flat_map(references);
    references.any(|reference| reference.is_some())
}

pub fn textures(gpu: &Gpu, scene: &Scene) -> Result<Option<TextureArray>> {
    if !is_textured(scene) {
        return Ok(None);
    }
    let textures: Vec<TextureData> = scene
        .textures
        .iter()
        .map(|t| {
            let image = &scene.images[t.image as usize];
            TextureData {
                width: image.width,
                height: image.height,
                rgba8: &image.rgba,
                srgb: t.srgb,
                wrap: t.wrap,
                nearest: t.nearest,
            }
        })
        .collect();
    gpu.texture_array(&textures).map(Some)
}
