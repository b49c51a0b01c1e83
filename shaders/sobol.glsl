// Points of the unit square that fill it evenly, as many and as independent of each other as a path asks for: the first two dimensions
// of Sobol's sequence, shuffled and scrambled anew for each pair. B. Burley, "Practical Hash-based Owen Scrambling", JCGT 2020.
#ifndef SOBOL_GLSL
#define SOBOL_GLSL

#include "sampling.glsl"

// A random permutation of a number's binary fractions, its lowest bit the first digit: each digit is flipped depending on those before
// it. The hash is N. Vegdahl's (2021), after Laine & Karras (2011).
uint ScrambleDigits(uint x, uint seed)
{
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// The second dimension of Sobol's sequence, its lowest bit the first digit: Pascal's triangle modulo 2.
uint PascalDigits(uint index)
{
    index ^= (index & 0xaaaaaaaau) >> 1;
    index ^= (index & 0xccccccccu) >> 2;
    index ^= (index & 0xf0f0f0f0u) >> 4;
    index ^= (index & 0xff00ff00u) >> 8;
    index ^= (index & 0xffff0000u) >> 16;
    return index;
}

// The points of one set of samples: those of equal seed belong together.
struct Sequence {
    uint index;
    uint seed;
};

// Point `pair` of the sequence, in units of 2^-32.
uvec2 PointBits(Sequence sequence, uint pair)
{
    uvec3 seeds = Pcg3d(uvec3(sequence.seed, pair, 0x9e3779b9u));
    // Shuffled as its digits are scrambled: sets of powers of two keep together.
    uint index = bitfieldReverse(ScrambleDigits(bitfieldReverse(sequence.index), seeds.x));
    return bitfieldReverse(uvec2(ScrambleDigits(index, seeds.y), ScrambleDigits(PascalDigits(index), seeds.z)));
}

vec2 Point(Sequence sequence, uint pair)
{
    uvec2 bits = PointBits(sequence, pair);
    return vec2(UnitFloat(bits.x), UnitFloat(bits.y));
}

#endif
