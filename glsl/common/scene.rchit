// Names the triangle that a scene ray met (see trace.glsl).
// In: the World, with which the arguments of every pass begin whose rays meet the scene. Out: SceneRay.found.
#version 460
#define HIT_SHADER
#include "lib/pass.glsl"
#include "lib/math.glsl"
#include "lib/rng.glsl"
#include "lib/sequence.glsl"
#include "lib/bsdf.glsl"
#include "lib/surface.glsl"
#include "lib/trace.glsl"

PUSH(WorldRef);

void main() {
    scene_ray.found = query_triangle(push.at[0], gl_InstanceCustomIndexEXT, gl_GeometryIndexEXT, gl_PrimitiveID);
}
