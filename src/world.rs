//! The scene on the device, summed up in one struct of addresses.

mod convert;
mod edges;
mod emission;
mod environment;
mod light_tree;
mod lights;

use crate::bvh::{SceneTree, morton_order};
use crate::gpu::{Blas, Buffer, Gpu, Instance, Ptr, TextureArray, Tlas, TriangleGeometry};
use crate::scene::{Alpha, Environment, Material, Scene};
use crate::settings::Trace;
use crate::shared::*;
use crate::{Error, Result};
use convert::{is_textured, material, shading, slots, textures, vertex};
use glam::Vec3;

/// The scene's buffers and what they hold.
pub struct World {
    /// Never `Auto`.
    pub trace: Trace,
    pub world: Buffer<crate::shared::World>,
    /// `None` where no material has one: such scenes bind no descriptor at all.
    pub textures: Option<TextureArray>,
    /// FEATURE_ bits.
    pub features: u32,
    /// Entries of the software traversal's stack.
    pub stack_size: u32,
    pub bounds_w: (Vec3, Vec3),
    /// Kept alive for their addresses.
    _held: Held,
}

#[allow(dead_code, reason = "held for the addresses that shaders follow")]
struct Held {
    positions: Buffer<[f32; 3]>,
    triangles: Buffer<TriangleShading>,
    vertices: Buffer<VertexShading>,
    materials: Buffer<crate::shared::Material>,
    slots: Buffer<TextureSlot>,
    lights: Buffer<Light>,
    light_tree: Buffer<LightNode>,
    lights_by_triangle: Buffer<u32>,
    environment: Option<environment::Buffers>,
    nodes: Option<Buffer<BvhNode>>,
    structure: Option<(Vec<Blas>, Tlas)>,
}

impl World {
    /// Uploads `scene` for a traversal.
    ///
    /// # Errors
    /// No light in the scene; textures on a device without descriptor indexing; out of memory.
    pub fn new(gpu: &Gpu, scene: &Scene, trace: Trace) -> Result<Self> {
        let corners: Vec<[Vec3; 3]> = scene
            .triangles
            .iter()
            .map(|t| t.vertices.map(|v| scene.vertices[v as usize].position_w))
            .collect();
        let (order, groups, tree) = match trace {
            Trace::Query => {
                let (order, groups) = grouped_order(scene, &corners);
                (order, groups, None)
            }
            _ => {
                let mut tree = SceneTree::build(&corners);
                (std::mem::take(&mut tree.order), [0; 5], Some(tree))
            }
        };

        let positions: Vec<[f32; 3]> = order
            .iter()
            .flat_map(|&t| corners[t as usize].map(Into::into))
            .collect();
        let folded = edges::folded_edges(scene, &corners);
        let triangles: Vec<TriangleShading> = order
            .iter()
            .map(|&t| shading(scene, t, folded[t as usize]))
            .collect();
        let (lights, light_tree) = lights::lights(scene, &order)?;
        let by_triangle = lights::by_triangle(&lights);
        let features = features(scene);
        let textures = textures(gpu, scene)?;
        let (min, max) = scene.bounds();

        let positions = gpu.upload("positions", &positions)?;
        let structure = match trace {
            Trace::Query => Some(structure(gpu, &positions, groups)?),
            _ => None,
        };
        let nodes = tree
            .as_ref()
            .map(|t| gpu.upload("scene tree", &t.nodes))
            .transpose()?;
        let held = Held {
            triangles: gpu.upload("triangles", &triangles)?,
            vertices: gpu.upload(
                "vertices",
                &scene.vertices.iter().map(vertex).collect::<Vec<_>>(),
            )?,
            materials: gpu.upload(
                "materials",
                &scene.materials.iter().map(material).collect::<Vec<_>>(),
            )?,
            slots: gpu.upload(
                "texture slots",
                &if textures.is_some() {
                    scene.materials.iter().flat_map(slots).collect()
                } else {
                    Vec::new()
                },
            )?,
            lights: gpu.upload("lights", &lights)?,
            light_tree: gpu.upload("light tree", &light_tree)?,
            lights_by_triangle: gpu.upload("lights by triangle", &by_triangle)?,
            environment: environment(scene)
                .map(|e| environment::upload(gpu, e))
                .transpose()?,
            positions,
            nodes,
            structure,
        };
        let world = crate::shared::World {
            positions_w: held.positions.ptr(),
            triangles: held.triangles.ptr(),
            vertices: held.vertices.ptr(),
            materials: held.materials.ptr(),
            texture_slots: held.slots.ptr(),
            lights: held.lights.ptr(),
            light_tree: held.light_tree.ptr(),
            lights_by_triangle: held.lights_by_triangle.ptr(),
            nodes: held.nodes.as_ref().map_or(Ptr::null(), Buffer::ptr),
            tlas: held
                .structure
                .as_ref()
                .map_or([0; 2], |(_, tlas)| address_words(tlas.address())),
            groups: [groups[0], groups[1], groups[2], groups[3]],
            light_count: lights.len() as u32,
            first_delta_light: by_triangle.len() as u32,
            center_w: ((min + max) * 0.5).into(),
            radius: (max - min).length() * 0.5,
            environment: held
                .environment
                .as_ref()
                .map_or(Default::default(), |e| e.environment),
        };
        Ok(Self {
            trace,
            world: gpu.upload("world", &[world])?,
            textures,
            features,
            stack_size: tree.map_or(1, |t| t.stack_size),
            bounds_w: (min, max),
            _held: held,
        })
    }

