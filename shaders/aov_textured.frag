#version 460
// The same as aov.frag, of surfaces that images lie on.
#extension GL_GOOGLE_include_directive : require
#define TEXTURED
#include "aov.glsl"
