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

// Cosine of the transmitted angle by Snell's law, report E(3), from 0; 0 where light is totally reflected.
// The report's 1 - (etaI / etaT)^2 (1 - cos^2), factored so that nothing cancels at grazing angles or where the indices are
// nearly equal.
float GetCosThetaTr(float cosThetaIn, float etaI, float etaT)
{
    precise float bent = etaI * cosThetaIn;
    precise float squared = (etaT - etaI) * (etaT + etaI) + bent * bent;
    return sqrt(max(0.0, squared)) / etaT;
}

// The least magnitude of a ratio of amplitudes that is inverted: the rounding error of 1.
const float LEAST_RATIO = 1.2e-7;

// Unpolarised Fresnel reflectance, report E(4), from 0 to 1 in front. From behind, where the cosine is negative and the
// indices are not swapped, the report's amplitudes are those of the front, inverted: at least 1, and infinite at Brewster's angle.
// There, the one deviation from the report's values, they stay finite. Equal indices reflect nothing, from either side.
float FresnelBSDF(float cosThetaIn, float etaIn, float etaTr)
{
    cosThetaIn = clamp(cosThetaIn, -1.0, 1.0);
    if (etaIn == etaTr) return 0.0;
    float cosThetaTr = GetCosThetaTr(cosThetaIn, etaIn, etaTr);
    if (cosThetaTr <= 0.0) return 1.0; // total internal reflection

    // (a - b) / (a + b) as (a^2 - b^2) / (a + b)^2, with Snell's law put into the numerators: no difference of nearly equal
    // numbers is left but at Brewster's angle.
    float cosine = abs(cosThetaIn);
    float in2 = etaIn * etaIn;
    float tr2 = etaTr * etaTr;
    precise float contrast = (etaTr - etaIn) * (etaTr + etaIn);
    float parallel = etaTr * (etaTr * cosine + etaIn * cosThetaTr);
    float perpendicular = etaIn * cosine + etaTr * cosThetaTr;
    float f0 = contrast * ((tr2 + in2) * cosine * cosine - in2) / (parallel * parallel);
    float f90 = -contrast / (perpendicular * perpendicular);
    if (cosThetaIn < 0.0) {
        f0 = 1.0 / max(abs(f0), LEAST_RATIO);
        f90 = 1.0 / max(abs(f90), LEAST_RATIO);
    }
    return (f0 * f0 + f90 * f90) / 2.0;
}

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

// Light of a point light mirrored by the surface, per unit of irradiance on a plane that faces the light. The red tint is that
// of the environment's reflection alone.
vec3 ComputeSpecularReflectionDirect(SurfaceData data, vec3 viewDir, vec3 lightDir)
{
    float cosThetaView = dot(data.normal, viewDir);
    float cosThetaLight = dot(data.normal, lightDir);
    if (!REFLECTION || cosThetaView <= 0.0 || cosThetaLight <= 0.0) return vec3(0.0);
    float alpha = data.roughness * data.roughness;
    float distribution = DistributionGGX(data.normal, normalize(viewDir + lightDir), alpha);
    // D G / (4 cos cos), its cosines cancelled against those in G.
    float specular = distribution * MaskingOverCosineGGX(cosThetaView, alpha) * MaskingOverCosineGGX(cosThetaLight, alpha);
    return vec3(specular * cosThetaLight * data.reflectionIntensity);
}

// The reflection of a point light, interpolated with no light by the Fresnel reflectance.
vec3 ComputeDirect(vec3 reflection, SurfaceData data, vec3 viewDir)
{
    return ReflectedShare(data, viewDir) * reflection;
}

#endif
