#version 460
// Rays inside of closed bodies, by the device's ray queries.
#extension GL_GOOGLE_include_directive : require
#define TRACE_HARDWARE
#include "probe_chain.glsl"
