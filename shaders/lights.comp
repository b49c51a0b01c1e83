#version 460
// Light of opaque surfaces, with rays traced by the traversal in trace_software.glsl.
#extension GL_GOOGLE_include_directive : require
#include "lights.glsl"
