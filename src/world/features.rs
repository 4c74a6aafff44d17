//! What a scene uses of all that lightfall can do, found once at load. Specialization constants, buffers, textures
//! and passes follow from it: what a scene does not use is not compiled in, uploaded or run.

use super::usage::{Reached, Use};
use crate::scene::{Alpha, Material, Scene, TextureRef};
use crate::shared::*;
use glam::Vec3;

/// Something that a scene may use and pay for.
pub struct Feature {
    pub name: &'static str,
    /// FEATURE_ bit.
    pub bit: u32,
    /// What it makes the device do.
    pub switches_on: &'static str,
    pub(super) used_by: UsedBy,
}

/// What decides.
#[derive(Clone, Copy)]
pub(super) enum UsedBy {
    /// Materials, among those of a triangle.
    Materials(fn(&Material) -> bool),
    /// Materials with a texture in this slot that can matter.
    Slot(u32),
    /// So many vertices.
    Vertices(fn(&crate::scene::Vertex) -> bool),
    /// Lights without area.
    Lights,
    /// Meshes that are stored once and shown many times.
    Instances,
    Environment,
}

const fn slot(name: &'static str, slot: u32, switches_on: &'static str) -> Feature {
    Feature {
        name,
        bit: FEATURE_SLOT << slot,
        switches_on,
        used_by: UsedBy::Slot(slot),
    }
}

const fn materials(
    name: &'static str,
    bit: u32,
    switches_on: &'static str,
    uses: fn(&Material) -> bool,
) -> Feature {
    Feature {
        name,
        bit,
        switches_on,
        used_by: UsedBy::Materials(uses),
    }
}

/// All of them, in the order of reports.
pub const FEATURES: &[Feature] = &[
    materials(
        "diffuse",
        FEATURE_DIFFUSE,
        "light paths, photon maps",
        is_diffuse,
    ),
    materials(
        "specular",
        FEATURE_SPECULAR,
        "specular lobes, a photon map of caustics",
        is_specular,
    ),
    materials(
        "rough specular",
        FEATURE_ROUGH,
        "microfacets, lamps seen in specular lobes",
        is_rough,
    ),
    materials("metal", FEATURE_METALLIC, "metal's reflectance", |m| {
        m.metallic > 0.0
    }),
    materials(
        "transmission",
        FEATURE_TRANSMISSION,
        "refraction, exact Fresnel equations",
        Material::is_transmissive,
    ),
    materials(
        "absorption",
        FEATURE_ABSORPTION,
        "the medium of each path, attenuation",
        |m| m.absorption.is_some_and(|sigma| sigma != Vec3::ZERO),
    ),
    materials("alpha", FEATURE_ALPHA, "holes that rays pass", |m| {
        matches!(m.alpha, Alpha::Mask { .. })
    }),
    materials(
        "blend",
        FEATURE_BLEND,
        "holes that rays pass by chance",
        |m| m.alpha == Alpha::Blend,
    ),
    materials("unlit", FEATURE_UNLIT, "surfaces for the eye alone", |m| {
        m.unlit
    }),
    materials(
        "one-sided",
        FEATURE_ONE_SIDED,
        "backs that the eye sees through",
        is_one_sided,
    ),
    materials(
        "area lights",
        FEATURE_AREA_LIGHTS,
        "points on lamps, rays that may hit one",
        |m| m.emission.max_element() > 0.0,
    ),
    Feature {
        name: "delta lights",
        bit: FEATURE_DELTA_LIGHTS,
        switches_on: "point, spot and directional lights",
        used_by: UsedBy::Lights,
    },
    Feature {
        name: "instances",
        bit: FEATURE_INSTANCES,
        switches_on: "a tree over places of meshes, each mesh stored once",
        used_by: UsedBy::Instances,
    },
    Feature {
        name: "environment",
        bit: FEATURE_ENVIRONMENT,
        switches_on: "light from all around",
        used_by: UsedBy::Environment,
    },
    Feature {
        name: "vertex colours",
        bit: FEATURE_VERTEX_COLORS,
        switches_on: "colours of vertices",
        used_by: UsedBy::Vertices(|v| v.color != glam::Vec4::ONE),
    },
    slot("base colour textures", SLOT_BASE_COLOR, TEXTURES),
    slot(
        "metallic-roughness textures",
        SLOT_METALLIC_ROUGHNESS,
        TEXTURES,
    ),
    slot("normal maps", SLOT_NORMAL, "tangents, textures"),
    slot("emission textures", SLOT_EMISSION, TEXTURES),
    slot("specular textures", SLOT_SPECULAR, TEXTURES),
    slot("specular colour textures", SLOT_SPECULAR_COLOR, TEXTURES),
    slot("transmission textures", SLOT_TRANSMISSION, TEXTURES),
    materials(
        "second texture coordinates",
        FEATURE_UV1,
        "a second set of texture coordinates",
        |m| textures(m).iter().flatten().any(|t| t.uv_set != 0),
    ),
];

