// Stable radix sort, second half. In: keys, values, the scanned histogram (consumed). Out: both,
// ordered by the digit.
#version 460
#include "lib/pass.glsl"

PUSH(SortPush);

// Keys that a thread takes in order.
layout(constant_id = 2) const uint SORT_CHUNK = 256u;

void main() {
    uint digits = 1u << push.digit_bits, chunk = thread_index(), chunks = (push.count + SORT_CHUNK - 1u) / SORT_CHUNK;
    if (chunk >= chunks) return;
    uint begin = chunk * SORT_CHUNK;
    for (uint i = begin; i < min(begin + SORT_CHUNK, push.count); i++) {
        uint key = push.keys.at[i];
        uint column = (key >> push.shift & (digits - 1u)) * chunks + chunk;
        uint to = push.histogram.at[column];
        push.histogram.at[column] = to + 1u;
        push.keys_out.at[to] = key;
        push.values_out.at[to] = push.values.at[i];
    }
}
