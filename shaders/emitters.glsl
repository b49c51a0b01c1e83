// Surfaces that shine as lights: triangles chosen by how much they do. src/passes/emitters.rs makes the table.
#ifndef EMITTERS_GLSL
#define EMITTERS_GLSL

#include "shared.glsl"
#include "surface.glsl"
#include "trace.glsl"

struct Emitter {
    float start;    // what lies before it in a list of all, as a share of the whole
    float share;
    uint instance;
    uint triangle;
};

layout(std430, set = 0, binding = 18) readonly buffer EmitterBuffer {
    uint emitterCount;
    float emittedPower;  // luminance times area, of all
    uvec2 emitterPadding;
    Emitter emitters[];
};

struct EmitterSample {
    vec3 position;
    vec3 faceNormal;  // of unit length
    Found found;
    float pdf;        // per area
};

// A point, evenly spread on the triangle that `u.x` chooses: A. Heitz, "A Low-Distortion Map Between Triangle and Square" (2019).
EmitterSample SampleEmitter(float choice, vec2 u)
{
    uint low = 0;
    uint high = emitterCount;
    while (high - low > 1) {
        uint middle = (low + high) / 2;
        if (emitters[middle].start <= choice) low = middle; else high = middle;
    }
    Emitter emitter = emitters[low];
    Instance instance = instances[emitter.instance];
    uint triangle = instance.firstTriangle + emitter.triangle;
    vec3 a = instance.objectToWorld * vec4(FetchCorner(triangle, 0), 1.0);
    vec3 b = instance.objectToWorld * vec4(FetchCorner(triangle, 1), 1.0);
    vec3 c = instance.objectToWorld * vec4(FetchCorner(triangle, 2), 1.0);
    vec2 place = 0.5 * u;
    if (u.y > u.x) place.y = u.y - place.x; else place.x = u.x - place.y;
    // In lengths of the longer edge, whose squares are numbers.
    float longer = max(max(length(b - a), length(c - a)), 1e-30);
    vec3 normal = cross((b - a) / longer, (c - a) / longer);
    float size = max(length(normal), 1e-30);
    EmitterSample chosen;
    chosen.position = a + place.x * (b - a) + place.y * (c - a);
    chosen.faceNormal = normal / size;
    chosen.found = Found(emitter.instance, emitter.triangle);
    chosen.pdf = emitter.share / (0.5 * size * longer * longer);
    return chosen;
}

// The density per steradian of choosing a point of a surface that `shines`, seen at `distance` and at an angle of `cosine`.
float EmitterPdf(float shines, float distance, float cosine)
{
    return shines / emittedPower * distance * distance / max(abs(cosine), 1e-6); // seen on edge it is infinite
}

#endif
