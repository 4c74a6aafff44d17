// The radii of the next iteration, where M photons were found within R (Hachisuka & Jensen 2009, the shared
// statistics of a pixel's region): N' = N + αM, R'² = R² (N + αM) / (N + M).
//
// The paper accumulates τ' = (τ + Φ) R'² / R², and shows L = τ' / (n π R'²), with Φ the flux × BSDF of iteration n. In
// τ / R² the factor cancels: τ' / R'² = τ / R² + Φ / R². So L is the mean over the iterations of Φ / (π R²), each with the
// radius that it was gathered with, which is what the film keeps.
// In: Frame, FramePixel.found, α. In and out: PixelStatistics [m²].
#version 460
#include "lib/pass.glsl"
#include "sppm/statistics.glsl"

PUSH(PixelRadiiPush);

void main() {
    Frame frame = push.frame.at[0];
    uint index = thread_index();
    if (index >= frame.size.x * frame.size.y) return;
    PixelStatistics s = statistics_of(frame, push.statistics, index);
    vec2 found = vec2(push.pixels.at[index].found);
    for (uint map = 0u; map < 2u; map++) {
        if (found[map] == 0.0) continue;
        float kept = s.kept[map] + push.alpha * found[map];
        s.radius2[map] *= kept / (s.kept[map] + found[map]);
        s.kept[map] = kept;
    }
    store_PixelStatistics(push.statistics, index, s);
}
