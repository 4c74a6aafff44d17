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

void main() {
    Frame frame = push.frame.at[0];
    uvec2 pixel;
    bool inside = pixel_of_thread(frame, thread_index(), pixel);
    uint index = pixel.y * frame.size.x + pixel.x;
    ViewSample view;
    view.weight = view.position_w = vec3(0.0);
    if (inside) view = push.samples.at[index];
#ifdef NEAR_GRID
    wanted = view.weight != vec3(0.0);
#else
    if (view.weight == vec3(0.0)) return;
#endif
    PhotonMaps maps = push.maps.at[0];
    position_w = view.position_w;
    gather.wo = unpack_direction(view.wo);
    gather.normal_g = unpack_direction(view.normal_g);
    gather.fresnel = unpackHalf2x16(view.fresnel);
    gather.longest = frame.max_depth - view.depth;
    gather.edge_distance = view.edge_distance;
    if (STOCHASTIC) gather.rng = Rng(frame.seed, frame.iteration, index, STREAM_GATHER + (push.map << 24));

#ifdef PIXEL_RADII
    float radius = sqrt(statistics_of(frame, push.statistics, index).radius2[push.map]);
#else
    float radius = frame.radius[push.map];
#endif
    gather.radius = radius;
    float area = PI * radius * radius, inner_area = PI * inner_radius2();
    if (is_clipped()) {
        for (int i = 0; i < 2; i++) gather.edge_normal[i] = unpack_direction(view.edge_normal[i]);
        float cosine = dot(gather.edge_normal[0], gather.edge_normal[1]);
        area = clipped_disc_area(radius, view.edge_distance, cosine);
        inner_area = clipped_disc_area(0.5 * radius, view.edge_distance, cosine);
    }
    gather.sum = gather.inner_sum = vec3(0.0);
    gather.found = 0u;
    find_near(maps, push.map, position_w, radius);

    if (RESERVOIR && gather.found > 0u) {
        uint n = min(gather.found, push.reservoir);
        for (uint i = 0u; i < n; i++) add(photon_at(maps, gather.kept[i]));
        gather.sum *= float(gather.found) / float(n);
        gather.inner_sum *= float(gather.found) / float(n);
    }
#ifdef NEAR_GRID
    if (!wanted) return;
#endif
    vec3 radiance = view.weight * gather.sum / area;
    push.pixels.at[index].bias[push.map] = luminance(radiance - view.weight * gather.inner_sum / inner_area);
#ifdef PIXEL_RADII
    push.pixels.at[index].found[push.map] = gather.found;
#endif
    if (push.map == MAP_CAUSTIC) push.pixels.at[index].caustic = radiance;
    else push.pixels.at[index].global = radiance;
}
