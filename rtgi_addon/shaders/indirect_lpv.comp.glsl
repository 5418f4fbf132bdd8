#include "include/irradiance_lpv.glsl"
#include "include/indirect_frame.glsl"
