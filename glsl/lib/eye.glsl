// A path from the eye, surface by surface: what `view` and `path` share.
// Needs camera.glsl, sequence.glsl, bsdf.glsl, trace.glsl, direct.glsl.
// In: World, Frame. Out: radiance [nit] in the layers of a FramePixel.
//
// The partition of paths, as regular expressions over the eye E, the lobes that its events chose
// (D diffuse, S any other) and the light L:
//
//     emission   E S* L
//     direct     E S* D L
//     caustic    E S* D S+ L
//     global     E S* D [SD]* D S* L
//
// Each path is in one of them, and no technique finds it twice. `path` finds all four. Techniques
// that gather photons find `emission` in `view`, and the last S* D S+ L and D … D S* L as photons of
// the caustic and the global map. They find `direct` in `view` too with direct light by rays
// (DIRECT_RAYS); else photons that come straight from a light bring it, and it is part of `global`.

const uint LAYER_EMISSION = 0u;
const uint LAYER_DIRECT = 1u;
const uint LAYER_CAUSTIC = 2u;
const uint LAYER_GLOBAL = 3u;

// Where light belongs that reaches a path of this layer through one more lobe.
uint layer_after(uint layer, bool diffuse) {
    if (diffuse) return layer == LAYER_EMISSION ? LAYER_DIRECT : LAYER_GLOBAL;
    return layer == LAYER_DIRECT ? LAYER_CAUSTIC : layer;
}

void add_light(inout FramePixel seen, uint layer, vec3 radiance) {
    if (layer == LAYER_EMISSION) seen.emission += radiance;
    else if (layer == LAYER_DIRECT) seen.direct += radiance;
    else if (layer == LAYER_CAUSTIC) seen.caustic += radiance;
    else seen.global += radiance;
}

struct EyePath {
    uint iteration;
    uint seed;
    Rng rng;
    vec3 origin_w;
    vec3 direction_w;
    // Where it last left a surface; the origin lies beside it.
    vec3 event_w;
    vec3 throughput;
    // What refraction has scaled radiance by, so far, inverted: η² of where the path is.
    float refraction;
    // What absorbs where the path is [1/m].
    vec3 medium;
    uint edges;
    // Of all edges [m].
    float length_w;
    // Of a light that the next edge hits.
    uint layer;
    // Of the direction, where lights were sampled too; 0 where they were not.
    float pdf_solid_angle;
};

// Up to this edge random numbers go through sequences over the iterations.
const uint SEQUENCE_EDGES = 3u;

// `dimension` below 8.
uvec2 next_pair_bits(inout EyePath path, uint dimension) {
    return path.edges <= SEQUENCE_EDGES ? sequence_bits(path.iteration, path.seed + 8u * path.edges + dimension) : next_bits(path.rng).xy;
}

vec2 next_pair(inout EyePath path, uint dimension) { return unit_floats(uvec4(next_pair_bits(path, dimension), 0u, 0u)).xy; }

// For blended surfaces on the next edge, or on a ray to a light (see surface.glsl).
uvec2 next_chance(EyePath path, uint dimension) { return uvec2(path.iteration, path.seed + 8u * path.edges + dimension); }

EyePath begin_eye_path(Frame frame, uvec2 pixel, uint index) {
    EyePath path;
    path.iteration = frame.iteration;
    path.seed = mix_seed(frame.seed ^ mix_seed(STREAM_VIEW + index));
    path.rng = Rng(frame.seed, frame.iteration, index, STREAM_VIEW);
    path.edges = 0u;
    camera_ray(frame, pixel, next_pair(path, 0u), path.origin_w, path.direction_w);
    path.event_w = path.origin_w;
    path.throughput = vec3(1.0);
    path.refraction = 1.0;
    path.medium = vec3(0.0);
    path.length_w = 0.0;
    path.layer = LAYER_EMISSION;
    path.pdf_solid_angle = 0.0;
    return path;
}

FramePixel nothing_seen() {
    FramePixel seen;
    seen.emission = seen.direct = seen.caustic = seen.global = seen.albedo = seen.normal_w = vec3(0.0);
    seen.depth = 0.0;
    seen.bias = vec2(0.0);
    seen.found = uvec2(0u);
    return seen;
}

