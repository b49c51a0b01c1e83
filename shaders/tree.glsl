// The whole tree of reflections and refractions of a camera ray at smooth interfaces: enumerated, nothing random in it.
//
// A branch is a ray with the share of light that it stands for, its throughput. At an interface it goes on as the smaller of
// its two children and the larger waits: the smaller has at most half the throughput, so few ever wait. What is too faint
// is cut off, filled with the environment in its direction, and counted. Radiance in a medium is scaled by the square of
// its index; that scale is the camera's and the environment's alone, and stays out of the tree.
#ifndef TREE_GLSL
#define TREE_GLSL

#include "trace.glsl"
#include "arrival.glsl"
#include "camera.glsl"
#include "effects.glsl"
#include "environment.glsl"
#include "fresnel.glsl"
#include "media.glsl"
#include "medium.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 14, rgba32f) uniform image2D mean;    // radiance, and throughput cut off
layout(set = 0, binding = 15, rgba32f) uniform image2D counts;  // interfaces, rays

struct Branch {
    vec3 origin;
    vec3 direction;
    vec3 throughput;
    uint depth;     // interfaces behind it
    uint medium;    // the material around it, from 1; 0: none
    Bodies bodies;
};

// Branches that wait. Each has at least twice the throughput of the next.
const int TREE_STACK = 16;

// A tree that cut off more than it may is followed once more with a cut-off so many times smaller, down to what no image shows.
const float CUTOFF_STEP = 8.0;
const float LEAST_CUTOFF = 1e-9;

// Nanometres, where no wavelength is told from the others.
const float D_LINE = 587.6;

// Boundaries that scatter nothing, as those between equal indices, that a ray passes in a row.
const uint MOST_PASSED = 4096;

float Largest(vec3 v) { return max(max(v.x, v.y), v.z); }

// What a pixel gathers.
struct Gathered {
    vec3 radiance;
    float discarded;
    float faint;       // the share of that which was cut off for its throughput
    uint interfaces;
    uint rays;
    bool dispersed;    // an index met on the way depends on the wavelength
};

vec3 EnvironmentTowards(vec3 direction) { return SampleEnvironment(direction, 0.0); }

// Counts what is cut off. In the place of what it would have found stands the environment in its direction; a constant
// environment is a furnace, which shows what is lost only if nothing replaces it.
void Discard(inout Gathered gathered, vec3 throughput, vec3 direction)
{
    gathered.discarded += Largest(throughput);
    if (ENVIRONMENT_IMAGE) gathered.radiance += throughput * EnvironmentTowards(direction);
}

// Whether a child is too faint to be followed; then it is cut off.
bool Cut(inout Gathered gathered, float cutoff, vec3 throughput, vec3 direction)
{
    float size = Largest(throughput);
    if (size == 0.0) return true;
    if (size > cutoff) return false;
    gathered.faint += size;
    Discard(gathered, throughput, direction);
    return true;
}

// The index of a material, from 1, at a wavelength; 1 of none.
float IndexOf(uint medium, float wavelength, inout bool dispersed)
{
    if (medium == 0) return 1.0;
    Material material = materials[medium - 1];
    if (!DISPERSION || material.dispersion == 0.0) return material.refractionIndex;
    dispersed = true;
    if (material.dispersion < 0.0) return SellmeierIndex(material.sellmeierStrengths, material.sellmeierResonances, wavelength);
    return DispersedIndex(material.refractionIndex, material.dispersion, wavelength);
}

// The material of the body of the highest rank, from 1; 0: none.
uint MediumOf(Bodies bodies)
{
    uint rank = HighestRank(bodies);
    return rank == 0 ? 0 : rankedMaterials[rank] + 1;
}

// One interface, as a branch meets it.
struct Crossing {
    uint before;
    uint beyond;
    Bodies bodiesBeyond;
};

Crossing CrossingAt(inout Branch branch, Found found, bool behind)
{
    uint own = instances[found.instance].material + 1;
    if (!NESTING) return Crossing(behind ? own : 0, behind ? 0 : own, branch.bodies);
    uint rank = instances[found.instance].rank;
    // What is seen from the inside was entered, also where that was missed.
    if (behind && !IsIn(branch.bodies, rank)) branch.bodies = Entered(branch.bodies, rank);
    Bodies beyond;
    if (behind) beyond = Left(branch.bodies, rank); else beyond = Entered(branch.bodies, rank);
    return Crossing(MediumOf(branch.bodies), MediumOf(beyond), beyond);
}

