// Samples the i-th place.
#version 460
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_nonuniform_qualifier : require
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform sampler2D textures[];
struct Place { uint texture_index; vec2 uv; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Places { Place at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Colors { vec4 at[]; };
layout(push_constant, scalar) uniform Push { Places places; Colors colors; uint count; };
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    Place place = places.at[i];
    colors.at[i] = textureLod(textures[nonuniformEXT(place.texture_index)], place.uv, 0.0);
}
