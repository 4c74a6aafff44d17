// Light paths, found from their other end: paths from the eye that go on as `path`'s do ask every
// surface they meet for the light that comes straight to it. Each answer names the primary sample
// (emission.glsl) with which a light path would have come that way, and what it would add to the
// picture: the density that light paths should have. Smooth surfaces, which no ray from a light
// could be asked for, are taken to scatter evenly what they reflect and let through: so that
// photons go to glass and mirrors, whose light is found nowhere else. (Importance for photon
// tracing: Peter & Pietrek 1998. The eye's paths need not be right, only sensible: the guide's
// density divides out.) In: World, Frame, the guide's center. Out: IMPORTANCE_RECORDS Importances a
// path [nit], ImportancePaths.
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
#include "lib/guide.glsl"
#include "lib/emission.glsl"
#include "lib/light_tree.glsl"
#include "lib/direct.glsl"
#include "lib/camera.glsl"
#include "lib/eye.glsl"

PUSH(ImportancePush);

const uint STREAM_IMPORTANCE = 0xc0000000u;

// What photons would bring of light in this layer.
float by_photons(uint layer, vec3 radiance) {
    bool direct = layer == LAYER_DIRECT && !DIRECT_RAYS;
    return layer == LAYER_CAUSTIC || layer == LAYER_GLOBAL || direct ? average(radiance) : 0.0;
}

void add_seen(inout float seen, vec3 radiance) {
    float l = luminance(radiance);
    // Nor NaN.
    if (l > 0.0) seen = min(seen + l, 1e30);
}

// Of a light, through a point, in the direction that its light goes. `bounce`: numbers that choose
// where it goes then; NONE where they do not.
void record(World world, Guide guide, uint path, inout uint count, uint light, vec2 bary,
    vec3 through_w, vec3 direction_w, uvec2 bounce, uint layer, vec3 radiance) {
    float weight = by_photons(layer, radiance);
    // Nor NaN.
    if (count == IMPORTANCE_RECORDS || light == NONE || !(weight > 0.0)) return;
    uvec4 random = pcg4d(uvec4(path, count, 0u, STREAM_IMPORTANCE));
    if (bounce.x == NONE) bounce = pcg4d(random).xy;
    Primary primary =
        primary_towards(world, guide, light, bary, through_w, direction_w, bounce, random);
    Importance found;
    found.primary.light = primary.light;
    found.primary.place = primary.place;
    found.primary.way = primary.way;
    found.primary.bounce = primary.bounce;
    found.weight = min(weight, 1e30) * (layer == LAYER_CAUSTIC ? -1.0 : 1.0);
    store_Importance(push.records, path * IMPORTANCE_RECORDS + count++, found);
}

// The numbers for which the diffuse lobe reflects light to where the path came from.
uvec2 bounce_back(Surface s) {
    vec3 d = s.wo * frame_of(s.normal_s);
    return to_unit(vec2(min(dot(d.xy, d.xy), 1.0), fract(atan(d.y, d.x) / (2.0 * PI))));
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
    uvec2 bounce = uvec2(NONE);
    Surface s;
    Hit hit;
    for (;;) {
        FramePixel found = nothing_seen();
        vec3 direction_w = path.direction_w, event_w = path.event_w;
        uint layer = path.layer;
        bool met = arrive(world, path, found, s, hit);
        add_seen(seen, found.emission + found.direct + found.caustic + found.global);
        vec3 shines = found.direct + found.caustic + found.global;
        if (max_component(shines) > 0.0) {
            uint light = met ? light_at(world, hit.triangle, hit.bary) : world.light_count - 1u;
            record(world, guide, index, count, light, hit.bary, event_w, -direction_w, bounce,
                layer, shines);
        }
        if (!met || path.edges >= frame.max_depth) break;
        if (path.layer != LAYER_EMISSION && dot(s.normal_s, s.wo) <= 0.0) break;

        bool diffuse = max_component(diffuse_color(s)) > 0.0;
        uvec2 choice = next_pair_bits(path, 0u), chance = next_chance(path, 7u);
        LightSample l = sample_light(world, s, path.medium, diffuse, choice, next_pair(path, 1u));
        if (max_component(l.even) > 0.0
            && !occluded(world, leave(s, l.wi), l.wi, l.distance_w, false, chance)) {
            add_seen(seen, path.throughput * (l.light.diffuse + l.light.specular));
            Lobes lobes = lobes_at(s, clamp(dot(s.normal_s, s.wo), 0.0, 1.0));
            bool crosses = dot(s.normal_g, l.wi) < 0.0;
            vec3 scattered = l.even * (crosses ? lobes.transmittance : lobes.reflectance);
            record(world, guide, index, count, l.index, l.bary, s.position_w, -l.wi, bounce_back(s),
                layer_after(path.layer, true), path.throughput * l.light.diffuse);
            record(world, guide, index, count, l.index, l.bary, s.position_w, -l.wi, uvec2(NONE),
                layer_after(path.layer, false), path.throughput * scattered);
        }
        BsdfSample event = next_event(s, true, path);
        bounce = event.lobe == LOBE_DIFFUSE ? bounce_back(s) : uvec2(NONE);
        if (!depart(s, event, path)) break;
    }
    ImportancePath result;
    result.seen = seen;
    uvec2 block = pixel * IMPORTANCE_BLOCKS / frame.size;
    result.block = block.y * IMPORTANCE_BLOCKS + block.x;
    push.paths.at[index] = result;
}
