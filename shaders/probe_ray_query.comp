#version 460
// Traces rays through an acceleration structure and says what they meet, so that a test can compare it with what it
// knows.
#extension GL_EXT_ray_query : require

const uint MISS = 0xffffffffu;

struct Ray
{
    float origin[3];
    float direction[3]; // of any length, the unit of distances
};

struct Hit
{
    uint instance; // its custom index, or MISS, and then the rest is 0
    uint triangle; // within its mesh
    float distance;
    uint front; // 1 where its corners run counter-clockwise
};

layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;
layout(std430, set = 0, binding = 1) readonly buffer RayBuffer { Ray rays[]; };
layout(std430, set = 0, binding = 2) writeonly buffer HitBuffer { Hit hits[]; };

vec3 Vector(float v[3]) { return vec3(v[0], v[1], v[2]); }

void main()
{
    uint index = gl_GlobalInvocationID.x;
    if (index >= rays.length()) return;
    Ray ray = rays[index];
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsNoneEXT, 0xff, Vector(ray.origin), 0, Vector(ray.direction), 1e30);
    while (rayQueryProceedEXT(query)) {
        // Everything is opaque: nothing waits to be confirmed.
    }
    Hit hit = Hit(MISS, 0, 0, 0);
    if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT) {
        hit.instance = rayQueryGetIntersectionInstanceCustomIndexEXT(query, true);
        hit.triangle = rayQueryGetIntersectionPrimitiveIndexEXT(query, true);
        hit.distance = rayQueryGetIntersectionTEXT(query, true);
        hit.front = uint(rayQueryGetIntersectionFrontFaceEXT(query, true));
    }
    hits[index] = hit;
}
