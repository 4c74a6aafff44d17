// One level of a software photon tree (see lib/near.glsl), leaves first. The tree splits the
// Morton-ordered photons into equal counts, so its shape is known beforehand and each level is one
// pass without atomics.
// In: positions, or the boxes of the level below. Out: boxes; inverted, never met, where no photons are.
#version 460
#include "lib/pass.glsl"

PUSH(TreePush);

void main() {
    uint i = thread_index();
    if (i >= push.count) return;
    PhotonMaps maps = push.maps.at[0];
    PhotonBoxRef tree = push.map == MAP_CAUSTIC ? maps.caustic_tree : maps.global_tree;
    uint node = push.first + i;
    PhotonBox box = PhotonBox(vec3(3.0e38), vec3(-3.0e38));
    if (node >= maps.first_leaf[push.map]) {
        uint begin = (node - maps.first_leaf[push.map]) * PHOTON_LEAF;
        uint end = min(begin + PHOTON_LEAF, maps.count[push.map]);
        for (uint j = begin; j < end; j++) {
            vec3 p = maps.positions_w.at[maps.first[push.map] + j];
            box.min_w = min(box.min_w, p);
            box.max_w = max(box.max_w, p);
        }
    } else {
        uint child = (node << PHOTON_FANOUT_LOG2) + 1u;
        for (uint j = 0u; j < 1u << PHOTON_FANOUT_LOG2; j++) {
            PhotonBox b = tree.at[child + j];
            box.min_w = min(box.min_w, b.min_w);
            box.max_w = max(box.max_w, b.max_w);
        }
    }
    tree.at[node] = box;
}
