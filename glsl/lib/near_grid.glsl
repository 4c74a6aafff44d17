// Photons near a point by a hashed grid (see grid.glsl and near.glsl). The threads of a subgroup whose points lie near
// each other search together. Each looks up another row of cells that any of them reaches. Then they test photons of all
// those rows, as many at once as they are, and keep those that any of them reaches until each has one to read, which is
// shown to all. So a photon is read and unpacked once, not once for each thread, and no thread waits for another's row.
// Loops end with their condition, here and wherever time counts: a CPU device runs a loop that begins with one once more
// than needed, for no thread. (It skips an `if` that no thread meets.)
// A thread may seek for more points than one: the more search together, the fewer rows and photons each has to pay for.
// All threads of a subgroup must call, with `wanted` false for points that seek nothing.

// Threads of a subgroup on this device: a constant, so that the loops over them can be unrolled.
layout(constant_id = 2) const uint SUBGROUP_SIZE = 32u;
// A subgroup may be wider than a work group.
const uint LANES = SUBGROUP_SIZE < GROUP_SIZE ? SUBGROUP_SIZE : GROUP_SIZE;
// That look rows up: a search reaches at most 4 × 4 (see GRID_JOIN).
const uint ROW_LANES = LANES < 16u ? LANES : 16u;

// That a thread seeks for; one where it keeps a reservoir.
layout(constant_id = 4) const uint POINTS = 1u;

struct Point {
    bool wanted;
    // Not searched for yet.
    bool pending;
    // Of those that search together now.
    bool joined;
    vec3 position_w;
    Sample at;
    Found found;
};
Point points[POINTS];

bool any_lane(bool value) { return subgroupBallot(value) != uvec4(0u); }

// The box about points that search together, and how far they reach beyond it.
struct Party {
    vec3 low_w;
    vec3 high_w;
    float reach;
};

// Visits the photon that one lane has read, for the points that it is near to.
void show(uint lane, uint index, NearPhoton read, float radius2) {
    NearPhoton photon;
    index = subgroupBroadcast(index, lane);
    photon.position_w = subgroupBroadcast(read.position_w, lane);
    photon.flux = subgroupBroadcast(read.flux, lane);
    photon.wi = subgroupBroadcast(read.wi, lane);
    photon.normal_g = subgroupBroadcast(read.normal_g, lane);
    photon.edges = subgroupBroadcast(read.edges, lane);
    [[unroll]] for (uint j = 0u; j < POINTS; j++) {
        position_w = points[j].position_w;
        gather.at = points[j].at;
        gather.found = points[j].found;
        vec3 d = photon.position_w - position_w;
        if (points[j].joined && dot(d, d) <= radius2) visit_photon(index, photon);
        points[j].found = gather.found;
    }
}

// Visits the near ones of each lane's run of photons, one run after the other.
void search_runs(PhotonMaps maps, uvec2 run, Party party, float radius2) {
    uint lane = gl_SubgroupInvocationID;
    // Photons of the lanes before, and of all.
    uint before = 0u, count = 0u;
    [[unroll]] for (uint k = 0u; k < ROW_LANES; k++) {
        uint length = subgroupBroadcast(run.y - run.x, k);
        if (k < lane) before += length;
        count += length;
    }
    // Those that a party reaches wait until there is one for each lane: one a lane, and what is beyond that.
    uint tested = 0u, waiting = 0u, lane_waiting = 0u, lane_beyond = 0u;
    do {
        do {
            uint place = tested + lane, index = 0u;
            [[unroll]] for (uint k = 0u; k < ROW_LANES; k++) {
                uint of_row = subgroupBroadcast(run.x - before, k) + place;
                if (place >= subgroupBroadcast(before, k)) index = of_row;
            }
            bool reached = place < count;
            if (reached) {
                vec3 photon_w = photon_position(maps, index);
                vec3 d = max(max(party.low_w - photon_w, photon_w - party.high_w), vec3(0.0));
                reached = dot(d, d) <= party.reach * party.reach;
            }
            uvec4 found = subgroupBallot(reached);
            uint to = reached ? waiting + subgroupBallotExclusiveBitCount(found) : NONE;
            [[unroll]] for (uint k = 0u; k < LANES; k++) {
                uint lane_to = subgroupBroadcast(to, k), value = subgroupBroadcast(index, k);
                if (lane_to == lane) lane_waiting = value;
                if (lane_to == lane + LANES) lane_beyond = value;
            }
            waiting += subgroupBallotBitCount(found);
            tested += LANES;
        } while (waiting < LANES && tested < count);
        NearPhoton read;
        if (lane < waiting) read = photon_at(maps, lane_waiting);
        uint k = 0u;
        do {
            if (k < waiting) show(k, lane_waiting, read, radius2);
        } while (++k < min(waiting, LANES));
        lane_waiting = lane_beyond;
        waiting = max(waiting, LANES) - LANES;
    } while (tested < count || waiting > 0u);
}

