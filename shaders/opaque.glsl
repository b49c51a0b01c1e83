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

// `head` is what it reflects head on where it is no metal.
OpaqueSurface OpaqueSurfaceOf(vec3 baseColor, float metallic, float roughness, float head, float specular)
{
    OpaqueSurface surface;
    surface.diffuse = baseColor * (1.0 - metallic);
    surface.head = mix(vec3(head * specular), baseColor, metallic);
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

// A direction to the light, for what is scattered below the facets: as the cosine.
vec3 DiffuseDirection(vec2 u)
{
    return vec3(sqrt(u.y) * CosSinTurns(u.x), sqrt(max(1.0 - u.y, 0.0)));
}

float DiffusePdf(vec3 wo)
{
    return max(wo.z, 0.0) / PI;
}

// And for what facets mirror: visible ones.
vec3 SpecularDirection(OpaqueSurface surface, vec3 wi, vec2 u)
{
    vec3 wm = SampleVisibleNormal(wi, surface.alpha, u);
    return 2.0 * dot(wi, wm) * wm - wi;
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

// The density of SpecularDirection choosing wo, per steradian, of surfaces that are no mirrors.
float SpecularPdf(OpaqueSurface surface, vec3 wi, vec3 wo)
{
    if (wi.z <= 0.0 || wo.z <= 0.0) return 0.0;
    vec3 wm = normalize(wi + wo);
    return DistributionGGX(wm.z, dot(wm.xy, wm.xy), surface.alpha) * MaskingOverCosineGGX(wi.z, dot(wi.xy, wi.xy), surface.alpha) / 2.0;
}

// The density of SampleOpaque choosing wo, per steradian, but for directions that a mirror has no choice about.
float OpaquePdf(OpaqueSurface surface, vec3 wi, vec3 wo)
{
    if (wi.z <= 0.0 || wo.z <= 0.0) return 0.0;
    float chance = SpecularChance(surface, wi);
    float pdf = (1.0 - chance) * DiffusePdf(wo);
    if (chance > 0.0 && !IsMirror(surface)) pdf += chance * SpecularPdf(surface, wi, wo);
    return pdf;
}

#endif
