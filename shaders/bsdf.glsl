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

struct SurfaceData {
    vec3 normal;
    float refractionIndex;
    float roughness;
    float reflectionRed;
    float reflectionIntensity;
    float refractionGreen;
    float refractionIntensity;
};

// Cosine of the transmitted angle by Snell's law, report E(3); 0 where light is totally reflected.
// The report's 1 - eta^2 (1 - cos^2) is factored so that nothing cancels at grazing angles or at an index near 1.
float GetCosThetaTr(float cosThetaIn, float etaIOverT)
{
    if (etaIOverT == 1.0) return abs(cosThetaIn); // a square root may be an ULP off, and then index 1 would show
    precise float bent = etaIOverT * cosThetaIn;
    precise float squared = (1.0 - etaIOverT) * (1.0 + etaIOverT) + bent * bent;
    return sqrt(max(0.0, squared));
}

// A ratio whose denominator stays above its own rounding error: report E(4) divides by zero where the surface is seen
// from behind at Brewster's angle. The one deviation from the report's values.
float FresnelRatio(float minuend, float subtrahend)
{
    float denominator = minuend + subtrahend;
    float least = 1.2e-7 * (abs(minuend) + abs(subtrahend));
    return (minuend - subtrahend) / (abs(denominator) < least ? least : denominator);
}

// Unpolarised Fresnel reflectance, report E(4). Above 1 where the cosine is negative.
float FresnelBSDF(float cosThetaIn, float etaIn, float etaTr)
{
    cosThetaIn = clamp(cosThetaIn, -1.0, 1.0);
    float cosThetaTr = GetCosThetaTr(cosThetaIn, etaIn / etaTr);
    if (cosThetaTr <= 0.0) return 1.0; // total internal reflection

    float f0 = FresnelRatio(etaTr * cosThetaIn, etaIn * cosThetaTr);
    float f90 = FresnelRatio(etaIn * cosThetaIn, etaTr * cosThetaTr);
    return (f0 * f0 + f90 * f90) / 2.0;
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
    float cosThetaTr = GetCosThetaTr(cosThetaIn, etaIOverT);
    if (cosThetaTr <= 0.0) return vec3(0.0); // total internal reflection

    // As in the original, the flip comes after the cosine: the direction is then not of unit length.
    if (frame.flippedRatio != 0) etaIOverT = data.refractionIndex;
    vec3 transmissionDir = etaIOverT * -viewDir + (etaIOverT * cosThetaIn - cosThetaTr) * data.normal;
    vec3 specularTransmission = SampleEnvironment(transmissionDir, 0.0);
    return (specularTransmission + vec3(0.0, data.refractionGreen, 0.0)) * data.refractionIntensity;
}

// Both, interpolated by the Fresnel reflectance, report E(2) and code block 1.
vec3 ComputeScatteredLighting(vec3 reflection, vec3 transmission, SurfaceData data, vec3 viewDir)
{
    float fresnel = FresnelBSDF(dot(viewDir, data.normal), 1.0, data.refractionIndex);
    // mix(), arranged to be exact where both are equal, however large the reflectance.
    return transmission + fresnel * (reflection - transmission);
}

// Distribution of microfacet normals, GGX: Walter et al. 2007, equation 33, in a form that does not overflow at small alpha.
// 0 at alpha 0, where a point light has no highlight that could be seen.
float DistributionGGX(vec3 normal, vec3 halfDir, float alpha)
{
    float cosine = max(dot(normal, halfDir), 0.0);
    vec3 sine = cross(normal, halfDir); // 1 - cos^2 has no digits left where the highlight is
    float ratio = alpha / max(alpha * alpha * cosine * cosine + dot(sine, sine), 1e-30);
    return ratio * ratio / PI;
}

// Smith's masking for GGX divided by twice the cosine: Walter et al. 2007, equation 34. Finite at grazing angles.
float MaskingOverCosineGGX(float cosine, float alpha)
{
    return 1.0 / (cosine + sqrt(alpha * alpha + (1.0 - alpha * alpha) * cosine * cosine));
}

// Light of a point light mirrored by the surface, per unit of irradiance on a plane that faces the light.
vec3 ComputeSpecularReflectionDirect(SurfaceData data, vec3 viewDir, vec3 lightDir)
{
    float cosThetaView = dot(data.normal, viewDir);
    float cosThetaLight = dot(data.normal, lightDir);
    if (!REFLECTION || cosThetaView <= 0.0 || cosThetaLight <= 0.0) return vec3(0.0);
    float alpha = data.roughness * data.roughness;
    float distribution = DistributionGGX(data.normal, normalize(viewDir + lightDir), alpha);
    // D G / (4 cos cos), its cosines cancelled against those in G.
    float specular = distribution * MaskingOverCosineGGX(cosThetaView, alpha) * MaskingOverCosineGGX(cosThetaLight, alpha);
    return vec3((specular * cosThetaLight + data.reflectionRed) * data.reflectionIntensity);
}

// The reflection of a point light, interpolated with no light by the Fresnel reflectance.
vec3 ComputeDirect(vec3 reflection, SurfaceData data, vec3 viewDir)
{
    return FresnelBSDF(dot(viewDir, data.normal), 1.0, data.refractionIndex) * reflection;
}

#endif
