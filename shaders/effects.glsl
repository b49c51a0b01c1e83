// The effects: one specialization constant each, numbered and named as in the table of src/effects.
#ifndef EFFECTS_GLSL
#define EFFECTS_GLSL

layout(constant_id = 0) const bool REFLECTION = true;
layout(constant_id = 1) const bool TRANSMISSION = true;
layout(constant_id = 2) const bool INTERIOR = true;
layout(constant_id = 3) const bool DIRECT_LIGHT = true;
layout(constant_id = 4) const bool SHADOWS = true;
layout(constant_id = 5) const bool ROUGHNESS = true;
layout(constant_id = 6) const bool ENERGY_COMPENSATION = true;
layout(constant_id = 7) const bool ABSORPTION = true;
layout(constant_id = 8) const bool DISPERSION = true;
layout(constant_id = 9) const bool NESTING = true;
layout(constant_id = 10) const bool THIN_WALLED = true;
layout(constant_id = 11) const bool OPAQUE = true;
layout(constant_id = 12) const bool TEXTURES = true;
layout(constant_id = 13) const bool NORMAL_MAPS = true;
layout(constant_id = 14) const bool CUTOUTS = true;
layout(constant_id = 15) const bool COATINGS = true;

#endif
