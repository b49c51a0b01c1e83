// Which bodies a ray is in. Where several overlap the one of the highest rank is there: Schmidt & Budge, "Simple Nested
// Dielectrics in Ray Traced Images", JGT 2002. src/scene/containment.rs ranks them.
#ifndef MEDIA_GLSL
#define MEDIA_GLSL

#include "effects.glsl"
#include "medium.glsl"
#include "shared.glsl"
#include "trace.glsl"

// Nanometres, where no wavelength is told from the others.
const float D_LINE = 587.6;

// Up to eight ranks of 16 bits, the highest first, 0 for none. A body that a ray entered twice is there twice.
struct Bodies {
    uvec4 ranks;
};

const int MOST_BODIES = 8;

// Boundaries that scatter nothing, as those between equal indices, that a ray passes in a row.
const uint MOST_PASSED = 4096;

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

// The material of the body of the highest rank, from 1; 0: none.
uint MediumOf(Bodies bodies)
{
    uint rank = HighestRank(bodies);
    return rank == 0 ? 0 : rankedMaterials[rank] + 1;
}

// The index of a material, from 1, at a wavelength; 1 of none. Sets `disperses` where other wavelengths have another.
float IndexOf(uint medium, float wavelength, inout bool disperses)
{
    if (medium == 0) return 1.0;
    float index = materials[medium - 1].refractionIndex;
    float dispersion = DISPERSION ? materials[medium - 1].dispersion : 0.0;
    if (dispersion == 0.0) return index;
    disperses = true;
    if (dispersion > 0.0) return DispersedIndex(index, dispersion, wavelength);
    return SellmeierIndex(materials[medium - 1].sellmeierStrengths, materials[medium - 1].sellmeierResonances, wavelength);
}

// Where a ray is.
struct Whereabouts {
    uint medium;    // the material around it, from 1; 0: none
    Bodies bodies;  // that it is in, where they can overlap
};

// The boundary of a body: where a ray that arrives is, and where one that goes on.
struct Boundary {
    Whereabouts before;
    Whereabouts beyond;
};

Boundary BoundaryOf(uint instance, bool behind, Whereabouts ray)
{
    uint own = instances[instance].material + 1;
    if (!NESTING) return Boundary(Whereabouts(behind ? own : 0, ray.bodies), Whereabouts(behind ? 0 : own, ray.bodies));
    uint rank = instances[instance].rank;
    Bodies before = ray.bodies;
    // What is seen from the inside was entered, also where that was missed.
    if (behind && !IsIn(before, rank)) before = Entered(before, rank);
    // What is seen from the outside was left, unless the mesh holds it twice.
    if (!behind && instances[instance].overlaps == 0 && IsIn(before, rank)) before = Left(before, rank);
    Bodies beyond;
    if (behind) beyond = Left(before, rank); else beyond = Entered(before, rank);
    return Boundary(Whereabouts(MediumOf(before), before), Whereabouts(MediumOf(beyond), beyond));
}

// What a ray meets: on which side of it there is which index.
struct Crossing {
    Boundary boundary;
    float etaI;
    float etaT;
    bool isOpaque;
    bool isPane;
    bool passes;    // nothing is there to see
};

Crossing CrossingOf(Found found, Material material, bool behind, Whereabouts ray, float wavelength, inout bool disperses)
{
    Crossing crossing;
    crossing.isPane = THIN_WALLED && material.kind == KIND_PANE;
    crossing.isOpaque = OPAQUE && material.kind == KIND_OPAQUE;
    crossing.boundary = Boundary(ray, ray);
    if (!crossing.isOpaque && !crossing.isPane) crossing.boundary = BoundaryOf(found.instance, behind, ray);
    crossing.etaI = IndexOf(crossing.boundary.before.medium, wavelength, disperses);
    crossing.etaT = crossing.etaI;
    if (crossing.isPane) crossing.etaT = material.refractionIndex;
    else if (!crossing.isOpaque) crossing.etaT = IndexOf(crossing.boundary.beyond.medium, wavelength, disperses);
    crossing.passes = !crossing.isOpaque && crossing.etaI == crossing.etaT;
    return crossing;
}

// What the medium around a ray leaves of its light.
vec3 Absorbed(uint medium, float distance)
{
    if (!ABSORPTION || medium == 0) return vec3(1.0);
    return Transmittance(materials[medium - 1].absorption, distance);
}

#endif
