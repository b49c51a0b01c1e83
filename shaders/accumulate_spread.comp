#version 460
// Moves the mean of all samples by one more, as accumulate.comp does, and the sum of their squared differences from it: B. P. Welford,
// "Note on a Method for Calculating Corrected Sums of Squares and Products", Technometrics 1962.
#extension GL_EXT_samplerless_texture_functions : require

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
    vec4 moved = value;
    vec3 squares = vec3(0.0);
    if (sampleIndex != 0) {
        vec4 before = imageLoad(mean, pixel);
        moved = before + (value - before) / float(sampleIndex + 1);
        squares = imageLoad(spread, pixel).rgb + (value - before).rgb * (value - moved).rgb;
    }
    imageStore(mean, pixel, moved);
    imageStore(spread, pixel, vec4(squares, float(sampleIndex + 1)));
}
