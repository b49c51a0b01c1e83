// Trace() by the device's ray queries.
#ifndef TRACE_HARDWARE_GLSL
#define TRACE_HARDWARE_GLSL

#extension GL_EXT_ray_query : require

layout(set = 0, binding = 9) uniform accelerationStructureEXT scene;

bool Trace(vec3 origin, vec3 direction, out Found found)
{
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xff, origin, 0.0, direction, LARGEST_FLOAT);
    while (rayQueryProceedEXT(query)) {}
    if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT) return false;
    found.instance = rayQueryGetIntersectionInstanceCustomIndexEXT(query, true);
    found.triangle = rayQueryGetIntersectionPrimitiveIndexEXT(query, true);
    return true;
}

#endif
