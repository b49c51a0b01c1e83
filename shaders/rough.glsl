// The rough dielectric: microfacets that reflect and refract, Walter et al. 2007, with GGX and separable Smith masking.
//
// The local frame: the surface's normal is +z. Directions point away from the surface, are of unit length, and `wi`, where light is
// seen from, lies on the side of +z, with index etaI; etaT is the index beyond. Values carry radiance, towards `wi`: what is
// transmitted is scaled by (etaI / etaT)^2, which cancels over enter and exit.
#ifndef ROUGH_GLSL
#define ROUGH_GLSL

#include "fresnel.glsl"
#include "microfacet.glsl"

// Below this alpha, and between equal indices, an interface is smooth: nothing is spread, there is no density.
const float LEAST_ALPHA = 1e-10;

bool IsSpread(float alpha, float etaI, float etaT)
{
    return alpha >= LEAST_ALPHA && etaI != etaT;
}

float SinSquared(vec3 w)
{
    return dot(w.xy, w.xy);
}

struct RoughValue {
    float value;  // the BSDF times the absolute cosine of wo
    float pdf;    // of SampleRough choosing wo, per steradian
};

// a x + b y, with the digits that are left where the two nearly cancel.
vec3 Combined(float a, vec3 x, float b, vec3 y)
{
    vec3 sum;
    for (int i = 0; i < 3; ++i) {
        vec2 p = TwoProduct(a, x[i]);
        vec2 q = TwoProduct(b, y[i]);
        vec2 s = TwoSum(p.x, q.x);
        sum[i] = s.x + (s.y + (p.y + q.y));
    }
    return sum;
}

// The density of a direction whose facet reflects, or refracts, the given share of light: visible normals (Heitz 2018) times
// the solid angle of facets over that of directions (Walter 2007, equations 14 and 17). `denominator` is that of equation 17, etaI cosI - etaT
// cosT, as its callers can tell it without cancellation; cosT is not used by reflection.
float FacetDensity(vec3 wi, vec3 wm, float alpha, bool reflected, float share, float cosI, float cosT, float etaT, float denominator)
{
    float distribution = DistributionGGX(wm.z, SinSquared(wm), alpha);
    float visible = 2.0 * MaskingOverCosineGGX(wi.z, SinSquared(wi), alpha) * distribution; // over cosI
    float bent = etaT / denominator;
    float density = share * visible * (reflected ? 0.25 : cosI * cosT * bent * bent);
    return min(density, LARGEST_FLOAT); // close to index 1 lobes are narrower than 32 bits can say
}

// That denominator, of a facet that refracts.
float RefractionDenominator(float cosI, float cosT, float etaI, float etaT)
{
    return (etaT - etaI) * (etaT + etaI) / (etaI * cosI + etaT * cosT);
}

// Value and density of one pair of directions.
RoughValue EvaluateRough(vec3 wi, vec3 wo, float alpha, float etaI, float etaT)
{
    const RoughValue nothing = RoughValue(0.0, 0.0);
    if (!IsSpread(alpha, etaI, etaT) || wi.z <= 0.0 || wo.z == 0.0) return nothing;
    bool reflected = wo.z > 0.0;
    // The facet's normal, on the side of the surface's: equations 13 and 16.
    vec3 halfway = reflected ? wi + wo : Combined(etaI, wi, etaT, wo);
    float size = length(halfway);
    if (!(size > 0.0)) return nothing;
    vec3 wm = halfway * ((halfway.z < 0.0 ? -1.0 : 1.0) / size);
    float cosI = dot(wi, wm);
    float cosO = dot(wo, wm);
    // Facets that are seen from behind, from either side.
    if (wm.z <= 0.0 || cosI <= 0.0 || (reflected ? cosO <= 0.0 : cosO >= 0.0)) return nothing;

    // Both cosines are known: no need to ask Snell, who amplifies errors at the critical angle.
    float share = reflected ? FresnelDielectric(cosI, etaI, etaT).reflectance : FresnelTransmittance(cosI, -cosO, etaI, etaT);
    float pdf = FacetDensity(wi, wm, alpha, reflected, share, cosI, -cosO, etaT, size);
    float ratio = reflected ? 1.0 : etaI / etaT;
    float weight = MaskingGGX(abs(wo.z), SinSquared(wo), alpha) * ratio * ratio;
    return RoughValue(min(pdf * weight, LARGEST_FLOAT), pdf);
}

struct RoughSample {
    vec3 wo;
    float weight;  // value over density; 0: no light comes this way
    float pdf;     // a probability, not a density, where the interface is smooth
};

// The direction beyond a facet, from a cosine of incidence above 0. As a change of the direction seen: close to index 1 that is
// small and keeps its digits, which a narrow lobe consists of.
vec3 RefractThroughFacet(vec3 wi, vec3 wm, float cosI, float cosThetaT, float etaI, float etaT)
{
    float share = (etaI + etaT) / (etaI * cosI + etaT * cosThetaT);
    return -wi + ((etaT - etaI) / etaT) * (wi - share * wm);
}

// A direction: u.xy choose the facet, u.z between reflection and transmission, by the facet's reflectance.
RoughSample SampleRough(vec3 wi, float alpha, float etaI, float etaT, vec3 u)
{
    const RoughSample nothing = RoughSample(vec3(0.0, 0.0, 1.0), 0.0, 0.0);
    if (wi.z <= 0.0) return nothing;
    bool spread = IsSpread(alpha, etaI, etaT);
    vec3 wm = spread ? SampleVisibleNormal(wi, alpha, u.xy) : vec3(0.0, 0.0, 1.0);
    float cosI = dot(wi, wm);
    Interface facet = FresnelDielectric(cosI, etaI, etaT);
    bool reflected = u.z < facet.reflectance;
    if (facet.total && !reflected) reflected = true; // u.z is 1
    vec3 wo = reflected ? 2.0 * cosI * wm - wi : RefractThroughFacet(wi, wm, cosI, facet.cosThetaT, etaI, etaT);
    float ratio = reflected ? 1.0 : etaI / etaT;
    if (!spread) return RoughSample(wo, ratio * ratio, reflected ? facet.reflectance : facet.transmittance);
    // Light that leaves a facet into the surface is what a single bounce loses.
    if (reflected ? wo.z <= 0.0 : wo.z >= 0.0) return nothing;
    // The density of the direction as it is rounded. Where a lobe is so narrow that rounding leaves no facet, that of the facet.
    float pdf = EvaluateRough(wi, wo, alpha, etaI, etaT).pdf;
    if (pdf == 0.0) {
        float share = reflected ? facet.reflectance : facet.transmittance;
        float denominator = RefractionDenominator(cosI, facet.cosThetaT, etaI, etaT);
        pdf = FacetDensity(wi, wm, alpha, reflected, share, cosI, facet.cosThetaT, etaT, denominator);
    }
    return RoughSample(wo, MaskingGGX(abs(wo.z), SinSquared(wo), alpha) * ratio * ratio, pdf);
}

#endif
