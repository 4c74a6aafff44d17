// Small geometry: constants, octahedral directions, frames, luminance; a hash.
const float PI = 3.14159265358979;

float square(float x) { return x * x; }

// Of linear Rec. 709.
float luminance(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }
float average(vec3 c) { return (c.r + c.g + c.b) / 3.0; }
float max_component(vec3 v) { return max(v.x, max(v.y, v.z)); }

// Octahedral map of the unit sphere (Cigolle et al. 2014), 16 bits an axis: error below 1e-4 rad.
vec2 octahedral_fold(vec2 p) {
    return (1.0 - abs(p.yx)) * vec2(p.x >= 0.0 ? 1.0 : -1.0, p.y >= 0.0 ? 1.0 : -1.0);
}
uint pack_direction(vec3 d) {
    vec2 p = d.xy / (abs(d.x) + abs(d.y) + abs(d.z));
    return packSnorm2x16(d.z < 0.0 ? octahedral_fold(p) : p);
}
vec3 unpack_direction(uint packed_direction) {
    vec2 p = unpackSnorm2x16(packed_direction);
    vec3 d = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    if (d.z < 0.0) d.xy = octahedral_fold(d.xy);
    return normalize(d);
}

// Columns: two tangents and the normal n (Duff et al. 2017).
mat3 frame_of(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

// Unit vector about +z with density cos θ / π (solid angle).
vec3 sample_cosine(vec2 u) {
    float r = sqrt(u.x), phi = 2.0 * PI * u.y;
    return vec3(r * cos(phi), r * sin(phi), sqrt(max(0.0, 1.0 - u.x)));
}

// Integer hash (Wang 2007), which Kern et al. 2023 and Mara et al. 2013 take for grid cells.
uint wang_hash(uint key) {
    key = (key ^ 61u) ^ (key >> 16u);
    key *= 9u;
    key ^= key >> 4u;
    key *= 0x27d4eb2du;
    return key ^ (key >> 15u);
}