bool any_pending() {
    bool pending = false;
    [[unroll]] for (uint j = 0u; j < POINTS; j++) pending = pending || points[j].pending;
    return any_lane(pending);
}

// Those that search together next: all that are near to the first that is pending, of the first thread that has one.
Party next_party(float radius) {
    bool pending = false;
    vec3 leader_w = vec3(0.0);
    [[unroll]] for (uint j = 0u; j < POINTS; j++) {
        if (points[j].pending && !pending) leader_w = points[j].position_w;
        pending = pending || points[j].pending;
    }
    leader_w = subgroupBroadcast(leader_w, subgroupBallotFindLSB(subgroupBallot(pending)));
    Party party;
    party.low_w = party.high_w = leader_w;
    [[unroll]] for (uint j = 0u; j < POINTS; j++) {
        vec3 position_w = points[j].position_w;
        points[j].joined = points[j].pending && max_component(abs(position_w - leader_w)) <= GRID_JOIN * radius;
        points[j].pending = points[j].pending && !points[j].joined;
        party.low_w = min(party.low_w, points[j].joined ? position_w : leader_w);
        party.high_w = max(party.high_w, points[j].joined ? position_w : leader_w);
    }
    party.low_w = subgroupMin(party.low_w);
    party.high_w = subgroupMax(party.high_w);
    return party;
}

// Photons of one row of cells that a party reaches. Rows that end at the end of their part go on at its beginning: `wrapped`.
uvec2 find_run(PhotonGrid grid, Party party, uvec2 yz, out uvec2 wrapped) {
    wrapped = uvec2(0u);
    // What of the row lies within reach of the points' box.
    vec2 side_w = grid.min_w.yz + vec2(yz) / grid.scale.yz;
    vec2 off = max(max(side_w - party.high_w.yz, party.low_w.yz - side_w - 1.0 / grid.scale.yz), vec2(0.0));
    float chord = sqrt(max(party.reach * party.reach - dot(off, off), 0.0));
    uint x = grid_cell(grid, party.low_w - chord).x, cells = grid_cell(grid, party.high_w + chord).x - x + 1u;
    uvec2 place = grid_row(grid, yz);
    uint at = place.y + x & grid.row_slots - 1u;
    if (dot(off, off) > party.reach * party.reach) return uvec2(0u);
    if (at + cells > grid.row_slots) wrapped = uvec2(grid.starts.at[place.x], grid.starts.at[place.x + at + cells - grid.row_slots]);
    return uvec2(grid.starts.at[place.x + at], grid.starts.at[place.x + min(at + cells, grid.row_slots)]);
}

void find_near(PhotonMaps maps, uint map, float radius) {
    PhotonGrid grid = map == MAP_CAUSTIC ? maps.caustic_grid : maps.global_grid;
    uint lane = gl_SubgroupInvocationID;
    [[unroll]] for (uint j = 0u; j < POINTS; j++) points[j].pending = points[j].wanted;
    if (any_pending()) do {
        Party party = next_party(radius);
        // More than the rounding of cells and positions.
        vec3 largest_w = max(max(abs(party.low_w), abs(party.high_w)), party.high_w - grid.min_w);
        party.reach = radius * 1.001 + max_component(largest_w) * 1e-6;
        uvec2 first = grid_cell(grid, party.low_w - party.reach).yz, rows = grid_cell(grid, party.high_w + party.reach).yz - first + 1u;
        uint done = 0u;
        do {
            uint z = uint((float(done + lane) + 0.5) / float(rows.x)), y = done + lane - z * rows.x;
            uvec2 run = uvec2(0u), wrapped = uvec2(0u);
            if (lane < ROW_LANES && z < rows.y) run = find_run(grid, party, first + uvec2(y, z), wrapped);
            do {
                search_runs(maps, run, party, radius * radius);
                run = wrapped;
                wrapped = uvec2(0u);
            } while (any_lane(run.x < run.y));
            done += ROW_LANES;
        } while (done < rows.x * rows.y);
    } while (any_pending());
}