Branch CameraBranch(vec2 pixel)
{
    Branch branch;
    branch.origin = vec3(0.0);
    branch.direction = normalize(CameraRay(pixel));
    branch.throughput = vec3(1.0);
    branch.depth = 0;
    branch.medium = frame.cameraMedium;
    branch.bodies = Bodies(frame.cameraBodies);
    return branch;
}

// Gathers what the branch and everything that grows from it bring, at one wavelength; no more than `tolerance` of it is cut off for
// being faint.
void FollowTree(inout Gathered gathered, const Branch root, float wavelength, float tolerance)
{
    Branch branch = root;
    Branch waiting[TREE_STACK];
    int top = 0;
    uint passed = 0;
    float cutoff = frame.cutoff;
    for (;;) {
        Found found;
        bool any = Trace(branch.origin, branch.direction, found);
        ++gathered.rays;
        bool goesOn = false;
        if (!any) {
            bool seen = frame.environmentVisible != 0 || branch.depth > 0;
            if (seen) gathered.radiance += branch.throughput * EnvironmentTowards(branch.direction);
        } else {
            Arrival arrival = ArriveAt(found, branch.origin, branch.direction);
            Material material = materials[instances[found.instance].material];
            bool isPane = THIN_WALLED && material.kind == KIND_PANE;
            bool isOpaque = OPAQUE && material.kind == KIND_OPAQUE;
            Crossing crossing = Crossing(branch.medium, branch.medium, branch.bodies);
            if (!isOpaque && !isPane) crossing = CrossingAt(branch, found, arrival.behind);
            if (ABSORPTION && crossing.before != 0) {
                branch.throughput *= Transmittance(materials[crossing.before - 1].absorption, arrival.distance);
            }
            float etaI = IndexOf(crossing.before, wavelength, gathered.dispersed);
            float etaT = isPane ? material.refractionIndex : IndexOf(crossing.beyond, wavelength, gathered.dispersed);

            vec3 wi = -branch.direction;
            if (isOpaque) {
                gathered.radiance += branch.throughput * material.emission;
            } else if (etaI == etaT) {
                // Nothing is there to see.
                branch.medium = crossing.beyond;
                branch.bodies = crossing.bodiesBeyond;
                branch.origin = LeaveFrom(arrival, branch.direction);
                goesOn = ++passed <= MOST_PASSED;
                if (!goesOn) Discard(gathered, branch.throughput, branch.direction);
            } else if (branch.depth >= frame.maxDepth) {
                Discard(gathered, branch.throughput, branch.direction);
            } else {
                ++gathered.interfaces;
                passed = 0;
                vec3 faceNormal = arrival.behind ? -arrival.faceNormal : arrival.faceNormal;
                vec3 normal = NormalTowards(arrival.behind ? -arrival.normal : arrival.normal, wi);
                Refraction refraction = Refract(wi, normal, etaI, etaT);
                float reflectance = refraction.crossed.reflectance;
                float transmittance = refraction.crossed.transmittance;
                vec3 wt = refraction.wt;
                if (isPane) {
                    // Both interfaces, and everything between them, summed; what gets through goes straight on.
                    reflectance = 2.0 * reflectance / (1.0 + reflectance);
                    transmittance = refraction.crossed.total ? 0.0 : transmittance / (1.0 + refraction.crossed.reflectance);
                    wt = branch.direction;
                } else if (!refraction.crossed.total) {
                    wt = DirectionAbove(normalize(wt), -faceNormal);
                }
                vec3 wr = DirectionAbove(normalize(2.0 * dot(wi, normal) * normal - wi), faceNormal);

                Branch reflected = branch;
                reflected.origin = LeaveFrom(arrival, wr);
                reflected.direction = wr;
                reflected.throughput *= REFLECTION ? reflectance : 0.0;
                reflected.depth = branch.depth + 1;
                Branch refracted = branch;
                refracted.origin = LeaveFrom(arrival, wt);
                refracted.direction = wt;
                refracted.throughput *= TRANSMISSION ? transmittance : 0.0;
                refracted.depth = branch.depth + 1;
                refracted.medium = crossing.beyond;
                refracted.bodies = crossing.bodiesBeyond;

                if (!INTERIOR) {
                    // The environment is all that lies beyond.
                    gathered.radiance += reflected.throughput * EnvironmentTowards(wr) + refracted.throughput * EnvironmentTowards(wt);
                    reflected.throughput = refracted.throughput = vec3(0.0);
                }
                bool followsReflected = !Cut(gathered, cutoff, reflected.throughput, reflected.direction);
                bool followsRefracted = !Cut(gathered, cutoff, refracted.throughput, refracted.direction);
                bool reflectedIsLarger = Largest(reflected.throughput) > Largest(refracted.throughput);
                if (followsReflected && followsRefracted) {
                    if (top < TREE_STACK) {
                        if (reflectedIsLarger) waiting[top] = reflected; else waiting[top] = refracted;
                        ++top;
                        if (reflectedIsLarger) branch = refracted; else branch = reflected;
                    } else {
                        if (reflectedIsLarger) Discard(gathered, refracted.throughput, refracted.direction);
                        else Discard(gathered, reflected.throughput, reflected.direction);
                        if (reflectedIsLarger) branch = reflected; else branch = refracted;
                    }
                    goesOn = true;
                } else if (followsReflected || followsRefracted) {
                    if (followsReflected) branch = reflected; else branch = refracted;
                    goesOn = true;
                }
            }
        }
        if (goesOn) continue;
        passed = 0;
        if (gathered.faint > tolerance && cutoff > LEAST_CUTOFF) {
            cutoff /= CUTOFF_STEP;
            gathered.radiance = vec3(0.0);
            gathered.discarded = gathered.faint = 0.0;
            branch = root;
            top = 0;
            continue;
        }
        if (top == 0) break;
        branch = waiting[--top];
    }
}

