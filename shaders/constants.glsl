// Numbers that several files need.
#ifndef CONSTANTS_GLSL
#define CONSTANTS_GLSL

const float PI = 3.14159265358979;
const float LARGEST_FLOAT = 3.4028235e38;

#endif
