// From a hit to a surface: interpolation, textures, the material's parameters (glTF 2.0, section 3.9).
// In: a triangle and barycentrics. Out: Surface (see bsdf.glsl). Needs bsdf.glsl, math.glsl and sequence.glsl.

#ifdef TEXTURES
layout(set = 0, binding = 0) uniform sampler2D textures[];

bool has_slot(uint slot) { return (FEATURES >> slot & FEATURE_SLOT) != 0u; }

// One slot of a material; white where the slot is empty.
vec4 fetch(World world, uint material, uint slot, vec2 uv0, vec2 uv1) {
    if (!has_slot(slot)) return vec4(1.0);
    TextureSlot t = load_TextureSlot(world.texture_slots, material * SLOTS_PER_MATERIAL + slot);
    if (t.texture == NONE) return vec4(1.0);
    vec3 uv = vec3(t.uv_set == 0u ? uv0 : uv1, 1.0);
    return textureLod(textures[nonuniformEXT(t.texture)], vec2(dot(t.row0, uv), dot(t.row1, uv)), 0.0);
}
#endif

struct Corners {
    vec3 p0;
    vec3 p1;
    vec3 p2;
};

mat3 world_from_mesh(Placement p) { return mat3(p.world_from_mesh_x, p.world_from_mesh_y, p.world_from_mesh_z); }
mat3 mesh_from_world(Placement p) { return mat3(p.mesh_from_world_x, p.mesh_from_world_y, p.mesh_from_world_z); }

// In the space of its mesh: the world, if the mesh is shown once, as every emissive one is.
Corners corners_of(World world, uint triangle) {
    return Corners(world.positions_w.at[3u * triangle], world.positions_w.at[3u * triangle + 1u], world.positions_w.at[3u * triangle + 2u]);
}

// In the world. Places do not mirror: fronts stay fronts.
Corners corners_at(World world, uint triangle, uint place) {
    Corners c = corners_of(world, triangle);
    if (!HAS_INSTANCES) return c;
    Placement p = load_Placement(world.placements, place);
    mat3 m = world_from_mesh(p);
    return Corners(m * c.p0 + p.origin_w, m * c.p1 + p.origin_w, m * c.p2 + p.origin_w);
}

vec3 normal_at(World world, uint vertex, uint place) {
    vec3 n = world.normals_w.at[vertex];
    return HAS_INSTANCES ? normalize(n * mesh_from_world(load_Placement(world.placements, place))) : n;
}

vec3 face_normal(Corners c) {
    // Scaled first: edges of 1e-20 m would underflow in the product.
    vec3 e1 = c.p1 - c.p0, e2 = c.p2 - c.p0;
    float l1 = max_component(abs(e1)), l2 = max_component(abs(e2));
    vec3 n = cross(e1 / l1, e2 / l2);
    // Not NaN for a sliver whose corners f32 rounds onto a line.
    return n * inversesqrt(max(dot(n, n), 1e-30));
}

vec3 interpolate(vec3 a, vec3 b, vec3 c, vec2 bary) { return a + bary.x * (b - a) + bary.y * (c - a); }

// Rays leave a face at this distance along its normal: 16 steps of the float grid at the face's
// largest coordinate, beyond the rounding of an interpolated point (Wächter & Binder 2019 use an
// absolute term besides, which is wrong for small scenes).
float origin_offset(Corners c) {
    return 9.5367431640625e-7 * max_component(max(abs(c.p0), max(abs(c.p1), abs(c.p2))));
}

vec4 color_at(World world, uvec3 v, vec2 bary) {
    if (!HAS_VERTEX_COLORS) return vec4(1.0);
    vec4 a = load_vec4(world.colors, v.x), b = load_vec4(world.colors, v.y), c = load_vec4(world.colors, v.z);
    return a + bary.x * (b - a) + bary.y * (c - a);
}

vec2 uv_at(vec2Ref uvs, uvec3 v, vec2 bary) {
    return interpolate(vec3(load_vec2(uvs, v.x), 0), vec3(load_vec2(uvs, v.y), 0), vec3(load_vec2(uvs, v.z), 0), bary).xy;
}

