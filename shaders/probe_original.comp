#version 460
// The original's functions at given cosines and indices, so that a test can compare them with their 64-bit counterparts.
#extension GL_GOOGLE_include_directive : require
#include "bsdf.glsl"

layout(local_size_x = 64) in;
// Cosine and index; roughness in the third.
layout(std430, set = 0, binding = 8) readonly buffer InputBuffer { vec3 inputs[]; };
layout(std430, set = 0, binding = 9) writeonly buffer OutputBuffer { vec4 outputs[]; };

void main()
{
    uint i = gl_GlobalInvocationID.x;
    if (i >= inputs.length()) return;
    float cosine = inputs[i].x;
    float index = inputs[i].y;
    float alpha = inputs[i].z * inputs[i].z;
    float sine = sqrt(max(0.0, 1.0 - cosine * cosine));
    outputs[i] = vec4(
        FresnelBSDF(cosine, 1.0, index),
        GetCosThetaTr(cosine, 1.0, index),
        DistributionGGX(vec3(0.0, 0.0, 1.0), vec3(sine, 0.0, cosine), alpha),
        MaskingOverCosineGGX(max(cosine, 0.0), alpha));
}
