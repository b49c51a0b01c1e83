// The pinhole camera: rays from the origin through pixels.
#ifndef CAMERA_GLSL
#define CAMERA_GLSL

#include "shared.glsl"

// Direction (not of unit length) through `pixel`, in pixels from the top left corner of the image.
vec3 CameraRay(vec2 pixel)
{
    return frame.rayCorner + pixel.x * frame.rayRight + pixel.y * frame.rayDown;
}

#endif
