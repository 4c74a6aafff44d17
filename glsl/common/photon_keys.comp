// Photons in the order of their paths, each with its sort key: the map, then the Morton code of its
// position (Morton 1966), 31 bits in all. Path order makes the sorted order, and so every float sum
// over photons, independent of which thread came first.
// In: Photons, slots and offsets of each path. Out: keys and photon indices.
#version 460
#include "lib/pass.glsl"

PUSH(PhotonKeysPush);

// Bits of x moved three apart.
uint spread(uint x) {
    x = (x | x << 16u) & 0x030000ffu;
    x = (x | x << 8u) & 0x0300f00fu;
    x = (x | x << 4u) & 0x030c30c3u;
    return (x | x << 2u) & 0x09249249u;
}

void main() {
    Frame frame = push.frame.at[0];
    uint path = thread_index();
    if (path >= frame.paths) return;
    uint to = push.path_offsets.at[path];
    uint end = push.path_offsets.at[path + 1u];
    for (uint i = 0u; to + i < end; i++) {
        uint slot = push.path_slots.at[path * frame.max_depth + i];
        uint index = slot & 0x7fffffffu;
        uvec3 cell = uvec3(clamp((push.photons.at[index].position_w - push.min_w) * push.scale, vec3(0.0), vec3(1023.0)));
        uint morton = spread(cell.x) | spread(cell.y) << 1u | spread(cell.z) << 2u;
        push.keys.at[to + i] = (slot >> 31) << 30 | morton;
        push.indices.at[to + i] = index;
    }
}
