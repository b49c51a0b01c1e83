#version 460
// Moves the mean of all samples by one more. A mean, not a sum: what is added to it shrinks with the number of samples, and
// so does what rounding loses.
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) uniform texture2D radiance;
layout(set = 0, binding = 1, rgba32f) uniform image2D mean;

layout(push_constant) uniform Push { uint sampleIndex; };

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(mean)))) return;
    vec4 value = texelFetch(radiance, pixel, 0);
    if (sampleIndex != 0) {
        vec4 before = imageLoad(mean, pixel);
        value = before + (value - before) / float(sampleIndex + 1);
    }
    imageStore(mean, pixel, value);
}
