// What lies at the centre of a pixel: normal, distance, base colour and number of the nearest object. A file that defines TEXTURED
// before its includes looks colours up in images, which only models that trace have.
#ifndef AOV_GLSL
#define AOV_GLSL

#include "camera.glsl"
#include "surface.glsl"
#ifdef TEXTURED
#include "texture.glsl"
#endif

layout(location = 0) flat in uint inTriangle;
layout(location = 0) out vec4 outNormalDepth;
layout(location = 1) out vec4 outAlbedoObject;

void main()
{
    vec3 ray = CameraRay(gl_FragCoord.xy + jitter);
    Instance instance = instances[instanceIndex];
    Hit hit = IntersectCameraRay(instance, inTriangle, ray);
    Material material = materials[instance.material];
    vec3 albedo = material.baseColor;
#ifdef TEXTURED
    Found found = Found(instanceIndex, inTriangle);
    Dressed dressed = DressAt(material, found, hit.weights, mat2(0.0));
    if (dressed.presence < 0.5) discard;
    albedo = dressed.material.baseColor;
    if (NORMAL_MAPS) hit.normal = BumpedNormal(dressed.bump, hit.normal, found, hit.weights);
#endif
    outNormalDepth = vec4(hit.normal, hit.t * length(ray));
    outAlbedoObject = vec4(albedo, instance.number);
}

#endif
