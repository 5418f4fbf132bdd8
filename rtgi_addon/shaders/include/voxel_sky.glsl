// What lies beyond the grid of voxels (techniques/voxels/field.py, VoxelField.beyond): the smooth sky, as far as no surface outside the
// grid hides it, and its bright patches, towards which voxels are asked instead of triangles.
#include "include/voxels.glsl"
#include "include/world.glsl"

// Direction `local` about +z turned to lie about `normal` (numerics/sampling.py, about).
vec3 voxel_about(vec3 normal, vec3 local)
{
  float sign = normal.z < 0.0 ? -1.0 : 1.0;
  float a = -1.0 / (sign + normal.z);
  float b = normal.x * normal.y * a;
  vec3 tangent = vec3(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x);
  vec3 bitangent = vec3(b, sign + normal.y * normal.y * a, -normal.y);
  return tangent * local.x + bitangent * local.y + normal * local.z;
}

// What surfaces outside the grid leave of the sky where a ray leaves it.
float voxel_open(VoxelRay ray)
{
  if (indirect.hidden.x == 0) {
    return 1.0;
  }
  ray = voxel_in(ray, VOXEL_GRIDS - 1);
  vec3 size = vec3(indirect.level[ray.grid].xyz - 2);
  float leave = clamp(voxel_span(ray).y, 0.0, VOXEL_FAR);
  vec3 place = clamp((ray.start + ray.direction * (leave < VOXEL_FAR ? leave : 0.0)) / size, vec3(0.0), vec3(1.0));
  // The side that is nearest, its patch, and the direction as octahedral coordinates.
  vec3 off = min(place, 1.0 - place) * size;
  int axis = off.x <= off.y && off.x <= off.z ? 0 : (off.y <= off.z ? 1 : 2);
  ivec2 tile = min(ivec2(vec2(place[(axis + 1) % 3], place[(axis + 2) % 3]) * float(indirect.hidden.x)), ivec2(indirect.hidden.x - 1));
  int side = 2 * axis + (place[axis] > 0.5 ? 1 : 0);
  int first = ((side * indirect.hidden.x + tile.y) * indirect.hidden.x + tile.x) * indirect.hidden.y * indirect.hidden.y;
  vec3 d = ray.direction / (abs(ray.direction.x) + abs(ray.direction.y) + abs(ray.direction.z));
  vec2 folded = (1.0 - abs(d.yx)) * vec2(d.x < 0.0 ? -1.0 : 1.0, d.y < 0.0 ? -1.0 : 1.0);
  vec2 square = (d.z < 0.0 ? folded : d.xy) * 0.5 + 0.5;
  float last = float(indirect.hidden.y - 1);
  vec2 position = clamp(square * float(indirect.hidden.y) - 0.5, vec2(0.0), vec2(last));
  ivec2 low = min(ivec2(position), ivec2(indirect.hidden.y - 2));
  vec2 f = position - vec2(low);
  int item = first + low.y * indirect.hidden.y + low.x;
  float bottom = mix(list_texel(voxel_hidden, item, 1, 0).x, list_texel(voxel_hidden, item + 1, 1, 0).x, f.x);
  item += indirect.hidden.y;
  float top = mix(list_texel(voxel_hidden, item, 1, 0).x, list_texel(voxel_hidden, item + 1, 1, 0).x, f.x);
  return mix(bottom, top, f.y);
}

// Radiance of the sky about the ray, `spread` to all sides.
vec3 voxel_beyond(VoxelRay ray, float spread)
{
  if (indirect.sky.x == 0) {
    return vec3(0.0);
  }
  mat3 turn = mat3(indirect.map_from_world);
  vec3 radiance = world_radiance(voxel_sky, turn, ray.direction);
  if (indirect.sky.x > 1 && spread > 0.0) {
    float tilt = 0.70710678 * spread;
    for (int index = 0; index < SKY_RING; index++) {
      float angle = 6.28318531 * float(index) / float(SKY_RING);
      radiance += world_radiance(voxel_sky, turn, voxel_about(ray.direction, vec3(tilt * cos(angle), tilt * sin(angle), 1.0)));
    }
    radiance /= float(1 + SKY_RING);
  }
  return radiance * voxel_open(ray);
}

// Irradiance of the sky's bright patches, for those in a grid: (direction, 0), (irradiance of one that faces it, 0) of each sample.
vec3 voxel_bright_sky(int grid, vec3 start, vec3 normal)
{
  vec3 sum = vec3(0.0);
  for (int index = 0; index < indirect.sky.y; index++) {
    VoxelRay ray = VoxelRay(grid, start, list_texel(voxel_bright, index, 2, 0).xyz, normal, true);
    float cosine = dot(ray.direction, normal);
    if (cosine > 0.0) {
      float passed = voxel_march_on(ray, 1.0).passed;
      sum += cosine * passed * (passed > 0.0 ? voxel_open(ray) : 0.0) * list_texel(voxel_bright, index, 2, 1).rgb;
    }
  }
  return sum;
}
