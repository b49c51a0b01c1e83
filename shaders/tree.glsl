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

#extension GL_EXT_control_flow_attributes : require
#include "trace.glsl"
#include "arrival.glsl"
#include "camera.glsl"
#include "effects.glsl"
#include "environment.glsl"
#include "fresnel.glsl"
#include "media.glsl"
#include "opaque.glsl"
#include "texture.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 14, rgba32f) uniform image2D mean;    // radiance, and throughput cut off
layout(set = 0, binding = 15, rgba32f) uniform image2D counts;  // interfaces, rays

// Pixels in a row of a workgroup's that one invocation takes, one after the other; as in src/passes/tree.rs.
const int PIXELS = 8;

// Branches that wait. Each has at least twice the throughput of the next.
const int TREE_STACK = 16;

// A tree that cut off more than it may is followed once more with a cut-off so many times smaller, down to what no image shows.
const float CUTOFF_STEP = 8.0;
const float LEAST_CUTOFF = 1e-9;

// Nanometres, where no wavelength is told from the others.
const float D_LINE = 587.6;

// Boundaries that scatter nothing, as those between equal indices, that a ray passes in a row.
const uint MOST_PASSED = 4096;

// The shares of light that reach opaque surfaces below this are none.
const float LEAST_SHARE = 1e-6;

float Largest(vec3 v) { return max(max(v.x, v.y), v.z); }

struct Branch {
    vec3 origin;
    vec3 direction;
    vec3 throughput;
    uint depth;     // interfaces behind it
    Whereabouts at;
};

Branch Child(Branch parent, Arrival arrival, vec3 direction, float share, Whereabouts at)
{
    return Branch(LeaveFrom(arrival, direction), direction, parent.throughput * share, parent.depth + 1, at);
}

Branch CameraBranch(vec2 pixel)
{
    Whereabouts at = Whereabouts(frame.cameraMedium, Bodies(frame.cameraBodies));
    return Branch(vec3(0.0), normalize(CameraRay(pixel)), vec3(1.0), 0, at);
}

// What a pixel gathers of one tree.
struct Gathered {
    vec3 radiance;
    float discarded;
    float faint;       // the share of that which was cut off for its throughput
};

// The environment towards directions that wait to be looked up, two at most a turn.
struct Outlook {
    vec3 throughput[2];
    vec3 direction[2];
    float lod;
};

// Counts what is cut off. In the place of what it would have found stands the environment in its direction; a constant
// environment is a furnace, which shows what is lost only if nothing replaces it.
void Discard(inout Gathered gathered, inout Outlook outlook, int place, vec3 throughput, vec3 direction)
{
    gathered.discarded += Largest(throughput);
    if (!ENVIRONMENT_IMAGE) return;
    outlook.throughput[place] = throughput;
    outlook.direction[place] = direction;
}

// ---- opaque surfaces: light after light, each with a ray that asks whether it is seen ---------------------------------------

// A point of an opaque surface whose lights are being asked for.
struct Lighting {
    Arrival arrival;
    OpaqueSurface surface;
    mat3 toWorld;
    vec3 wi;           // to the viewer, local frame
    vec3 throughput;
    Whereabouts at;
    uint next;         // light
    uint count;        // of lights
};

// A ray towards a light. Dielectrics on its way take what they mirror and absorb, and do not bend it.
struct LightRay {
    vec3 origin;
    vec3 direction;
    vec3 throughput;   // radiance that arrives from a point light, or the weight of the environment's
    float reach;       // distance of a point light; infinite: the environment
    float lod;
    Whereabouts at;
};

