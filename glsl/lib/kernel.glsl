// The area that a density estimate divides by: the disc about the view sample, less what lies beyond
// the nearest edges where the surface ends or folds. Photons beyond those edges are not counted
// either, so the estimate has no dark rim along walls, and a seam between coplanar meshes does no
// harm. (The plain disc of Jensen 2001 loses 21 % on average within one radius of an edge.)
// In: distances [m] to two edges and the directions from the edges to here. Needs math.glsl.

// Of a disc of radius r beyond a chord at distance d from its centre.
float segment_area(float r, float d) {
    return d >= r ? 0.0 : r * r * acos(clamp(d / r, 0.0, 1.0)) - d * sqrt(max(0.0, r * r - d * d));
}

// Of a disc of radius r on the near side of two chords. `cosine` is that of the angle between the
// directions from the chords to the centre.
float clipped_disc_area(float r, vec2 d, float cosine) {
    float area = PI * r * r - segment_area(r, d.x) - segment_area(r, d.y);
    if (max(d.x, d.y) >= r) return area;
    // In a frame whose y axis points at the first chord: chord 0 is y = d0, chord 1 crosses it where
    // (p · n1) = d1, n = -(direction to the centre).
    float sine = sqrt(max(0.0, 1.0 - cosine * cosine));
    float half0 = sqrt(max(0.0, r * r - d.x * d.x));
    if (sine < 1e-4) {
        // Parallel: on one side the nearer chord hides the other, on opposite sides they cannot meet.
        return cosine > 0.0 ? PI * r * r - segment_area(r, min(d.x, d.y)) : area;
    }
    float x = (d.y - cosine * d.x) / sine;
    if (abs(x) >= half0) {
        // They meet outside the disc. One lies behind the other where its midpoint does.
        if (cosine * d.x > d.y) return PI * r * r - segment_area(r, d.y);
        if (cosine * d.y > d.x) return PI * r * r - segment_area(r, d.x);
        return area;
    }
    // Beyond both: from their meeting point to where each leaves the disc on the other's far side.
    vec2 meet = vec2(x, d.x);
    vec2 leave0 = vec2(half0, d.x);
    vec2 n1 = vec2(sine, cosine), along1 = vec2(-cosine, sine);
    float half1 = sqrt(max(0.0, r * r - d.y * d.y));
    vec2 leave1 = n1 * d.y + along1 * half1;
    vec2 a = leave0 - meet, b = leave1 - meet;
    float triangle = 0.5 * abs(a.x * b.y - a.y * b.x);
    float chord = min(distance(leave0, leave1) / (2.0 * r), 1.0);
    float angle = 2.0 * asin(chord);
    return area + triangle + 0.5 * r * r * (angle - sin(angle));
}
