// For each point: how many of the boxes that the structure reports hold it, and the sum of their indices.
#version 460
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_ray_query : require
layout(local_size_x = 64) in;
struct Box { vec3 low; vec3 high; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Points { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Boxes { Box at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Found { uvec2 at[]; };
layout(push_constant, scalar) uniform Push {
    uvec2 tlas; Points points; Boxes boxes; Found found; uint count; uint mask;
};
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    vec3 point = points.at[i];
    uvec2 sum = uvec2(0);
    rayQueryEXT query;
    rayQueryInitializeEXT(query, accelerationStructureEXT(tlas), 0, mask, point, 0.0, vec3(0, 0, 1), 1e-20);
    while (rayQueryProceedEXT(query)) {
        uint b = rayQueryGetIntersectionPrimitiveIndexEXT(query, false)
               + 1000 * rayQueryGetIntersectionInstanceCustomIndexEXT(query, false);
        Box box = boxes.at[b];
        if (all(lessThanEqual(box.low, point)) && all(lessThanEqual(point, box.high)))
            sum += uvec2(1, b);
    }
    found.at[i] = sum;
}
