// Irradiance from nested light propagation volumes whose atlases share textures, finest first; each gives way to the next one over
// its outermost cells (techniques/lpv/cascades.py, shares).
#include "include/lpv.glsl"

// From cascade `first` on.
vec3 lpv_cascades_irradiance(vec3 position_world, vec3 normal_world, int first, bool dampening)
{
  vec3 sum = vec3(0.0);
  float left = 1.0;
  for (int level = first; level < LPV_CASCADES; level++) {
    ivec4 shape = indirect.resolution[level];
    vec3 cells = (position_world - indirect.corner[level].xyz) / indirect.corner[level].w;
    vec3 depth = min(cells, vec3(shape.xyz) - cells);
    float covered = clamp(min(depth.x, min(depth.y, depth.z)) / indirect.blend_cells, 0.0, 1.0);
    float share = level == LPV_CASCADES - 1 ? left : left * covered;
    left *= 1.0 - covered;
    if (share > 0.0) {
      LpvVolume volume = LpvVolume(shape.xyz, shape.w, ivec2(0, int(indirect.factors[level].z)), indirect.factors[level].x,
                                   indirect.factors[level].y, indirect.surface_cells, dampening);
      sum += share * lpv_irradiance(volume, cells, normal_world);
    }
  }
  return sum;
}

vec3 indirect_irradiance(vec3 position_world, vec3 normal_world)
{
  return lpv_cascades_irradiance(position_world, normal_world, 0, indirect.dampening != 0);
}
