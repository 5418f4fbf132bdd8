// Lit voxels and what is met on the way through them (transport/voxels/rays.py, march). Needs the samplers voxel_rows, voxel_cells and
// voxel_light and the uniforms `indirect` of preview/indirect/voxels.py, which say what is in them; lengths are in finest cells.
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

// A ray or a cone's axis. `surface` says that it leaves one with this normal.
struct VoxelRay {
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
  vec3 high = vec3(indirect.resolution);
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

// Cell by cell until the ray leaves the grid, or comes to an empty cell after `reach`. `first_hit`: a cell that takes more ends it, and
// shows itself whole; 1 and more let all count for what they cover.
VoxelsSeen voxel_march(VoxelRay ray, float reach, float first_hit)
{
  vec2 span = voxel_span(ray);
  VoxelsSeen seen = VoxelsSeen(vec3(0.0), 1.0, span.x);
  if (span.y <= span.x) {
    return seen;
  }
  vec3 entry = ray.start + ray.direction * span.x;
  ivec3 last = indirect.resolution - 1;
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
    int row = voxel_row(0, cell + 1);
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
    if (end >= span.y || seen.passed <= VOXEL_SPENT || (end >= reach && voxel_row(0, cell + 1) == 0)) {
      break;
    }
  }
  seen.passed = seen.passed <= VOXEL_SPENT ? 0.0 : seen.passed;
  return seen;
}
