// The point of a triangle that a ray meets. Where the rasteriser only says which triangle covers a pixel, position and
// normal come from here, so that a picture does not depend on how finely a device snaps and interpolates.
#ifndef SURFACE_GLSL
#define SURFACE_GLSL

#include "shared.glsl"

struct Hit {
    float t;        // in lengths of the ray's direction
    vec3 position;
    vec3 normal;    // of unit length, towards the outside of the surface; interpolated where the object is smooth
    bool behind;    // the triangle is seen from the inside
    vec3 weights;   // of the triangle's corners
};

vec3 FetchPosition(uint vertex)
{
    return vec3(positions[3 * vertex], positions[3 * vertex + 1], positions[3 * vertex + 2]);
}

vec3 FetchNormal(uint vertex)
{
    return vec3(normals[3 * vertex], normals[3 * vertex + 1], normals[3 * vertex + 2]);
}

uvec3 FetchTriangle(Instance instance, uint triangle)
{
    uint first = 3 * (instance.firstTriangle + triangle);
    return instance.firstVertex + uvec3(triangles[first], triangles[first + 1], triangles[first + 2]);
}

// The normal in the world, at the weights b1 and b2 of the second and the third corner; `normal` is that of the face in the mesh's space.
vec3 NormalAt(Instance instance, uvec3 vertices, vec3 normal, float b1, float b2)
{
    if (instance.smoothNormals != 0) {
        vec3 first = FetchNormal(vertices.x);
        normal = normalize(first + b1 * (FetchNormal(vertices.y) - first) + b2 * (FetchNormal(vertices.z) - first));
    }
    return normalize(mat3(instance.normalToWorld) * normal);
}

// Where the camera's ray along `direction` meets the plane of `triangle`: Moeller & Trumbore 1997, in the mesh's space.
Hit IntersectCameraRay(Instance instance, uint triangle, vec3 direction)
{
    uvec3 vertices = FetchTriangle(instance, triangle);
    vec3 corner = FetchPosition(vertices.x);
    vec3 edge1 = FetchPosition(vertices.y) - corner;
    vec3 edge2 = FetchPosition(vertices.z) - corner;
    vec3 ray = mat3(instance.worldToObject) * direction;

    vec3 p = cross(ray, edge2);
    vec3 fromCorner = instance.worldToObject[3] - corner; // the camera is at the origin
    vec3 q = cross(fromCorner, edge1);
    float determinant = dot(edge1, p);
    float inverse = abs(determinant) > 1e-30 ? 1.0 / determinant : 0.0; // seen exactly on edge

    Hit hit;
    hit.t = dot(edge2, q) * inverse;
    hit.position = hit.t * direction;
    hit.behind = determinant < 0.0;
    vec3 normal = normalize(cross(edge1, edge2));
    // A pixel's centre may lie just outside of the triangle that the rasteriser chose, where normals go on as they are
    // inside, and far outside of one seen on edge.
    float b1 = clamp(dot(fromCorner, p) * inverse, -1.0, 2.0);
    float b2 = clamp(dot(ray, q) * inverse, -1.0, 2.0);
    hit.weights = vec3(1.0 - b1 - b2, b1, b2);
    hit.normal = NormalAt(instance, vertices, normal, b1, b2);
    return hit;
}

#endif
