// What every pass starts with: extensions, the structs shared with Rust, the thread's number. A pass that
// traces rays by a pipeline (TRACE_PIPELINE) is a ray generation shader instead of a compute shader; the
// shaders that its rays call define HIT_SHADER.
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#ifdef TRACE_QUERY
#extension GL_EXT_ray_query : require
#endif
#ifdef TRACE_PIPELINE
#extension GL_EXT_ray_tracing : require
#endif
#ifdef TEXTURES
#extension GL_EXT_nonuniform_qualifier : require
#endif
#include "shared.glsl"

// What the scene contains: code for anything else is not compiled into the pipeline.
layout(constant_id = 0) const uint FEATURES = ~0u;
const bool HAS_SPECULAR = (FEATURES & FEATURE_SPECULAR) != 0u;
const bool HAS_TRANSMISSION = (FEATURES & FEATURE_TRANSMISSION) != 0u;
const bool HAS_ABSORPTION = (FEATURES & FEATURE_ABSORPTION) != 0u;
const bool HAS_BLEND = (FEATURES & FEATURE_BLEND) != 0u;
const bool HAS_UNLIT = (FEATURES & FEATURE_UNLIT) != 0u;
const bool HAS_ALPHA = (FEATURES & FEATURE_ALPHA) != 0u || HAS_BLEND || HAS_UNLIT;
const bool HAS_AREA_LIGHTS = (FEATURES & FEATURE_AREA_LIGHTS) != 0u;
const bool HAS_DELTA_LIGHTS = (FEATURES & FEATURE_DELTA_LIGHTS) != 0u;
const bool HAS_ROUGH = (FEATURES & FEATURE_ROUGH) != 0u;
const bool HAS_METALLIC = (FEATURES & FEATURE_METALLIC) != 0u;
const bool HAS_VERTEX_COLORS = (FEATURES & FEATURE_VERTEX_COLORS) != 0u;
const bool HAS_UV1 = (FEATURES & FEATURE_UV1) != 0u;
const bool HAS_INSTANCES = (FEATURES & FEATURE_INSTANCES) != 0u;
const bool HAS_ENVIRONMENT = (FEATURES & FEATURE_ENVIRONMENT) != 0u;
const bool HAS_ONE_SIDED = (FEATURES & FEATURE_ONE_SIDED) != 0u;
const bool HAS_LEDGER = (FEATURES & FEATURE_LEDGER) != 0u;
const bool DIRECT_RAYS = (FEATURES & FEATURE_DIRECT_RAYS) != 0u;
const bool STOCHASTIC = (FEATURES & FEATURE_STOCHASTIC) != 0u;
// Entries of the software traversal's stack: the depth of the scene's tree.
layout(constant_id = 1) const uint STACK_SIZE = 64u;

#define PUSH(Type) layout(push_constant, scalar) uniform PushBlock { Type push; }

// What a pass and the shaders that its rays call both see.
#ifndef TRACE_PIPELINE
#define PAYLOAD(Type, name) Type name
#elif defined(HIT_SHADER)
#define PAYLOAD(Type, name) layout(location = 0) rayPayloadInEXT Type name
#else
#define PAYLOAD(Type, name) layout(location = 0) rayPayloadEXT Type name
#endif

// Linear over a dispatch whose groups are spread over x and y (65535 groups an axis at most).
#ifdef TRACE_PIPELINE
uint thread_index() { return gl_LaunchIDEXT.y * gl_LaunchSizeEXT.x + gl_LaunchIDEXT.x; }
#else
layout(local_size_x = GROUP_SIZE) in;
uint thread_index() {
    return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * GROUP_SIZE + gl_LocalInvocationID.x;
}
#endif
