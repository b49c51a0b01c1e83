#version 460
// Adds one sample of the image to the sum of all.
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) uniform texture2D radiance;
layout(set = 0, binding = 1, rgba32f) uniform image2D total;

layout(push_constant) uniform Push { uint sampleIndex; };

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(total)))) return;
    vec4 value = texelFetch(radiance, pixel, 0);
    if (sampleIndex != 0) value += imageLoad(total, pixel);
    imageStore(total, pixel, value);
}
