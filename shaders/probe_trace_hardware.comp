#version 460
// What rays meet, by the device's ray queries.
#extension GL_GOOGLE_include_directive : require
#define TRACE_HARDWARE
#include "probe_trace.glsl"
