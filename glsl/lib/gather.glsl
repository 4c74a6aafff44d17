// Which photons near a view sample count, and what is kept of them. A pass calls this for each photon itself, or the
// any-hit shader does (common/photon.rahit).
// In: Gather, and the sample's position [m]. Out: Gather: flux × BSDF [lm/sr], but for what all photons share.
// Needs rng.glsl, bsdf.glsl, photon.glsl.

PUSH(GatherPush);

// Lists are thinned out as they are searched instead.
#ifdef NEAR_LISTS
const bool RESERVOIR = false;
#else
const bool RESERVOIR = STOCHASTIC;
#endif

// What photons are sought for, beside the position.
struct Sample {
    vec3 weight;
    vec3 wo;
    vec3 normal_g;
    vec2 fresnel;
    uint longest;
    float radius;
    vec2 edge_distance;
    // Only of a clipped disc.
    vec3 edge_normal[2];
};

struct Found {
    vec3 sum;
    // Of half the radius.
    vec3 inner_sum;
    uint count;
};

struct Gather {
    Sample at;
    Found found;
    Rng rng;
    uint kept[RESERVOIR ? RESERVOIR_MAX : 1u];
};
PAYLOAD(Gather, gather);
// Of the sample.
vec3 position_w;

#include "lib/near.glsl"

// Photons lie this far off the sample's plane at most: a quarter of the radius, which a surface with
// a radius of curvature of twice the photons' stays within.
float height() { return 0.25 * gather.at.radius; }

float inner_radius2() { return 0.25 * gather.at.radius * gather.at.radius; }

// The sample lies within a radius of an edge.
bool is_clipped() { return gather.at.edge_distance.x < gather.at.radius; }

bool beyond_edges(vec3 offset_w) {
    return dot(offset_w, gather.at.edge_normal[0]) < -gather.at.edge_distance.x
        || dot(offset_w, gather.at.edge_normal[1]) < -gather.at.edge_distance.y;
}

// A photon counts where it arrived on the side that the eye sees, on a face that looks the same way
// (no halo through thin walls) and lies in the same plane (none from a wall close behind), short of
// the edges, and where the whole path is not longer than allowed.
bool accepts(NearPhoton p) {
    vec3 offset_w = p.position_w - position_w;
    return p.edges <= gather.at.longest
        && dot(p.wi, gather.at.normal_g) > 0.0
        && dot(p.normal_g, gather.at.normal_g) > FOLD_COSINE
        && abs(dot(offset_w, gather.at.normal_g)) <= height()
        && !(is_clipped() && beyond_edges(offset_w));
}

vec3 evaluate(NearPhoton p) {
    return p.flux * diffuse_transmittance(vec3(gather.at.fresnel.x), gather.at.fresnel.y, gather.at.wo, p.wi);
}

void add(NearPhoton p) {
    vec3 flux = evaluate(p), offset_w = p.position_w - position_w;
    gather.found.sum += flux;
    if (dot(offset_w, offset_w) <= inner_radius2() && abs(dot(offset_w, gather.at.normal_g)) <= 0.5 * height()) gather.found.inner_sum += flux;
}

void visit_photon(uint index, NearPhoton photon) {
    if (!accepts(photon)) return;
    uint place = gather.found.count++;
    if (!RESERVOIR) {
        add(photon);
        return;
    }
    if (place >= push.reservoir) place = uint(next4(gather.rng).x * float(gather.found.count));
    if (place < push.reservoir) gather.kept[place] = index;
}
