// For a scene ray that met nothing (see trace.glsl). Out: SceneRay.found, NONE.
#version 460
#define HIT_SHADER
#include "lib/pass.glsl"
#include "lib/math.glsl"
#include "lib/rng.glsl"
#include "lib/sequence.glsl"
#include "lib/bsdf.glsl"
#include "lib/surface.glsl"
#include "lib/trace.glsl"

void main() { scene_ray.found.x = NONE; }
