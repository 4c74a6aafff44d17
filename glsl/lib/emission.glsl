// Where light paths begin: seven numbers of 32 bits, the primary sample, become a light, a place on
// it and a direction; and back. In units of their range these numbers are uniform, or as the guide
// wants them (guide.glsl).
//
//     light   which: an interval of the sum of all probabilities
//     place   a point of an emissive triangle, uniform in area; for the environment, a direction
//     way     a direction; for directional lights and the environment, a point of the disc
//             through which they shine on the scene
//     bounce  the direction of the first diffuse reflection, as sample_bsdf draws it
//
// Squares become discs by Shirley & Chiu 1997, so that what is near stays near. The middle of the
// square is the guide's center, or the direction to it, and numbers are counted from there: what
// lies 10⁻⁶ of the scene's extent beside the center is still told apart. Needs math.glsl,
// guide.glsl, surface.glsl, light.glsl and environment.glsl. In: a primary sample. Out: a ray in
// world space, flux [lm] per channel over the density of a uniform sample.

struct Emission {
    vec3 origin_w;
    vec3 direction_w;
    vec3 flux;
    // Where the ray passes the guide's center, from so far away that its origin and direction do
    // not tell.
    vec3 passes_w;
    bool from_afar;
};

// From so many times the extent of what matters, the rounding of a ray's origin and direction would
// show there.
const float AFAR = 1e4;

// In [-1, 1), 0 in the middle.
vec2 from_middle(uvec2 x) { return vec2(ivec2(x ^ 0x80000000u)) * 4.656612873077393e-10; }
uvec2 to_middle(vec2 s) {
    return uvec2(ivec2(clamp(s, -1.0, 0.99999994) * 2147483648.0)) ^ 0x80000000u;
}

vec2 from_unit(uvec2 x) { return unit_floats(uvec4(x, 0u, 0u)).xy; }
uvec2 to_unit(vec2 u) { return uvec2(clamp(u, 0.0, 0.99999994) * 4294967296.0); }

vec2 disc_from_square(uvec2 square) {
    vec2 s = from_middle(square);
    bool wide = abs(s.x) >= abs(s.y);
    float r = wide ? s.x : s.y, across = wide ? s.y : s.x;
    if (r == 0.0) return vec2(0.0);
    float phi = 0.25 * PI * across / r;
    return r * (wide ? vec2(cos(phi), sin(phi)) : vec2(sin(phi), cos(phi)));
}

uvec2 square_from_disc(vec2 p) {
    bool wide = abs(p.x) >= abs(p.y);
    float along = wide ? p.x : p.y, across = wide ? p.y : p.x;
    if (along == 0.0) return uvec2(0x80000000u);
    float r = length(p) * sign(along), s = r * (4.0 / PI) * atan(across / along);
    return to_middle(wide ? vec2(r, s) : vec2(s, r));
}

// The whole sphere as a disc about +z that keeps areas (Lambert 1772).
vec3 sphere_from_disc(vec2 p) {
    float q = min(dot(p, p), 1.0);
    return vec3(2.0 * sqrt(1.0 - q) * p, 1.0 - 2.0 * q);
}
vec2 disc_from_sphere(vec3 d) { return d.xy * inversesqrt(max(2.0 * (1.0 + d.z), 1e-20)); }

// Inverts ∫ falloff dcosθ over the cone: a cubic ramp from the outer to the inner angle, then
// linear.
struct SpotCone {
    float width;
    float ramp_end;
    float knee;
    float ramp;
    float total;
};

SpotCone spot_cone(Light light) {
    SpotCone c;
    c.width = max(0.001, light.cos_inner - light.cos_outer);
    c.knee = min(light.cos_outer + c.width, 1.0);
    c.ramp_end = (c.knee - light.cos_outer) / c.width;
    c.ramp = c.width * c.ramp_end * c.ramp_end * c.ramp_end / 3.0;
    c.total = c.ramp + (1.0 - c.knee);
    return c;
}

// Returns cos θ with density falloff(cos θ) / `total`.
float sample_spot_cosine(Light light, SpotCone c, float u) {
    float x = u * c.total;
    float on_ramp = light.cos_outer + c.width * pow(3.0 * x / c.width, 1.0 / 3.0);
    return x < c.ramp ? on_ramp : c.knee + (x - c.ramp);
}

float spot_number(Light light, SpotCone c, float cos_theta) {
    float t = max(cos_theta - light.cos_outer, 0.0) / c.width;
    return (cos_theta < c.knee ? c.width * t * t * t / 3.0 : c.ramp + cos_theta - c.knee) / c.total;
}

// The light whose interval holds a number.
uint light_of_number(World world, uint number) {
    uint light = 0u, end = world.light_count;
    if (end > 1u) do {
        uint middle = (light + end) / 2u;
        if (world.lights.at[middle].first_number <= number) light = middle;
        else end = middle;
    } while (end - light > 1u);
    return light;
}

// Seen from afar, what matters is a narrow bundle about the direction to the guide's center,
// whichever way a triangle faces.
bool is_far(Guide guide, vec3 corner_w) {
    vec3 d = guide.center_w - corner_w;
    return dot(d, d) > square(2.0 * guide.reach);
}

