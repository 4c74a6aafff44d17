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

#include "lib/gather.glsl"

// Prepares `gather` for a thread's pixel; false where nothing is to be found.
bool begin(Frame frame, uint thread, out uint index) {
    uvec2 pixel;
    bool inside = pixel_of_thread(frame, thread, pixel);
    index = pixel.y * frame.size.x + pixel.x;
    if (!inside) return false;
    ViewSample view = load_ViewSample(push.samples, index);
    position_w = view.position_w;
    gather.at.weight = view.weight;
    gather.at.wo = unpack_direction(view.wo);
    gather.at.normal_g = unpack_direction(view.normal_g);
    gather.at.fresnel = unpackHalf2x16(view.fresnel);
    gather.at.longest = frame.max_depth - view.depth;
    gather.at.edge_distance = view.edge_distance;
    if (STOCHASTIC) gather.rng = Rng(frame.seed, frame.iteration, index, STREAM_GATHER + (push.map << 24));
#ifdef PIXEL_RADII
    gather.at.radius = sqrt(statistics_of(frame, push.statistics, index).radius2[push.map]);
#else
    gather.at.radius = frame.radius[push.map];
#endif
    if (is_clipped()) for (int i = 0; i < 2; i++) gather.at.edge_normal[i] = unpack_direction(view.edge_normal[i]);
    gather.found.sum = gather.found.inner_sum = vec3(0.0);
    gather.found.count = 0u;
    return view.weight != vec3(0.0);
}

// Makes radiance of what was found.
void finish(PhotonMaps maps, uint index) {
    if (RESERVOIR && gather.found.count > 0u) {
        uint n = min(gather.found.count, push.reservoir);
        for (uint i = 0u; i < n; i++) add(photon_at(maps, gather.kept[i]));
        gather.found.sum *= float(gather.found.count) / float(n);
        gather.found.inner_sum *= float(gather.found.count) / float(n);
    }
    float area = PI * gather.at.radius * gather.at.radius, inner_area = PI * inner_radius2();
    if (is_clipped()) {
        float cosine = dot(gather.at.edge_normal[0], gather.at.edge_normal[1]);
        area = clipped_disc_area(gather.at.radius, gather.at.edge_distance, cosine);
        inner_area = clipped_disc_area(0.5 * gather.at.radius, gather.at.edge_distance, cosine);
    }
    vec3 weight = gather.at.weight, radiance = weight * gather.found.sum / area;
    push.pixels.at[index].bias[push.map] = luminance(radiance - weight * gather.found.inner_sum / inner_area);
#ifdef PIXEL_RADII
    push.pixels.at[index].found[push.map] = gather.found.count;
#endif
    if (push.map == MAP_CAUSTIC) push.pixels.at[index].caustic = radiance;
    else push.pixels.at[index].global = radiance;
}

#ifdef NEAR_GRID
// A subgroup's points are those of consecutive threads, if each had one.
void main() {
    Frame frame = push.frame.at[0];
    uint thread = thread_index(), first = thread / LANES * LANES * POINTS + thread % LANES, index[POINTS];
    [[unroll]] for (uint j = 0u; j < POINTS; j++) {
        points[j].wanted = begin(frame, first + j * LANES, index[j]);
        points[j].position_w = position_w;
        points[j].at = gather.at;
        points[j].found = gather.found;
    }
    PhotonMaps maps = push.maps.at[0];
    find_near(maps, push.map, frame.radius[push.map]);
    [[unroll]] for (uint j = 0u; j < POINTS; j++) {
        gather.at = points[j].at;
        gather.found = points[j].found;
        position_w = points[j].position_w;
        if (points[j].wanted) finish(maps, index[j]);
    }
}
#else
void main() {
    uint index;
    if (!begin(push.frame.at[0], thread_index(), index)) return;
    PhotonMaps maps = push.maps.at[0];
    find_near(maps, push.map, position_w, gather.at.radius);
    finish(maps, index);
}
#endif
