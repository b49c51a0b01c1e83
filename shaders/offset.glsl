// Where a ray starts that leaves a surface: beyond the rounding error of the point, and not a step farther.
// Pharr, Jakob & Humphreys, Physically Based Rendering (4th ed.), 6.8.
#ifndef OFFSET_GLSL
#define OFFSET_GLSL

#include "constants.glsl"

// The next float above, or below, in the direction of `sign`; the largest stays. Zero becomes the smallest number that no device
// takes for zero.
float NextFloat(float x, float sign)
{
    if (!(abs(x) < LARGEST_FLOAT)) return x < 0.0 ? -LARGEST_FLOAT : LARGEST_FLOAT;
    if (abs(x) < 1.1754944e-38) return sign > 0.0 ? 1.1754944e-38 : -1.1754944e-38;
    uint bits = floatBitsToUint(x);
    return uintBitsToFloat((x > 0.0) == (sign > 0.0) ? bits + 1u : bits - 1u);
}

// A point on the side of `w` of every plane with the normal `n` through the box `position` +- `error`.
vec3 OffsetRayOrigin(vec3 position, vec3 error, vec3 n, vec3 w)
{
    float distance = min(dot(abs(n), error), LARGEST_FLOAT);
    vec3 offset = (dot(w, n) < 0.0 ? -distance : distance) * n;
    vec3 origin = position + offset;
    for (int i = 0; i < 3; ++i) {
        if (offset[i] != 0.0) origin[i] = NextFloat(origin[i], offset[i]);
    }
    return origin;
}

#endif
