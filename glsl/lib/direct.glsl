// Light that comes straight from a light: next-event estimation, combined with paths that hit the
// light by the balance heuristic (Veach 1997, section 9.2.2), lobe by lobe. Without it a diffuse
// wall or a rough mirror finds a small lamp rarely and brightly, and a lamp without area never.
// Needs bsdf.glsl, trace.glsl, light.glsl, light_tree.glsl. Out: radiance [nit]; densities per
// solid angle.

// The light that a point of an emissive triangle belongs to; NONE where it is dark.
uint light_at(World world, uint triangle, vec2 bary) {
#ifdef TEXTURES
    uint key = part_key(bary);
#else
    uint key = 0u;
#endif
    // The last light that begins at this part or before.
    uint low = 0u, high = world.first_delta_light;
    if (low < high) do {
        uint middle = (low + high) / 2u;
        Light light = load_Light(world.lights, world.lights_by_triangle.at[middle]);
        if (light.triangle < triangle || (light.triangle == triangle && light.part <= key)) low = middle + 1u;
        else high = middle;
    } while (low < high);
    if (low == 0u) return NONE;
    uint index = world.lights_by_triangle.at[low - 1u];
    Light light = load_Light(world.lights, index);
    // Dark parts are no lights.
    uint length = uint(square(light.part_edge) * float(1u << 2u * PART_LEVELS));
    return light.triangle != triangle || key - light.part >= length ? NONE : index;
}

// With which `sample_light` at `from_w` would have sampled this point of an emissive triangle.
float light_pdf_solid_angle(World world, vec3 from_w, uint triangle, vec2 bary, vec3 direction, float distance_w) {
    uint index = light_at(world, triangle, bary);
    if (index == NONE) return 0.0;
    Light light = load_Light(world.lights, index);
    Corners p = corners_of(world, triangle);
    float cosine = max(-dot(face_normal(p), direction), 1e-6);
    return light_probability(world, index, from_w) * distance_w * distance_w / (part_area(light, p) * cosine);
}

// Likewise, of a direction to the environment.
EnvironmentLight environment_seen(World world, vec3 from_w, vec3 direction_w) {
    EnvironmentLight l = environment_towards(world.environment, direction_w);
    l.pdf_solid_angle *= light_probability(world, world.light_count - 1u, from_w);
    return l;
}

// Of one light, by the lobes that it leaves by.
struct Direct {
    vec3 diffuse;
    vec3 specular;
};

// A point on a light, as seen from a surface.
struct LightSample {
    uint index;
    // Of a triangle.
    vec2 bary;
    vec3 wi;
    float distance_w;
    // Unless something is in the way: what a surface that scatters evenly, albedo 1, would turn
    // towards the eye [nit], of this one strategy alone.
    vec3 even;
    // Likewise, what this surface does, in balance with paths that hit the light.
    Direct light;
};

