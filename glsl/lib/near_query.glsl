// Photons near a point by ray query over their boxes (inverse radius search, Evangelou et al. 2021). See near.glsl.

void find_near(PhotonMaps maps, uint map, vec3 position_w, float radius) {
    if (maps.count[map] == 0u) return;
    rayQueryEXT query;
    // A ray of no length; not of length zero, which some drivers lose on boxes below the float grid.
    rayQueryInitializeEXT(query, accelerationStructureEXT(maps.tlas), gl_RayFlagsNoneEXT, 1u << map, position_w, 0.0, vec3(0.0, 0.0, 1.0), 1e-6 * radius);
    // Candidates are conservative: the sphere test decides.
    while (rayQueryProceedEXT(query)) {
        uint index = maps.first[map] + rayQueryGetIntersectionPrimitiveIndexEXT(query, false);
        if (photon_is_near(maps, index, position_w, radius * radius)) visit_photon(index, photon_at(maps, index));
    }
}
