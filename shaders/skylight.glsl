// The environment as a light: directions chosen by how bright it is there. src/passes/skylight.rs makes the table.
#ifndef SKYLIGHT_GLSL
#define SKYLIGHT_GLSL

#include "environment.glsl"

// A part of the environment, from an edge of rows and columns to the next.
struct Cell {
    uint other;       // what stands in for it, for as many choices as it is darker than the mean
    float share;      // of the choices that are its own
    float density;    // of directions in it, per steradian
    uint padding;
};

layout(std430, set = 0, binding = 17) readonly buffer CellBuffer {
    uvec2 cellCount;  // columns, rows; 0: the environment is not sampled
    uvec2 cellPadding;
    Cell cells[];
};

struct SkySample {
    vec3 direction;
    float pdf;        // per steradian
};

// `choice`: in units of 2^-32, which cell, and whether it or the other; `u`: where in the cell.
SkySample SampleSky(uvec2 choice, vec2 u)
{
    uint high;
    uint low;
    umulExtended(choice.x, cellCount.x * cellCount.y, high, low);
    uint cell = UnitFloat(choice.y) < cells[high].share ? high : cells[high].other;
    uvec2 place = uvec2(cell % cellCount.x, cell / cellCount.x);
    float angle = ((float(place.x) + u.x) / float(cellCount.x) - frame.environmentTurn) * 2.0 * PI;
    // Evenly by area, which along the columns is by the cosine: as a sum of what is small next to the poles.
    vec2 edges = sin(vec2(place.y, place.y + 1) * (0.5 * PI / float(cellCount.y)));
    float below = 2.0 * mix(edges.x * edges.x, edges.y * edges.y, u.y); // 1 - cosine
    float sine = sqrt(max(below * (2.0 - below), 0.0));
    return SkySample(vec3(sine * sin(angle), 1.0 - below, -sine * cos(angle)), cells[cell].density);
}

float SkyPdf(vec3 direction)
{
    uvec2 place = min(uvec2(EnvironmentPlace(direction) * vec2(cellCount)), cellCount - 1);
    return cells[place.y * cellCount.x + place.x].density;
}

#endif