// A point of one light. `medium`: what the path is in, on the side of wo.
// `diffuse`: whether to ask for that lobe.
LightSample sample_light(World world, Surface s, vec3 medium, bool diffuse, uvec2 choice, vec2 u) {
    LightSample l;
    l.even = vec3(0.0);
    l.light = Direct(vec3(0.0), vec3(0.0));
    l.bary = vec2(0.0);
    float probability;
    l.index = choose_light_near(world, s.position_w, choice, probability);
    Light light = load_Light(world.lights, l.index);
    vec3 irradiance = vec3(0.0);
    float pdf_light = 0.0;
    if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
        l.bary = sample_part(light, u);
        Corners p = corners_of(world, light.triangle);
        vec3 to = interpolate(p.p0, p.p1, p.p2, l.bary) - s.position_w;
        l.distance_w = length(to);
        l.wi = to / l.distance_w;
        float cosine = -dot(face_normal(p), l.wi);
        if (!(cosine > 0.0)) return l;
        irradiance = emission_at(world, light.triangle, l.bary);
        pdf_light = probability * l.distance_w * l.distance_w / (part_area(light, p) * cosine);
        // The light itself must not shade the light.
        l.distance_w *= 0.9999;
    } else if (HAS_ENVIRONMENT && light.kind == LIGHT_ENVIRONMENT) {
        EnvironmentLight e = sample_environment(world.environment, u, l.wi);
        l.distance_w = 3.0e38;
        irradiance = e.radiance;
        pdf_light = probability * e.pdf_solid_angle;
        if (!(pdf_light > 0.0)) return l;
    } else if (HAS_DELTA_LIGHTS) {
        irradiance = delta_irradiance(light, s.position_w, l.wi, l.distance_w) / probability;
    }
    if (HAS_ABSORPTION) {
        uint lobe = dot(s.normal_g, l.wi) < 0.0 ? LOBE_TRANSMISSION : LOBE_REFLECTION;
        irradiance *= transmittance(next_medium(s, medium, lobe), l.distance_w);
    }
    irradiance *= abs(dot(s.normal_s, l.wi));
    l.even = irradiance / (PI * (pdf_light > 0.0 ? pdf_light : 1.0));
    float pdf_diffuse, pdf_specular;
    if (diffuse) {
        l.light.diffuse = eval_diffuse(s, l.wi, pdf_diffuse) * irradiance;
        if (pdf_light > 0.0) l.light.diffuse /= pdf_light + pdf_diffuse;
    }
    if (HAS_ROUGH) {
        l.light.specular = eval_specular(s, l.wi, pdf_specular) * irradiance;
        if (pdf_light > 0.0) l.light.specular /= pdf_light + pdf_specular;
    }
    return l;
}

// Points on lights, of which one is asked for by a ray. Few lights are covered by the sequences
// over the iterations, which a choice among candidates would upset; many are not.
const uint LIGHT_CANDIDATES = 4u;
const uint FEW_LIGHTS = 16u;

// Resampled importance sampling (Talbot et al. 2005): of a few points on lights the one to ask for
// by a ray is chosen in proportion to the light that would come from it. The balance heuristic is
// part of what is resampled, so that it holds as for one point. `skip_backs`: of a path from the
// eye that has met specular surfaces only; its specular lobes see lights as the eye does (see
// trace.glsl). u.z: uniform. `chance`: for blended surfaces in the way.
Direct direct_light(World world, Surface s, vec3 medium, bool diffuse, bool skip_backs, uvec2 choice, vec3 u, uvec2 chance) {
    uint count = world.light_count > FEW_LIGHTS ? LIGHT_CANDIDATES : 1u;
    LightSample chosen;
    float total = 0.0, chosen_weight = 0.0;
    uint i = 0u;
    do {
        // Branches of the tree far from each other, points far from each other (Roberts's R2
        // sequence).
        uvec2 shift = uvec2(0xffffffffu / count, 0x9e3779b9u) * i;
        vec2 at = fract(u.xy + float(i) * vec2(0.7548776662, 0.5698402910));
        LightSample l = sample_light(world, s, medium, diffuse, choice + shift, at);
        float weight = max_component(l.light.diffuse + l.light.specular);
        // Nor NaN.
        if (!(weight > 0.0)) continue;
        total += weight;
        float probability = weight / total;
        if (u.z < probability) {
            chosen = l;
            chosen_weight = weight;
            u.z /= probability;
        } else {
            u.z = (u.z - probability) / (1.0 - probability);
        }
    } while (++i < count);
    if (chosen_weight == 0.0) return Direct(vec3(0.0), vec3(0.0));
    float share = total / (chosen_weight * float(count));
    Direct d = Direct(chosen.light.diffuse * share, chosen.light.specular * share);
    vec3 origin = leave(s, chosen.wi);
    bool dark = occluded(world, origin, chosen.wi, chosen.distance_w, false, chance), dark_to_eye = dark;
    // The eye sees through backs, and not through what is unlit.
    if (skip_backs && (dark ? HAS_ONE_SIDED : HAS_UNLIT) && max_component(d.specular) > 0.0)
        dark_to_eye = occluded(world, origin, chosen.wi, chosen.distance_w, true, chance);
    if (dark) d.diffuse = vec3(0.0);
    if (dark_to_eye) d.specular = vec3(0.0);
    return d;
}
