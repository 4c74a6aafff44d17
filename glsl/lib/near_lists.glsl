// Photons near a point in a hash table of lists (see lists.glsl and near.glsl): each stands for as many as its
// bucket counted for every one that it kept. Stochastic collection (Mara et al. 2013) looks at every other photon of
// a list, from the first or the second on at random.

void search_cell(PhotonMaps maps, uvec4 cell, vec3 position_w, float radius2) {
    PhotonLists lists = maps.lists;
    uint home = list_hash(cell) & lists.buckets - 1u, bucket = home;
    if (PROBING) {
        for (uint attempt = 1u;; attempt++) {
            uint owner = lists.owners.at[bucket];
            if (owner == NONE) bucket = NONE;
            if (owner == NONE || cell_of_photon(maps, owner) == cell) break;
            bucket = list_probe(lists, home, attempt);
        }
        if (bucket == NONE) return;
    }
    uint count = lists.counts.at[bucket], kept = min(count, LIST_LENGTH), step = STOCHASTIC && LIST_LENGTH > 1u ? 2u : 1u;
    float weight = float(count) / float(max(kept, 1u)) * float(step);
    uint i = step == 2u && next4(gather.rng).x < 0.5 ? 1u : 0u;
    if (i < kept) do {
        uint index = photon_of_key(lists.seed, lists.keys.at[bucket * LIST_LENGTH + i]);
        if (!photon_is_near(maps, index, position_w, radius2)) continue;
        // Of another cell: found there, or not at all.
        if (!PROBING && cell_of_photon(maps, index) != cell) continue;
        NearPhoton photon = photon_at(maps, index);
        photon.flux *= weight;
        visit_photon(index, photon);
    } while ((i += step) < kept);
}

void find_near(PhotonMaps maps, uint map, vec3 position_w, float radius) {
    PhotonLists lists = maps.lists;
    // More than the rounding of cells.
    float reach = radius * 1.001 + max_component(max(abs(position_w), position_w - lists.min_w)) * 1e-6;
    uvec4 first = list_cell(lists, map, position_w - reach), last = list_cell(lists, map, position_w + reach), cell = first;
    cell.z = first.z;
    do {
        cell.y = first.y;
        do {
            cell.x = first.x;
            do {
                search_cell(maps, cell, position_w, radius * radius);
            } while (++cell.x <= last.x);
        } while (++cell.y <= last.y);
    } while (++cell.z <= last.z);
}
