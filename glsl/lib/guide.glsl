// The guide: a density over the primary samples of light paths (emission.glsl), even in each cell of a k-d tree over
// their five numbers. A uniform sample goes down the tree and is stretched at every split, so that an even spread
// of many samples stays as even as can be (hierarchical warping, Clarberg et al. 2005), and one cell alone
// changes nothing.
// In: a uniform primary sample. Out: the same, as dense as the guide wants it; that density over the uniform one.
// Needs emission.glsl.

// number × scale / 2²⁴, below 2³².
uint stretch(uint number, uint scale) {
    uint high, low;
    umulExtended(number, scale, high, low);
    return high << 8u | low >> 24u;
}

// From [0, 2³²) to the `size` numbers from `first` on; a size of 0 stands for 2³².
uint into(uint number, uint first, uint size) {
    uint high, low;
    umulExtended(number, size, high, low);
    return size == 0u ? number : first + high;
}

float guide_sample(Guide guide, inout Primary primary) {
    GuideNode node = load_GuideNode(guide.nodes, 0u);
    uint t[5] = uint[5](primary.light, primary.place.x, primary.place.y, primary.way.x, primary.way.y);
    if (node.axis != NONE) do {
        uint x = t[node.axis];
        bool above = x >= node.threshold;
        t[node.axis] = stretch(above ? x - node.threshold : x, above ? node.scale_above : node.scale_below);
        node = load_GuideNode(guide.nodes, node.child + uint(above));
    } while (node.axis != NONE);
    GuideCell cell = load_GuideCell(guide.cells, node.child);
    primary.light = into(t[0], cell.first_light, cell.size_light);
    primary.place = uvec2(into(t[1], cell.first_place.x, cell.size_place.x), into(t[2], cell.first_place.y, cell.size_place.y));
    primary.way = uvec2(into(t[3], cell.first_way.x, cell.size_way.x), into(t[4], cell.first_way.y, cell.size_way.y));
    return cell.density;
}
