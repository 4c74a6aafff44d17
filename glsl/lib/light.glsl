// What shines: points of emissive triangles, spots, lights without area.
// In: World; positions and directions in world space. Out: radiance [nit], irradiance [lx].
// Needs math.glsl and surface.glsl.

// KHR_lights_punctual: the square of a linear ramp in the cosine.
float spot_falloff(Light light, float cos_theta) {
    float scale = 1.0 / max(0.001, light.cos_inner - light.cos_outer);
    return square(clamp((cos_theta - light.cos_outer) * scale, 0.0, 1.0));
}

// Uniform in area.
vec2 sample_triangle(vec2 u) {
    float r = sqrt(u.x);
    return vec2(u.y * r, 1.0 - r);
}

float triangle_area(Corners p) { return 0.5 * length(cross(p.p1 - p.p0, p.p2 - p.p0)); }

// Radiance [nit] of a point of an emissive triangle, by its front.
vec3 emission_at(World world, uint triangle, vec2 bary) {
    vec3 emission = surface_at(world, triangle, 0u, bary, face_normal(corners_of(world, triangle))).emission;
    bool whole = !HAS_ALPHA || (world.triangles.at[triangle].material & TRIANGLE_ALPHA) == 0u;
    return whole ? emission : emission * coverage_at(world, triangle, bary);
}

// A point of the part of an emissive triangle that is a light, uniform in area.
vec2 sample_part(Light light, vec2 u) { return light.part_corner + light.part_edge * sample_triangle(u); }

float part_area(Light light, Corners p) { return triangle_area(p) * square(light.part_edge); }

// The numbers for which sample_part draws this point.
vec2 part_numbers(Light light, vec2 bary) {
    vec2 b = (bary - light.part_corner) / light.part_edge;
    float r = clamp(1.0 - b.y, 1e-12, 1.0);
    return vec2(r * r, clamp(b.x / r, 0.0, 1.0));
}

// The way to a point of a triangle through splits into four: at the corners 0, 1, 2, and upside down in the middle 3.
uint part_key(vec2 bary) {
    uint key = 0u;
    for (uint i = 0u; i < PART_LEVELS; i++) {
        bary *= 2.0;
        uint digit = bary.x + bary.y <= 1.0 ? 0u : bary.x >= 1.0 ? 1u : bary.y >= 1.0 ? 2u : 3u;
        if (digit == 1u) bary.x -= 1.0;
        if (digit == 2u) bary.y -= 1.0;
        if (digit == 3u) bary = 1.0 - bary;
        key = key << 2u | digit;
    }
    return key;
}

// Light that a delta light sends to a point, without visibility [lx × π⁻¹ free]: irradiance on a
// surface facing it. Out: direction to the light and its distance.
vec3 delta_irradiance(Light light, vec3 position_w, out vec3 wi, out float distance_w) {
    if (light.kind == LIGHT_DIRECTIONAL) {
        wi = -light.direction_w;
        distance_w = 3.0e38;
        return light.intensity;
    }
    vec3 d = light.position_w - position_w;
    // The floor keeps a point at the light finite.
    distance_w = max(length(d), 1e-15);
    wi = d / distance_w;
    vec3 e = light.intensity / (distance_w * distance_w);
    return light.kind == LIGHT_SPOT ? e * spot_falloff(light, dot(-wi, light.direction_w)) : e;
}
