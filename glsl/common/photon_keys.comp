// Photons in the order of their paths, each with its sort key: the map, then its position on a Hilbert curve, 31 bits in
// all; or its slot in a grid; or its map alone. Path order makes the sorted order, and so every float sum over photons,
// independent of which thread came first.
// In: Photons, where those of each path begin. Out: keys and photon indices.
#version 460
#include "lib/pass.glsl"
#if defined(NEAR_GRID) || defined(NEAR_CELLS)
#include "lib/math.glsl"
#include "lib/grid.glsl"
#endif

PUSH(PhotonKeysPush);

#if defined(NEAR_GRID)

// Either is at a uniform place, their choice is not.
PhotonGrid grid_of(uint map) {
    PhotonGrid caustic = push.grids.at[MAP_CAUSTIC], global = push.grids.at[MAP_GLOBAL];
    return map == MAP_CAUSTIC ? caustic : global;
}

uint key_of(uint map, vec3 position_w) { return grid_slot(grid_of(map), position_w); }

#elif defined(NEAR_CELLS)

uint key_of(uint map, vec3 position_w) { return cell_slot(push.grids.at[map], grid_cell(push.grids.at[map], position_w)); }

#elif defined(NEAR_LISTS)

uint key_of(uint map, vec3 position_w) { return map; }

#else

// Bits of x moved three apart.
uint spread(uint x) {
    x = (x | x << 16u) & 0x030000ffu;
    x = (x | x << 8u) & 0x0300f00fu;
    x = (x | x << 4u) & 0x030c30c3u;
    return (x | x << 2u) & 0x09249249u;
}

// Place of a cell on the Hilbert curve (Skilling 2004): neighbours on it are neighbours in space, so
// that runs of photons have small boxes; a Morton curve jumps.
uint hilbert(uvec3 x) {
    for (uint q = 512u; q > 1u; q >>= 1u) {
        for (uint i = 0u; i < 3u; i++) {
            if ((x[i] & q) != 0u) {
                x.x ^= q - 1u;
            } else {
                uint swapped = (x.x ^ x[i]) & (q - 1u);
                x.x ^= swapped;
                x[i] ^= swapped;
            }
        }
    }
    x.y ^= x.x;
    x.z ^= x.y;
    uint flips = 0u;
    for (uint q = 512u; q > 1u; q >>= 1u) if ((x.z & q) != 0u) flips ^= q - 1u;
    x ^= flips;
    return spread(x.x) << 2u | spread(x.y) << 1u | spread(x.z);
}

uint key_of(uint map, vec3 position_w) {
    return map << 30 | hilbert(uvec3(clamp((position_w - push.min_w) * push.scale, vec3(0.0), vec3(1023.0))));
}

#endif

void main() {
    uint index = thread_index();
    if (index >= push.count) return;
    Photon photon = load_Photon(push.photons, index);
    uint to = push.path_offsets.at[photon.path] + (photon.number & 0x7fffffffu);
    push.keys.at[to] = key_of(photon.number >> 31, photon.position_w);
    push.indices.at[to] = index;
}