// About the direction to the guide's center; any other for a light that is there.
mat3 frame_towards_center(Guide guide, vec3 from_w) {
    vec3 d = guide.center_w - from_w;
    float largest = max_component(abs(d));
    return frame_of(largest > 0.0 ? normalize(d / largest) : vec3(0.0, 0.0, 1.0));
}

// From a light at a distance, about the direction to the guide's center.
void aim(Guide guide, vec2 disc, inout Emission e) {
    vec3 d = sphere_from_disc(disc);
    float distance_w = distance(guide.center_w, e.origin_w);
    mat3 frame = frame_towards_center(guide, e.origin_w);
    e.direction_w = frame * d;
    // Without the difference of two long ways.
    e.passes_w = guide.center_w + distance_w * (frame * vec3(d.xy, -2.0 * dot(disc, disc)));
    e.from_afar = distance_w > AFAR * guide.reach;
}

Emission emit_photon(World world, Guide guide, Primary primary) {
    Light light = load_Light(world.lights, light_of_number(world, primary.light));
    Emission e;
    e.from_afar = false;
    float share = 1.0 / light.probability;
    if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
        vec2 bary = sample_part(light, from_unit(primary.place));
        Corners p = corners_of(world, light.triangle);
        vec3 n = face_normal(p);
        e.origin_w = interpolate(p.p0, p.p1, p.p2, bary) + n * origin_offset(p);
        vec2 disc = disc_from_square(primary.way);
        float solid_angle = PI;
        if (is_far(guide, p.p0)) {
            aim(guide, disc, e);
            solid_angle = 4.0 * PI * max(dot(e.direction_w, n), 0.0);
        } else {
            e.direction_w = frame_of(n) * vec3(disc, sqrt(max(0.0, 1.0 - dot(disc, disc))));
        }
        e.flux = emission_at(world, light.triangle, bary);
        e.flux *= solid_angle * part_area(light, p) * share;
    } else if (light.kind == LIGHT_POINT) {
        e.origin_w = light.position_w;
        aim(guide, disc_from_square(primary.way), e);
        e.flux = light.intensity * (4.0 * PI * share);
    } else if (light.kind == LIGHT_SPOT) {
        SpotCone cone = spot_cone(light);
        vec2 u = from_unit(primary.way);
        float z = sample_spot_cosine(light, cone, u.x);
        float r = sqrt(max(0.0, 1.0 - z * z)), phi = 2.0 * PI * u.y;
        e.origin_w = light.position_w;
        e.direction_w = frame_of(light.direction_w) * vec3(r * cos(phi), r * sin(phi), z);
        e.flux = light.intensity * (2.0 * PI * cone.total * share);
    } else {
        // Parallel rays from a direction, through the disc that covers the scene.
        vec3 irradiance = light.intensity;
        e.direction_w = light.direction_w;
        if (HAS_ENVIRONMENT && light.kind == LIGHT_ENVIRONMENT) {
            vec3 towards;
            vec2 u = from_unit(primary.place);
            EnvironmentLight l = sample_environment(world.environment, u, towards);
            e.direction_w = -towards;
            irradiance = l.radiance / l.pdf_solid_angle;
        }
        mat3 frame = frame_of(e.direction_w);
        vec3 beside = frame * vec3(disc_from_square(primary.way), 0.0);
        e.passes_w = guide.center_w + guide.radius * beside;
        e.from_afar = guide.radius > AFAR * guide.reach;
        e.origin_w = e.passes_w - guide.radius * e.direction_w;
        e.flux = irradiance * (PI * guide.radius * guide.radius * share);
    }
    return e;
}

// The primary sample for which a light sends a photon through a point in a direction: from `bary`,
// where it is a triangle. What does not matter is taken from `random`.
Primary primary_towards(World world, Guide guide, uint index, vec2 bary, vec3 through_w,
    vec3 direction_w, uvec2 bounce, uvec4 random) {
    Light light = load_Light(world.lights, index);
    Primary primary = Primary(0u, random.xy, random.zw, bounce);
    // Anywhere in its interval, as each number of it is as good.
    uint rest;
    umulExtended(random.x ^ random.w, uint(light.probability * 4294967040.0), primary.light, rest);
    primary.light += light.first_number;
    if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
        Corners p = corners_of(world, light.triangle);
        vec3 n = face_normal(p), origin_w = interpolate(p.p0, p.p1, p.p2, bary);
        primary.place = to_unit(part_numbers(light, bary));
        bool far = is_far(guide, p.p0);
        vec3 d = direction_w * (far ? frame_towards_center(guide, origin_w) : frame_of(n));
        primary.way = square_from_disc(far ? disc_from_sphere(d) : d.xy);
    } else if (light.kind == LIGHT_POINT) {
        vec3 d = direction_w * frame_towards_center(guide, light.position_w);
        primary.way = square_from_disc(disc_from_sphere(d));
    } else if (light.kind == LIGHT_SPOT) {
        vec3 d = direction_w * frame_of(light.direction_w);
        float turn = fract(atan(d.y, d.x) / (2.0 * PI));
        primary.way = to_unit(vec2(spot_number(light, spot_cone(light), d.z), turn));
    } else {
        if (HAS_ENVIRONMENT && light.kind == LIGHT_ENVIRONMENT)
            primary.place = to_unit(environment_numbers(world.environment, -direction_w));
        vec3 p = (through_w - guide.center_w) * frame_of(direction_w);
        primary.way = square_from_disc(p.xy / guide.radius);
    }
    return primary;
}
