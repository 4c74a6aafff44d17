// Stable radix sort, first half: each thread counts the digits of its SORT_CHUNK keys in a column of
// the histogram that it alone writes; no atomics, so the order is the same on every run.
// In: keys. Out: histogram, digit-major, so that its prefix sum gives each chunk's place per digit.
#version 460
#include "lib/pass.glsl"

PUSH(SortPush);

// Bits of a digit, and keys that a thread takes in order.
layout(constant_id = 2) const uint SORT_DIGIT_BITS = 8u;
layout(constant_id = 3) const uint SORT_CHUNK = 256u;
const uint DIGITS = 1u << SORT_DIGIT_BITS;

void main() {
    uint chunk = thread_index(), chunks = (push.count + SORT_CHUNK - 1u) / SORT_CHUNK;
    if (chunk >= chunks) return;
    for (uint digit = 0u; digit < DIGITS; digit++) push.histogram.at[digit * chunks + chunk] = 0u;
    uint begin = chunk * SORT_CHUNK;
    for (uint i = begin; i < min(begin + SORT_CHUNK, push.count); i++)
        push.histogram.at[(push.keys.at[i] >> push.shift & (DIGITS - 1u)) * chunks + chunk]++;
}
