// How a footprint in an image is averaged: as a few look-ups in a row along its longer axis, in a level of the image whose texels are
// about as wide as the shorter one.
#ifndef FILTER_GLSL
#define FILTER_GLSL

struct Row {
    vec2 axis;   // the longer axis: so much of the footprint's first side and of its second
    int count;
    float lod;   // level of the image, from 0; between two levels both are mixed
};

const int LONGEST_ROW = 8;

// Texels of a level, bilinear, are as wide as a box of this many of them: the variances are the same.
const float WIDTH_OF_TEXEL = 1.7320508;

// For a parallelogram: products of its sides with themselves and one with the other, in texels of the first level. A row of at most
// `longest`: shorter ones see more than the parallelogram.
Row RowOver(float firstSquared, float product, float secondSquared, int longest, float lastLevel)
{
    // Eigenvalues of the second moments, and the eigenvector of the larger.
    float middle = 0.5 * (firstSquared + secondSquared);
    float difference = 0.5 * (firstSquared - secondSquared);
    float radius = sqrt(difference * difference + product * product);
    float size = sqrt(middle + radius);
    float width = sqrt(max(middle - radius, 0.0));
    vec2 axis = difference > 0.0 ? vec2(radius + difference, product) : vec2(product, radius - difference);
    float norm = length(axis);
    Row row;
    row.axis = norm > 0.0 ? axis / norm : vec2(1.0, 0.0);
    row.lod = clamp(log2(max(max(width, size / float(longest)), 1e-3) / WIDTH_OF_TEXEL), 0.0, lastLevel);
    row.count = clamp(int(ceil(size / (WIDTH_OF_TEXEL * exp2(row.lod)) - 1e-3)), 1, longest);
    return row;
}

// Place `number` of the row, in lengths of the longer axis from its middle.
float PlaceInRow(Row row, int number)
{
    return (float(number) + 0.5) / float(row.count) - 0.5;
}

#endif
