// The guide: a density over the primary samples of light paths (emission.glsl), even in each cell
// of a k-d tree over their seven numbers. A uniform sample goes down the tree and is stretched at
// every split, so that an even spread of many samples stays as even as can be (hierarchical
// warping, Clarberg et al. 2005), and one cell alone changes nothing. In: a uniform primary sample.
// Out: the same, as dense as the guide wants it; that density over the uniform one. Needs rng.glsl
// and sequence.glsl.

// See emission.glsl.
struct Primary {
    uint light;
    uvec2 place;
    uvec2 way;
    uvec2 bounce;
};

// A path's number among those of all iterations, and a seed.
uvec2 number_of_path(Frame frame, uint index) {
    uint high, low, carry;
    umulExtended(frame.iteration, frame.paths, high, low);
    low = uaddCarry(low, index, carry);
    return uvec2(low, mix_seed(frame.seed ^ mix_seed(STREAM_PHOTON + high + carry)));
}

// The light, the place on it, the direction, and that of the first diffuse reflection come from
// sequences that go on over the iterations, so that the photons of all of them together cover the
// lights evenly.
Primary uniform_primary(uvec2 number) {
    uint low = number.x, seed = number.y;
    uint light = sequence_bits(low, seed).x;
    uvec2 place = sequence_bits(low, seed + 1u), way = sequence_bits(low, seed + 2u);
    return Primary(light, place, way, sequence_bits(low, seed + 3u));
}

// 24 bits are left of a number, and these are enough within a cell.
uint stretch(uint number, float scale) { return uint(min(float(number) * scale, 4294967040.0)); }

// From [0, 2³²) to the `size` numbers from `first` on; a size of 0 stands for 2³².
uint into(uint number, uint first, uint size) {
    uint high, low;
    umulExtended(number, size, high, low);
    return size == 0u ? number : first + high;
}

uvec2 into(uvec2 number, uvec2 first, uvec2 size) {
    return uvec2(into(number.x, first.x, size.x), into(number.y, first.y, size.y));
}

float guide_sample(Guide guide, inout Primary primary) {
    GuideNode node = load_GuideNode(guide.nodes, 0u);
    uvec2 place = primary.place, way = primary.way, bounce = primary.bounce;
    uint t[7] = uint[7](primary.light, place.x, place.y, way.x, way.y, bounce.x, bounce.y);
    if (node.axis != NONE) do {
        uint x = t[node.axis];
        bool above = x >= node.threshold;
        float scale = above ? node.scale_above : node.scale_below;
        t[node.axis] = stretch(above ? x - node.threshold : x, scale);
        node = load_GuideNode(guide.nodes, node.child + uint(above));
    } while (node.axis != NONE);
    GuideCell cell = load_GuideCell(guide.cells, node.child);
    primary.light = into(t[0], cell.first_light, cell.size_light);
    primary.place = into(uvec2(t[1], t[2]), cell.first_place, cell.size_place);
    primary.way = into(uvec2(t[3], t[4]), cell.first_way, cell.size_way);
    primary.bounce = into(uvec2(t[5], t[6]), cell.first_bounce, cell.size_bounce);
    return cell.density;
}
