#version 460
// One optics function at many inputs, for `vitrum numerics`. FUNCTION is a row of the table in src/numerics/functions.rs; inputs and
// outputs are packed as that row lists them.
#extension GL_GOOGLE_include_directive : require
#include "medium.glsl"
#include "offset.glsl"
#include "rough.glsl"

// Constants of single shaders start at 128.
layout(constant_id = 128) const uint FUNCTION = 0;

const uint FRESNEL = 0;
const uint REFRACT = 1;
const uint ROUGH_EVAL = 2;
const uint ROUGH_SAMPLE = 3;
const uint ORIGINAL_FRESNEL = 4;
const uint DISTRIBUTION = 5;
const uint MASKING = 6;
const uint VISIBLE_NORMAL = 7;
const uint TRANSMITTANCE = 8;
const uint DISPERSED_INDEX = 9;
const uint OFFSET_ORIGIN = 10;
const uint FRESNEL_TRANSMITTANCE = 11;
const uint REFRACT_ABOUT = 12;
const uint BASIS = 13;

layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 0) readonly buffer InputBuffer { float inputs[]; };
layout(std430, set = 0, binding = 1) writeonly buffer OutputBuffer { float outputs[]; };

layout(push_constant) uniform Push { uint count; };

uint nextInput;
uint nextOutput;

float Take() { return inputs[nextInput++]; }
vec3 Take3() { float x = Take(); float y = Take(); return vec3(x, y, Take()); }
void Put(float value) { outputs[nextOutput++] = value; }
void Put(vec3 value) { Put(value.x); Put(value.y); Put(value.z); }

void Open(uint i, uint inputCount, uint outputCount)
{
    nextInput = i * inputCount;
    nextOutput = i * outputCount;
}

// By its bits: a device may take a number below the least normal one for 0, and 0 has no side.
bool IsNegative(float side) { return floatBitsToUint(side) > 0x80000000u; }

// Indices on the side that light is seen from and beyond: `eta` is the index on the side of -z over that on the side of +z.
vec2 Indices(float side, float eta) { return IsNegative(side) ? vec2(eta, 1.0) : vec2(1.0, eta); }

// The functions take the side of light as +z.
vec3 Upright(vec3 w, float side) { return IsNegative(side) ? vec3(w.xy, -w.z) : w; }

void main()
{
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    switch (FUNCTION) {
    case FRESNEL: {
        Open(i, 2, 3);
        float cosine = Take();
        vec2 eta = Indices(cosine, Take());
        Interface crossed = FresnelDielectric(abs(cosine), eta.x, eta.y);
        Put(crossed.reflectance);
        Put(crossed.cosThetaT);
        Put(crossed.total ? 1.0 : 0.0);
        break;
    }
    case FRESNEL_TRANSMITTANCE: {
        Open(i, 2, 1);
        float cosine = Take();
        vec2 eta = Indices(cosine, Take());
        Put(FresnelDielectric(abs(cosine), eta.x, eta.y).transmittance);
        break;
    }
    case REFRACT: {
        Open(i, 4, 4);
        vec3 wi = Take3();
        vec2 eta = Indices(wi.z, Take());
        Refraction refraction = Refract(Upright(wi, wi.z), vec3(0.0, 0.0, 1.0), eta.x, eta.y);
        Put(Upright(refraction.wt, wi.z));
        Put(refraction.crossed.total ? 1.0 : 0.0);
        break;
    }
    case REFRACT_ABOUT: {
        Open(i, 7, 4);
        vec3 wi = Take3();
        vec3 n = Take3();
        Refraction refraction = Refract(wi, n, 1.0, Take());
        Put(refraction.wt);
        Put(refraction.crossed.total ? 1.0 : 0.0);
        break;
    }
    case BASIS: {
        Open(i, 3, 9);
        mat3 axes = BasisAround(Take3());
        for (int k = 0; k < 3; ++k) Put(axes[k]);
        break;
    }
    case ROUGH_EVAL: {
        Open(i, 8, 2);
        vec3 wi = Take3();
        vec3 wo = Take3();
        float alpha = Take();
        vec2 eta = Indices(wi.z, Take());
        RoughValue found = EvaluateRough(Upright(wi, wi.z), Upright(wo, wi.z), alpha, eta.x, eta.y);
        Put(found.value);
        Put(found.pdf);
        break;
    }
    case ROUGH_SAMPLE: {
        Open(i, 8, 5);
        vec3 wi = Take3();
        float alpha = Take();
        vec2 eta = Indices(wi.z, Take());
        RoughSample found = SampleRough(Upright(wi, wi.z), alpha, eta.x, eta.y, Take3());
        Put(Upright(found.wo, wi.z));
        Put(found.weight);
        Put(found.pdf);
        break;
    }
    case ORIGINAL_FRESNEL: {
        Open(i, 2, 1);
        float cosine = Take();
        Put(FresnelBSDF(cosine, 1.0, Take()));
        break;
    }
    case DISTRIBUTION: {
        Open(i, 4, 1);
        vec3 wm = Take3();
        Put(DistributionGGX(wm.z, SinSquared(wm), Take()));
        break;
    }
    case MASKING: {
        Open(i, 4, 1);
        vec3 w = Take3();
        Put(MaskingGGX(w.z, SinSquared(w), Take()));
        break;
    }
    case VISIBLE_NORMAL: {
        Open(i, 6, 3);
        vec3 wi = Take3();
        float alpha = Take();
        float u1 = Take();
        Put(SampleVisibleNormal(wi, alpha, vec2(u1, Take())));
        break;
    }
    case TRANSMITTANCE: {
        Open(i, 2, 1);
        float absorption = Take();
        Put(Transmittance(vec3(absorption), Take()).x);
        break;
    }
    case DISPERSED_INDEX: {
        Open(i, 3, 1);
        float ior = Take();
        float dispersion = Take();
        Put(DispersedIndex(ior, dispersion, Take()));
        break;
    }
    case OFFSET_ORIGIN: {
        Open(i, 12, 3);
        vec3 position = Take3();
        vec3 error = Take3();
        vec3 n = Take3();
        Put(OffsetRayOrigin(position, error, n, Take3()));
        break;
    }
    }
}
