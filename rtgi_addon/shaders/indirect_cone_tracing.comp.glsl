#include "include/irradiance_cone_tracing.glsl"
#include "include/indirect_frame.glsl"
