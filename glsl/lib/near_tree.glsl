// Photons near a point by a software tree. See near.glsl.

// A complete tree in heap order: the children of node i start at FANOUT i + 1, all leaves lie on one
// level, leaf j holds photons PHOTON_LEAF j … of the sorted map, boxes beyond the last are
// empty. The walk tests all children of a node in one step, and remembers those it has yet to visit as
// bits instead of a stack: a CPU device pays dearly for arrays with an index of each thread's own.
void find_near(PhotonMaps maps, uint map, vec3 position_w, float radius) {
    const uint FANOUT = 1u << PHOTON_FANOUT_LOG2;
    uvec3Ref tree = map == MAP_CAUSTIC ? maps.caustic_tree : maps.global_tree;
    uint first_leaf = maps.first_leaf[map], first = maps.first[map], count = maps.count[map];
    if (count == 0u) return;
    float radius2 = radius * radius;
    // In cells of the boxes' grid.
    vec3 at = (position_w - maps.grid_min_w) * maps.grid_scale;
    float reach = radius * maps.grid_scale;
    // Children to visit: FANOUT bits a level, the deepest level lowest, whose parent is `parent`, counted
    // within its level. The root is child 0 of nothing.
    uvec2 pending = uvec2(1u, 0u);
    uint parent = 0u, level = 0u;
    for (;;) {
        uint leaf = NONE;
        // Leaves come out of the inner loop, so that neighbouring threads test photons together.
        if ((pending.x | pending.y) != 0u) do {
            if (pending.x == 0u) {
                pending = uvec2(pending.y, 0u);
                level -= 32u / FANOUT;
                parent >>= PHOTON_FANOUT_LOG2 * (32u / FANOUT);
            }
            // Up past levels with nothing left, then down to a child.
            uint bit = findLSB(pending.x), up = bit / FANOUT, shift = up * FANOUT;
            pending.x = (pending.x & (pending.x - 1u)) >> shift | (pending.y << 1u) << (31u - shift);
            pending.y >>= shift;
            parent >>= PHOTON_FANOUT_LOG2 * up;
            level -= up;
            uint place = (parent << PHOTON_FANOUT_LOG2) + bit % FANOUT;
            // Behind the (FANOUT^level - 1) / (FANOUT - 1) nodes above, in binary 1, 101, 10101 …
            uint node = place + (0xffffffffu / (FANOUT - 1u) & (1u << PHOTON_FANOUT_LOG2 * level) - 1u);
            if (node >= first_leaf) {
                leaf = node - first_leaf;
                continue;
            }
            uint child = (node << PHOTON_FANOUT_LOG2) + 1u, met = 0u;
            [[unroll]] for (uint i = 0u; i < FANOUT; i++) {
                uvec3 box = tree.at[child + i];
                vec3 d = max(max(vec3(box & 0xffffu) - at, at - vec3(box >> 16u)), vec3(0.0));
                if (dot(d, d) <= reach * reach) met |= 1u << i;
            }
            pending = uvec2(pending.x << FANOUT | met, pending.y << FANOUT | pending.x >> (32u - FANOUT));
            parent = place;
            level++;
        } while (leaf == NONE && (pending.x | pending.y) != 0u);
        if (leaf == NONE) return;
        uint begin = leaf * PHOTON_LEAF, end = min(begin + PHOTON_LEAF, count), i = first + begin;
        // A radius beyond the grid of boxes meets the empty ones too.
        if (i < first + end) do {
            if (photon_is_near(maps, i, position_w, radius2)) visit_photon(i, photon_at(maps, i));
        } while (++i < first + end);
    }
}
