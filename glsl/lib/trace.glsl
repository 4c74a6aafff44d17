// The traversal seam for scene rays: the closest hit and occlusion, by ray query, by a ray tracing pipeline or
// by a software tree. All answer with a triangle; barycentrics and distance are computed here for all, so
// that the same triangle gives the same point.
// In: origin and unit direction in world space, range in metres. Needs surface.glsl.

// `eye`: the ray is the eye's, maybe by way of mirrors and glass, else light's. One-sided faces (glTF:
// doubleSided false) are not there seen from behind: the eye skips them, so that one can look into a closed
// room; light does not, so that none leaks in. Unlit faces are there for the eye only.
// `chance`: a number for each blended triangle (see surface.glsl).
struct Hit {
    uint triangle;
    // With instances: which placement of its mesh.
    uint place;
    vec2 bary;
    float distance_w;
};

// Shears space so that the ray is an axis (Woop, Benthin & Wald 2013): a place p relative to the
// origin lies (dot(x, p), dot(y, p)) beside the ray and dot(z, p) along it. Rows of exact ones and
// zeros instead of the paper's permutation of the axes: the same rounding.
struct Shear {
    vec3 x;
    vec3 y;
    vec3 z;
};

Shear shear_along(vec3 direction) {
    vec3 d = abs(direction);
    bool x_largest = d.x >= d.y && d.x >= d.z, y_largest = !x_largest && d.y >= d.z;
    vec3 axis_z = x_largest ? vec3(1, 0, 0) : y_largest ? vec3(0, 1, 0) : vec3(0, 0, 1);
    vec3 axis_x = axis_z.zxy, axis_y = axis_z.yzx;
    float inverse = 1.0 / dot(axis_z, direction);
    // A mirrored y where the ray runs down its axis: fronts stay fronts.
    return Shear(axis_x - axis_z * (dot(axis_x, direction) * inverse),
        (axis_y - axis_z * (dot(axis_y, direction) * inverse)) * (inverse < 0.0 ? -1.0 : 1.0), axis_z * inverse);
}

// Of a triangle's corners relative to the origin. Two triangles see exactly the opposite number at the
// edge they share, so no ray slips between them. x + y + z > 0: front.
vec3 edge_functions(vec3 a, vec3 b, vec3 c, Shear s) {
    precise float ax = dot(s.x, a), ay = dot(s.y, a), bx = dot(s.x, b), by = dot(s.y, b), cx = dot(s.x, c), cy = dot(s.y, c);
    precise vec3 e = vec3(cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
    return e;
}

// Of the point where a ray meets a triangle's plane, kept inside the triangle.
Hit complete_hit(World world, uint triangle, uint place, vec3 origin, vec3 direction) {
    Corners p = corners_at(world, triangle, place);
    vec3 e = edge_functions(p.p0 - origin, p.p1 - origin, p.p2 - origin, shear_along(direction));
    float det = e.x + e.y + e.z;
    // Hardware can hit, edge-on, what has no area here.
    vec2 bary = det != 0.0 ? clamp(e.yz / det, vec2(0.0), vec2(1.0)) : vec2(0.0);
    bary /= max(1.0, bary.x + bary.y);
    return Hit(triangle, place, bary, distance(origin, interpolate(p.p0, p.p1, p.p2, bary)));
}

#if defined(TRACE_QUERY) || defined(TRACE_PIPELINE)

// Triangle and place. `instance`: the first group, of two; with instances the place above a bit that says which.
uvec2 query_triangle(World world, uint instance, uint geometry, uint primitive) {
    if (!HAS_INSTANCES) return uvec2(world.groups[instance + geometry] + primitive, 0u);
    uint place = instance >> 1u;
    return uvec2(world.placements.at[place].groups[(instance & 1u) * 2u + geometry] + primitive, place);
}

#endif

#if defined(TRACE_QUERY)

void proceed(rayQueryEXT query, World world, vec3 origin, vec3 direction, bool eye, uvec2 chance) {
    while (rayQueryProceedEXT(query)) {
        if (!HAS_ALPHA) continue;
        uvec2 hit = query_triangle(world, rayQueryGetIntersectionInstanceCustomIndexEXT(query, false),
            rayQueryGetIntersectionGeometryIndexEXT(query, false), rayQueryGetIntersectionPrimitiveIndexEXT(query, false));
        if (!is_absent(world, hit.x, hit.y, complete_hit(world, hit.x, hit.y, origin, direction).bary, eye, chance))
            rayQueryConfirmIntersectionEXT(query);
    }
}

bool trace(World world, vec3 origin, vec3 direction, bool eye, uvec2 chance, out Hit hit) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, accelerationStructureEXT(world.tlas), eye ? gl_RayFlagsCullBackFacingTrianglesEXT : gl_RayFlagsNoneEXT, 0xff, origin, 0.0, direction, 3.0e38);
    proceed(query, world, origin, direction, eye, chance);
    if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionTriangleEXT) return false;
    uvec2 found = query_triangle(world, rayQueryGetIntersectionInstanceCustomIndexEXT(query, true),
        rayQueryGetIntersectionGeometryIndexEXT(query, true), rayQueryGetIntersectionPrimitiveIndexEXT(query, true));
    hit = complete_hit(world, found.x, found.y, origin, direction);
    return true;
}

