// The doctor's test of a ray query or, with TRACE_PIPELINE, a ray tracing pipeline over boxes: which boxes the driver
// reports for each point. Stands alone: what it tests must not depend on what the other passes include.
#version 460
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require
#ifdef TRACE_PIPELINE
#extension GL_EXT_ray_tracing : require
layout(location = 0) rayPayloadEXT uint n;
#else
#extension GL_EXT_ray_query : require
layout(local_size_x = 64) in;
uint n;
#endif

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Words { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Points { vec3 at[]; };

// counts: boxes reported per point. reported: the first `capacity` of them per point.
layout(push_constant, scalar) uniform Push {
    uvec2 tlas; Points points; Words counts; Words reported; uint count; uint capacity; float t_max; uint pad;
};

void main() {
#ifdef TRACE_PIPELINE
    uint thread = gl_LaunchIDEXT.x;
#else
    uint thread = gl_GlobalInvocationID.x;
#endif
    if (thread >= count) return;
    n = 0;
#ifdef TRACE_PIPELINE
    traceRayEXT(accelerationStructureEXT(tlas), gl_RayFlagsSkipClosestHitShaderEXT, 0xff, 0, 0, 0, points.at[thread], 0.0, vec3(0, 0, 1), t_max, 0);
#else
    rayQueryEXT query;
    rayQueryInitializeEXT(query, accelerationStructureEXT(tlas), 0, 0xff, points.at[thread], 0.0, vec3(0, 0, 1), t_max);
    while (rayQueryProceedEXT(query)) {
        if (n < capacity) reported.at[thread * capacity + n] = rayQueryGetIntersectionPrimitiveIndexEXT(query, false);
        n++;
    }
#endif
    counts.at[thread] = n;
}
