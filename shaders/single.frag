#version 460
// The original model: each covered pixel shows one interface, lit by the environment and by point lights.
#extension GL_GOOGLE_include_directive : require
#include "camera.glsl"
#include "lighting.glsl"
#include "surface.glsl"

layout(location = 0) flat in uint inTriangle;
layout(location = 0) out vec4 outRadiance;

void main()
{
    vec3 ray = CameraRay(gl_FragCoord.xy + jitter);
    Instance instance = instances[instanceIndex];
    Material material = materials[instance.material];
    Hit hit = IntersectCameraRay(instance, inTriangle, ray);

    SurfaceData data;
    data.normal = hit.normal;
    data.behind = hit.behind;
    data.refractionIndex = material.refractionIndex;
    data.roughness = material.roughness;
    data.albedoTable = material.albedoTable;
    data.reflectionRed = frame.reflectionRed;
    data.reflectionIntensity = frame.reflectionIntensity;
    data.refractionGreen = frame.transmissionGreen;
    data.refractionIntensity = frame.transmissionIntensity;
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    outRadiance = vec4(ComputeLighting(data, -normalize(ray), hit.position, pixel, /* direct */ DIRECT_LIGHT), 1.0);
}
