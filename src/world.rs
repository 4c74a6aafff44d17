//! The scene on the device, summed up in one struct of addresses.

mod convert;
mod edges;
mod emission;
mod environment;
mod features;
mod geometry;
mod light_tree;
mod lights;
mod usage;

use crate::gpu::{Blas, Buffer, Gpu, Pass, Ptr, RayShaders, TextureArray, Tlas};
use crate::scene::{Scene, Vertex};
use crate::settings::Trace;
use crate::shaders::spirv;
use crate::shared::*;
use crate::{Error, Result};
use convert::{material, slots, texture_array};
use features::ANY_SLOT;
use geometry::Geometry;
use glam::Vec3;
use lights::Lights;

pub use features::{FEATURES, Feature, everything, features};
pub use lights::LightNames;
pub use usage::{Reached, Use, upload_bytes};

/// The scene's buffers and what they hold.
pub struct World {
    /// Never `Auto`.
    pub trace: Trace,
    pub world: Buffer<crate::shared::World>,
    /// `None` where no material has one: such scenes bind no descriptor at all.
    pub textures: Option<TextureArray>,
    /// FEATURE_ bits of what is compiled in, uploaded and run.
    pub features: u32,
    /// Entries of the software traversal's stack.
    pub stack_size: u32,
    pub bounds_w: (Vec3, Vec3),
    pub light_names: LightNames,
    /// Kept alive for their addresses.
    _held: Held,
}

#[allow(dead_code, reason = "held for the addresses that shaders follow")]
struct Held {
    positions: Buffer<[f32; 3]>,
    triangles: Buffer<TriangleShading>,
    normals: Buffer<[f32; 3]>,
    tangents: Option<Buffer<[f32; 4]>>,
    uvs0: Option<Buffer<[f32; 2]>>,
    uvs1: Option<Buffer<[f32; 2]>>,
    colors: Option<Buffer<[f32; 4]>>,
    materials: Buffer<crate::shared::Material>,
    slots: Option<Buffer<TextureSlot>>,
    lights: Buffer<Light>,
    light_tree: Buffer<LightNode>,
    lights_by_triangle: Buffer<u32>,
    environment: Option<environment::Buffers>,
    nodes: Option<Buffer<BvhNode>>,
    placements: Option<Buffer<Placement>>,
    structure: Option<(Vec<Blas>, Tlas)>,
}

