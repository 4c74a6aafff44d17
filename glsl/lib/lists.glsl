// A hash table of photon lists of fixed length (Mara et al. 2013; Kern et al. 2023, section 4.1): a bucket
// counts the photons put into it and keeps at most LIST_LENGTH of them, each with the same probability. Those
// kept are the ones with the smallest keys, a random permutation of the photons' numbers, in order: the
// same whichever thread came first. Needs math.glsl and photon.glsl.

// Photons that a bucket keeps. One: no probing, cells may share a bucket (Hachisuka & Jensen 2010).
layout(constant_id = 3) const uint LIST_LENGTH = 1u;
const bool PROBING = LIST_LENGTH > 1u;

// Monotone in each coordinate; the map is part of the cell.
uvec4 list_cell(PhotonLists lists, uint map, vec3 position_w) {
    return uvec4(clamp((position_w - lists.min_w) * lists.scale[map], vec3(0.0), vec3(GRID_CELL_MAX)), map);
}

uint list_hash(uvec4 cell) {
    return wang_hash(cell.x * 73856093u ^ cell.y * 19349663u ^ cell.z * 83492791u ^ cell.w * 0x9e3779b9u);
}

// Quadratic probing by triangular numbers, which meets every bucket of a power of two.
uint list_probe(PhotonLists lists, uint home, uint attempt) {
    return home + attempt * (attempt + 1u) / 2u & lists.buckets - 1u;
}

uvec4 cell_of_photon(PhotonMaps maps, uint index) {
    return list_cell(maps.lists, maps.lists.maps.at[index], maps.positions_w.at[index]);
}

// A Feistel network: a permutation of 32 bits that can be undone (Luby & Rackoff 1988).
uint feistel(uint seed, uint round, uint half_word) { return wang_hash(half_word ^ seed + round * 0x9e3779b9u) >> 16u; }
uint scramble(uint seed, uint x) {
    uint l = x >> 16u, r = x & 0xffffu;
    for (uint i = 0u; i < 4u; i++) {
        uint next = l ^ feistel(seed, i, r);
        l = r;
        r = next;
    }
    return l << 16u | r;
}
uint unscramble(uint seed, uint x) {
    uint l = x >> 16u, r = x & 0xffffu;
    for (uint i = 4u; i-- > 0u;) {
        uint before = r ^ feistel(seed, i, l);
        r = l;
        l = before;
    }
    return l << 16u | r;
}

// NONE is no photon's number, and becomes no photon's key.
uint key_of_photon(uint seed, uint index) {
    uint key = scramble(seed, index);
    return key == NONE ? scramble(seed, NONE) : key;
}
uint photon_of_key(uint seed, uint key) {
    uint index = unscramble(seed, key);
    return index == NONE ? unscramble(seed, NONE) : index;
}
