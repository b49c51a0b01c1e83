// Paths of light from the camera on, at random: every effect, without bias up to the longest chain of interfaces. Multiple importance
// sampling (Veach & Guibas 1995) joins directions chosen by a surface with those chosen by where light comes from.
//
// As in tree.glsl one loop does everything, a ray a turn, and radiance is that of a medium of index 1.
#ifndef PATH_GLSL
#define PATH_GLSL

#include "trace.glsl"
#include "arrival.glsl"
#include "camera.glsl"
#include "effects.glsl"
#include "emitters.glsl"
#include "environment.glsl"
#include "interface.glsl"
#include "media.glsl"
#include "skylight.glsl"
#include "sobol.glsl"
#include "spectrum.glsl"
#include "spot.glsl"
#include "texture.glsl"
#include "welford.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// How light is looked for at surfaces that spread it: by lights alone, by the surface alone, or by both; for tests.
layout(constant_id = 66) const bool SAMPLE_LIGHTS = true;
layout(constant_id = 67) const bool SAMPLE_SURFACES = true;

layout(set = 0, binding = 15, rgba32f) uniform image2D mean;    // radiance
layout(set = 0, binding = 16, rgba32f) uniform image2D counts;  // interfaces, rays, throughput that was cut off
layout(set = 0, binding = 17, rgba32f) uniform image2D spread;  // sum of squared differences of the batches' means from their mean, and their number

// From here on a faint path may end, with a probability that those going on make up for.
const uint ROULETTE_DEPTH = 4;
const float LEAST_SURVIVAL = 0.05;

struct Ray {
    vec3 origin;
    vec3 direction;
    vec3 throughput;
    float reach;      // distance of the light at its end; infinite: the environment
    Whereabouts at;
    Found left;
    Found aim;        // the triangle that shines at its end
    uint passed;      // boundaries in a row between equal indices
};

// Whether both ways are followed beyond the first interface too: not where opaque surfaces share the noise.
layout(constant_id = 68) const bool BRANCHES = true;

// As long as a pixel is seen through smooth glass alone both what an interface reflects and what it transmits are followed: one of them is rare at
// most angles, and would make most of the noise. One waits for the other.
struct Waiting {
    Ray ray;
    uint depth;
    float share;
    bool isColored;
};
const int MOST_WAITING = 4;

// Less of a pixel's light is not worth a path of its own: what water reflects of glass, 0.4 %, is.
const float LEAST_SHARE = 0.002;

// Pairs of numbers that a path takes: for the camera, and for each interface.
const uint PAIR_PIXEL = 0;
const uint PAIR_WAVELENGTH = 1;
const uint PAIRS_BEFORE = 2;
const uint PAIR_DIRECTION = 0;
const uint PAIR_CHOICE = 1;
const uint PAIR_LIGHT = 2;
const uint PAIR_LIGHT_CHOICE = 3;
const uint PAIRS_OF_INTERFACE = 4;
const uint PAIRS_OF_BRANCH = 1 << 18; // more than the deepest path takes

float PowerHeuristic(float pdf, float other)
{
    float ratio = other / max(pdf, 1e-30);
    return 1.0 / (1.0 + ratio * ratio);
}

// Moves the means of a pixel by a batch of samples, and what says how far batches are from each other.
void AddBatch(ivec2 place, vec3 value, vec3 counted)
{
    Moments moments = Moments(value, vec3(0.0));
    vec4 count = vec4(counted, 0.0);
    if (sampleIndex != 0) {
        moments = WithOneMore(Moments(imageLoad(mean, place).rgb, imageLoad(spread, place).rgb), sampleIndex, value);
        vec4 before = imageLoad(counts, place);
        count = before + (count - before) / float(sampleIndex + 1);
    }
    imageStore(mean, place, vec4(moments.mean, 1.0));
    imageStore(spread, place, vec4(moments.squares, float(sampleIndex + 1)));
    imageStore(counts, place, count);
}

