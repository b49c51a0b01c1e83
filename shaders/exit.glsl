// Where light leaves a body, found in pictures of it: its nearest fronts and its nearest backs, each pixel the number of a triangle.
// After C. Wyman, "An Approximate Image-Space Approach for Interactive Refraction" (2005), and S. Davis & C. Wyman, "Interactive
// Refractions with Total Internal Reflection" (2007), which keep normals and distances there; with triangles what is met is exact.
#ifndef EXIT_GLSL
#define EXIT_GLSL

#extension GL_EXT_samplerless_texture_functions : require
#include "constants.glsl"
#include "surface.glsl"

// An instance in the picture.
struct Placed {
    ivec2 first;    // the texels that may show it
    ivec2 last;
    uint closed;    // 1: a closed body, seen from outside
    float scale;    // of the radiance that is seen from inside of it
};

// A triangle as planes, in the mesh's space: a point x lies outside of it where dot(outside.xyz, x) > outside.w, and has there the
// weights dot(second.xyz, x) + second.w of the second corner and the like of the third.
struct Facet {
    vec4 outside;
    vec4 second;
    vec4 third;
};

layout(std430, set = 0, binding = 9) readonly buffer FacetBuffer { Facet facets[]; };
layout(std430, set = 0, binding = 10) readonly buffer PlacedBuffer { Placed placed[]; };
layout(set = 0, binding = 11) uniform utexture2D fronts;
layout(set = 0, binding = 12) uniform utexture2D backs;

// Pictures are looked at that often for one exit, at most.
const int SEARCH_STEPS = 12;

// Nearer than this, in the mesh's space, where a body has a radius of 0.5 to 1, nothing is met.
const float LEAST_STEP = 1e-5;

struct Exit {
    bool found;
    bool met;       // the triangle itself, and not only its plane
    uint triangle;
    float distance;
    vec2 weights;   // of the triangle's second and third corner
};

// So far outside of a triangle a point still counts as one of it.
const float EDGE = 1e-3;

vec2 WeightsAt(Facet facet, vec3 point)
{
    return vec2(dot(facet.second.xyz, point) + facet.second.w, dot(facet.third.xyz, point) + facet.third.w);
}

bool IsIn(vec2 weights)
{
    return min(min(weights.x, weights.y), 1.0 - weights.x - weights.y) >= -EDGE;
}

// Where a ray that runs in a body from `origin`, on the triangle `left`, in `direction` meets its surface, as far as the camera sees that.
//
// At a point of the ray the pictures say which triangles lie behind it and before it. Their planes say whether the point is still
// inside, and where the ray meets them: Newton's method, held between a point that is inside and one that is not. It ends with a
// triangle that the ray does meet; failing that, a `thorough` search looks around, or else it is the last one proposed.
Exit FindExit(Instance instance, Placed place, uint left, vec3 origin, vec3 direction, bool thorough)
{
    vec3 o = instance.worldToObject * vec4(origin, 1.0);
    vec3 d = mat3(instance.worldToObject) * direction;
    vec4 from = frame.viewProjection * vec4(origin, 1.0);
    vec4 along = frame.viewProjection * vec4(direction, 0.0);
    ivec2 size = textureSize(fronts, 0);
    ivec2 last = min(place.last, size - 1);

    // Meshes lie in the ball of radius 1.
    float speed = length(d);
    float b = dot(o, d) / speed;
    float low = 0.0;
    float high = (-b + sqrt(max(b * b - dot(o, o) + 1.0, 0.0))) / speed;
    float least = LEAST_STEP / speed;
    float s = 0.0;
    Exit exit = Exit(false, false, 0, 0.0, vec2(0.0));
    ivec2 before = ivec2(-1);
    for (int i = 0; i < SEARCH_STEPS; ++i) {
        vec4 clip = from + s * along;
        vec2 pixel = (0.5 + vec2(0.5, -0.5) * clip.xy / clip.w) * vec2(size) - jitter;
        bool isSeen = clip.w > 0.0 && all(greaterThanEqual(pixel, vec2(place.first))) && all(lessThan(pixel, vec2(last + 1)));
        ivec2 texel = ivec2(pixel);
        if (isSeen && exit.found && texel == before) break;
        before = texel;
        uvec2 found = uvec2(0);
        if (isSeen) found = uvec2(texelFetch(fronts, texel, 0).x, texelFetch(backs, texel, 0).x);
        bool isOutside = s > 0.0 && found.x == 0 && found.y == 0;
        float next = high - least;
        uint triangle = 0;
        vec3 point = o + s * d;
        for (int k = 0; k < 2; ++k) {
            if (found[k] == 0) continue;
            vec4 plane = facets[instance.firstTriangle + found[k] - 1].outside;
            float inside = plane.w - dot(plane.xyz, point);
            if (s > 0.0 && inside < -LEAST_STEP) isOutside = true;
            float slope = dot(plane.xyz, d);
            float meets = s + inside / slope;
            if (slope > 0.0 && found[k] - 1 != left && meets > low + least && meets < next) {
                next = meets;
                triangle = found[k];
            }
        }
        if (isOutside) high = min(high, s); else low = max(low, s);
        if (triangle != 0) {
            Facet facet = facets[instance.firstTriangle + triangle - 1];
            point = o + next * d;
            vec2 weights = WeightsAt(facet, point);
            exit = Exit(true, IsIn(weights), triangle - 1, next, weights);
            if (exit.met) return exit;
            s = next;
        } else {
            s = 0.5 * (low + high);
        }
    }
    // Faces seen on edge hide between pixels: the neighbours of the last one may show that which is met.
    if (!thorough) return exit;
    float nearest = LARGEST_FLOAT;
    for (int k = 0; k < 18; ++k) {
        ivec2 at = before + ivec2((k >> 1) % 3 - 1, (k >> 1) / 3 - 1);
        if (any(lessThan(at, place.first)) || any(greaterThan(at, last))) continue;
        uint triangle = (k & 1) == 0 ? texelFetch(fronts, at, 0).x : texelFetch(backs, at, 0).x;
        if (triangle == 0 || triangle - 1 == left) continue;
        Facet facet = facets[instance.firstTriangle + triangle - 1];
        float slope = dot(facet.outside.xyz, d);
        float meets = (facet.outside.w - dot(facet.outside.xyz, o)) / slope;
        if (slope <= 0.0 || meets < least || meets >= nearest) continue;
        vec2 weights = WeightsAt(facet, o + meets * d);
        if (!IsIn(weights)) continue;
        nearest = meets;
        exit = Exit(true, true, triangle - 1, meets, weights);
    }
    return exit;
}

// The normal where light leaves, in the world, of unit length, outwards.
vec3 NormalOf(Instance instance, Exit exit)
{
    vec2 weights = clamp(exit.weights, vec2(-1.0), vec2(2.0));
    vec3 normal = facets[instance.firstTriangle + exit.triangle].outside.xyz;
    return NormalAt(instance, FetchTriangle(instance, exit.triangle), normal, weights.x, weights.y);
}

#endif
