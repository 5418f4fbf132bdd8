#include "include/irradiance_vpl.glsl"
#include "include/indirect_frame.glsl"
