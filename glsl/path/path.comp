// Path tracing with next-event estimation and multiple importance sampling (Kajiya 1986; Veach 1997,
// chapter 9): all light that a path from the eye can find, without bias. Light from a lamp without
// area through smooth glass or off a smooth mirror it cannot.
// In: World, Frame. Out: FramePixels: radiance [nit] in the layers of lib/eye.glsl; albedo, normal
// and depth of the first surface.
#version 460
#include "lib/pass.glsl"
#include "lib/math.glsl"
#include "lib/rng.glsl"
#include "lib/sequence.glsl"
#include "lib/bsdf.glsl"
#include "lib/surface.glsl"
#include "lib/trace.glsl"
#include "lib/environment.glsl"
#include "lib/light.glsl"
#include "lib/light_tree.glsl"
#include "lib/direct.glsl"
#include "lib/camera.glsl"
#include "lib/eye.glsl"

PUSH(PathPush);

void main() {
    Frame frame = push.frame.at[0];
    uvec2 pixel;
    if (!pixel_of_thread(frame, thread_index(), pixel)) return;
    World world = push.world.at[0];
    uint index = pixel.y * frame.size.x + pixel.x;

    FramePixel seen = nothing_seen();
    EyePath path = begin_eye_path(frame, pixel, index);
    Surface s;
    Hit hit;
    while (arrive(world, path, seen, s, hit) && path.edges < frame.max_depth) {
        // Photons do not leave towards where the shading normal faces away (see shading_ratio in
        // common/emit.comp).
        if (path.layer != LAYER_EMISSION && dot(s.normal_s, s.wo) <= 0.0) break;
        add_direct_light(world, s, true, path, seen);
        if (!depart(s, next_event(s, true, path), path)) break;
    }
    store_FramePixel(push.pixels, index, seen);
}
