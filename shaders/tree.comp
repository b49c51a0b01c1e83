#version 460
// The model `tree`, with rays traced by the traversal in trace_software.glsl.
#extension GL_GOOGLE_include_directive : require
#include "tree.glsl"
