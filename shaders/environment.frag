#version 460
// The environment where the camera sees it directly.
#extension GL_GOOGLE_include_directive : require
#include "camera.glsl"
#include "environment.glsl"

layout(location = 0) out vec4 outRadiance;

void main()
{
    vec3 radiance = frame.environmentVisible != 0 ? SampleEnvironment(normalize(CameraRay(gl_FragCoord.xy + jitter)), 0.0) : vec3(0.0);
    outRadiance = vec4(radiance, 0.0); // no interface
}
