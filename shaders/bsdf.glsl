// The original's BSDF of smooth dielectrics, and that of rough ones: one interface, seen from the rasteriser.
// A. Ferreira Gomes, "Glass Refraction Using BSDF for Smooth Dielectrics" (2025), section 3. The formulas are those of
// Pharr, Jakob & Humphreys, Physically Based Rendering (3rd ed.), 8.2.
//
// viewDir and the directions returned point away from the surface, inDir points towards it. normal is of unit length; the
// cosine with it is negative where the surface is seen from behind, and the indices are not swapped then.
#ifndef BSDF_GLSL
#define BSDF_GLSL

#include "compensation.glsl"
#include "effects.glsl"
#include "environment.glsl"
#include "rough.glsl"

struct SurfaceData {
    vec3 normal;
    bool behind;            // the surface itself, not only its interpolated normal, is turned away
    float refractionIndex;
    float roughness;
    uint albedoTable;
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

// ---- rough surfaces: Walter et al. 2007 in the place of the smooth interface ---------------------------------------------------

bool IsRough(SurfaceData data)
{
    return ROUGHNESS && data.roughness > SMOOTH_ROUGHNESS && data.refractionIndex != 1.0;
}

// A rough surface and the direction that it is seen from, in its local frame.
struct RoughSurface {
    mat3 toWorld;
    vec3 wi;
    float alpha;
    float scale;  // what a single bounce loses, given back
};

RoughSurface RoughSurfaceSeenFrom(SurfaceData data, vec3 viewDir)
{
    RoughSurface surface;
    surface.toWorld = BasisAround(data.behind ? -data.normal : data.normal);
    surface.wi = viewDir * surface.toWorld;
    // Where interpolated normals turn to the other side than the surface, as at rims, the view grazes it.
    surface.wi.z = max(surface.wi.z, 1e-4);
    surface.wi = normalize(surface.wi);
    surface.alpha = data.roughness * data.roughness;
    // From behind facets mirror everything; what a mirror loses is in no table.
    bool compensated = ENERGY_COMPENSATION && !data.behind;
    surface.scale = compensated ? RoughCompensation(data.albedoTable, surface.wi.z) : 1.0;
    return surface;
}

// Light that facets mirror and refract, as means over visible normals. `shift` is the pixel's own, `first` the number of normals
// taken before, `inAll` of those that share the picture: each stands for a cone of directions, and the environment is
// averaged over it.
//
// Each facet mixes reflection and transmission by its own Fresnel reflectance. As with smooth surfaces transmitted radiance is
// not scaled by the ratio of the indices, and facets seen from behind mirror everything.
vec3 ComputeRoughLight(SurfaceData data, vec3 viewDir, uvec2 shift, uint first, uint count, float inAll)
{
    RoughSurface surface = RoughSurfaceSeenFrom(data, viewDir);
    vec3 wi = surface.wi;
    float eta = data.refractionIndex;
    vec3 light = vec3(0.0);
    float weights = 0.0;
    for (uint k = 0; k < count; ++k) {
        vec3 wm = SampleVisibleNormal(wi, surface.alpha, PlasticPoint(first + k, shift));
        float dither = UnitFloat((first + k) * GOLDEN_STEP + shift.x);
        float cosI = dot(wi, wm);
        Interface facet = FresnelDielectric(cosI, 1.0, eta);
        float reflected = data.behind ? 1.0 : facet.reflectance;

        vec3 wr = 2.0 * cosI * wm - wi;
        float weight = reflected * MaskingGGX(wr.z, SinSquared(wr), surface.alpha);
        if (wr.z > 0.0) {
            weights += weight;
            if (REFLECTION) {
                float pdf = FacetDensity(wi, wm, surface.alpha, /* reflected */ true, 1.0, cosI, 0.0, eta, 1.0);
                vec3 radiance = SampleEnvironment(surface.toWorld * wr, EnvironmentLod(1.0 / (inAll * pdf), dither));
                light += weight * data.reflectionIntensity * (radiance + vec3(data.reflectionRed, 0.0, 0.0));
            }
        }
        if (data.behind || facet.total) continue;
        vec3 wt = RefractThroughFacet(wi, wm, cosI, facet.cosThetaT, 1.0, eta);
        if (TRANSMISSION && wt.z < 0.0) {
            float denominator = RefractionDenominator(cosI, facet.cosThetaT, 1.0, eta);
            float pdf = FacetDensity(wi, wm, surface.alpha, /* reflected */ false, 1.0, cosI, facet.cosThetaT, eta, denominator);
            vec3 radiance = SampleEnvironment(surface.toWorld * wt, EnvironmentLod(1.0 / (inAll * pdf), dither));
            weight = facet.transmittance * MaskingGGX(-wt.z, SinSquared(wt), surface.alpha);
            light += weight * data.refractionIntensity * (radiance + vec3(0.0, data.refractionGreen, 0.0));
        }
    }
    // What a mirror loses is what its weights lack.
    if (data.behind && ENERGY_COMPENSATION) return light / max(weights, 1e-6);
    return light * surface.scale / float(count);
}

// Light of a point light, mirrored by facets or refracted through them, per unit of irradiance on a plane that faces it. None
// from behind, as with smooth surfaces.
vec3 ComputeRoughDirect(SurfaceData data, vec3 viewDir, vec3 lightDir)
{
    if (data.behind) return vec3(0.0);
    RoughSurface surface = RoughSurfaceSeenFrom(data, viewDir);
    vec3 wo = lightDir * surface.toWorld;
    bool reflected = wo.z > 0.0;
    if (reflected ? !REFLECTION : !TRANSMISSION) return vec3(0.0);
    float eta = data.refractionIndex;
    float value = EvaluateRough(surface.wi, wo, surface.alpha, 1.0, eta).value;
    if (reflected) return vec3(value * surface.scale * data.reflectionIntensity);
    return vec3(value * eta * eta * surface.scale * data.refractionIntensity);
}

#endif