const TEXTURES: &str = "textures";

/// Bits of all texture slots.
pub const ANY_SLOT: u32 = ((1 << SLOTS_PER_MATERIAL) - 1) * FEATURE_SLOT;

/// FEATURE_ bits of what `scene` uses.
pub fn features(scene: &Scene) -> u32 {
    let reached = Reached::new(scene);
    let used = FEATURES
        .iter()
        .filter(|f| f.used_in(scene, &reached) != Use::default());
    used.fold(0, |bits, f| bits | f.bit)
}

/// FEATURE_ bits of everything that a scene may use: what benchmarks compare with.
pub fn everything() -> u32 {
    FEATURES.iter().fold(0, |bits, f| bits | f.bit)
}

/// A material's textures that can matter: one that multiplies zero is none. In the order of the SLOT_ constants.
pub fn textures(m: &Material) -> [Option<TextureRef>; SLOTS_PER_MATERIAL as usize] {
    let dielectric = m.specular > 0.0;
    [
        m.base_color_texture,
        m.metallic_roughness_texture.filter(|_| is_specular(m)),
        m.normal_texture.filter(|_| !m.unlit),
        m.emission_texture.filter(|_| m.emission != Vec3::ZERO),
        m.specular_texture.filter(|_| dielectric),
        m.specular_color_texture.filter(|_| dielectric),
        m.transmission_texture.filter(|_| m.is_transmissive()),
    ]
}

/// A layer that reflects nothing is a plain Lambertian surface.
fn is_specular(m: &Material) -> bool {
    m.metallic > 0.0 || m.specular > 0.0 || m.is_transmissive()
}

/// Rougher than what shaders take for smooth.
fn is_rough(m: &Material) -> bool {
    is_specular(m) && m.roughness > 1e-3
}

pub fn is_one_sided(material: &Material) -> bool {
    !material.double_sided && !material.is_transmissive()
}

/// Whether some light can leave it by a diffuse lobe: else it stores no photon.
fn is_diffuse(m: &Material) -> bool {
    // Textures take away of both.
    let metal = m.metallic >= 1.0 && m.metallic_roughness_texture.is_none();
    let glass = m.transmission >= 1.0 && m.transmission_texture.is_none();
    let black = m.base_color.truncate().max_element() <= 0.0;
    !metal && !glass && !black && !m.unlit
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Light, Triangle};

    #[test]
    fn features_are_those_of_the_scene() {
        let on = |scene: &Scene| -> Vec<&str> {
            let bits = features(scene);
            let used = FEATURES.iter().filter(|f| bits & f.bit != 0);
            used.map(|f| f.name).collect()
        };
        let chalk = Material {
            metallic: 0.0,
            specular: 0.0,
            double_sided: true,
            ..Material::default()
        };
        let triangle = |material| Triangle {
            vertices: [0; 3],
            material,
        };
        let mut scene = Scene {
            materials: vec![chalk.clone()],
            triangles: vec![triangle(0)],
            ..Scene::default()
        };
        assert_eq!(on(&scene), ["diffuse"]);
        scene.materials.push(Material {
            transmission: 1.0,
            absorption: Some(Vec3::ONE),
            roughness: 0.0,
            ..chalk.clone()
        });
        assert_eq!(on(&scene), ["diffuse"], "no triangle has the second");
        scene.triangles[0].material = 1;
        assert_eq!(on(&scene), ["specular", "transmission", "absorption"]);
        scene.materials[1] = Material {
            alpha: Alpha::Mask { cutoff: 0.5 },
            double_sided: false,
            normal_texture: Some(TextureRef {
                texture: 0,
                uv_set: 0,
                transform: [Vec3::X, Vec3::Y],
            }),
            // Nothing that it could colour.
            emission_texture: Some(TextureRef {
                texture: 0,
                uv_set: 1,
                transform: [Vec3::X, Vec3::Y],
            }),
            ..chalk
        };
        scene.images.push(crate::scene::Image::default());
        scene.textures.push(crate::scene::Texture {
            image: 0,
            wrap: [crate::scene::Wrap::Repeat; 2],
            nearest: false,
            srgb: false,
        });
        scene.lights.push(Light::Point {
            position_w: Vec3::ZERO,
            intensity: Vec3::ONE,
        });
        let last = [
            "diffuse",
            "alpha",
            "one-sided",
            "delta lights",
            "normal maps",
        ];
        assert_eq!(on(&scene), last);
    }
}