    /// Of the sphere (m) about the bounds.
    pub fn radius(&self) -> f32 {
        0.5 * (self.bounds_w.1 - self.bounds_w.0).length()
    }

    /// Lengths (m) below this are lost in the rounding of positions: 16 steps of the float grid at the largest
    /// coordinate, which is also how far rays start above a surface.
    pub fn resolution(&self) -> f32 {
        let (min, max) = self.bounds_w;
        8.0 * f32::EPSILON * min.abs().max(max.abs()).max_element()
    }

    /// The part of a shader's stem that names this world's variant.
    pub fn variant(&self) -> &'static str {
        match (self.trace, self.textures.is_some()) {
            (Trace::Query, false) => "query",
            (Trace::Query, true) => "query.textured",
            (_, false) => "software",
            (_, true) => "software.textured",
        }
    }
}

/// A device address as shaders take it: low word, high word.
pub fn address_words(address: u64) -> [u32; 2] {
    [address as u32, (address >> 32) as u32]
}

fn is_one_sided(material: &Material) -> bool {
    !material.double_sided && !material.is_transmissive()
}

/// Triangles in Morton order within each of the four groups of the acceleration structure, and
/// where the groups begin and end.
fn grouped_order(scene: &Scene, corners: &[[Vec3; 3]]) -> (Vec<u32>, [u32; 5]) {
    let mut groups = [const { Vec::new() }; 4];
    for (i, triangle) in scene.triangles.iter().enumerate() {
        let material = &scene.materials[triangle.material as usize];
        let group = usize::from(is_one_sided(material)) * 2 + usize::from(material.has_holes());
        groups[group].push(i as u32);
    }
    let mut order = Vec::with_capacity(corners.len());
    let mut first = [0; 5];
    for (i, mut group) in groups.into_iter().enumerate() {
        morton_order(corners, &mut group);
        order.extend(group);
        first[i + 1] = order.len() as u32;
    }
    (order, first)
}

/// Two instances at most: faces seen from both sides, and those that are not there from behind.
fn structure(
    gpu: &Gpu,
    positions: &Buffer<[f32; 3]>,
    groups: [u32; 5],
) -> Result<(Vec<Blas>, Tlas)> {
    let mut all = Vec::new();
    let mut instances = Vec::new();
    for first_group in [0, 2] {
        if groups[first_group] == groups[first_group + 2] {
            continue;
        }
        let geometry = |group: usize| {
            let [first, end] = [groups[group] as usize, groups[group + 1] as usize];
            TriangleGeometry {
                positions: positions.ptr(),
                // An empty group at the end would begin where no buffer is.
                first_triangle: if first == end { 0 } else { first },
                triangles: end - first,
                opaque: group.is_multiple_of(2),
            }
        };
        let blas =
            gpu.triangle_blas("scene", &[geometry(first_group), geometry(first_group + 1)])?;
        instances.push(Instance {
            blas_address: blas.address(),
            custom_index: first_group as u32,
            mask: 0xff,
            facing_cull_disable: first_group == 0,
            front_ccw: false,
        });
        all.push(blas);
    }
    let tlas = gpu.tlas("scene", instances.len())?;
    let mut commands = gpu.commands()?;
    commands.build_tlas(&tlas, &instances);
    commands.submit()?;
    Ok((all, tlas))
}

