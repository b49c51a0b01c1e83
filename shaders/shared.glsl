// What the host and the shaders share: struct layouts and bindings. src/gpu/shared.rs mirrors the structs; a test reads
// every member back. Space: world axes with the camera at the origin, so that far-off scenes keep their precision.
#ifndef SHARED_GLSL
#define SHARED_GLSL

struct Frame {
    mat4 viewProjection;       // to clip space, depth reversed: 1 at the near plane, 0 at infinity
    vec3 rayCorner;            // direction through the outer corner of the top left pixel
    uint lightCount;
    vec3 rayRight;             // added for each pixel to the right
    float environmentTurn;     // rotation of the environment in turns
    vec3 rayDown;              // added for each pixel down
    uint environmentVisible;   // 0: black where the camera sees it directly
    vec3 environmentRadiance;  // its constant radiance, or the factor of its image
    float reflectionRed;       // debug controls of the original
    float reflectionIntensity;
    float transmissionGreen;
    float transmissionIntensity;
    uint flippedRatio;
    uint seed;
    uint normals;              // visible normals of a rough surface that each sample of a pixel takes
    uint normalsInAll;         // that all samples of a pixel take; 0: not known beforehand
    uint environmentLevels;    // of the environment's image: halves of halves below it
    uvec2 environmentSize;     // of its first level
    uint maxDepth;             // interfaces in a chain
    float cutoff;              // throughput below which a branch is cut off
    uvec4 cameraBodies;        // ranks of the bodies that the camera is in, as in media.glsl
    float cameraIndex;         // of the medium around it
    uint cameraMedium;         // its material, from 1; 0: none
    float tolerance;           // throughput that a pixel may lose so
    uint firstTangent;         // among the coordinates of texture.glsl
};

struct Instance {
    mat4x3 objectToWorld;
    mat4x3 normalToWorld;      // its last column is unused
    mat4x3 worldToObject;
    uint firstTriangle;
    uint firstVertex;
    uint firstNode;            // of its mesh's hierarchy
    uint material;
    uint smoothNormals;        // 0: normals of the faces
    uint number;               // of the object in the scene file, from 1
    uint rank;                 // where bodies overlap the highest one is there; 0: no body
    uint overlaps;             // 1: its mesh may hold bodies that overlap
};

const uint KIND_DIELECTRIC = 0;
const uint KIND_PANE = 1;      // a thin-walled dielectric
const uint KIND_OPAQUE = 2;

struct Material {
    vec3 absorption;           // per unit of length
    float refractionIndex;     // at 587.6 nm
    vec3 baseColor;            // of a dielectric what light is multiplied by that goes through
    float roughness;
    vec3 emission;
    float metallic;
    vec3 sellmeierStrengths;
    float dispersion;          // 20 / Abbe number; below 0: by Sellmeier's formula
    vec3 sellmeierResonances;  // square micrometres
    float specular;
    uint kind;
    uint albedoTable;          // its first node in the tables of compensation.glsl
    uint albedoTables;         // of every pair of indices that meet at it; 0: none
    uint colorMap;             // images, from 1, as in texture.glsl; 0: none. Multiplied with the base colour
    uint finishMap;            // green with the roughness, blue with what is metal
    uint emissionMap;
    uint transmissionMap;      // red
    uint normalMap;
    uint alphaMap;
    float normalScale;
    float alphaCutoff;         // there from this alpha on; below 0: as often as alpha says
    float alpha;
    float shines;              // luminance of the mean of what it sends out
    float head;                // what a dielectric reflects head on
    float transmission;        // the share of a dielectric that lets light through, where it is no metal
    uint padding;
};

struct Light {
    vec3 position;
    float coneScale;           // how strong it is, squared: the cosine with its axis times this plus coneOffset, 0 to 1
    vec3 intensity;            // W/sr, of a spot along its axis
    float coneOffset;          // 1, with a scale of 0: everywhere alike
    vec3 axis;                 // of a spot, the direction of its light
};

layout(std430, set = 0, binding = 0) readonly buffer FrameBuffer { Frame frame; };
layout(std430, set = 0, binding = 1) readonly buffer InstanceBuffer { Instance instances[]; };
layout(std430, set = 0, binding = 2) readonly buffer MaterialBuffer { Material materials[]; };
layout(std430, set = 0, binding = 3) readonly buffer LightBuffer { Light lights[]; };
layout(std430, set = 0, binding = 4) readonly buffer PositionBuffer { float positions[]; };
layout(std430, set = 0, binding = 5) readonly buffer NormalBuffer { float normals[]; };
layout(std430, set = 0, binding = 6) readonly buffer TriangleBuffer { uint triangles[]; };
layout(set = 0, binding = 7) uniform texture2D environment;
layout(std430, set = 0, binding = 8) readonly buffer AlbedoBuffer { float albedos[]; };

layout(push_constant) uniform Push {
    vec2 jitter;               // of this sample inside the pixel, in pixels from its centre
    vec2 clipOffset;           // the same in clip space
    uint instanceIndex;
    uint sampleIndex;
    uint firstRow;             // of the rows that are traced
    uint wavelengths;          // that a sample takes
    float footprint;           // how wide its share of a pixel is, 0 to 1
    uint samplesInBatch;       // that a pixel takes at once
    uint firstColumn;          // of those that are traced
    uint pushPadding;
    vec4 spectrum[4];          // of each its colour, and nanometres
};

#endif
