// The nearest surface on a ray's way: one interface, two ways to get there. A file that defines TRACE_HARDWARE before its includes
// gets the device's ray queries, else a traversal written here. Both only say which triangle it is; where on it the
// ray arrives, surface.glsl computes for both, so that both give the same picture.
//
//     bool Trace(vec3 origin, vec3 direction, Found left, out Found found)
//
// Space is the device's, see shared.glsl. What lies before the origin or on it is not found: rays that leave a surface start
// beside it, see offset.glsl. On a triangle that is much longer than wide that step is less than what rounding does to the distance along
// the ray: so a ray never meets the triangle that it has left, `left`.
#ifndef TRACE_GLSL
#define TRACE_GLSL

#include "constants.glsl"
#include "shared.glsl"

struct Found {
    uint instance;
    uint triangle;  // of the instance's mesh
};

// What a ray has left that starts anywhere else.
const Found NOWHERE = Found(0xffffffffu, 0u);

layout(std430, set = 0, binding = 10) readonly buffer CornerBuffer { vec4 corners[]; };

// Corner 0, 1 or 2 of a triangle, counted through all meshes, in its mesh's space.
vec3 FetchCorner(uint triangle, uint corner)
{
    return corners[3 * triangle + corner].xyz;
}

#ifdef TRACE_HARDWARE
#include "trace_hardware.glsl"
#else
#include "trace_software.glsl"
#endif

#endif
