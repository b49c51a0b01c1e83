// A mean that grows value by value, and how far the values are from it: B. P. Welford, "Note on a Method for Calculating Corrected Sums of
// Squares and Products", Technometrics 1962.
#ifndef WELFORD_GLSL
#define WELFORD_GLSL

struct Moments {
    vec3 mean;
    vec3 squares;  // the sum of squared differences from the mean
};

// `before` is of `count` values.
Moments WithOneMore(Moments before, uint count, vec3 value)
{
    vec3 mean = before.mean + (value - before.mean) / float(count + 1);
    return Moments(mean, before.squares + (value - before.mean) * (value - mean));
}

#endif