// The kinds of lights that are looked for; each as often as the others.
bool SeeksSky() { return ENVIRONMENT_IMAGE && SAMPLE_LIGHTS && cellCount.x != 0; }
bool SeeksPoints() { return DIRECT_LIGHT && frame.lightCount > 0; }
bool SeeksEmitters() { return OPAQUE && SAMPLE_LIGHTS && emitterCount > 0; }

float ChanceOfKind()
{
    return 1.0 / max(float(SeeksSky()) + float(SeeksPoints()) + float(SeeksEmitters()), 1.0);
}

// A ray from an interface towards a light that it may see: false where there is none.
bool AskLight(Met met, mat3 toWorld, Arrival arrival, Sequence sequence, uint pair, Ray path, out Ray light)
{
    light = path;
    light.left = arrival.found;
    light.passed = 0;
    light.reach = LARGEST_FLOAT;
    float chance = ChanceOfKind();
    vec2 choice = Point(sequence, pair + PAIR_LIGHT_CHOICE);
    vec2 u = Point(sequence, pair + PAIR_LIGHT);
    uint kind = uint(choice.x / chance);
    vec3 radiance = vec3(0.0);
    bool isSky = false;
    float pdf = NO_PDF; // of a surface choosing it none
    if (SeeksSky() && kind-- == 0) {
        isSky = true;
        SkySample chosen = SampleSky(u);
        light.direction = normalize(chosen.direction);
        pdf = chosen.pdf * chance;
        radiance = SampleEnvironment(light.direction, 0.0) / pdf;
    } else if (SeeksPoints() && kind-- == 0) {
        uint number = min(uint(choice.y * float(frame.lightCount)), frame.lightCount - 1);
        vec3 toLight = lights[number].position - arrival.position;
        light.reach = max(length(toLight), 1e-30);
        light.direction = toLight / light.reach;
        radiance = IntensityAlong(-light.direction, lights[number]) * (float(frame.lightCount) / (light.reach * light.reach * chance));
    } else if (SeeksEmitters() && (INTERIOR || met.isOpaque)) { // else the surface would not find them either
        EmitterSample chosen = SampleEmitter(choice.y, u);
        vec3 toLight = chosen.position - arrival.position;
        light.reach = max(length(toLight), 1e-30);
        light.direction = toLight / light.reach;
        light.aim = chosen.found;
        float shines = materials[instances[chosen.found.instance].material].shines;
        float cosine = dot(light.direction, chosen.faceNormal);
        pdf = EmitterPdf(shines, light.reach, cosine) * chance;
        // Times what it sends out there, once it is known.
        radiance = vec3(abs(cosine) / (light.reach * light.reach * chosen.pdf * chance));
    } else {
        return false;
    }
    vec3 wo = light.direction * toWorld;
    // On the same side of the surface and of its interpolated normal.
    bool above = (dot(light.direction, arrival.faceNormal) > 0.0) != arrival.behind;
    if (above != (wo.z > 0.0) || (isSky && !IsUnderSky(met, above))) return false;
    Worth worth = Evaluate(met, wo);
    float weight = pdf != NO_PDF && SAMPLE_SURFACES ? PowerHeuristic(pdf, worth.pdf) : 1.0;
    light.throughput = path.throughput * worth.value * radiance * weight;
    light.origin = LeaveFrom(arrival, light.direction);
    return Largest(abs(light.throughput)) > 0.0;
}

// The share of light that a surface's choice of a direction counts for, where it could have been the choice of lights, of density `other`.
float WeightOfSurface(float pdf, float other)
{
    return SAMPLE_SURFACES ? PowerHeuristic(pdf, other * ChanceOfKind()) : 0.0;
}

