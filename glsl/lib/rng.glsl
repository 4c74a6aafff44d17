// Counter-based random numbers: a function of (seed, iteration, path, dimension) and nothing else,
// so that an iteration depends on its index alone. PCG4D (Jarzynski & Olano 2020). The same bits as
// `src/rng.rs`.
// Out: uniform floats in [0, 1).

const uint STREAM_VIEW = 0u;
const uint STREAM_PHOTON = 0x40000000u;
const uint STREAM_GATHER = 0x80000000u;

struct Rng {
    uint seed;
    uint iteration;
    uint path;
    uint dimension;
};

uvec4 pcg4d(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w; v.y += v.z * v.x; v.z += v.x * v.y; v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w; v.y += v.z * v.x; v.z += v.x * v.y; v.w += v.y * v.z;
    return v;
}

vec4 unit_floats(uvec4 bits) { return vec4(bits >> 8u) * 5.9604644775390625e-8; }

uvec4 next_bits(inout Rng rng) { return pcg4d(uvec4(rng.path, rng.dimension++, rng.iteration, rng.seed)); }

vec4 next4(inout Rng rng) { return unit_floats(next_bits(rng)); }