bool occluded(World world, vec3 origin, vec3 direction, float distance_w, bool eye, uvec2 chance) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, accelerationStructureEXT(world.tlas), gl_RayFlagsTerminateOnFirstHitEXT | (eye ? gl_RayFlagsCullBackFacingTrianglesEXT : gl_RayFlagsNoneEXT), 0xff, origin, 0.0, direction, distance_w);
    proceed(query, world, origin, direction, eye, chance);
    return rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT;
}

#elif defined(TRACE_PIPELINE)

// Written by common/scene.rchit or common/scene.rmiss, read by common/scene.rahit.
struct SceneRay {
    // What triangle is met in which place, or NONE; of an occlusion ray anything but NONE.
    uvec2 found;
    uvec2 chance;
};
PAYLOAD(SceneRay, scene_ray);

// The eye's rays cull backs, others do not: common/scene.rahit knows them by this flag.
const uint EYE_FLAG = gl_RayFlagsCullBackFacingTrianglesEXT;

#ifndef HIT_SHADER

void call_pipeline(World world, uint flags, vec3 origin, vec3 direction, float distance_w, bool eye, uvec2 chance) {
    scene_ray = SceneRay(uvec2(0u), chance);
    traceRayEXT(accelerationStructureEXT(world.tlas), flags | (eye ? EYE_FLAG : gl_RayFlagsNoneEXT), 0xff, 0, 0, 0, origin, 0.0, direction, distance_w, 0);
}

bool trace(World world, vec3 origin, vec3 direction, bool eye, uvec2 chance, out Hit hit) {
    call_pipeline(world, gl_RayFlagsNoneEXT, origin, direction, 3.0e38, eye, chance);
    if (scene_ray.found.x == NONE) return false;
    hit = complete_hit(world, scene_ray.found.x, scene_ray.found.y, origin, direction);
    return true;
}

bool occluded(World world, vec3 origin, vec3 direction, float distance_w, bool eye, uvec2 chance) {
    call_pipeline(world, gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT, origin, direction, distance_w, eye, chance);
    return scene_ray.found.x != NONE;
}

#endif

#else

// Distances to planes across an axis: byte i of `cells` to component i.
vec4 planes(uint cells, float cell, float corner) {
    return vec4(uvec4(cells, cells >> 8u, cells >> 16u, cells >> 24u) & 255u) * cell + corner;
}

// The children that a ray meets, nearest first: the number of each in the low two bits, above them where it is
// entered; NONE where there is no more. Exits are widened by the rounding of the products (Ize 2013).
uvec4 meet_children(BvhNode node, vec3 origin, vec3 inverse, float t_max) {
    vec3 cell = uintBitsToFloat((uvec3(node.exponents, node.exponents >> 8u, node.exponents >> 16u) & 255u) << 23u) * inverse;
    vec3 corner = (node.min_w - origin) * inverse;
    bvec3 down = lessThan(inverse, vec3(0.0));
    uvec3 near = mix(node.low, node.high, down), far = mix(node.high, node.low, down);
    vec4 enter = max(max(planes(near.x, cell.x, corner.x), planes(near.y, cell.y, corner.y)), max(planes(near.z, cell.z, corner.z), vec4(0.0)));
    vec4 leave = min(min(planes(far.x, cell.x, corner.x), planes(far.y, cell.y, corner.y)), min(planes(far.z, cell.z, corner.z), vec4(t_max)));
    const uvec4 number = uvec4(0u, 1u, 2u, 3u);
    uvec4 met = mix(uvec4(NONE), floatBitsToUint(enter) & ~3u | number, lessThanEqual(enter, leave * 1.000001));
    met = mix(uvec4(NONE), met, lessThan(number, uvec4(node.exponents >> 24u)));
    // A network of five.
    met = uvec4(min(met.xy, met.zw), max(met.xy, met.zw));
    met = uvec4(min(met.x, met.y), max(met.x, met.y), min(met.z, met.w), max(met.z, met.w));
    return uvec4(met.x, min(met.y, met.z), max(met.y, met.z), met.w);
}

// For slabs. A zero component would make 0 · inf in one that the origin lies on, and a tiny one inf - inf.
vec3 inverse_of(vec3 direction) {
    vec3 least = vec3(1e-18 * max_component(abs(direction)));
    return 1.0 / mix(direction, least, lessThan(abs(direction), least));
}

