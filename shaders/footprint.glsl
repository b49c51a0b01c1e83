// How much of what lies around a look-up stands for: ray differentials, Igehy 1999. What is looked up is averaged over all that the
// rays of a sample's share of the pixel would see, so that few samples suffice; the share shrinks as samples grow.
#ifndef FOOTPRINT_GLSL
#define FOOTPRINT_GLSL

#include "arrival.glsl"
#include "camera.glsl"

// Constants beyond those of effects.glsl start at 64.
layout(constant_id = 65) const bool FOOTPRINTS = true;

// How a ray's origin and direction change over a sample's share of the pixel, to the right and down.
struct Differentials {
    mat2x3 position;
    mat2x3 direction;
};

const Differentials NO_DIFFERENTIALS = Differentials(mat2x3(0.0), mat2x3(0.0));

// Directions are no farther apart than opposite ones, and positions hardly farther than the scene is wide. Where light is scattered so
// wildly that derivatives grow beyond any bound, small shares of a pixel still have to see less than large ones, or the picture would
// never converge.
const float WIDEST = 2.0;
const float WIDEST_OF_PIXEL = 4.0;

// Cosines that are divided by are at least this: beyond, derivatives say nothing of a whole footprint.
const float LEAST_COSINE = 1e-3;

float AwayFromZero(float cosine)
{
    return cosine < 0.0 ? min(cosine, -LEAST_COSINE) : max(cosine, LEAST_COSINE);
}

vec3 Bounded(vec3 change)
{
    change = clamp(change, vec3(-1e9), vec3(1e9)); // so that its square is a number
    float widest = min(WIDEST, WIDEST_OF_PIXEL * footprint);
    return change * (widest / max(length(change), widest));
}

mat2x3 Bounded(mat2x3 change)
{
    return mat2x3(Bounded(change[0]), Bounded(change[1]));
}

// Of the camera's ray through `pixel`, where `share` is how wide a sample's share of it is.
Differentials CameraDifferentials(vec2 pixel, float share)
{
    vec3 ray = CameraRay(pixel);
    float size = length(ray);
    vec3 direction = ray / size;
    mat2x3 change = mat2x3(frame.rayRight, frame.rayDown) * (share / size);
    return Differentials(mat2x3(0.0), change - outerProduct(direction, direction * change));
}

// Of the same ray where it arrives.
Differentials Transferred(Differentials before, vec3 direction, Arrival arrival)
{
    mat2x3 position = before.position + arrival.distance * before.direction;
    position -= outerProduct(direction, arrival.faceNormal * position / AwayFromZero(dot(arrival.faceNormal, direction)));
    return Differentials(Bounded(position), before.direction);
}

// How the weights of the second and the third corner change with a position on the triangle.
mat2 WeightDifferentials(Arrival arrival, mat2x3 position)
{
    // In lengths of the longer edge, whose squares of squares are numbers.
    float size = max(length(arrival.edges[0]), length(arrival.edges[1]));
    mat2x3 edges = arrival.edges / max(size, 1e-30);
    vec3 normal = cross(edges[0], edges[1]);
    float scale = 1.0 / max(dot(normal, normal) * size, 1e-30);
    vec2 second = scale * (cross(edges[1], normal) * position);
    vec2 third = scale * (cross(normal, edges[0]) * position);
    return mat2(second.x, third.x, second.y, third.y);
}

// How the normal changes, as the side has it that `normal` points to.
mat2x3 NormalDifferentials(Arrival arrival, vec3 normal, mat2x3 position)
{
    mat2x3 change = arrival.bends * WeightDifferentials(arrival, position);
    change -= outerProduct(normal, normal * change);
    return Bounded(arrival.behind ? -change : change);
}

// How the cosine between direction and normal changes.
vec2 CosineDifferential(vec3 direction, mat2x3 directions, vec3 normal, mat2x3 normals)
{
    return normal * directions + direction * normals;
}

Differentials Reflected(Differentials before, vec3 direction, vec3 normal, mat2x3 normals)
{
    vec2 cosines = CosineDifferential(direction, before.direction, normal, normals);
    mat2x3 change = before.direction - 2.0 * (dot(direction, normal) * normals + outerProduct(normal, cosines));
    return Differentials(before.position, Bounded(change));
}

// `normal` is on the side that the ray comes from, `wt` the direction that it is refracted to, `eta` the index there over the one beyond.
Differentials Refracted(Differentials before, vec3 direction, vec3 normal, mat2x3 normals, vec3 wt, float eta)
{
    vec2 cosines = CosineDifferential(direction, before.direction, normal, normals);
    float cosI = dot(direction, normal);
    float cosT = AwayFromZero(dot(wt, normal));
    float along = eta * cosI - cosT;
    mat2x3 change = eta * before.direction - along * normals - outerProduct(normal, (eta - eta * eta * cosI / cosT) * cosines);
    return Differentials(before.position, Bounded(change));
}

#endif
