// Puts photons into the lists of a hash table (see lib/lists.glsl). In: positions [m] and maps of the photons,
// an empty table. Out: for each bucket how many photons came, and which are kept.
#version 460
#include "lib/pass.glsl"
#include "lib/math.glsl"
#include "lib/photon.glsl"
#include "lib/lists.glsl"

PUSH(ListInsertPush);

void main() {
    uint i = thread_index();
    if (i >= push.count) return;
    PhotonMaps maps = push.maps.at[0];
    PhotonLists lists = maps.lists;
    uvec4 cell = cell_of_photon(maps, i);
    uint home = list_hash(cell) & lists.buckets - 1u, bucket = home;
    // A bucket belongs to the cell of the photon that came first: exact, where a hash of the cell would not be.
    if (PROBING) {
        for (uint attempt = 1u;; attempt++) {
            uint owner = atomicCompSwap(lists.owners.at[bucket], NONE, i);
            if (owner == NONE || cell_of_photon(maps, owner) == cell) break;
            bucket = list_probe(lists, home, attempt);
        }
    }
    atomicAdd(lists.counts.at[bucket], 1u);
    // Insertion into a sorted list: each place keeps the smaller key, the larger goes on.
    uint key = key_of_photon(lists.seed, i);
    for (uint j = 0u; j < LIST_LENGTH && key != NONE; j++) key = max(key, atomicMin(lists.keys.at[bucket * LIST_LENGTH + j], key));
}
