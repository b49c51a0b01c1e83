// What a single bounce between microfacets loses, given back: E. Turquin, "Practical multiple scattering compensation for
// microfacet models" (2019). src/optics/compensation.rs makes the tables.
#ifndef COMPENSATION_GLSL
#define COMPENSATION_GLSL

#include "constants.glsl"
#include "shared.glsl"

// Nodes of a table, at cosines (i / (ALBEDO_NODES - 1))^3.
const uint ALBEDO_NODES = 96;

float AlbedoNode(uint i)
{
    float root = float(i) / float(ALBEDO_NODES - 1);
    return root * root * root;
}

// The share of power that leaves a rough surface after one bounce when light comes at an angle of cosine `cosThetaI`.
float RoughAlbedo(uint table, float cosThetaI)
{
    float cosine = clamp(cosThetaI, 0.0, 1.0);
    uint low = min(uint(pow(cosine, 1.0 / 3.0) * float(ALBEDO_NODES - 1)), ALBEDO_NODES - 2);
    float share = (cosine - AlbedoNode(low)) / (AlbedoNode(low + 1) - AlbedoNode(low));
    return mix(albedos[table + low], albedos[table + low + 1], share);
}

// Surfaces whose roughness an image tells have so many tables, one after the other, of the roughnesses
// SMOOTH_ROUGHNESS + (1 - SMOOTH_ROUGHNESS) (i / (ALBEDO_LEVELS - 1))^1.5.
const uint ALBEDO_LEVELS = 16;

// The same of a surface of this roughness; the first of its tables is `tables`.
float RoughAlbedoAt(uint tables, float roughness, float cosThetaI)
{
    float share = clamp((roughness - SMOOTH_ROUGHNESS) / (1.0 - SMOOTH_ROUGHNESS), 0.0, 1.0);
    float level = pow(share, 2.0 / 3.0) * float(ALBEDO_LEVELS - 1);
    uint low = min(uint(level), ALBEDO_LEVELS - 2);
    uint first = tables + low * ALBEDO_NODES;
    return mix(RoughAlbedo(first, cosThetaI), RoughAlbedo(first + ALBEDO_NODES, cosThetaI), level - float(low));
}

// Indices that differ by more are not those of one interface at two wavelengths.
const float FARTHEST_TABLE = 0.2;

// The table of an interface between two indices among the tables of a material: how many there are, then of each the indices and its
// first node. The one that is closest, since an index that changes with the wavelength has none of its own; 0: none is close.
uint RoughTable(uint tables, float etaI, float etaT)
{
    uint count = uint(albedos[tables]);
    uint table = 0;
    float nearest = FARTHEST_TABLE;
    for (uint i = 0; i < count; ++i) {
        uint entry = tables + 1 + 3 * i;
        float distance = abs(albedos[entry] - etaI) + abs(albedos[entry + 1] - etaT);
        if (distance < nearest) {
            nearest = distance;
            table = uint(albedos[entry + 2]);
        }
    }
    return table;
}

// The factor that gives back what is lost; 1 without a table. Along a very rough surface close to index 1 nearly everything is, and a number above 0 is
// divided by.
float RoughCompensation(uint table, float cosThetaI)
{
    return table == 0 ? 1.0 : 1.0 / max(RoughAlbedo(table, cosThetaI), 1e-6);
}

// The same of a surface whose roughness an image tells.
float RoughCompensationAt(uint tables, float roughness, float cosThetaI)
{
    return tables == 0 ? 1.0 : 1.0 / max(RoughAlbedoAt(tables, roughness, cosThetaI), 1e-6);
}

#endif
