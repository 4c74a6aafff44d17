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

// Entry distance of a box, or -1. The exit is widened by the rounding of the products (Ize 2013).
float enter_box(vec3 min_w, vec3 max_w, vec3 origin, vec3 inverse, float t_max) {
    vec3 t0 = (min_w - origin) * inverse, t1 = (max_w - origin) * inverse;
    vec3 near = min(t0, t1), far = max(t0, t1);
    float enter = max(max(near.x, near.y), max(near.z, 0.0));
    float leave = min(min(far.x, far.y), min(far.z, t_max)) * 1.0000005;
    return enter <= leave ? enter : -1.0;
}

// For slabs. A zero component would make 0 · inf in one that the origin lies on.
vec3 inverse_of(vec3 direction) {
    return 1.0 / mix(direction, vec3(1e-30), lessThan(abs(direction), vec3(1e-30)));
}

// Nearest triangle before t_max and its place, or NONE; with `any`, whichever is met first.
// With instances the tree is over placements, of which each leads to the tree of its mesh. The ray goes there in the mesh's
// space, its direction as long as it becomes: distances stay what they are.
uvec2 traverse(World world, vec3 origin_w, vec3 direction_w, float t_max, bool any, bool eye, uvec2 chance) {
    vec3 origin = origin_w, inverse = inverse_of(direction_w);
    Shear shear = shear_along(direction_w);
    uint stack[STACK_SIZE];
    uint top = 0u;
    uvec2 found = uvec2(NONE, 0u);
    uint node = HAS_INSTANCES ? world.node : 0u;
    uint first = 0u, count = 0u;
    // Within a placement, whose nodes lie on the stack from `base` on.
    bool within = false;
    uint place = 0u, base = 0u;
    for (;;) {
        // Leaves come out of the inner loop, so that neighbouring threads test triangles together.
        do {
            if (count == 0u && node != NONE) {
                BvhNode n = load_BvhNode(world.nodes, node);
                float t0 = enter_box(n.min0_w, n.max0_w, origin, inverse, t_max);
                float t1 = enter_box(n.min1_w, n.max1_w, origin, inverse, t_max);
                bool swap = t0 < 0.0 || (t1 >= 0.0 && t1 < t0);
                uint near_child = swap ? n.child1 : n.child0, near_count = swap ? n.count1 : n.count0;
                float t_near = swap ? t1 : t0, t_far = swap ? t0 : t1;
                if (t_far >= 0.0) {
                    // A leaf is pushed as its triangles: count (at most 15) above 28 bits of index.
                    uint far_child = swap ? n.child0 : n.child1, far_count = swap ? n.count0 : n.count1;
                    stack[top++] = far_child | far_count << 28;
                }
                node = NONE;
                if (t_near >= 0.0) {
                    if (near_count == 0u) node = near_child;
                    first = near_child;
                    count = near_count;
                } else if (top > base) {
                    uint entry = stack[--top];
                    count = entry >> 28;
                    first = entry & 0x0fffffffu;
                    if (count == 0u) node = first;
                }
            }
        } while (count == 0u && node != NONE);
        if (HAS_INSTANCES && count == LEAF_PLACEMENT) {
            Placement p = load_Placement(world.placements, first);
            mat3 m = mesh_from_world(p);
            vec3 direction = m * direction_w;
            origin = m * (origin_w - p.origin_w);
            inverse = inverse_of(direction);
            shear = shear_along(direction);
            within = true;
            place = first;
            base = top;
            node = p.node;
            count = 0u;
            continue;
        }
        if (HAS_INSTANCES && count == 0u && within && top > 0u) {
            origin = origin_w;
            inverse = inverse_of(direction_w);
            within = false;
            base = 0u;
            uint entry = stack[--top];
            count = entry >> 28;
            first = entry & 0x0fffffffu;
            if (count == 0u) node = first;
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
        if (top > base) {
            uint entry = stack[--top];
            count = entry >> 28;
            first = entry & 0x0fffffffu;
            if (count == 0u) node = first;
        }
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
