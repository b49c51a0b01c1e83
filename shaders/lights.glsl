// The light of opaque surfaces: point lights, and directions to the environment, each with a ray that asks whether it is seen. A
// pixel's records are taken up one after the other; one loop, a ray a turn, as in tree.glsl.
#ifndef LIGHTS_GLSL
#define LIGHTS_GLSL

#include "trace.glsl"
#include "arrival.glsl"
#include "effects.glsl"
#include "environment.glsl"
#include "fresnel.glsl"
#include "media.glsl"
#include "opaque.glsl"
#include "pixel.glsl"
#include "records.glsl"
#include "skylight.glsl"
#include "spot.glsl"
#include "texture.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Shares of light below this are none.
const float LEAST_SHARE = 1e-6;

// A point of an opaque surface in its local frame.
struct Lit {
    Arrival arrival;
    OpaqueSurface surface;
    mat3 toWorld;
    vec3 wi;       // to the viewer
};

Lit LitAt(Record record)
{
    Lit lit;
    Found found = Found(record.instance, record.triangle);
    Material material = materials[instances[found.instance].material];
    lit.arrival = ArriveAt(found, record.origin, record.direction);
    if (NORMAL_MAPS) {
        vec3 bump = vec3(unpackHalf2x16(record.normal), 1.0);
        lit.arrival.normal = BumpedNormal(bump, lit.arrival.normal, found, lit.arrival.weights);
    }
    vec3 normal = lit.arrival.behind ? -lit.arrival.normal : lit.arrival.normal;
    lit.toWorld = BasisAround(NormalTowards(normal, -record.direction));
    lit.wi = normalize(-record.direction * lit.toWorld);
    vec2 last = unpackUnorm2x16(record.color.y);
    vec3 color = material.baseColor;
    if (TEXTURES && material.colorMap != 0) color = vec3(unpackUnorm2x16(record.color.x), last.x);
    float metallic = material.metallic;
    float roughness = material.roughness;
    if (TEXTURES && material.finishMap != 0) roughness = uintBitsToFloat(record.roughness);
    if ((TEXTURES && material.finishMap != 0) || (COATINGS && material.kind != KIND_OPAQUE)) metallic = last.y;
    lit.surface = OpaqueSurfaceOf(color, metallic, roughness, material.head, material.specular);
    return lit;
}

// A ray towards a light. Dielectrics on its way take what they mirror and absorb, and do not bend it.
struct LightRay {
    vec3 origin;
    vec3 direction;
    vec3 throughput;   // radiance that arrives from a point light, or the weight of the environment's
    float reach;       // distance of a point light; infinite: the environment
    Whereabouts at;
    Found left;
};

// Whether a surface mirrors light into more than one direction.
bool IsGlossy(OpaqueSurface surface)
{
    return IsSpecular(surface) && !IsMirror(surface);
}

// Lights of a point: point lights, then directions to the environment chosen by how bright it is, or where that is the same
// everywhere by what is scattered; then those chosen by what is mirrored.
uint LightsOf(Lit lit)
{
    return frame.lightCount + (IsGlossy(lit.surface) ? 2 : 1) * frame.normals;
}

// A direction to the environment, and how often the ways to choose one choose it.
struct Towards {
    vec3 wo;
    float pdf;   // per steradian
};

// Direction `number`, from 0 to below twice frame.normals. Balanced: a direction counts as often as either way would have chosen it
// (Veach & Guibas 1995).
Towards AskSky(uint number, Lit lit)
{
    vec2 u = PlasticPoint(sampleIndex * frame.normals + number % frame.normals, uvec2(frame.seed, GOLDEN_STEP));
    bool bySky = ENVIRONMENT_IMAGE && cellCount.x != 0;
    Towards towards;
    if (number >= frame.normals) {
        towards.wo = SpecularDirection(lit.surface, lit.wi, u);
        towards.pdf = bySky ? SkyPdf(lit.toWorld * towards.wo) : DiffusePdf(towards.wo);
    } else if (bySky) {
        SkySample chosen = SampleSky(u);
        towards = Towards(chosen.direction * lit.toWorld, chosen.pdf);
    } else {
        towards.wo = DiffuseDirection(u);
        towards.pdf = DiffusePdf(towards.wo);
    }
    if (IsGlossy(lit.surface)) towards.pdf += SpecularPdf(lit.surface, lit.wi, towards.wo);
    return towards;
}

// The ray to light `number` of the point of `record`; false if its light cannot be seen. Every pixel takes the same directions, each
// sample others.
bool AskFor(uint number, Record record, Lit lit, out LightRay ray)
{
    vec3 wo;
    vec3 light;
    if (number < frame.lightCount) {
        vec3 toLight = lights[number].position - lit.arrival.position;
        ray.reach = max(length(toLight), 1e-30);
        vec3 direction = toLight / ray.reach;
        wo = direction * lit.toWorld;
        // Light is given as it is in the medium that the surface lies in.
        bool disperses = false;
        float spread = ray.reach * IndexOf(record.medium, D_LINE, disperses);
        light = DIRECT_LIGHT ? IntensityAlong(-direction, lights[number]) / (spread * spread) : vec3(0.0);
    } else {
        Towards towards = AskSky(number - frame.lightCount, lit);
        wo = towards.wo;
        ray.reach = LARGEST_FLOAT;
        light = vec3(towards.pdf > 0.0 ? 1.0 / (towards.pdf * float(frame.normals)) : 0.0);
    }
    ray.throughput = record.throughput * EvaluateOpaque(lit.surface, lit.wi, wo) * light;
    ray.direction = normalize(lit.toWorld * wo);
    ray.origin = LeaveFrom(lit.arrival, ray.direction);
    ray.left = lit.arrival.found;
    ray.at = Whereabouts(record.medium, Bodies(record.bodies));
    bool above = (dot(ray.direction, lit.arrival.faceNormal) > 0.0) != lit.arrival.behind;
    return above && Largest(abs(ray.throughput)) > 0.0;
}