// What shines where no surface is.
void add_environment(World world, EyePath path, inout FramePixel seen) {
    EnvironmentLight l = environment_seen(world, path.event_w, path.direction_w);
    float weight = path.pdf_solid_angle > 0.0 ? 1.0 / (1.0 + l.pdf_solid_angle / path.pdf_solid_angle) : 1.0;
    // What absorbs where nothing ends it absorbs all, as on the way to lamps without area.
    if (HAS_ABSORPTION) l.radiance *= transmittance(path.medium, 3.0e38);
    add_light(seen, path.layer, path.throughput * l.radiance * weight);
}

// One more edge: finds the surface at its end and adds what shines there. False where there is none.
bool arrive(World world, inout EyePath path, inout FramePixel seen, out Surface s, out Hit hit) {
    // Beyond a diffuse surface the path stands for light (see trace.glsl).
    if (!trace(world, path.origin_w, path.direction_w, path.layer == LAYER_EMISSION, next_chance(path, 6u), hit)) {
        if (HAS_ENVIRONMENT) add_environment(world, path, seen);
        return false;
    }
    s = surface_at(world, hit.triangle, hit.place, hit.bary, -path.direction_w);
    path.edges++;
    path.length_w += hit.distance_w;
    if (path.edges == 1u) {
        seen.albedo = s.base_color;
        seen.normal_w = s.normal_s;
        seen.depth = hit.distance_w;
    }
    path.throughput *= segment_transmittance(s, path.medium, hit.distance_w);
    if (max_component(s.emission) > 0.0) {
        float weight = 1.0;
        if (path.pdf_solid_angle > 0.0)
            weight = 1.0 / (1.0 + light_pdf_solid_angle(world, path.event_w, hit.triangle, hit.bary, path.direction_w, hit.distance_w) / path.pdf_solid_angle);
        add_light(seen, path.layer, path.throughput * s.emission * weight);
    }
    return true;
}

// Adds the light that comes straight from a light and leaves by a lobe that is not a mirror's.
// `diffuse`: by the diffuse one too.
void add_direct_light(World world, Surface s, bool diffuse, inout EyePath path, inout FramePixel seen) {
    diffuse = diffuse && max_component(diffuse_color(s)) > 0.0;
    if (!diffuse && !(HAS_ROUGH && s.alpha > 0.0)) return;
    Direct d = direct_light(world, s, path.medium, diffuse, path.layer == LAYER_EMISSION, next_pair_bits(path, 0u), vec3(next_pair(path, 1u), next_pair(path, 5u).x), next_chance(path, 7u));
    add_light(seen, layer_after(path.layer, true), path.throughput * d.diffuse);
    add_light(seen, layer_after(path.layer, false), path.throughput * d.specular);
}

// Draws the event at s. `diffuse`: the direction matters where it is diffuse.
BsdfSample next_event(Surface s, bool diffuse, inout EyePath path) {
    vec4 u = vec4(next_pair(path, 2u), next_pair(path, 3u));
    return sample_bsdf(s, true, u, diffuse ? next_pair(path, 4u) : vec2(0.0));
}

// Leaves s by an event, for whose lobe add_direct_light has asked. False where the path ends.
bool depart(Surface s, BsdfSample event, inout EyePath path) {
    path.throughput *= event.weight;
    if (event.lobe == LOBE_NONE || !(max_component(path.throughput) > 0.0)) return false;
    if (event.lobe == LOBE_TRANSMISSION && s.solid) path.refraction *= square(relative_ior(s));
    // Long paths: the same roulette as photons play, from the fourth event on. What refraction takes from radiance it
    // gives back where the path leaves.
    if (path.edges >= 4u) {
        float survival = min(1.0, average(path.throughput) * path.refraction);
        if (next4(path.rng).x >= survival) return false;
        path.throughput /= survival;
    }
    path.pdf_solid_angle = 0.0;
    bool diffuse = event.lobe == LOBE_DIFFUSE;
    if (diffuse) eval_diffuse(s, event.wi, path.pdf_solid_angle);
    else if (HAS_ROUGH) eval_specular(s, event.wi, path.pdf_solid_angle);
    path.layer = layer_after(path.layer, diffuse);
    path.medium = next_medium(s, path.medium, event.lobe);
    path.event_w = s.position_w;
    path.origin_w = leave(s, event.wi);
    path.direction_w = event.wi;
    return true;
}
