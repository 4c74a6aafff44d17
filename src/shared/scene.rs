//! The scene as shaders read it.

use super::glsl::{Glsl, Header, shared_structs};
use crate::gpu::Ptr;
use bytemuck::{Pod, Zeroable};

shared_structs! {
    /// A node of the software scene tree: up to four children with their boxes, in cells of a grid
    /// of their own.
    struct BvhNode {
        /// Corner of the grid.
        min_w: [f32; 3],
        /// Edges (m) of a cell along x, y and z as exponents of floats, a byte each; number of
        /// children in the top byte.
        exponents: u32,
        /// Where the boxes begin along x, y and z, and where they end; child i in byte i.
        low: [u32; 3],
        high: [u32; 3],
        /// Index of a node, or of a leaf's first triangle below its number of triangles in the top
        /// 4 bits.
        children: [u32; 4],
    }

    /// What shading needs of a triangle: its vertices and its material with the TRIANGLE_ flags.
    struct TriangleShading {
        vertices: [u32; 3],
        material: u32,
    }

    /// See `scene::Material`.
    struct Material {
        base_color: [f32; 4],
        emission: [f32; 3],
        metallic: f32,
        specular_color: [f32; 3],
        specular: f32,
        /// σ [1/m].
        absorption: [f32; 3],
        transmission: f32,
        roughness: f32,
        ior: f32,
        alpha_cutoff: f32,
        normal_scale: f32,
        flags: u32,
        unused: u32,
    }

    /// A material's use of a texture: its number or NONE, the UV set, and (u', v') = rows · (u, v,
    /// 1).
    struct TextureSlot {
        texture: u32,
        uv_set: u32,
        row0: [f32; 3],
        row1: [f32; 3],
    }

    /// Something that emits photons.
    struct Light {
        kind: u32,
        /// The triangle of an emissive one, and which part of it: see `world::emission`.
        triangle: u32,
        part: u32,
        part_corner: [f32; 2],
        part_edge: f32,
        /// The probability that a light path begins here, without a guide.
        probability: f32,
        /// The first of the 2^32 numbers that choose this light.
        first_number: u32,
        position_w: [f32; 3],
        /// The direction that a spot or directional light shines in.
        direction_w: [f32; 3],
        /// Intensity (cd), or illuminance (lx) of a directional light.
        intensity: [f32; 3],
        cos_inner: f32,
        cos_outer: f32,
        /// The way to it from the light tree's root: a bit for each level, the lowest first, 1 for
        /// the right child.
        trail: u32,
    }

    /// A group of lights, or one (see `light_tree.glsl`).
    struct LightNode {
        center_w: [f32; 3],
        /// Of the sphere that holds them, squared (m²).
        radius2: f32,
        /// cd.
        intensity: f32,
        /// Of those infinitely far away (lx).
        irradiance: f32,
        /// The left child, beside the right one; NONE for a light.
        child: u32,
        light: u32,
    }

    /// A place of a mesh that is stored once: world = linear part · mesh + origin.
    struct Placement {
        /// Columns of the linear part, and of its inverse.
        world_from_mesh_x: [f32; 3],
        world_from_mesh_y: [f32; 3],
        world_from_mesh_z: [f32; 3],
        mesh_from_world_x: [f32; 3],
        mesh_from_world_y: [f32; 3],
        mesh_from_world_z: [f32; 3],
        /// Of the mesh's own space.
        origin_w: [f32; 3],
        /// The mesh's part of [`World::groups`].
        groups: [u32; 4],
        /// The root of the mesh's tree.
        node: u32,
        /// The same for each traversal; 0 for what is shown once.
        number: u32,
        unused: u32,
    }

    /// Light from all around (see `environment.glsl`).
    struct Environment {
        /// nit, row by row from the zenith.
        radiance: Ptr<[f32; 3]>,
        /// Rows of cells between the texels' middles: one more than texels have, and the end.
        rows: Ptr<EnvironmentRow>,
        /// The probability of the cells before this one among those of its row; one more for the
        /// end of each row.
        columns: Ptr<f32>,
        /// Width and height.
        size: [u32; 2],
        /// About +Y, in turns.
        rotation: f32,
        unused: u32,
    }

    struct EnvironmentRow {
        /// Squares of the sine and the cosine of half the polar angle of the row's upper edge.
        half_angle2: [f32; 2],
        /// The probability of the rows before this one.
        cumulative: f32,
        /// Of a cell (sr).
        solid_angle: f32,
    }

    /// The scene on the device.
    struct World {
        /// Three corners a triangle, in the order of the traversal structure.
        positions_w: Ptr<[f32; 3]>,
        triangles: Ptr<TriangleShading>,
        /// Of each vertex; what no feature needs lies nowhere.
        normals_w: Ptr<[f32; 3]>,
        tangents_w: Ptr<[f32; 4]>,
        uvs0: Ptr<[f32; 2]>,
        uvs1: Ptr<[f32; 2]>,
        colors: Ptr<[f32; 4]>,
        materials: Ptr<Material>,
        texture_slots: Ptr<TextureSlot>,
        /// Emissive triangles, then lights without area.
        lights: Ptr<Light>,
        light_tree: Ptr<LightNode>,
        /// The emissive ones' numbers, in the order of their triangles and parts.
        lights_by_triangle: Ptr<u32>,
        nodes: Ptr<BvhNode>,
        /// With instances alone. The first is that of all that is shown once, if there is such.
        placements: Ptr<Placement>,
        tlas: [u32; 2],
        /// First triangle of each group: two-sided opaque, two-sided alpha, one-sided opaque,
        /// one-sided alpha (a geometry of the acceleration structure each).
        groups: [u32; 4],
        /// The root of the tree: over triangles, or over placements.
        node: u32,
        light_count: u32,
        /// Where the lights without area begin; the environment is the last of all.
        first_delta_light: u32,
        unused: u32,
        environment: Environment,
    }
}
