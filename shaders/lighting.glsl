// Light at a point of a surface, composed: the original's lighting.glsl, report section 3.6.
#ifndef LIGHTING_GLSL
#define LIGHTING_GLSL

#include "bsdf.glsl"
#include "spot.glsl"

// Light scattered from the environment.
vec3 ComputeBSDFLight(SurfaceData data, vec3 viewDir)
{
    vec3 reflection = ComputeSpecularReflection(data, viewDir);
    vec3 transmission = ComputeSpecularTransmission(data, viewDir);
    return ComputeScatteredLighting(reflection, transmission, data, viewDir);
}

// The same of a rough surface, for the pixel that is being drawn.
vec3 ComputeRoughBSDFLight(SurfaceData data, vec3 viewDir, uvec2 pixel)
{
    uint first = sampleIndex * frame.normals;
    bool known = frame.normalsInAll != 0;
    uint inAll = known ? frame.normalsInAll : first + frame.normals;
    // Samples without end lie in the pixel by the sequence that normals follow too: a shift of its own for each sample keeps the two
    // apart.
    uvec2 shift = Pcg3d(uvec3(pixel, frame.seed + (known ? 0 : sampleIndex))).xy;
    return ComputeRoughLight(data, viewDir, shift, first, frame.normals, float(inAll));
}

// Light of one point light.
vec3 ComputeBSDFDirect(SurfaceData data, vec3 viewDir, vec3 position, Light light)
{
    vec3 toLight = light.position - position;
    float distanceSquared = dot(toLight, toLight);
    if (distanceSquared == 0.0) return vec3(0.0);
    vec3 lightDir = toLight * inversesqrt(distanceSquared);
    vec3 irradiance = IntensityAlong(-lightDir, light) / distanceSquared;
    if (IsRough(data)) return ComputeRoughDirect(data, viewDir, lightDir) * irradiance;
    return ComputeDirect(ComputeSpecularReflectionDirect(data, viewDir, lightDir), data, viewDir) * irradiance;
}

// Everything that leaves `position` towards the viewer; with `direct`, point lights included.
vec3 ComputeLighting(SurfaceData data, vec3 viewDir, vec3 position, uvec2 pixel, bool direct)
{
    vec3 lighting = IsRough(data) ? ComputeRoughBSDFLight(data, viewDir, pixel) : ComputeBSDFLight(data, viewDir);
    if (direct) {
        for (uint i = 0; i < frame.lightCount; ++i) lighting += ComputeBSDFDirect(data, viewDir, position, lights[i]);
    }
    return lighting;
}

#endif
