//! How much of a scene uses each feature, and what lies on the device for it.

use super::environment;
use super::features::{ANY_SLOT, Feature, UsedBy, features, textures};
use crate::scene::{Material, Scene};
use crate::shared::*;

/// Bytes of the scene on the device, without its tree or acceleration structure.
pub fn upload_bytes(scene: &Scene) -> u64 {
    let (bits, reached) = (features(scene), Reached::new(scene));
    let has = |bit| if bits & bit != 0 { 1 } else { 0 };
    let vertex = 12
        + 16 * has(FEATURE_SLOT << SLOT_NORMAL)
        + 8 * has(ANY_SLOT)
        + 8 * has(FEATURE_UV1)
        + 16 * has(FEATURE_VERTEX_COLORS);
    let textures = reached.textures_in(scene, |_| true);
    let slots = has(ANY_SLOT) * size_of::<[TextureSlot; SLOTS_PER_MATERIAL as usize]>();
    let material = size_of::<crate::shared::Material>() + slots;
    let triangle = 36 + size_of::<TriangleShading>();
    let places = scene.meshes.iter().map(|mesh| mesh.places.len());
    let buffers = vertex * scene.stored_vertices().count()
        + material * reached.materials.len()
        + triangle * scene.stored_triangles().count()
        + size_of::<Placement>() * places.sum::<usize>();
    buffers as u64
        + textures
            .iter()
            .map(|&t| texture_bytes(scene, t))
            .sum::<u64>()
}

/// How much of a scene uses a feature. All zero: nothing does.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Use {
    pub materials: usize,
    /// Of these materials.
    pub triangles: usize,
    /// Lights without area.
    pub lights: usize,
    pub vertices: usize,
    /// Meshes that are stored once, and how often all of them are shown.
    pub meshes: usize,
    pub places: usize,
    /// Distinct textures.
    pub textures: usize,
    /// On the device, beyond what every scene takes.
    pub bytes: u64,
}

impl Feature {
    /// How much of `scene` uses it.
    pub fn used_in(&self, scene: &Scene, reached: &Reached) -> Use {
        let vertices = scene.stored_vertices().count();
        let attribute = |bytes: usize| (bytes * vertices) as u64;
        let by_materials = |uses: &dyn Fn(&Material) -> bool| {
            let mut used = Use::default();
            for &(material, triangles) in &reached.materials {
                let material = &scene.materials[material as usize];
                if uses(material) {
                    used.materials += 1;
                    used.triangles += triangles;
                }
            }
            used
        };
        match self.used_by {
            UsedBy::Materials(uses) => {
                let used = by_materials(&uses);
                let uvs = self.bit == FEATURE_UV1 && used.materials > 0;
                Use {
                    bytes: if uvs { attribute(8) } else { 0 },
                    ..used
                }
            }
            UsedBy::Slot(slot) => {
                let used = by_materials(&|m| textures(m)[slot as usize].is_some());
                let in_slot = reached.textures_in(scene, |s| s == slot);
                let tangents = slot == SLOT_NORMAL && used.materials > 0;
                let texels: u64 = in_slot.iter().map(|&t| texture_bytes(scene, t)).sum();
                Use {
                    textures: in_slot.len(),
                    bytes: texels + if tangents { attribute(16) } else { 0 },
                    ..used
                }
            }
            UsedBy::Vertices(uses) => {
                let vertices = scene.stored_vertices().filter(|v| uses(v)).count();
                Use {
                    vertices,
                    bytes: if vertices > 0 { attribute(16) } else { 0 },
                    ..Use::default()
                }
            }
            UsedBy::Instances => {
                let places = scene.meshes.iter().map(|mesh| mesh.places.len()).sum();
                Use {
                    meshes: scene.meshes.len(),
                    places,
                    bytes: (places * size_of::<Placement>()) as u64,
                    ..Use::default()
                }
            }
            UsedBy::Lights => Use {
                lights: scene.lights.len(),
                ..Use::default()
            },
            UsedBy::Environment if environment::shines(scene) => Use {
                bytes: environment::bytes(&environment::of(scene)),
                ..Use::default()
            },
            UsedBy::Environment => Use::default(),
        }
    }
}

/// Materials that a triangle has, which alone are uploaded, with their textures.
pub struct Reached {
    /// Into [`Scene::materials`], ascending; and how many triangles have each.
    pub materials: Vec<(u32, usize)>,
}

impl Reached {
    pub fn new(scene: &Scene) -> Self {
        let mut triangles = vec![0; scene.materials.len()];
        for triangle in scene.stored_triangles() {
            triangles[triangle.material as usize] += 1;
        }
        let materials = (0..).zip(triangles).filter(|&(_, count)| count > 0);
        Self {
            materials: materials.collect(),
        }
    }

    /// Textures in these slots that can matter, ascending, each once.
    pub fn textures_in(&self, scene: &Scene, slots: impl Fn(u32) -> bool) -> Vec<u32> {
        let mut all = Vec::new();
        for &(material, _) in &self.materials {
            let textures = textures(&scene.materials[material as usize]);
            let of_slots = (0..).zip(textures).filter(|&(slot, _)| slots(slot));
            all.extend(of_slots.filter_map(|(_, t)| Some(t?.texture)));
        }
        all.sort_unstable();
        all.dedup();
        all
    }
}

fn texture_bytes(scene: &Scene, texture: u32) -> u64 {
    let image = scene.textures[texture as usize].image;
    scene.images[image as usize].rgba.len() as u64
}
