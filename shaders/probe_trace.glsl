// What rays meet, one an invocation: for tests that know it, and for measurements of Trace(). src/passes/probe.rs.
#ifndef PROBE_TRACE_GLSL
#define PROBE_TRACE_GLSL

#include "trace.glsl"
#include "arrival.glsl"

// Constants of single shaders start at 128. False leaves only Trace() itself to be timed; then `object` and
// `triangle` are known.
layout(constant_id = 128) const bool ARRIVES = true;

// Both in the device's space.
struct ProbeRay {
    float origin[3];
    float direction[3];  // of unit length
};

struct ProbeHit {
    uint object;         // its number in the scene file, from 1; 0: nothing is met
    uint triangle;       // of its mesh, in the order of the device
    uint behind;         // 1: seen from the inside
    float distance;
    float position[3];
    float normal[3];     // of the face, towards the outside
    float shading[3];    // the same, interpolated where the object is smooth
    uint instance;
};

layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 11) readonly buffer RayBuffer { ProbeRay rays[]; };
layout(std430, set = 0, binding = 12) writeonly buffer HitBuffer { ProbeHit hits[]; };

void main()
{
    uint index = gl_GlobalInvocationID.x;
    if (index >= rays.length()) return;
    vec3 origin = vec3(rays[index].origin[0], rays[index].origin[1], rays[index].origin[2]);
    vec3 direction = vec3(rays[index].direction[0], rays[index].direction[1], rays[index].direction[2]);
    Found found;
    bool any = Trace(origin, direction, NOWHERE, found);
    hits[index].object = any ? instances[found.instance].number : 0;
    if (!any) return;
    hits[index].triangle = found.triangle;
    if (!ARRIVES) return;
    Arrival arrival = ArriveAt(found, origin, direction);
    hits[index].behind = uint(arrival.behind);
    hits[index].distance = arrival.distance;
    for (int i = 0; i < 3; ++i) {
        hits[index].position[i] = arrival.position[i];
        hits[index].normal[i] = arrival.faceNormal[i];
        hits[index].shading[i] = arrival.normal[i];
    }
    hits[index].instance = found.instance;
}

#endif
