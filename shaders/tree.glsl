// The whole tree of reflections and refractions of a camera ray at smooth interfaces: enumerated, nothing random in it.
//
// A branch is a ray with the share of light that it stands for, its throughput. At an interface it goes on as the smaller of
// its two children and the larger waits: the smaller has at most half the throughput, so few ever wait. What is too faint
// is cut off, filled with the environment in its direction, and counted. Radiance in a medium is scaled by the square of
// its index; that scale is the camera's and the environment's alone, and stays out of the tree.
//
// One loop does everything, a ray a turn, and an invocation whose tree has ended goes on with its next pixel: devices that run
// invocations in step wait for no tree, and the tracer is there once.
#ifndef TREE_GLSL
#define TREE_GLSL

#include "trace.glsl"
#include "arrival.glsl"
#include "camera.glsl"
#include "constants.glsl"
#include "effects.glsl"
#include "environment.glsl"
#include "footprint.glsl"
#include "fresnel.glsl"
#include "media.glsl"
#include "opaque.glsl"
#include "pixel.glsl"
#include "records.glsl"
#include "texture.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Pixels in a row of a workgroup's that one invocation takes, one after the other; as in src/passes/tree.rs.
const int PIXELS = 8;

// Branches that wait. Whenever one is added, the one that goes on has at most half its throughput.
const int TREE_STACK = 16;

// A tree that cut off more than it may is followed once more with a cut-off so many times smaller, down to what no image shows.
const float CUTOFF_STEP = 8.0;
const float LEAST_CUTOFF = 1e-9;

// Unless it took more rays than this: light that is guided in a wall and splits at every turn has a tree without end.
const uint MOST_RAYS = 1 << 12;

struct Branch {
    vec3 origin;
    vec3 direction;
    vec3 throughput;
    uint depth;     // interfaces behind it
    Whereabouts at;
    Found left;     // where it starts
    Differentials differentials;
};

Branch Child(Branch parent, Arrival arrival, vec3 direction, Differentials differentials, vec3 share, Whereabouts at)
{
    vec3 origin = LeaveFrom(arrival, direction);
    return Branch(origin, direction, parent.throughput * share, parent.depth + 1, at, arrival.found, differentials);
}

Branch CameraBranch(vec2 pixel)
{
    Whereabouts at = Whereabouts(frame.cameraMedium, Bodies(frame.cameraBodies));
    Differentials differentials = NO_DIFFERENTIALS;
    if (FOOTPRINTS) differentials = CameraDifferentials(pixel, footprint);
    return Branch(vec3(0.0), normalize(CameraRay(pixel)), vec3(1.0), 0, at, NOWHERE, differentials);
}

// What a pixel gathers of one tree.
struct Gathered {
    vec3 radiance;
    float discarded;
    float faint;       // the share of that which was cut off for its throughput
};

// The environment towards a direction that waits to be looked up, as wide as a footprint.
struct Look {
    vec3 throughput;
    vec3 direction;
    mat2x3 sides;
};

// Two at most a turn.
struct Outlook {
    Look next;
    Look other;
    uint count;
};

void LookTowards(inout Outlook outlook, vec3 throughput, vec3 direction, mat2x3 sides)
{
    outlook.other = outlook.next;
    outlook.next = Look(throughput, direction, sides);
    ++outlook.count;
}

// Counts what is cut off. In the place of what it would have found stands the environment in its direction; a constant
// environment is a furnace, which shows what is lost only if nothing replaces it.
void Discard(inout Gathered gathered, inout Outlook outlook, vec3 throughput, vec3 direction, Differentials differentials)
{
    gathered.discarded += Largest(throughput);
    if (ENVIRONMENT_IMAGE) LookTowards(outlook, throughput, direction, differentials.direction);
}

// ---- opaque surfaces -----------------------------------------------------------------------------------------------------------

// What a mirror-like surface mirrors, of each channel; 0 where it is none.
vec3 MirroredShare(Material material, vec3 wi, vec3 normal)
{
    OpaqueSurface surface = OpaqueSurfaceOf(material.baseColor, material.metallic, material.roughness, material.head, material.specular);
    return IsSpecular(surface) && IsMirror(surface) ? FacetReflectance(surface, dot(wi, normal)) : vec3(0.0);
}

// Records of a pixel that wait for their lights, the last one first, from 1; and those of a tree that begins once more.
struct Chain {
    uint head;
    uint spare;
};

