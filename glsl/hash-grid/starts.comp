// Where the photons of each slot begin. In: keys of the sorted photons, which are their slots. Out: for
// each slot and the one behind the last, how many photons lie in slots before it.
#version 460
#include "lib/pass.glsl"

PUSH(GridStartsPush);

void main() {
    uint i = thread_index();
    if (i > push.count) return;
    uint slot = i == 0u ? 0u : push.keys.at[i - 1u] + 1u;
    uint end = i == push.count ? push.slots : push.keys.at[i];
    // Slots between this photon's and the one before it are empty.
    if (slot <= end) do push.starts.at[slot] = i;
    while (++slot <= end);
}
