// Light paths; a photon at every surface with a diffuse lobe (Kern et al. 2023, sections 3.4 and
// 3.5). In: World, Frame, culling mask. Out: Photons in any order, how many each path has (so that
// later passes can put them in an order that does not depend on timing), Counters. Caustic map: L
// S+ D. Global map: all other L … D. Flux in lumen per channel.
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
#include "lib/photon.glsl"
#include "lib/cull.glsl"

PUSH(EmitPush);

layout(constant_id = 2) const uint PATHS_PER_THREAD = 1u;

bool is_culled(Frame frame, vec3 position_w) {
    if (frame.cull == 0u) return false;
    float radius = max(frame.radius[MAP_CAUSTIC], frame.radius[MAP_GLOBAL]);
    uint bit = cull_cell_hash(ivec3(floor(cull_cell_position(position_w, radius))));
    return (push.mask.at[bit >> 5u] >> (bit & 31u) & 1u) == 0u;
}

#define COUNT(counter) if (HAS_LEDGER) atomicAdd(push.counters.at[0].counter, 1u)

// Flux density on the face is what a gather divides by; weighting by |ω·n_s| / |ω·n_g| makes it the
// density on the smooth surface that the shading normal stands for.
float shading_ratio(Surface s) {
    float cos_g = dot(s.wo, s.normal_g), cos_s = dot(s.wo, s.normal_s);
    return cos_g > 0.0 ? max(cos_s, 0.0) / cos_g : 0.0;
}

struct LightPath {
    uint index;
    Rng rng;
    vec3 origin_w;
    vec3 direction_w;
    vec3 flux;
    // What absorbs where the path is [1/m].
    vec3 medium;
    // Numbers that choose the direction of the first diffuse reflection.
    vec2 bounce;
    // For blended surfaces: the path's number among those of all iterations, and a seed.
    uvec2 chance;
    // Average over the channels at the light.
    float emitted;
    // Of the guide there.
    float density;
    uint edges;
    uint stored;
    bool specular_only;
};

// A ray that passes what matters begins beside it, unless something is in the way from the light to
// there.
void begin_nearby(World world, Guide guide, uvec2 chance, inout Emission e) {
    float beside = distance(e.passes_w, guide.center_w), near = 4.0 * guide.reach;
    if (beside > near) return;
    vec3 begin_w = e.passes_w - (near + beside) * e.direction_w;
    float to_light = 0.9999 * distance(e.origin_w, begin_w);
    if (!occluded(world, begin_w, -e.direction_w, to_light, false, chance)) e.origin_w = begin_w;
}

// All but the beginning of a path is random (see guide.glsl).
LightPath begin(World world, Frame frame, uint index) {
    uvec2 number = number_of_path(frame, index);
    Guide guide = push.guide.at[0];
    Primary primary = uniform_primary(number);
    float density = guide_sample(guide, primary);
    Emission e = emit_photon(world, guide, primary);
    e.flux /= density * float(frame.paths);
    if (e.from_afar) begin_nearby(world, guide, number + uvec2(0u, 4u), e);
    LightPath path;
    path.index = index;
    path.rng = Rng(frame.seed, frame.iteration, index, STREAM_PHOTON);
    path.origin_w = e.origin_w;
    path.direction_w = e.direction_w;
    path.flux = e.flux;
    path.medium = vec3(0.0);
    path.bounce = from_unit(primary.bounce);
    path.chance = number + uvec2(0u, 3u);
    path.emitted = average(e.flux);
    path.density = density;
    path.edges = 1u;
    path.stored = 0u;
    path.specular_only = true;
    return path;
}

// u: uniform. Drawn for every event, so that rejection changes no path.
void store_photon(Frame frame, Surface s, float u, inout LightPath path) {
    uint map = path.edges > 1u && path.specular_only ? MAP_CAUSTIC : MAP_GLOBAL;
    float keep = map == MAP_GLOBAL ? 1.0 - frame.reject : 1.0;
    if (u >= keep) {
        COUNT(rejected);
        return;
    }
    if (is_culled(frame, s.position_w)) {
        COUNT(culled);
        return;
    }
    uint slot = atomicAdd(push.counters.at[0].photons, 1u);
    if (slot >= frame.capacity) return;
    Photon photon;
    photon.position_w = s.position_w;
    // Of a blended surface, photons and view samples each meet only a share.
    photon.path = path.index;
    photon.number = path.stored++ | map << 31;
    photon.density = path.density;
    photon.power = pack_power(path.flux * (shading_ratio(s) / (keep * s.coverage)), s.wo, s.normal_g, path.edges);
    store_Photon(push.photons, slot, photon);
    if (map == MAP_CAUSTIC) atomicAdd(push.counters.at[0].caustic_photons, 1u);
}

// One more edge; false where the path ends.
bool extend(World world, Frame frame, inout LightPath path) {
    if (!(average(path.flux) > 0.0)) {
        COUNT(absorbed);
        return false;
    }
    // A path has an edge to the eye too, so the photon's own number at most max_depth - 1.
    if (path.edges == frame.max_depth) {
        COUNT(too_long);
        return false;
    }
    Hit hit;
    if (!trace(world, path.origin_w, path.direction_w, false, uvec2(path.chance.x, path.chance.y + path.edges), hit)) {
        COUNT(escaped);
        return false;
    }
    Surface s = surface_at(world, hit.triangle, hit.place, hit.bary, -path.direction_w);
    path.flux *= segment_transmittance(s, path.medium, hit.distance_w);
    vec4 u = next4(path.rng), v = next4(path.rng);
    // Light straight from a light is found by rays, if so asked.
    if (max_component(diffuse_color(s)) > 0.0 && !(DIRECT_RAYS && path.edges == 1u)) store_photon(frame, s, v.z, path);

    BsdfSample event = sample_bsdf(s, false, u, path.specular_only ? path.bounce : v.xy);
    path.specular_only = path.specular_only && event.lobe != LOBE_DIFFUSE;
    // Shading normals make flux non-symmetric (Veach 1997, section 5.3).
    float adjoint = shading_ratio(s) * abs(dot(event.wi, s.normal_g)) / max(abs(dot(event.wi, s.normal_s)), 1e-6);
    path.flux *= event.lobe == LOBE_NONE ? vec3(0.0) : event.weight * adjoint;

    // Russian roulette with the average throughput, after storing.
    float survival = min(1.0, average(path.flux) / path.emitted);
    if (survival < 1.0 && survival > 0.0) {
        if (v.w >= survival) {
            COUNT(terminated);
            return false;
        }
        path.flux /= survival;
    }
    path.medium = next_medium(s, path.medium, event.lobe);
    path.origin_w = leave(s, event.wi);
    path.direction_w = event.wi;
    path.edges++;
    return true;
}

// A thread traces PATHS_PER_THREAD paths, and starts the next where one ends: neighbouring threads
// run in step, and would otherwise wait for the longest path among them.
void main() {
    Frame frame = push.frame.at[0];
    uint thread = thread_index(), threads = (frame.paths + PATHS_PER_THREAD - 1u) / PATHS_PER_THREAD;
    // Ends the list of counts.
    if (thread == 0u) push.path_photons.at[frame.paths] = 0u;
    if (thread >= threads) return;
    World world = push.world.at[0];
    LightPath path = begin(world, frame, thread);
    for (;;) {
        if (extend(world, frame, path)) continue;
        push.path_photons.at[path.index] = path.stored;
        uint next = path.index + threads;
        if (next >= frame.paths) return;
        path = begin(world, frame, next);
    }
}
