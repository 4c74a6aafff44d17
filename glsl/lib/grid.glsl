// A hashed grid of photons. Cells along x lie side by side, so that a row's run of cells is one run of
// photons; rows begin at hashed places of a table of slots. The table has a part for each pair of
// y and z modulo 4, so rows of a 4 × 4 neighbourhood never share a slot: no photon is met twice. Rows from
// elsewhere that do share it cost sphere tests, and nothing else. Needs math.glsl.

// Monotone in each coordinate, rounding included: what lies between two points has a cell between theirs.
uvec3 grid_cell(PhotonGrid grid, vec3 position_w) {
    return uvec3(clamp((position_w - grid.min_w) * grid.scale, vec3(0.0), vec3(GRID_CELL_MAX)));
}

// First slot of a row's part, and where in it the row begins.
uvec2 grid_row(PhotonGrid grid, uvec2 yz) {
    uvec2 part = yz & 3u, block = yz >> 2u;
    return uvec2(grid.first_slot + (part.y << 2u | part.x) * grid.row_slots, wang_hash(block.x * 73856093u ^ block.y * 19349663u));
}

uint grid_slot(PhotonGrid grid, vec3 position_w) {
    uvec3 cell = grid_cell(grid, position_w);
    uvec2 row = grid_row(grid, cell.yz);
    return row.x + (row.y + cell.x & grid.row_slots - 1u);
}

// Of a plain grid of cells (see bench/near_cells.glsl).
uint cell_slot(PhotonGrid grid, uvec3 cell) {
    uvec3 part = cell & 1u, block = cell >> 1u;
    uint hash = wang_hash(block.x * 73856093u ^ block.y * 19349663u ^ block.z * 83492791u);
    return grid.first_slot + (part.z << 2u | part.y << 1u | part.x) * grid.row_slots * 2u + (hash & grid.row_slots * 2u - 1u);
}
