// Light that comes straight from a light: next-event estimation towards one light, combined with paths
// that hit the light by the balance heuristic (Veach 1997, section 9.2.2), lobe by lobe. Without it a
// diffuse wall or a rough mirror finds a small lamp rarely and brightly, and a lamp without area never.
// Needs bsdf.glsl, trace.glsl, light.glsl.
// Out: radiance [nit]; densities per solid angle.

// With which `direct_light` would have sampled this point of an emissive triangle.
float light_pdf_solid_angle(World world, uint triangle, vec3 direction, float distance_w) {
    uint low = 0u, high = world.first_delta_light;
    while (low < high) {
        uint middle = (low + high) / 2u;
        if (world.lights.at[world.lights_by_triangle.at[middle]].triangle < triangle) low = middle + 1u;
        else high = middle;
    }
    if (low == world.first_delta_light) return 0.0;
    Light light = world.lights.at[world.lights_by_triangle.at[low]];
    if (light.triangle != triangle) return 0.0;
    Corners p = corners_of(world, triangle);
    float cosine = max(-dot(face_normal(p), direction), 1e-6);
    return light.probability * distance_w * distance_w / (triangle_area(p) * cosine);
}

// Of one light, by the lobes that it leaves by.
struct Direct {
    vec3 diffuse;
    vec3 specular;
};

// From one light, chosen in proportion to flux. `medium`: what the path is in, on the side of wo.
// `diffuse`: whether to ask for that lobe. `skip_backs`: of a path from the eye that has met specular
// surfaces only; its specular lobes see lights as the eye does (see trace.glsl).
Direct direct_light(World world, Surface s, vec3 medium, bool diffuse, bool skip_backs, uvec2 choice, vec2 u) {
    Direct d = Direct(vec3(0.0), vec3(0.0));
    Light light = world.lights.at[choose_light(world, choice)];
    vec3 wi, irradiance;
    float distance_w, pdf_light = 0.0;
    if (light.kind == LIGHT_TRIANGLE) {
        vec2 bary = sample_triangle(u);
        Corners p = corners_of(world, light.triangle);
        vec3 to = interpolate(p.p0, p.p1, p.p2, bary) - s.position_w;
        distance_w = length(to);
        wi = to / distance_w;
        float cosine = -dot(face_normal(p), wi);
        if (!(cosine > 0.0)) return d;
        irradiance = emission_at(world, light.triangle, bary);
        pdf_light = light.probability * distance_w * distance_w / (triangle_area(p) * cosine);
        // The light itself must not shade the light.
        distance_w *= 0.9999;
    } else {
        irradiance = delta_irradiance(light, s.position_w, wi, distance_w);
        irradiance /= light.probability;
    }
    if (HAS_ABSORPTION) {
        uint lobe = dot(s.normal_g, wi) < 0.0 ? LOBE_TRANSMISSION : LOBE_REFLECTION;
        irradiance *= exp(-next_medium(s, medium, lobe) * distance_w);
    }
    irradiance *= abs(dot(s.normal_s, wi));
    float pdf_diffuse, pdf_specular;
    if (diffuse) {
        d.diffuse = eval_diffuse(s, wi, pdf_diffuse) * irradiance;
        if (pdf_light > 0.0) d.diffuse /= pdf_light + pdf_diffuse;
    }
    if (HAS_SPECULAR) {
        d.specular = eval_specular(s, wi, pdf_specular) * irradiance;
        if (pdf_light > 0.0) d.specular /= pdf_light + pdf_specular;
    }
    // NaN too.
    if (!(max_component(d.diffuse + d.specular) > 0.0)) return Direct(vec3(0.0), vec3(0.0));
    vec3 origin = leave(s, wi);
    if (occluded(world, origin, wi, distance_w, false)) {
        d.diffuse = vec3(0.0);
        bool behind_backs = HAS_ONE_SIDED && skip_backs && max_component(d.specular) > 0.0;
        if (!behind_backs || occluded(world, origin, wi, distance_w, true)) d.specular = vec3(0.0);
    }
    return d;
}
