#version 460
// The mean of all samples as a screen shows it.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "tonemap.glsl"

layout(location = 0) out vec4 outColor;
layout(set = 0, binding = 0) uniform texture2D mean;

layout(push_constant) uniform Push {
    float scale;   // exposure
    uint curve;
};

void main()
{
    vec3 radiance = texelFetch(mean, ivec2(gl_FragCoord.xy), 0).rgb * scale;
    outColor = vec4(EncodeSrgb(ToneCurve(radiance, curve)), 1.0);
}
