// Camera paths through specular events to the first diffuse one (Kern et al. 2023, section 3.3).
// In: World, Frame. Out: a ViewSample per pixel; in FramePixel radiance [nit]: emission, and with
// DIRECT_RAYS direct light (see lib/eye.glsl for the partition of paths); albedo, normal and depth of
// the first surface.
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
#include "lib/light_tree.glsl"
#include "lib/direct.glsl"
#include "lib/camera.glsl"
#include "lib/eye.glsl"

PUSH(ViewPush);

// The two nearest edges of the triangle at which the surface ends or folds (see lib/kernel.glsl).
void find_edges(World world, Hit hit, Surface s, inout ViewSample result) {
    result.edge_distance = vec2(3.0e38);
    result.edge_normal = uvec2(0u);
    uint flags = world.triangles.at[hit.triangle].material / TRIANGLE_EDGE & 7u;
    if (flags == 0u) return;
    Corners c = corners_at(world, hit.triangle, hit.place);
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

    ViewSample result;
    result.weight = vec3(0.0);
    FramePixel seen = nothing_seen();
    EyePath path = begin_eye_path(frame, pixel, index);
    Surface s;
    Hit hit;
    while (arrive(world, path, seen, s, hit) && path.edges < frame.max_depth) {
        add_direct_light(world, s, DIRECT_RAYS, path, seen);
        BsdfSample event = next_event(s, DIRECT_RAYS, path);
        if (event.lobe == LOBE_DIFFUSE) {
            result.position_w = s.position_w;
            result.weight = path.throughput * diffuse_color(s) / (PI * event.probability);
            result.wo = pack_direction(s.wo);
            result.normal_g = pack_direction(s.normal_g);
            result.fresnel = packHalf2x16(vec2(max_component(s.f0), s.f90));
            result.depth = path.edges;
            result.offset = s.offset;
            find_edges(world, hit, s, result);
            result.footprint = pixel_footprint(frame, path.length_w);
            // Towards lights that are easier to hit than to sample.
            if (DIRECT_RAYS && (HAS_AREA_LIGHTS || HAS_ENVIRONMENT) && depart(s, event, path)) arrive(world, path, seen, s, hit);
            break;
        }
        if (!depart(s, event, path)) break;
    }
    store_ViewSample(push.samples, index, result);
    store_FramePixel(push.pixels, index, seen);
}
