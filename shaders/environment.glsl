// Radiance from afar: an equirectangular image or a constant.
// Direction d looks up u = atan2(d.x, -d.z) / 2pi, v = acos(d.y) / pi; texels are centred at (i + 0.5) / size.
#ifndef ENVIRONMENT_GLSL
#define ENVIRONMENT_GLSL

#extension GL_EXT_samplerless_texture_functions : require
#include "constants.glsl"
#include "filter.glsl"
#include "shared.glsl"

// Constants beyond those of effects.glsl start at 64.
layout(constant_id = 64) const bool ENVIRONMENT_IMAGE = true;

// atan(y / x) in the right quadrant, in radians. Vulkan lets the built-in be off by 4096 ULP, several texels of a large
// image; this minimax polynomial is within 2e-7 everywhere. 0 at the origin.
float Atan2(float y, float x)
{
    float larger = max(abs(x), abs(y));
    float t = larger == 0.0 ? 0.0 : min(abs(x), abs(y)) / larger;
    float s = t * t;
    float p = 0.0028498899;
    p = p * s - 0.0160686318;
    p = p * s + 0.0426915288;
    p = p * s - 0.0750429556;
    p = p * s + 0.1064093485;
    p = p * s - 0.1420364529;
    p = p * s + 0.1999261975;
    p = p * s - 0.3333307207;
    float angle = t + t * s * p;
    angle = abs(y) > abs(x) ? 0.5 * PI - angle : angle;
    angle = x < 0.0 ? PI - angle : angle;
    return y < 0.0 ? -angle : angle;
}

// Where a level of the image lies: the first at the top, its halves below it from left to right. Not mip levels: drivers may
// fetch for all pixels of a quad from the level that one of them asks for.
struct Level {
    ivec2 corner;
    ivec2 size;
};

Level EnvironmentLevel(int level)
{
    ivec2 whole = ivec2(frame.environmentSize);
    if (level == 0) return Level(ivec2(0), whole);
    return Level(ivec2(whole.x - (whole.x >> (level - 1)), whole.y), whole >> level);
}

// Bilinear by hand: the filter of a GPU weighs texels in steps of 1/256 only.
vec3 SampleEnvironmentImage(vec2 uv, Level level)
{
    ivec2 size = level.size;
    vec2 position = uv * vec2(size) - 0.5;
    vec2 corner = floor(position);
    vec2 weight = position - corner;
    ivec2 low = ivec2(corner);
    ivec2 high = low + 1;
    low.x = low.x < 0 ? low.x + size.x : low.x;
    high.x = high.x >= size.x ? high.x - size.x : high.x;
    // Rows end at the poles; columns would leave the image only for a direction that is not a number.
    low = level.corner + clamp(low, ivec2(0), size - 1);
    high = level.corner + clamp(high, ivec2(0), size - 1);
    vec3 top = mix(texelFetch(environment, low, 0).rgb, texelFetch(environment, ivec2(high.x, low.y), 0).rgb, weight.x);
    vec3 bottom = mix(texelFetch(environment, ivec2(low.x, high.y), 0).rgb, texelFetch(environment, high, 0).rgb, weight.x);
    return mix(top, bottom, weight.y);
}

// Where in the image `direction` points to, of any length above 0.
vec2 EnvironmentPlace(vec3 direction)
{
    float u = Atan2(direction.x, -direction.z) / (2.0 * PI) + frame.environmentTurn;
    float v = Atan2(length(direction.xz), direction.y) / PI;
    return vec2(u - floor(u), v);
}

// Radiance arriving from `direction`, of any length above 0. `lod` is the level of the image, a whole number from 0.
vec3 SampleEnvironment(vec3 direction, float lod)
{
    if (!ENVIRONMENT_IMAGE) return frame.environmentRadiance;
    return frame.environmentRadiance * SampleEnvironmentImage(EnvironmentPlace(direction), EnvironmentLevel(int(lod)));
}

// The mean radiance arriving from the parallelogram of directions around `direction` whose sides are the columns of `sides`. Rows
// of texels have the same height everywhere; towards the poles columns get narrower, and there less is averaged than might be.
vec3 SampleEnvironment(vec3 direction, mat2x3 sides, int longest)
{
    if (!ENVIRONMENT_IMAGE) return frame.environmentRadiance;
    sides *= float(frame.environmentSize.y) / PI;
    Row row = RowOver(dot(sides[0], sides[0]), dot(sides[0], sides[1]), dot(sides[1], sides[1]), longest,
        float(frame.environmentLevels - 1));
    vec3 axis = sides * row.axis * (PI / float(frame.environmentSize.y));
    int fine = int(row.lod);
    float coarse = row.lod - float(fine);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < row.count; ++i) {
        vec2 uv = EnvironmentPlace(direction + PlaceInRow(row, i) * axis);
        vec3 radiance = SampleEnvironmentImage(uv, EnvironmentLevel(fine));
        if (coarse > 0.0) radiance = mix(radiance, SampleEnvironmentImage(uv, EnvironmentLevel(fine + 1)), coarse);
        sum += radiance;
    }
    return frame.environmentRadiance * sum / float(row.count);
}

// The level whose texels, with the interpolation between them that doubles their area, are as wide as a cone of `solidAngle`. It
// lies between two levels; `dither`, even from 0 to below 1, chooses one, which in the mean of many look-ups is as good as mixing
// both, at half the price. Rows have the same height everywhere; towards the poles columns get narrower, and there less is
// averaged than might be.
float EnvironmentLod(float solidAngle, float dither)
{
    float rows = sqrt(0.5 * solidAngle) * float(frame.environmentSize.y) / PI;
    float lod = clamp(log2(max(rows, 1e-3)), 0.0, float(frame.environmentLevels - 1));
    return floor(lod + dither);
}

#endif
