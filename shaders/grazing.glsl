// Interpolated normals bend a surface that stays as it is: what they would send through it grazes it instead.
#ifndef GRAZING_GLSL
#define GRAZING_GLSL

// Slope of that.
const float LEAST_SLOPE = 1e-4;

// `n`, tilted towards the viewer at `w` as far as he has to see its front.
vec3 NormalTowards(vec3 n, vec3 w)
{
    float cosine = dot(n, w);
    return cosine < LEAST_SLOPE ? normalize(n + (LEAST_SLOPE - cosine) * w) : n;
}

// `w`, bent as far as it has to stay on the side of the face normal `n`.
vec3 DirectionAbove(vec3 w, vec3 n)
{
    float slope = dot(w, n);
    return slope < LEAST_SLOPE ? normalize(w + (LEAST_SLOPE - slope) * n) : w;
}

#endif
