// A rough surface as a landscape of tiny smooth facets: GGX, after Walter, Marschner, Li & Torrance, "Microfacet Models for
// Refraction through Rough Surfaces" (EGSR 2007). Directions of unit length; alpha is roughness squared, above 0.
#ifndef MICROFACET_GLSL
#define MICROFACET_GLSL

#include "sampling.glsl"

// Distribution of the normals of facets, Walter 2007, equation 33, per steradian; from the cosine of the angle to the surface's
// normal and the square of its sine, which has its own digits where the angle is small. In a form that does not overflow for
// alpha from 1e-18.
float DistributionGGX(float cosTheta, float sinThetaSquared, float alpha)
{
    float ratio = alpha / max(alpha * alpha * cosTheta * cosTheta + sinThetaSquared, 1e-37);
    return ratio * ratio / PI;
}

// Smith's masking for GGX, one direction, Walter 2007, equation 34, divided by twice the cosine: finite at grazing angles.
float MaskingOverCosineGGX(float cosTheta, float sinThetaSquared, float alpha)
{
    return 1.0 / (cosTheta + sqrt(cosTheta * cosTheta + alpha * alpha * sinThetaSquared));
}

// The share of facets that a direction sees, 0 to 1.
float MaskingGGX(float cosTheta, float sinThetaSquared, float alpha)
{
    return 2.0 * cosTheta * MaskingOverCosineGGX(cosTheta, sinThetaSquared, alpha);
}

// The normal of a facet as `wi` sees them, wi.z above 0, by the area that they show: caps of the sphere, Dupuy & Benyoub,
// "Sampling Visible GGX Normals with Spherical Caps" (HPG 2023), listing 3. `u` from 0 to 1.
vec3 SampleVisibleNormal(vec3 wi, float alpha, vec2 u)
{
    vec3 stretched = normalize(vec3(alpha * wi.xy, wi.z));
    // The last of the 32-bit numbers below 1 keeps the vector off zero.
    float v = min(u.y, LAST_BELOW_ONE);
    // A point of the cap, v (1 + z) below the pole: written with that distance, whose digits the sine needs.
    float below = v * (1.0 + stretched.z);
    float sine = sqrt(max(below * (2.0 - below), 0.0));
    vec2 halfway = sine * CosSinTurns(u.x) + stretched.xy;
    // 1 - below + z, without the cancellation.
    float height = (1.0 - v) * (1.0 + stretched.z);
    return normalize(vec3(alpha * halfway, height));
}

#endif