// Leaves it to lights.glsl what else an opaque surface, or the share of it that is opaque, does with the light that reaches it.
void Leave(inout Chain chain, inout Gathered gathered, Found found, Branch branch, uint line, Dressed dressed, float share)
{
    uint number = chain.spare;
    if (number != 0) {
        chain.spare = records[number - 1].next;
    } else {
        number = atomicAdd(recordCount, 1) + 1;
        if (number > recordCapacity) {
            gathered.discarded += share * Largest(branch.throughput);
            return;
        }
    }
    vec3 color = dressed.material.baseColor;
    uvec2 packed = uvec2(packUnorm2x16(color.rg), packUnorm2x16(vec2(color.b, dressed.material.metallic)));
    uint normal = packHalf2x16(clamp(dressed.bump.xy / dressed.bump.z, -6e4, 6e4));
    records[number - 1] = Record(branch.origin, chain.head, branch.direction, found.instance, share * branch.throughput, found.triangle,
        branch.at.bodies.ranks, branch.at.medium, line, packed, floatBitsToUint(dressed.material.roughness), normal, uvec2(0));
    chain.head = number;
}

// Gives the records back that were left after `head` was the last one.
void GiveBack(inout Chain chain, uint head)
{
    while (chain.head != head) {
        uint number = chain.head;
        chain.head = records[number - 1].next;
        records[number - 1].next = chain.spare;
        chain.spare = number;
    }
}

// ---- pixels --------------------------------------------------------------------------------------------------------------------

// What the next ray is.
const uint NEXT_PIXEL = 0;   // the camera's of the next pixel
const uint NEXT_TREE = 1;    // the camera's of this one once more
const uint NEXT_BRANCH = 2;  // the branch

