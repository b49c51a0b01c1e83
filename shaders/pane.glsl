// The rough pane, a dielectric without an inside: facets that reflect, and that let the rest through as if mirrored to the other side,
// what bounces between the pane's two faces included. After the thin-walled surfaces of glTF's KHR_materials_transmission.
//
// Directions are in the local frame, as in rough.glsl; there is one medium on both sides.
#ifndef PANE_GLSL
#define PANE_GLSL

#include "fresnel.glsl"
#include "rough.glsl"

RoughValue EvaluatePane(vec3 wi, vec3 wo, float alpha, float etaI, float etaT)
{
    if (wi.z <= 0.0 || wo.z == 0.0) return RoughValue(0.0, 0.0);
    vec3 mirrored = vec3(wo.xy, abs(wo.z));
    vec3 wm = normalize(wi + mirrored);
    float cosI = dot(wi, wm);
    float reflectance = PaneReflectance(FresnelDielectric(cosI, etaI, etaT).reflectance);
    float share = wo.z > 0.0 ? reflectance : 1.0 - reflectance;
    float pdf = FacetDensity(wi, wm, alpha, /* reflected */ true, share, cosI, 0.0, etaT, 1.0);
    return RoughValue(pdf * MaskingGGX(mirrored.z, SinSquared(mirrored), alpha), pdf);
}

// A direction: u.xy choose the facet, u.z between reflection and transmission, by the facet's reflectance.
RoughSample SamplePane(vec3 wi, float alpha, float etaI, float etaT, vec3 u)
{
    const RoughSample nothing = RoughSample(vec3(0.0, 0.0, 1.0), 0.0, 0.0);
    if (wi.z <= 0.0) return nothing;
    vec3 wm = SampleVisibleNormal(wi, alpha, u.xy);
    float cosI = dot(wi, wm);
    vec3 wo = 2.0 * cosI * wm - wi;
    // Light that leaves a facet into the surface is what a single bounce loses.
    if (wo.z <= 0.0) return nothing;
    float weight = MaskingGGX(wo.z, SinSquared(wo), alpha);
    if (u.z >= PaneReflectance(FresnelDielectric(cosI, etaI, etaT).reflectance)) wo.z = -wo.z;
    return RoughSample(wo, weight, EvaluatePane(wi, wo, alpha, etaI, etaT).pdf);
}

#endif
