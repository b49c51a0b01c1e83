// Error-free transformations: a sum or a product as the pair of what 32 bits hold and what rounding lost; together they are
// exact. Knuth, TAOCP 2, 4.2.2; Dekker 1971. `precise` keeps compilers from rearranging them. Products are split in halves:
// Vulkan lets fma() round twice.
#ifndef COMPENSATED_GLSL
#define COMPENSATED_GLSL

vec2 TwoSum(float a, float b)
{
    precise float sum = a + b;
    precise float second = sum - a;
    precise float error = (a - (sum - second)) + (b - second);
    return vec2(sum, error);
}

// The upper 12 bits of a float: products of two such are exact.
float UpperHalf(float a)
{
    return uintBitsToFloat(floatBitsToUint(a) & 0xfffff000u);
}

vec2 TwoProduct(float a, float b)
{
    precise float product = a * b;
    float upperA = UpperHalf(a);
    float upperB = UpperHalf(b);
    precise float lowerA = a - upperA;
    precise float lowerB = b - upperB;
    precise float error = ((upperA * upperB - product) + upperA * lowerB + lowerA * upperB) + lowerA * lowerB;
    return vec2(product, error);
}

vec2 TwoSquare(float a)
{
    precise float product = a * a;
    float upper = UpperHalf(a);
    precise float lower = a - upper;
    precise float error = ((upper * upper - product) + 2.0 * upper * lower) + lower * lower;
    return vec2(product, error);
}

// The root of a pair, as a pair: one Newton step from the device's own root, which Vulkan lets be off by several ULP.
vec2 RootOfPair(vec2 a)
{
    float root = sqrt(a.x);
    vec2 square = TwoSquare(root);
    precise float rest = ((a.x - square.x) - square.y) + a.y;
    return vec2(root, rest / (2.0 * root));
}

// The quotient of two pairs, as a pair, whatever the device's own division loses.
vec2 QuotientOfPairs(vec2 a, vec2 b)
{
    float quotient = a.x / b.x;
    vec2 product = TwoProduct(quotient, b.x);
    precise float rest = ((a.x - product.x) - product.y) + (a.y - quotient * b.y);
    return vec2(quotient, rest / b.x);
}

#endif
