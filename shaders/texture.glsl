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

// Images as materials wear them, numbered from 1: of each its first word, width, height and what lies beyond it; from the coordinates of
// a mesh, v downwards, to its own a matrix, then an offset. Then the texels of each image, linear, two words of two half floats each:
// red and green, blue and alpha. Behind each image are its halves, down to a single texel.
layout(std430, set = 0, binding = 13) readonly buffer TexelBuffer { uint texels[]; };

const uint MAP_WORDS = 10;

// What lies beyond an image, two bits a direction.
const uint WRAP_REPEAT = 0;
const uint WRAP_MIRROR = 1;
const uint WRAP_CLAMP = 2;

float MapNumber(uint map, uint word) { return uintBitsToFloat(texels[MAP_WORDS * (map - 1) + word]); }

mat2 TurnOf(uint map) { return mat2(MapNumber(map, 4), MapNumber(map, 5), MapNumber(map, 6), MapNumber(map, 7)); }

// A level of an image.
struct Texels {
    uint first;
    uvec2 size;
};

Texels TexelsOf(uint map, int level)
{
    uint header = MAP_WORDS * (map - 1);
    Texels image = Texels(texels[header], uvec2(texels[header + 1], texels[header + 2]));
    for (int i = 0; i < level; ++i) {
        image.first += 2 * image.size.x * image.size.y;
        image.size = max(image.size / 2, uvec2(1));
    }
    return image;
}

// A column or row that may be one beyond the image.
int Wrapped(int place, int size, uint wrap)
{
    if (wrap == WRAP_CLAMP) return clamp(place, 0, size - 1);
    if (wrap == WRAP_MIRROR) return place < 0 ? 0 : place >= size ? size - 1 : place;
    return place + (place < 0 ? size : place >= size ? -size : 0);
}

// The same place within the image.
float Within(float place, uint wrap)
{
    if (wrap == WRAP_CLAMP) return clamp(place, 0.0, 1.0);
    if (wrap == WRAP_MIRROR) return abs(place - 2.0 * floor(0.5 * place + 0.5));
    return place - floor(place);
}

vec4 FetchTexel(Texels image, ivec2 place, uvec2 wrap)
{
    uint column = uint(Wrapped(place.x, int(image.size.x), wrap.x));
    uint row = uint(Wrapped(place.y, int(image.size.y), wrap.y));
    uint word = image.first + 2 * (row * image.size.x + column);
    return vec4(unpackHalf2x16(texels[word]), unpackHalf2x16(texels[word + 1]));
}

// The texels at `at`, (0, 0) being the top left corner, bilinear.
vec4 SampleTexels(Texels image, vec2 at, uvec2 wrap)
{
    vec2 position = vec2(Within(at.x, wrap.x), Within(at.y, wrap.y)) * vec2(image.size) - 0.5;
    vec2 corner = floor(position);
    vec2 weight = position - corner;
    ivec2 low = ivec2(corner);
    vec4 top = mix(FetchTexel(image, low, wrap), FetchTexel(image, low + ivec2(1, 0), wrap), weight.x);
    vec4 bottom = mix(FetchTexel(image, low + ivec2(0, 1), wrap), FetchTexel(image, low + ivec2(1, 1), wrap), weight.x);
    return mix(top, bottom, weight.y);
}

// The mean of what `map` has over the parallelogram around the coordinates `uv` of a mesh whose sides are the columns of `sides`.
vec4 SampleMap(uint map, vec2 uv, mat2 sides)
{
    Texels image = TexelsOf(map, 0);
    mat2 turn = TurnOf(map);
    uint wraps = texels[MAP_WORDS * (map - 1) + 3];
    uvec2 wrap = uvec2(wraps & 3, wraps >> 2);
    vec2 at = turn * vec2(uv.x, 1.0 - uv.y) + vec2(MapNumber(map, 8), MapNumber(map, 9));
    sides = turn * mat2(sides[0].x, -sides[0].y, sides[1].x, -sides[1].y);
    // Beyond a whole image nothing changes any more.
    sides = mat2(clamp(sides[0], -64.0, 64.0), clamp(sides[1], -64.0, 64.0));
    mat2 inTexels = mat2(sides[0] * vec2(image.size), sides[1] * vec2(image.size));
    Row row = RowOver(dot(inTexels[0], inTexels[0]), dot(inTexels[0], inTexels[1]), dot(inTexels[1], inTexels[1]), LONGEST_ROW,
        float(findMSB(max(image.size.x, image.size.y))));
    int level = int(row.lod);
    float coarse = row.lod - float(level);
    image = TexelsOf(map, level);
    Texels next = TexelsOf(map, coarse > 0.0 ? level + 1 : level);
    vec2 axis = sides * row.axis;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < row.count; ++i) {
        vec2 place = at + PlaceInRow(row, i) * axis;
        vec4 value = SampleTexels(image, place, wrap);
        if (coarse > 0.0) value = mix(value, SampleTexels(next, place, wrap), coarse);
        sum += value;
    }
    return sum / float(row.count);
}

