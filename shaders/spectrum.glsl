// Light of one wavelength as a colour: src/optics/spectrum.rs in 32 bits, and how a path chooses its wavelength.
#ifndef SPECTRUM_GLSL
#define SPECTRUM_GLSL

// The wavelengths that carry colour, in nanometres.
const float SHORTEST = 390.0;
const float LONGEST = 710.0;

// How often wavelengths are chosen, by band: in proportion to the length of their colours, which makes the least noise. Up to the start
// of each band, and all.
const uint BANDS = 16;
const float BAND_EDGES[BANDS + 1] = float[](0.0, 0.005, 0.0513, 0.1615, 0.2657, 0.3219, 0.3714, 0.4536, 0.5442, 0.6222, 0.7096, 0.82,
    0.9189, 0.9747, 0.9947, 0.9993, 1.0);

float Lobe(float wavelength, float mean, float below, float above)
{
    float scaled = (wavelength - mean) * (wavelength < mean ? below : above);
    return exp(-0.5 * scaled * scaled);
}

// The CIE 1931 colour matching functions: Wyman, Sloan & Shirley, JCGT 2013.
vec3 ColorMatching(float wavelength)
{
    return vec3(
        0.362 * Lobe(wavelength, 442.0, 0.0624, 0.0374) + 1.056 * Lobe(wavelength, 599.8, 0.0264, 0.0323)
            - 0.065 * Lobe(wavelength, 501.1, 0.0490, 0.0382),
        0.821 * Lobe(wavelength, 568.8, 0.0213, 0.0247) + 0.286 * Lobe(wavelength, 530.9, 0.0613, 0.0322),
        1.217 * Lobe(wavelength, 437.0, 0.0845, 0.0278) + 0.681 * Lobe(wavelength, 459.0, 0.0385, 0.0725));
}

// In linear Rec. 709; the mean over all wavelengths is white. Outside of the gamut channels are below 0.
vec3 ColorOf(float wavelength)
{
    const mat3 toColor = mat3(8.0892720, -3.0527864, 0.1837432, -3.8372188, 5.9086568, -0.6737249, -1.2445034, 0.1308842, 3.4911200);
    return toColor * ColorMatching(wavelength);
}

struct Wavelength {
    float nanometres;
    vec3 color;       // over the density of the choice: its mean is white
};

// Evenly spread `u` make wavelengths as evenly spread as their colours count.
Wavelength ChooseWavelength(float u)
{
    uint band = 0;
    for (uint i = 1; i < BANDS; ++i) band += uint(BAND_EDGES[i] <= u);
    float share = BAND_EDGES[band + 1] - BAND_EDGES[band];
    float within = (u - BAND_EDGES[band]) / share;
    float nanometres = SHORTEST + (float(band) + within) * ((LONGEST - SHORTEST) / float(BANDS));
    return Wavelength(nanometres, ColorOf(nanometres) / (share * float(BANDS)));
}

#endif
