#version 460
// The model `path`, with rays traced by the traversal in trace_software.glsl.
#extension GL_GOOGLE_include_directive : require
#include "path.glsl"
