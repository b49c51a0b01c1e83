#version 460
// What rays meet, by the traversal in trace_software.glsl.
#extension GL_GOOGLE_include_directive : require
#include "probe_trace.glsl"
