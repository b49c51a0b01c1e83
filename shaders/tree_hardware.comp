#version 460
// The model `tree`, with rays traced by the device's ray queries.
#extension GL_GOOGLE_include_directive : require
#define TRACE_HARDWARE
#include "tree.glsl"
