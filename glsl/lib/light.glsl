// Photon emission (`physics.md`: flux of each kind of light). Lights are chosen by an alias table in
// proportion to luminous flux (Vose 1991); a photon carries the light's flux in its direction over
// (probability of the light × light paths). Needs math.glsl, surface.glsl and environment.glsl.
// In: uniform numbers. Out: a ray and flux [lm] per channel.

struct Emission {
    vec3 origin_w;
    vec3 direction_w;
    vec3 flux;
};

// KHR_lights_punctual: the square of a linear ramp in the cosine.
float spot_falloff(Light light, float cos_theta) {
    float scale = 1.0 / max(0.001, light.cos_inner - light.cos_outer);
    return square(clamp((cos_theta - light.cos_outer) * scale, 0.0, 1.0));
}

// Inverts ∫ falloff dcosθ over the cone: a cubic ramp from the outer to the inner angle, then linear.
// Returns cos θ with density falloff(cos θ) / `total`.
float sample_spot_cosine(Light light, float u, out float total) {
    float width = max(0.001, light.cos_inner - light.cos_outer);
    float knee = min(light.cos_outer + width, 1.0);
    float ramp_end = (knee - light.cos_outer) / width;
    float ramp = width * ramp_end * ramp_end * ramp_end / 3.0;
    total = ramp + (1.0 - knee);
    float x = u * total;
    return x < ramp ? light.cos_outer + width * pow(3.0 * x / width, 1.0 / 3.0) : knee + (x - ramp);
}

// All 32 bits choose the row: floats of 24 would favour some of a million lights.
uint choose_light(World world, uvec2 bits) {
    uint row, rest;
    umulExtended(bits.x, world.light_count, row, rest);
    Light light = load_Light(world.lights, row);
    return float(bits.y >> 8u) * 5.9604644775390625e-8 < light.alias_threshold ? row : light.alias;
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

// u: where on the light; v: direction.
Emission emit_photon(World world, uint index, uint paths, vec2 u, vec2 v) {
    Light light = load_Light(world.lights, index);
    Emission e;
    float share = 1.0 / (light.probability * float(paths));
    if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
        vec2 bary = sample_part(light, u);
        Corners p = corners_of(world, light.triangle);
        vec3 n = face_normal(p);
        e.direction_w = frame_of(n) * sample_cosine(v);
        e.origin_w = interpolate(p.p0, p.p1, p.p2, bary) + n * origin_offset(p);
        e.flux = emission_at(world, light.triangle, bary) * (PI * part_area(light, p) * share);
    } else if (light.kind == LIGHT_POINT) {
        e.origin_w = light.position_w;
        e.direction_w = sample_cone(v, -1.0);
        e.flux = light.intensity * (4.0 * PI * share);
    } else if (light.kind == LIGHT_SPOT) {
        float total;
        float z = sample_spot_cosine(light, v.x, total);
        float r = sqrt(max(0.0, 1.0 - z * z)), phi = 2.0 * PI * v.y;
        e.origin_w = light.position_w;
        e.direction_w = frame_of(light.direction_w) * vec3(r * cos(phi), r * sin(phi), z);
        e.flux = light.intensity * (2.0 * PI * total * share);
    } else if (HAS_ENVIRONMENT && light.kind == LIGHT_ENVIRONMENT) {
        // Parallel rays from a direction, through the disc that covers the scene.
        vec3 towards;
        EnvironmentLight l = sample_environment(world.environment, u, towards);
        e.direction_w = -towards;
        e.origin_w = world.center_w + world.radius * (frame_of(towards) * vec3(sample_disc(v), 1.0));
        e.flux = l.radiance * (PI * world.radius * world.radius / l.pdf_solid_angle * share);
    } else {
        mat3 frame = frame_of(light.direction_w);
        e.origin_w = world.center_w + world.radius * (frame * vec3(sample_disc(v), -1.0));
        e.direction_w = light.direction_w;
        e.flux = light.intensity * (PI * world.radius * world.radius * share);
    }
    return e;
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
