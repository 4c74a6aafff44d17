// Radiance from one photon map at each view sample: L = Σ f_r Φ / (π r²), no cosine (Kern et al.
// 2023, section 3.6), the area clipped at edges (see lib/kernel.glsl); by full evaluation or by
// stochastic evaluation of a reservoir of photons (section 3.8; Vitter 1985).
// In: ViewSamples, PhotonMaps, the map's radius [m], or with PIXEL_RADII the pixel's own.
// Out: FramePixel.caustic or .global [nit]; .bias [nit], from the same photons within half the radius;
// with PIXEL_RADII .found.
#version 460
#ifdef NEAR_GRID
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require
#endif
#include "lib/pass.glsl"
#include "lib/math.glsl"
#include "lib/rng.glsl"
#include "lib/bsdf.glsl"
#include "lib/camera.glsl"
#include "lib/photon.glsl"
#include "lib/kernel.glsl"
#ifdef PIXEL_RADII
#include "sppm/statistics.glsl"
#endif
#if defined(NEAR_GRID) || defined(NEAR_CELLS)
#include "lib/grid.glsl"
#elif defined(NEAR_LISTS)
#include "lib/lists.glsl"
#endif

PUSH(GatherPush);

// Lists are thinned out as they are searched instead.
#ifdef NEAR_LISTS
const bool RESERVOIR = false;
#else
const bool RESERVOIR = STOCHASTIC;
#endif
Rng rng;

#include "lib/near.glsl"

PhotonMaps maps;
ViewSample view;
vec3 wo;
vec3 normal_g;
vec2 fresnel;
uint longest;
// Photons lie this far off the sample's plane at most: a quarter of the radius, which a surface with
// a radius of curvature of twice the photons' stays within.
float height;
// The sample lies within a radius of an edge.
bool clipped;
vec3 edge_normal[2];

vec3 sum = vec3(0.0);
// Of half the radius.
vec3 inner_sum = vec3(0.0);
float inner_radius2;
uint found = 0u;
uint kept[RESERVOIR ? RESERVOIR_MAX : 1u];

// A photon counts where it arrived on the side that the eye sees, on a face that looks the same way
// (no halo through thin walls) and lies in the same plane (none from a wall close behind), short of
// the edges, and where the whole path is not longer than allowed.
bool accepts(NearPhoton p) {
    vec3 offset_w = p.position_w - view.position_w;
    return p.edges <= longest
        && dot(p.wi, normal_g) > 0.0
        && dot(p.normal_g, normal_g) > FOLD_COSINE
        && abs(dot(offset_w, normal_g)) <= height
        && !(clipped && (dot(offset_w, edge_normal[0]) < -view.edge_distance.x || dot(offset_w, edge_normal[1]) < -view.edge_distance.y));
}

// Without view.weight, which all photons share.
vec3 evaluate(NearPhoton p) {
    return p.flux * diffuse_transmittance(vec3(fresnel.x), fresnel.y, wo, p.wi);
}

void add(NearPhoton p) {
    vec3 flux = evaluate(p), offset_w = p.position_w - view.position_w;
    sum += flux;
    if (dot(offset_w, offset_w) <= inner_radius2 && abs(dot(offset_w, normal_g)) <= 0.5 * height) inner_sum += flux;
}

void visit_photon(uint index, NearPhoton photon) {
    if (!accepts(photon)) return;
    uint place = found++;
    if (!RESERVOIR) {
        add(photon);
        return;
    }
    if (place >= push.reservoir) place = uint(next4(rng).x * float(found));
    if (place < push.reservoir) kept[place] = index;
}

void main() {
    Frame frame = push.frame.at[0];
    uvec2 pixel;
    bool inside = pixel_of_thread(frame, thread_index(), pixel);
    uint index = pixel.y * frame.size.x + pixel.x;
    view.weight = view.position_w = vec3(0.0);
    if (inside) view = push.samples.at[index];
#ifdef NEAR_GRID
    wanted = view.weight != vec3(0.0);
#else
    if (view.weight == vec3(0.0)) return;
#endif
    maps = push.maps.at[0];
    wo = unpack_direction(view.wo);
    normal_g = unpack_direction(view.normal_g);
    fresnel = unpackHalf2x16(view.fresnel);
    longest = frame.max_depth - view.depth;
    if (STOCHASTIC) rng = Rng(frame.seed, frame.iteration, index, STREAM_GATHER + (push.map << 24));

#ifdef PIXEL_RADII
    float radius = sqrt(statistics_of(frame, push.statistics, index).radius2[push.map]);
#else
    float radius = frame.radius[push.map];
#endif
    inner_radius2 = 0.25 * radius * radius;
    float area = PI * radius * radius, inner_area = PI * inner_radius2;
    height = 0.25 * radius;
    clipped = view.edge_distance.x < radius;
    if (clipped) {
        for (int i = 0; i < 2; i++) edge_normal[i] = unpack_direction(view.edge_normal[i]);
        float cosine = dot(edge_normal[0], edge_normal[1]);
        area = clipped_disc_area(radius, view.edge_distance, cosine);
        inner_area = clipped_disc_area(0.5 * radius, view.edge_distance, cosine);
    }
    find_near(maps, push.map, view.position_w, radius);

    if (RESERVOIR && found > 0u) {
        uint n = min(found, push.reservoir);
        for (uint i = 0u; i < n; i++) add(photon_at(maps, kept[i]));
        sum *= float(found) / float(n);
        inner_sum *= float(found) / float(n);
    }
#ifdef NEAR_GRID
    if (!wanted) return;
#endif
    vec3 radiance = view.weight * sum / area;
    push.pixels.at[index].bias[push.map] = luminance(radiance - view.weight * inner_sum / inner_area);
#ifdef PIXEL_RADII
    push.pixels.at[index].found[push.map] = found;
#endif
    if (push.map == MAP_CAUSTIC) push.pixels.at[index].caustic = radiance;
    else push.pixels.at[index].global = radiance;
}
