//! The structs that Rust and GLSL both read, declared once.
//!
//! `shared_structs!` makes the `Pod` struct and [`glsl_header`] prints its GLSL twin in scalar
//! layout, so the two cannot differ: `Pod` refuses hidden padding at compile time, and scalar
//! layout adds none. See [`glsl`] for what else GLSL gets.

pub mod glsl;

use crate::gpu::{GROUP_SIZE, Ptr};
use bytemuck::{Pod, Zeroable};
use glsl::{Glsl, Header, shared_structs};

macro_rules! shared_constants {
    ($($(#[$meta:meta])* $name:ident = $value:expr;)*) => {
        $($(#[$meta])* pub const $name: u32 = $value;)*
        const CONSTANTS: &[(&str, u32)] = &[$((stringify!($name), $name)),*];
    };
}

/// The text of the virtual file `shared.glsl` that every pass includes.
pub fn glsl_header() -> String {
    let mut header = Header::default();
    for (name, value) in CONSTANTS {
        header.text += &format!("const uint {name} = {value}u;\n");
    }
    header.text += &format!("const uint GROUP_SIZE = {GROUP_SIZE}u;\n");
    header.text += &format!("const float FOLD_COSINE = {FOLD_COSINE:?};\n");
    header.text += &format!("const float GRID_JOIN = {GRID_JOIN:?};\n");
    <Ptr<f32>>::declare(&mut header);
    declare_structs(&mut header);
    header.text
}

/// Faces whose normals differ by more are folded: no photon counts across, and no kernel reaches.
pub const FOLD_COSINE: f32 = 0.5;

/// Points search a hashed grid together that lie within so many radii of one of them, along each axis: the
/// rows of cells that they reach then span at most four cells of edge 2r.
pub const GRID_JOIN: f32 = 1.9;

shared_constants! {
    /// "There is none": no texture, no hit, no child.
    NONE = u32::MAX;
    /// [`Light::kind`].
    LIGHT_TRIANGLE = 0;
    LIGHT_POINT = 1;
    LIGHT_SPOT = 2;
    LIGHT_DIRECTIONAL = 3;
    LIGHT_ENVIRONMENT = 4;
    /// [`TriangleShading::material`]: the low bits index the material.
    TRIANGLE_MATERIAL_MASK = 0x07ff_ffff;
    /// Edge i, from corner i to corner i + 1, is this bit shifted by i: the surface ends or folds there.
    TRIANGLE_EDGE = 0x0800_0000;
    /// The triangle has to be asked whether it is there (see `is_absent` in `surface.glsl`).
    TRIANGLE_ALPHA = 0x4000_0000;
    /// The triangle is not there seen from behind (glTF: doubleSided false).
    TRIANGLE_ONE_SIDED = 0x8000_0000;
    /// [`Material::flags`].
    MATERIAL_SOLID = 1;
    MATERIAL_BLEND = 2;
    MATERIAL_UNLIT = 4;
    /// What the scene contains and the user asked for: bits of specialization constant 0.
    FEATURE_SPECULAR = 1;
    FEATURE_TRANSMISSION = 2;
    FEATURE_ABSORPTION = 4;
    FEATURE_ALPHA = 8;
    FEATURE_ONE_SIDED = 16;
    FEATURE_DELTA_LIGHTS = 32;
    FEATURE_LEDGER = 64;
    FEATURE_STOCHASTIC = 128;
    FEATURE_DIRECT_RAYS = 256;
    FEATURE_ENVIRONMENT = 512;
    FEATURE_BLEND = 1024;
    FEATURE_UNLIT = 2048;
    FEATURE_DIFFUSE = 1 << 18;
    FEATURE_AREA_LIGHTS = 1 << 19;
    FEATURE_ROUGH = 1 << 20;
    FEATURE_METALLIC = 1 << 21;
    FEATURE_VERTEX_COLORS = 1 << 22;
    FEATURE_UV1 = 1 << 23;
    FEATURE_INSTANCES = 1 << 24;
    /// Textures in the slot with this number, shifted by it.
    FEATURE_SLOT = 1 << 25;
    /// Triangles in a leaf of the software scene tree at most; a leaf of so many is one [`Placement`].
    LEAF_TRIANGLES = 4;
    LEAF_PLACEMENT = 15;
    /// Bits of a leaf's first triangle.
    LEAF_SHIFT = 28;
    /// Rows of [`World::texture_slots`] for each material, in this order.
    SLOT_BASE_COLOR = 0;
    SLOT_METALLIC_ROUGHNESS = 1;
    SLOT_NORMAL = 2;
    SLOT_EMISSION = 3;
    SLOT_SPECULAR = 4;
    SLOT_SPECULAR_COLOR = 5;
    SLOT_TRANSMISSION = 6;
    SLOTS_PER_MATERIAL = 7;
    /// The two photon maps; also bit of the instance mask and the top bit of the sort key.
    MAP_CAUSTIC = 0;
    MAP_GLOBAL = 1;
    /// Photons in a leaf of the software photon tree.
    PHOTON_LEAF = 8;
    /// An inner node of the software photon tree has 2 to this power children: 2 or 4.
    PHOTON_FANOUT_LOG2 = 2;
    /// Cells of a photon grid along an axis, less one: f32 still tells them apart.
    GRID_CELL_MAX = (1 << 22) - 1;
    /// How often an emissive triangle is split into four at most.
    PART_LEVELS = 8;
    /// Prefix sum: entries that one thread sums.
    SCAN_CHUNK = 512;
    /// Cells of the culling mask (Kern et al. 2023, section 4.5), one bit each.
    CULL_CELLS = 1 << 22;
    /// Photons that stochastic evaluation can keep.
    RESERVOIR_MAX = 8;
}

shared_structs! {
    /// A node of the software scene tree: up to four children with their boxes, in cells of a grid of their own.
    struct BvhNode {
        /// Corner of the grid.
        min_w: [f32; 3],
        /// Edges (m) of a cell along x, y and z as exponents of floats, a byte each; number of children in the top byte.
        exponents: u32,
        /// Where the boxes begin along x, y and z, and where they end; child i in byte i.
        low: [u32; 3],
        high: [u32; 3],
        /// Index of a node, or of a leaf's first triangle below its number of triangles in the top 4 bits.
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

    /// A material's use of a texture: its number or NONE, the UV set, and (u', v') = rows · (u, v, 1).
    struct TextureSlot {
        texture: u32,
        uv_set: u32,
        row0: [f32; 3],
        row1: [f32; 3],
    }

    /// Something that emits photons, and its row of the alias table.
    struct Light {
        kind: u32,
        /// The triangle of an emissive one, and which part of it: see `world::emission`.
        triangle: u32,
        part: u32,
        part_corner: [f32; 2],
        part_edge: f32,
        /// The probability that a light path begins here.
        probability: f32,
        /// Alias method (Vose 1991): keep this row below `alias_threshold`, else take row `alias`.
        alias_threshold: f32,
        alias: u32,
        position_w: [f32; 3],
        /// The direction that a spot or directional light shines in.
        direction_w: [f32; 3],
        /// Intensity (cd), or illuminance (lx) of a directional light.
        intensity: [f32; 3],
        cos_inner: f32,
        cos_outer: f32,
        /// The way to it from the light tree's root: a bit for each level, the lowest first, 1 for the right child.
        trail: u32,
        unused: u32,
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
        /// The probability of the cells before this one among those of its row; one more for the end of each row.
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
        center_w: [f32; 3],
        /// Of the bounding sphere (m).
        radius: f32,
        unused: u32,
        environment: Environment,
    }

    /// What changes from one iteration to the next.
    struct Frame {
        camera_position_w: [f32; 3],
        /// Camera axes, scaled so that a pixel's direction is forward + x right + y up, x and y in [-1, 1]; of an
        /// orthographic camera its origin is position + x right + y up.
        camera_right_w: [f32; 3],
        camera_up_w: [f32; 3],
        camera_forward_w: [f32; 3],
        /// 1: rays are parallel.
        orthographic: u32,
        size: [u32; 2],
        seed: u32,
        iteration: u32,
        /// Light paths of this iteration.
        paths: u32,
        /// Edges of a path from the eye to the light at most.
        max_depth: u32,
        /// Radii (m) of the caustic and the global map.
        radius: [f32; 2],
        /// Probability that a global photon is not stored.
        reject: f32,
        /// 1: photons outside the culling mask are not stored.
        cull: u32,
        /// Photons that the buffer holds.
        capacity: u32,
    }

    /// Where a view path chose the diffuse lobe (48 bytes in Kern et al. 2023, table 1).
    struct ViewSample {
        position_w: [f32; 3],
        /// The path's throughput × diffuse colour / π / the probability of having chosen diffuse.
        /// All zero: this pixel has no sample.
        weight: [f32; 3],
        /// To the eye; octahedral.
        wo: u32,
        /// Face normal on the eye's side; octahedral.
        normal_g: u32,
        /// Fresnel F0 and F90 of the dielectric layer over the diffuse one, as two halves.
        fresnel: u32,
        /// Edges from the eye to here.
        depth: u32,
        /// Of the pixel at this distance (m).
        footprint: f32,
        /// The two nearest edges where the surface ends or folds: distance (m) and, octahedral, the
        /// direction from the edge to here.
        edge_distance: [f32; 2],
        edge_normal: [u32; 2],
        unused: u32,
    }

    /// A photon as emission leaves it. Its power and a box (24 bytes) take 40 (Kern et al. 2023, table 2).
    struct Photon {
        position_w: [f32; 3],
        power: PhotonPower,
        path: u32,
        /// How many photons the path left before this one; the map in the top bit.
        number: u32,
        unused: u32,
    }

    /// What a photon carries.
    struct PhotonPower {
        /// Flux (lm): three 16-bit mantissas and a shared 10-bit exponent; 6 bits of path edges.
        flux: [u32; 2],
        /// Where it came from; octahedral.
        wi: u32,
        /// Face normal on the side that it arrived on; octahedral.
        normal_g: u32,
    }

    /// Counted by emission.
    struct Counters {
        /// Of both maps, those beyond the capacity included.
        photons: u32,
        /// Stored ones of the caustic map.
        caustic_photons: u32,
        culled: u32,
        rejected: u32,
        /// Ends of paths.
        absorbed: u32,
        escaped: u32,
        terminated: u32,
        too_long: u32,
    }

    /// Running means of one pixel over the iterations, each as an unevaluated sum of two floats.
    struct FilmPixel {
        emission: [f32; 3],
        direct: [f32; 3],
        caustic: [f32; 3],
        global: [f32; 3],
        albedo: [f32; 3],
        normal_w: [f32; 3],
        depth: f32,
        /// Variance of one iteration's luminance.
        variance: f32,
        /// Of both maps (see [`FramePixel::bias`]), and the variance of one iteration's.
        bias: f32,
        bias_variance: f32,
        emission_low: [f32; 3],
        direct_low: [f32; 3],
        caustic_low: [f32; 3],
        global_low: [f32; 3],
        albedo_low: [f32; 3],
        normal_w_low: [f32; 3],
        depth_low: f32,
        variance_low: f32,
        bias_low: f32,
        bias_variance_low: f32,
    }

    /// One iteration's values of one pixel.
    struct FramePixel {
        emission: [f32; 3],
        direct: [f32; 3],
        caustic: [f32; 3],
        global: [f32; 3],
        albedo: [f32; 3],
        normal_w: [f32; 3],
        /// Distance from the eye to the first surface (m); 0 where there is none.
        depth: f32,
        /// Luminance (nit) gathered from the caustic and the global map within the radius less that within
        /// half of it: what shrinking it would still change (see `render::accuracy`).
        bias: [f32; 2],
        /// Photons within the radius, of the caustic and the global map; counted only where pixels have radii of their own.
        found: [u32; 2],
        unused: u32,
    }

    /// What `sppm` keeps of a pixel, of the caustic and the global map.
    struct PixelStatistics {
        /// Photons found so far, each iteration's times α.
        kept: [f32; 2],
        /// Of the next iteration (m²).
        radius2: [f32; 2],
    }

    /// The arguments of `view`. Those of passes that trace the scene begin with it: the shaders that their
    /// rays call read no more.
    struct ViewPush {
        world: Ptr<World>,
        frame: Ptr<Frame>,
        samples: Ptr<ViewSample>,
        pixels: Ptr<FramePixel>,
    }

    /// The arguments of `path`.
    struct PathPush {
        world: Ptr<World>,
        frame: Ptr<Frame>,
        pixels: Ptr<FramePixel>,
    }

    struct CullPush {
        frame: Ptr<Frame>,
        samples: Ptr<ViewSample>,
        mask: Ptr<u32>,
    }

    struct EmitPush {
        world: Ptr<World>,
        frame: Ptr<Frame>,
        mask: Ptr<u32>,
        photons: Ptr<Photon>,
        /// How many each path leaves.
        path_photons: Ptr<u32>,
        counters: Ptr<Counters>,
    }

    /// Exclusive prefix sum, one level of a tree: `values` become offsets within their chunk, the
    /// chunk's total goes to `totals`.
    struct ScanPush {
        values: Ptr<u32>,
        totals: Ptr<u32>,
        count: u32,
        unused: u32,
    }

    struct PhotonKeysPush {
        photons: Ptr<Photon>,
        path_offsets: Ptr<u32>,
        keys: Ptr<u32>,
        indices: Ptr<u32>,
        /// The box that holds all photons, for the Hilbert curve.
        min_w: [f32; 3],
        scale: [f32; 3],
        /// Of the caustic and the global map, for slots.
        grids: Ptr<PhotonGrid>,
        count: u32,
        unused: u32,
    }

    struct SortPush {
        keys: Ptr<u32>,
        values: Ptr<u32>,
        keys_out: Ptr<u32>,
        values_out: Ptr<u32>,
        /// `histogram[digit * chunks + chunk]`.
        histogram: Ptr<u32>,
        count: u32,
        /// The digit: so many bits above so many others.
        digit_bits: u32,
        shift: u32,
        unused: u32,
    }

    /// Photons in sorted order, caustic ones first. Pairs are of the caustic and the global map.
    struct PhotonMaps {
        positions_w: Ptr<[f32; 3]>,
        power: Ptr<PhotonPower>,
        /// For the acceleration structures.
        boxes: Ptr<PhotonBox>,
        /// Complete trees in heap order (see `near.glsl`). A box is a word an axis: 16 bits of its low
        /// side, 16 of its high side, in cells of a grid with this corner and so many cells a metre.
        caustic_tree: Ptr<[u32; 3]>,
        global_tree: Ptr<[u32; 3]>,
        grid_min_w: [f32; 3],
        grid_scale: f32,
        tlas: [u32; 2],
        first: [u32; 2],
        count: [u32; 2],
        first_leaf: [u32; 2],
        caustic_grid: PhotonGrid,
        global_grid: PhotonGrid,
        lists: PhotonLists,
    }

    /// A hashed grid over one photon map (see `grid.glsl`).
    struct PhotonGrid {
        /// Photons of slot s lie from `starts[s]` to before `starts[s + 1]`.
        starts: Ptr<u32>,
        /// Corner of the grid, and cells per metre.
        min_w: [f32; 3],
        scale: [f32; 3],
        first_slot: u32,
        /// Slots of each of the table's 16 parts, a power of two.
        row_slots: u32,
    }

    /// A hash table of photon lists over both maps (see `lists.glsl`).
    struct PhotonLists {
        /// The photon whose cell has the bucket, or NONE.
        owners: Ptr<u32>,
        /// Photons put into the bucket.
        counts: Ptr<u32>,
        /// Keys of those kept, the same number of places for each bucket.
        keys: Ptr<u32>,
        /// The map of each photon.
        maps: Ptr<u32>,
        min_w: [f32; 3],
        /// Cells per metre of the caustic and the global map.
        scale: [f32; 2],
        /// A power of two.
        buckets: u32,
        /// Of the keys in this iteration.
        seed: u32,
        unused: u32,
    }

    struct ListInsertPush {
        maps: Ptr<PhotonMaps>,
        count: u32,
        unused: u32,
    }

    struct GridStartsPush {
        keys: Ptr<u32>,
        starts: Ptr<u32>,
        /// Of photons.
        count: u32,
        slots: u32,
    }

    /// An axis-aligned box, as acceleration structures want it.
    struct PhotonBox {
        min_w: [f32; 3],
        max_w: [f32; 3],
    }

    struct PlacePush {
        frame: Ptr<Frame>,
        photons: Ptr<Photon>,
        indices: Ptr<u32>,
        maps: Ptr<PhotonMaps>,
        count: u32,
        unused: u32,
    }

    /// One level of a photon tree.
    struct TreePush {
        maps: Ptr<PhotonMaps>,
        map: u32,
        /// First node of this level and how many it has.
        first: u32,
        count: u32,
        unused: u32,
    }

    struct GatherPush {
        frame: Ptr<Frame>,
        samples: Ptr<ViewSample>,
        maps: Ptr<PhotonMaps>,
        pixels: Ptr<FramePixel>,
        /// Where pixels have radii of their own.
        statistics: Ptr<PixelStatistics>,
        map: u32,
        /// Photons kept by stochastic evaluation.
        reservoir: u32,
    }

    struct PixelRadiiPush {
        frame: Ptr<Frame>,
        pixels: Ptr<FramePixel>,
        statistics: Ptr<PixelStatistics>,
        alpha: f32,
        unused: u32,
    }

    struct FilmPush {
        frame: Ptr<Frame>,
        pixels: Ptr<FramePixel>,
        film: Ptr<FilmPixel>,
    }

    /// What `bench.rays` traces.
    struct Ray {
        origin_w: [f32; 3],
        /// Unit length.
        direction_w: [f32; 3],
        /// Where a shadow ray ends in metres.
        distance_w: f32,
    }

    struct BenchRaysPush {
        world: Ptr<World>,
        rays: Ptr<Ray>,
        met: Ptr<u32>,
        count: u32,
        /// 1: ask only whether something is in the way.
        shadow: u32,
    }
}

/// Shaders that rays call know nothing of a pass's arguments but that they begin with the world.
const _: () = {
    use std::mem::offset_of;
    assert!(offset_of!(ViewPush, world) == 0);
    assert!(offset_of!(PathPush, world) == 0);
    assert!(offset_of!(EmitPush, world) == 0);
    assert!(offset_of!(BenchRaysPush, world) == 0);
};
