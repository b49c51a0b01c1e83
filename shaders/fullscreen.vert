#version 460
// One triangle over the whole target, at infinite distance.
void main()
{
    gl_Position = vec4(4.0 * (gl_VertexIndex & 1) - 1.0, 2.0 * (gl_VertexIndex & 2) - 1.0, 0.0, 1.0);
}
