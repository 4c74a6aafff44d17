// Photons move to their sorted places. In: Photons, sorted indices, radii [m]. Out: powers, and
// boxes of edge 2r (Kern et al. 2023, section 3.5) or, for the software tree, their middles.
#version 460
#include "lib/pass.glsl"
#include "lib/math.glsl"
#include "lib/photon.glsl"

PUSH(PlacePush);

void main() {
    uint i = thread_index();
    if (i >= push.count) return;
    PhotonMaps maps = push.maps.at[0];
    Photon photon = load_Photon(push.photons, push.indices.at[i]);
    store_PhotonPower(maps.power, i, photon.power);
    vec2 radii = push.frame.at[0].radius;
    float radius = i < maps.first[MAP_GLOBAL] ? radii[MAP_CAUSTIC] : radii[MAP_GLOBAL];
    // Rounding must not leave a photon at distance r outside: one step of the float grid more.
    precise vec3 extent = vec3(radius) + abs(photon.position_w) * 1.2e-7;
    precise PhotonBox box = PhotonBox(photon.position_w - extent, photon.position_w + extent);
#ifdef TRACE_QUERY
    store_PhotonBox(maps.boxes, i, box);
#else
    maps.positions_w.at[i] = box_middle(box);
#endif
}
