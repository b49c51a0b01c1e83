// Which bodies a ray is in. Where several overlap the one of the highest rank is there: Schmidt & Budge, "Simple Nested
// Dielectrics in Ray Traced Images", JGT 2002. src/scene/containment.rs ranks them.
#ifndef MEDIA_GLSL
#define MEDIA_GLSL

#include "shared.glsl"

// Up to eight ranks of 16 bits, the highest first, 0 for none. A body that a ray entered twice is there twice.
struct Bodies {
    uvec4 ranks;
};

const int MOST_BODIES = 8;

layout(std430, set = 0, binding = 11) readonly buffer RankBuffer { uint rankedMaterials[]; };

uint RankAt(Bodies bodies, int i)
{
    uint pair = bodies.ranks[i / 2];
    return (i & 1) == 0 ? pair >> 16 : pair & 0xffffu;
}

uint HighestRank(Bodies bodies)
{
    return bodies.ranks.x >> 16;
}

// With one body more. Of nine the lowest, which no one sees before the others are left, is forgotten.
Bodies Entered(Bodies bodies, uint rank)
{
    Bodies more;
    for (int i = 0; i < MOST_BODIES; i += 2) {
        uint first = RankAt(bodies, i);
        uint second = RankAt(bodies, i + 1);
        uint high = max(first, rank);
        rank = min(first, rank);
        uint low = max(second, rank);
        rank = min(second, rank);
        more.ranks[i / 2] = high << 16 | low;
    }
    return more;
}

bool IsIn(Bodies bodies, uint rank)
{
    bool found = false;
    for (int i = 0; i < MOST_BODIES; ++i) found = found || RankAt(bodies, i) == rank;
    return found;
}

// With one body less, once.
Bodies Left(Bodies bodies, uint rank)
{
    Bodies less;
    bool gone = false;
    for (int i = 0; i < MOST_BODIES; i += 2) {
        gone = gone || RankAt(bodies, i) == rank;
        uint high = gone ? RankAt(bodies, i + 1) : RankAt(bodies, i);
        gone = gone || RankAt(bodies, i + 1) == rank;
        uint low = !gone ? RankAt(bodies, i + 1) : i + 2 < MOST_BODIES ? RankAt(bodies, i + 2) : 0u;
        less.ranks[i / 2] = high << 16 | low;
    }
    return less;
}

#endif
