// Surfaces that let nothing through: metallic-roughness as glTF 2.0, appendix B, with the factor of KHR_materials_specular.
//
// Directions are in the local frame, +z is the normal, and point away from the surface: wi to the viewer, wo to the light.
#ifndef OPAQUE_GLSL
#define OPAQUE_GLSL

#include "constants.glsl"
#include "microfacet.glsl"
#include "sampling.glsl"

struct OpaqueSurface {
    vec3 diffuse;   // reflectance below the interface
    vec3 head;      // reflectance of facets seen from the front
    float grazing;  // and on edge
    float alpha;
};

// Below this alpha a facet distribution is a mirror.
const float MIRROR_ALPHA = 1e-4;

OpaqueSurface OpaqueSurfaceOf(vec3 baseColor, float metallic, float roughness, float specular)
{
    OpaqueSurface surface;
    surface.diffuse = baseColor * (1.0 - metallic);
    surface.head = mix(vec3(0.04 * specular), baseColor, metallic);
    surface.grazing = mix(specular, 1.0, metallic);
    surface.alpha = roughness * roughness;
    return surface;
}

bool IsMirror(OpaqueSurface surface) { return surface.alpha <= MIRROR_ALPHA; }
bool IsSpecular(OpaqueSurface surface) { return surface.grazing > 0.0; }

// Reflectance of a facet: Schlick 1994.
vec3 FacetReflectance(OpaqueSurface surface, float cosine)
{
    float rest = clamp(1.0 - cosine, 0.0, 1.0);
    float squared = rest * rest;
    return surface.head + (surface.grazing - surface.head) * (squared * squared * rest);
}

// What is not mirrored goes below.
float BelowFacets(OpaqueSurface surface, float cosine)
{
    vec3 mirrored = FacetReflectance(surface, cosine);
    return 1.0 - max(max(mirrored.x, mirrored.y), mirrored.z);
}

// The BSDF times the cosine of wo.
vec3 EvaluateOpaque(OpaqueSurface surface, vec3 wi, vec3 wo)
{
    if (wi.z <= 0.0 || wo.z <= 0.0) return vec3(0.0);
    vec3 wm = normalize(wi + wo);
    float cosine = dot(wi, wm);
    vec3 value = surface.diffuse * (BelowFacets(surface, cosine) * wo.z / PI);
    if (IsSpecular(surface) && !IsMirror(surface)) {
        // D G / (4 cos cos) times cos, the cosines cancelled against those in G.
        float distribution = DistributionGGX(wm.z, dot(wm.xy, wm.xy), surface.alpha);
        float masking = MaskingOverCosineGGX(wi.z, dot(wi.xy, wi.xy), surface.alpha)
            * MaskingOverCosineGGX(wo.z, dot(wo.xy, wo.xy), surface.alpha);
        value += FacetReflectance(surface, cosine) * (distribution * masking * wo.z);
    }
    return value;
}

// The share of directions that are chosen for what facets mirror.
float SpecularChance(OpaqueSurface surface, vec3 wi)
{
    if (!IsSpecular(surface)) return 0.0;
    vec3 mirrored = FacetReflectance(surface, wi.z);
    float mirror = mirrored.x + mirrored.y + mirrored.z;
    float below = BelowFacets(surface, wi.z) * (surface.diffuse.x + surface.diffuse.y + surface.diffuse.z);
    return mirror / max(mirror + below, 1e-30);
}

// The density of SampleOpaque choosing wo, per steradian, but for directions that a mirror has no choice about.
float OpaquePdf(OpaqueSurface surface, vec3 wi, vec3 wo)
{
    if (wi.z <= 0.0 || wo.z <= 0.0) return 0.0;
    float chance = SpecularChance(surface, wi);
    float pdf = (1.0 - chance) * wo.z / PI;
    if (chance > 0.0 && !IsMirror(surface)) {
        vec3 wm = normalize(wi + wo);
        pdf += chance * DistributionGGX(wm.z, dot(wm.xy, wm.xy), surface.alpha)
            * MaskingOverCosineGGX(wi.z, dot(wi.xy, wi.xy), surface.alpha) / 2.0;
    }
    return pdf;
}

// A direction to the light, what its radiance is worth, and the density of such directions.
struct LightSample {
    vec3 wo;
    vec3 weight;
    float pdf;
};

// For what is scattered below the facets: as the cosine.
LightSample SampleDiffuse(OpaqueSurface surface, vec3 wi, vec2 u)
{
    vec2 around = CosSinTurns(u.x);
    vec3 wo = vec3(sqrt(u.y) * around, sqrt(max(1.0 - u.y, 0.0)));
    float cosine = dot(wi, normalize(wi + wo));
    return LightSample(wo, surface.diffuse * BelowFacets(surface, cosine), max(wo.z, 1e-4) / PI);
}

// For what facets mirror: visible ones.
LightSample SampleSpecular(OpaqueSurface surface, vec3 wi, vec2 u)
{
    vec3 wm = SampleVisibleNormal(wi, surface.alpha, u);
    float cosine = dot(wi, wm);
    vec3 wo = 2.0 * cosine * wm - wi;
    if (wo.z <= 0.0) return LightSample(wo, vec3(0.0), 1.0);
    float pdf = DistributionGGX(wm.z, dot(wm.xy, wm.xy), surface.alpha)
        * MaskingOverCosineGGX(wi.z, dot(wi.xy, wi.xy), surface.alpha) / 2.0;
    float masking = MaskingGGX(wo.z, dot(wo.xy, wo.xy), surface.alpha);
    return LightSample(wo, FacetReflectance(surface, cosine) * masking, max(pdf, 1e-6));
}

#endif
