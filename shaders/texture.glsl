// Images on surfaces: all texels in one buffer, so that no device's count of images limits a scene.
#ifndef TEXTURE_GLSL
#define TEXTURE_GLSL

#include "shared.glsl"

// Two numbers a vertex; (0, 0) is the bottom left of the image.
layout(std430, set = 0, binding = 12) readonly buffer CoordinateBuffer { vec2 coordinates[]; };

// Of each texture its first word, width and height; then the texels, linear, two words of two half floats each.
layout(std430, set = 0, binding = 13) readonly buffer TexelBuffer { uint texels[]; };

vec3 FetchTexel(uint first, uvec2 size, ivec2 place)
{
    // The image repeats; a place is at most one image away.
    place += ivec2(place.x < 0 ? size.x : 0, place.y < 0 ? size.y : 0);
    place -= ivec2(place.x >= int(size.x) ? size.x : 0, place.y >= int(size.y) ? size.y : 0);
    uint word = first + 2 * (uint(place.y) * size.x + uint(place.x));
    return vec3(unpackHalf2x16(texels[word]), unpackHalf2x16(texels[word + 1]).x);
}

// The colour of `texture`, counted from 1, at `uv`, bilinear.
vec3 SampleTexture(uint number, vec2 uv)
{
    uint first = texels[3 * (number - 1)];
    uvec2 size = uvec2(texels[3 * (number - 1) + 1], texels[3 * (number - 1) + 2]);
    vec2 turned = vec2(uv.x, 1.0 - uv.y);
    vec2 position = (turned - floor(turned)) * vec2(size) - 0.5;
    vec2 corner = floor(position);
    vec2 weight = position - corner;
    ivec2 low = ivec2(corner);
    vec3 top = mix(FetchTexel(first, size, low), FetchTexel(first, size, low + ivec2(1, 0)), weight.x);
    vec3 bottom = mix(FetchTexel(first, size, low + ivec2(0, 1)), FetchTexel(first, size, low + ivec2(1, 1)), weight.x);
    return mix(top, bottom, weight.y);
}

#endif
