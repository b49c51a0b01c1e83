#version 460
// The model `double`: light that enters a body where the camera sees it, and one chain of internal reflections, each found in pictures
// of the body. At every interface light that leaves the body is looked up in the environment.
#extension GL_GOOGLE_include_directive : require
#include "camera.glsl"
#include "exit.glsl"
#include "lighting.glsl"
#include "medium.glsl"
#include "scatter.glsl"
#include "sobol.glsl"

layout(location = 0) out vec4 outRadiance; // and the number of interfaces

// What is faint beside the noise of rough surfaces need not be found: throughput below which their chains end is their alpha, up to
// this.
const float ROUGH_CUTOFF = 0.1;

// Less than this part of the light is not worth a guess: it may see a sun where none is.
const float LITTLE = 0.1;

// Up to this alpha exits are searched for as thoroughly as those of smooth surfaces.
const float THOROUGH_ALPHA = 0.01;

// Light from `direction`, of a lobe of this solid angle shared by `inAll` directions.
vec3 LookTowards(vec3 direction, float area, float inAll, float dither)
{
    return SampleEnvironment(direction, ROUGHNESS && area > 0.0 ? EnvironmentLod(area / inAll, dither) : 0.0);
}

// Point lights mirrored by the surface that is seen; none shine through it.
vec3 Highlights(Material material, Hit hit, vec3 view)
{
    SurfaceData data;
    data.normal = hit.normal;
    data.behind = false;
    data.refractionIndex = material.refractionIndex;
    data.roughness = material.roughness;
    data.albedoTable = ENERGY_COMPENSATION && IsRough(data) ? RoughTable(material.albedoTables, 1.0, material.refractionIndex) : 0;
    data.reflectionRed = 0.0;
    data.reflectionIntensity = 1.0;
    data.refractionGreen = 0.0;
    data.refractionIntensity = 1.0;
    vec3 sum = vec3(0.0);
    for (uint i = 0; i < frame.lightCount; ++i) {
        bool isAbove = dot(lights[i].position - hit.position, hit.normal) > 0.0;
        if (isAbove) sum += ComputeBSDFDirect(data, view, hit.position, lights[i]);
    }
    return sum;
}

