#version 460
// Vertices of the forward pass, pulled from the scene's buffers: three for each triangle of one instance.
#extension GL_GOOGLE_include_directive : require
#include "surface.glsl"

layout(location = 0) flat out uint outTriangle;

void main()
{
    Instance instance = instances[instanceIndex];
    outTriangle = gl_VertexIndex / 3;
    vec3 position = FetchPosition(FetchTriangle(instance, outTriangle)[gl_VertexIndex % 3]);
    gl_Position = frame.viewProjection * vec4(instance.objectToWorld * vec4(position, 1.0), 1.0);
    gl_Position.xy += clipOffset * gl_Position.w;
}
