// An interface that spreads light, opaque or rough glass, as a path meets it: what a direction is worth, how likely it is chosen, and the
// choice, all three of one kind of surface or another.
#ifndef INTERFACE_GLSL
#define INTERFACE_GLSL

#include "compensation.glsl"
#include "effects.glsl"
#include "media.glsl"
#include "opaque.glsl"
#include "pane.glsl"
#include "rough.glsl"

// The density of a direction that could not have been another.
const float NO_PDF = -1.0;

// An interface that a path has met, in the local frame.
struct Met {
    bool isOpaque;
    bool isPane;
    OpaqueSurface surface;
    float alpha;
    float etaI;
    float etaT;
    float scale;       // what single bounces between facets lose, given back
    vec3 tint;         // what light is multiplied by that goes through
    vec3 wi;
};

// What directions are worth: the BSDF times the cosine of wo, without the factor of the indices, and their density.
struct Worth {
    vec3 value;
    float pdf;
};

Worth Evaluate(Met met, vec3 wo)
{
    if (met.isOpaque) return Worth(EvaluateOpaque(met.surface, met.wi, wo), OpaquePdf(met.surface, met.wi, wo));
    RoughValue rough;
    if (met.isPane) rough = EvaluatePane(met.wi, wo, met.alpha, met.etaI, met.etaT);
    else rough = EvaluateRough(met.wi, wo, met.alpha, met.etaI, met.etaT);
    bool reflected = wo.z > 0.0;
    if (reflected ? !REFLECTION : !TRANSMISSION) return Worth(vec3(0.0), rough.pdf);
    float ratio = reflected || met.isPane ? 1.0 : met.etaT / met.etaI;
    vec3 value = vec3(rough.value * met.scale * ratio * ratio);
    if (COATINGS && !reflected) value *= met.tint;
    return Worth(value, rough.pdf);
}

// A direction that a path goes on in.
struct Next {
    vec3 wo;
    vec3 weight;
    float pdf;        // NO_PDF: none other was possible
};

// Of an opaque surface: u chooses the direction, `choice` between what is mirrored and what is scattered below.
Next SampleOpaque(OpaqueSurface surface, vec3 wi, vec2 u, float choice)
{
    float chance = SpecularChance(surface, wi);
    bool isSpecular = choice < chance;
    if (isSpecular && IsMirror(surface)) return Next(vec3(-wi.xy, wi.z), FacetReflectance(surface, wi.z) / chance, NO_PDF);
    vec3 wo = isSpecular ? SpecularDirection(surface, wi, u) : DiffuseDirection(u);
    float pdf = OpaquePdf(surface, wi, wo);
    return Next(wo, pdf > 0.0 ? EvaluateOpaque(surface, wi, wo) / pdf : vec3(0.0), pdf);
}

Next SampleNext(Met met, vec2 u, float choice)
{
    if (met.isOpaque) return SampleOpaque(met.surface, met.wi, u, choice);
    RoughSample rough;
    if (met.isPane) rough = SamplePane(met.wi, met.alpha, met.etaI, met.etaT, vec3(u, choice));
    else rough = SampleRough(met.wi, met.alpha, met.etaI, met.etaT, vec3(u, choice));
    bool reflected = rough.wo.z > 0.0;
    if (reflected ? !REFLECTION : !TRANSMISSION) rough.weight = 0.0;
    float ratio = reflected || met.isPane ? 1.0 : met.etaT / met.etaI;
    vec3 weight = vec3(rough.weight * met.scale * ratio * ratio);
    if (COATINGS && !reflected) weight *= met.tint;
    return Next(rough.wo, weight, rough.pdf);
}

// Whether the environment is looked for on that side of an interface: where another index than 1 is there only what is bent comes from it,
// but for holes in a mesh.
bool IsUnderSky(Met met, bool above)
{
    float index = above || met.isPane ? met.etaI : met.etaT;
    return index == 1.0 || !INTERIOR;
}

bool IsRough(Material material)
{
    return material.roughness > SMOOTH_ROUGHNESS;
}

Met MetAt(Material material, Crossing crossing, vec3 wi)
{
    Met met;
    met.isOpaque = crossing.isOpaque;
    met.isPane = crossing.isPane;
    met.surface = OpaqueSurface(vec3(0.0), vec3(0.0), 0.0, 1.0);
    if (met.isOpaque) met.surface = OpaqueSurfaceOf(material.baseColor, material.metallic, material.roughness, material.head, material.specular);
    met.alpha = material.roughness * material.roughness;
    met.etaI = crossing.etaI;
    met.etaT = crossing.etaT;
    met.wi = normalize(wi);
    met.scale = 1.0;
    met.tint = material.baseColor;
    if (ENERGY_COMPENSATION && !met.isOpaque) {
        uint table = met.isPane ? material.albedoTable : RoughTable(material.albedoTables, met.etaI, met.etaT);
        bool isMapped = TEXTURES && material.finishMap != 0;
        met.scale = isMapped ? RoughCompensationAt(table, material.roughness, met.wi.z) : RoughCompensation(table, met.wi.z);
    }
    return met;
}

#endif