// What a dielectric at `arrival` leaves of a light ray that goes straight through it.
void PassThrough(inout LightRay light, Material material, Arrival arrival, bool isThere)
{
    bool disperses = false;
    Crossing crossing = CrossingOf(arrival.found, material, arrival.behind, light.at, D_LINE, disperses);
    light.throughput *= Absorbed(crossing.boundary.before.medium, arrival.distance);
    vec3 normal = arrival.behind ? -arrival.normal : arrival.normal;
    // A ray that goes straight on has the direction that it would have outside: seen from there nothing is totally reflected.
    float thinner = min(crossing.etaI, crossing.etaT);
    float denser = max(crossing.etaI, crossing.etaT);
    Interface crossed = FresnelDielectric(max(dot(-light.direction, normal), LEAST_SLOPE), thinner, denser);
    bool isPane = crossing.isPane && !crossed.total;
    if (isThere) light.throughput *= isPane ? PaneTransmittance(crossed.reflectance, crossed.transmittance) : crossed.transmittance;
    light.reach -= light.reach < LARGEST_FLOAT ? arrival.distance : 0.0;
    light.at = crossing.boundary.beyond;
    light.origin = LeaveFrom(arrival, light.direction);
    light.left = arrival.found;
}

void main()
{
    ivec2 place = ivec2(gl_GlobalInvocationID.x + firstColumn, gl_GlobalInvocationID.y + firstRow);
    if (any(greaterThanEqual(place, imageSize(mean)))) return;
    if (recordsRepeat != 0 && recordCount > recordCapacity) return;
    Sample one = samples[SampleAt(place)];
    float scale = frame.cameraIndex * frame.cameraIndex;
    LightRay light = LightRay(vec3(0.0), vec3(0.0), vec3(0.0), 0.0, Whereabouts(0, Bodies(uvec4(0))), NOWHERE);
    uint head = one.head;
    uint number = 0;
    uint passed = 0;
    bool onItsWay = false;
    while (head != 0) {
        if (!onItsWay) {
            Record record = records[head - 1];
            if (DISPERSION && one.disperses != 0) record.throughput *= spectrum[record.line].rgb;
            Lit lit = LitAt(record);
            passed = 0;
            if (number < LightsOf(lit)) {
                onItsWay = AskFor(number, record, lit, light);
                ++number;
            } else {
                head = record.next;
                number = 0;
            }
        }
        if (onItsWay) {
            Found found;
            Arrival arrival;
            bool meets = false;
            if (light.reach == LARGEST_FLOAT || SHADOWS) {
                meets = Trace(light.origin, light.direction, light.left, found);
                ++one.rays;
            }
            if (meets) arrival = ArriveAt(found, light.origin, light.direction);
            onItsWay = meets && arrival.distance < light.reach;
            bool isBlocked = false;
            vec3 share = vec3(1.0);
            vec3 emission = vec3(0.0);
            vec3 towards = light.direction;
            float lod = 0.0;
            if (onItsWay) {
                Dressed dressed = DressAt(materials[instances[found.instance].material], found, arrival.weights, mat2(0.0));
                Material material = dressed.material;
                bool isThere = !CUTOUTS || dressed.presence >= 0.5;
                isBlocked = isThere && (material.kind == KIND_OPAQUE || (COATINGS && dressed.through == 0.0));
                if (isBlocked) {
                    // What stands in the way of the environment sends its own light, and its colour of what the half of the environment
                    // before it sends, whatever else is there.
                    bool disperses = false;
                    float index = IndexOf(light.at.medium, D_LINE, disperses);
                    share = material.baseColor;
                    emission = material.emission / (index * index);
                    towards = arrival.behind ? -arrival.normal : arrival.normal;
                    lod = EnvironmentLod(2.0 * PI, 0.0);
                    light.throughput *= Absorbed(light.at.medium, arrival.distance);
                    onItsWay = false;
                } else {
                    PassThrough(light, material, arrival, isThere);
                    if (COATINGS && isThere) light.throughput *= dressed.through * material.baseColor;
                    onItsWay = Largest(abs(light.throughput)) > LEAST_SHARE && ++passed <= MOST_PASSED;
                    isBlocked = !onItsWay;
                    share = vec3(0.0);
                }
            }
            if (!onItsWay) {
                vec3 radiance = vec3(0.0);
                if (light.reach == LARGEST_FLOAT) radiance = share * SampleEnvironment(towards, lod) + emission;
                else if (!isBlocked) radiance = Absorbed(light.at.medium, light.reach);
                one.value.rgb += scale * light.throughput * radiance;
            }
        }
    }
    AddSample(place, one);
}

#endif
