// Rays that stay inside of closed bodies, reflected from wall to wall: whatever leaves has found a leak.
// src/passes/probe.rs.
//
// Reflections are what the tree makes of them, about interpolated normals too, and take turns with directions drawn
// at random, some of which hug the wall.
#ifndef PROBE_CHAIN_GLSL
#define PROBE_CHAIN_GLSL

#include "trace.glsl"
#include "arrival.glsl"
#include "sampling.glsl"

// Constants of single shaders start at 128. Rays that a dispatch adds to each chain.
layout(constant_id = 128) const uint SEGMENTS = 32;

// In the device's space; a dispatch goes on where the one before ended.
struct Chain {
    float start[3];      // inside
    uint misses;         // rays that met nothing
    float origin[3];     // of the next ray
    uint wrongSides;     // rays that met a surface from the outside
    float direction[3];  // of the next ray
    uint rays;           // so far
    float lostOrigin[3];     // the last ray that missed or was on the wrong side
    float lostDirection[3];
};

layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 11) buffer ChainBuffer { Chain chains[]; };

// Evenly over the half of the sphere around `n`; one in four within a thousandth of its rim.
vec3 DirectionInto(vec3 n, uvec3 random)
{
    float z = UnitFloat(random.x);
    if ((random.z & 3u) == 0) z *= 1e-3;
    vec3 local = vec3(sqrt(1.0 - z * z) * CosSinTurns(UnitFloat(random.y)), z);
    return DirectionAbove(normalize(BasisAround(n) * local), n);
}

void main()
{
    uint index = gl_GlobalInvocationID.x;
    if (index >= chains.length()) return;
    vec3 start = vec3(chains[index].start[0], chains[index].start[1], chains[index].start[2]);
    vec3 origin = vec3(chains[index].origin[0], chains[index].origin[1], chains[index].origin[2]);
    vec3 direction = vec3(chains[index].direction[0], chains[index].direction[1], chains[index].direction[2]);
    uint before = chains[index].rays;
    uint misses = 0;
    uint wrongSides = 0;
    Found left = NOWHERE;
    for (uint segment = 0; segment < SEGMENTS; ++segment) {
        uvec3 random = Pcg3d(uvec3(index, before + segment, 0));
        Found found;
        bool isInside = false;
        vec3 from = origin;
        vec3 towards = direction;
        if (Trace(origin, direction, left, found)) {
            Arrival arrival = ArriveAt(found, origin, direction);
            isInside = arrival.behind;
            if (!isInside) ++wrongSides;
            vec3 wi = -direction;
            vec3 normal = NormalTowards(-arrival.normal, wi);
            bool isMirror = ((before + segment) & 1u) == 0;
            direction = isMirror
                ? DirectionAbove(normalize(2.0 * dot(wi, normal) * normal - wi), -arrival.faceNormal)
                : DirectionInto(-arrival.faceNormal, random);
            origin = LeaveFrom(arrival, direction);
            left = found;
        } else {
            ++misses;
        }
        if (!isInside) {
            left = NOWHERE;
            for (int i = 0; i < 3; ++i) {
                chains[index].lostOrigin[i] = from[i];
                chains[index].lostDirection[i] = towards[i];
            }
            // Back in, somewhere else.
            origin = start;
            direction = DirectionInto(vec3(0.0, (random.z & 4u) == 0 ? 1.0 : -1.0, 0.0), random);
        }
    }
    chains[index].misses += misses;
    chains[index].wrongSides += wrongSides;
    chains[index].rays = before + SEGMENTS;
    for (int i = 0; i < 3; ++i) {
        chains[index].origin[i] = origin[i];
        chains[index].direction[i] = direction[i];
    }
}

#endif
