// Where light paths of an iteration began. In: their numbers, Frame, Guide. Out: primary samples
// (emission.glsl).
#version 460
#include "lib/pass.glsl"
#include "lib/rng.glsl"
#include "lib/sequence.glsl"
#include "lib/guide.glsl"

PUSH(PrimariesPush);

void main() {
    uint index = thread_index();
    if (index >= push.count) return;
    Primary primary = uniform_primary(number_of_path(push.frame.at[0], push.paths.at[index]));
    guide_sample(push.guide.at[0], primary);
    PrimarySample result;
    result.light = primary.light;
    result.place = primary.place;
    result.way = primary.way;
    result.bounce = primary.bounce;
    push.primaries.at[index] = result;
}
