// The traversal seam for photons: every photon within a radius of a point, once. A pass defines
// `visit_photon`, which is the any-hit accumulation of Kern et al. 2023, listing 2.
// In: a point in world space [m]. The sphere test is exact and the same in all. Needs photon.glsl.

struct NearPhoton {
    vec3 position_w;
    vec3 flux;
    // Unit vectors.
    vec3 wi;
    vec3 normal_g;
    uint edges;
};

void visit_photon(uint index, NearPhoton photon);

NearPhoton unpack_photon(PhotonPower power, vec3 position_w) {
    return NearPhoton(position_w, photon_flux(power), unpack_direction(power.wi), unpack_direction(power.normal_g), photon_edges(power));
}

vec3 photon_position(PhotonMaps maps, uint index) {
#if defined(TRACE_QUERY) || defined(TRACE_PIPELINE)
    return box_middle(load_PhotonBox(maps.boxes, index));
#else
    return maps.positions_w.at[index];
#endif
}

NearPhoton photon_at(PhotonMaps maps, uint index) {
    return unpack_photon(load_PhotonPower(maps.power, index), photon_position(maps, index));
}

bool photon_is_near(PhotonMaps maps, uint index, vec3 position_w, float radius2) {
    vec3 d = photon_position(maps, index) - position_w;
    return dot(d, d) <= radius2;
}

#if defined(NEAR_GRID)
#include "lib/near_grid.glsl"
#elif defined(NEAR_LISTS)
#include "lib/near_lists.glsl"
#elif defined(NEAR_CELLS)
#include "bench/near_cells.glsl"
#elif defined(TRACE_QUERY)
#include "lib/near_query.glsl"
#elif defined(TRACE_PIPELINE)
#include "lib/near_pipeline.glsl"
#else
#include "lib/near_tree.glsl"
#endif
