#include "include/irradiance_rsm.glsl"
#include "include/indirect_frame.glsl"
