// Which cell of a volume a surface stands before, and which cells around it are open to that one (techniques/lpv/standing.py, which
// derives it). Positions are in cells from the volume's corner: cell i reaches from i to i + 1.
#include "include/volume.glsl"

// Where a volume's faces stand in a texture of two halves side by side: what the faces above a cell along x, y and z let through;
// and where, in cells above the face's plane, surfaces cross there.
struct Walls {
  ivec3 resolution;
  int columns;
  ivec2 first_texel;
};

// A cell's centre is before a plane from so many cells on, and may lie behind a curved surface up to the second.
const float BEFORE_CELLS = 1e-3;
const float HARDLY_BEFORE = 0.05;
// Below this share let through, a face is a wall with two sides.
const float WALL = 0.5;
// The cell that a surface stands before counts at least this much.
const float LEAST_SHARE = 1e-4;

ivec3 eighth(int corner)
{
  return ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
}

float trilinear_weight(ivec3 step, vec3 fraction)
{
  vec3 along = mix(1.0 - fraction, fraction, vec3(step));
  return along.x * along.y * along.z;
}

// What the face above `cell` along an axis lets through, and where it is crossed; outside the volume faces are open.
vec2 wall_at(sampler2D face_texels, Walls around, ivec3 cell, int axis)
{
  if (!is_inside(cell, around.resolution)) {
    return vec2(1.0, 0.0);
  }
  ivec2 texel = around.first_texel + atlas_texel(cell, around.resolution, around.columns);
  ivec2 half_width = ivec2(textureSize(face_texels, 0).x / 2, 0);
  return vec2(texelFetch(face_texels, texel, 0)[axis], texelFetch(face_texels, texel + half_width, 0)[axis]);
}

float height_of(ivec3 cell, vec3 base, vec3 normal)
{
  return dot(vec3(cell) + 0.5 - base, normal);
}

// Of the eight cells from `low` to the next along each axis, `fraction` of the way between their centres.
ivec3 standing_cell(sampler2D face_texels, Walls around, ivec3 low, vec3 fraction, vec3 base, vec3 normal)
{
  float best = -1.0;
  ivec3 chosen = low;
  for (int corner = 0; corner < 8; corner++) {
    ivec3 cell = low + eighth(corner);
    float weight = trilinear_weight(eighth(corner), fraction);
    if (weight > best && height_of(cell, base, normal) > BEFORE_CELLS) {
      best = weight;
      chosen = cell;
    }
  }
  for (int axis = 0; axis < 3; axis++) {
    int side = 0;
    for (int edge = 0; edge < 4; edge++) {
      ivec3 cell = low;
      cell[(axis + 1) % 3] += edge & 1;
      cell[(axis + 2) % 3] += edge >> 1;
      vec2 wall = wall_at(face_texels, around, cell, axis);
      float above = base[axis] - (float(low[axis]) + 1.0 + wall.y);
      if (wall.x < WALL && abs(above) > BEFORE_CELLS) {
        side += above > 0.0 ? 1 : -1;
      }
    }
    ivec3 moved = chosen;
    if (side != 0) {
      moved[axis] = low[axis] + (side > 0 ? 1 : 0);
    }
    if (height_of(moved, base, normal) > BEFORE_CELLS) {
      chosen = moved;
    }
  }
  // Of two cells before the plane with a wall between them, the nearer one is behind the wall.
  for (int axis = 0; axis < 3; axis++) {
    ivec3 ahead = chosen;
    ivec3 face = chosen;
    ahead[axis] = low[axis] + (normal[axis] > 0.0 ? 1 : 0);
    face[axis] = low[axis];
    if (wall_at(face_texels, around, face, axis).x < WALL && height_of(chosen, base, normal) < HARDLY_BEFORE) {
      chosen = ahead;
    }
  }
  return chosen;
}

// What is let through on the way from a cell to a neighbour: along x, then y, then z.
float open_way(sampler2D face_texels, Walls around, ivec3 start, ivec3 end)
{
  float share = 1.0;
  ivec3 at = start;
  for (int axis = 0; axis < 3; axis++) {
    if (end[axis] != at[axis]) {
      ivec3 face = at;
      face[axis] = min(at[axis], end[axis]);
      share *= wall_at(face_texels, around, face, axis).x;
      at[axis] = end[axis];
    }
  }
  return share;
}
