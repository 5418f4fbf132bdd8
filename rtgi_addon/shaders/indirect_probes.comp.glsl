#include "include/irradiance_probes.glsl"
#include "include/indirect_frame.glsl"
