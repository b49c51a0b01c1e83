// Numbers that several files need.
#ifndef CONSTANTS_GLSL
#define CONSTANTS_GLSL

const float PI = 3.14159265358979;
const float LARGEST_FLOAT = 3.4028235e38;
const float LAST_BELOW_ONE = 0.99999994; // 1 - 2^-24

// Up to the original's default a surface is smooth: its highlights are narrower than a pixel, and nothing else differs.
const float SMOOTH_ROUGHNESS = 0.01;

float Largest(vec3 v) { return max(max(v.x, v.y), v.z); }

#endif
