// The traversal seam for photons: every photon within a radius of a point, by ray query over boxes
// (inverse radius search, Evangelou et al. 2021) or by a software tree. A pass defines
// `visit_photon`, which is the any-hit accumulation of Kern et al. 2023, listing 2.
// In: a point in world space [m]. The sphere test is exact and the same in both. Needs photon.glsl.

void visit_photon(uint index);

vec3 photon_position(PhotonMaps maps, uint index) {
#ifdef TRACE_QUERY
    return box_middle(maps.boxes.at[index]);
#else
    return maps.positions_w.at[index];
#endif
}

bool photon_is_near(PhotonMaps maps, uint index, vec3 position_w, float radius2) {
    vec3 d = photon_position(maps, index) - position_w;
    return dot(d, d) <= radius2;
}

#ifdef TRACE_QUERY

void find_near(PhotonMaps maps, uint map, vec3 position_w, float radius) {
    if (maps.count[map] == 0u) return;
    rayQueryEXT query;
    // A ray of no length; not of length zero, which some drivers lose on boxes below the float grid.
    rayQueryInitializeEXT(query, accelerationStructureEXT(maps.tlas), gl_RayFlagsNoneEXT, 1u << map, position_w, 0.0, vec3(0.0, 0.0, 1.0), 1e-6 * radius);
    // Candidates are conservative: the sphere test decides.
    while (rayQueryProceedEXT(query)) {
        uint index = maps.first[map] + rayQueryGetIntersectionPrimitiveIndexEXT(query, false);
        if (photon_is_near(maps, index, position_w, radius * radius)) visit_photon(index);
    }
}

#else

// A complete tree in heap order: the children of node i start at FANOUT i + 1, all leaves lie on one
// level, leaf j holds photons PHOTON_LEAF j … of the Morton-ordered map, boxes beyond the last are
// empty. So the walk needs no stack: the next node follows from the number of this one.
void find_near(PhotonMaps maps, uint map, vec3 position_w, float radius) {
    const uint FANOUT = 1u << PHOTON_FANOUT_LOG2;
    PhotonBoxRef tree = map == MAP_CAUSTIC ? maps.caustic_tree : maps.global_tree;
    uint first_leaf = maps.first_leaf[map], first = maps.first[map], count = maps.count[map];
    if (count == 0u) return;
    float radius2 = radius * radius;
    uint node = 0u;
    bool done = false;
    while (!done) {
        uint leaf = NONE;
        while (!done && leaf == NONE) {
            PhotonBox box = tree.at[node];
            vec3 d = max(max(box.min_w - position_w, position_w - box.max_w), vec3(0.0));
            bool hit = dot(d, d) <= radius2;
            if (hit && node < first_leaf) node = (node << PHOTON_FANOUT_LOG2) + 1u;
            else {
                if (hit) leaf = node - first_leaf;
                // The last sibling is a multiple of the fan-out: its parent is done too.
                while (node != 0u && (node & (FANOUT - 1u)) == 0u) node = (node - 1u) >> PHOTON_FANOUT_LOG2;
                done = node == 0u;
                node++;
            }
        }
        if (leaf != NONE) {
            uint begin = leaf * PHOTON_LEAF, end = min(begin + PHOTON_LEAF, count);
            for (uint i = first + begin; i < first + end; i++)
                if (photon_is_near(maps, i, position_w, radius2)) visit_photon(i);
        }
    }
}

#endif
