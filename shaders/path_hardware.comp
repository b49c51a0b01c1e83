#version 460
// The model `path`, with rays traced by the device's ray queries.
#extension GL_GOOGLE_include_directive : require
#define TRACE_HARDWARE
#include "path.glsl"