// Share of a point of a triangle that is there: of a blended one the base colour's alpha, else all or nothing.
float coverage_at(World world, uint triangle, vec2 bary) {
    TriangleShading t = load_TriangleShading(world.triangles, triangle);
    uint m = t.material & TRIANGLE_MATERIAL_MASK;
    float alpha = world.materials.at[m].base_color.a * color_at(world, t.vertices, bary).a;
#ifdef TEXTURES
    vec2 uv0 = uv_at(world.uvs0, t.vertices, bary), uv1 = HAS_UV1 ? uv_at(world.uvs1, t.vertices, bary) : uv0;
    alpha *= fetch(world, m, SLOT_BASE_COLOR, uv0, uv1).a;
#endif
    if (HAS_BLEND && (world.materials.at[m].flags & MATERIAL_BLEND) != 0u) return alpha;
    return alpha < world.materials.at[m].alpha_cutoff ? 0.0 : 1.0;
}

// Whether a triangle with TRIANGLE_ALPHA is not there for a ray. Blended ones are there with a probability of
// alpha (stochastic transparency, Enderton et al. 2010). `chance`: number of the path, and a seed for each of
// its rays; with the triangle they name a random number, so that all traversals decide alike. It is
// spread evenly over the paths.
bool is_absent(World world, uint triangle, uint place, vec2 bary, bool eye, uvec2 chance) {
    TriangleShading t = load_TriangleShading(world.triangles, triangle);
    if (HAS_UNLIT && !eye && (world.materials.at[t.material & TRIANGLE_MATERIAL_MASK].flags & MATERIAL_UNLIT) != 0u) return true;
    float coverage = coverage_at(world, triangle, bary);
    if (!HAS_BLEND) return coverage == 0.0;
    uint seed = chance.y ^ mix_seed(t.vertices.x ^ mix_seed(t.vertices.y ^ mix_seed(t.vertices.z)));
    if (HAS_INSTANCES) seed ^= mix_seed(world.placements.at[place].number);
    return coverage <= sequence_pair(chance.x, seed).x;
}

