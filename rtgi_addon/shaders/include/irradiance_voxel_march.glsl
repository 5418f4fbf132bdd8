// Irradiance by rays through lit voxels, drawn in proportion to the cosine (techniques/voxel_march.py, MarchField.gather).
#include "include/hash.glsl"
#include "include/voxels.glsl"
#include "include/voxel_sky.glsl"

// Of receivers in a grid, at a place in its cells.
vec3 grid_irradiance(int grid, vec3 start, vec3 position_world, vec3 normal_world)
{
  // The same rays for the same place, whoever else is asked about.
  uint state = HASH_START;
  for (int axis = 0; axis < 3; axis++) {
    state = hash_with(state, floatBitsToUint(position_world[axis]));
  }
  for (int axis = 0; axis < 3; axis++) {
    state = hash_with(state, floatBitsToUint(normal_world[axis]));
  }
  vec2 shift = vec2(0.0);
  for (int axis = 0; axis < 2; axis++) {
    uint number = hash_with(hash_with(hash_with(state, uint(axis)), indirect.seed), MARCH_STREAM);
    shift[axis] = float(number >> 8) * exp2(-24.0);
  }
  vec3 sum = vec3(0.0);
  for (int index = 0; index < indirect.rays; index++) {
    vec2 u = fract(list_texel(voxel_numbers, index, 1, 0).xy + shift);
    // A concentric map of the square to the disk, lifted to the hemisphere (numerics/sampling.py, cosine_hemisphere).
    vec2 offset = 2.0 * u - 1.0;
    bool wide = abs(offset.x) > abs(offset.y);
    float radius = wide ? offset.x : offset.y;
    float ratio = wide ? offset.y / offset.x : (offset.y == 0.0 ? 0.0 : offset.x / offset.y);
    float angle = wide ? 0.78539816 * ratio : 1.57079633 - 0.78539816 * ratio;
    vec2 disk = radius * vec2(cos(angle), sin(angle));
    vec3 local = vec3(disk, sqrt(max(0.0, 1.0 - dot(disk, disk))));
    VoxelRay ray = VoxelRay(grid, start, voxel_about(normal_world, local), normal_world, true);
    VoxelsSeen seen = voxel_march_on(ray, indirect.first_hit);
    sum += seen.radiance + (seen.passed > 0.0 ? seen.passed * voxel_beyond(ray, 0.0) : vec3(0.0));
  }
  return 3.14159265 * sum / float(indirect.rays) + voxel_bright_sky(grid, start, normal_world);
}

#include "include/irradiance_grids.glsl"
