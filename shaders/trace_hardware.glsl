// Trace() by the device's ray queries.
#ifndef TRACE_HARDWARE_GLSL
#define TRACE_HARDWARE_GLSL

#include "triangle.glsl"

#extension GL_EXT_ray_query : require

layout(set = 0, binding = 9) uniform accelerationStructureEXT scene;

// Triangles behind the origin that a device may take for ones ahead: the one that the ray left, and its neighbours.
const int MOST_BEHIND = 4;

// Whether what the device found at `t` lies ahead.
bool IsAhead(Found found, vec3 origin, vec3 direction, float t)
{
    mat4x3 toObject = instances[found.instance].worldToObject;
    uint triangle = instances[found.instance].firstTriangle + found.triangle;
    vec3 local = toObject * vec4(origin, 1.0);
    vec3 a = FetchCorner(triangle, 0) - local;
    vec3 b = FetchCorner(triangle, 1) - local;
    vec3 c = FetchCorner(triangle, 2) - local;
    vec3 towards = mat3(toObject) * direction;
    vec3 reach = max(max(abs(a), abs(b)), abs(c));
    if (t * length(towards) > DOUBT * (reach.x + reach.y + reach.z)) return true;
    return IsPlaneAhead(towards, a, b, c);
}

bool Trace(vec3 origin, vec3 direction, Found left, out Found found)
{
    float start = 0.0;
    for (int i = 0; i < MOST_BEHIND; ++i) {
        rayQueryEXT query;
        rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xff, origin, start, direction, LARGEST_FLOAT);
        while (rayQueryProceedEXT(query)) {}
        if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT) return false;
        found.instance = rayQueryGetIntersectionInstanceCustomIndexEXT(query, true);
        found.triangle = rayQueryGetIntersectionPrimitiveIndexEXT(query, true);
        float t = rayQueryGetIntersectionTEXT(query, true);
        if (found != left && IsAhead(found, origin, direction, t)) return true;
        // The next number, or nearly, that no device takes for zero.
        start = max(t * 1.000001, 1.2e-38);
    }
    return false;
}

#endif
