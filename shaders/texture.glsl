// Images on surfaces: all texels in one buffer, so that no device's count of images limits a scene.
#ifndef TEXTURE_GLSL
#define TEXTURE_GLSL

#include "arrival.glsl"
#include "effects.glsl"
#include "filter.glsl"
#include "shared.glsl"

// Two numbers a vertex; (0, 0) is the bottom left of the image.
layout(std430, set = 0, binding = 12) readonly buffer CoordinateBuffer { vec2 coordinates[]; };

mat3x2 CoordinatesOf(uvec3 vertices)
{
    return mat3x2(coordinates[vertices.x], coordinates[vertices.y], coordinates[vertices.z]);
}

// Of each texture its first word, width and height; then the texels, linear, two words of two half floats each. Behind each image are
// its halves, down to a single texel.
layout(std430, set = 0, binding = 13) readonly buffer TexelBuffer { uint texels[]; };

// A level of an image.
struct Texels {
    uint first;
    uvec2 size;
};

Texels TexelsOf(uint number, int level)
{
    uint header = 3 * (number - 1);
    Texels image = Texels(texels[header], uvec2(texels[header + 1], texels[header + 2]));
    for (int i = 0; i < level; ++i) {
        image.first += 2 * image.size.x * image.size.y;
        image.size = max(image.size / 2, uvec2(1));
    }
    return image;
}

vec3 FetchTexel(Texels image, ivec2 place)
{
    // The image repeats; a place is at most one image away.
    ivec2 size = ivec2(image.size);
    place += ivec2(place.x < 0 ? size.x : 0, place.y < 0 ? size.y : 0);
    place -= ivec2(place.x >= size.x ? size.x : 0, place.y >= size.y ? size.y : 0);
    uint word = image.first + 2 * uint(place.y * size.x + place.x);
    return vec3(unpackHalf2x16(texels[word]), unpackHalf2x16(texels[word + 1]).x);
}

// The colour at `uv`, bilinear.
vec3 SampleTexels(Texels image, vec2 uv)
{
    vec2 turned = vec2(uv.x, 1.0 - uv.y);
    vec2 position = (turned - floor(turned)) * vec2(image.size) - 0.5;
    vec2 corner = floor(position);
    vec2 weight = position - corner;
    ivec2 low = ivec2(corner);
    vec3 top = mix(FetchTexel(image, low), FetchTexel(image, low + ivec2(1, 0)), weight.x);
    vec3 bottom = mix(FetchTexel(image, low + ivec2(0, 1)), FetchTexel(image, low + ivec2(1, 1)), weight.x);
    return mix(top, bottom, weight.y);
}

// The mean colour of `texture`, counted from 1, over the parallelogram around `uv` whose sides are the columns of `sides`.
vec3 SampleTexture(uint number, vec2 uv, mat2 sides)
{
    Texels image = TexelsOf(number, 0);
    // Beyond a whole image nothing changes any more.
    sides = mat2(clamp(sides[0], -64.0, 64.0), clamp(sides[1], -64.0, 64.0));
    mat2 inTexels = mat2(sides[0] * vec2(image.size), sides[1] * vec2(image.size));
    Row row = RowOver(dot(inTexels[0], inTexels[0]), dot(inTexels[0], inTexels[1]), dot(inTexels[1], inTexels[1]), LONGEST_ROW,
        float(findMSB(max(image.size.x, image.size.y))));
    int level = int(row.lod);
    float coarse = row.lod - float(level);
    image = TexelsOf(number, level);
    Texels next = TexelsOf(number, coarse > 0.0 ? level + 1 : level);
    vec2 axis = sides * row.axis;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < row.count; ++i) {
        vec2 place = uv + PlaceInRow(row, i) * axis;
        vec3 color = SampleTexels(image, place);
        if (coarse > 0.0) color = mix(color, SampleTexels(next, place), coarse);
        sum += color;
    }
    return sum / float(row.count);
}

// The colour of an opaque surface at a point of the triangle that was found; `sides` of what the pixel sees of it in the texture's
// coordinates.
vec3 BaseColor(Material material, Found found, vec3 weights, mat2 sides)
{
    if (!TEXTURES || material.texture == 0) return material.baseColor;
    uvec3 vertices = VerticesOf(found);
    return SampleTexture(material.texture, CoordinatesOf(vertices) * weights, sides);
}

#endif
