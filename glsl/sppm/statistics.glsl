// What sppm knows of a pixel (Hachisuka & Jensen 2009): photons kept so far N, and the squared radius
// R² [m²], of each map. The frame's radii are the first.

PixelStatistics statistics_of(Frame frame, PixelStatisticsRef statistics, uint index) {
    // Whatever an earlier render left behind.
    if (frame.iteration == 0u) return PixelStatistics(vec2(0.0), frame.radius * frame.radius);
    return load_PixelStatistics(statistics, index);
}
