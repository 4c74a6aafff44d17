// Camera paths through specular events to the first diffuse one (Kern et al. 2023, section 3.3).
// In: World, Frame. Out: a ViewSample per pixel; in FramePixel the radiance [nit] of emitters met
// on the way (paths E S* L), and albedo, normal and depth of the first surface.
// The partition of paths: E S* L here; E S+ L of lights without area here too, at rough surfaces,
// since no path can hit them; everything with a diffuse event is gathered from photons.
#version 460
#include "lib/pass.glsl"
#include "lib/math.glsl"
#include "lib/rng.glsl"
#include "lib/bsdf.glsl"
#include "lib/surface.glsl"
#include "lib/trace.glsl"
#include "lib/light.glsl"
#include "lib/camera.glsl"

PUSH(ViewPush);

// Delta lights in the lobes of reflection and transmission [nit].
vec3 specular_delta_lights(World world, Surface s) {
    vec3 sum = vec3(0.0);
    for (uint i = world.first_delta_light; i < world.light_count; i++) {
        vec3 wi;
        float distance_w;
        vec3 irradiance = delta_irradiance(world.lights.at[i], s.position_w, wi, distance_w);
        vec3 f = eval_specular(s, wi) * abs(dot(s.normal_s, wi)) * irradiance;
        if (max_component(f) > 0.0 && !occluded(world, leave(s, wi), wi, distance_w)) sum += f;
    }
    return sum;
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

    vec4 u = next4(rng);
    vec3 origin = frame.camera_position_w, direction = camera_direction(frame, pixel, u.xy);
    vec3 throughput = vec3(1.0), medium = vec3(0.0);
    float path_length = 0.0;
    for (uint edges = 1u; edges <= frame.max_depth; edges++) {
        Hit hit;
        if (!trace(world, origin, direction, hit)) break;
        Surface s = surface_at(world, hit.triangle, hit.bary, -direction);
        path_length += hit.distance_w;
        if (edges == 1u) {
            seen.albedo = s.base_color;
            seen.normal_w = s.normal_s;
            seen.depth = hit.distance_w;
        }
        throughput *= segment_transmittance(s, medium, hit.distance_w);
        seen.emission += throughput * s.emission;
        if (edges == frame.max_depth) break;
        if (HAS_SPECULAR && HAS_DELTA_LIGHTS) seen.emission += throughput * specular_delta_lights(world, s);

        BsdfSample event = sample_bsdf(s, true, next4(rng), vec2(0.0));
        if (event.lobe == LOBE_DIFFUSE) {
            result.position_w = s.position_w;
            result.weight = throughput * diffuse_color(s) / (PI * event.probability);
            result.wo = pack_direction(s.wo);
            result.normal_g = pack_direction(s.normal_g);
            result.fresnel = packHalf2x16(vec2(max_component(s.f0), s.f90));
            result.depth = edges;
            result.footprint = path_length * 2.0 * length(frame.camera_up_w) / float(frame.size.y);
            break;
        }
        throughput *= event.weight;
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