impl World {
    /// Uploads `scene` for a traversal, with all that `features` name. Those that it uses must be among them.
    ///
    /// # Errors
    /// No light in the scene; textures on a device without descriptor indexing; out of memory.
    pub fn new(gpu: &Gpu, scene: &Scene, trace: Trace, features: u32) -> Result<Self> {
        let has = |bits| features & bits != 0;
        let reached = Reached::new(scene);
        let materials: Vec<u32> = reached.materials.iter().map(|m| m.0).collect();
        let geometry = Geometry::new(scene, trace, &materials, has(FEATURE_INSTANCES));
        check_tree(&geometry, &gpu.info().name)?;
        let Lights {
            lights,
            tree: light_tree,
            names: light_names,
        } = lights::lights(scene, &geometry.once)?;
        let by_triangle = lights::by_triangle(&lights);
        let in_slots = reached.textures_in(scene, |_| true);
        let textures = has(ANY_SLOT)
            .then(|| texture_array(gpu, scene, &in_slots))
            .transpose()?;
        let materials = || materials.iter().map(|&m| &scene.materials[m as usize]);
        let (min, max) = scene.bounds();

        let positions = gpu.upload("positions", &geometry.positions)?;
        let structure = match trace.uses_structures() {
            true => Some(geometry.structure(gpu, &positions)?),
            false => None,
        };
        let held = Held {
            triangles: gpu.upload("triangles", &geometry.triangles)?,
            normals: gpu.upload("normals", &attribute(scene, |v| v.normal_w.into()))?,
            tangents: has(FEATURE_SLOT << SLOT_NORMAL)
                .then(|| gpu.upload("tangents", &attribute(scene, |v| v.tangent_w.into())))
                .transpose()?,
            uvs0: has(ANY_SLOT)
                .then(|| gpu.upload("TEXCOORD_0", &attribute(scene, |v| v.uv[0].into())))
                .transpose()?,
            uvs1: has(FEATURE_UV1)
                .then(|| gpu.upload("TEXCOORD_1", &attribute(scene, |v| v.uv[1].into())))
                .transpose()?,
            colors: has(FEATURE_VERTEX_COLORS)
                .then(|| gpu.upload("colours", &attribute(scene, |v| v.color.into())))
                .transpose()?,
            materials: gpu.upload("materials", &materials().map(material).collect::<Vec<_>>())?,
            slots: has(ANY_SLOT)
                .then(|| {
                    let slots = materials().flat_map(|m| slots(m, &in_slots));
                    gpu.upload("texture slots", &slots.collect::<Vec<_>>())
                })
                .transpose()?,
            lights: gpu.upload("lights", &lights)?,
            light_tree: gpu.upload("light tree", &light_tree)?,
            lights_by_triangle: gpu.upload("lights by triangle", &by_triangle)?,
            environment: has(FEATURE_ENVIRONMENT)
                .then(|| environment::upload(gpu, &environment::of(scene)))
                .transpose()?,
            positions,
            nodes: (!trace.uses_structures())
                .then(|| gpu.upload("scene tree", &geometry.nodes))
                .transpose()?,
            placements: has(FEATURE_INSTANCES)
                .then(|| gpu.upload("placements", &geometry.placements))
                .transpose()?,
            structure,
        };
        let world = crate::shared::World {
            positions_w: held.positions.ptr(),
            triangles: held.triangles.ptr(),
            normals_w: held.normals.ptr(),
            tangents_w: ptr(&held.tangents),
            uvs0: ptr(&held.uvs0),
            uvs1: ptr(&held.uvs1),
            colors: ptr(&held.colors),
            materials: held.materials.ptr(),
            texture_slots: ptr(&held.slots),
            lights: held.lights.ptr(),
            light_tree: held.light_tree.ptr(),
            lights_by_triangle: held.lights_by_triangle.ptr(),
            nodes: ptr(&held.nodes),
            placements: ptr(&held.placements),
            tlas: held
                .structure
                .as_ref()
                .map_or([0; 2], |(_, tlas)| address_words(tlas.address())),
            groups: geometry
                .groups
                .first()
                .map_or([0; 4], |g| [g[0], g[1], g[2], g[3]]),
            node: geometry.root,
            light_count: lights.len() as u32,
            first_delta_light: by_triangle.len() as u32,
            unused: 0,
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
            stack_size: geometry.stack_size.max(1),
            bounds_w: (min, max),
            light_names,
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

    /// A pass that traces this world. Its arguments begin with the world's address. `features` are FEATURE_
    /// bits beside the world's, `constants` the specialization constants from id 2 on.
    pub fn pass(
        &self,
        gpu: &Gpu,
        stem: &'static str,
        features: u32,
        constants: &[u32],
    ) -> Result<Pass> {
        let features = self.features | features;
        let constants = [&[features, self.stack_size], constants].concat();
        let (textures, textured) = match &self.textures {
            Some(textures) => (Some(textures), ".textured"),
            None => (None, ""),
        };
        let code = spirv(&format!("{stem}.{}{textured}", self.trace.variant()))?;
        if self.trace != Trace::Pipeline {
            return gpu.pass(stem, code, &constants, textures);
        }
        let any_hit = match features & (FEATURE_ALPHA | FEATURE_BLEND | FEATURE_UNLIT) {
            0 => None,
            _ => Some(spirv(&format!("scene.any{textured}"))?),
        };
        let called = RayShaders {
            miss: Some(spirv("scene.miss")?),
            closest_hit: Some(spirv("scene.closest")?),
            any_hit,
            intersection: None,
        };
        gpu.ray_pass(stem, code, &called, &constants, textures)
    }
}

/// A device address as shaders take it: low word, high word.
pub fn address_words(address: u64) -> [u32; 2] {
    [address as u32, (address >> 32) as u32]
}

fn ptr<T>(buffer: &Option<Buffer<T>>) -> Ptr<T> {
    buffer.as_ref().map_or(Ptr::null(), Buffer::ptr)
}

fn attribute<T>(scene: &Scene, of: impl Fn(&Vertex) -> T) -> Vec<T> {
    scene.stored_vertices().map(of).collect()
}

/// The software traversal's stack keeps a node in 24 bits.
fn check_tree(geometry: &Geometry, device: &str) -> Result<()> {
    let nodes = geometry.nodes.len();
    if nodes <= 1 << 24 {
        return Ok(());
    }
    Err(Error::Device {
        device: device.into(),
        fault: format!("the scene's tree has {nodes} nodes; --trace software takes 2^24 at most"),
    })
}

/// What the software tree and the acceleration structure cannot hold.
pub fn check_size(scene: &Scene, device: &str) -> Result<()> {
    if scene.materials.len() > TRIANGLE_MATERIAL_MASK as usize {
        return Err(Error::Device {
            device: device.into(),
            fault: "more than 2^27 materials".into(),
        });
    }
    // The tree keeps a leaf's first triangle in 28 bits.
    let triangles = scene.stored_triangles().count();
    if triangles >= 1 << 28 {
        return Err(Error::Device {
            device: device.into(),
            fault: format!("the scene has {triangles} triangles; at most 2^28 can be traced"),
        });
    }
    // Acceleration structures have 24 bits for it and the part that is seen from one side.
    let places: usize = scene.meshes.iter().map(|mesh| mesh.places.len()).sum();
    if places >= 1 << 23 {
        return Err(Error::Device {
            device: device.into(),
            fault: format!("the scene shows meshes {places} times; less than 2^23 can be traced"),
        });
    }
    Ok(())
}