// The next light that could be seen, if one is left: point lights first, then directions to the environment for what is scattered,
// then for what is mirrored. Every pixel takes the same directions, and each sample others.
bool NextLight(inout Lighting lighting, out LightRay ray)
{
    ray.at = lighting.at;
    ray.reach = LARGEST_FLOAT;
    ray.lod = 0.0;
    for (; lighting.next < lighting.count; ++lighting.next) {
        uint number = lighting.next;
        vec3 wo;
        if (number < frame.lightCount) {
            vec3 toLight = lights[number].position - lighting.arrival.position;
            ray.reach = length(toLight);
            if (!DIRECT_LIGHT || ray.reach == 0.0) continue;
            wo = toLight / ray.reach * lighting.toWorld;
            ray.throughput = EvaluateOpaque(lighting.surface, lighting.wi, wo) * lights[number].intensity / (ray.reach * ray.reach);
        } else {
            number -= frame.lightCount;
            bool mirrored = number >= frame.normals;
            uint index = sampleIndex * frame.normals + number % frame.normals;
            vec2 u = PlasticPoint(index, uvec2(frame.seed, 0x9e3779b9u));
            LightSample light;
            if (mirrored) light = SampleSpecular(lighting.surface, lighting.wi, u);
            else light = SampleDiffuse(lighting.surface, lighting.wi, u);
            wo = light.wo;
            ray.reach = LARGEST_FLOAT;
            ray.throughput = light.weight / float(frame.normals);
            float inAll = frame.normalsInAll != 0 ? float(frame.normalsInAll) : float(index + 1);
            if (frame.environmentLevels > 1) ray.lod = EnvironmentLod(1.0 / (inAll * light.pdf), UnitFloat(index * GOLDEN_STEP));
        }
        ray.direction = normalize(lighting.toWorld * wo);
        ray.throughput *= lighting.throughput;
        bool above = dot(ray.direction, lighting.arrival.faceNormal) > 0.0 == !lighting.arrival.behind;
        if (!above || !(Largest(ray.throughput) > 0.0)) continue;
        ray.origin = LeaveFrom(lighting.arrival, ray.direction);
        ++lighting.next;
        return true;
    }
    return false;
}

vec3 BaseColor(Material material, Found found, Arrival arrival)
{
    if (!TEXTURES || material.texture == 0) return material.baseColor;
    uint first = 3 * (instances[found.instance].firstTriangle + found.triangle);
    uvec3 vertices = instances[found.instance].firstVertex + uvec3(triangles[first], triangles[first + 1], triangles[first + 2]);
    vec2 uv = arrival.weights.x * coordinates[vertices.x] + arrival.weights.y * coordinates[vertices.y]
        + arrival.weights.z * coordinates[vertices.z];
    return SampleTexture(material.texture, uv);
}

Lighting LightingOf(Material material, Found found, Arrival arrival, Branch branch)
{
    Lighting lighting;
    vec3 wi = -branch.direction;
    lighting.arrival = arrival;
    lighting.surface = OpaqueSurfaceOf(BaseColor(material, found, arrival), material.metallic, material.roughness, material.specular);
    lighting.toWorld = BasisAround(NormalTowards(arrival.behind ? -arrival.normal : arrival.normal, wi));
    lighting.wi = normalize(wi * lighting.toWorld);
    lighting.throughput = branch.throughput;
    lighting.at = branch.at;
    lighting.next = 0;
    bool spread = IsSpecular(lighting.surface) && !IsMirror(lighting.surface);
    lighting.count = frame.lightCount + (spread ? 2 : 1) * frame.normals;
    return lighting;
}

// ---- pixels --------------------------------------------------------------------------------------------------------------------

// Moves the means of a pixel by one sample: means, not sums, as in accumulate.comp.
void Store(ivec2 place, vec4 value, vec4 count)
{
    if (sampleIndex != 0) {
        vec4 before = imageLoad(mean, place);
        value = before + (value - before) / float(sampleIndex + 1);
        before = imageLoad(counts, place);
        count = before + (count - before) / float(sampleIndex + 1);
    }
    imageStore(mean, place, value);
    imageStore(counts, place, count);
}

// What the next ray is.
const uint NEXT_PIXEL = 0;   // the camera's of the next pixel
const uint NEXT_TREE = 1;    // the camera's of this one once more
const uint NEXT_BRANCH = 2;  // the branch
const uint NEXT_LIGHT = 3;   // the light ray

