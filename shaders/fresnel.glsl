// What a smooth interface does to light: Snell's law and Fresnel's equations.
//
// Directions point away from the surface. etaI is the index on the side that light is seen from, etaT the index beyond; both
// above 0, from 1e-6 to 1e6. Two sets of functions: those of the original, as the model `single` shows them, and those that
// every other function builds on, right to a few ULP also where the textbook's formulas have no digits left.
#ifndef FRESNEL_GLSL
#define FRESNEL_GLSL

#include "compensated.glsl"

// ---- the original: A. Ferreira Gomes (2025), sections 3.2 and 3.3 ---------------------------------------------------

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

// ---- the hard cases -------------------------------------------------------------------------------------------------

// An interface at one angle of incidence.
struct Interface {
    float reflectance;    // unpolarised, 0 to 1
    float transmittance;  // 1 - reflectance, with digits of its own where that is small
    float cosThetaT;      // 0 where light is totally reflected
    bool total;           // total reflection
};

// etaT^2 - etaI^2, exact but for the last bits of the third of three numbers that fall in size.
vec3 Contrast(float etaI, float etaT)
{
    vec2 t = TwoSquare(etaT);
    vec2 i = TwoSquare(etaI);
    vec2 coarse = TwoSum(t.x, -i.x);
    vec2 fine = TwoSum(t.y, -i.y);
    vec2 middle = TwoSum(coarse.y, fine.x);
    return vec3(coarse.x, middle.x, middle.y + fine.y);
}

// (etaT cosThetaT)^2 = etaT^2 - etaI^2 + (etaI cosThetaI)^2 by Snell's law, as a pair; not above 0 where light is totally
// reflected. Next to the critical angle the terms cancel, to the bit; what they had lost is added then, so that what is left
// has all its digits. `tangential` is etaI cosThetaI, as a pair.
vec2 TransmittedSquared(vec3 contrast, vec2 tangential)
{
    vec2 square = TwoSquare(tangential.x);
    vec2 twice = TwoProduct(2.0 * tangential.x, tangential.y);
    vec2 coarse = TwoSum(contrast.x, square.x);
    vec2 fine = TwoSum(square.y, twice.x);
    vec2 middle = TwoSum(contrast.y, fine.x);
    vec2 lost = TwoSum(coarse.y, middle.x);
    vec2 sum = TwoSum(coarse.x, lost.x);
    precise float rest = sum.y + lost.y;
    rest += ((middle.y + contrast.z) + fine.y) + (twice.y + tangential.y * tangential.y);
    precise float high = sum.x + rest;
    precise float low = rest - (high - sum.x);
    return vec2(high, low);
}

// The share of light that passes, from both cosines and the first one's sine, squared: no difference of nearly equal numbers is in it.
float FresnelTransmittance(float cosThetaI, float sinThetaI2, float cosThetaT, float etaI, float etaT)
{
    float i = etaI * cosThetaI;
    float t = etaT * cosThetaT;
    // sin 2 thetaI sin 2 thetaT / sin^2 (thetaI + thetaT), and the same over cos^2 (thetaI - thetaT).
    float through = 2.0 * (i / (i + t)) * (t / (i + t));
    float difference = etaT / (cosThetaI * t + etaI * sinThetaI2);
    return min(through + through * difference * difference, 1.0);
}

float FresnelTransmittance(float cosThetaI, float cosThetaT, float etaI, float etaT)
{
    return FresnelTransmittance(cosThetaI, (1.0 - cosThetaI) * (1.0 + cosThetaI), cosThetaT, etaI, etaT);
}

