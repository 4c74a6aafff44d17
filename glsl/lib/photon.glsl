// The photon record: 16 bytes of power beside the position. Flux: a shared exponent and three
// mantissas of 16 bits, so that neither 1e-30 nor 1e30 lm overflows or flushes to zero; each channel
// is right to 2^-16 of the largest. The low 6 bits of the exponent's word count path edges.

PhotonPower pack_power(vec3 flux, vec3 wi, vec3 normal_g, uint edges) {
    // 2^e > every channel. The floor keeps both ldexps within ±126, beyond which GLSL leaves them
    // undefined; what is below it becomes zero.
    int e;
    frexp(max(max_component(flux), 1e-33), e);
    uvec3 m = uvec3(min(ldexp(flux, ivec3(16 - e)) + 0.5, vec3(65535.0)));
    PhotonPower p;
    p.flux = uvec2(m.r | m.g << 16, m.b | uint(e + 256) << 22 | edges << 16);
    p.wi = pack_direction(wi);
    p.normal_g = pack_direction(normal_g);
    return p;
}

vec3 photon_flux(PhotonPower p) {
    vec3 m = vec3(p.flux.x & 0xffffu, p.flux.x >> 16, p.flux.y & 0xffffu);
    return ldexp(m, ivec3(int(p.flux.y >> 22) - 256 - 16));
}

uint photon_edges(PhotonPower p) { return p.flux.y >> 16 & 63u; }

// Acceleration structures keep a photon as its box alone, with the position in the middle: with the
// power it takes the 40 bytes of Kern et al. 2023, table 2. The software tree keeps the same middle.
vec3 box_middle(PhotonBox box) {
    precise vec3 middle = 0.5 * (box.min_w + box.max_w);
    return middle;
}
