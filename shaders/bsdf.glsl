// The original's BSDF of smooth dielectrics: one interface, seen from the rasteriser.
// A. Ferreira Gomes, "Glass Refraction Using BSDF for Smooth Dielectrics" (2025), section 3. The formulas are those of
// Pharr, Jakob & Humphreys, Physically Based Rendering (3rd ed.), 8.2.
//
// viewDir and the directions returned point away from the surface, inDir points towards it. normal is of unit length; the
// cosine with it is negative where the surface is seen from behind, and the indices are not swapped then.
#ifndef BSDF_GLSL
#define BSDF_GLSL

#include "effects.glsl"
#include "environment.glsl"
#include "fresnel.glsl"
#include "microfacet.glsl"

struct SurfaceData {
    vec3 normal;
    float refractionIndex;
    float roughness;
    float reflectionRed;
    float reflectionIntensity;
    float refractionGreen;
    float refractionIntensity;
};

// The share of reflection in a mixture. From behind the reflectance is above 1; an image holds no less than no light.
float ReflectedShare(SurfaceData data, vec3 viewDir)
{
    return min(FresnelBSDF(dot(viewDir, data.normal), 1.0, data.refractionIndex), 1.0);
}

// Light mirrored by the surface, report code block 4.
vec3 ComputeSpecularReflection(SurfaceData data, vec3 viewDir)
{
    if (!REFLECTION) return vec3(0.0);
    vec3 reflectionDir = reflect(-viewDir, data.normal);
    vec3 specularReflection = SampleEnvironment(reflectionDir, 0.0);
    return (specularReflection + vec3(data.reflectionRed, 0.0, 0.0)) * data.reflectionIntensity;
}

// Light refracted through the surface, report E(5) and code block 5.
vec3 ComputeSpecularTransmission(SurfaceData data, vec3 viewDir)
{
    if (!TRANSMISSION) return vec3(0.0);
    float cosThetaIn = clamp(dot(data.normal, viewDir), -1.0, 1.0);
    float etaIOverT = 1.0 / data.refractionIndex;
    float cosThetaTr = GetCosThetaTr(cosThetaIn, 1.0, data.refractionIndex);
    vec3 transmissionDir = -viewDir; // nothing bends at index 1, also where rounding would
    if (data.refractionIndex != 1.0) {
        if (cosThetaTr <= 0.0) return vec3(0.0); // total internal reflection
        // As in the original, the flip comes after the cosine: the direction is then not of unit length.
        if (frame.flippedRatio != 0) etaIOverT = data.refractionIndex;
        transmissionDir = etaIOverT * -viewDir + (etaIOverT * cosThetaIn - cosThetaTr) * data.normal;
    }
    vec3 specularTransmission = SampleEnvironment(transmissionDir, 0.0);
    return (specularTransmission + vec3(0.0, data.refractionGreen, 0.0)) * data.refractionIntensity;
}

// Both, interpolated by the Fresnel reflectance, report E(2) and code block 1.
vec3 ComputeScatteredLighting(vec3 reflection, vec3 transmission, SurfaceData data, vec3 viewDir)
{
    // mix(), arranged to be exact where both are equal.
    return transmission + ReflectedShare(data, viewDir) * (reflection - transmission);
}

// The square of the sine of the angle between two directions: 1 - cos^2 has no digits left where the highlight is.
float SinSquaredTo(vec3 a, vec3 b)
{
    vec3 sine = cross(a, b);
    return dot(sine, sine);
}

// Light of a point light mirrored by the surface, per unit of irradiance on a plane that faces the light. The red tint is that
// of the environment's reflection alone.
vec3 ComputeSpecularReflectionDirect(SurfaceData data, vec3 viewDir, vec3 lightDir)
{
    float cosThetaView = dot(data.normal, viewDir);
    float cosThetaLight = dot(data.normal, lightDir);
    if (!REFLECTION || cosThetaView <= 0.0 || cosThetaLight <= 0.0) return vec3(0.0);
    float alpha = data.roughness * data.roughness;
    vec3 halfDir = normalize(viewDir + lightDir);
    float distribution = DistributionGGX(dot(data.normal, halfDir), SinSquaredTo(data.normal, halfDir), alpha);
    // D G / (4 cos cos), its cosines cancelled against those in G.
    float masking = MaskingOverCosineGGX(cosThetaView, SinSquaredTo(data.normal, viewDir), alpha)
        * MaskingOverCosineGGX(cosThetaLight, SinSquaredTo(data.normal, lightDir), alpha);
    return vec3(distribution * masking * cosThetaLight * data.reflectionIntensity);
}

// The reflection of a point light, interpolated with no light by the Fresnel reflectance.
vec3 ComputeDirect(vec3 reflection, SurfaceData data, vec3 viewDir)
{
    return ReflectedShare(data, viewDir) * reflection;
}

#endif
