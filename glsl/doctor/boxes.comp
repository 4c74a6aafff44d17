// The doctor's test of a ray query over boxes: which boxes the driver reports for each point.
// Stands alone: what it tests must not depend on what the other passes include.
#version 460
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_ray_query : require
layout(local_size_x = 64) in;

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Words { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Points { vec3 at[]; };

// counts: boxes reported per point. reported: the first `capacity` of them per point.
layout(push_constant, scalar) uniform Push {
    uvec2 tlas; Points points; Words counts; Words reported; uint count; uint capacity; float t_max; uint pad;
};

void main() {
    uint thread = gl_GlobalInvocationID.x;
    if (thread >= count) return;
    uint n = 0;
    rayQueryEXT query;
    rayQueryInitializeEXT(query, accelerationStructureEXT(tlas), 0, 0xff, points.at[thread], 0.0, vec3(0, 0, 1), t_max);
    while (rayQueryProceedEXT(query)) {
        if (n < capacity) reported.at[thread * capacity + n] = rayQueryGetIntersectionPrimitiveIndexEXT(query, false);
        n++;
    }
    counts.at[thread] = n;
}
