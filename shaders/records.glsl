// Points of opaque surfaces that trees have found and that wait for their lights: tree.glsl leaves them, lights.glsl takes them up.
#ifndef RECORDS_GLSL
#define RECORDS_GLSL

#include "effects.glsl"
#include "texture.glsl"
#include "trace.glsl"

struct Record {
    vec3 origin;      // of the ray that found it
    uint next;        // record of the pixel, from 1; 0: none
    vec3 direction;
    uint instance;
    vec3 throughput;
    uint triangle;
    uvec4 bodies;
    uint medium;
    uint line;        // wavelength
    uvec2 padding;
};

layout(std430, set = 0, binding = 17) buffer RecordBuffer {
    uint recordCount;     // that were to be left, those beyond the capacity too
    uint recordCapacity;
    uint recordsRepeat;   // 1: where some were lost the rows are traced once more
    uint recordPadding;
    Record records[];
};

// The colour of an opaque surface at a point of the triangle that was found.
vec3 BaseColor(Material material, Found found, vec3 weights)
{
    if (!TEXTURES || material.texture == 0) return material.baseColor;
    uint first = 3 * (instances[found.instance].firstTriangle + found.triangle);
    uvec3 vertices = instances[found.instance].firstVertex + uvec3(triangles[first], triangles[first + 1], triangles[first + 2]);
    vec2 uv = weights.x * coordinates[vertices.x] + weights.y * coordinates[vertices.y]
        + weights.z * coordinates[vertices.z];
    return SampleTexture(material.texture, uv);
}

#endif
