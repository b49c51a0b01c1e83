// Random and low-discrepancy numbers, and what turns them into directions.
#ifndef SAMPLING_GLSL
#define SAMPLING_GLSL

#include "constants.glsl"

// Cosine and sine of 2 pi `turns`, 0 to 1. Vulkan lets the built-in ones be off by 2^-11, a bias that a test of a
// distribution sees; these are within 2e-7.
vec2 CosSinTurns(float turns)
{
    float quadrant = floor(4.0 * turns + 0.5);
    float x = (turns - 0.25 * quadrant) * (2.0 * PI); // -pi/4 to pi/4; the difference is exact
    float s = x * x;
    float sine = x + x * s * (-1.6666667e-1 + s * (8.3333310e-3 + s * (-1.9840874e-4 + s * 2.7525562e-6)));
    float cosine = 1.0 + s * (-0.5 + s * (4.1666668e-2 + s * (-1.3888889e-3 + s * 2.4760495e-5)));
    uint turn = uint(quadrant) & 3u;
    vec2 swapped = (turn & 1u) != 0u ? vec2(sine, cosine) : vec2(cosine, sine);
    return vec2(turn == 1u || turn == 2u ? -swapped.x : swapped.x, turn >= 2u ? -swapped.y : swapped.y);
}

// A number from 0 to below 1.
float UnitFloat(uint bits)
{
    return float(bits >> 8) * 5.9604645e-8;
}

// 1 / golden ratio in units of 2^-32: its multiples fill an interval more evenly than those of any other number.
const uint GOLDEN_STEP = 2654435769u;

// Scrambles three numbers: Jarzynski & Olano, "Hash Functions for GPU Rendering", JCGT 2020.
uvec3 Pcg3d(uvec3 v)
{
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> 16u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

// Point `index` of a sequence that fills the unit square evenly, moved around its edges by `shift`: multiples of 1/g and 1/g^2,
// g^3 = g + 1 (M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018), in units of 2^-32.
vec2 PlasticPoint(uint index, uvec2 shift)
{
    uvec2 bits = shift + index * uvec2(3242174889u, 2447445414u);
    return vec2(UnitFloat(bits.x), UnitFloat(bits.y));
}

// Axes of a local frame whose +z is `n`, as columns: Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017, which
// keeps its digits also where n.z is close to -1.
mat3 BasisAround(vec3 n)
{
    float side = n.z < 0.0 ? -1.0 : 1.0;
    float a = -1.0 / (side + n.z);
    float b = n.x * n.y * a;
    return mat3(vec3(1.0 + side * n.x * n.x * a, side * b, -side * n.x), vec3(b, side + n.y * n.y * a, -n.y), n);
}

#endif