/// That of the scene, unless it is black.
fn environment(scene: &Scene) -> Option<&Environment> {
    let shines = |e: &&Environment| e.map.pixels.iter().any(|&value| value > 0.0);
    scene.environment.as_ref().filter(shines)
}

fn features(scene: &Scene) -> u32 {
    let mut features = 0;
    for m in &scene.materials {
        // A layer that reflects nothing is a plain Lambertian surface.
        if m.metallic > 0.0 || m.specular > 0.0 || m.is_transmissive() {
            features |= FEATURE_SPECULAR;
        }
        if m.is_transmissive() {
            features |= FEATURE_TRANSMISSION;
        }
        if m.absorption.is_some_and(|sigma| sigma != Vec3::ZERO) {
            features |= FEATURE_ABSORPTION;
        }
        match m.alpha {
            Alpha::Opaque => {}
            Alpha::Mask { .. } => features |= FEATURE_ALPHA,
            Alpha::Blend => features |= FEATURE_BLEND,
        }
        if m.unlit {
            features |= FEATURE_UNLIT;
        }
        if is_one_sided(m) {
            features |= FEATURE_ONE_SIDED;
        }
    }
    if !scene.lights.is_empty() {
        features |= FEATURE_DELTA_LIGHTS;
    }
    if environment(scene).is_some() {
        features |= FEATURE_ENVIRONMENT;
    }
    features
}

/// What a scene may hold and pay for, in words for the user, and whether this one does. Shaders leave out
/// what it does not hold; without specular surfaces no photon map of caustics is built, and without
/// textures no descriptor is bound.
pub fn scene_features(scene: &Scene) -> [(&'static str, bool); 10] {
    let bits = features(scene);
    let has = |bit| bits & bit != 0;
    [
        ("specular", has(FEATURE_SPECULAR)),
        ("transmission", has(FEATURE_TRANSMISSION)),
        ("absorption", has(FEATURE_ABSORPTION)),
        ("alpha", has(FEATURE_ALPHA)),
        ("blend", has(FEATURE_BLEND)),
        ("unlit", has(FEATURE_UNLIT)),
        ("one-sided", has(FEATURE_ONE_SIDED)),
        ("delta lights", has(FEATURE_DELTA_LIGHTS)),
        ("environment", has(FEATURE_ENVIRONMENT)),
        ("textures", is_textured(scene)),
    ]
}

/// What the software tree and the acceleration structure cannot hold.
pub fn check_size(scene: &Scene, device: &str) -> Result<()> {
    if scene.materials.len() > TRIANGLE_MATERIAL_MASK as usize {
        return Err(Error::Device {
            device: device.into(),
            fault: "more than 2^27 materials".into(),
        });
    }
    // The shader's stack keeps a leaf's first triangle in 28 bits.
    if scene.triangles.len() >= 1 << 28 {
        return Err(Error::Device {
            device: device.into(),
            fault: format!(
                "the scene has {} triangles; at most 2^28 can be traced",
                scene.triangles.len()
            ),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::TextureRef;

    #[test]
    fn features_are_those_of_the_scene() {
        let on = |scene: &Scene| -> Vec<&str> {
            let features = scene_features(scene).into_iter();
            features.filter(|f| f.1).map(|f| f.0).collect()
        };
        let chalk = Material {
            metallic: 0.0,
            specular: 0.0,
            double_sided: true,
            ..Material::default()
        };
        let mut scene = Scene {
            materials: vec![chalk.clone()],
            ..Scene::default()
        };
        assert_eq!(on(&scene), [""; 0]);
        scene.materials.push(Material {
            transmission: 1.0,
            absorption: Some(Vec3::ONE),
            ..chalk.clone()
        });
        assert_eq!(on(&scene), ["specular", "transmission", "absorption"]);
        scene.materials[1] = Material {
            alpha: Alpha::Mask { cutoff: 0.5 },
            double_sided: false,
            normal_texture: Some(TextureRef {
                texture: 0,
                uv_set: 0,
                transform: [Vec3::X, Vec3::Y],
            }),
            ..chalk
        };
        scene.lights.push(crate::scene::Light::Point {
            position_w: Vec3::ZERO,
            intensity: Vec3::ONE,
        });
        let last = ["alpha", "one-sided", "delta lights", "textures"];
        assert_eq!(on(&scene), last);
    }
}
