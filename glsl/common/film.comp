// Adds an iteration to the running means: m += (x - m) / n, each mean an unevaluated sum of two
// floats (Dekker 1971), so that 10^6 iterations do not drift and a saved film goes on exactly.
// In: FramePixels, the iteration's number from 0. Out: FilmPixels.
#version 460
#include "lib/pass.glsl"
#include "lib/math.glsl"

PUSH(FilmPush);

// Fast two-sum keeps the rounding of `high + x` in `low`; |high| ≥ |x| is not needed (Knuth's form).
void add(inout float high, inout float low, float x) {
    precise float y = x + low;
    precise float t = high + y;
    precise float z = t - high;
    precise float rest = (high - (t - z)) + (y - z);
    high = t;
    low = rest;
}

// (x - mean) / n, the difference with the low part too.
void update(inout float high, inout float low, float x, float n) {
    precise float difference = (x - high) - low;
    add(high, low, difference / n);
}

void update3(inout vec3 high, inout vec3 low, vec3 x, float n) {
    for (int i = 0; i < 3; i++) {
        float h = high[i], l = low[i];
        update(h, l, x[i], n);
        high[i] = h;
        low[i] = l;
    }
}

void main() {
    Frame frame = push.frame.at[0];
    uint index = thread_index();
    if (index >= frame.size.x * frame.size.y) return;
    FramePixel x = load_FramePixel(push.pixels, index);
    FilmPixel film = load_FilmPixel(push.film, index);
    float n = float(frame.iteration + 1u);

    // Welford 1962, as a running mean of (x - m_before)(x - m_after).
    float y = luminance(x.emission + x.direct + x.caustic + x.global);
    float before = luminance(film.emission + film.direct + film.caustic + film.global);
    update3(film.emission, film.emission_low, x.emission, n);
    update3(film.direct, film.direct_low, x.direct, n);
    update3(film.caustic, film.caustic_low, x.caustic, n);
    update3(film.global, film.global_low, x.global, n);
    float after = luminance(film.emission + film.direct + film.caustic + film.global);
    // The square of 1e20 nit is no float.
    update(film.variance, film.variance_low, min((y - before) * (y - after), 1e38), n);
    float bias = x.bias[MAP_CAUSTIC] + x.bias[MAP_GLOBAL], bias_before = film.bias;
    update(film.bias, film.bias_low, bias, n);
    update(film.bias_variance, film.bias_variance_low, min((bias - bias_before) * (bias - film.bias), 1e38), n);

    update3(film.albedo, film.albedo_low, x.albedo, n);
    update3(film.normal_w, film.normal_w_low, x.normal_w, n);
    update(film.depth, film.depth_low, x.depth, n);
    store_FilmPixel(push.film, index, film);
}
