// Camera paths through specular events to the first diffuse one (Kern et al. 2023, section 3.3).
// In: World, Frame. Out: a ViewSample per pixel; in FramePixel the radiance [nit] of emitters met
// on the way (paths E S* L), and albedo, normal and depth of the first surface.
// The partition of paths: E S* L here; everything with a diffuse event is gathered from photons. The
// last rough event before a light is sampled towards the light too (see lib/direct.glsl).
#version 460
#include "lib/pass.glsl"
#include "lib/math.glsl"
#include "lib/rng.glsl"
#include "lib/sequence.glsl"
#include "lib/bsdf.glsl"
#include "lib/surface.glsl"
#include "lib/trace.glsl"
#include "lib/light.glsl"
#include "lib/direct.glsl"
#include "lib/camera.glsl"

PUSH(ViewPush);

// The two nearest edges of the triangle at which the surface ends or folds (see lib/kernel.glsl).
void find_edges(World world, uint triangle, Surface s, inout ViewSample result) {
    result.edge_distance = vec2(3.0e38);
    result.edge_normal = uvec2(0u);
    uint flags = world.triangles.at[triangle].material / TRIANGLE_EDGE & 7u;
    if (flags == 0u) return;
    Corners c = corners_of(world, triangle);
    for (uint i = 0u; i < 3u; i++) {
        if ((flags >> i & 1u) == 0u) continue;
        vec3 from = i == 0u ? c.p0 : i == 1u ? c.p1 : c.p2, to = i == 0u ? c.p1 : i == 1u ? c.p2 : c.p0;
        vec3 inward = normalize(cross(s.normal_g, normalize(to - from)));
        float d = dot(s.position_w - from, inward);
        uint normal = pack_direction(d >= 0.0 ? inward : -inward);
        d = abs(d);
        if (d < result.edge_distance.x) {
            result.edge_distance = vec2(d, result.edge_distance.x);
            result.edge_normal = uvec2(normal, result.edge_normal.x);
        } else if (d < result.edge_distance.y) {
            result.edge_distance.y = d;
            result.edge_normal.y = normal;
        }
    }
}

void main() {
    Frame frame = push.frame.at[0];
    uvec2 pixel;
    if (!pixel_of_thread(frame, thread_index(), pixel)) return;
    World world = push.world.at[0];
    uint index = pixel.y * frame.size.x + pixel.x;
    Rng rng = Rng(frame.seed, frame.iteration, index, STREAM_VIEW);

    ViewSample result;
    result.weight = vec3(0.0);
    FramePixel seen;
    seen.emission = seen.caustic = seen.global = seen.albedo = seen.normal_w = vec3(0.0);
    seen.depth = 0.0;

    // The place in the pixel and the first event go through a sequence over the iterations.
    uint seed = mix_seed(frame.seed ^ mix_seed(STREAM_VIEW + index));
    vec3 origin = frame.camera_position_w;
    vec3 direction = camera_direction(frame, pixel, sequence_pair(frame.iteration, seed));
    vec3 throughput = vec3(1.0), medium = vec3(0.0);
    float path_length = 0.0;
    // Of the event that led here, where lights were sampled too; 0 where they were not.
    float pdf_solid_angle = 0.0;
    for (uint edges = 1u; edges <= frame.max_depth; edges++) {
        Hit hit;
        if (!trace(world, origin, direction, true, hit)) break;
        Surface s = surface_at(world, hit.triangle, hit.bary, -direction);
        path_length += hit.distance_w;
        if (edges == 1u) {
            seen.albedo = s.base_color;
            seen.normal_w = s.normal_s;
            seen.depth = hit.distance_w;
        }
        throughput *= segment_transmittance(s, medium, hit.distance_w);
        if (max_component(s.emission) > 0.0) {
            float weight = 1.0;
            if (pdf_solid_angle > 0.0)
                weight = pdf_solid_angle / (pdf_solid_angle + light_pdf_solid_angle(world, hit.triangle, direction, hit.distance_w));
            seen.emission += throughput * s.emission * weight;
        }
        if (edges == frame.max_depth) break;
        if (HAS_SPECULAR && s.alpha > 0.0) seen.emission += throughput * specular_light(world, s, next_bits(rng), next4(rng).xy);

        vec4 u = edges == 1u
            ? vec4(sequence_pair(frame.iteration, seed + 1u), sequence_pair(frame.iteration, seed + 2u))
            : next4(rng);
        BsdfSample event = sample_bsdf(s, true, u, vec2(0.0));
        if (event.lobe == LOBE_DIFFUSE) {
            result.position_w = s.position_w;
            result.weight = throughput * diffuse_color(s) / (PI * event.probability);
            result.wo = pack_direction(s.wo);
            result.normal_g = pack_direction(s.normal_g);
            result.fresnel = packHalf2x16(vec2(max_component(s.f0), s.f90));
            result.depth = edges;
            find_edges(world, hit.triangle, s, result);
            result.footprint = path_length * 2.0 * length(frame.camera_up_w) / float(frame.size.y);
            break;
        }
        throughput *= event.weight;
        pdf_solid_angle = 0.0;
        if (HAS_SPECULAR) eval_specular(s, event.wi, pdf_solid_angle);
        if (event.lobe == LOBE_NONE || max_component(throughput) <= 0.0) break;
        // Long specular chains: the same roulette as photons play, from the fourth event on.
        if (edges >= 4u) {
            float survival = min(1.0, average(throughput));
            if (next4(rng).x >= survival) break;
            throughput /= survival;
        }
        medium = next_medium(s, medium, event.lobe);
        origin = leave(s, event.wi);
        direction = event.wi;
    }
    push.samples.at[index] = result;
    push.pixels.at[index] = seen;
}
