// Exclusive prefix sum, first half: a thread sums SCAN_CHUNK entries one after the other, which on
// wide machines costs little and on a CPU device beats shared memory and barriers by far.
// In, out: `values` become offsets within their chunk. Out: `totals`, a sum for each chunk.
#version 460
#include "lib/pass.glsl"

PUSH(ScanPush);

void main() {
    uint begin = thread_index() * SCAN_CHUNK;
    if (begin >= push.count) return;
    uint sum = 0u;
    for (uint i = begin; i < min(begin + SCAN_CHUNK, push.count); i++) {
        uint value = push.values.at[i];
        push.values.at[i] = sum;
        sum += value;
    }
    push.totals.at[thread_index()] = sum;
}
