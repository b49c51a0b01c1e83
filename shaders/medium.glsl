// What the inside of a body does to light: absorption and dispersion.
#ifndef MEDIUM_GLSL
#define MEDIUM_GLSL

// The share of light left after `distance`, by Beer and Lambert; `absorption` per unit of length, from 0, finite.
vec3 Transmittance(vec3 absorption, float distance)
{
    return exp(-absorption * distance);
}

// The index at `wavelength` in nanometres, as KHR_materials_dispersion has it: `ior` at 587.6 nm, `dispersion` = 20 / Abbe
// number. Cauchy's formula, its two terms chosen so that index and Abbe number come out right.
float DispersedIndex(float ior, float dispersion, float wavelength)
{
    return ior + (ior - 1.0) * (dispersion / 20.0) * (523655.0 / (wavelength * wavelength) - 1.5168);
}

// The index at `wavelength` in nanometres by Sellmeier's formula; resonances in square micrometres.
float SellmeierIndex(vec3 strengths, vec3 resonances, float wavelength)
{
    float squared = wavelength * wavelength * 1e-6;
    return sqrt(1.0 + dot(strengths, squared / (squared - resonances)));
}

#endif
