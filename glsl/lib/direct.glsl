// Light that reaches a surface straight from a light and leaves by the specular lobes: next-event
// estimation, combined with paths that hit the light by the balance heuristic (Veach 1997, section
// 9.2.2). Without it a rough mirror finds a small lamp rarely and brightly, and a lamp without
// area never. Needs bsdf.glsl, trace.glsl, light.glsl.
// Out: radiance [nit]; densities per solid angle.

// With which `specular_light` would have sampled this point of an emissive triangle.
float light_pdf_solid_angle(World world, uint triangle, vec3 direction, float distance_w) {
    // Emissive triangles stand first, in the order of their places.
    uint low = 0u, high = world.first_delta_light;
    while (low < high) {
        uint middle = (low + high) / 2u;
        if (world.lights.at[middle].triangle < triangle) low = middle + 1u;
        else high = middle;
    }
    if (low == world.first_delta_light || world.lights.at[low].triangle != triangle) return 0.0;
    Corners p = corners_of(world, triangle);
    float cosine = max(-dot(face_normal(p), direction), 1e-6);
    return world.lights.at[low].probability * distance_w * distance_w / (triangle_area(p) * cosine);
}

// From one light, chosen in proportion to flux.
vec3 specular_light(World world, Surface s, uvec4 choice, vec2 u) {
    Light light = world.lights.at[choose_light(world, choice.xy)];
    vec3 wi, irradiance;
    float distance_w, pdf_bsdf, pdf_light = 0.0;
    if (light.kind == LIGHT_TRIANGLE) {
        vec2 bary = sample_triangle(u);
        Corners p = corners_of(world, light.triangle);
        vec3 to = interpolate(p.p0, p.p1, p.p2, bary) - s.position_w;
        distance_w = length(to);
        wi = to / distance_w;
        float cosine = -dot(face_normal(p), wi);
        if (!(cosine > 0.0)) return vec3(0.0);
        irradiance = surface_at(world, light.triangle, bary, -wi).emission;
        pdf_light = light.probability * distance_w * distance_w / (triangle_area(p) * cosine);
        // The light itself must not shade the light.
        distance_w *= 0.9999;
    } else {
        irradiance = delta_irradiance(light, s.position_w, wi, distance_w);
    }
    vec3 f = eval_specular(s, wi, pdf_bsdf) * abs(dot(s.normal_s, wi)) * irradiance;
    f /= light.kind == LIGHT_TRIANGLE ? pdf_light + pdf_bsdf : light.probability;
    if (!(max_component(f) > 0.0) || occluded(world, leave(s, wi), wi, distance_w)) return vec3(0.0);
    return f;
}
