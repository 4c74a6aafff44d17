// Photons near a point by a hashed grid (see grid.glsl and near.glsl). The threads of a subgroup whose
// points lie near each other search together: each looks up another row of cells that any of them
// reaches, then they read as many photons of a row at once as they are, and each photon is shown to
// all. So a photon is read and unpacked once, not once for each thread, and no thread waits for another's row.
// All threads of a subgroup must call, with `wanted` false for those that seek nothing.

// Threads of a subgroup on this device: a constant, so that the loop over them can be unrolled.
layout(constant_id = 2) const uint SUBGROUP_SIZE = 32u;

bool wanted;

bool any_lane(bool value) { return subgroupBallot(value) != uvec4(0u); }

// Shows the photon that one lane has read to all.
void show(uint lane, uint index, bool useful, NearPhoton read, vec3 position_w, float radius2) {
    if (!useful) return;
    NearPhoton photon;
    photon.position_w = subgroupBroadcast(read.position_w, lane);
    vec3 d = photon.position_w - position_w;
    bool near = dot(d, d) <= radius2;
    if (!any_lane(near)) return;
    photon.flux = subgroupBroadcast(read.flux, lane);
    photon.wi = subgroupBroadcast(read.wi, lane);
    photon.normal_g = subgroupBroadcast(read.normal_g, lane);
    photon.edges = subgroupBroadcast(read.edges, lane);
    if (near) visit_photon(index, photon);
}

void find_near(PhotonMaps maps, uint map, vec3 position_w, float radius) {
    PhotonGrid grid = map == MAP_CAUSTIC ? maps.caustic_grid : maps.global_grid;
    // A subgroup may be wider than a work group.
    const uint LANES = min(SUBGROUP_SIZE, GROUP_SIZE);
    uint lane = gl_SubgroupInvocationID;
    bool pending = wanted;
    while (any_lane(pending)) {
        vec3 leader_w = subgroupBroadcast(position_w, subgroupBallotFindLSB(subgroupBallot(pending)));
        bool joined = pending && max_component(abs(position_w - leader_w)) <= GRID_JOIN * radius;
        pending = pending && !joined;
        float radius2 = joined ? radius * radius : -1.0;
        vec3 low_w = subgroupMin(joined ? position_w : leader_w), high_w = subgroupMax(joined ? position_w : leader_w);
        // More than the rounding of cells and positions.
        float reach = radius * 1.001 + max_component(max(max(abs(low_w), abs(high_w)), high_w - grid.min_w)) * 1e-6;
        uvec3 first = grid_cell(grid, low_w - reach), last = grid_cell(grid, high_w + reach);
        // At most 4 × 4 rows (see GRID_JOIN).
        uint rows = (last.z - first.z + 1u) * 4u;
        for (uint done = 0u; done < rows; done += LANES) {
            uvec2 yz = first.yz + uvec2(done + lane & 3u, done + lane >> 2u);
            // What of the row lies within reach of the points' box.
            vec2 side_w = grid.min_w.yz + vec2(yz) / grid.scale.yz;
            vec2 off = max(max(side_w - high_w.yz, low_w.yz - side_w - 1.0 / grid.scale.yz), vec2(0.0));
            float chord = sqrt(max(reach * reach - dot(off, off), 0.0));
            uint x = grid_cell(grid, low_w - chord).x, cells = grid_cell(grid, high_w + chord).x - x + 1u;
            uvec2 place = grid_row(grid, yz);
            uint at = place.y + x & grid.row_slots - 1u;
            uvec2 run = uvec2(0u), wrapped = uvec2(0u);
            if (all(lessThanEqual(yz, last.yz)) && dot(off, off) <= reach * reach) {
                run = uvec2(grid.starts.at[place.x + at], grid.starts.at[place.x + min(at + cells, grid.row_slots)]);
                // About the end of its part a row goes on at the beginning.
                if (at + cells > grid.row_slots) wrapped = uvec2(grid.starts.at[place.x], grid.starts.at[place.x + at + cells - grid.row_slots]);
            }
            for (;;) {
                for (uvec4 found = subgroupBallot(run.x < run.y); found != uvec4(0u);) {
                    uint j = subgroupBallotFindLSB(found);
                    found[j / 32u] &= found[j / 32u] - 1u;
                    uint row_end = subgroupBroadcast(run.y, j);
                    for (uint i = subgroupBroadcast(run.x, j); i < row_end; i += LANES) {
                        uint index = i + lane;
                        bool useful = false;
                        vec3 photon_w = vec3(0.0);
                        if (index < row_end) {
                            photon_w = photon_position(maps, index);
                            vec3 d = max(max(low_w - photon_w, photon_w - high_w), vec3(0.0));
                            useful = dot(d, d) <= reach * reach;
                        }
                        uvec4 shown = subgroupBallot(useful);
                        if (shown == uvec4(0u)) continue;
                        PhotonPower power;
                        if (useful) power = maps.power.at[index];
                        NearPhoton read = unpack_photon(power, photon_w);
                        [[unroll]] for (uint k = 0u; k < LANES; k++)
                            show(k, i + k, (shown[k / 32u] >> k % 32u & 1u) != 0u, read, position_w, radius2);
                    }
                }
                if (!any_lane(wrapped.x < wrapped.y)) break;
                run = wrapped;
                wrapped = uvec2(0u);
            }
        }
    }
}
