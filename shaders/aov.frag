#version 460
// What lies at the centre of a pixel.
#extension GL_GOOGLE_include_directive : require
#include "aov.glsl"