void main()
{
    uvec2 pixel = uvec2(gl_GlobalInvocationID.x, gl_GlobalInvocationID.y + firstRow);
    if (any(greaterThanEqual(pixel, uvec2(imageSize(mean))))) return;
    Branch camera = CameraBranch(vec2(pixel) + 0.5 + jitter);
    Gathered gathered = Gathered(vec3(0.0), 0.0, 0.0, 0, 0, false);
    if (!DISPERSION) {
        FollowTree(gathered, camera, D_LINE, frame.tolerance);
    } else {
        // Each wavelength has a tree of its own, up to the first one that no index tells from the others.
        vec3 radiance = vec3(0.0);
        vec3 discarded = vec3(0.0);
        vec3 shares = vec3(0.0);
        for (uint i = 0; i < wavelengths; ++i) shares += max(spectrum[i].rgb, 0.0);
        for (uint i = 0; i < wavelengths; ++i) {
            gathered.radiance = vec3(0.0);
            gathered.discarded = gathered.faint = 0.0;
            FollowTree(gathered, camera, spectrum[i].w, frame.tolerance / Largest(shares));
            vec3 weight = gathered.dispersed ? spectrum[i].rgb : vec3(1.0);
            radiance += weight * gathered.radiance;
            discarded += weight * gathered.discarded;
            if (!gathered.dispersed) break;
        }
        gathered.radiance = radiance;
        gathered.discarded = Largest(discarded);
    }

    float scale = frame.cameraIndex * frame.cameraIndex;
    vec4 value = scale * vec4(gathered.radiance, gathered.discarded);
    vec4 count = vec4(float(gathered.interfaces), float(gathered.rays), 0.0, 0.0);
    ivec2 place = ivec2(pixel);
    if (sampleIndex != 0) {
        // A mean, not a sum, as in accumulate.comp.
        vec4 before = imageLoad(mean, place);
        value = before + (value - before) / float(sampleIndex + 1);
        before = imageLoad(counts, place);
        count = before + (count - before) / float(sampleIndex + 1);
    }
    imageStore(mean, place, value);
    imageStore(counts, place, count);
}

#endif
