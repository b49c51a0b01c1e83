#version 460
// What lies at the centre of a pixel: normal, distance, base colour and number of the nearest object.
#extension GL_GOOGLE_include_directive : require
#include "camera.glsl"
#include "surface.glsl"

layout(location = 0) flat in uint inTriangle;
layout(location = 0) out vec4 outNormalDepth;
layout(location = 1) out vec4 outAlbedoObject;

void main()
{
    vec3 ray = CameraRay(gl_FragCoord.xy + jitter);
    Instance instance = instances[instanceIndex];
    Hit hit = IntersectCameraRay(instance, inTriangle, ray);
    outNormalDepth = vec4(hit.normal, hit.t * length(ray));
    outAlbedoObject = vec4(materials[instance.material].baseColor, instance.number);
}
