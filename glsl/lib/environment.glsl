// Light from all around. Between the middles of four texels of an equirectangular map lies a cell,
// in which radiance is bilinear in azimuth and cosine of the polar angle. Directions are drawn in
// exact proportion to the mean of the channels: a row and a cell of it by their cumulative sums, a
// place in the cell by inversion (Pharr et al. 2023, sections A.5 and 12.5). So evaluation and
// density agree everywhere, and a map that is even is drawn evenly. The map's middle is +x, its top
// +y, +z is to the right of the middle. In: Environment; directions in world space. Out: radiance
// [nit], density per solid angle. Needs math.glsl.

struct EnvironmentLight {
    vec3 radiance;
    float pdf_solid_angle;
};

// The corners of a cell: above left and right, below left and right.
struct EnvironmentCell {
    vec3 corners[4];
    uint row;
    uint column;
};

EnvironmentCell environment_cell(Environment e, uint row, uint column) {
    EnvironmentCell cell;
    cell.row = row;
    cell.column = column;
    uint above = max(row, 1u) - 1u, below = min(row, e.size.y - 1u), right = column + 1u == e.size.x ? 0u : column + 1u;
    cell.corners[0] = e.radiance.at[above * e.size.x + column];
    cell.corners[1] = e.radiance.at[above * e.size.x + right];
    cell.corners[2] = e.radiance.at[below * e.size.x + column];
    cell.corners[3] = e.radiance.at[below * e.size.x + right];
    return cell;
}

// At a place of the cell in [0, 1]².
EnvironmentLight environment_light(Environment e, EnvironmentCell cell, vec2 at) {
    EnvironmentLight l;
    l.radiance = mix(mix(cell.corners[0], cell.corners[1], at.x), mix(cell.corners[2], cell.corners[3], at.x), at.y);
    float mean = average(0.25 * (cell.corners[0] + cell.corners[1] + cell.corners[2] + cell.corners[3]));
    uint first = cell.row * (e.size.x + 1u) + cell.column;
    float probability = (e.rows.at[cell.row + 1u].cumulative - e.rows.at[cell.row].cumulative) * (e.columns.at[first + 1u] - e.columns.at[first]);
    l.pdf_solid_angle = mean > 0.0 ? probability * average(l.radiance) / (mean * e.rows.at[cell.row].solid_angle) : 0.0;
    return l;
}

// The cell that a direction lies in, and its place there in [0, 1]².
EnvironmentCell environment_cell_towards(Environment e, vec3 direction_w, out vec2 at) {
    float r2 = dot(direction_w.xz, direction_w.xz);
    float azimuth = r2 > 0.0 ? atan(direction_w.z, direction_w.x) : 0.0;
    float x = fract(azimuth / (2.0 * PI) + 0.5 + e.rotation - 0.5 / float(e.size.x)) * float(e.size.x);
    float y = atan(sqrt(r2), direction_w.y) / PI * float(e.size.y) + 0.5;
    EnvironmentCell cell = environment_cell(e, min(uint(y), e.size.y), min(uint(x), e.size.x - 1u));
    // Squares of sine and cosine of half the polar angle, by which the cosine is interpolated:
    // without cancellation at the poles.
    bool north = direction_w.y >= 0.0;
    float large = 0.5 * (1.0 + abs(direction_w.y)), small = r2 / (4.0 * large);
    vec2 top = load_EnvironmentRow(e.rows, cell.row).half_angle2, bottom = load_EnvironmentRow(e.rows, cell.row + 1u).half_angle2;
    float along = north ? (small - top.x) / (bottom.x - top.x) : (top.y - small) / (top.y - bottom.y);
    at = clamp(vec2(x - float(cell.column), along), vec2(0.0), vec2(1.0));
    return cell;
}

EnvironmentLight environment_towards(Environment e, vec3 direction_w) {
    vec2 at;
    EnvironmentCell cell = environment_cell_towards(e, direction_w, at);
    return environment_light(e, cell, at);
}

// The means of the channels at the corners of a cell.
vec4 corner_means(EnvironmentCell cell) {
    return vec4(average(cell.corners[0]), average(cell.corners[1]), average(cell.corners[2]), average(cell.corners[3]));
}

// In proportion to a line from a to b over [0, 1].
float sample_linear(float u, float a, float b) {
    float sum = a + b;
    if (!(sum > 0.0)) return u;
    a /= sum;
    b /= sum;
    return min(u / (a + sqrt(mix(a * a, b * b, u))), 1.0);
}

EnvironmentLight sample_environment(Environment e, vec2 u, out vec3 direction_w) {
    uint row = 0u, end = e.size.y + 1u;
    while (end - row > 1u) {
        uint middle = (row + end) / 2u;
        if (e.rows.at[middle].cumulative <= u.y) row = middle;
        else end = middle;
    }
    float before = e.rows.at[row].cumulative;
    u.y = (u.y - before) / (e.rows.at[row + 1u].cumulative - before);
    uint first = row * (e.size.x + 1u), column = 0u;
    end = e.size.x;
    while (end - column > 1u) {
        uint middle = (column + end) / 2u;
        if (e.columns.at[first + middle] <= u.x) column = middle;
        else end = middle;
    }
    before = e.columns.at[first + column];
    u.x = (u.x - before) / (e.columns.at[first + column + 1u] - before);

    EnvironmentCell cell = environment_cell(e, row, column);
    vec4 w = corner_means(cell);
    vec2 at;
    at.y = sample_linear(u.y, w.x + w.y, w.z + w.w);
    vec2 line = mix(w.xy, w.zw, at.y);
    at.x = sample_linear(u.x, line.x, line.y);

    vec2 half_angle2 = mix(load_EnvironmentRow(e.rows, row).half_angle2, load_EnvironmentRow(e.rows, row + 1u).half_angle2, at.y);
    float azimuth = 2.0 * PI * ((float(column) + 0.5 + at.x) / float(e.size.x) - 0.5 - e.rotation);
    float r = 2.0 * sqrt(half_angle2.x * half_angle2.y);
    direction_w = vec3(r * cos(azimuth), half_angle2.y - half_angle2.x, r * sin(azimuth));
    return environment_light(e, cell, at);
}

// The share of a line from a to b over [0, 1] that lies before x: the inverse of sample_linear.
float linear_before(float x, float a, float b) { return a + b > 0.0 ? x * (2.0 * a + (b - a) * x) / (a + b) : x; }

// The numbers for which sample_environment draws this direction.
vec2 environment_numbers(Environment e, vec3 direction_w) {
    vec2 at;
    EnvironmentCell cell = environment_cell_towards(e, direction_w, at);
    vec4 w = corner_means(cell);
    vec2 line = mix(w.xy, w.zw, at.y);
    uint first = cell.row * (e.size.x + 1u) + cell.column;
    vec2 before = vec2(e.columns.at[first], e.rows.at[cell.row].cumulative);
    vec2 after = vec2(e.columns.at[first + 1u], e.rows.at[cell.row + 1u].cumulative);
    return mix(before, after, vec2(linear_before(at.x, line.x, line.y), linear_before(at.y, w.x + w.y, w.z + w.w)));
}
