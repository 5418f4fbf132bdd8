// Irradiance of nested grids of voxels (transport/voxels/cascades.py, by_cascade): at a grid's border it and the next answer by
// shares. What a technique finds in one grid is `vec3 grid_irradiance(int grid, vec3 place, vec3 position_world, vec3 normal_world)`,
// which stands before this.

vec3 indirect_irradiance(vec3 position_world, vec3 normal_world)
{
  vec3 start = (position_world - indirect.corner.xyz) / indirect.corner.w;
  vec3 sum = vec3(0.0);
  float left = 1.0;
  for (int grid = 0; grid < VOXEL_GRIDS && left > 0.0; grid++) {
    float share = voxel_share(grid, start, left);
    if (share > 0.0) {
      sum += share * grid_irradiance(grid, voxel_place(0, grid, start), position_world, normal_world);
    }
  }
  return sum;
}