// A material as it is at a place.
struct Dressed {
    Material material;  // colours, roughness and metal are those of the place
    float presence;     // how much of the surface is there, 0 to 1
    float through;      // of a dielectric, the share that lets light through
    vec3 bump;          // the normal in the frame of the texture's coordinates
};

// At a point of a triangle; `sides` of what the pixel sees of it in the mesh's coordinates.
Dressed DressAt(Material material, Found found, vec3 weights, mat2 sides)
{
    Dressed dressed = Dressed(material, 1.0, 1.0, vec3(0.0, 0.0, 1.0));
    vec4 color = vec4(1.0);
    vec4 finish = vec4(1.0);
    vec4 emission = vec4(1.0);
    vec4 transmission = vec4(1.0);
    float alpha = 1.0;
    if (TEXTURES || NORMAL_MAPS || CUTOUTS) {
        uint normalMap = NORMAL_MAPS ? material.normalMap : 0;
        uint maps[6] = uint[6](0, 0, 0, 0, normalMap, CUTOUTS ? material.alphaMap : 0);
        if (TEXTURES) {
            maps[0] = material.colorMap;
            maps[1] = material.finishMap;
            maps[2] = material.emissionMap;
            maps[3] = material.transmissionMap;
        }
        // Alpha comes with the colour.
        bool joined = maps[5] == maps[0];
        if (joined) maps[5] = 0;
        vec2 uv = CoordinatesOf(VerticesOf(found)) * weights;
        for (int i = 0; i < 6; ++i) {
            if (maps[i] == 0) continue;
            vec4 value = SampleMap(maps[i], uv, sides);
            if (i == 0) color = value;
            if (i == 1) finish = value;
            if (i == 2) emission = value;
            if (i == 3) transmission = value;
            if (i == 4) dressed.bump = 2.0 * value.xyz - 1.0;
            if (i == 5) alpha = value.a;
        }
        if (joined) alpha = color.a;
        if (normalMap != 0) {
            // Where in the mesh's coordinates the image's lead to the right, and downwards: the inverse of its turn, of unit length.
            mat2 turn = TurnOf(normalMap);
            vec2 right = vec2(turn[1].y, -turn[0].y);
            vec2 down = vec2(-turn[1].x, turn[0].x);
            float side = sign(turn[0].x * turn[1].y - turn[0].y * turn[1].x);
            vec2 slope = dressed.bump.x * right / max(length(right), 1e-30) - dressed.bump.y * down / max(length(down), 1e-30);
            slope *= side * material.normalScale;
            dressed.bump = vec3(slope.x, -slope.y, max(dressed.bump.z, 1e-3));
        }
    }
    if (TEXTURES) {
        dressed.material.baseColor *= color.rgb;
        dressed.material.roughness *= finish.g;
        dressed.material.metallic *= finish.b;
        dressed.material.emission *= emission.rgb;
    }
    if (CUTOUTS) {
        alpha *= material.alpha;
        dressed.presence = material.alphaCutoff < 0.0 ? alpha : float(alpha >= material.alphaCutoff);
    }
    if (COATINGS && OPAQUE && material.kind != KIND_OPAQUE) {
        float metallic = dressed.material.metallic;
        dressed.through = material.transmission * transmission.r * (1.0 - metallic);
        // Of what lets nothing through.
        dressed.material.metallic = metallic / max(1.0 - dressed.through, 1e-6);
    }
    return dressed;
}

// Two numbers a vertex behind the coordinates: its tangent in the mesh's space, as an octahedron has it (Cigolle et al. 2014).
vec3 FetchTangent(uint vertex)
{
    vec2 place = coordinates[frame.firstTangent + vertex];
    vec3 tangent = vec3(place, 1.0 - abs(place.x) - abs(place.y));
    if (tangent.z < 0.0) tangent.xy = (1.0 - abs(tangent.yx)) * vec2(tangent.x < 0.0 ? -1.0 : 1.0, tangent.y < 0.0 ? -1.0 : 1.0);
    return normalize(tangent);
}

// The normal of a surface that has `normal` without its map.
vec3 BumpedNormal(vec3 bump, vec3 normal, Found found, vec3 weights)
{
    if (bump.x == 0.0 && bump.y == 0.0) return normal;
    uvec3 vertices = VerticesOf(found);
    vec3 mean = weights.x * FetchTangent(vertices.x) + weights.y * FetchTangent(vertices.y) + weights.z * FetchTangent(vertices.z);
    mat3x2 corners = CoordinatesOf(vertices);
    vec2 right = corners[1] - corners[0];
    vec2 up = corners[2] - corners[0];
    mat3 toWorld = mat3(instances[found.instance].objectToWorld);
    bool isMirrored = (right.x * up.y < right.y * up.x) != (determinant(toWorld) < 0.0);
    vec3 tangent = toWorld * mean;
    tangent -= dot(tangent, normal) * normal;
    float size = length(tangent);
    if (size < 1e-6 * length(toWorld[0])) return normal;
    tangent /= size;
    vec3 bitangent = isMirrored ? cross(tangent, normal) : cross(normal, tangent);
    return normalize(bump.x * tangent + bump.y * bitangent + bump.z * normal);
}

#endif
