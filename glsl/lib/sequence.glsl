// Low-discrepancy points for the first dimensions of a path: the (0, 2)-sequence of Sobol', shuffled
// and Owen-scrambled by hashing (Burley 2020). A function of index and seed alone, like rng.glsl; a
// path takes as many independent pairs as it wants, each with a seed of its own.
// In: index in the sequence, a seed. Out: uniform numbers in [0, 1). Needs rng.glsl.

// A random permutation of the numbers below every power of two (Laine & Karras 2011, with Vegdahl's
// constants), on reversed bits.
uint owen_scramble(uint x, uint seed) {
    x = bitfieldReverse(x);
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return bitfieldReverse(x);
}

uint mix_seed(uint x) {
    x ^= x >> 16u;
    x *= 0x21f0aaadu;
    x ^= x >> 15u;
    x *= 0xd35a2d97u;
    return x ^ (x >> 15u);
}

// Second dimension of Sobol's sequence: Pascal's triangle modulo 2, by doubling.
uint sobol_second(uint i) {
    i = bitfieldReverse(i);
    i ^= (i & 0x55555555u) << 1u;
    i ^= (i & 0x33333333u) << 2u;
    i ^= (i & 0x0f0f0f0fu) << 4u;
    i ^= (i & 0x00ff00ffu) << 8u;
    i ^= (i & 0x0000ffffu) << 16u;
    return i;
}

uvec2 sequence_bits(uint index, uint seed) {
    seed = mix_seed(seed);
    uint i = owen_scramble(index, seed);
    uvec2 x = uvec2(bitfieldReverse(i), sobol_second(i));
    x.x = owen_scramble(x.x, mix_seed(seed + 1u));
    x.y = owen_scramble(x.y, mix_seed(seed + 2u));
    return x;
}

vec2 sequence_pair(uint index, uint seed) { return unit_floats(uvec4(sequence_bits(index, seed), 0u, 0u)).xy; }
