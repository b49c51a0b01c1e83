#version 460
// Light of opaque surfaces, with rays traced by the device's ray queries.
#extension GL_GOOGLE_include_directive : require
#define TRACE_HARDWARE
#include "lights.glsl"
