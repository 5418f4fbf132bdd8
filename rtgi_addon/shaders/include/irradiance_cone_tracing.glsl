// Irradiance by cones through lit voxels (transport/voxels/cones.py, irradiance), of all or those of a receiver's turn for all.
#include "include/hash.glsl"
#include "include/voxel_cones.glsl"
#include "include/voxel_sky.glsl"

// Of receivers in a grid, at a place in its cells.
vec3 grid_irradiance(int grid, vec3 start, vec3 position_world, vec3 normal_world)
{
  vec3 sum = vec3(0.0);
  int turn = 0;
  if (indirect.stride > 1) {
    uint state = hash_with(HASH_START, indirect.seed);
    for (int axis = 0; axis < 3; axis++) {
      state = hash_with(state, floatBitsToUint(position_world[axis]));
    }
    turn = int(state % uint(indirect.stride));
  }
  for (int index = turn; index < VOXEL_CONES; index += indirect.stride) {
    vec4 cone = indirect.cone[index];
    VoxelRay ray = VoxelRay(grid, start, voxel_about(normal_world, cone.xyz), normal_world, true);
    VoxelsSeen seen = voxel_cone(ray, indirect.spread, indirect.step, indirect.near);
    vec3 beyond = seen.passed > 0.0 ? seen.passed * voxel_beyond(ray, indirect.spread) : vec3(0.0);
    sum += 3.14159265 * float(indirect.stride) * cone.w * (seen.radiance + beyond);
  }
  return sum + voxel_bright_sky(grid, start, normal_world);
}

#include "include/irradiance_grids.glsl"
