// Cones through the hierarchy of lit voxels (transport/voxels/cones.py, trace_cones).
#include "include/voxels.glsl"

// What a sample finds for each cell's length: optical depth and that times radiance, the share of crossings of sheets and that times
// radiance.
struct ConeSample {
  float depth;
  vec3 glow;
  float share;
  vec3 shown;
};

// Where a sample lies among a level's cells: its array begins with an empty layer, and samples lie at cells' centres.
vec3 cone_place(int grid, int level, vec3 position)
{
  return clamp(voxel_place(grid, level, position) + 0.5, vec3(0.0), vec3(indirect.level[level].xyz - 1));
}

// The lowest of the eight cells that a sample lies between.
ivec3 cone_low(int level, vec3 place)
{
  return min(ivec3(place), indirect.level[level].xyz - 2);
}

// `lod`, or the largest whole number below it for which no level that the next sample from `at` on lies between has cells there that are
// too wide for the walls in them.
float cone_narrow(VoxelRay ray, float at, float step, float lod)
{
  for (int over = min(int(ceil(lod)), VOXEL_LEVELS - 1 - ray.grid); over > 0; over--) {
    if (lod > float(over - 1)) {
      vec3 middle = ray.start + ray.direction * (at + 0.5 * step * exp2(lod));
      int level = ray.grid + over;
      float number = voxel_number(level, cone_low(level, cone_place(ray.grid, level, middle)));
      lod = fract(2.0 * number) > 0.25 ? float(over - 1) : lod;
    }
  }
  return lod;
}

// The least that may answer at a place: where it is beyond a grid, the next one, and between two where both do.
float cone_least(int grid, vec3 position)
{
  float least = 0.0;
  for (int over = 0; grid + over < VOXEL_GRIDS - 1 && least == float(over); over++) {
    least += voxel_outside(grid + over, voxel_place(grid, grid + over, position));
  }
  return least;
}

// Add a level's trilinear sample.
void cone_add(int grid, int level, vec3 position, vec3 direction, float weight, inout ConeSample met)
{
  float size = float(1 << (level - grid));
  vec3 place = cone_place(grid, level, position);
  ivec3 low = cone_low(level, place);
  vec3 part = place - vec3(low);
  if (voxel_number(level, low) == 0.0) {
    return;
  }
  for (int corner = 0; corner < 8; corner++) {
    ivec3 step = ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
    vec3 along = mix(1.0 - part, part, vec3(step));
    float share = along.x * along.y * along.z * weight / size;
    int row = share > 0.0 ? voxel_row(level, low + step) : 0;
    if (row == 0) {
      continue;
    }
    Voxel voxel = voxel_at(row);
    vec3 way = direction * share;
    vec3 crossed = abs(way);
#if VOXEL_GRIDS > 1
    if (voxel.adds && level < VOXEL_GRIDS) {
      // A grid's own cells add for those who are in a finer one, and add what they block.
      voxel.adds = level > grid;
      for (int axis = 0; axis < 3 && voxel.adds; axis++) {
        crossed[axis] *= voxel.depth[axis] > 0.0 ? voxel_taken(voxel.depth[axis]) / voxel.depth[axis] : 1.0;
      }
    }
#endif
    float depth = dot(voxel.depth, crossed);
    vec3 glow = depth > 0.0 ? voxel_glow(row, direction, crossed) : vec3(0.0);
    if (voxel.adds) {
      met.share += depth;
      met.shown += glow;
      continue;
    }
    met.depth += depth;
    met.glow += glow;
    float through = dot(voxel.sheet, way);
    if (through != 0.0) {
      met.share += abs(through);
      met.shown += abs(through) * voxel_shown(row, through);
    }
  }
}

// What a cone sees that is 2·spread as wide as it is long.
VoxelsSeen voxel_cone(VoxelRay ray, float spread, float step, float near)
{
  // How far along the cone one may be for each side of the cells that are read.
  float clear = VOXEL_FAR;
  float reach = near;
  if (ray.surface) {
    vec3 own = abs(ray.normal);
    clear = dot(ray.direction, ray.normal) / (CONE_SUPPORT * (own.x + own.y + own.z));
    reach = max(near, 1.0 / max(clear, 1e-6));
  }
  VoxelsSeen seen = voxel_march(ray, reach, 1.0, 0.0);
  vec2 span = voxel_span(voxel_in(ray, VOXEL_GRIDS - 1)) * float(1 << (VOXEL_GRIDS - 1 - ray.grid));
  float at = max(span.x, seen.at);
  // What a wide cone reads of the outermost cells it reads in part when it has left them.
  float leave = span.y + min(max(spread * span.y, 1.0), clear * max(span.y, 0.0) + 1.0);
  float top = float(VOXEL_LEVELS - 1 - ray.grid);
  float sheet = 1.0;
  float level = 0.0;
  // Steps are no shorter than their share of a cell.
  int most = int(min((leave - at) / step, 65536.0)) + 2;
  for (int count = 0; count < most && at < leave - 1e-5 && seen.passed > VOXEL_SPENT; count++) {
    // What is read between cells is twice as wide as they are.
    float lod = log2(max(spread * at, 1.0));
    // Both levels that a sample lies between keep off.
    lod = min(min(lod, floor(log2(max(clear * at, 1.0)))), top);
    // A sheet lies in other places on other levels, so it is crossed on one.
    level = cone_narrow(ray, at, step, sheet < 1.0 ? level : lod);
#if VOXEL_GRIDS > 1
    level = max(level, cone_least(ray.grid, ray.start + ray.direction * at));
#endif
    lod = level;
    float way = min(step * exp2(lod), leave - at);
    vec3 middle = ray.start + ray.direction * (at + 0.5 * way);
    int lower = min(int(lod), VOXEL_LEVELS - 1 - ray.grid);
    float blend = lod - float(lower);
    ConeSample met = ConeSample(0.0, vec3(0.0), 0.0, vec3(0.0));
    lower += ray.grid;
    cone_add(ray.grid, lower, middle, ray.direction, 1.0 - blend, met);
    if (blend > 0.0 && lower + 1 < VOXEL_LEVELS) {
      cone_add(ray.grid, lower + 1, middle, ray.direction, blend, met);
    }
    // Shares of one sheet add up, all else multiplies.
    float crossed = CONE_TIGHT * met.share * way;
    float cut = min(crossed / max(sheet, 1e-6), 1.0);
    sheet = crossed > 0.0 ? sheet - crossed : 1.0;
    float taken = voxel_taken(met.depth * way);
    float of_sheet = cut * (1.0 - 0.5 * taken);
    float of_rest = taken * (1.0 - 0.5 * cut);
    vec3 light = vec3(0.0);
    light += met.share > 0.0 ? of_sheet / met.share * met.shown : vec3(0.0);
    light += met.depth > 0.0 ? of_rest / met.depth * met.glow : vec3(0.0);
    seen.radiance += seen.passed * light;
    seen.passed *= (1.0 - taken) * (1.0 - cut);
    at += way;
  }
  seen.passed = seen.passed <= VOXEL_SPENT ? 0.0 : seen.passed;
  seen.at = at;
  return seen;
}
