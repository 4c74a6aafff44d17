// Exclusive prefix sum, second half. In: `totals`, scanned. In, out: `values` of each chunk move up
// by its total.
#version 460
#include "lib/pass.glsl"

PUSH(ScanPush);

void main() {
    uint i = thread_index();
    if (i < push.count) push.values.at[i] += push.totals.at[i / SCAN_CHUNK];
}
