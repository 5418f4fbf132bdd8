#include "include/irradiance_world.glsl"
#include "include/indirect_frame.glsl"
