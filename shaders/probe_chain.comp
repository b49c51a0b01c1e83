#version 460
// Rays inside of closed bodies, by the traversal in trace_software.glsl.
#extension GL_GOOGLE_include_directive : require
#include "probe_chain.glsl"
