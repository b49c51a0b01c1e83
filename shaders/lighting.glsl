// Light at a point of a surface, composed: the original's lighting.glsl, report section 3.6.
#ifndef LIGHTING_GLSL
#define LIGHTING_GLSL

#include "bsdf.glsl"

// Light scattered from the environment.
vec3 ComputeBSDFLight(SurfaceData data, vec3 viewDir)
{
    vec3 reflection = ComputeSpecularReflection(data, viewDir);
    vec3 transmission = ComputeSpecularTransmission(data, viewDir);
    return ComputeScatteredLighting(reflection, transmission, data, viewDir);
}

// Light of one point light.
vec3 ComputeBSDFDirect(SurfaceData data, vec3 viewDir, vec3 position, Light light)
{
    vec3 toLight = light.position - position;
    float distanceSquared = dot(toLight, toLight);
    if (distanceSquared == 0.0) return vec3(0.0);
    vec3 reflection = ComputeSpecularReflectionDirect(data, viewDir, toLight * inversesqrt(distanceSquared));
    return ComputeDirect(reflection, data, viewDir) * light.intensity / distanceSquared;
}

// Everything that leaves `position` towards the viewer; with `direct`, point lights included.
vec3 ComputeLighting(SurfaceData data, vec3 viewDir, vec3 position, bool direct)
{
    vec3 lighting = ComputeBSDFLight(data, viewDir);
    if (direct) {
        for (uint i = 0; i < frame.lightCount; ++i) lighting += ComputeBSDFDirect(data, viewDir, position, lights[i]);
    }
    return lighting;
}

#endif
