// Photons move to their sorted places. In: Photons, sorted indices, radii [m]. Out: positions, powers
// and, for acceleration structures, boxes of edge 2r (Kern et al. 2023, section 3.5).
#version 460
#include "lib/pass.glsl"

PUSH(PlacePush);

void main() {
    uint i = thread_index();
    if (i >= push.count) return;
    PhotonMaps maps = push.maps.at[0];
    Photon photon = push.photons.at[push.indices.at[i]];
    maps.positions_w.at[i] = photon.position_w;
    maps.power.at[i] = photon.power;
#ifdef TRACE_QUERY
    float radius = push.frame.at[0].radius[i < maps.first[MAP_GLOBAL] ? MAP_CAUSTIC : MAP_GLOBAL];
    // Rounding must not leave a photon at distance r outside: one step of the float grid more.
    vec3 extent = vec3(radius) + abs(photon.position_w) * 1.2e-7;
    maps.boxes.at[i] = PhotonBox(photon.position_w - extent, photon.position_w + extent);
#endif
}
