// From scene-linear Rec. 709 to display values.
#ifndef TONEMAP_GLSL
#define TONEMAP_GLSL

const uint TONEMAP_NONE = 0;
const uint TONEMAP_NEUTRAL = 1;
const uint TONEMAP_AGX = 2;

// Khronos PBR Neutral tone mapper (2024): colours up to 0.8 keep their values, brighter ones roll off to white.
vec3 ToneCurveNeutral(vec3 color)
{
    const float start = 0.8 - 0.04;
    const float desaturation = 0.15;
    float least = min(color.r, min(color.g, color.b));
    color -= least < 0.08 ? least - 6.25 * least * least : 0.04;
    float peak = max(color.r, max(color.g, color.b));
    if (peak < start) return color;
    const float range = 1.0 - start;
    float newPeak = 1.0 - range * range / (peak + range - start);
    float share = 1.0 - 1.0 / (desaturation * (peak - newPeak) + 1.0);
    return mix(color * (newPeak / peak), vec3(newPeak), share);
}

// AgX by T. Sobotka, in B. Wrensch's polynomial form ("Minimal AgX Implementation", 2023). Returns linear values.
vec3 ToneCurveAgx(vec3 color)
{
    const mat3 inset = mat3(
        0.842479062253094, 0.0423282422610123, 0.0423756549057051,
        0.0784335999999992, 0.878468636469772, 0.0784336,
        0.0792237451477643, 0.0791661274605434, 0.879142973793104);
    const mat3 outset = mat3(
        1.19687900512017, -0.0528968517574562, -0.0529716355144438,
        -0.0980208811401368, 1.15190312990417, -0.0980434501171241,
        -0.0990297440797205, -0.0989611768448433, 1.15107367264116);
    const float lowest = -12.47393; // stops around middle grey
    const float highest = 4.026069;
    vec3 x = (clamp(log2(max(inset * color, 1e-10)), lowest, highest) - lowest) / (highest - lowest);
    vec3 x2 = x * x;
    vec3 x4 = x2 * x2;
    x = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
    return pow(max(outset * x, 0.0), vec3(2.2));
}

vec3 ToneCurve(vec3 color, uint curve)
{
    color = max(color, 0.0);
    if (curve == TONEMAP_NEUTRAL) return ToneCurveNeutral(color);
    if (curve == TONEMAP_AGX) return ToneCurveAgx(color);
    return color;
}

// Linear to sRGB, IEC 61966-2-1.
vec3 EncodeSrgb(vec3 color)
{
    color = clamp(color, 0.0, 1.0);
    return mix(12.92 * color, 1.055 * pow(color, vec3(1.0 / 2.4)) - 0.055, greaterThan(color, vec3(0.0031308)));
}

#endif
