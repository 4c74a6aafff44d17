// Light paths, found from their other end: paths from the eye that go on as `path`'s do ask every surface they meet
// for the light that comes straight to it. Each answer names the primary sample (emission.glsl) with which a light path
// would have come that way, and what it would add to the picture: the density that light paths should have.
// Smooth surfaces, which no ray from a light could be asked for, are taken to scatter evenly what they reflect
// and let through: so that photons go to glass and mirrors, whose light is found nowhere else.
// (Importance for photon tracing: Peter & Pietrek 1998. The eye's paths need not be right, only sensible: the
// guide's density divides out.)
// In: World, Frame, the guide's center. Out: IMPORTANCE_RECORDS Importances a path [nit], ImportancePaths.
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
#include "lib/emission.glsl"
#include "lib/light_tree.glsl"
#include "lib/direct.glsl"
#include "lib/camera.glsl"
#include "lib/eye.glsl"

PUSH(ImportancePush);

const uint STREAM_IMPORTANCE = 0xc0000000u;

// What photons would bring of light in this layer, to the caustic and the global map.
vec2 to_maps(uint layer, vec3 radiance) {
    float l = average(radiance);
    bool global = layer == LAYER_GLOBAL || (layer == LAYER_DIRECT && !DIRECT_RAYS);
    return vec2(layer == LAYER_CAUSTIC ? l : 0.0, global ? l : 0.0);
}

void add_seen(inout float seen, vec3 radiance) {
    float l = luminance(radiance);
    // Nor NaN.
    if (l > 0.0) seen = min(seen + l, 1e30);
}

// Of a light, through a point, in the direction that its light goes.
void record(World world, Guide guide, uint path, inout uint count, uint light, vec2 bary, vec3 through_w, vec3 direction_w, vec2 weight) {
    // Nor NaN.
    if (count == IMPORTANCE_RECORDS || light == NONE || !(weight.x + weight.y > 0.0)) return;
    uvec4 random = pcg4d(uvec4(path, count, 0u, STREAM_IMPORTANCE));
    Primary primary = primary_towards(world, guide, light, bary, through_w, direction_w, random);
    Importance found;
    found.light = primary.light;
    found.place = primary.place;
    found.way = primary.way;
    found.weight = min(weight, vec2(1e30));
    store_Importance(push.records, path * IMPORTANCE_RECORDS + count++, found);
}

void main() {
    uint index = thread_index();
    if (index >= push.count) return;
    World world = push.world.at[0];
    Guide guide = push.guide.at[0];
    Frame frame = push.frame.at[0];
    // Over the image as over the iterations of a pixel: all paths share one sequence.
    vec2 at = sequence_pair(index, frame.seed ^ STREAM_IMPORTANCE);
    uvec2 pixel = min(uvec2(at * vec2(frame.size)), frame.size - 1u);
    frame.iteration = index;
    EyePath path = begin_eye_path(frame, pixel, STREAM_IMPORTANCE);

    uint count = 0u;
    float seen = 0.0;
    Surface s;
    Hit hit;
    for (;;) {
        FramePixel found = nothing_seen();
        vec3 direction_w = path.direction_w, event_w = path.event_w;
        bool met = arrive(world, path, found, s, hit);
        add_seen(seen, found.emission + found.direct + found.caustic + found.global);
        vec2 weight = to_maps(LAYER_DIRECT, found.direct) + to_maps(LAYER_CAUSTIC, found.caustic) + to_maps(LAYER_GLOBAL, found.global);
        // At most one light shines at the end of an edge.
        if (weight.x + weight.y > 0.0) {
            uint light = met ? light_at(world, hit.triangle, hit.bary) : world.light_count - 1u;
            record(world, guide, index, count, light, hit.bary, event_w, -direction_w, weight);
        }
        if (!met || path.edges >= frame.max_depth) break;
        if (path.layer != LAYER_EMISSION && dot(s.normal_s, s.wo) <= 0.0) break;

        bool diffuse = max_component(diffuse_color(s)) > 0.0;
        LightSample l = sample_light(world, s, path.medium, diffuse, next_pair_bits(path, 0u), next_pair(path, 1u));
        if (max_component(l.even) > 0.0 && !occluded(world, leave(s, l.wi), l.wi, l.distance_w, false, next_chance(path, 7u))) {
            add_seen(seen, path.throughput * (l.light.diffuse + l.light.specular));
            Lobes lobes = lobes_at(s, clamp(dot(s.normal_s, s.wo), 0.0, 1.0));
            vec3 scattered = l.even * (dot(s.normal_g, l.wi) < 0.0 ? lobes.transmittance : lobes.reflectance);
            weight = to_maps(layer_after(path.layer, true), path.throughput * l.light.diffuse);
            weight += to_maps(layer_after(path.layer, false), path.throughput * scattered);
            record(world, guide, index, count, l.index, l.bary, s.position_w, -l.wi, weight);
        }
        if (!depart(s, next_event(s, true, path), path)) break;
    }
    ImportancePath result;
    result.seen = seen;
    uvec2 block = pixel * IMPORTANCE_BLOCKS / frame.size;
    result.block = block.y * IMPORTANCE_BLOCKS + block.x;
    push.paths.at[index] = result;
}
