// A pixel's ray. Pixel (0, 0) is the top left; box filter: uniform over the pixel.
// In: pixel and two uniform numbers. Out: unit direction in world space.
vec3 camera_direction(Frame frame, uvec2 pixel, vec2 u) {
    vec2 p = (vec2(pixel) + u) / vec2(frame.size) * 2.0 - 1.0;
    return normalize(frame.camera_forward_w + p.x * frame.camera_right_w - p.y * frame.camera_up_w);
}

// Threads to pixels in tiles of 8 × 8, which keeps neighbouring threads on neighbouring surfaces.
// False beyond the image.
bool pixel_of_thread(Frame frame, uint thread, out uvec2 pixel) {
    uint tiles_x = (frame.size.x + 7u) / 8u;
    uint tile = thread / 64u, within = thread % 64u;
    pixel = uvec2(tile % tiles_x * 8u + within % 8u, tile / tiles_x * 8u + within / 8u);
    return pixel.x < frame.size.x && pixel.y < frame.size.y;
}
