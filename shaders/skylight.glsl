// The environment as a light: directions chosen by how bright it is there. src/passes/skylight.rs makes the table.
#ifndef SKYLIGHT_GLSL
#define SKYLIGHT_GLSL

#include "environment.glsl"

// The environment in cells of equal height and width: their shares of the light, added up.
layout(std430, set = 0, binding = 14) readonly buffer SkyBuffer {
    uvec2 cellCount;  // columns, rows; 0: the environment is not looked for
    uvec2 cellPadding;
    float shares[];   // up to each row and the end of the last one; then of each row the same up to each column
};

struct SkySample {
    vec3 direction;
    float pdf;        // per steradian
};

// The last of `count` parts that starts at `u` or before; `first` is the place of the first one's start.
uint PartAt(uint first, uint count, float u)
{
    uint low = 0;
    uint high = count;
    while (high - low > 1) {
        uint middle = (low + high) / 2;
        if (shares[first + middle] <= u) low = middle; else high = middle;
    }
    return low;
}

uint FirstOfRow(uint row)
{
    return cellCount.y + 1 + row * (cellCount.x + 1);
}

// Cosines of the angles to +y, from 1 down, as what they lack to 1: the sum of what is small next to the poles.
vec2 EdgesOfRow(uint row)
{
    vec2 sines = sin(vec2(row, row + 1) * (0.5 * PI / float(cellCount.y)));
    return 2.0 * sines * sines;
}

float DensityOf(uvec2 cell, vec2 edges)
{
    uint first = FirstOfRow(cell.y) + cell.x;
    float share = (shares[cell.y + 1] - shares[cell.y]) * (shares[first + 1] - shares[first]);
    return share * float(cellCount.x) / (2.0 * PI * (edges.y - edges.x));
}

// Evenly spread `u` make directions as evenly spread as the light allows.
SkySample SampleSky(vec2 u)
{
    uint row = PartAt(0, cellCount.y, u.y);
    uint first = FirstOfRow(row);
    uint column = PartAt(first, cellCount.x, u.x);
    vec2 start = vec2(shares[first + column], shares[row]);
    vec2 size = vec2(shares[first + column + 1], shares[row + 1]) - start;
    vec2 within = clamp((u - start) / max(size, 1e-20), 0.0, 1.0);
    float angle = ((float(column) + within.x) / float(cellCount.x) - frame.environmentTurn) * 2.0 * PI;
    vec2 edges = EdgesOfRow(row);
    float below = mix(edges.x, edges.y, within.y);
    float sine = sqrt(max(below * (2.0 - below), 0.0));
    vec3 direction = vec3(sine * sin(angle), 1.0 - below, -sine * cos(angle));
    return SkySample(direction, DensityOf(uvec2(column, row), edges));
}

float SkyPdf(vec3 direction)
{
    uvec2 cell = min(uvec2(EnvironmentPlace(direction) * vec2(cellCount)), cellCount - 1);
    return DensityOf(cell, EdgesOfRow(cell.y));
}

#endif