// The interface at an angle of incidence of cosine `cosThetaI`, 0 to 1, a pair.
//
// Fresnel's amplitudes, (a - b) / (a + b), are written as (a^2 - b^2) / (a + b)^2 with Snell's law in the numerator:
//   perpendicular  -(etaT^2 - etaI^2) / (etaI cosThetaI + etaT cosThetaT)^2
//   parallel       the same times cos(thetaI + thetaT) / cos(thetaI - thetaT)
// No difference of nearly equal numbers is left, but for the parallel one at Brewster's angle, where it is next to nothing.
Interface FresnelDielectric(vec2 cosThetaI, float etaI, float etaT)
{
    if (!(cosThetaI.x > 0.0)) cosThetaI = vec2(0.0);
    if (cosThetaI.x > 1.0) cosThetaI = vec2(1.0, 0.0);
    float cosine = cosThetaI.x;
    if (etaI == etaT) return Interface(0.0, 1.0, cosine, false);
    vec3 contrast = Contrast(etaI, etaT);
    vec2 i = TwoProduct(etaI, cosine);
    i.y += etaI * cosThetaI.y;
    vec2 squared = TransmittedSquared(contrast, i);
    if (squared.x <= 0.0) return Interface(1.0, 0.0, 0.0, true);
    vec2 t = RootOfPair(squared);

    vec2 sum = TwoSum(i.x, t.x);
    sum.y += i.y + t.y;
    vec2 sumSquared = TwoSquare(sum.x);
    sumSquared.y += 2.0 * sum.x * sum.y;
    vec2 amplitude = QuotientOfPairs(vec2(contrast.x, contrast.y + contrast.z), sumSquared);
    vec2 squaredAmplitude = TwoSquare(amplitude.x);
    float perpendicular = squaredAmplitude.x + (squaredAmplitude.y + 2.0 * amplitude.x * amplitude.y);

    // etaT cos(thetaI -+ thetaT) is the difference or the sum of these two.
    float cosines = cosine * t.x;
    // Seen from a very dense side everything happens next to a cosine of 1, where the rest of it is most of the sine.
    precise float sinThetaI2 = ((1.0 - cosine) - cosThetaI.y) * ((1.0 + cosine) + cosThetaI.y);
    sinThetaI2 = max(sinThetaI2, 0.0);
    float sines = etaI * sinThetaI2;
    float ratio = (cosines - sines) / (cosines + sines);
    float reflectance = min(0.5 * (perpendicular + perpendicular * ratio * ratio), 1.0);

    float cosThetaT = (t.x + t.y) / etaT;
    return Interface(reflectance, FresnelTransmittance(cosine, sinThetaI2, cosThetaT, etaI, etaT), cosThetaT, false);
}

Interface FresnelDielectric(float cosThetaI, float etaI, float etaT)
{
    return FresnelDielectric(vec2(cosThetaI, 0.0), etaI, etaT);
}

// The share of light that a pane's two parallel faces reflect, from that of one, what bounces between them included.
float PaneReflectance(float reflectance)
{
    return 2.0 * reflectance / (1.0 + reflectance);
}

// And the share that they let through.
float PaneTransmittance(float reflectance, float transmittance)
{
    return transmittance / (1.0 + reflectance);
}

// Scalar product, as a pair: Ogita, Rump & Oishi 2005, algorithm 5.3.
vec2 CompensatedDot(vec3 a, vec3 b)
{
    vec2 x = TwoProduct(a.x, b.x);
    vec2 y = TwoProduct(a.y, b.y);
    vec2 z = TwoProduct(a.z, b.z);
    vec2 two = TwoSum(x.x, y.x);
    vec2 three = TwoSum(two.x, z.x);
    precise float low = (two.y + three.y) + ((x.y + y.y) + z.y);
    return vec2(three.x, low);
}

// Cosine of the angle between two directions, as a pair. Vectors of unit length are rounded, and so a little longer or shorter:
// 1e-7, which next to the critical angle moves the refracted ray by 3e-4.
vec2 CosineBetween(vec3 a, vec3 b)
{
    vec2 lengthA = CompensatedDot(a, a);
    vec2 lengthB = CompensatedDot(b, b);
    precise float excess = ((lengthA.x - 1.0) + lengthA.y) + ((lengthB.x - 1.0) + lengthB.y);
    vec2 cosine = CompensatedDot(a, b);
    // Of grazing directions the products cancel, and what is left of their rounding is more than a rounding of the sum.
    return TwoSum(cosine.x, cosine.y - 0.5 * excess * cosine.x);
}

// The refracted direction, away from the surface, and the interface that it crosses. `wi` and `n` are of unit length and on one
// side; zero where light is totally reflected.
struct Refraction {
    vec3 wt;
    Interface crossed;
};

// Tangential and normal part apart: close to the critical angle the normal part is small, and keeps its digits where the
// normal is an axis.
Refraction Refract(vec3 wi, vec3 n, float etaI, float etaT)
{
    vec2 cosThetaI = CosineBetween(wi, n);
    Interface crossed = FresnelDielectric(cosThetaI, etaI, etaT);
    if (crossed.total) return Refraction(vec3(0.0), crossed);
    if (etaI == etaT) return Refraction(-wi, crossed); // nothing bends, also where rounding would
    // Without the correction of the length: where the normal is an axis nothing of wi is left along it.
    vec3 tangential = wi - CompensatedDot(wi, n).x * n;
    return Refraction(-(etaI / etaT) * tangential - crossed.cosThetaT * n, crossed);
}

#endif
