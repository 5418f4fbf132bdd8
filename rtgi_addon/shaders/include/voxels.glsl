// Lit voxels and what is met on the way through them (transport/voxels/rays.py, march). Needs the samplers voxel_rows, voxel_cells and
// voxel_light and the uniforms `indirect` of preview/indirect/voxels.py, which say what is in them. The first VOXEL_GRIDS of VOXEL_LEVELS
// levels are nested grids (transport/voxels/cascades.py), those after them filtered from the last; who is in one of the grids begins at
// its own level, and lengths are in its cells.
#include "include/list.glsl"

#define VOXEL_CELL_TEXELS 3
#define VOXEL_LIGHT_TEXELS 8
// Where an axis is not moved along, and what nothing reaches.
#define VOXEL_FAR 1e30

// What was met: `passed` is the share that is left of what lies behind, `at` how far it came.
struct VoxelsSeen {
  vec3 radiance;
  float passed;
  float at;
};

// A ray or a cone's axis in the cells of a grid. `surface` says that it leaves one with this normal.
struct VoxelRay {
  int grid;
  vec3 start;
  vec3 direction;
  vec3 normal;
  bool surface;
};

// What a voxel holds, as Level has it (transport/voxels/hierarchy.py); `plane` may be plates.
struct Voxel {
  vec3 depth;
  bool adds;
  vec3 sheet;
  vec4 plane;
  float filled;
};

// The row in the tables of a cell of a level, whose array begins with an empty layer: 0 for an empty one; and a half if it or one of the
// seven cells up from it is not empty, and a quarter if those are too wide for the walls in them.
float voxel_number(int level, ivec3 padded)
{
  ivec4 shape = indirect.level[level];
  if (any(lessThan(padded, ivec3(0))) || any(greaterThanEqual(padded, shape.xyz))) {
    return 0.0;
  }
  return list_texel(voxel_rows, shape.w + (padded.z * shape.y + padded.y) * shape.x + padded.x, 1, 0).x;
}

int voxel_row(int level, ivec3 padded)
{
  return int(voxel_number(level, padded));
}

Voxel voxel_at(int row)
{
  vec4 depth = list_texel(voxel_cells, row, VOXEL_CELL_TEXELS, 0);
  vec4 sheet = list_texel(voxel_cells, row, VOXEL_CELL_TEXELS, 1);
  return Voxel(depth.xyz, depth.w != 0.0, sheet.xyz, list_texel(voxel_cells, row, VOXEL_CELL_TEXELS, 2), sheet.w);
}

// Optical depth times what the faces show that `direction` looks at, by how much of each axis is crossed.
vec3 voxel_glow(int row, vec3 direction, vec3 crossed)
{
  vec3 glow = vec3(0.0);
  for (int axis = 0; axis < 3; axis++) {
    if (crossed[axis] > 0.0) {
      glow += crossed[axis] * list_texel(voxel_light, row, VOXEL_LIGHT_TEXELS, 2 * axis + (direction[axis] < 0.0 ? 1 : 0)).rgb;
    }
  }
  return glow;
}

// Where a place in the cells of a grid lies in those of a level that is no finer.
vec3 voxel_place(int grid, int level, vec3 place)
{
  place /= float(1 << (level - grid));
#if VOXEL_GRIDS > 1
  place -= (indirect.origin[level].xyz - indirect.origin[grid].xyz) / float(1 << level);
#endif
  return place;
}

// The ray in the cells of a grid that is no finer.
VoxelRay voxel_in(VoxelRay ray, int grid)
{
  ray.start = voxel_place(ray.grid, grid, ray.start);
  ray.grid = grid;
  return ray;
}

// How far a place in the cells of a grid is on the way out of it: 0 within, 1 where the next one answers alone.
float voxel_outside(int grid, vec3 place)
{
  vec3 inward = min(place, vec3(indirect.level[grid].xyz - 2) - place);
  return clamp((VOXEL_EDGE + VOXEL_BLEND - min(min(inward.x, inward.y), inward.z)) / VOXEL_BLEND, 0.0, 1.0);
}

// The share that each grid has of what a receiver at a place in the finest cells gets, and what is left for the next ones.
float voxel_share(int grid, vec3 place, inout float left)
{
  if (grid == VOXEL_GRIDS - 1) {
    return left;
  }
  float share = left * (1.0 - voxel_outside(grid, voxel_place(0, grid, place)));
  left -= share;
  return share;
}

// Radiance of a sheet's side.
vec3 voxel_shown(int row, float through)
{
  return list_texel(voxel_light, row, VOXEL_LIGHT_TEXELS, through > 0.0 ? 7 : 6).rgb;
}

// Share of light that an optical depth takes.
float voxel_taken(float depth)
{
  return depth < 1e-3 ? depth * (1.0 - 0.5 * depth) : 1.0 - exp(-depth);
}

// Where the ray enters and leaves the grid; it begins at 0.
vec2 voxel_span(VoxelRay ray)
{
  vec3 high = vec3(indirect.level[ray.grid].xyz - 2);
  vec2 span = vec2(0.0, VOXEL_FAR);
  for (int axis = 0; axis < 3; axis++) {
    float start = ray.start[axis];
    float along = ray.direction[axis];
    if (along == 0.0) {
      // Between the planes all the way, or nowhere.
      span = start >= 0.0 && start < high[axis] ? span : vec2(VOXEL_FAR, -VOXEL_FAR);
      continue;
    }
    float first = -start / along;
    float second = (high[axis] - start) / along;
    span = vec2(max(span.x, min(first, second)), min(span.y, max(first, second)));
  }
  return span;
}