void main()
{
    uint next = NEXT_PIXEL;
    int column = -1;
    ivec2 place = ivec2(0);
    uint interfaces = 0;
    uint rays = 0;

    // Trees of the pixel: one for each wavelength, if any index tells them from each other.
    uint line = 0;
    bool disperses = false;
    vec3 radiance = vec3(0.0);
    vec3 discarded = vec3(0.0);
    float scale = frame.cameraIndex * frame.cameraIndex;
    float tolerance = frame.tolerance / scale;
    if (DISPERSION) {
        vec3 shares = vec3(0.0);
        for (uint i = 0; i < wavelengths; ++i) shares += max(spectrum[i].rgb, 0.0);
        tolerance /= Largest(shares);
    }

    // The tree.
    Gathered gathered = Gathered(vec3(0.0), 0.0, 0.0);
    float cutoff = 0.0;
    Branch branch = CameraBranch(vec2(0.0));
    Branch waiting[TREE_STACK];
    int top = 0;
    uint passed = 0;
    Chain chain = Chain(0, 0);
    uint headBefore = 0;        // of the chain when the tree began: there it begins once more
    uint interfacesBefore = 0;
    uint raysBefore = 0;

    for (;;) {
        if (next == NEXT_PIXEL) {
            if (++column == PIXELS) break;
            place = ivec2(firstColumn + 8 * (PIXELS * gl_WorkGroupID.x + column) + gl_LocalInvocationID.x, gl_GlobalInvocationID.y + firstRow);
            if (any(greaterThanEqual(place, imageSize(mean)))) continue;
            interfaces = rays = line = 0;
            disperses = false;
            radiance = discarded = vec3(0.0);
            cutoff = frame.cutoff;
            chain = Chain(0, 0);
            headBefore = interfacesBefore = 0;
            next = NEXT_TREE;
        }
        if (next == NEXT_TREE) {
            gathered = Gathered(vec3(0.0), 0.0, 0.0);
            branch = CameraBranch(vec2(place) + 0.5 + jitter);
            top = 0;
            passed = 0;
            if (OPAQUE) GiveBack(chain, headBefore);
            interfaces = interfacesBefore;
            raysBefore = rays;
            next = NEXT_BRANCH;
        }
        Found found;
        vec3 direction = branch.direction;
        bool meets = Trace(branch.origin, direction, branch.left, found);
        ++rays;

        Look nowhere = Look(vec3(0.0), direction, mat2x3(0.0));
        Outlook outlook = Outlook(nowhere, nowhere, 0);
        bool goesOn = false;
        if (!meets) {
            if (frame.environmentVisible != 0 || branch.depth > 0) LookTowards(outlook, branch.throughput, direction, branch.differentials.direction);
        } else {
            Arrival arrival = ArriveAt(found, branch.origin, direction);
            Differentials before = branch.differentials;
            Differentials arrived = before;
            if (FOOTPRINTS) arrived = Transferred(before, direction, arrival);
            mat2 sides = mat2(0.0);
            if (FOOTPRINTS && (TEXTURES || NORMAL_MAPS || CUTOUTS)) {
                mat3x2 corners = CoordinatesOf(VerticesOf(found));
                sides = mat2(corners[1] - corners[0], corners[2] - corners[0]) * WeightDifferentials(arrival, arrived.position);
            }
            Dressed dressed = DressAt(materials[instances[found.instance].material], found, arrival.weights, sides);
            Material material = dressed.material;
            if (NORMAL_MAPS) arrival.normal = BumpedNormal(dressed.bump, arrival.normal, found, arrival.weights);
            if (OPAQUE && COATINGS && dressed.through == 0.0) material.kind = KIND_OPAQUE;
            float wavelength = DISPERSION ? spectrum[line].w : D_LINE;
            Crossing crossing = CrossingOf(found, material, arrival.behind, branch.at, wavelength, disperses);
            Boundary boundary = crossing.boundary;
            bool isOpaque = crossing.isOpaque;
            bool isPane = crossing.isPane;
            bool isThere = !CUTOUTS || dressed.presence >= 0.5;
            if (!isThere) {
                // The medium is another one beyond, but nothing shows that.
                isOpaque = false;
                crossing.passes = true;
            }
            bool passes = crossing.passes;
            branch.throughput *= Absorbed(boundary.before.medium, arrival.distance);
            if (COATINGS && passes && isThere) {
                if (OPAQUE && dressed.through < 1.0) Leave(chain, gathered, found, branch, line, dressed, 1.0 - dressed.through);
                branch.throughput *= dressed.through * material.baseColor;
            }

            vec3 wi = -direction;
            vec3 faceNormal = arrival.behind ? -arrival.faceNormal : arrival.faceNormal;
            vec3 normal = NormalTowards(arrival.behind ? -arrival.normal : arrival.normal, wi);
            mat2x3 normals = mat2x3(0.0);
            if (FOOTPRINTS) {
                if (passes) {
                    before.position += arrival.distance * before.direction;
                } else {
                    before = arrived;
                    normals = NormalDifferentials(arrival, normal, before.position);
                }
                branch.differentials = before;
            }
            Refraction refraction = Refraction(vec3(0.0), Interface(0.0, 1.0, 1.0, false));
            float reflectance = 0.0;
            float transmittance = 1.0;
            if (!isOpaque && !passes) {
                refraction = Refract(wi, normal, crossing.etaI, crossing.etaT);
                reflectance = refraction.crossed.reflectance;
                transmittance = refraction.crossed.transmittance;
                if (isPane) {
                    // Both interfaces, and everything between them, summed; what gets through goes straight on.
                    transmittance = refraction.crossed.total ? 0.0 : PaneTransmittance(reflectance, transmittance);
                    reflectance = PaneReflectance(reflectance);
                }
            }

            if (isOpaque) {
                ++interfaces;
                // Light is given as it is in the medium that the surface lies in.
                gathered.radiance += branch.throughput * material.emission / (crossing.etaI * crossing.etaI);
                Leave(chain, gathered, found, branch, line, dressed, 1.0);
                branch.throughput *= MirroredShare(material, wi, normal);
                if (Largest(branch.throughput) > 0.0) {
                    vec3 wr = DirectionAbove(normalize(2.0 * dot(wi, normal) * normal - wi), faceNormal);
                    Differentials reflected = before;
                    if (FOOTPRINTS) reflected = Reflected(before, direction, normal, normals);
                    goesOn = branch.depth < frame.maxDepth && Largest(branch.throughput) > cutoff;
                    if (!goesOn && branch.depth < frame.maxDepth) gathered.faint += Largest(branch.throughput);
                    if (goesOn) branch = Child(branch, arrival, wr, reflected, vec3(1.0), branch.at);
                    else Discard(gathered, outlook, branch.throughput, wr, reflected);
                }
            } else {
                if (passes) {
                    branch.at = boundary.beyond;
                    branch.origin = LeaveFrom(arrival, direction);
                    branch.left = found;
                    goesOn = ++passed <= MOST_PASSED;
                }
                if (passes ? !goesOn : branch.depth >= frame.maxDepth) {
                    Discard(gathered, outlook, branch.throughput, direction, before);
                } else if (!passes) {
                    ++interfaces;
                    passed = 0;
                    vec3 wr = DirectionAbove(normalize(2.0 * dot(wi, normal) * normal - wi), faceNormal);
                    vec3 wt = direction;
                    if (!isPane && !refraction.crossed.total) wt = DirectionAbove(normalize(refraction.wt), -faceNormal);
                    Differentials reflected = before;
                    Differentials refracted = before;
                    if (FOOTPRINTS) {
                        reflected = Reflected(before, direction, normal, normals);
                        if (!isPane) refracted = Refracted(before, direction, normal, normals, wt, crossing.etaI / crossing.etaT);
                    }
                    if (!REFLECTION) reflectance = 0.0;
                    if (!TRANSMISSION) transmittance = 0.0;
                    vec3 tint = vec3(1.0);
                    if (COATINGS) {
                        tint = dressed.through * material.baseColor;
                        // Where it is painted the same interface lies above; one that is rough is left to its lights.
                        if (OPAQUE && dressed.through < 1.0) {
                            Leave(chain, gathered, found, branch, line, dressed, 1.0 - dressed.through);
                            if (material.roughness * material.roughness > MIRROR_ALPHA) reflectance *= dressed.through;
                        }
                        transmittance *= Largest(tint);
                        tint /= max(Largest(tint), 1e-30);
                    }
                    float whole = Largest(branch.throughput);
                    if (!INTERIOR) {
                        // The environment is all that lies beyond.
                        LookTowards(outlook, branch.throughput * reflectance, wr, reflected.direction);
                        LookTowards(outlook, branch.throughput * (transmittance * tint), wt, refracted.direction);
                    } else {
                        bool reflects = whole * reflectance > cutoff;
                        bool transmits = whole * transmittance > cutoff;
                        bool reflectedFirst = reflectance <= transmittance; // the smaller
                        if (reflects && transmits && top == TREE_STACK) {
                            if (reflectedFirst) reflects = false; else transmits = false;
                        }
                        if (!reflects && reflectance > 0.0) {
                            gathered.faint += whole * reflectance;
                            Discard(gathered, outlook, branch.throughput * reflectance, wr, reflected);
                        }
                        if (!transmits && transmittance > 0.0) {
                            gathered.faint += whole * transmittance;
                            Discard(gathered, outlook, branch.throughput * (transmittance * tint), wt, refracted);
                        }
                        bool goesReflected = reflects && (reflectedFirst || !transmits);
                        if (reflects && transmits) {
                            if (goesReflected) waiting[top] = Child(branch, arrival, wt, refracted, transmittance * tint, boundary.beyond);
                            else waiting[top] = Child(branch, arrival, wr, reflected, vec3(reflectance), boundary.before);
                            ++top;
                        }
                        goesOn = reflects || transmits;
                        if (goesReflected) branch = Child(branch, arrival, wr, reflected, vec3(reflectance), boundary.before);
                        else branch = Child(branch, arrival, wt, refracted, transmittance * tint, boundary.beyond);
                    }
                }
            }
        }

        for (uint i = 0; i < outlook.count; ++i) {
            Look look = outlook.next;
            vec3 seen = vec3(0.0);
            // What is faint may be blurred.
            int longest = clamp(int(ceil(float(LONGEST_ROW) * Largest(look.throughput))), 1, LONGEST_ROW);
            if (FOOTPRINTS) seen = SampleEnvironment(look.direction, look.sides, longest);
            else seen = SampleEnvironment(look.direction, 0.0);
            gathered.radiance += look.throughput * seen;
            outlook.next = outlook.other;
        }

        if (goesOn) continue;
        passed = 0;
        if (gathered.faint > tolerance && cutoff > LEAST_CUTOFF && rays - raysBefore <= MOST_RAYS) {
            cutoff /= CUTOFF_STEP;
            next = NEXT_TREE;
        } else if (top > 0) {
            branch = waiting[--top];
        } else {
            vec3 weight = DISPERSION && disperses ? spectrum[line].rgb : vec3(1.0);
            radiance += weight * gathered.radiance;
            // Lines of a colour below 0 take light away: what they lack is not lacking in the picture.
            discarded += max(weight, 0.0) * gathered.discarded;
            next = NEXT_TREE;
            cutoff = frame.cutoff;
            headBefore = chain.head;
            interfacesBefore = interfaces;
            if (!DISPERSION || !disperses || ++line == wavelengths) {
                float trees = DISPERSION && disperses ? float(wavelengths) : 1.0;
                Sample one = Sample(scale * vec4(radiance, Largest(discarded)), float(interfaces) / trees, rays, chain.head, uint(disperses));
                if (OPAQUE) samples[SampleAt(place)] = one; else AddSample(place, one);
                next = NEXT_PIXEL;
            }
        }
    }
}

#endif
