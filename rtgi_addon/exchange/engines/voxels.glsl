// Light by cones through lit voxels, the same in every engine. What stands before says what voxels there are (RTGI_VOXEL_…) and how
// lists of theirs are read.

// Direction `local` about +z turned to lie about `normal` (Duff 2017).
vec3 rtgi_voxel_about(vec3 normal, vec3 local)
{
  float turn = normal.z < 0.0 ? -1.0 : 1.0;
  float a = -1.0 / (turn + normal.z);
  float b = normal.x * normal.y * a;
  vec3 tangent = vec3(1.0 + turn * normal.x * normal.x * a, turn * b, -turn * normal.x);
  vec3 bitangent = vec3(b, turn + normal.y * normal.y * a, -normal.y);
  return tangent * local.x + bitangent * local.y + normal * local.z;
}

// Radiance of the smooth sky: SH of order 2.
vec3 rtgi_voxel_sky(vec3 d)
{
  vec3 sum = RTGI_VOXEL_SKY[0] * 0.28209479 + RTGI_VOXEL_SKY[1] * (0.48860251 * d.y) + RTGI_VOXEL_SKY[2] * (0.48860251 * d.z);
  sum += RTGI_VOXEL_SKY[3] * (0.48860251 * d.x) + RTGI_VOXEL_SKY[4] * (1.09254843 * d.x * d.y);
  sum += RTGI_VOXEL_SKY[5] * (1.09254843 * d.y * d.z) + RTGI_VOXEL_SKY[6] * (0.31539157 * (3.0 * d.z * d.z - 1.0));
  sum += RTGI_VOXEL_SKY[7] * (1.09254843 * d.x * d.z) + RTGI_VOXEL_SKY[8] * (0.54627422 * (d.x * d.x - d.y * d.y));
  return max(sum, vec3(0.0));
}

// What one cone sees, sky and all: from a place in the finest cells, 2·spread as wide as it is long. `surface`: it leaves one with that
// normal.
vec3 rtgi_voxel_seen(vec3 start, vec3 direction, vec3 normal, bool surface, float spread)
{
  vec3 sum = vec3(0.0);
  float left = 1.0;
  for (int grid = 0; grid < RTGI_VOXEL_GRIDS && left > 0.0; grid++) {
    float share = rtgi_voxel_share(grid, start, left);
    if (share > 0.0) {
      RTGIVoxelRay ray = RTGIVoxelRay(grid, rtgi_voxel_place(0, grid, start), direction, normal, surface);
      RTGIVoxelsSeen seen = rtgi_voxel_cone(ray, spread, RTGI_VOXEL_STEP, RTGI_VOXEL_NEAR);
      sum += share * (seen.radiance + (seen.passed > 0.0 ? seen.passed * rtgi_voxel_sky(direction) : vec3(0.0)));
    }
  }
  return sum;
}

// Irradiance [W/m^2] at a place in the finest cells under a unit normal of the voxels' own axes.
vec3 rtgi_voxel_irradiance(vec3 start, vec3 normal)
{
  vec3 sum = vec3(0.0);
  for (int index = 0; index < RTGI_VOXEL_CONES; index++) {
    vec4 local = RTGI_VOXEL_CONE[index];
    sum += 3.14159265 * local.w * rtgi_voxel_seen(start, rtgi_voxel_about(normal, local.xyz), normal, true, RTGI_VOXEL_SPREAD);
  }
  return sum;
}