// What the voxel `row` takes (.w) and shows on the part of the ray from `at` to `end`; `place` is where the ray starts from the voxel's
// centre.
vec4 voxel_met(VoxelRay ray, int row, vec3 place, float at, float end)
{
  Voxel voxel = voxel_at(row);
  vec3 way = ray.direction * max(end - at, 0.0);
  vec3 crossed = abs(way);
  // A sheet is met where the ray crosses its plane.
  float before = dot(voxel.plane.xyz, place + ray.direction * at) - voxel.plane.w;
  float through = dot(voxel.plane.xyz, way);
  float after = before + through;
  float cut = min(before, after) < VOXEL_GAP && max(before, after) > -VOXEL_GAP ? max(voxel.filled, 0.0) : 0.0;
  if (voxel.filled < 0.0) {
    // What lies across an axis is met where it lies, and not on the way there.
    vec3 begin = place + ray.direction * at - voxel.plane.xyz;
    vec3 last = begin + way;
    for (int axis = 0; axis < 3; axis++) {
      if (voxel.plane[axis] < VOXEL_NO_PLATE) {
        crossed[axis] = min(begin[axis], last[axis]) < VOXEL_PLATE && max(begin[axis], last[axis]) > -VOXEL_PLATE ? 1.0 : 0.0;
      }
    }
  }
  if (ray.surface) {
    vec3 own = abs(ray.normal);
    if (abs(dot(place, ray.normal)) <= 0.5 * (own.x + own.y + own.z) + VOXEL_TOUCHING) {
      crossed = mix(crossed, vec3(0.0), greaterThan(own, vec3(VOXEL_OWN_AXIS)));
      cut = abs(dot(voxel.plane.xyz, ray.normal)) > VOXEL_OWN_PLANE ? 0.0 : cut;
    }
  }
  float depth = dot(voxel.depth, crossed);
  float blocked = voxel_taken(depth);
  vec3 shown = depth > 0.0 ? voxel_glow(row, ray.direction, crossed) * (blocked / depth) : vec3(0.0);
  // A voxel holds one or the other.
  if (cut > 0.0) {
    shown += cut * voxel_shown(row, through);
  }
  return vec4(shown, blocked + cut);
}

// Cell by cell from `begin` until the ray leaves the grid, or comes to an empty cell after `reach`. `first_hit`: a cell that takes more
// ends it, and shows itself whole; 1 and more let all count for what they cover.
VoxelsSeen voxel_march(VoxelRay ray, float reach, float first_hit, float begin)
{
  vec2 span = voxel_span(ray);
  span.x = max(span.x, begin);
  VoxelsSeen seen = VoxelsSeen(vec3(0.0), 1.0, span.x);
  if (span.y <= span.x) {
    return seen;
  }
  vec3 entry = ray.start + ray.direction * span.x;
  ivec3 last = indirect.level[ray.grid].xyz - 3;
  ivec3 cell = clamp(ivec3(floor(entry)), ivec3(0), last);
  ivec3 step = ivec3(ray.direction.x < 0.0 ? -1 : 1, ray.direction.y < 0.0 ? -1 : 1, ray.direction.z < 0.0 ? -1 : 1);
  for (int axis = 0; axis < 3; axis++) {
    // A ray that starts between two cells is in the one that it goes to.
    cell[axis] -= step[axis] < 0 && entry[axis] == float(cell[axis]) && cell[axis] > 0 ? 1 : 0;
  }
  int most = last.x + last.y + last.z + 3;
  for (int count = 0; count < most; count++) {
    vec3 ahead = vec3(VOXEL_FAR);
    for (int axis = 0; axis < 3; axis++) {
      if (ray.direction[axis] != 0.0) {
        ahead[axis] = (float(cell[axis] + max(step[axis], 0)) - ray.start[axis]) / ray.direction[axis];
      }
    }
    int axis = ahead.x <= ahead.y && ahead.x <= ahead.z ? 0 : (ahead.y <= ahead.z ? 1 : 2);
    float end = min(ahead[axis], span.y);
    int row = voxel_row(ray.grid, cell + 1);
    if (row > 0) {
      vec4 met = voxel_met(ray, row, ray.start - (vec3(cell) + 0.5), seen.at, end);
      if (first_hit < 1.0) {
        met = met.w > first_hit ? vec4(met.rgb / met.w, 1.0) : vec4(0.0);
      }
      seen.radiance += seen.passed * met.rgb;
      seen.passed *= 1.0 - met.w;
    }
    seen.at = end;
    cell[axis] += step[axis];
    if (end >= span.y || seen.passed <= VOXEL_SPENT || (end >= reach && voxel_row(ray.grid, cell + 1) == 0)) {
      break;
    }
  }
  seen.passed = seen.passed <= VOXEL_SPENT ? 0.0 : seen.passed;
  return seen;
}

// Through one grid after the other that the ray comes into, until it leaves the last.
VoxelsSeen voxel_march_on(VoxelRay ray, float first_hit)
{
  VoxelsSeen seen = voxel_march(ray, VOXEL_FAR, first_hit, 0.0);
  for (int grid = ray.grid + 1; grid < VOXEL_GRIDS && seen.passed > 0.0; grid++) {
    ray = voxel_in(ray, grid);
    VoxelsSeen on = voxel_march(ray, VOXEL_FAR, first_hit, 0.5 * seen.at);
    seen = VoxelsSeen(seen.radiance + seen.passed * on.radiance, seen.passed * on.passed, on.at);
  }
  return seen;
}
