// How bright a light without extent is: KHR_lights_punctual.
#ifndef SPOT_GLSL
#define SPOT_GLSL

#include "shared.glsl"

// Radiant intensity along `direction`, away from the light.
vec3 IntensityAlong(vec3 direction, Light light)
{
    float falloff = clamp(dot(light.axis, direction) * light.coneScale + light.coneOffset, 0.0, 1.0);
    return light.intensity * (falloff * falloff);
}

#endif