// Nearest triangle before t_max and its place, or NONE; with `any`, whichever is met first.
// With instances the tree is over placements, of which each leads to the tree of its mesh. The ray goes there in the mesh's
// space, its direction as long as it becomes: distances stay what they are.
uvec2 traverse(World world, vec3 origin_w, vec3 direction_w, float t_max, bool any, bool eye, uvec2 chance) {
    vec3 origin = origin_w, inverse = inverse_of(direction_w);
    Shear shear = shear_along(direction_w);
    uint stack[STACK_SIZE];
    uint top = 0u;
    // A node, how many of its children are yet to visit, and which: nearest first, two bits each. Of nodes higher up the
    // stack keeps the same in a word.
    uint node = HAS_INSTANCES ? world.node : 0u, left = 1u, order = 0u;
    uvec2 found = uvec2(NONE, 0u);
    uint first = 0u, count = 0u;
    // Within a placement, whose nodes lie on the stack from `base` on.
    bool within = false;
    uint place = 0u, base = 0u;
    for (;;) {
        // Leaves come out of the inner loop, so that neighbouring threads test triangles together.
        do {
            if (count == 0u && (left > 0u || top > base)) {
                if (left == 0u) {
                    uint entry = stack[--top];
                    node = entry >> 8u;
                    left = entry >> 6u & 3u;
                    order = entry & 63u;
                }
                uint child = world.nodes.at[node].children[order & 3u];
                order >>= 2u;
                left--;
                first = child & (1u << LEAF_SHIFT) - 1u;
                count = child >> LEAF_SHIFT;
                if (count == 0u) {
                    if (left > 0u) stack[top++] = node << 8u | left << 6u | order;
                    node = first;
                    uvec4 met = meet_children(load_BvhNode(world.nodes, node), origin, inverse, t_max);
                    uvec4 number = met & 3u, is_met = uvec4(notEqual(met, uvec4(NONE)));
                    order = number.x | number.y << 2u | number.z << 4u | number.w << 6u;
                    left = is_met.x + is_met.y + is_met.z + is_met.w;
                }
            }
        } while (count == 0u && (left > 0u || top > base));
        if (HAS_INSTANCES && count == LEAF_PLACEMENT) {
            Placement p = load_Placement(world.placements, first);
            mat3 m = mesh_from_world(p);
            vec3 direction = m * direction_w;
            origin = m * (origin_w - p.origin_w);
            inverse = inverse_of(direction);
            shear = shear_along(direction);
            within = true;
            place = first;
            if (left > 0u) stack[top++] = node << 8u | left << 6u | order;
            base = top;
            node = p.node;
            left = 1u;
            order = 0u;
            count = 0u;
            continue;
        }
        if (HAS_INSTANCES && count == 0u && within) {
            origin = origin_w;
            inverse = inverse_of(direction_w);
            within = false;
            base = 0u;
            continue;
        }
        if (count == 0u) return found;
        uint i = first, end = first + count;
        do {
            Corners p = corners_of(world, i);
            vec3 a = p.p0 - origin, b = p.p1 - origin, c = p.p2 - origin;
            vec3 e = edge_functions(a, b, c, shear);
            float det = e.x + e.y + e.z;
            bool inside = (e.x >= 0.0 && e.y >= 0.0 && e.z >= 0.0) || (e.x <= 0.0 && e.y <= 0.0 && e.z <= 0.0);
            float t = (e.x * dot(shear.z, a) + e.y * dot(shear.z, b) + e.z * dot(shear.z, c)) / det;
            if (inside && det != 0.0 && t > 0.0 && t < t_max) {
                bool there = true;
                if (HAS_ALPHA || HAS_ONE_SIDED) {
                    uint flags = world.triangles.at[i].material;
                    if (eye && (flags & TRIANGLE_ONE_SIDED) != 0u) there = det > 0.0;
                    if (there && (flags & TRIANGLE_ALPHA) != 0u) there = !is_absent(world, i, place, e.yz / det, eye, chance);
                }
                if (there) {
                    found = uvec2(i, place);
                    t_max = t;
                }
            }
        } while (++i < end);
        if (any && found.x != NONE) return found;
        count = 0u;
    }
}

bool trace(World world, vec3 origin, vec3 direction, bool eye, uvec2 chance, out Hit hit) {
    uvec2 found = traverse(world, origin, direction, 3.0e38, false, eye, chance);
    if (found.x == NONE) return false;
    hit = complete_hit(world, found.x, found.y, origin, direction);
    return true;
}

bool occluded(World world, vec3 origin, vec3 direction, float distance_w, bool eye, uvec2 chance) {
    return traverse(world, origin, direction, distance_w, true, eye, chance).x != NONE;
}

#endif