void main()
{
    ivec2 place = ivec2(gl_GlobalInvocationID.xy) + ivec2(firstColumn, firstRow);
    if (any(greaterThanEqual(place, imageSize(mean)))) return;
    Sequence sequence = Sequence(0, Pcg3d(uvec3(place, frame.seed) + uvec3(0, 0, sampleIndex * GOLDEN_STEP)).x);
    vec3 sum = vec3(0.0);
    uint interfaces = 0;
    uint rays = 0;
    vec3 discarded = vec3(0.0);

    Whereabouts atCamera = Whereabouts(frame.cameraMedium, Bodies(frame.cameraBodies));
    Ray path = Ray(vec3(0.0), vec3(0.0, 0.0, -1.0), vec3(0.0), LARGEST_FLOAT, atCamera, NOWHERE, NOWHERE, 0);
    Ray light = path;
    bool toLight = false;
    Waiting waiting[MOST_WAITING];
    for (int i = 0; i < MOST_WAITING; ++i) waiting[i] = Waiting(path, 0, 0.0, false);
    int top = 0;
    uint branch = 0;
    float share = 1.0; // of the pixel's light that the path stands for
    bool isClear = true; // nothing spread it yet
    bool goesOn = false;
    uint depth = 0;
    float pdf = NO_PDF;
    bool isUnderSky = false;
    float travelled = 0.0; // from the interface before
    Wavelength wavelength = Wavelength(D_LINE, vec3(1.0));
    bool isColored = false;
    bool isBeyondGlass = false;
    bool startsSample = true;
    uint turn = 0; // of the sample

    for (;;) {
        if (startsSample) {
            startsSample = false;
            turn = 0;
            vec2 pixel = vec2(place) + Point(sequence, PAIR_PIXEL);
            path = Ray(vec3(0.0), normalize(CameraRay(pixel)), vec3(1.0), LARGEST_FLOAT, atCamera, NOWHERE, NOWHERE, 0);
            if (DISPERSION) wavelength = ChooseWavelength(Point(sequence, PAIR_WAVELENGTH).x);
            isColored = false;
            depth = 0;
            pdf = NO_PDF;
            travelled = 0.0;
            isBeyondGlass = false;
            toLight = false;
            branch = 0;
            share = 1.0;
            isClear = true;
            goesOn = true;
        }
        bool isLight = toLight;
        Ray ray = path;
        if (isLight) ray = light;
        Found found = NOWHERE;
        // Without the interior the environment and the lights are all that lies beyond glass.
        bool meets = (INTERIOR || !isBeyondGlass) && Trace(ray.origin, ray.direction, ray.left, found);
        ++rays;

        Arrival arrival;
        Dressed dressed = Dressed(materials[0], 1.0, 1.0, vec3(0.0));
        if (meets) {
            arrival = ArriveAt(found, ray.origin, ray.direction);
            dressed = DressAt(materials[instances[found.instance].material], found, arrival.weights, mat2(0.0));
            if (NORMAL_MAPS) arrival.normal = BumpedNormal(dressed.bump, arrival.normal, found, arrival.weights);
        }
        Material material = dressed.material;
        vec3 emitted = vec3(1.0);
        if (isLight && OPAQUE && ray.aim != NOWHERE) {
            bool arrives = meets && found == ray.aim;
            Material lamp = materials[instances[ray.aim.instance].material];
            // Where rounding has it miss what it aims at: as bright as that is in the mean.
            vec3 mean = lamp.emission * lamp.shines / max(dot(lamp.emission, vec3(0.2126, 0.7152, 0.0722)), 1e-30);
            emitted = arrives ? dressed.presence * material.emission : mean;
        }
        if (meets && isLight) {
            bool isPoint = ray.reach < LARGEST_FLOAT && ray.aim == NOWHERE;
            meets = arrival.distance < ray.reach && found != ray.aim && (SHADOWS || !isPoint);
        }
        bool isThere = true;
        if (meets && (CUTOUTS || COATINGS)) {
            vec3 coins = vec3(Pcg3d(uvec3(sequence.seed, sequence.index, turn)) >> 8) / float(1 << 24);
            isThere = isLight ? dressed.presence == 1.0 : coins.x < dressed.presence;
            if (isLight && !isThere) ray.throughput *= 1.0 - dressed.presence;
            if (OPAQUE && coins.y >= dressed.through) material.kind = KIND_OPAQUE;
        }
        ++turn;
        Boundary boundary = Boundary(ray.at, ray.at);
        Crossing crossing = Crossing(boundary, 1.0, 1.0, false, false, false);
        bool disperses = false;
        if (meets) {
            crossing = CrossingOf(found, material, arrival.behind, ray.at, wavelength.nanometres, disperses);
            boundary = crossing.boundary;
            ray.throughput *= Absorbed(boundary.before.medium, arrival.distance);
            if (!isThere) {
                // The medium is another one beyond, but nothing shows that.
                crossing.isOpaque = false;
                crossing.passes = true;
            } else if (COATINGS && crossing.passes) {
                ray.throughput *= material.baseColor;
            }
        }
        bool isOpaque = crossing.isOpaque;
        bool passes = crossing.passes;
        bool ends = !meets;
        if (passes) {
            ray.at = boundary.beyond;
            ray.reach -= ray.reach < LARGEST_FLOAT ? arrival.distance : 0.0;
            ray.origin = LeaveFrom(arrival, ray.direction);
            ray.left = found;
            ends = ++ray.passed > MOST_PASSED;
        }

        // From the first interface on whose index depends on the wavelength a path has a colour.
        if (DISPERSION && disperses && !isColored && !isLight && !passes) {
            ray.throughput *= wavelength.color;
            isColored = true;
        }

        if (isLight) {
            // Only what is not bent arrives.
            if (!meets) sum += ray.throughput * emitted * (ray.reach < LARGEST_FLOAT ? Absorbed(ray.at.medium, ray.reach) : vec3(1.0));
            toLight = passes && !ends;
            light = ray;
        } else if (!meets) {
            bool isSeen = frame.environmentVisible != 0 || depth > 0;
            if (isSeen) {
                float weight = 1.0;
                if (SeeksSky() && pdf > 0.0 && isUnderSky) weight = WeightOfSurface(pdf, SkyPdf(ray.direction));
                sum += weight * ray.throughput * SampleEnvironment(ray.direction, 0.0);
            }
            goesOn = false;
        } else if (passes) {
            path = ray;
            travelled += arrival.distance;
            goesOn = !ends;
            if (ends) discarded += ray.throughput;
        } else {
            if (isOpaque && Largest(material.emission) > 0.0) {
                float weight = 1.0;
                if (SeeksEmitters() && pdf > 0.0) {
                    float cosine = dot(ray.direction, arrival.faceNormal);
                    weight = WeightOfSurface(pdf, EmitterPdf(material.shines, travelled + arrival.distance, cosine));
                }
                sum += weight * ray.throughput * material.emission / (crossing.etaI * crossing.etaI);
            }
            goesOn = depth < frame.maxDepth;
            if (!goesOn) discarded += ray.throughput;
        }

        bool scatters = !isLight && meets && !passes;
        if (scatters && (isOpaque || goesOn)) ++interfaces;
        if (scatters && goesOn) {
            uint pair = PAIRS_BEFORE + PAIRS_OF_INTERFACE * depth + PAIRS_OF_BRANCH * branch;
            ++depth;
            isBeyondGlass = !isOpaque;
            vec3 wi = -ray.direction;
            vec3 faceNormal = arrival.behind ? -arrival.faceNormal : arrival.faceNormal;
            vec3 normal = NormalTowards(arrival.behind ? -arrival.normal : arrival.normal, wi);
            vec2 choice = Point(sequence, pair + PAIR_CHOICE);
            vec3 direction = ray.direction;
            vec3 weight = vec3(1.0);
            pdf = NO_PDF;
            bool reflected = false;
            bool isRough = ROUGHNESS && !isOpaque && IsRough(material);
            if (isOpaque || isRough) {
                isClear = false;
                mat3 toWorld = BasisAround(normal);
                Met met = MetAt(material, crossing, wi * toWorld);
                toLight = AskLight(met, toWorld, arrival, sequence, pair, ray, light);
                if (toLight) {
                    bool through = dot(light.direction, faceNormal) < 0.0 && INTERIOR;
                    light.at = through ? boundary.beyond : boundary.before;
                    // Light of points and of surfaces is given as it is in the medium that they lie in.
                    float index = through && !crossing.isPane ? crossing.etaT : crossing.etaI;
                    if (light.reach < LARGEST_FLOAT) light.throughput /= index * index;
                }
                Next sampled = SampleNext(met, Point(sequence, pair + PAIR_DIRECTION), choice.x);
                direction = toWorld * sampled.wo;
                weight = sampled.weight;
                pdf = sampled.pdf;
                reflected = sampled.wo.z > 0.0;
                isUnderSky = IsUnderSky(met, reflected);
                // A direction that the face lies in the way of is bent; no light is asked for there.
                vec3 side = reflected ? faceNormal : -faceNormal;
                if (dot(direction, side) < LEAST_SLOPE) pdf = NO_PDF;
                direction = DirectionAbove(normalize(direction), side);
            } else {
                Refraction refraction = Refract(wi, normal, crossing.etaI, crossing.etaT);
                float reflectance = refraction.crossed.reflectance;
                if (crossing.isPane) reflectance = PaneReflectance(reflectance);
                reflected = refraction.crossed.total || choice.x < reflectance;
                vec3 wr = DirectionAbove(normalize(2.0 * dot(wi, normal) * normal - wi), faceNormal);
                vec3 wt = direction;
                if (!crossing.isPane && !refraction.crossed.total) wt = DirectionAbove(normalize(refraction.wt), -faceNormal);
                vec3 tint = COATINGS ? material.baseColor : vec3(1.0);
                if (!reflected) weight = tint;
                if (reflected ? !REFLECTION : !TRANSMISSION) weight = vec3(0.0);
                float smaller = min(reflectance, 1.0 - reflectance) * share;
                bool isWorthIt = depth == 1 ? smaller > 0.0 : BRANCHES && smaller > LEAST_SHARE && top < MOST_WAITING;
                if (isClear && isWorthIt && REFLECTION && TRANSMISSION) {
                    reflected = true;
                    weight = vec3(reflectance);
                    Ray transmitted = Ray(LeaveFrom(arrival, wt), wt, ray.throughput * tint * (1.0 - reflectance), LARGEST_FLOAT, boundary.beyond, found,
                        NOWHERE, 0);
                    waiting[top++] = Waiting(transmitted, depth, share * (1.0 - reflectance), isColored);
                    share *= reflectance;
                }
                direction = reflected ? wr : wt;
            }
            path = Ray(LeaveFrom(arrival, direction), direction, ray.throughput * weight, LARGEST_FLOAT,
                reflected ? boundary.before : boundary.beyond, found, NOWHERE, 0);
            travelled = 0.0;
            float size = Largest(abs(path.throughput));
            goesOn = size > 0.0;
            if (depth > ROULETTE_DEPTH && size < share) {
                float survival = max(size / share, LEAST_SURVIVAL);
                goesOn = goesOn && choice.y < survival;
                path.throughput /= survival;
            }
        }

        if (goesOn || toLight) continue;
        if (top > 0) {
            Waiting other = waiting[--top];
            path = other.ray;
            isColored = other.isColored;
            share = other.share;
            depth = other.depth;
            pdf = NO_PDF;
            isClear = true;
            ++branch;
            travelled = 0.0;
            isBeyondGlass = true;
            goesOn = true;
            continue;
        }
        if (++sequence.index == samplesInBatch) break;
        startsSample = true;
    }
    float samples = float(samplesInBatch);
    float scale = frame.cameraIndex * frame.cameraIndex;
    // Paths of one colour each are white together: the largest channel of a few of them is too large.
    float lost = max(DISPERSION ? dot(discarded, vec3(1.0 / 3.0)) : Largest(discarded), 0.0);
    AddBatch(place, scale * sum / samples, vec3(interfaces, rays, scale * lost) / samples);
}

#endif
