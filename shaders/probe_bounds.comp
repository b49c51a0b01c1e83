#version 460

// Writes into a buffer at an index that the caller names: beyond its end, to see whether that is noticed.

layout(local_size_x = 1) in;

layout(std430, set = 0, binding = 0) buffer Values { uint values[]; };

layout(push_constant) uniform Push { uint index; };

void main() {
    values[index] = index;
}
