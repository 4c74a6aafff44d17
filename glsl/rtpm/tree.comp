// One level of a software photon tree (see lib/near.glsl), leaves first. The tree splits the
// sorted photons into equal counts, so its shape is known beforehand and each level is one
// pass without atomics.
// In: positions, or the boxes of the level below. Out: boxes; inverted, never met, where no photons are.
#version 460
#include "lib/pass.glsl"

PUSH(TreePush);

void main() {
    uint i = thread_index();
    if (i >= push.count) return;
    PhotonMaps maps = push.maps.at[0];
    uvec3Ref tree = push.map == MAP_CAUSTIC ? maps.caustic_tree : maps.global_tree;
    uint node = push.first + i;
    uvec3 low = uvec3(0xffffu), high = uvec3(0u);
    if (node >= maps.first_leaf[push.map]) {
        uint begin = (node - maps.first_leaf[push.map]) * PHOTON_LEAF;
        uint end = min(begin + PHOTON_LEAF, maps.count[push.map]);
        for (uint j = begin; j < end; j++) {
            // A cell larger than it need be all round: rounding must lose no photon.
            uvec3 cell = uvec3((maps.positions_w.at[maps.first[push.map] + j] - maps.grid_min_w) * maps.grid_scale);
            low = min(low, cell - 1u);
            high = max(high, cell + 2u);
        }
    } else {
        uint child = (node << PHOTON_FANOUT_LOG2) + 1u;
        for (uint j = 0u; j < 1u << PHOTON_FANOUT_LOG2; j++) {
            uvec3 box = tree.at[child + j];
            low = min(low, box & 0xffffu);
            high = max(high, box >> 16u);
        }
    }
    tree.at[node] = low | high << 16u;
}
