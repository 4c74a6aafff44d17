// What is asked of each photon near a view sample, and what is kept of it: the body of a gather. On a ray tracing
// pipeline common/photon.rahit runs it, else the pass itself.
// In: a ViewSample, the radius [m]. Out: Gathered, without ViewSample.weight, which all photons share.
// Needs rng.glsl, bsdf.glsl, photon.glsl.

PUSH(GatherPush);

// Lists are thinned out as they are searched instead.
#ifdef NEAR_LISTS
const bool RESERVOIR = false;
#else
const bool RESERVOIR = STOCHASTIC;
#endif
struct Gathered {
    vec3 sum;
    // Of half the radius.
    vec3 inner_sum;
    uint found;
    uint kept[RESERVOIR ? RESERVOIR_MAX : 1u];
};
PAYLOAD(Gathered, gathered);

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
float inner_radius2;

// Makes ready to visit photons within the radius of `view`, the sample of the pixel `index`.
void prepare(Frame frame, uint index, float radius) {
    maps = push.maps.at[0];
    wo = unpack_direction(view.wo);
    normal_g = unpack_direction(view.normal_g);
    fresnel = unpackHalf2x16(view.fresnel);
    longest = frame.max_depth - view.depth;
    if (STOCHASTIC) rng = Rng(frame.seed, frame.iteration, index, STREAM_GATHER + (push.map << 24));
    inner_radius2 = 0.25 * radius * radius;
    height = 0.25 * radius;
    clipped = view.edge_distance.x < radius;
    if (clipped) for (int i = 0; i < 2; i++) edge_normal[i] = unpack_direction(view.edge_normal[i]);
}

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

vec3 evaluate(NearPhoton p) {
    return p.flux * diffuse_transmittance(vec3(fresnel.x), fresnel.y, wo, p.wi);
}

void add(NearPhoton p) {
    vec3 flux = evaluate(p), offset_w = p.position_w - view.position_w;
    gathered.sum += flux;
    if (dot(offset_w, offset_w) <= inner_radius2 && abs(dot(offset_w, normal_g)) <= 0.5 * height) gathered.inner_sum += flux;
}

void visit_photon(uint index, NearPhoton photon) {
    if (!accepts(photon)) return;
    uint place = gathered.found++;
    if (!RESERVOIR) {
        add(photon);
        return;
    }
    if (place >= push.reservoir) {
        Rng draw = rng;
        draw.dimension += place - push.reservoir;
        place = uint(next4(draw).x * float(gathered.found));
    }
    if (place < push.reservoir) gathered.kept[place] = index;
}