void main()
{
    uint next = NEXT_PIXEL;
    int column = -1;
    ivec2 place;
    uint interfaces;
    uint rays;

    // Trees of the pixel: one for each wavelength, if any index tells them from each other.
    uint line;
    bool disperses;
    vec3 radiance;
    vec3 discarded;
    float tolerance = frame.tolerance;
    if (DISPERSION) {
        vec3 shares = vec3(0.0);
        for (uint i = 0; i < wavelengths; ++i) shares += max(spectrum[i].rgb, 0.0);
        tolerance /= Largest(shares);
    }

    // The tree.
    Gathered gathered;
    float cutoff;
    Branch branch;
    Branch waiting[TREE_STACK];
    int top;
    uint passed;
    Lighting lighting;
    LightRay light;

    for (;;) {
        if (next == NEXT_PIXEL) {
            if (++column == PIXELS) break;
            place = ivec2(8 * (PIXELS * gl_WorkGroupID.x + column) + gl_LocalInvocationID.x, gl_GlobalInvocationID.y + firstRow);
            if (any(greaterThanEqual(place, imageSize(mean)))) continue;
            interfaces = rays = line = 0;
            disperses = false;
            radiance = discarded = vec3(0.0);
            cutoff = frame.cutoff;
            next = NEXT_TREE;
        }
        if (next == NEXT_TREE) {
            gathered = Gathered(vec3(0.0), 0.0, 0.0);
            branch = CameraBranch(vec2(place) + 0.5 + jitter);
            top = 0;
            passed = 0;
            next = NEXT_BRANCH;
        }
        bool toLight = OPAQUE && next == NEXT_LIGHT;
        vec3 origin = toLight ? light.origin : branch.origin;
        vec3 direction = toLight ? light.direction : branch.direction;
        Found found;
        bool any = Trace(origin, direction, found);
        ++rays;

        Outlook outlook;
        outlook.throughput[0] = outlook.throughput[1] = vec3(0.0);
        outlook.direction[0] = outlook.direction[1] = direction;
        outlook.lod = toLight ? light.lod : 0.0;
        bool goesOn = false;
        Arrival arrival;
        if (any) arrival = ArriveAt(found, origin, direction);
        if (toLight && any && arrival.distance >= light.reach) any = false;
        if (!any) {
            if (toLight && light.reach < LARGEST_FLOAT) {
                gathered.radiance += light.throughput;
            } else if (toLight) {
                outlook.throughput[0] = light.throughput;
            } else if (frame.environmentVisible != 0 || branch.depth > 0) {
                outlook.throughput[0] = branch.throughput;
            }
        } else {
            Material material = materials[instances[found.instance].material];
            bool isPane = THIN_WALLED && material.kind == KIND_PANE;
            bool isOpaque = OPAQUE && material.kind == KIND_OPAQUE;
            Whereabouts at = branch.at;
            if (toLight) at = light.at;
            Boundary boundary = Boundary(at, at);
            if (!isOpaque && !isPane) boundary = BoundaryOf(found.instance, arrival.behind, at);
            vec3 arriving = vec3(1.0);
            if (ABSORPTION && boundary.before.medium != 0) {
                arriving = Transmittance(materials[boundary.before.medium - 1].absorption, arrival.distance);
            }
            float wavelength = DISPERSION ? spectrum[line].w : D_LINE;
            float etaI = IndexOf(boundary.before.medium, wavelength, disperses);
            float etaT = isPane ? material.refractionIndex : IndexOf(boundary.beyond.medium, wavelength, disperses);
            bool passes = !isOpaque && etaI == etaT; // nothing is there to see

            vec3 wi = -direction;
            vec3 faceNormal = arrival.behind ? -arrival.faceNormal : arrival.faceNormal;
            vec3 normal = NormalTowards(arrival.behind ? -arrival.normal : arrival.normal, wi);
            Refraction refraction;
            float reflectance;
            float transmittance;
            if (!isOpaque && !passes) {
                refraction = Refract(wi, normal, etaI, etaT);
                reflectance = refraction.crossed.reflectance;
                transmittance = refraction.crossed.transmittance;
                if (isPane) {
                    // Both interfaces, and everything between them, summed; what gets through goes straight on.
                    transmittance = refraction.crossed.total ? 0.0 : transmittance / (1.0 + reflectance);
                    reflectance = 2.0 * reflectance / (1.0 + reflectance);
                }
            }

            if (toLight) {
                light.throughput *= arriving;
                if (!passes) light.throughput *= isOpaque ? 0.0 : transmittance;
                light.reach -= light.reach < LARGEST_FLOAT ? arrival.distance : 0.0;
                light.at = boundary.beyond;
                light.origin = LeaveFrom(arrival, direction);
                goesOn = Largest(light.throughput) > LEAST_SHARE * Largest(lighting.throughput) && ++passed <= MOST_PASSED;
            } else if (isOpaque) {
                branch.throughput *= arriving;
                ++interfaces;
                // Light is given as it is in the medium that the surface lies in.
                float index = IndexOf(branch.at.medium, wavelength, disperses);
                gathered.radiance += branch.throughput * material.emission / (index * index);
                lighting = LightingOf(material, found, arrival, branch);
                if (IsSpecular(lighting.surface) && IsMirror(lighting.surface)) {
                    vec3 share = FacetReflectance(lighting.surface, lighting.wi.z);
                    vec3 wr = DirectionAbove(normalize(2.0 * dot(wi, normal) * normal - wi), faceNormal);
                    branch.throughput *= share;
                    if (branch.depth < frame.maxDepth && Largest(branch.throughput) > cutoff && top < TREE_STACK) {
                        waiting[top++] = Child(branch, arrival, wr, 1.0, branch.at);
                    } else {
                        Discard(gathered, outlook, 0, branch.throughput, wr);
                    }
                }
            } else {
                branch.throughput *= arriving;
                if (passes) {
                    branch.at = boundary.beyond;
                    branch.origin = LeaveFrom(arrival, direction);
                    goesOn = ++passed <= MOST_PASSED;
                }
                if (passes ? !goesOn : branch.depth >= frame.maxDepth) {
                    Discard(gathered, outlook, 0, branch.throughput, direction);
                } else if (!passes) {
                    ++interfaces;
                    passed = 0;
                    vec3 wr = DirectionAbove(normalize(2.0 * dot(wi, normal) * normal - wi), faceNormal);
                    vec3 wt = direction;
                    if (!isPane && !refraction.crossed.total) wt = DirectionAbove(normalize(refraction.wt), -faceNormal);
                    if (!REFLECTION) reflectance = 0.0;
                    if (!TRANSMISSION) transmittance = 0.0;
                    float whole = Largest(branch.throughput);
                    if (!INTERIOR) {
                        // The environment is all that lies beyond.
                        outlook.throughput[0] = branch.throughput * reflectance;
                        outlook.direction[0] = wr;
                        outlook.throughput[1] = branch.throughput * transmittance;
                        outlook.direction[1] = wt;
                    } else {
                        bool reflects = whole * reflectance > cutoff;
                        bool transmits = whole * transmittance > cutoff;
                        bool reflectedFirst = reflectance <= transmittance; // the smaller
                        if (reflects && transmits && top == TREE_STACK) {
                            if (reflectedFirst) reflects = false; else transmits = false;
                        }
                        if (!reflects && reflectance > 0.0) {
                            gathered.faint += whole * reflectance;
                            Discard(gathered, outlook, 0, branch.throughput * reflectance, wr);
                        }
                        if (!transmits && transmittance > 0.0) {
                            gathered.faint += whole * transmittance;
                            Discard(gathered, outlook, 1, branch.throughput * transmittance, wt);
                        }
                        bool goesReflected = reflects && (reflectedFirst || !transmits);
                        if (reflects && transmits) {
                            if (goesReflected) waiting[top] = Child(branch, arrival, wt, transmittance, boundary.beyond);
                            else waiting[top] = Child(branch, arrival, wr, reflectance, boundary.before);
                            ++top;
                        }
                        goesOn = reflects || transmits;
                        if (goesReflected) branch = Child(branch, arrival, wr, reflectance, boundary.before);
                        else branch = Child(branch, arrival, wt, transmittance, boundary.beyond);
                    }
                }
            }
            if (isOpaque && !toLight) goesOn = NextLight(lighting, light);
            if (isOpaque && !toLight && goesOn) {
                next = NEXT_LIGHT;
                passed = 0;
            }
        }

        [[dont_unroll]] for (int i = 0; i < 2; ++i) {
            if (Largest(outlook.throughput[i]) > 0.0) {
                gathered.radiance += outlook.throughput[i] * SampleEnvironment(outlook.direction[i], outlook.lod);
            }
        }

        if (goesOn) continue;
        passed = 0;
        if (toLight && NextLight(lighting, light)) continue;
        next = NEXT_BRANCH;
        if (gathered.faint > tolerance && cutoff > LEAST_CUTOFF) {
            cutoff /= CUTOFF_STEP;
            next = NEXT_TREE;
        } else if (top > 0) {
            branch = waiting[--top];
        } else {
            vec3 weight = DISPERSION && disperses ? spectrum[line].rgb : vec3(1.0);
            radiance += weight * gathered.radiance;
            discarded += weight * gathered.discarded;
            next = NEXT_TREE;
            cutoff = frame.cutoff;
            if (!DISPERSION || !disperses || ++line == wavelengths) {
                float scale = frame.cameraIndex * frame.cameraIndex;
                Store(place, scale * vec4(radiance, Largest(discarded)), vec4(float(interfaces), float(rays), 0.0, 0.0));
                next = NEXT_PIXEL;
            }
        }
    }
}

#endif
