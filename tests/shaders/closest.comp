// For each ray: the distance to the closest triangle and its index, or -1.
#version 460
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_ray_query : require
layout(local_size_x = 64) in;
struct Ray { vec3 origin; vec3 direction; };
struct Hit { float t; int triangle; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Rays { Ray at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Hits { Hit at[]; };
layout(push_constant, scalar) uniform Push { uvec2 tlas; Rays rays; Hits hits; uint count; uint first; };
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    Ray ray = rays.at[i];
    rayQueryEXT query;
    rayQueryInitializeEXT(query, accelerationStructureEXT(tlas), 0, 0xff, ray.origin, 0.0, ray.direction, 1e30);
    while (rayQueryProceedEXT(query)) rayQueryConfirmIntersectionEXT(query);
    Hit hit = Hit(-1.0, -1);
    if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT) {
        hit.t = rayQueryGetIntersectionTEXT(query, true);
        hit.triangle = rayQueryGetIntersectionPrimitiveIndexEXT(query, true)
                     + int(first) * rayQueryGetIntersectionGeometryIndexEXT(query, true);
    }
    hits.at[i] = hit;
}
