// A pixel's ray. Pixel (0, 0) is the top left; box filter: uniform over the pixel.
// In: pixel and two uniform numbers. Out: origin and unit direction in world space.
void camera_ray(Frame frame, uvec2 pixel, vec2 u, out vec3 origin_w, out vec3 direction_w) {
    vec2 p = (vec2(pixel) + u) / vec2(frame.size) * 2.0 - 1.0;
    vec3 aside = p.x * frame.camera_right_w - p.y * frame.camera_up_w;
    bool parallel = frame.orthographic != 0u;
    origin_w = parallel ? frame.camera_position_w + aside : frame.camera_position_w;
    direction_w = normalize(parallel ? frame.camera_forward_w : frame.camera_forward_w + aside);
}

// Height [m] of a pixel where a path of this length from the eye ends.
float pixel_footprint(Frame frame, float length_w) {
    return (frame.orthographic != 0u ? 2.0 : 2.0 * length_w) * length(frame.camera_up_w) / float(frame.size.y);
}

// Threads to pixels in tiles of 8 × 8, in which threads follow a Morton curve: those of a subgroup, whatever its
// size, see a patch as square as can be.
// False beyond the image.
bool pixel_of_thread(Frame frame, uint thread, out uvec2 pixel) {
    uint tiles_x = (frame.size.x + 7u) / 8u;
    uint tile = thread / 64u, within = thread % 64u;
    uvec2 bits = uvec2(within, within >> 1u);
    pixel = uvec2(tile % tiles_x, tile / tiles_x) * 8u + (bits & 1u | bits >> 1u & 2u | bits >> 2u & 4u);
    return pixel.x < frame.size.x && pixel.y < frame.size.y;
}
