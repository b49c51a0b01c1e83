#version 460
// Which triangle of an instance covers a pixel, counted from 1.
layout(location = 0) flat in uint inTriangle;
layout(location = 0) out uint outTriangle;

void main()
{
    outTriangle = inTriangle + 1;
}
