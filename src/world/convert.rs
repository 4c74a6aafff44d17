//! The scene's structs as shaders read them.

use super::features::{is_one_sided, textures};
use crate::Result;
use crate::gpu::{Gpu, TextureArray, TextureData};
use crate::scene::{Alpha, Material, Scene, Triangle};
use crate::shared::*;

/// `materials`: the scene's that are uploaded, ascending. `first_vertex`: where those of the triangle's mesh begin.
pub fn shading(
    scene: &Scene,
    materials: &[u32],
    t: &Triangle,
    first_vertex: u32,
    folded: u32,
) -> TriangleShading {
    let material = &scene.materials[t.material as usize];
    let place = materials.partition_point(|&m| m < t.material) as u32;
    let mut word = place | (folded * TRIANGLE_EDGE);
    if is_one_sided(material) {
        word |= TRIANGLE_ONE_SIDED;
    }
    if material.has_holes() {
        word |= TRIANGLE_ALPHA;
    }
    TriangleShading {
        vertices: t.vertices.map(|v| first_vertex + v),
        material: word,
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
        unused: 0,
    }
}

/// In the order of the SLOT_ constants. `uploaded`: the scene's textures on the device, ascending.
pub fn slots(m: &Material, uploaded: &[u32]) -> [TextureSlot; SLOTS_PER_MATERIAL as usize] {
    textures(m).map(|reference| match reference {
        None => TextureSlot {
            texture: NONE,
            ..Default::default()
        },
        Some(r) => TextureSlot {
            texture: uploaded.partition_point(|&t| t < r.texture) as u32,
            uv_set: r.uv_set,
            row0: r.transform[0].into(),
            row1: r.transform[1].into(),
        },
    })
}

/// The scene's textures with these numbers.
pub fn texture_array(gpu: &Gpu, scene: &Scene, uploaded: &[u32]) -> Result<TextureArray> {
    let textures = uploaded.iter().map(|&t| {
        let texture = &scene.textures[t as usize];
        let image = &scene.images[texture.image as usize];
        TextureData {
            width: image.width,
            height: image.height,
            rgba8: &image.rgba,
            srgb: texture.srgb,
            wrap: texture.wrap,
            nearest: texture.nearest,
        }
    });
    let textures: Vec<TextureData> = textures.collect();
    gpu.texture_array(&textures)
}
