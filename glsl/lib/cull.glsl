// The culling mask (Kern et al. 2023, section 3.7): a bit for each hash cell that a view sample's
// gather can reach. Cells are two global radii wide, so a gather reaches its nearest eight at most.
// A collision keeps a photon that nobody gathers; it never loses one. Needs math.glsl.

uint cull_cell_hash(ivec3 cell) {
    return wang_hash(uint(cell.x) * 73856093u ^ uint(cell.y) * 19349663u ^ uint(cell.z) * 83492791u) & (CULL_CELLS - 1u);
}

vec3 cull_cell_position(vec3 position_w, float radius) { return position_w / (2.0 * radius); }
