//! Constants that Rust and GLSL both read.

macro_rules! shared_constants {
    ($($(#[$meta:meta])* $name:ident = $value:expr;)*) => {
        $($(#[$meta])* pub const $name: u32 = $value;)*
        pub(super) const CONSTANTS: &[(&str, u32)] = &[$((stringify!($name), $name)),*];
    };
}

/// Faces whose normals differ by more are folded: no photon counts across, and no kernel reaches.
pub const FOLD_COSINE: f32 = 0.5;

/// Points search a hashed grid together that lie within so many radii of one of them, along each axis: the
/// rows of cells that they reach then span at most four cells of edge 2r.
pub const GRID_JOIN: f32 = 1.9;

shared_constants! {
    /// "There is none": no texture, no hit, no child.
    NONE = u32::MAX;
    /// [`Light::kind`](super::Light::kind).
    LIGHT_TRIANGLE = 0;
    LIGHT_POINT = 1;
    LIGHT_SPOT = 2;
    LIGHT_DIRECTIONAL = 3;
    LIGHT_ENVIRONMENT = 4;
    /// [`TriangleShading::material`](super::TriangleShading::material): the low bits index the material.
    TRIANGLE_MATERIAL_MASK = 0x07ff_ffff;
    /// Edge i, from corner i to corner i + 1, is this bit shifted by i: the surface ends or folds there.
    TRIANGLE_EDGE = 0x0800_0000;
    /// The triangle has to be asked whether it is there (see `is_absent` in `surface.glsl`).
    TRIANGLE_ALPHA = 0x4000_0000;
    /// The triangle is not there seen from behind (glTF: doubleSided false).
    TRIANGLE_ONE_SIDED = 0x8000_0000;
    /// [`Material::flags`](super::Material::flags).
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
    /// Triangles in a leaf of the software scene tree at most; a leaf of so many is one [`Placement`](super::Placement).
    LEAF_TRIANGLES = 4;
    LEAF_PLACEMENT = 15;
    /// Bits of a leaf's first triangle.
    LEAF_SHIFT = 28;
    /// Rows of [`World::texture_slots`](super::World::texture_slots) for each material, in this order.
    SLOT_BASE_COLOR = 0;
    SLOT_METALLIC_ROUGHNESS = 1;
    SLOT_NORMAL = 2;
    SLOT_EMISSION = 3;
    SLOT_SPECULAR = 4;
    SLOT_SPECULAR_COLOR = 5;
    SLOT_TRANSMISSION = 6;
    SLOTS_PER_MATERIAL = 7;
    /// Records of each path that looks for light, at most.
    IMPORTANCE_RECORDS = 12;
    /// Blocks along each edge of the image, in which light is compared.
    IMPORTANCE_BLOCKS = 16;
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
