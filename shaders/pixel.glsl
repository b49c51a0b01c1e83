// What models that trace make of a pixel: one sample, and the means of all.
#ifndef PIXEL_GLSL
#define PIXEL_GLSL

#include "shared.glsl"

layout(set = 0, binding = 15, rgba32f) uniform image2D mean;    // radiance, and throughput cut off
layout(set = 0, binding = 16, rgba32f) uniform image2D counts;  // interfaces, rays

struct Sample {
    vec4 value;       // radiance, and throughput cut off
    float interfaces;  // mean over its trees
    uint rays;
    uint head;        // of its records, from 1; 0: none
    uint disperses;   // 1: its wavelengths have trees of their own
};

// Samples of the rows being traced that wait for the light of opaque surfaces.
layout(std430, set = 0, binding = 17) buffer SampleBuffer { Sample samples[]; };

uint SampleAt(ivec2 place)
{
    return uint(place.y - int(firstRow)) * uint(imageSize(mean).x) + uint(place.x);
}

// Moves the means of a pixel by one sample: means, not sums, as in accumulate.comp.
void AddSample(ivec2 place, Sample one)
{
    vec4 value = one.value;
    vec4 count = vec4(one.interfaces, float(one.rays), 0.0, 0.0);
    if (sampleIndex != 0) {
        vec4 before = imageLoad(mean, place);
        value = before + (value - before) / float(sampleIndex + 1);
        before = imageLoad(counts, place);
        count = before + (count - before) / float(sampleIndex + 1);
    }
    imageStore(mean, place, value);
    imageStore(counts, place, count);
}

#endif
