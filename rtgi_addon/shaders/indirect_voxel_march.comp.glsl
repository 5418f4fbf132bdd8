#include "include/irradiance_voxel_march.glsl"
#include "include/indirect_frame.glsl"