// `wo` points back along the ray that hit.
Surface surface_at(World world, uint triangle, uint place, vec2 bary, vec3 wo) {
    Corners p = corners_at(world, triangle, place);
    TriangleShading t = load_TriangleShading(world.triangles, triangle);
    uvec3 v = t.vertices;
    Material m = load_Material(world.materials, t.material & TRIANGLE_MATERIAL_MASK);

    Surface s;
    s.position_w = interpolate(p.p0, p.p1, p.p2, bary);
    s.offset = origin_offset(p);
    s.wo = wo;
    vec3 n_g = face_normal(p);
    s.front = dot(n_g, wo) >= 0.0;
    s.normal_g = s.front ? n_g : -n_g;
    vec3 n_s = interpolate(normal_at(world, v.x, place), normal_at(world, v.y, place), normal_at(world, v.z, place), bary);
    vec4 color = m.base_color * color_at(world, v, bary);
    float metallic = m.metallic, roughness = m.roughness, specular = m.specular, transmission = m.transmission;
    vec3 specular_color = m.specular_color;
    s.emission = HAS_AREA_LIGHTS ? m.emission : vec3(0.0);
#ifdef TEXTURES
    uint slot = t.material & TRIANGLE_MATERIAL_MASK;
    vec2 uv0 = uv_at(world.uvs0, v, bary), uv1 = HAS_UV1 ? uv_at(world.uvs1, v, bary) : uv0;
    color *= fetch(world, slot, SLOT_BASE_COLOR, uv0, uv1);
    vec4 mr = fetch(world, slot, SLOT_METALLIC_ROUGHNESS, uv0, uv1);
    roughness *= mr.g;
    metallic *= mr.b;
    s.emission *= fetch(world, slot, SLOT_EMISSION, uv0, uv1).rgb;
    specular *= fetch(world, slot, SLOT_SPECULAR, uv0, uv1).a;
    specular_color *= fetch(world, slot, SLOT_SPECULAR_COLOR, uv0, uv1).rgb;
    transmission *= fetch(world, slot, SLOT_TRANSMISSION, uv0, uv1).r;
    if (has_slot(SLOT_NORMAL) && world.texture_slots.at[slot * SLOTS_PER_MATERIAL + SLOT_NORMAL].texture != NONE) {
        vec4 a = load_vec4(world.tangents_w, v.x), b = load_vec4(world.tangents_w, v.y), c = load_vec4(world.tangents_w, v.z);
        if (HAS_INSTANCES) {
            mat3 m = world_from_mesh(load_Placement(world.placements, place));
            a.xyz = normalize(m * a.xyz);
            b.xyz = normalize(m * b.xyz);
            c.xyz = normalize(m * c.xyz);
        }
        vec4 tangent = a + bary.x * (b - a) + bary.y * (c - a);
        vec3 n = fetch(world, slot, SLOT_NORMAL, uv0, uv1).xyz * 2.0 - 1.0;
        n.xy *= m.normal_scale;
        vec3 bitangent = cross(n_s, tangent.xyz) * tangent.w;
        vec3 mapped = n.x * tangent.xyz + n.y * bitangent + n.z * n_s;
        if (dot(mapped, mapped) > 0.0) n_s = mapped;
    }
#endif
    float n_length = length(n_s);
    n_s = n_length > 0.0 ? n_s / n_length : n_g;
    if (!s.front) n_s = -n_s;
    s.normal_s = n_s;

    // Shown as it is, by both sides, to the eye alone: 1 nit where it is white.
    bool unlit = HAS_UNLIT && (m.flags & MATERIAL_UNLIT) != 0u;
    if (unlit) {
        s.emission = color.rgb;
        color.rgb = vec3(0.0);
    }
    s.base_color = color.rgb;
    // What a random number of 24 bits makes of alpha at least.
    s.coverage = HAS_BLEND && (m.flags & MATERIAL_BLEND) != 0u ? max(color.a, 5.9604644775390625e-8) : 1.0;
    s.metallic = HAS_METALLIC ? metallic : 0.0;
    s.transmission = HAS_TRANSMISSION ? transmission : 0.0;
    // A narrower lobe is lost in the rounding of directions, which are unit vectors of f32.
    s.alpha = HAS_ROUGH && roughness > 1e-3 ? roughness * roughness : 0.0;
    s.f0 = min(square((m.ior - 1.0) / (m.ior + 1.0)) * specular_color, vec3(1.0)) * specular;
    s.f90 = specular;
    s.ior = m.ior;
    s.solid = (m.flags & MATERIAL_SOLID) != 0u;
    s.absorption = m.absorption;
    if (!s.front && !unlit) s.emission = vec3(0.0);
    return s;
}

// Where a ray towards wi starts.
vec3 leave(Surface s, vec3 wi) {
    return s.position_w + s.normal_g * (dot(wi, s.normal_g) >= 0.0 ? s.offset : -s.offset);
}

// Beer–Lambert. Beyond the bound it is 0 in f32, and NaN on Mesa's CPU driver where the product is huge.
vec3 transmittance(vec3 absorption, float distance_w) { return exp(-min(absorption * distance_w, vec3(104.0))); }

// Over a segment that ended at s. Where a solid's back is hit, the segment lay in it;
// elsewhere in `medium` [1/m], what the path entered last: a floor under water is no part of the water.
vec3 segment_transmittance(Surface s, vec3 medium, float distance_w) {
    if (!HAS_ABSORPTION) return vec3(1.0);
    return transmittance(s.solid && !s.front ? s.absorption : medium, distance_w);
}

// What a path is in after an event at s.
vec3 next_medium(Surface s, vec3 medium, uint lobe) {
    bool crosses = lobe == LOBE_TRANSMISSION;
    if (!HAS_ABSORPTION || !s.solid) return medium;
    return s.front == crosses ? s.absorption : crosses ? vec3(0.0) : medium;
}
