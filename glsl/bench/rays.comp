// Rays from a list, and nothing else: what a traversal costs (see benches/traversal).
// In: World, rays. Out: what each ray met, named by the triangle's first vertex, because the
// traversals keep triangles in orders of their own; NONE for nothing. Of a shadow ray: 0 for something.
#version 460
#include "lib/pass.glsl"
#include "lib/math.glsl"
#include "lib/rng.glsl"
#include "lib/sequence.glsl"
#include "lib/bsdf.glsl"
#include "lib/surface.glsl"
#include "lib/trace.glsl"

PUSH(BenchRaysPush);

void main() {
    uint i = thread_index();
    if (i >= push.count) return;
    World world = push.world.at[0];
    Ray ray = push.rays.at[i];
    uint met = NONE;
    if (push.shadow != 0u) {
        if (occluded(world, ray.origin_w, ray.direction_w, ray.distance_w, false, uvec2(i, 0u))) met = 0u;
    } else {
        Hit hit;
        if (trace(world, ray.origin_w, ray.direction_w, false, uvec2(i, 0u), hit)) met = world.triangles.at[hit.triangle].vertices.x;
    }
    push.met.at[i] = met;
}
