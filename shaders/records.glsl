// Points of opaque surfaces that trees have found and that wait for their lights: tree.glsl leaves them, lights.glsl takes them up.
#ifndef RECORDS_GLSL
#define RECORDS_GLSL

#include "shared.glsl"

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
    uvec2 color;      // of the surface, red and green, blue and metal
    uint roughness;
    uint normal;      // what its map makes of it, in the frame of the texture's coordinates: two of 16 bits, divided by the third
    uvec2 padding;
};

layout(std430, set = 0, binding = 18) buffer RecordBuffer {
    uint recordCount;     // that were to be left, those beyond the capacity too
    uint recordCapacity;
    uint recordsRepeat;   // 1: where some were lost the rows are traced once more
    uint recordPadding;
    Record records[];
};

#endif
