// What an interface does to light that arrives from one direction: what it mirrors and what it lets through, one direction each. Smooth,
// or one facet of a rough surface.
#ifndef SCATTER_GLSL
#define SCATTER_GLSL

#include "compensation.glsl"
#include "effects.glsl"
#include "fresnel.glsl"
#include "grazing.glsl"
#include "rough.glsl"

// An interface, seen from one of its sides: `normal` and `faceNormal`, of the surface itself, point there.
struct Seen {
    vec3 normal;
    vec3 faceNormal;
    float etaI;
    float etaT;
    bool isRough;
    bool isPane;
    float alpha;
    uint tables;       // of what rough surfaces lose
};

struct Scattered {
    vec3 wr;           // the direction that is mirrored
    vec3 wt;           // and the one that passes
    float reflected;   // their shares of the light
    float transmitted;
    float areaR;       // solid angles of the lobes that they stand for; 0: none
    float areaT;
    bool total;        // total reflection
};

Scattered ScatterSmooth(Seen seen, vec3 wi)
{
    vec3 normal = NormalTowards(seen.normal, wi);
    Refraction refraction = Refract(wi, normal, seen.etaI, seen.etaT);
    Scattered light;
    light.total = refraction.crossed.total;
    light.reflected = refraction.crossed.reflectance;
    light.transmitted = refraction.crossed.transmittance;
    if (seen.isPane) {
        // Both interfaces, and everything between them, summed.
        light.transmitted = light.total ? 0.0 : PaneTransmittance(light.reflected, light.transmitted);
        light.reflected = PaneReflectance(light.reflected);
    }
    light.wr = DirectionAbove(normalize(2.0 * dot(wi, normal) * normal - wi), seen.faceNormal);
    light.wt = -wi;
    if (!seen.isPane && !light.total && seen.etaI != seen.etaT) light.wt = DirectionAbove(normalize(refraction.wt), -seen.faceNormal);
    light.areaR = 0.0;
    light.areaT = 0.0;
    return light;
}

// By one visible normal, that which `u` chooses. What the facet sends to other facets is lost, and given back in the mean.
Scattered ScatterRough(Seen seen, vec3 wi, vec2 u)
{
    mat3 toWorld = BasisAround(seen.normal);
    vec3 w = wi * toWorld;
    // Where interpolated normals turn to the other side than the surface, as at rims, the view grazes it.
    w.z = max(w.z, 1e-4);
    w = normalize(w);
    float scale = ENERGY_COMPENSATION ? RoughCompensation(RoughTable(seen.tables, seen.etaI, seen.etaT), w.z) : 1.0;
    vec3 wm = SampleVisibleNormal(w, seen.alpha, u);
    float cosI = dot(w, wm);
    Interface facet = FresnelDielectric(cosI, seen.etaI, seen.etaT);
    Scattered light;
    light.total = facet.total;
    light.wr = toWorld * vec3(0.0, 0.0, 1.0);
    light.wt = -light.wr;
    light.reflected = 0.0;
    light.transmitted = 0.0;
    light.areaR = 0.0;
    light.areaT = 0.0;
    vec3 wr = 2.0 * cosI * wm - w;
    if (wr.z > 0.0) {
        light.wr = DirectionAbove(normalize(toWorld * wr), seen.faceNormal);
        light.reflected = scale * facet.reflectance * MaskingGGX(wr.z, SinSquared(wr), seen.alpha);
        light.areaR = 1.0 / FacetDensity(w, wm, seen.alpha, /* reflected */ true, 1.0, cosI, 0.0, seen.etaT, 1.0);
    }
    if (facet.total) return light;
    vec3 wt = RefractThroughFacet(w, wm, cosI, facet.cosThetaT, seen.etaI, seen.etaT);
    if (wt.z < 0.0) {
        float denominator = RefractionDenominator(cosI, facet.cosThetaT, seen.etaI, seen.etaT);
        light.wt = DirectionAbove(normalize(toWorld * wt), -seen.faceNormal);
        light.transmitted = scale * facet.transmittance * MaskingGGX(-wt.z, SinSquared(wt), seen.alpha);
        light.areaT = 1.0 / FacetDensity(w, wm, seen.alpha, /* reflected */ false, 1.0, cosI, facet.cosThetaT, seen.etaT, denominator);
    }
    return light;
}

Scattered Scatter(Seen seen, vec3 wi, vec2 u)
{
    Scattered light;
    if (ROUGHNESS && seen.isRough) light = ScatterRough(seen, wi, u); else light = ScatterSmooth(seen, wi);
    if (!REFLECTION) light.reflected = 0.0;
    if (!TRANSMISSION) light.transmitted = 0.0;
    return light;
}

#endif
