#version 460
// Copies every member of every shared struct to a buffer, in the order of their declaration, so that a test can compare
// them with what the host wrote.
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"

layout(local_size_x = 1) in;
layout(std430, set = 0, binding = 9) writeonly buffer OutputBuffer { float members[]; };

uint next = 0;

void Put(float value) { members[next++] = value; }
void Put(uint value) { Put(float(value)); }
void Put(vec2 value) { Put(value.x); Put(value.y); }
void Put(vec3 value) { Put(value.xy); Put(value.z); }
void Put(vec4 value) { Put(value.xyz); Put(value.w); }
void Put(mat4x3 value) { for (int column = 0; column < 4; ++column) Put(value[column]); }
void Put(mat4 value) { for (int column = 0; column < 4; ++column) Put(value[column]); }

void main()
{
    Put(frame.viewProjection);
    Put(frame.rayCorner);
    Put(frame.lightCount);
    Put(frame.rayRight);
    Put(frame.environmentTurn);
    Put(frame.rayDown);
    Put(frame.environmentVisible);
    Put(frame.environmentRadiance);
    Put(frame.reflectionRed);
    Put(frame.reflectionIntensity);
    Put(frame.transmissionGreen);
    Put(frame.transmissionIntensity);
    Put(frame.flippedRatio);
    Put(frame.seed);
    Put(frame.normals);
    Put(frame.normalsInAll);
    Put(frame.environmentLevels);
    Put(vec2(frame.environmentSize));
    Put(frame.maxDepth);
    Put(frame.cutoff);
    Put(vec4(frame.cameraBodies));
    Put(frame.cameraIndex);
    Put(frame.cameraMedium);
    Put(frame.tolerance);
    Put(frame.firstTangent);
    // The second of two, so that the size of the first counts too.
    Put(instances[1].objectToWorld);
    Put(instances[1].normalToWorld);
    Put(instances[1].worldToObject);
    Put(instances[1].firstTriangle);
    Put(instances[1].firstVertex);
    Put(instances[1].firstNode);
    Put(instances[1].material);
    Put(instances[1].smoothNormals);
    Put(instances[1].number);
    Put(instances[1].rank);
    Put(instances[1].overlaps);
    Put(materials[1].absorption);
    Put(materials[1].refractionIndex);
    Put(materials[1].baseColor);
    Put(materials[1].roughness);
    Put(materials[1].emission);
    Put(materials[1].metallic);
    Put(materials[1].sellmeierStrengths);
    Put(materials[1].dispersion);
    Put(materials[1].sellmeierResonances);
    Put(materials[1].specular);
    Put(materials[1].kind);
    Put(materials[1].albedoTable);
    Put(materials[1].albedoTables);
    Put(materials[1].colorMap);
    Put(materials[1].finishMap);
    Put(materials[1].emissionMap);
    Put(materials[1].transmissionMap);
    Put(materials[1].normalMap);
    Put(materials[1].alphaMap);
    Put(materials[1].normalScale);
    Put(materials[1].alphaCutoff);
    Put(materials[1].alpha);
    Put(materials[1].shines);
    Put(materials[1].head);
    Put(materials[1].transmission);
    Put(lights[1].position);
    Put(lights[1].coneScale);
    Put(lights[1].intensity);
    Put(lights[1].coneOffset);
    Put(lights[1].axis);
    Put(positions[1]);
    Put(normals[1]);
    Put(triangles[1]);
    Put(albedos[1]);
    Put(jitter);
    Put(clipOffset);
    Put(instanceIndex);
    Put(sampleIndex);
    Put(firstRow);
    Put(wavelengths);
    Put(footprint);
    Put(samplesInBatch);
    Put(firstColumn);
    for (int i = 0; i < 4; ++i) Put(spectrum[i]);
}
