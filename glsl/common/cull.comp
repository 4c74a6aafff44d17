// Marks the culling mask (see lib/cull.glsl). In: ViewSamples, the global radius [m]. Out: mask bits.
#version 460
#include "lib/pass.glsl"
#include "lib/math.glsl"
#include "lib/cull.glsl"

PUSH(CullPush);

void main() {
    Frame frame = push.frame.at[0];
    uint index = thread_index();
    if (index >= frame.size.x * frame.size.y) return;
    ViewSample view = load_ViewSample(push.samples, index);
    if (view.weight == vec3(0.0)) return;
    vec3 p = cull_cell_position(view.position_w, max(frame.radius[MAP_CAUSTIC], frame.radius[MAP_GLOBAL]));
    ivec3 cell = ivec3(floor(p));
    // Towards the nearer neighbour on each axis.
    ivec3 step = ivec3(greaterThanEqual(p - vec3(cell), vec3(0.5))) * 2 - 1;
    for (uint corner = 0u; corner < 8u; corner++) {
        ivec3 offset = ivec3(corner & 1u, corner >> 1u & 1u, corner >> 2u) * step;
        uint bit = cull_cell_hash(cell + offset);
        // Neighbouring pixels mark the same cells: a read is cheaper than an atomic.
        if ((push.mask.at[bit >> 5u] >> (bit & 31u) & 1u) == 0u) atomicOr(push.mask.at[bit >> 5u], 1u << (bit & 31u));
    }
}
