// Trace() without help of the device: two levels of compressed wide nodes, src/passes/bvh.rs. Ylitie, Karras & Laine,
// "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017.
//
// A node has up to eight children; their boxes are bytes on a grid of its own. The upper level's leaves are
// instances: there the ray is turned into the instance's space and goes on at the root of its mesh.
#ifndef TRACE_SOFTWARE_GLSL
#define TRACE_SOFTWARE_GLSL

#include "triangle.glsl"

layout(std430, set = 0, binding = 9) readonly buffer NodeBuffer { uvec4 nodes[]; };  // five a node

// Groups that wait. One a level at most, and one more for each level of the upper hierarchy; the host refuses deeper
// ones.
const int TRACE_STACK = 48;

// A ray as the boxes of nodes meet it.
struct BoxRay {
    vec3 origin;
    vec3 inverse;   // 1 / direction
    uint octant;    // in each byte: which children come first
};

BoxRay BoxRayOf(vec3 origin, vec3 direction)
{
    // A direction along a face of a box: 0 times infinity would be no number.
    vec3 safe = mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    uint octant = (direction.x < 0.0 ? 0u : 0x04040404u) | (direction.y < 0.0 ? 0u : 0x02020202u) | (direction.z < 0.0 ? 0u : 0x01010101u);
    return BoxRay(origin, 1.0 / safe, octant);
}

// Which children's boxes the ray meets before `limit`: a bit each, inner nodes in the upper byte in the order of the
// way, the triangles of leaves below.
uint MeetChildren(uint node, BoxRay ray, float limit, out uvec2 groups, out uint inner)
{
    uvec4 head = nodes[5 * node];
    uvec4 middle = nodes[5 * node + 1];
    uvec4 x = nodes[5 * node + 2];
    uvec4 y = nodes[5 * node + 3];
    uvec4 z = nodes[5 * node + 4];
    groups = middle.xy;
    inner = head.w >> 24;

    vec3 step = uintBitsToFloat((uvec3(head.w) >> uvec3(0, 8, 16) & 0xffu) << 23) * ray.inverse;
    vec3 corner = (uintBitsToFloat(head.xyz) - ray.origin) * ray.inverse;
    // What rounding can lose, of the boxes too, is given to both sides.
    vec3 slack = 5e-7 * (abs(corner) + 255.0 * abs(step));
    vec3 near = corner - slack;
    vec3 far = corner + slack;
    bvec3 turned = lessThan(ray.inverse, vec3(0.0));

    uint met = 0;
    for (int side = 0; side < 2; ++side) {
        uint meta = side == 0 ? middle.z : middle.w;
        uint isInner = (meta & (meta << 1)) & 0x10101010u;
        uint innerMask = ((isInner >> 4) & 0x01010101u) * 0xffu;
        uint index = (meta ^ (ray.octant & innerMask)) & 0x1f1f1f1fu;
        uint bits = (meta >> 5) & 0x07070707u;
        uvec3 low = side == 0 ? uvec3(x.x, y.x, z.x) : uvec3(x.y, y.y, z.y);
        uvec3 high = side == 0 ? uvec3(x.z, y.z, z.z) : uvec3(x.w, y.w, z.w);
        uvec3 first = mix(low, high, turned);
        uvec3 last = mix(high, low, turned);
        for (int shift = 0; shift < 32; shift += 8) {
            // Numbers from 0 on have the order of their bits, and those below stay below: integers are compared in one
            // instruction, where a CPU takes several for floats, one of which may be no number.
            ivec3 enter = floatBitsToInt(fma(vec3(first >> shift & 0xffu), step, near));
            ivec3 leave = floatBitsToInt(fma(vec3(last >> shift & 0xffu), step, far));
            int from = max(max(enter.x, enter.y), max(enter.z, 0));
            int to = min(min(leave.x, leave.y), min(leave.z, floatBitsToInt(limit)));
            if (from <= to) met |= (bits >> shift & 0xffu) << (index >> shift & 0xffu);
        }
    }
    return met;
}

