// The doctor's test of device addresses: each thread follows an address that it finds in memory.
// Stands alone: what it tests must not depend on what the other passes include.
#version 460
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 64) in;

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Words { uint at[]; };
struct Link { Words words; uint index; uint pad; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer Links { Link at[]; };

layout(push_constant, scalar) uniform Push { Links links; Words sums; uint count; uint pad; };

void main() {
    uint thread = gl_GlobalInvocationID.x;
    if (thread >= count) return;
    Link link = links.at[thread];
    sums.at[thread] = link.words.at[link.index] + thread;
}
