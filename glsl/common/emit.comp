// Light paths; a photon at every surface with a diffuse lobe (Kern et al. 2023, sections 3.4 and 3.5).
// In: World, Frame, culling mask. Out: Photons in any order, how many each path has and in which
// slots (so that later passes can put them in an order that does not depend on timing), Counters.
// Caustic map: L S+ D. Global map: all other L … D. Flux in lumen per channel.
#version 460
#include "lib/pass.glsl"
#include "lib/math.glsl"
#include "lib/rng.glsl"
#include "lib/bsdf.glsl"
#include "lib/surface.glsl"
#include "lib/trace.glsl"
#include "lib/light.glsl"
#include "lib/photon.glsl"
#include "lib/cull.glsl"

PUSH(EmitPush);

bool is_culled(Frame frame, vec3 position_w) {
    if (frame.cull == 0u) return false;
    uint bit = cull_cell_hash(ivec3(floor(cull_cell_position(position_w, max(frame.radius[MAP_CAUSTIC], frame.radius[MAP_GLOBAL])))));
    return (push.mask.at[bit >> 5u] >> (bit & 31u) & 1u) == 0u;
}

#define COUNT(counter) if (HAS_LEDGER) atomicAdd(push.counters.at[0].counter, 1u)

// Flux density on the face is what a gather divides by; weighting by |ω·n_s| / |ω·n_g| makes it the
// density on the smooth surface that the shading normal stands for.
float shading_ratio(Surface s) {
    float cos_g = dot(s.wo, s.normal_g), cos_s = dot(s.wo, s.normal_s);
    return cos_g > 0.0 ? max(cos_s, 0.0) / cos_g : 0.0;
}

void main() {
    Frame frame = push.frame.at[0];
    uint path = thread_index();
    if (path >= frame.paths) {
        if (path == frame.paths) push.path_photons.at[path] = 0u;
        return;
    }
    World world = push.world.at[0];
    Rng rng = Rng(frame.seed, frame.iteration, path, STREAM_PHOTON);

    vec4 u = next4(rng), v = next4(rng);
    Emission e = emit_photon(world, choose_light(world, u.x, u.y), frame.paths, u.zw, v.xy);
    vec3 origin = e.origin_w, direction = e.direction_w, flux = e.flux;
    float emitted = average(flux);
    bool specular_only = true;
    uint stored = 0u;

    // A path has an edge to the eye too, so the photon's own number at most max_depth - 1.
    for (uint edges = 1u;; edges++) {
        if (!(average(flux) > 0.0)) {
            COUNT(absorbed);
            break;
        }
        if (edges == frame.max_depth) {
            COUNT(too_long);
            break;
        }
        Hit hit;
        if (!trace(world, origin, direction, hit)) {
            COUNT(escaped);
            break;
        }
        Surface s = surface_at(world, hit.triangle, hit.bary, -direction);
        flux *= segment_transmittance(s, hit.distance_w);

        if (max_component(diffuse_color(s)) > 0.0) {
            uint map = edges > 1u && specular_only ? MAP_CAUSTIC : MAP_GLOBAL;
            float keep = map == MAP_GLOBAL ? 1.0 - frame.reject : 1.0;
            if (keep < 1.0 && next4(rng).x >= keep) {
                COUNT(rejected);
            } else if (is_culled(frame, s.position_w)) {
                COUNT(culled);
            } else {
                uint slot = atomicAdd(push.counters.at[0].photons, 1u);
                if (slot < frame.capacity) {
                    Photon photon;
                    photon.position_w = s.position_w;
                    photon.power = pack_power(flux * (shading_ratio(s) / keep), s.wo, s.normal_g, edges);
                    push.photons.at[slot] = photon;
                    push.path_slots.at[path * frame.max_depth + stored++] = slot | map << 31;
                    if (map == MAP_CAUSTIC) atomicAdd(push.counters.at[0].caustic_photons, 1u);
                }
            }
        }

        BsdfSample event = sample_bsdf(s, false, next4(rng), next4(rng).xy);
        specular_only = specular_only && event.lobe != LOBE_DIFFUSE;
        // Shading normals make flux non-symmetric (Veach 1997, section 5.3).
        float adjoint = shading_ratio(s) * abs(dot(event.wi, s.normal_g)) / max(abs(dot(event.wi, s.normal_s)), 1e-6);
        flux *= event.lobe == LOBE_NONE ? vec3(0.0) : event.weight * adjoint;

        // Russian roulette with the average throughput, after storing.
        float survival = min(1.0, average(flux) / emitted);
        if (survival < 1.0 && survival > 0.0) {
            if (next4(rng).x >= survival) {
                COUNT(terminated);
                break;
            }
            flux /= survival;
        }
        origin = leave(s, event.wi);
        direction = event.wi;
    }
    push.path_photons.at[path] = stored;
}
