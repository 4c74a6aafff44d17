// Stable radix sort, first half: each thread counts the digits of its SORT_CHUNK keys in a column of
// the histogram that it alone writes; no atomics, so the order is the same on every run.
// In: keys. Out: histogram, digit-major, so that its prefix sum gives each chunk's place per digit.
#version 460
#include "lib/pass.glsl"

PUSH(SortPush);

// Keys that a thread takes in order.
layout(constant_id = 2) const uint SORT_CHUNK = 256u;

void main() {
    uint digits = 1u << push.digit_bits, chunk = thread_index(), chunks = (push.count + SORT_CHUNK - 1u) / SORT_CHUNK;
    if (chunk >= chunks) return;
    for (uint digit = 0u; digit < digits; digit++) push.histogram.at[digit * chunks + chunk] = 0u;
    uint begin = chunk * SORT_CHUNK;
    for (uint i = begin; i < min(begin + SORT_CHUNK, push.count); i++)
        push.histogram.at[(push.keys.at[i] >> push.shift & (digits - 1u)) * chunks + chunk]++;
}