void main()
{
    Placed place = placed[instanceIndex];
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    // Helper invocations beside the instance's texels see there what nobody wrote.
    ivec2 texel = clamp(pixel, place.first, place.last);
    uint front = texelFetch(fronts, texel, 0).x;
    uint back = texelFetch(backs, texel, 0).x;
    bool isClosed = place.closed != 0;
    if (front == 0 && (back == 0 || isClosed)) discard;

    Instance instance = instances[instanceIndex];
    Material material = materials[instance.material];
    vec3 ray = CameraRay(gl_FragCoord.xy + jitter);
    uint triangle = (front != 0 ? front : back) - 1;
    Hit hit = IntersectCameraRay(instance, triangle, ray);
    bool isBehind = front == 0;
    if (!isClosed && front != 0 && back != 0) {
        Hit other = IntersectCameraRay(instance, back - 1, ray);
        if (other.t < hit.t) {
            isBehind = true;
            hit = other;
            triangle = back - 1;
        }
    }
    vec4 clip = frame.viewProjection * vec4(hit.position, 1.0);
    gl_FragDepth = clip.z / clip.w;

    vec3 view = -normalize(ray);
    mat3 normalToWorld = mat3(instance.normalToWorld);
    Seen seen;
    seen.isPane = THIN_WALLED && material.kind == KIND_PANE;
    seen.isRough = ROUGHNESS && !seen.isPane && material.roughness > SMOOTH_ROUGHNESS && material.refractionIndex != 1.0;
    seen.alpha = material.roughness * material.roughness;
    seen.tables = material.albedoTables;
    // Of what is seen from the inside, and of panes, which have no inside, one interface is all.
    bool isAlone = !INTERIOR || isBehind || seen.isPane;

    uint count = seen.isRough ? frame.normals : 1;
    uint firstPoint = sampleIndex * frame.normals;
    bool known = frame.normalsInAll != 0;
    float inAll = float(known ? frame.normalsInAll : firstPoint + frame.normals);
    uvec3 shift = Pcg3d(uvec3(pixel, frame.seed + (known ? 0 : sampleIndex)));

    float cutoff = seen.isRough ? max(frame.cutoff, min(seen.alpha, ROUGH_CUTOFF)) : frame.cutoff;
    bool thorough = !seen.isRough || seen.alpha <= THOROUGH_ALPHA;

    vec3 radiance = vec3(0.0);
    uint interfaces = 0;
    for (uint k = 0; k < count; ++k) {
        uint point = firstPoint + k;
        float dither = UnitFloat(point * GOLDEN_STEP + shift.x);
        vec2 u = PlasticPoint(point, shift.xy);
        bool isInside = isBehind && !seen.isPane;
        float side = isBehind ? -1.0 : 1.0;
        vec3 origin = hit.position;
        uint at = triangle;
        vec3 wi = view;
        vec3 throughput = vec3(1.0);
        vec3 found = vec3(0.0);
        float left = 0.0;  // the body, of the light, but for what it absorbs
        float stayed = 1.0;
        bool isGuess = false;  // an exit was not met for sure
        float area = 0.0;
        seen.normal = side * hit.normal;
        for (uint depth = 1; ; ++depth) {
            seen.faceNormal = side * normalize(normalToWorld * facets[instance.firstTriangle + at].outside.xyz);
            seen.etaI = isInside ? material.refractionIndex : 1.0;
            seen.etaT = isInside ? 1.0 : material.refractionIndex;
            Scattered light = Scatter(seen, wi, u);
            ++interfaces;

            // What leaves the body here, and what goes on in it.
            vec3 leaves = isInside ? light.wt : light.wr;
            vec3 stays = isInside ? light.wr : light.wt;
            float leaving = isInside ? light.transmitted : light.reflected;
            float staying = isInside ? light.reflected : light.transmitted;
            float areaOut = area + (isInside ? light.areaT : light.areaR);
            if (leaving > 0.0) found += throughput * leaving * LookTowards(leaves, areaOut, inAll, dither);
            throughput *= staying;
            left += stayed * leaving;
            stayed *= staying;
            area += isInside ? light.areaR : light.areaT;

            Exit exit = Exit(false, false, 0, 0.0, vec2(0.0));
            bool isLittle = stayed < LITTLE * left;
            bool goesOn = !isAlone && !(isLittle && isGuess) && depth < frame.maxDepth && Largest(throughput) > cutoff;
            if (goesOn) exit = FindExit(instance, place, at, origin, stays, thorough);
            if (!exit.found) {
                if (isLittle) {
                    // What is left of the light is as what was found.
                    found *= (left + stayed) / left;
                } else {
                    // The rest is what the environment is there.
                    bool fits = isInside && !isAlone && !light.total && leaving > 0.0;
                    found += throughput * LookTowards(fits ? leaves : stays, area, inAll, dither);
                }
                radiance += found;
                break;
            }
            if (ABSORPTION) throughput *= Transmittance(material.absorption, exit.distance);
            origin += exit.distance * stays;
            at = exit.triangle;
            wi = -stays;
            side = -1.0;
            seen.normal = -NormalOf(instance, exit);
            isInside = true;
            isGuess = isGuess || !exit.met;
            if (seen.isRough) u = Point(Sequence(point, shift.z), depth);
        }
    }
    if (isBehind) radiance *= place.scale;
    if (ABSORPTION && isBehind && !seen.isPane) radiance *= Transmittance(material.absorption, hit.t * length(ray));
    if (DIRECT_LIGHT && !isBehind) radiance += float(count) * Highlights(material, hit, view);
    outRadiance = vec4(radiance, float(interfaces)) / float(count);
}
