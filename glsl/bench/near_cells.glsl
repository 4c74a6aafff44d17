// Photons near a point in a plain grid, a rival for `cargo bench`: cells of edge 2r, photons sorted by hashed cell,
// a search visits the nearest eight cells. Slots have a part for each parity of the coordinates, so that those eight
// never share one.

void find_near(PhotonMaps maps, uint map, vec3 position_w, float radius) {
    PhotonGrid grid = map == MAP_CAUSTIC ? maps.caustic_grid : maps.global_grid;
    float reach = radius * 1.001;
    uvec3 first = grid_cell(grid, position_w - reach), last = grid_cell(grid, position_w + reach), cell;
    cell.z = first.z;
    do {
        cell.y = first.y;
        do {
            cell.x = first.x;
            do {
                uint slot = cell_slot(grid, cell), i = grid.starts.at[slot], end = grid.starts.at[slot + 1u];
                if (i < end) do {
                    if (photon_is_near(maps, i, position_w, radius * radius)) visit_photon(i, photon_at(maps, i));
                } while (++i < end);
            } while (++cell.x <= last.x);
        } while (++cell.y <= last.y);
    } while (++cell.z <= last.z);
}