// The first node of `group` that is left: its number; the group loses it.
uint TakeNode(inout uvec2 group, uint octant)
{
    int bit = findMSB(group.y);
    group.y &= ~(1u << bit);
    uint slot = uint(bit - 24) ^ (octant & 0xffu);
    return group.x + uint(bitCount(group.y & ~(0xffffffffu << slot) & 0xffu));
}

// Groups are pairs: a first number, and a bit for each of them that is left; nodes of one level have theirs in the
// upper byte, and in the lowest which children are inner nodes.
const uvec2 NOTHING = uvec2(0);
const uvec2 ROOT = uvec2(0, 0x80000000u);
const uint ANY_NODE = 0xff000000u;

// A ray in the space of an instance, at the root of its mesh.
struct Entry {
    BoxRay ray;
    ShearedRay sheared;
    uint firstNode;
    uint firstTriangle;
};

Entry EntryOf(uint instance, vec3 origin, vec3 direction)
{
    mat4x3 toObject = instances[instance].worldToObject;
    vec3 localOrigin = toObject * vec4(origin, 1.0);
    vec3 localDirection = mat3(toObject) * direction;
    return Entry(BoxRayOf(localOrigin, localDirection), ShearRay(localOrigin, localDirection), instances[instance].firstNode,
        instances[instance].firstTriangle);
}

bool Trace(vec3 origin, vec3 direction, Found left, out Found found)
{
    uvec2 stack[TRACE_STACK];
    int top = 0;
    int ground = -1;  // height of the stack where the instance was entered; below 0: on the upper level
    uvec2 group = ROOT;
    uvec2 leaves = NOTHING;
    uint instance = 0;
    Entry entry = Entry(BoxRayOf(origin, direction), ShearRay(origin, direction), 0, 0);
    if (instances.length() == 1) {
        // There is nothing to choose on the upper level.
        entry = EntryOf(0, origin, direction);
        ground = 0;
    }
    float nearest = LARGEST_FLOAT;
    bool any = false;

    for (;;) {
        if ((group.y & ANY_NODE) != 0) {
            uint node = entry.firstNode + TakeNode(group, entry.ray.octant);
            if ((group.y & ANY_NODE) != 0) stack[top++] = group;
            uvec2 groups;
            uint inner;
            uint met = MeetChildren(node, entry.ray, nearest, groups, inner);
            group = uvec2(groups.x, (met & ANY_NODE) | inner);
            leaves = uvec2(groups.y, met & ~ANY_NODE);
        }
        while (leaves.y != 0) {
            int bit = findMSB(leaves.y);
            leaves.y &= ~(1u << bit);
            uint number = leaves.x + uint(bit);
            if (ground < 0) {
                if (leaves.y != 0) stack[top++] = leaves;
                if ((group.y & ANY_NODE) != 0) stack[top++] = group;
                ground = top;
                instance = number;
                entry = EntryOf(instance, origin, direction);
                group = ROOT;
                leaves = NOTHING;
                break;
            }
            if (number == left.triangle && instance == left.instance) continue;
            uint triangle = entry.firstTriangle + number;
            Meeting meeting;
            if (MeetTriangle(entry.sheared, FetchCorner(triangle, 0), FetchCorner(triangle, 1), FetchCorner(triangle, 2), meeting)
                && meeting.t < nearest) {
                nearest = meeting.t;
                found = Found(instance, number);
                any = true;
            }
        }
        if ((group.y & ANY_NODE) != 0) continue;
        if (top == ground) {
            ground = -1;
            entry.firstNode = 0;
            entry.ray = BoxRayOf(origin, direction);
        }
        if (top == 0) break;
        uvec2 next = stack[--top];
        bool nodes = (next.y & ANY_NODE) != 0;
        group = nodes ? next : NOTHING;
        leaves = nodes ? NOTHING : next;
    }
    return any;
}

#endif
