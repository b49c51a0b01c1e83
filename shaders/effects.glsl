// The effects: one specialization constant each, numbered and named as in the table of src/effects.rs.
#ifndef EFFECTS_GLSL
#define EFFECTS_GLSL

layout(constant_id = 0) const bool REFLECTION = true;
layout(constant_id = 1) const bool TRANSMISSION = true;
layout(constant_id = 3) const bool DIRECT_LIGHT = true;
layout(constant_id = 5) const bool ROUGHNESS = true;
layout(constant_id = 6) const bool ENERGY_COMPENSATION = true;

#endif
