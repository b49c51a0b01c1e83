#version 460
// Moves the mean of all samples by one more, as accumulate.comp does, and the sum of their squared differences from it.
#extension GL_EXT_samplerless_texture_functions : require
#include "welford.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) uniform texture2D radiance;
layout(set = 0, binding = 1, rgba32f) uniform image2D mean;
layout(set = 0, binding = 2, rgba32f) uniform image2D spread; // and the number of samples

layout(push_constant) uniform Push { uint sampleIndex; };

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(mean)))) return;
    vec4 value = texelFetch(radiance, pixel, 0);
    Moments moments = Moments(value.rgb, vec3(0.0));
    if (sampleIndex != 0) {
        vec4 before = imageLoad(mean, pixel);
        moments = WithOneMore(Moments(before.rgb, imageLoad(spread, pixel).rgb), sampleIndex, value.rgb);
        value.a = before.a + (value.a - before.a) / float(sampleIndex + 1);
    }
    imageStore(mean, pixel, vec4(moments.mean, value.a));
    imageStore(spread, pixel, vec4(moments.squares, float(sampleIndex + 1)));
}
