// Photons near a point by a ray tracing pipeline over their boxes (Kern et al. 2023, listing 2): the intersection
// shader holds each box to the sphere, the any-hit shader visits its photon and lets the ray go on. See near.glsl.

#ifdef HIT_SHADER

uint photon_of_box(PhotonMaps maps) { return maps.first[gl_InstanceCustomIndexEXT] + gl_PrimitiveID; }

#else

void find_near(PhotonMaps maps, uint map, vec3 position_w, float radius) {
    if (maps.count[map] == 0u) return;
    // A ray of no length (see near_query.glsl): its direction matters to nobody, and tells the shaders the radius.
    traceRayEXT(accelerationStructureEXT(maps.tlas), gl_RayFlagsSkipClosestHitShaderEXT, 1u << map, 0, 0, 0, position_w, 0.0, vec3(0.0, 0.0, radius), 1e-6, 0);
}

#endif
